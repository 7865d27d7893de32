# SPDX-License-Identifier: Apache-2.0
"""The FuseSoC cores of the blocks: what each of them says, and how they are linted and simulated.

    python -m embed.fusesoc [CORE …]      `fusesoc run` of lint and simulation, of these or of all

The core of a module is beside its source, x.core by x.sv, and is made by tables/fusesoc.py. Its
simulation runs the block's own cocotb tests under Icarus, with the parameters of their first
build; a block without such tests has no simulation.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tomllib
import xml.etree.ElementTree
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import IO

from cocotb_tools.config import pygpi_entry_point
from find_libpython import find_libpython

from embed import design, tests_of
from embed.tests_of import Tests
from firmware import build as firmware_build
from twin import build as twin_build
from twin.build import CORES, ROOT, package

RTL = ROOT / "rtl"
BUILD = ROOT / "build" / "fusesoc"
LIBRARY = "moire:rtl"
PACKAGES = "python_package"  # the core whose generator copies sources out of a Python package
WAIVERS = "cores.vlt"  # beside the modules that instantiate foreign ones
STEPS = ("lint", "sim")
LONGEST_S: float = 300  # of one step
TIMESCALE = "1ns/1ps"


@dataclass(frozen=True)
class Core:
    """The FuseSoC core of a module of rtl/."""

    module: str

    @property
    def vlnv(self) -> str:
        """Vendor, library, name and version, as `fusesoc run` takes them."""
        return f"{LIBRARY}:{self.module}:{version()}"

    @property
    def source(self) -> Path:
        return design.file_of(self.module)

    @property
    def file(self) -> Path:
        """The core file."""
        return self.source.with_suffix(".core")

    @cached_property
    def tests(self) -> Tests | None:
        """The cocotb tests that its simulation runs, if there are any."""
        return tests_of.of(self.module)

    @property
    def foreign(self) -> dict[str, list[str]]:
        """{package: files in it} of the foreign modules that this one instantiates."""
        found: dict[str, list[str]] = {}
        for name in design.instances(self.module):
            if name in design.foreign():
                for path in design.files(name):
                    for module, folder in CORES.items():
                        root = package(module, "a soft core")
                        if path.is_relative_to(root / folder):
                            files = found.setdefault(module, [])
                            files.append(path.relative_to(root).as_posix())
        return found


@cache
def version() -> str:
    """The version of the project, which is that of its host package."""
    file = ROOT / "sw" / "host" / "pyproject.toml"
    return str(tomllib.loads(file.read_text(encoding="utf-8"))["project"]["version"])


def cores() -> list[Core]:
    """The cores of all modules below rtl/."""
    return [Core(name) for name, path in design.modules().items() if path.is_relative_to(RTL)]


def named(names: Sequence[str]) -> list[Core]:
    """The cores of these modules, or of all if there are none."""
    known = {core.module: core for core in cores()}
    for name in names:
        if name not in known:
            raise design.DesignError(f"there is no module {name} under rtl/")
    return [known[name] for name in names] or list(known.values())


# What the core files say


def text(value: str) -> str:
    """A string in YAML, for which JSON is enough."""
    return json.dumps(value, ensure_ascii=False)


def purpose(module: str) -> str:
    """The first sentence of the header of a module."""
    words: list[str] = []
    for line in design.source(module).splitlines()[1:]:
        line = line.removeprefix("//").strip()
        words.append(line)
        if not line or line.endswith("."):
            break
    return " ".join(words).partition(" -- ")[2].strip().rstrip(".").split(". ")[0]


def yaml(core: Core) -> Iterator[str]:
    """The lines of a core file."""
    module, waivers = core.module, core.source.parent / WAIVERS
    yield "CAPI=2:"
    yield "# SPDX-License-Identifier: Apache-2.0"
    yield f"# Made by tables/fusesoc.py from {core.source.relative_to(ROOT)}: do not edit."
    yield f"name: {text(core.vlnv)}"
    yield f"description: {text(purpose(module))}"
    yield "filesets:"
    yield "  rtl:"
    yield f"    files: [{core.source.name}]"
    yield "    file_type: systemVerilogSource"
    own = [name for name in design.instances(module) if name in design.modules()]
    needed = [Core(name).vlnv for name in own]
    if core.foreign:
        needed.append(f"{LIBRARY}:{PACKAGES}:{version()}")
    if needed:
        yield "    depend:"
        yield from (f"      - {text(name)}" for name in needed)
    if core.foreign:
        yield "  waivers:"
        yield f"    files: [{waivers.name}]"
        yield "    file_type: vlt"
        yield "generate:"
        for name, files in core.foreign.items():
            yield f"  {name}:"
            yield f"    generator: {PACKAGES}"
            yield "    parameters:"
            yield f"      package: {name}"
            yield "      files:"
            yield from (f"        - {file}" for file in files)
    parameters = design.parameters(module)
    if parameters:
        yield "parameters:"
        for name, one in parameters.items():
            yield f"  {name}:"
            yield f"    datatype: {'str' if one.is_string else 'int'}"
            yield f"    description: {text(one.meaning)}"
            yield "    paramtype: vlogparam"

    def target(name: str, values: Mapping[str, int]) -> Iterator[str]:
        """The lines of a target with these values of parameters."""
        words = [f"{one}={values[one]}" if one in values else one for one in parameters]
        yield f"  {name}:"
        yield f"    filesets: [{'waivers, ' if core.foreign else ''}rtl]"
        yield f"    toplevel: {module}"
        if parameters:
            yield f"    parameters: [{', '.join(words)}]"
        if core.foreign:
            yield f"    generate: [{', '.join(core.foreign)}]"

    yield "targets:"
    yield from target("default", {})
    yield from [*target("lint", {}), "    flow: lint", "    flow_options:"]
    yield "      tool: verilator"
    yield f'      verilator_options: [-Wall, "--timescale {TIMESCALE}"]'
    if core.tests:
        yield from [*target("sim", core.tests.parameters), "    flow: sim", "    flow_options:"]
        yield "      tool: icarus"
        yield "      iverilog_options: [-g2012]"
        yield f"      timescale: {TIMESCALE}"
        yield f"      cocotb_module: {core.tests.module}"


def of_packages() -> Iterator[str]:
    """The lines of the core with the generator."""
    yield "CAPI=2:"
    yield "# SPDX-License-Identifier: Apache-2.0"
    yield "# Made by tables/fusesoc.py: do not edit."
    yield f"name: {text(f'{LIBRARY}:{PACKAGES}:{version()}')}"
    yield f"description: {text('sources out of an installed Python package')}"
    yield "generators:"
    yield f"  {PACKAGES}:"
    yield "    interpreter: python3"
    yield f"    command: {PACKAGES}.py"


def made() -> dict[Path, str | None]:
    """{file: text} of all core files; None for one whose module does not exist any more."""
    found: dict[Path, str | None] = {core.file: "\n".join([*yaml(core), ""]) for core in cores()}
    found[RTL / "cpu" / f"{PACKAGES}.core"] = "\n".join([*of_packages(), ""])
    old = (path for path in RTL.rglob("*.core") if path not in found)
    return found | dict.fromkeys(old)


# Running them


def environment(seed: int, results: Path) -> dict[str, str]:
    """The environment of FuseSoC: our Python and Verilator first, the tests to be found."""
    verilator = package("verilator", "it lints")
    first = [str(Path(sys.executable).parent), str(verilator / "bin")]
    return {
        **os.environ,
        "PATH": os.pathsep.join([*first, os.environ["PATH"]]),
        "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]).rstrip(":"),
        "VERILATOR_ROOT": str(verilator),
        # what cocotb 2.1 loads; FuseSoC's flow names the modules of the tests only
        "GPI_USERS": f"{find_libpython()};{pygpi_entry_point()}",
        "COCOTB_RANDOM_SEED": str(seed),
        "COCOTB_RESULTS_FILE": str(results),
        "XDG_CONFIG_HOME": str(BUILD / "home"),  # not the libraries of whoever runs it
        "XDG_CACHE_HOME": str(BUILD / "home"),
        "XDG_DATA_HOME": str(BUILD / "home"),
    }


def command(core: Core, step: str) -> list[str]:
    """The command line of a step. Only the folders that it needs are searched for cores."""
    program = str(Path(sys.executable).with_name("fusesoc"))
    ours = {path.parent for path in design.files(core.module) if path.is_relative_to(RTL)}
    if any(name in design.foreign() for name in design.below(core.module)):
        ours.add(RTL / "cpu")  # the generator is there
    # the folder of the diagrams contains all others
    folders = [RTL] if RTL in ours else sorted(ours)
    roots = [word for folder in folders for word in ("--cores-root", str(folder))]
    work = ["--work-root", str(BUILD / core.module / step)]
    given: list[str] = []
    if step == "sim" and core.tests and core.tests.image:
        given = ["--FIRMWARE", str(firmware(core.tests.image))]
    return [program, *roots, "run", *work, "--target", step, core.vlnv, *given]


def firmware(image: str) -> Path:
    """The file of an image of the firmware for one axis, built first when it is not fresh."""
    twin_build.firmware(image, 1)
    return ROOT / "build" / "firmware" / f"{firmware_build.stem_of(image, 1)}.hex"


def outcome_of(
    line: Sequence[str], folder: Path, variables: Mapping[str, str], out: IO[str]
) -> int | None:
    """Exit code of a command, None if it does not end in time; its children end with it."""
    with subprocess.Popen(
        line,
        cwd=folder,
        env=variables,
        stdin=subprocess.DEVNULL,
        stdout=out,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    ) as process:
        try:
            return process.wait(LONGEST_S)
        except BaseException as why:
            os.killpg(process.pid, signal.SIGKILL)  # the simulator is a child of FuseSoC's make
            if isinstance(why, subprocess.TimeoutExpired):
                return None
            raise


def run(core: Core, step: str, seed: int = 1) -> str:
    """Run a step of a core by FuseSoC: what is wrong, in one line, or nothing."""
    if step == "sim" and not core.tests:
        return f"{core.module} has no simulation"
    folder = BUILD / core.module
    folder.mkdir(parents=True, exist_ok=True)
    results, log = folder / "results.xml", folder / f"{step}.log"
    results.unlink(missing_ok=True)
    with log.open("w", encoding="utf-8") as out:
        code = outcome_of(command(core, step), folder, environment(seed, results), out)
    if code is None:
        return f"{core.module}: {step} has not ended after {LONGEST_S} s"
    said = log.read_text(encoding="utf-8", errors="replace")
    where = f"(log: {log.relative_to(ROOT)})"
    if code or "%Warning" in said:
        return f"{core.module}: {step} failed {where}"
    if step == "sim":
        ran, failed = counted(results)
        if failed or not ran:
            count = f"{failed} of {ran} tests failed" if ran else "no test ran"
            return f"{core.module}: {count} {where}"
    return ""


def counted(results: Path) -> tuple[int, int]:
    """(tests that ran, those that failed) of cocotb's file of results."""
    if not results.exists():
        return 0, 0
    cases = list(xml.etree.ElementTree.parse(results).getroot().iter("testcase"))
    ran = [case for case in cases if case.find("skipped") is None]
    failed = [c for c in ran if c.find("failure") is not None or c.find("error") is not None]
    return len(ran), len(failed)


