# SPDX-License-Identifier: Apache-2.0
"""Campaigns lose nothing and repeat nothing, whatever dies; a part that fails is reported with its
seed.
"""

import os
import shutil
import socket
import subprocess
import sys
from collections import Counter
from contextlib import contextmanager
from math import comb
from pathlib import Path

import pytest
import yaml

from campaigns import runner, soak, version
from campaigns.campaign import Campaign, Task, added, chance_of_at_most, upper_bound
from campaigns.pages import is_good, page, parts_words
from campaigns.store import Store
from figures import soak as figure
from figures.common import collected, seeds
from tb.campaigns.parts import TRIED, campaign, kills, runs, wrong
from twin.build import ROOT


def job_of(one, keep, seed=1, parts=None):
    return runner.prepared("some", one, keep, seed, one.parts if parts is None else parts)


def ran(one, keep, client, watch=None, **more):
    """The job of a campaign after a run."""
    job = job_of(one, keep)
    runner.run(client, {"some": job}, keep, watch or runner.Watch(), **more)
    return job


@pytest.fixture
def keep(tmp_path):
    return Store(str(tmp_path / "results"))


# ------------------------------------------------------------------ the interface


def test_no_failure_in_n_trials_gives_the_rule_of_three():
    for tried in (100, 10**5, 10**9):
        assert upper_bound(0, tried) == pytest.approx(3 / tried, rel=0.02)
    assert upper_bound(0, 59) < 0.05 < upper_bound(0, 58)


@pytest.mark.parametrize("failed, tried", [(1, 10), (2, 20), (7, 50), (30, 40), (3, 1000)])
def test_the_bound_is_where_so_few_failures_have_a_chance_of_5_percent(failed, tried):
    share = upper_bound(failed, tried)
    chance = sum(comb(tried, n) * share**n * (1 - share) ** (tried - n) for n in range(failed + 1))
    assert chance == pytest.approx(0.05, rel=1e-6)
    assert chance_of_at_most(failed, tried, share) == pytest.approx(chance, rel=1e-9)


def test_the_bound_of_many_trials_is_that_of_a_poisson_count():
    assert upper_bound(3, 10**9) == pytest.approx(7.7537e-9, rel=1e-3)
    assert upper_bound(5, 5) == upper_bound(0, 0) == 1


def test_every_part_has_a_seed_of_its_own_which_is_that_of_a_run_of_a_figure():
    for seed in (1, 4):
        found = [Task("x", "v", seed, part).part_seed for part in range(20)]
        assert found == list(seeds(seed, 20))


def test_every_campaign_says_what_it_counts_and_has_seeds_enough():
    known = collected("CAMPAIGNS")
    needed = {"decoder", "line", "homing_s3", "guard_axis", "guard_s0", "guard_s2", "guard_s3"}
    assert needed <= set(known)
    for name, one in known.items():
        assert isinstance(one, Campaign) and "; failed: " in one.what, name
        assert 0 < one.parts <= 10**5 and one.parts_of(1e-9) == 1 and one.parts_of(1) == one.parts


def test_the_version_is_that_of_the_content(tmp_path):
    def folder(name, text):
        for one in ("rtl", "sw/fuzz", "tables", "tb"):
            (tmp_path / name / one).mkdir(parents=True)
        (tmp_path / name / "requirements.lock").write_text("")
        shutil.copy(ROOT / ".gitignore", tmp_path / name)
        (tmp_path / name / "rtl" / "axis.sv").write_text(text)
        return tmp_path / name

    first, same, other = folder("a", "module"), folder("b", "module"), folder("c", "modul")
    (same / "sw" / "__pycache__").mkdir()
    (same / "sw" / "__pycache__" / "x.pyc").write_text("made")
    for path in ("sw/host/moire/web/uplot-1.6/integrity", "sw/linuxcnc/moire.so"):
        (same / path).parent.mkdir(parents=True)
        (same / path).write_text("fetched, or made")
    assert version.content(first) == version.content(same) != version.content(other)
    assert version.version().endswith(f"-{version.content()}")


# ------------------------------------------------------------------ results


