# SPDX-License-Identifier: Apache-2.0
"""The netlist that Yosys makes of a module for a family of FPGAs, as sources of a simulation.

The primitives are Yosys's own models (its folder share), without the timing that Icarus does not
read. Yosys has no model of two primitives of the ECP5, dp16kd.vh and mult18x18d.vh are ours, and
none of the block RAMs and the multiplier of a Gowin part: gowin_*. A
wrapper has the name, the ports and the parameters of the module, so that a test sees no difference,
as long as it uses ports only. All of it is kept under build/netlist by the contents of everything
that goes in.
"""

import fcntl
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
BODIES = HERE / "primitives"
ROOT = HERE.parents[1]
BUILD = ROOT / "build" / "netlist"
FAMILIES = ("ecp5", "ice40")  # for which the tests of all blocks run
# of a node: on its netlist, and from random states
NODE_TESTS = ("tb/twin/test_twin.py", "tb/system/test_s0_stage.py")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
INSTANCE = re.compile(r"\b(\w+)\s+(?:#\s*\(|\w+\s*\()")  # the module of one, and other words
SUFFIX = "_netlist"  # of the module that Yosys has made, below its wrapper
TIMING = re.compile(r"^[ \t]*specify\b.*?^[ \t]*endspecify\b", re.MULTILINE | re.DOTALL)
OURS = {"DP16KD": "dp16kd.vh", "MULT18X18D": "mult18x18d.vh"}
GOWIN = {  # our bodies of its primitives, and the bits of a group of a block RAM
    "SP": ("gowin_single_port.vh", 8),
    "SPX9": ("gowin_single_port.vh", 9),
    "SDPB": ("gowin_simple_dual_port.vh", 8),
    "SDPX9B": ("gowin_simple_dual_port.vh", 9),
    "DPB": ("gowin_dual_port.vh", 8),
    "DPX9B": ("gowin_dual_port.vh", 9),
    "MULT18X18": ("gowin_mult18x18.vh", 0),
}
BUSES = {  # of their ports of one bit each
    "DP16KD": {"ADA": 14, "ADB": 14, "DIA": 18, "DIB": 18, "DOA": 18, "DOB": 18},
    "MULT18X18D": {"A": 18, "B": 18, "P": 36},
}


Parameters = Mapping[str, int | str]


class NetlistError(Exception):
    """One line that says why there is no netlist."""


def share() -> Path:
    """Yosys's folder of models and maps."""
    found = find_spec("pyosys")
    if not found or not found.submodule_search_locations:
        raise NetlistError("the package pyosys is missing")
    return Path(found.submodule_search_locations[0]) / "share"


def module_of(text: str, name: str) -> str:
    """A module, without its end."""
    found = re.search(rf"^module {name}\b.*?^(?=endmodule)", text, re.MULTILINE | re.DOTALL)
    if not found:
        raise NetlistError(f"Yosys has no module {name}")
    return found[0]


def rows() -> str:
    """The initial contents of a DP16KD: 64 parameters of 16 words of 18 bits, 20 bits apart."""
    return "\n".join(
        f"for (n = 0; n < 8; n = n + 1) rows[{8 * n} + n] = "
        f"{{INITVAL_{n:02X}[40*n+20+:18], INITVAL_{n:02X}[40*n+:18]}};"
        for n in range(64)
    )


def filled(name: str, body: str) -> str:
    """Our body of a primitive, with the buses that its ports of one bit form."""
    for bus, width in BUSES[name].items():
        bits = ", ".join(f"{bus}{bit}" for bit in reversed(range(width)))
        body = body.replace(f"`{bus}_BITS", f"{{{bits}}}")
    return body.replace("`ROWS", rows())


def primitives_ecp5() -> str:
    folder = share() / "ecp5"
    text = "".join(
        (folder / name).read_text() for name in ("common_sim.vh", "ccu2c_sim.vh", "cells_sim.v")
    )
    text = re.sub(r"^`include.*$", "", text, flags=re.MULTILINE)
    # a cell of a placed design, which Icarus does not read, and which Yosys does not make
    text = text.replace(f"{module_of(text, 'TRELLIS_COMB')}endmodule", "")
    boxes = text + (folder / "cells_bb.v").read_text()
    ours = {name: module_of(boxes, name) for name in OURS}
    text = text.replace(f"(* blackbox *)\n{ours['DP16KD']}endmodule", "")
    for name, file in OURS.items():
        text += f"\n{ours[name]}{filled(name, (BODIES / file).read_text())}endmodule\n"
    return text


