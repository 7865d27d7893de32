# SPDX-License-Identifier: Apache-2.0
"""An encoder input behind AXI4-Lite, written in Amaranth around two blocks of Moire.

`encoder_counter` counts the encoder and has three registers, `axi_lite_port` makes them accessible;
the synchronisers and the time stamp are Amaranth's own. The registers are those of the header of
rtl/decode/encoder_counter.sv: word 0 at address 0, word 1 at 4, word 2 at 8.

    python -m embed.examples.axi_lite_encoder FILE        writes the design as Verilog
"""

import sys
from pathlib import Path

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from embed import amaranth_block, design
from embed.amaranth_block import instance

NAME = "axi_lite_encoder"
BLOCKS = ("axi_lite_port", "encoder_counter")  # whose files the design needs
PINS = ("encoder_a", "encoder_b", "encoder_z", "probe")
# three words of four bytes; one block alone answers in the cycle after select
PORT = {"ADDRESS_W": 4, "LATENCY": 1}
FILTER_W = 4  # bits of the filter's setting


class AxiLiteEncoder(wiring.Component):
    """Ports: the signals `axi_...` of axi_lite_port, and the pins of the encoder."""

    def __init__(self) -> None:
        widths = design.widths("axi_lite_port", PORT)
        flow = {"input": In, "output": Out}
        self.bus = [name for name in design.ports("axi_lite_port") if name.startswith("axi_")]
        super().__init__(
            {
                **{
                    name: flow[design.ports("axi_lite_port")[name].direction](widths[name])
                    for name in self.bus
                },
                **{name: In(1) for name in PINS},
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        levels = {name: Signal(name=f"{name}_level") for name in PINS}
        for name, level in levels.items():
            m.submodules[f"{name}_synchroniser"] = FFSynchronizer(getattr(self, name), level)

        now = Signal(16)  # cycles, wraps
        m.d.sync += now.eq(now + 1)

        select, write = Signal(), Signal()
        address, wdata, rdata = Signal(PORT["ADDRESS_W"]), Signal(32), Signal(32)
        m.submodules.port = instance(
            "axi_lite_port",
            {
                **{name: getattr(self, name) for name in self.bus},
                "ready": 1,
                "select": select,
                "write": write,
                "address": address,
                "wdata": wdata,
                "rdata": rdata,
            },
            PORT,
        )
        m.submodules.counter = instance(
            "encoder_counter",
            {
                "select": select,
                "write": write,
                "word": address[2:4],
                "wdata": wdata,
                "now": now,
                "a": levels["encoder_a"],
                "b": levels["encoder_b"],
                "z": levels["encoder_z"],
                "probe": levels["probe"],
                "rdata": rdata,
            },
            {"FILTER_W": FILTER_W},
        )
        return m


def write_verilog(path: Path) -> None:
    """Write the design, without the files of its blocks."""
    amaranth_block.write_verilog(AxiLiteEncoder(), NAME, path)


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    write_verilog(Path(sys.argv[1]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