def test_results_come_back_as_they_were_written(keep):
    task = Task("some", "v", 2, 7)
    result = runner.Result(task, {"trials": 3, "wrong": 1, "input": "a b"}, "here/1", "now", 1.5)
    keep.write(result)
    assert keep.read(task) == result and keep.parts("some", "v", 2) == {7}
    assert keep.read(Task("some", "w", 2, 7)) is None and keep.parts("some", "v", 1) == set()


def test_an_object_store_keeps_results_too():
    keep = Store("memory://moire/results")
    keep.check()
    result = runner.Result(Task("some", "v", 1, 0), {"trials": 3, "wrong": 0}, "h/1", "now", 1.0)
    keep.write(result)
    assert keep.results("some", "v", 1, range(3)) == {0: result}
    assert keep.parts("some", "v", 1) == {0}


def test_a_file_has_its_name_only_when_it_is_whole(keep, monkeypatch):
    def full(path, data):
        with open(path, "wb") as file:
            file.write(data[: len(data) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(keep.files, "pipe_file", full)
    task = Task("some", "v", 1, 0)
    with pytest.raises(OSError):
        keep.write(runner.Result(task, {"trials": 1, "wrong": 0}, "h/1", "now", 1.0))
    assert keep.read(task) is None and keep.parts("some", "v", 1) == set()


# ------------------------------------------------------------------ runs


def test_each_part_runs_once_and_a_second_run_repeats_nothing(keep, tmp_path):
    one = campaign(tmp_path)
    with runner.local(2, processes=False) as client:
        job = ran(one, keep, client)
        assert sorted(runs(tmp_path)) == list(range(5)) and is_good(job)
        again = ran(one, keep, client)
        assert len(runs(tmp_path)) == 5 and again.repeated == 5 and is_good(again)
        torn = Path(keep.path(job.task(3)))
        torn.write_bytes(torn.read_bytes()[:-9])
        third = ran(one, keep, client)
    assert runs(tmp_path)[5:] == [3] and third.repeated == 4 and is_good(third)
    total = added(one, third.results)
    assert total == {"trials": 5 * TRIED, "wrong": 0, "seeds": 15, "largest seed": 5}


def test_a_campaign_that_is_stopped_goes_on_where_it_was(keep, tmp_path):
    one = campaign(tmp_path, parts=30)
    with runner.local(1, processes=False) as client:
        job = job_of(one, keep)
        runner.run(client, {"some": job}, keep, runner.Watch(), lambda: len(runs(tmp_path)) < 3)
        done = len(keep.parts("some", job.version, 1))
        assert 3 <= done < 30 and not is_good(job)
        assert is_good(ran(one, keep, client))
    assert Counter(runs(tmp_path)) == Counter(range(30))


def test_a_killed_worker_loses_nothing(keep, tmp_path):
    one = campaign(tmp_path, kills)
    with runner.local(2) as client:
        job = ran(one, keep, client)
    begun = Counter(runs(tmp_path))
    assert is_good(job) and begun == Counter([0, 1, 2, 2, 3, 4])
    assert added(one, job.results)["trials"] == 5 * TRIED
    names = [path.name for path in Path(keep.url).rglob("*") if path.is_file()]
    assert sorted(names) == [f"part-{n:06}.parquet" for n in range(5)]


def test_a_part_that_ends_every_worker_is_reported_and_the_others_complete(
    keep, tmp_path, monkeypatch
):
    monkeypatch.setitem(runner.SETTINGS, "distributed.scheduler.allowed-failures", 0)
    one = campaign(tmp_path, kills, parts=3, at=1, always=True)
    with runner.local(1) as client:
        job = ran(one, keep, client)
    (failure,) = job.failures.values()
    assert "its worker died" in failure.reason and sorted(job.results) == [0, 2]
    assert failure.task.command == "make soak K=some SEED=1 PART=1" and failure.task.part_seed == 2


def test_a_worker_of_another_version_refuses(keep, tmp_path):
    one = campaign(tmp_path, parts=1)
    job = job_of(one, keep)
    job.version = "abc-0123456789"
    with runner.local(1, processes=False) as client:
        runner.run(client, {"some": job}, keep, runner.Watch())
    assert "give it the same checkout" in job.failures[0].reason and not runs(tmp_path)


class Cluster:
    """A scheduler and a worker as processes of their own, on one address."""

    def __init__(self, folder):
        self.folder, self.processes = folder, []
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"

    def start(self):
        port = self.address.rpartition(":")[2]
        scheduler = self.process("scheduler", "--host", "127.0.0.1", "--port", port)
        (self.folder / "scheduler").write_text(str(scheduler.pid))
        self.process(
            "worker", self.address, "--nthreads", "1", "--no-nanny", "--death-timeout", "60"
        )

    def process(self, *words):
        command = [sys.executable, "-m", "dask", *words, "--no-dashboard"]
        log = open(self.folder / "cluster.log", "a", encoding="utf-8")
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        self.processes.append(
            subprocess.Popen(command, stdout=log, stderr=log, env=environment, cwd=self.folder)
        )
        return self.processes[-1]

    def end(self):
        for process in self.processes:
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path):
    made = Cluster(tmp_path)
    made.start()
    yield made
    made.end()


def test_a_killed_scheduler_loses_nothing(keep, tmp_path, cluster, monkeypatch):
    monkeypatch.setattr(runner, "CONNECT_S", 60)

    class Starts(runner.Watch):
        """Starts the cluster again when it is gone."""

        said = []

        def say(self, sentence):
            self.said.append(sentence)
            cluster.start()

    one = campaign(tmp_path, kills, victim="scheduler")
    with runner.remote(cluster.address) as client:
        job = ran(one, keep, client, Starts())
    begun = Counter(runs(tmp_path))
    assert "is gone" in Starts.said[0] and is_good(job) and set(begun) == set(range(5))
    assert begun[0] == begun[1] == 1, "what was done was done again"


# ------------------------------------------------------------------ the command


@pytest.fixture
def command(monkeypatch, tmp_path):
    """make soak with a campaign of this file on threads; (exit code) of its arguments."""
    threads = runner.local

    @contextmanager
    def local(workers, dashboard=False):
        with threads(workers, processes=False) as client:
            yield client

    monkeypatch.setattr(soak.runner, "local", local)

    def run(one, *arguments):
        monkeypatch.setattr(soak, "collected", lambda attribute: {"some": one})
        return soak.main(["--results", str(tmp_path / "results"), "--workers", "2", *arguments])

    return run


def test_a_part_that_fails_is_shown_with_its_seed_and_the_command_that_repeats_it(
    command, tmp_path, capsys
):
    one = campaign(tmp_path, wrong)
    assert command(one, "--seed", "2") == 1
    shown = capsys.readouterr()
    text = shown.out + shown.err
    again = "the same again: make soak K=some SEED=2 PART=1"
    assert f"part 1 (seed 1000002) has 2 wrong; {again}" in text
    assert "bytes of 1000002" in text
    assert "part 3 (seed 1000004) is not done: ZeroDivisionError: no result" in text
    assert "some: BAD: 2 wrong in 40 trials" in shown.out
    html = Path(shown.out.split("page: ")[1].strip()).read_text()
    assert "make soak K=some SEED=2 PART=1" in html and "bytes of 1000002" in html
    assert version.version() in html and "1000001\N{EN DASH}1000003, 1000005" in html
    assert command(one, "--seed", "2", "--part", "1") == 1
    assert "wrong: 2" in capsys.readouterr().out
    assert command(one, "--seed", "2", "--part", "0") == 0


def test_the_page_of_a_good_campaign_states_what_it_proves(command, tmp_path, capsys):
    one = campaign(tmp_path, parts=30)
    assert command(one) == 0 and "some: good: 0 wrong in 300 trials" in capsys.readouterr().out
    assert command(one) == 0 and "30 parts from before" in capsys.readouterr().out
    keep = Store(str(tmp_path / "results"))
    html = page(job_of(one, keep))
    assert "Good. Trials; failed: wrong ones." in html
    assert "a share below 0.0099 with 95% confidence" in html
    assert "30 of the 30 asked for" in html and "1\N{EN DASH}30" in html
    assert runs(tmp_path) and len(runs(tmp_path)) == 30
    assert "Not complete" in page(job_of(one, keep, seed=2))


def test_a_share_of_the_length_and_an_allowed_share_of_failures(command, tmp_path, capsys):
    assert command(campaign(tmp_path, parts=40), "--scale", "0.05") == 0
    assert sorted(runs(tmp_path)) == [0, 1] and "in 20 trials" in capsys.readouterr().out
    some = Campaign("x; failed: y", lambda part, seed: {"n": 10, "y": 1}, 3, "n", "y", allowed=0.1)
    assert command(some) == 0
    few = Campaign("x; failed: y", lambda part, seed: {"n": 10, "y": 1}, 3, "n", "y", allowed=0.09)
    assert command(few, "--seed", "3") == 1


def test_a_campaign_that_was_stopped_within_its_allowed_share_is_not_called_bad(keep, capsys):
    one_of_ten = lambda part, seed: {"n": 10, "y": int(part == 0)}
    some = Campaign("x; failed: y", one_of_ten, 3, "n", "y", allowed=0.1)
    with runner.local(1, processes=False) as client:
        job = ran(some, keep, client)
    del job.results[2]
    assert soak.conclude({"some": job}, keep) == 0
    assert "some: 1 of 3 parts left: 1 y in 20 n" in capsys.readouterr().out
    assert "Not complete" in page(job)


def refused(command, capsys, *arguments):
    """The sentence with which the command refuses."""
    try:
        code = command(*arguments)
    except SystemExit as end:
        code = end.code
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert code == 2 and error
    return error


def test_bad_input_is_refused_with_one_sentence(command, tmp_path, capsys, monkeypatch):
    one = campaign(tmp_path)
    assert "there is no campaign other: there are some" in refused(command, capsys, one, "other")
    assert "some has the parts 0 to 4" in refused(command, capsys, one, "--part", "5")
    assert "--scale takes a share" in refused(command, capsys, one, "--scale", "0")
    (tmp_path / "file").write_text("")
    below = str(tmp_path / "file" / "results")
    said = refused(command, capsys, one, "--results", below)
    assert said.startswith(f"soak: results cannot be written to {below}: ")
    said = refused(command, capsys, one, "--results", "nonsense://x")
    assert said.startswith("soak: results cannot be kept at nonsense://x: ")
    monkeypatch.setattr(runner, "CONNECT_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    said = refused(command, capsys, one, "--scheduler", address)
    assert said.startswith(f"soak: no Dask scheduler answers at {address}: ") and not runs(tmp_path)
    said = refused(command, capsys, one, "--scheduler", "nonsense")
    assert said.startswith("soak: no Dask scheduler answers at nonsense: ")


def test_numbers_of_parts_are_written_as_ranges():
    assert parts_words([3, 1, 2, 7, 9, 10]) == "1\N{EN DASH}3, 7, 9\N{EN DASH}10"
    assert parts_words([]) == "none"


# ------------------------------------------------------------------ clusters

CLUSTER = ROOT / "sw" / "campaigns" / "cluster"


def test_the_compose_file_runs_programs_of_the_lock_file_and_variables_of_make_soak():
    services = yaml.safe_load((CLUSTER / "compose.yml").read_text())["services"]
    assert set(services) == {"scheduler", "worker", "soak"}
    for service in services.values():
        assert (CLUSTER / service["build"]["context"]).resolve() == ROOT
        assert (ROOT / service["build"]["dockerfile"]).is_file()
    for name in ("scheduler", "worker"):
        *program, kind = services[name]["command"][:4]
        words = [word.partition("=")[0] for word in services[name]["command"][4:]]
        done = subprocess.run(
            [sys.executable, *program[1:], kind, "--help"],
            capture_output=True,
            text=True,
            check=True,
        )
        assert (
            program[0] == "python"
            and kind == name
            and all(w in done.stdout for w in words if w.startswith("--"))
        )
    makefile = (ROOT / "Makefile").read_text()
    assert services["soak"]["command"][:2] == ["make", "soak"]
    names = [word.partition("=")[0] for word in services["soak"]["command"][2:]]
    assert set(names) >= {"SCHEDULER", "RESULTS"}
    assert all(f"$({name})" in makefile for name in names if name != "K")


def test_the_slurm_script_is_a_whole_script():
    script = str(CLUSTER / "slurm.sh")
    done = subprocess.run(["bash", "-n", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert os.access(script, os.X_OK)


def test_the_figure_counts_failures_and_parts_that_are_not_done(tmp_path, monkeypatch):
    monkeypatch.setattr(figure, "collected", lambda attribute: {"some": campaign(tmp_path, wrong)})
    monkeypatch.setattr(figure, "PARTS_IN_SHORT", 5)
    assert figure.soak_failures(("some",)) == 2 + 1
