# SPDX-License-Identifier: Apache-2.0
"""Builds the simulation of a module and runs the cocotb tests of a file in it; the settings of the
environment are those of tb/bench.py.
"""

import fcntl
import hashlib
import json
import os
import re
import shutil
import xml.etree.ElementTree
from importlib.util import find_spec
from pathlib import Path

import pytest
from cocotb_tools.runner import as_sv_literal, get_runner

from embed.design import EXAMPLES
from mutation import block
from twin import build as twin_build
from twin import crossings, netlist, netlist_tests
from twin.build import ROOT, rtl_path

BENCHES = ROOT / "build" / "benches"  # tops that a test writes for itself
WAIVERS = [
    ROOT / "rtl" / "cpu" / "cores.vlt"
]  # foreign sources only; our own waivers stand in the line they excuse
# of the Python of a simulation: only the tests and their models have assertions that pytest
# explains, and no plug-in of pytest is of use
SIMULATION = {"COCOTB_REWRITE_ASSERTION_FILES": "tb/*/*.py", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}


def package(name):
    """Folder of an installed package, without importing it."""
    spec = find_spec(name)
    return Path(spec.submodule_search_locations[0]) if spec else None


def source_of(top):
    modelled = [path for d in crossings.folders() for path in d.glob(f"{top}.sv")]
    found = modelled or list((ROOT / "rtl").rglob(f"{top}.sv"))
    assert len(found) == 1, (
        f"there must be exactly one {top}.sv under rtl/, "
        f"found {[str(p.relative_to(ROOT)) for p in found]}"
    )
    return found[0]


def direct_verilator(runner, waves):
    """Call the compiler itself: Verilator's Perl front end is not needed, and a minimal system has
    no Pod::Usage for it. Without waves, Verilator's run-time part, most of the compiler's work for
    a small block, is compiled once for all.
    """
    folder = package("verilator")
    if folder and (folder / "bin" / "verilator_bin").exists():
        os.environ["VERILATOR_ROOT"] = str(folder)
        runner._simulator_in_path_build_only = lambda: setattr(
            runner, "executable", str(folder / "bin" / "verilator_bin")
        )
    flags = ["CFG_CXXFLAGS_PCH_I=-include"]  # else larger designs miss their precompiled header
    if folder and not waves:
        runtime = twin_build.runtime(twin_build.compiler(), folder, vpi=True)
        flags += ["VM_GLOBAL_FAST=", "VM_GLOBAL_SLOW=", f"LOADLIBES={runtime}"]
    os.environ["MAKEFLAGS"] = " ".join(flags)


def run(top, test, seed, parameters):
    """Build module `top` with `parameters` and run the cocotb tests in the file `test`. Files are
    found by name: a bench top beside the test, among the figures, the examples or in BENCHES, every
    other module under rtl/.
    """
    __tracebackhide__ = True
    power_up, counts = os.environ.get("POWER_UP"), os.environ.get("RTL_COVERAGE")
    sim, waves, here = (
        os.environ.get("SIM") or ("verilator" if power_up or counts else "icarus"),
        bool(os.environ.get("WAVES")),
        Path(test).resolve(),
    )
    folders = (here.parent, ROOT / "sw" / "figures", EXAMPLES, BENCHES)
    benches = [folder / f"{top}.sv" for folder in folders]
    source = next((bench for bench in benches if bench.exists()), None) or source_of(top)
    name = os.environ.get("PYTEST_CURRENT_TEST", "run").split("::")[-1].split(" ")[0]
    values = {k: as_sv_literal(v) for k, v in parameters.items()}
    tag = "-".join([top, *(f"{k}{v}" for k, v in values.items()), *(["waves"] if waves else [])])
    tag = tag.replace(f"{ROOT}/", "")
    if not re.fullmatch(r"[\w.-]{1,100}", tag):
        tag = f"{top}-{hashlib.sha256(tag.encode()).hexdigest()[:12]}"
    family = os.environ.get("NETLIST")
    request = os.environ.get("MUTANTS")
    late = crossings.seed() and "crossings"
    variants = [power_up and "power_up", counts and "coverage", request and "mutants", late]
    kind = "-".join(filter(None, [sim, family, *variants]))
    shared = ROOT / "build" / kind / tag
    own = shared / re.sub(r"[^\w.-]", "_", f"{here.stem}.{name}")
    own.mkdir(parents=True, exist_ok=True)
    runner, build = (
        get_runner(sim),
        own if sim == "icarus" else shared,
    )  # Icarus compiles at once: nothing to share
    args = [a for d in (*rtl_path(), EXAMPLES) for a in ("-y", str(d))]
    if sim == "icarus":
        sources, args = [], [*args, "-Y.sv", "-Y.v", "-Wall", "-Wno-timescale"]
    else:
        sources, args = [w for w in WAIVERS if w.exists()], [*args, "+libext+.sv+.v", "-Wall"]
        direct_verilator(runner, waves)
    circuit, known_as = "", f"{here.relative_to(ROOT / 'tb')}::{name} {tag}"
    if family:
        circuit = netlist.name_of(family, source, parameters, rtl_path())
        if not netlist_tests.due(family, known_as, circuit):
            pytest.skip("this netlist is not to be tested again, see sw/twin/netlist_tests.py")
        sources, source, args = of_netlist(sim, family, source, parameters)
    modules = [".".join(here.relative_to(ROOT).with_suffix("").parts)]
    environment = dict(SIMULATION)
    if request:
        assert sim == "icarus", "MUTANTS needs Icarus: Verilator's threads do not survive a fork"
        source, more = of_mutants(request, source, parameters, own.name)
        environment.update(more)
        sources, args = [], quiet(sim)
        modules.append("tb.mutants")
    if power_up:
        assert sim == "verilator", "Icarus has no random states: POWER_UP needs Verilator"
        args = [*args, "--x-initial", "unique", "--x-assign", "unique"]
    plusargs = crossings.plusargs() + random_state(power_up)
    if counts:
        assert sim == "verilator", "only Verilator counts coverage"
        # The counters keep Verilator from splitting a vector whose bits depend on each other, so it
        # sees a loop where there is none; without them, it is asked.
        args = [*args, "--coverage-line", "--coverage-toggle", "-Wno-UNOPTFLAT"]
        plusargs.append(f"+verilator+coverage+file+{own / 'coverage.dat'}")
    with open(shared / "lock", "w") as lock:  # parallel workers may want the same build
        fcntl.flock(lock, fcntl.LOCK_EX)
        runner.build(
            sources=[*sources, source],
            hdl_toplevel=top,
            parameters=values,
            always=True,
            build_args=args,
            build_dir=build,
            timescale=("1ns", "1ps"),
            waves=waves,
        )
    what = f"{top} under {sim}" + (f" as a netlist for {family}" if family else "")
    print(f"{what}, SEED={seed}", flush=True)
    again = f"SIM={sim} SEED={seed}" + (f" NETLIST={family}" if family else "")
    again += f" POWER_UP={power_up}" if power_up else ""
    again += f" CROSSINGS={crossings.seed()}" if late else ""
    failed = f"{what}: {{}}. Again: make test K={name.split('[')[0]} {again}"
    try:
        count, skipped, wrong = results(
            runner.test(
                hdl_toplevel=top,
                test_module=modules,
                build_dir=build,
                test_dir=own,
                seed=seed,
                waves=waves,
                plusargs=plusargs,
                extra_env=environment,
            )
        )
    except (
        SystemExit,
        RuntimeError,
        FileNotFoundError,
    ):  # the runner's words for a failed test and for no result at all
        count, skipped, wrong = None, None, None
    if family and wrong == count == 0 and skipped:
        pytest.skip(f"{what}: all its tests read inside the module")
    if wrong != 0 or not count:
        pytest.fail(
            failed.format(
                f"no test ran from {here.name}" if count == 0 else "failed, see its output"
            ),
            pytrace=False,
        )
    if family:
        netlist_tests.passed(family, known_as, circuit)
    if counts:
        Path(counts).mkdir(parents=True, exist_ok=True)
        shutil.copy(own / "coverage.dat", Path(counts) / f"{tag}.{own.name}.dat")