def primitives_ice40() -> str:
    text = (share() / "ice40" / "cells_sim.v").read_text()
    return f"`define NO_ICE40_DEFAULT_ASSIGNMENTS\n{text}"


def primitives_gowin() -> str:
    """Yosys's models, and ours of the block RAMs and the multiplier."""
    folder = share() / "gowin"
    text, boxes = ((folder / name).read_text() for name in ("cells_sim.v", "cells_xtra_gw2a.v"))
    ours = (BODIES / "gowin_ram.v").read_text()
    for name, (file, unit) in GOWIN.items():
        known = f"\n{text}" if f"\nmodule {name} " in text else f"\n{boxes}"
        head, body = module_of(known, name), (BODIES / file).read_text()
        text = text.replace(f"{head}endmodule", "")
        contents = ", ".join(f"INIT_RAM_{row:02X}" for row in reversed(range(64)))
        body = body.replace("`UNIT", str(unit)).replace("`INIT", f"{{{contents}}}")
        ours += f"\n{head}{body}endmodule\n"
    return text + ours


PRIMITIVES: Mapping[str, Callable[[], str]] = {
    "ecp5": primitives_ecp5,
    "ice40": primitives_ice40,
    "gowin": primitives_gowin,
}


def primitives(family: str) -> str:
    """The models of a family's primitives, as the text of one file."""
    text = PRIMITIVES[family]()
    return f"`default_nettype wire\n`timescale 1ns/1ps\n{TIMING.sub('', text)}".replace(
        "`timescale 1ps / 1ps", ""
    )


def literal(value: int | str) -> str:
    """A parameter as Yosys reads it, which knows no sign."""
    if isinstance(value, str):
        return f'"{value}"'
    return str(int(value)) if value >= 0 else f"32'h{value & 0xFFFFFFFF:08x}"


def parts(source: Path, folders: Sequence[Path]) -> dict[Path, str]:
    """The code, without comments, of the source and of the modules below it, in these folders."""
    known = {path.stem: path for d in folders for path in sorted(d.glob("*.*v"))}
    found: dict[Path, str] = {}
    left = [source]
    while left:
        path = left.pop()
        if path not in found:
            found[path] = COMMENT.sub("", path.read_text())
            left += [known[word] for word in set(INSTANCE.findall(found[path])) & known.keys()]
    return found


def name_of(chosen: str, source: Path, parameters: Parameters, folders: Sequence[Path]) -> str:
    """A name for what Yosys makes the netlist from, and its version."""
    named = repr((chosen, source.stem, sorted(parameters.items()))).replace(f"{ROOT}/", "")
    total = hashlib.sha256(named.encode() + version("pyosys").encode())
    for path, text in sorted(parts(source, folders).items()):
        total.update(path.name.encode() + text.encode())
    for value in parameters.values():
        if isinstance(value, str) and (ROOT / value).is_file():
            total.update((ROOT / value).read_bytes())
    return total.hexdigest()[:16]


def digest(chosen: str, source: Path, parameters: Parameters, folders: Sequence[Path]) -> str:
    """A name for everything that a simulation of the netlist depends on."""
    total = hashlib.sha256(name_of(chosen, source, parameters, folders).encode())
    for path in (*sorted(BODIES.glob("*.v*")), Path(__file__), ROOT / "tools" / "yosys.py"):
        total.update(path.read_bytes())
    return total.hexdigest()[:16]


def yosys(passes: Sequence[str], log: Path) -> str:
    """Runs these passes; what Yosys prints goes to a file. Returns the line that says what is
    wrong, nothing if all is well.
    """
    command = [sys.executable, str(ROOT / "tools" / "yosys.py"), "; ".join(passes)]
    with open(log, "w") as out:
        done = subprocess.run(command, cwd=ROOT, stdout=out, stderr=subprocess.STDOUT)
    if not done.returncode:
        return ""
    lines = log.read_text().splitlines()
    errors = [line for line in lines if "ERROR" in line] or lines[-1:]
    return errors[-1] if errors else "no word"


