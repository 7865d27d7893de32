# SPDX-License-Identifier: Apache-2.0
"""Whether a mutant of a block can be seen at its outputs at all.

Two copies of the netlist, without the mutant and with it, have the same inputs. Their flip-flops
without a first value begin at 0, and the outputs are compared as soon as there has been a reset.
The inputs are those that the block's properties assume (`assume` in `ifdef FORMAL`). ABC searches a
difference within DEPTH cycles, and then tries to prove for all times that there is none.
"""

import json
import re
import resource
import subprocess
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from mutation import block
from twin import netlist

DEPTH = 40  # cycles in which a difference is searched
SEARCH_S, PROOF_S = 5, 10  # of computing time
EQUIVALENT, UNDECIDED, DIFFERENT = "equivalent", "undecided", "different"
NO_STATE = re.compile(r"lat = +0 ")  # what `print_stats` says of a combinational block
PAIR, CONTRACT = "pair.il", "contract"


def ports_text(ports: dict[str, Any], direction: str) -> list[tuple[str, str]]:
    """(name, packed range) of the ports of a direction."""
    return [
        (name, f"[{len(port['bits']) - 1}:0]")
        for name, port in ports.items()
        if port["direction"] == direction
    ]


def miter(ports: dict[str, Any], number: int) -> str:
    """A module that compares the two copies."""
    inputs, outputs = ports_text(ports, "input"), ports_text(ports, "output")
    same = "".join(f", .{name}({name})" for name, _ in inputs)
    lines = ["module miter (", ",\n".join(f"  input wire {w} {n}" for n, w in inputs)]
    lines += [",\n  output wire miter_differs\n);", f"  {CONTRACT} u_contract ({same[2:]});"]
    for copy, selected in (("good", 0), ("mutated", number)):
        lines += [f"  wire {w} {copy}_{n};" for n, w in outputs]
        joined = "".join(f", .{n}({copy}_{n})" for n, _ in outputs)
        lines += [f"  mutated u_{copy} (.{block.SELECTOR}({selected}){same}{joined});"]
    differs = " || ".join(f"good_{n} != mutated_{n}" for n, _ in outputs)
    if {"clk", "rst"} <= {n for n, _ in inputs}:
        lines += ["  reg miter_begun = 1'b0;"]
        lines += ["  always @(posedge clk) if (rst) miter_begun <= 1'b1;"]
        differs = f"miter_begun && ({differs})"
    return "\n".join([*lines, f"  assign miter_differs = {differs};", "endmodule\n"])


def pair(
    folder: Path, source: Path, values: netlist.Parameters, folders: Sequence[Path]
) -> dict[str, Any]:
    """Make what the comparisons of a build share, once; the ports of the block."""
    top = source.stem
    ports: dict[str, Any] = json.loads((folder / "interface.json").read_text())["modules"][top][
        "ports"
    ]
    if not (folder / PAIR).exists():
        passes = [
            *netlist.elaboration(source, values, folders, formal=True),
            f"prep -flatten -top {top}; chformal -assert -cover -live -fair -remove",
            f"rename {top} {CONTRACT}; write_rtlil {folder}/{CONTRACT}.il; design -reset",
            f"read_rtlil {folder}/{block.MUTATED}; hierarchy -top {top}; flatten; opt_clean",
            f"rename {top} mutated; read_rtlil {folder}/{CONTRACT}.il",
            f"write_rtlil {folder}/{PAIR}",
        ]
        block.yosys(passes, folder / "pair.log")
    return ports


def judged(said: str) -> tuple[str, str]:
    """(verdict, words) from what ABC says."""
    if "Property proved" in said or "UNSATISFIABLE" in said:
        return EQUIVALENT, "no difference at any time"
    if "SATISFIABLE" in said:
        return DIFFERENT, "seen at the outputs at once"
    seen = re.search(r"asserted in frame (\d+)", said)
    if seen:
        return DIFFERENT, f"seen at the outputs after {seen[1]} cycles"
    reached = re.search(r"No output asserted in (\d+) frames", said)
    cycles = reached[1] if reached else "0"
    return UNDECIDED, f"no difference in {cycles} cycles, no proof"


def abc(aiger: Path, steps: str, seconds: int) -> str:
    """What ABC says of a miter, nothing if it takes more computing time. Its own limits count the
    time of the clock on the wall, which depends on what else runs.
    """
    program = str(netlist.share().parent / "yosys-abc")
    command = [program, "-c", f"read_aiger {aiger}; fold; strash; scorr; {steps}"]
    limit = partial(resource.setrlimit, resource.RLIMIT_CPU, (seconds, seconds))
    return subprocess.run(command, capture_output=True, text=True, preexec_fn=limit).stdout


def answer(aiger: Path) -> tuple[str, str]:
    """(EQUIVALENT, UNDECIDED or DIFFERENT, words) of a miter."""
    said = abc(aiger, f"print_stats; bmc3 -F {DEPTH}", SEARCH_S)
    if NO_STATE.search(said):
        return judged(abc(aiger, "sat", PROOF_S))
    if judged(said)[0] == UNDECIDED:
        said += abc(aiger, "pdr", PROOF_S)
    return judged(said)


def compared(
    folder: Path, ports: dict[str, Any], numbers: Sequence[int]
) -> dict[int, tuple[str, str]]:
    """{number: (EQUIVALENT, UNDECIDED or DIFFERENT, words)} of mutants of a build."""
    passes = [f"read_rtlil {folder}/{PAIR}; design -save pair"]
    for number in numbers:
        text = folder / f"miter-{number}.v"
        text.write_text(miter(ports, number))
        passes += [
            f"design -load pair; read_verilog -sv -formal {text}",
            "prep -flatten -top miter; memory_map; opt -full; async2sync; dffunmap",
            "setundef -undriven -zero; setundef -init -zero; techmap; opt_expr",
            f"setundef -zero; aigmap; opt_clean; write_aiger {text.with_suffix('.aig')}",
        ]
    script = folder / "miters.ys"
    script.write_text("\n".join(passes).replace("; ", "\n"))
    block.yosys([f"script {script}"], folder / "miters.log")
    return {number: answer(folder / f"miter-{number}.aig") for number in numbers}