def random_state(power_up):
    """The arguments with which Verilator makes the state after power-up random."""
    return ["+verilator+rand+reset+2", f"+verilator+seed+{power_up}"] if power_up else []


def of_netlist(sim, family, source, parameters):
    """(other sources, source of the top, arguments) of the simulation of a module's netlist."""
    *others, top = netlist.sources(family, source, parameters, rtl_path())
    return others, top, quiet(sim)


def quiet(sim):
    """Arguments of a simulator that reads what Yosys has written."""
    return ["-Wno-timescale"] if sim == "icarus" else ["-Wno-lint", "-Wno-style", "-Wno-fatal"]


def of_mutants(request, source, parameters, name):
    """(source, environment) of the simulation of a block with its mutants, by a request of
    mutation.blocks, which finds the verdicts by the name of the test. A test of another module is
    skipped, and so is one whose build has itself left all faults that are asked for, or has none of
    the mutants that are asked for by their labels. A mutant that another test of the same build has
    found is not run again.
    """
    file = Path(request)
    asked = json.loads(file.read_text())
    if source.stem != asked["block"]:
        pytest.skip(f"there are mutants of {asked['block']} only")
    faults = [tuple(fault) for fault, build in asked["faults"] if build != parameters]
    if asked["faults"] and not faults:
        pytest.skip("the faults were left by this build")
    choice = asked["count"], asked["seed"], faults
    folder = block.prepared(source, parameters, rtl_path(), *choice)
    found = block.Run.found(file.parent, folder)
    build = block.build_words(parameters)
    numbers = [
        m.number
        for m in block.mutants_of(folder)
        if m.number not in found
        and (not asked["labels"] or block.label(source.stem, build, m) in asked["labels"])
    ]
    if asked["labels"] and not numbers:
        pytest.skip("this build has none of the mutants that are asked for")
    block.Run(str(folder), parameters, numbers).write(file.parent / f"{name}.json")
    return folder / block.NETLIST, {
        "MUTANT_VERDICTS": str(file.parent / f"{name}.verdicts"),
        "MUTANT_NUMBERS": " ".join(map(str, numbers)),
        "COCOTB_MAX_FAILURES": "1",
        "COCOTB_TEST_FILTER": asked["tests"],
    }


def results(path):
    """(how many tests ran, how many were skipped, how many of those that ran were wrong) from the
    file of results.
    """
    suites = xml.etree.ElementTree.parse(path).getroot().findall("testsuite")
    count, skipped, *wrong = (
        sum(int(suite.get(name, 0)) for suite in suites)
        for name in ("tests", "skipped", "failures", "errors")
    )
    return count - skipped, skipped, sum(wrong)