def value_of(bits: str) -> str:
    """A parameter's value in Yosys's JSON, as Verilog."""
    if re.fullmatch(r"[01xz]+", bits):
        number = int(re.sub("[xz]", "0", bits), 2)
        return str(number - 2**32 if len(bits) == 32 and number >= 2**31 else number)
    return f'"{bits.rstrip()}"'


def wrapper(top: str, module: dict[str, Any]) -> str:
    """A module of the netlist's name, ports and parameters, around the netlist."""
    parameters = module.get("parameter_default_values", {})
    listed = ",\n".join(f"    parameter {p} = {value_of(v)}" for p, v in parameters.items())
    ports = module["ports"]
    declared = ",\n".join(
        f"    {port['direction']} wire {'signed ' if port.get('signed') else ''}"
        f"[{len(port['bits']) - 1}:0] {name}"
        if len(port["bits"]) > 1
        else f"    {port['direction']} wire {name}"
        for name, port in ports.items()
    )
    joined = ",\n".join(f"        .{name}({name})" for name in ports)
    head = f"module {top} #(\n{listed}\n) (" if parameters else f"module {top} ("
    return f"{head}\n{declared}\n);\n    {top}{SUFFIX} u_netlist (\n{joined}\n    );\nendmodule\n"


def elaboration(
    source: Path, parameters: Parameters, folders: Sequence[Path], formal: bool = False
) -> list[str]:
    """Passes of Yosys that read a module with these parameters, and those below it from these
    folders; with the properties in their code if `formal`. Yosys (0.70) may read a module again
    once it knows those below, and then call it by its parameters: it gets its own name back.
    """
    top = source.stem
    change = "".join(f" -set {name} {literal(value)}" for name, value in parameters.items())
    return [
        f"read_verilog -sv {'-formal ' if formal else ''}{source}",
        f"chparam{change} {top}" if change else "",
        f"hierarchy -check -top {top} {' '.join(f'-libdir {d}' for d in folders)}",
        f"rename -top {top}",
    ]


def synthesise(
    chosen: str, source: Path, parameters: Parameters, folders: Sequence[Path], out: Path
) -> None:
    """Yosys writes netlist.v and the interface of the module into the folder `out`."""
    top, family = source.stem, chosen.split()[0]
    passes = [
        *elaboration(source, parameters, folders),
        "design -save elaborated; proc",
        f"write_json {out}/interface.json",
        f"design -load elaborated; synth_{chosen} -top {top}",
        f"check -assert; rename {top} {top}{SUFFIX}",
        f"write_verilog -noattr {out}/netlist.v",
    ]
    if wrong := yosys(passes, out / "synthesis.log"):
        raise NetlistError(f"synth_{family} of {top}: {wrong}")
    module = json.loads((out / "interface.json").read_text())["modules"][top]
    (out / "wrapper.v").write_text(wrapper(top, module))
    (out / "primitives.v").write_text(primitives(family))
    (out / "interface.json").unlink()


def sources(
    chosen: str, source: Path, parameters: Parameters, folders: Sequence[Path]
) -> list[Path]:
    """[primitives, netlist, wrapper] of a module with these parameters: what a simulation compiles
    in place of its RTL. `chosen` is a family, and perhaps options of its synthesis.
    """
    family = next(iter(chosen.split()), "")
    if family not in PRIMITIVES:
        raise NetlistError(f"NETLIST={chosen}: it is one of {', '.join(PRIMITIVES)}")
    tag = digest(chosen, source, parameters, folders)
    folder = BUILD / family / f"{source.stem}-{tag}"
    BUILD.mkdir(parents=True, exist_ok=True)
    with open(BUILD / f"{family}-{source.stem}-{tag}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            folder.parent.mkdir(exist_ok=True)
            making = Path(tempfile.mkdtemp(dir=BUILD, prefix="making-"))
            try:
                synthesise(chosen, source, parameters, folders, making)
                os.rename(making, folder)
            finally:
                shutil.rmtree(making, ignore_errors=True)
    return [folder / name for name in ("primitives.v", "netlist.v", "wrapper.v")]
