# SPDX-License-Identifier: Apache-2.0
"""Blocks of rtl/ in a design in Amaranth.

The parameters, the ports and their widths come from the source of the block, so a wrong name or a
signal of the wrong width is an error while the design is elaborated.
"""

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from amaranth.back import rtlil
from amaranth.hdl import ClockSignal, Const, Elaboratable, Instance, ResetSignal, Value

from embed import design
from embed.design import DesignError
from twin.build import ROOT


def instance(
    module: str, signals: Mapping[str, Value | int], parameters: Mapping[str, int | str] = {}
) -> Instance:
    """An instance of a block. `signals` has a signal or a number for each input and a signal for
    each output that is used; clk and rst are those of the domain `sync` unless they are given.
    A DesignError names a parameter or a port that the block does not have, an input that is not
    connected, and a signal of another width than its port.
    """
    parameters = parameters or {}
    ports, widths = design.ports(module), design.widths(module, parameters)
    given = {"clk": ClockSignal(), "rst": ResetSignal(), **signals}
    connections: dict[str, Value | int] = {}
    for name in signals:
        if name not in ports:
            raise DesignError(f"{module} has no port {name}; it has {', '.join(ports)}")
    for name, port in ports.items():
        if name not in given:
            if port.direction == "input":
                raise DesignError(f"the input {name} of {module} is not connected")
            continue
        signal = given[name]
        if isinstance(signal, int):
            signal = Const(signal, widths[name])
        elif name not in ("clk", "rst") and len(signal) != widths[name]:
            raise DesignError(
                f"port {name} of {module} has {widths[name]} bits, the signal has {len(signal)}"
            )
        connections[f"{port.direction[0]}_{name}"] = signal
    return Instance(module, **{f"p_{n}": v for n, v in parameters.items()}, **connections)


def write_verilog(top: Elaboratable, name: str, path: Path) -> None:
    """Write a component as Verilog, by Yosys; the blocks in it stay instances."""
    path.parent.mkdir(parents=True, exist_ok=True)
    middle = path.with_suffix(".il")
    middle.write_text(rtlil.convert(top, name=name), encoding="utf-8")
    passes = f"read_rtlil {middle}; proc; clean; write_verilog -noattr {path}"
    done = subprocess.run(
        [sys.executable, ROOT / "tools" / "yosys.py", passes], capture_output=True, text=True
    )
    if done.returncode:
        raise DesignError(f"Yosys refuses {middle}: {(done.stdout + done.stderr)[-500:]}")
    path.write_text(design.FOREIGN_STYLE + path.read_text(encoding="utf-8"), encoding="utf-8")
