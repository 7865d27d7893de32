# SPDX-License-Identifier: Apache-2.0
"""Synthesis, place and route of a module for the Lattice ECP5 or iCE40: how fast and how large it
becomes on this day's sources.

python -m figures.synthesis TOP [NAME=VALUE …] [--seed N] [--ice40]        e.g. node AXES=2
"""

import argparse
import json
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "synthesis"
PADS = 150  # an inner block has more ports than the ECP5 has pads: it is placed without any
ECP5 = ["--25k", "--package", "CABGA256", "--speed", "6"]  # LFE5U-25F-6
ECP5_CELLS = {"lut": "TRELLIS_COMB", "ff": "TRELLIS_FF", "block_ram": "DP16KD", "dsp": "MULT18X18D"}
ICE40 = ["--hx8k", "--package", "ct256"]


class SynthesisError(Exception):
    """One line that says which step failed and why."""


def run(command, step, log):
    """Run a tool at the root; it is told of built files by relative paths, since a YoWASP tool has
    a /tmp of its own.
    """
    words = [
        str(c.relative_to(ROOT) if isinstance(c, Path) and c.is_relative_to(BUILD) else c)
        for c in command
    ]
    done = subprocess.run(words, cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    log.write_text(done.stdout + done.stderr)
    if done.returncode:
        lines = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        told = [line for line in lines if "ERROR" in line] or lines
        raise SynthesisError(
            f"{step} failed: {told[-1] if told else 'without a word'} (log: {log.relative_to(ROOT)})"
        )


def quoted(value):
    return f'"{value}"' if isinstance(value, str) else str(value)


def source_of(top):
    source = next((ROOT / "rtl").rglob(f"{top}.sv"), None)
    if not source:
        raise SynthesisError(f"there is no {top}.sv under rtl/")
    return source


def netlist_of(source, parameters, family, seed):
    """The netlist of a source file's module for a family (ecp5, ice40), in a folder of its own."""
    top = source.stem
    chosen = [f"{k}{Path(str(v)).name}" for k, v in parameters.items()]
    tag = "-".join([*([] if family == "ecp5" else [family]), top, *chosen, f"seed{seed}"])
    folder = BUILD / re.sub(r"[^\w.-]", "_", tag)
    folder.mkdir(parents=True, exist_ok=True)
    core = Path(find_spec("pythondata_cpu_picorv32").submodule_search_locations[0]) / "verilog"
    rooms = sorted({p.parent for p in (ROOT / "rtl").rglob("*.sv")}) + [core]
    netlist = folder / "netlist.json"
    change = "".join(f" -set {name} {quoted(value)}" for name, value in parameters.items())
    passes = [
        f"read_verilog -sv {source.relative_to(ROOT)}",
        f"chparam{change} {top}" if change else "",
        f"hierarchy -check -top {top} {' '.join(f'-libdir {d}' for d in rooms)}",
        f"synth_{family} -top {top} -json {netlist.relative_to(ROOT)}",
    ]
    run(
        [sys.executable, ROOT / "tools" / "yosys.py", "; ".join(passes)],
        "synthesis",
        folder / "synthesis.log",
    )
    return netlist


def placed(netlist, family, part, wanted_mhz, seed, *more):
    """What nextpnr reports of a netlist; a missed timing is a result, not a failure."""
    report = netlist.with_name("report.json")
    run(
        [
            Path(sys.executable).parent / f"yowasp-nextpnr-{family}",
            *part,
            "--json",
            netlist,
            "--freq",
            wanted_mhz,
            "--seed",
            seed,
            *more,
            "--timing-allow-fail",
            "--report",
            report,
        ],
        "place and route",
        netlist.with_name("place_and_route.log"),
    )
    told = json.loads(report.read_text())
    return min((clock["achieved"] for clock in told["fmax"].values()), default=0.0), told[
        "utilization"
    ]


def synthesise(top, parameters=None, wanted_mhz=60, seed=1):
    """{fmax_mhz, lut, ff, block_ram, dsp, and …_of: what the part has} of rtl/…/top.sv on an ECP5;
    parameters by name.
    """
    netlist = netlist_of(source_of(top), parameters or {}, "ecp5", seed)
    ports = json.loads(netlist.read_text())["modules"][top]["ports"].values()
    alone = (
        ["--out-of-context"]
        if sum(len(p["bits"]) for p in ports) > PADS
        else ["--textcfg", netlist.with_name("config")]
    )
    fmax, used = placed(
        netlist, "ecp5", ECP5, wanted_mhz, seed, "--lpf-allow-unconstrained", *alone
    )
    result = {"fmax_mhz": fmax}
    for name, cell in ECP5_CELLS.items():
        use = used.get(cell, {"used": 0, "available": 0})
        result |= {name: use["used"], f"{name}_of": use["available"]}
    return result


def synthesise_ice40(top, parameters=None, seed=1, wanted_mhz=150, source=None):
    """{lc: logic cells, fmax_mhz} of rtl/…/top.sv, or of another source file, on an iCE40 HX8K;
    parameters by name.
    """
    netlist = netlist_of(source or source_of(top), parameters or {}, "ice40", seed)
    fmax, used = placed(netlist, "ice40", ICE40, wanted_mhz, seed, "--pcf-allow-unconstrained")
    return {
        "lc": used["ICESTORM_LC"]["used"],
        "lc_of": used["ICESTORM_LC"]["available"],
        "fmax_mhz": fmax,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
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
    try:
        found = (synthesise_ice40 if options.ice40 else synthesise)(
            options.top, parameters, seed=options.seed
        )
    except SynthesisError as why:
        sys.exit(str(why))
    if options.ice40:
        print(
            f"{options.top}: {found['fmax_mhz']:.1f} MHz, {found['lc']} logic cells of {found['lc_of']}"
        )
        return
    print(
        f"{options.top}: {found['fmax_mhz']:.1f} MHz, {found['lut']} LUT4 of {found['lut_of']}, {found['ff']} FF, "
        f"{found['block_ram']} block RAM of {found['block_ram_of']}, {found['dsp']} DSP of {found['dsp_of']}"
    )


if __name__ == "__main__":
    main()
