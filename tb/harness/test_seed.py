# SPDX-License-Identifier: Apache-2.0
"""SEED of the environment: `random` collects the whole suite, is drawn once for all workers, and
the printed number reproduces it.
"""

import os
import re
import subprocess
import sys

import pytest

from tb import bench

PROBE = """
import os
import random
import pytest
from bench import seed
SEED = seed()

@pytest.mark.parametrize("drawn", [random.Random(SEED).getrandbits(32) for _ in range(4)])
def test_probe(drawn):
    with open(os.environ["PROBE_LOG"], "a") as log:
        log.write(f"{SEED} {seed()} {drawn}\\n")
"""


def pytest_of(*arguments, **environment):
    """Output of another pytest run, and its exit code."""
    inherited = {
        name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")
    }
    result = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments],
        cwd=bench.ROOT,
        env=inherited | environment,
        capture_output=True,
        text=True,
    )
    return result.stdout + result.stderr, result.returncode


def test_the_whole_suite_is_collected_with_a_random_seed():
    output, code = pytest_of("--collect-only", "tb", SEED="random")
    assert code == 0 and not re.search(r"\berrors?\b", output.splitlines()[-1]), output[-2000:]
    assert "test_s0_stage.py" in output and "test_host_cobs.py" in output


@pytest.fixture
def probe(tmp_path):
    """Runs a probe of four parametrised tests on two workers; returns what the workers saw and what
    was printed.
    """
    path, log = tmp_path / "test_probe.py", tmp_path / "log"
    path.write_text(PROBE)

    def run(seed):
        log.unlink(missing_ok=True)
        output, code = pytest_of(
            "-p",
            "conftest",
            "-n",
            "2",
            "--rootdir",
            str(tmp_path),
            str(path),
            SEED=seed,
            PROBE_LOG=str(log),
            PYTHONPATH=str(bench.ROOT / "tb"),
        )
        assert code == 0, output
        return sorted(log.read_text().splitlines()), output

    return run


def test_the_drawn_seed_is_one_for_all_workers_and_reproduces_the_run(probe):
    seen, output = probe("random")
    printed = re.search(r"The same run again: SEED=(\d+)", output).group(1)
    assert len(seen) == 4 and {tuple(line.split()[:2]) for line in seen} == {(printed, printed)}
    assert probe(printed)[0] == seen


def test_without_a_seed_it_is_1(monkeypatch):
    for value in ("", None):
        monkeypatch.setenv("SEED", value) if value is not None else monkeypatch.delenv(
            "SEED", raising=False
        )
        assert bench.seed() == 1


def test_two_draws_differ(monkeypatch):
    drawn = []
    for _ in range(2):
        monkeypatch.setenv("SEED", "random")
        drawn.append(bench.seed())
    assert drawn[0] != drawn[1]