def wrong(
    chosen: Sequence[Core], seed: int = 1, jobs: int = 2, steps: Sequence[str] = STEPS
) -> list[str]:
    """What is wrong with lint and simulation of these cores, a line each."""
    # all tests are found before the threads begin: see code_coverage.rtl.parsing
    runs = [(core, step) for core in chosen for step in steps if step == "lint" or core.tests]
    with ThreadPoolExecutor(jobs) as pool:
        return [why for why in pool.map(lambda one: run(one[0], one[1], seed), runs) if why]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("cores", nargs="*", metavar="CORE", help="modules below rtl/; default: all")
    parser.add_argument("--seed", type=int, default=1, help="of the random numbers of the tests")
    parser.add_argument("--jobs", type=int, default=2, help="so many at once")
    parser.add_argument("--step", choices=STEPS, help="only this one")
    options = parser.parse_args()
    steps = [options.step] if options.step else STEPS
    try:
        chosen = named(options.cores)
    except design.DesignError as why:
        print(f"fusesoc: {why}", file=sys.stderr)
        return 2
    found = wrong(chosen, options.seed, options.jobs, steps)
    for line in found:
        print(line)
    linted = len(chosen) if "lint" in steps else 0
    simulated = sum(bool(core.tests) for core in chosen) if "sim" in steps else 0
    print(f"fusesoc: {linted} linted, {simulated} simulated, {len(found)} wrong")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
