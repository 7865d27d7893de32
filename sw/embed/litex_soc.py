# SPDX-License-Identifier: Apache-2.0
"""A LiteX SoC with an axis on its Wishbone bus and a node, for a simulation: the bus master is
outside, in the place of a processor.

    PYTHONPATH=build/litex python -m embed.litex_soc FOLDER FIRMWARE

writes FOLDER/motion_soc.sv, the SoC as Verilog, and FOLDER/motion_soc.json, its map as LiteX's
software tools read it. `make litex` fetches LiteX into build/litex.
"""

import sys
from pathlib import Path
from typing import Any

from litex.build.generic_platform import GenericPlatform, Pins, Subsignal
from litex.build.io import CRG
from litex.soc.integration import export
from litex.soc.integration.soc import SoCRegion
from litex.soc.integration.soc_core import SoCMini
from litex.soc.interconnect import wishbone

from embed import design
from embed.litex_blocks import MAP_BYTES, MoireAxis, MoireNode
from embed.litex_parts import NAME
from firmware.build import MEMORY_BYTES

CLK_HZ = 8_000_000
AXIS_AT = 0x9000_0000
AXIS_PINS = ("encoder_a", "encoder_b", "estop_open", "bridge_a", "bridge_b", "drive_enable")
NODE_PINS = ("rs485_rx", "rs485_tx", "rs485_driver_enable", "estop_open")
# levels at which nothing happens: no fault, no switch, an idle line
HIGH = {"drive_fault_n", "i2c_scl", "i2c_sda", "keyboard_clock", "keyboard_data", "edm_clock"}
HIGH |= {"edm_data", "peer_rx", "sensor_rx", "link_rx", "link_cs_n"}


def idle(module: str, pins: tuple[str, ...]) -> dict[str, int]:
    """Levels of the inputs of a module that have no pin here."""
    return {
        name: int(name in HIGH)
        for name, port in design.ports(module).items()
        if port.direction == "input" and name not in pins and name not in ("clk", "rst", "address")
        if not name.startswith("wb_")
    }


def pads(name: str, module: str, pins: tuple[str, ...]) -> tuple[Any, ...]:
    """The pads of a module as LiteX describes them."""
    widths = design.widths(module)
    return (name, 0, *(Subsignal(pin, Pins(widths[pin])) for pin in pins))


class MotionSoC(SoCMini):
    """The SoC, whose bus has three devices: CSRs, the axis, and the node by its CSRs."""

    def __init__(self, platform: Any, firmware: str) -> None:
        super().__init__(platform, CLK_HZ, bus_standard="wishbone")
        self.crg = CRG(platform.request("clk"), platform.request("rst"))
        master = wishbone.Interface(data_width=32, adr_width=30, addressing="word")
        self.comb += master.connect_to_pads(platform.request("wb"), mode="slave")
        self.bus.add_master("processor", master)
        self.axis = MoireAxis(
            platform,
            CLK_HZ,
            platform.request("axis"),
            idle("axis_on_wishbone", AXIS_PINS),
            TICK_HZ=4000,
            HAS_STEPPER=0,
        )
        self.bus.add_slave(
            "axis", self.axis.bus, SoCRegion(origin=AXIS_AT, size=MAP_BYTES, cached=False)
        )
        self.node = MoireNode(
            platform,
            CLK_HZ,
            platform.request("node"),
            idle("node", NODE_PINS),
            FIRMWARE=firmware,
            MEMORY_BYTES=MEMORY_BYTES,
            AXES=1,
            HAS_SINE=0,
            HAS_DRIVE=0,
        )


def write(folder: Path, firmware: str) -> None:
    """Write the SoC and its map."""
    io = [
        ("clk", 0, Pins(1)),
        ("rst", 0, Pins(1)),
        *wishbone.Interface(data_width=32, adr_width=30).get_ios("wb"),
        pads("axis", "axis_on_wishbone", AXIS_PINS),
        pads("node", "node", NODE_PINS),
    ]
    platform = GenericPlatform("simulation", io, name=NAME)
    soc = MotionSoC(platform, firmware)
    soc.finalize()
    folder.mkdir(parents=True, exist_ok=True)
    text = design.FOREIGN_STYLE + str(platform.get_verilog(soc, name=NAME))
    (folder / f"{NAME}.sv").write_text(text, encoding="utf-8")
    regions = export.get_csr_json(soc.csr_regions, soc.constants, soc.mem_regions)
    (folder / f"{NAME}.json").write_text(regions, encoding="utf-8")


def main() -> int:
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    write(Path(sys.argv[1]), sys.argv[2])
    return 0


if __name__ == "__main__":
    sys.exit(main())
