# SPDX-License-Identifier: Apache-2.0
"""A board: what constraints/NAME/board.toml says of its FPGA, clock, pads and connectors."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from boards.family import FAMILIES, Part
from boards.toml_file import ROOT, Misfit, Table, read
from firmware.build import CODE_BYTES

FOLDER = ROOT / "constraints"
# what a LED may show; the texts are expressions of the top that is made
LEDS = ("running", "sending", "estop", "limit_high", "limit_low", "drive_fault", "step", "drive_on")
# pads of the board that the node may use besides its connectors
ON_BOARD = {
    "usb_rx": "in",
    "usb_tx": "out",
    "flash_cs_n": "out",
    "flash_sclk": "out",
    "flash_mosi": "out",
    "flash_miso": "in",
}
FLASH = tuple(name for name in ON_BOARD if name.startswith("flash"))
# pads of an Ethernet PHY, by the interface: how many, and their direction
ETHERNET = {
    "mii": {
        **{"reference": (1, "out"), "reset_n": (1, "out")},
        **{"rx_clk": (1, "in"), "rx_dv": (1, "in"), "rx_data": (4, "in")},
        **{"tx_clk": (1, "in"), "tx_en": (1, "out"), "tx_data": (4, "out")},
    },
    "rgmii": {
        **{"rx_clk": (1, "in"), "rx_ctl": (1, "in"), "rx_data": (4, "in")},
        **{"tx_clk": (1, "out"), "tx_ctl": (1, "out"), "tx_data": (4, "out")},
    },
}
OF_THE_TOP = ("reference", "reset_n")  # of these, what the top drives and not the Ethernet core
ETHERNET_HZ = {"mii": 25_000_000, "rgmii": 125_000_000}  # of its clocks
ETHERNET_FAMILIES = {"mii": ("ecp5", "xc7"), "rgmii": ("ecp5",)}  # for which LiteEth makes its core
MOST_FLASH = 1 << 24  # bytes that a command of three bytes of address reaches
MOST_HZ = 1_000_000_000  # of a clock
MOST_DELAY_NS = 3.1  # of a pin of the ECP5
PULLS = ("up", "down", "none")
DIRECTIONS = ("both", "in", "out")


@dataclass(frozen=True)
class Pad:
    """One pin of the package and what is known of its other end."""

    ball: str
    place: str  # `J1 gp0`, or the name of what is on the board
    direction: str = "both"  # both, in or out
    volts: float = 3.3  # level of an output; highest level of an input
    pull: str = "none"
    through: str = ""  # a buffer in between
    pulled_up: bool = False  # by the board, also before the configuration
    fast: bool = False  # of an output: strong and fast edges


@dataclass(frozen=True)
class Loader:
    """How openFPGALoader reaches the part and its flash."""

    board: str  # its name of the board
    cable: str  # its name of the cable; empty: that of the board
    sram: bool  # False: the part takes its configuration from the flash only
    flash_offset: int  # byte address of the bitstream in the flash

    @property
    def target(self) -> str:
        """The target of make that loads a bitstream."""
        return "load" if self.sram else "flash"


@dataclass(frozen=True)
class Code:
    """Where the part of a firmware is that a soft core executes from the flash of the board."""

    offset: int  # its byte address, behind the bitstream
    loader: list[str]  # options of openFPGALoader that choose this flash


@dataclass(frozen=True)
class Ethernet:
    """The PHY of a board."""

    interface: str
    tx_delay_ns: float  # by which the FPGA delays the clock to the PHY, with rgmii
    rx_delay_ns: float  # by which it delays the data from the PHY
    pads: dict[str, Pad]  # by the port of the top
    ports: dict[str, str]  # {pads of the Ethernet core: ports of the top}

    @property
    def hz(self) -> int:
        """Of the clocks of the interface."""
        return ETHERNET_HZ[self.interface]

    @property
    def has_reference(self) -> bool:
        """Whether it takes its own clock from the FPGA."""
        return "eth_reference" in self.pads

    @property
    def clocks(self) -> list[str]:
        """Ports of the top at which the PHY gives a clock."""
        return [
            port
            for port, pad in self.pads.items()
            if port.endswith("_clk") and pad.direction == "in"
        ]


@dataclass(frozen=True)
class Board:
    """A board file that has been checked by itself."""

    name: str
    file: str
    title: str
    layout: str  # boards of one layout have the same connectors
    sources: list[str]
    loader: Loader
    code: Code | None  # None: no soft core executes anything from its flash
    part: Part
    clock: Pad
    clock_hz: int
    clock_ppm: float
    node_hz: int
    pll_pad: bool  # the pin of the clock is an input of the PLL itself
    on_board: dict[str, Pad]
    ethernet: Ethernet | None
    address: list[Pad]  # switches, bit 0 first
    leds: dict[str, Pad]
    leds_low: bool  # True: a LED is on when its pin is low
    connectors: dict[str, dict[str, Pad]]
    buffer: str  # part of the buffers behind buffered connectors
    turned: Pad | None  # what a pin of a turned connector is like
    turning: str  # how buffers are turned
    notes: list[str]

    def pads(self) -> Iterator[Pad]:
        yield self.clock
        yield from self.on_board.values()
        yield from self.ethernet.pads.values() if self.ethernet else ()
        yield from self.address
        yield from self.leds.values()
        for pins in self.connectors.values():
            yield from pins.values()


@cache
def package_pins(family: str, device: str, package: str) -> frozenset[str]:
    """The pins of a package that a design may use; empty if the family has no such package."""
    return FAMILIES[family].package_pins(device, package)


def part_of(table: Table) -> Part:
    family = table.take("family", str)
    if family not in FAMILIES:
        raise table.misfit(f"family {family!r} is none of {', '.join(FAMILIES)}")
    node = table.table("node")
    part = Part(
        family=FAMILIES[family],
        name=table.take("name", str),
        device=table.take("device", str),
        package=table.take("package", str),
        speed=table.take("speed", int, 0),
        lut=table.take("lut", int),
        block_ram=table.take("block_ram", int),
        synthesis=table.take("synthesis", str, ""),
        place=table.words("place"),
        pack=table.words("pack"),
        node={key: node.take(key, str) for key in list(node.left)},
    )
    table.close()
    if not package_pins(family, part.device, part.package):
        raise table.misfit(f"a {family} {part.device} has no package {part.package}")
    return part


def loader_of(table: Table) -> Loader:
    loader = Loader(
        table.take("board", str),
        table.take("cable", str, ""),
        table.take("sram", bool, True),
        table.take("flash_offset", int, 0),
    )
    table.close()
    return loader


def code_of(table: Table) -> Code | None:
    """The place of [code]; None if there is no such table."""
    if not table.left:
        return None
    code = Code(table.take("offset", int), table.words("loader"))
    table.close()
    if code.offset % CODE_BYTES or not 0 < code.offset <= MOST_FLASH - CODE_BYTES:
        raise table.misfit(
            f"offset {code.offset} must be a multiple of {CODE_BYTES}, above 0 and below "
            f"{MOST_FLASH}"
        )
    return code


def pull_of(table: Table) -> str:
    pull = table.take("pull", str, "none")
    if pull not in PULLS:
        raise table.misfit(f"pull {pull!r} is none of {', '.join(PULLS)}")
    return pull


def ethernet_of(table: Table) -> Ethernet | None:
    """The PHY of [ethernet]; None if there is no such table."""
    if not table.left:
        return None
    interface = table.take("interface", str)
    if interface not in ETHERNET:
        raise table.misfit(f"interface {interface!r} is none of {', '.join(ETHERNET)}")
    tx = rx = 0.0
    if interface == "rgmii":
        tx, rx = table.take("tx_delay_ns", float), table.take("rx_delay_ns", float)
    if not (0 <= tx <= MOST_DELAY_NS and 0 <= rx <= MOST_DELAY_NS):
        raise table.misfit(f"tx_delay_ns and rx_delay_ns must be 0 to {MOST_DELAY_NS:g}")
    pads: dict[str, Pad] = {}
    ports: dict[str, str] = {}
    for name, (count, direction) in ETHERNET[interface].items():
        balls = table.words(name)
        if len(balls) != count:
            raise table.misfit(f"{name} must name {count} pin{'s' * (count > 1)}")
        numbered = [f"eth_{name}" + (f"_{n}" if count > 1 else "") for n in range(count)]
        pads |= {
            # low at the end of the reset, rx_dv also chooses mii of a PHY that has rmii, too
            port: Pad(
                ball,
                f"PHY {name}",
                direction,
                pull="down" if name == "rx_dv" else "none",
                fast=True,
            )
            for port, ball in zip(numbered, balls, strict=True)
        }
        if name in OF_THE_TOP:
            continue
        inside = {"rx_clk": "clocks_rx", "tx_clk": "clocks_tx"}.get(name, f"pads_{name}")
        joined = ", ".join(reversed(numbered))
        ports[inside] = f"{{{joined}}}" if count > 1 else joined
    table.close()
    return Ethernet(interface, tx, rx, pads, ports)


def connector_of(table: Table, name: str, buffer: str) -> dict[str, Pad]:
    """{pin: pad} of a connector."""
    direction = table.take("direction", str, "both")
    if direction not in DIRECTIONS:
        raise table.misfit(f"direction {direction!r} is none of {', '.join(DIRECTIONS)}")
    buffered = table.take("buffered", bool, False)
    if buffered and not buffer:
        raise table.misfit("buffered: the board has no table [buffer]")
    pulled_up = table.take("pulled_up", bool, False)
    volts, pins = table.take("volts", float), table.table("pins", needed=True)
    found = {
        pin: Pad(
            pins.take(pin, str),
            f"{name} {pin}",
            direction,
            volts,
            # the pull-up of the FPGA keeps an open input high, but not the far side of a buffer
            "none" if buffered else "up",
            buffer if buffered else "",
            pulled_up,
        )
        for pin in list(pins.left)
    }
    table.close()
    return found


def check_balls(board: Board) -> None:
    """Refuses pins that the package lacks."""
    known = package_pins(board.part.family.name, board.part.device, board.part.package)
    for pad in board.pads():
        if pad.ball not in known:
            raise Misfit(
                f"{board.file}: {pad.place}: the package {board.part.package} of "
                f"{board.part.name} has no pin {pad.ball}"
            )


def check_phy(board: Board) -> None:
    """Refuses a PHY that the part cannot serve."""
    phy, family = board.ethernet, board.part.family.name
    if phy is None:
        return
    if family not in ETHERNET_FAMILIES[phy.interface]:
        raise Misfit(
            f"{board.file}: [ethernet] {phy.interface} is not built for the family {family}"
        )
    if phy.has_reference and board.node_hz != 2 * phy.hz:
        raise Misfit(
            f"{board.file}: [clock] node_hz must be {2 * phy.hz}: the reference of the PHY is half "
            "of it"
        )


def names() -> list[str]:
    """All boards of the project."""
    return sorted(path.parent.name for path in FOLDER.glob("*/board.toml"))


def load(path: Path) -> Board:
    """The board of a board file."""
    table = read(path)
    buffer = table.table("buffer")
    clock, switches, leds = table.table("clock", True), table.table("address"), table.table("leds")
    on_board, connectors = table.table("on_board"), table.table("connector")
    title = table.take("title", str)
    fitted = bool(buffer.left)
    buffer_part = buffer.take("part", str) if fitted else ""
    turned = Pad("", "", "in", buffer.take("turned_volts", float)) if fitted else None
    turning = buffer.take("turning", str) if fitted else ""
    switch_pull = pull_of(switches)
    led_names = [name for name in leds.left if name != "low_is_on"]
    for name in led_names:
        if name not in LEDS:
            raise leds.misfit(f"{name} is none of {', '.join(LEDS)}")
    for name in on_board.left:
        if name not in ON_BOARD:
            raise on_board.misfit(f"{name} is none of {', '.join(ON_BOARD)}")
    board = Board(
        name=path.parent.name,
        file=table.file,
        title=title,
        layout=table.take("layout", str),
        sources=table.words("sources"),
        loader=loader_of(table.table("loader", True)),
        code=code_of(table.table("code")),
        part=part_of(table.table("part", True)),
        clock=Pad(clock.take("pin", str), "clock", "in"),
        clock_hz=clock.within("hz", 1, MOST_HZ),
        clock_ppm=clock.take("ppm", float),
        node_hz=clock.within("node_hz", 1, MOST_HZ),
        pll_pad=clock.take("pll_pad", bool, False),
        on_board={
            name: Pad(
                on_board.take(name, str),
                name,
                ON_BOARD[name],
                pull="up" if name.endswith("rx") else "none",
            )
            for name in list(on_board.left)
        },
        ethernet=ethernet_of(table.table("ethernet")),
        address=[
            Pad(ball, f"switch {n}", "in", pull=switch_pull)
            for n, ball in enumerate(switches.words("pins"))
        ],
        leds={name: Pad(leds.take(name, str), f"LED {name}", "out") for name in led_names},
        leds_low=leds.take("low_is_on", bool, False),
        connectors={
            name: connector_of(connectors.table(name), name, buffer_part)
            for name in list(connectors.left)
        },
        buffer=buffer_part,
        turned=turned,
        turning=turning,
        notes=table.words("notes"),
    )
    if len(board.address) not in (0, 4):
        raise switches.misfit("an address has 4 switches")
    for each in (buffer, clock, switches, table):
        each.close()
    check_balls(board)
    check_phy(board)
    return board


def named(name: str) -> Board:
    """A board of the project."""
    if name not in names():
        raise Misfit(f"there is no board {name!r}; there are: {', '.join(names())}")
    return load(FOLDER / name / "board.toml")
