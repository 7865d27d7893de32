# SPDX-License-Identifier: Apache-2.0
"""A machine on a board: each signal gets its pin, and what does not fit is refused."""

from dataclasses import dataclass, replace

from boards import clocks, size
from boards.board import FLASH, Board, Ethernet, Pad
from boards.family import Placer
from boards.machine import (
    DRIVES,
    FEATURES,
    LINKS,
    PERIPHERALS,
    SERIAL_LINK,
    SPI_LINK,
    Between,
    Machine,
    Signal,
    Wiring,
)
from boards.toml_file import Misfit, TooLarge
from firmware.build import CODE_BYTES

TICK_HZ = 4000  # servo tick that the firmware sets
LEAST_CODE_HZ = 15_000_000  # clock for firmware in the flash: a round of 73 000 cycles in 5 ms
SPRAM = "-spram"  # option of the synthesis: large memories are single-port RAMs of an iCE40
PLACEHOLDER = "placeholder"  # of the firmware; the name of its file


@dataclass(frozen=True)
class Connection:
    """A signal at a pin."""

    name: str  # X.step, rs485_rx
    signal: Signal
    pad: Pad
    between: Between

    @property
    def port(self) -> str:
        """Its name in the top."""
        return self.name.replace(".", "_").lower()


@dataclass(frozen=True)
class Design:
    """A machine on a board that it fits."""

    board: Board
    machine: Machine
    connections: list[Connection]
    parameters: dict[str, int | str]  # of the module of the machine
    pll: clocks.Pll | None  # None: the node runs at the clock of the board
    estimate: size.Size
    turned: list[str]  # connectors whose buffers were turned

    @property
    def name(self) -> str:
        return f"{self.board.name}-{self.machine.name}"

    @property
    def ethernet(self) -> Ethernet | None:
        """The PHY, if the machine has its link over Ethernet."""
        return self.board.ethernet if self.machine.ip_address else None

    @property
    def placer(self) -> Placer:
        """How its part is placed; refused if no open tool does."""
        found = self.board.part.family.placer
        if found is None:
            raise Misfit(f"{self.board.file}: no open tool places a {self.board.part.name}")
        return found

    @property
    def in_block_ram(self) -> bool:
        """Whether the firmware is in block RAMs of a placed design, which is then placed with a
        placeholder.
        """
        return has_placeholder(self.board, self.machine)

    @property
    def arguments(self) -> str:
        """What names it in a command of make."""
        return f"BOARD={self.board.name} MACHINE={self.machine.argument}"

    @property
    def firmware_address(self) -> int:
        """Byte address in the flash, behind the bitstream, of the firmware of a serial core, or of
        what a soft core executes from there.
        """
        return int(self.parameters["FLASH_START"])


def has_placeholder(board: Board, machine: Machine) -> bool:
    placer = board.part.family.placer
    return machine.core != "serial" and placer is not None and placer.contents is not None


def mask(machine: Machine, name: str) -> int:
    """Bit n: axis n has the drive or feature."""
    return sum(1 << n for n, axis in enumerate(machine.axes) if axis.has(name))


def link_parameters(machine: Machine) -> dict[str, int]:
    """The parameters of the node that choose the carrier of its link, and its PLL."""
    carrier = 1 if machine.ip_address else 2 if SPI_LINK in machine.peripherals else 0
    built = carrier or SERIAL_LINK in machine.peripherals
    chosen = {"LINK_CARRIER": carrier, "LINK_PLL": int(machine.link_pll)}
    return {"HAS_LINK": int(bool(built)), **{name: n for name, n in chosen.items() if n}}


def parameters(board: Board, machine: Machine) -> dict[str, int | str]:
    """The parameters of the node or of the relay."""
    if machine.orders:
        return {"K": machine.orders, "CLK_HZ": board.node_hz}
    found: dict[str, int | str] = {
        "CLK_HZ": board.node_hz,
        "AXES": len(machine.axes),
        "FILTERS": machine.filters,
        "SEGMENTS": machine.segments,
        "SCOPE_WORDS": machine.scope_words,
        "HAS_DRIVE": mask(machine, "drive"),
        **{name: mask(machine, drive) for drive, name in DRIVES.items()},
        **{name: mask(machine, feature) for feature, (name, _) in FEATURES.items()},
        **{
            name: int(each in machine.peripherals)
            for each, name in PERIPHERALS.items()
            if each not in LINKS
        },
        **link_parameters(machine),
        "HAS_SERIAL_CORE": int(machine.core == "serial"),
        "MEMORY_BYTES": 1024 * machine.memory_kib,
        "PROGRAM_BYTES": 32768,
        "FLASH_START": 131072,
        "HAS_UPDATE": int(machine.update),
        **board.part.node,
    }
    if machine.core == "flash" and board.code:
        found |= {"CODE_BYTES": CODE_BYTES, "FLASH_START": board.code.offset}
    if machine.core != "serial":
        words = PLACEHOLDER if has_placeholder(board, machine) else size.firmware_stem(machine)
        found["FIRMWARE"] = f"build/boards/{board.name}-{machine.name}/{words}.hex"
    return found


def wiring_for(board: Board, machine: Machine) -> Wiring:
    """The machine's wiring on this board."""
    if board.layout not in machine.wiring:
        layouts = ", ".join(machine.wiring) or "no board at all"
        raise Misfit(
            f"{machine.file}: has no [wiring.{board.layout}] for the board {board.name}; "
            f"it is wired for {layouts}"
        )
    return machine.wiring[board.layout]


def pad_of(board: Board, file: str, name: str, place: str, turned: list[str]) -> Pad:
    """The pad at a pin of a connector, as it is with the buffers that were turned."""
    connector, pin = place.split()
    if connector not in board.connectors:
        raise Misfit(
            f"{file}: {name}: {board.file} has no connector {connector}; "
            f"there are: {', '.join(board.connectors)}"
        )
    if pin not in board.connectors[connector]:
        raise Misfit(f"{file}: {name}: the connector {connector} of {board.file} has no pin {pin}")
    pad = board.connectors[connector][pin]
    if connector in turned and board.turned:
        return replace(pad, direction="in", volts=board.turned.volts)
    return pad


def check_direction(board: Board, machine: Machine, one: Connection) -> None:
    """Refuses an output on a pin for inputs only, and an input on one for outputs only."""
    if one.pad.direction not in ("both", one.signal.direction):
        words = {"in": "input", "out": "output", "both": "input and output"}
        behind = f" behind its buffer ({one.pad.through})" if one.pad.through else ""
        raise Misfit(
            f"{machine.file}: {one.name} is an {words[one.signal.direction]}, but {one.pad.place} "
            f"of {board.file} is an {words[one.pad.direction]} only{behind}"
        )


def check_turned(board: Board, machine: Machine, one: Connection) -> None:
    """Refuses an output on a net that a turned connector has as well: its buffers may drive it."""
    for name in wiring_for(board, machine).turned:
        for pad in board.connectors[name].values():
            if one.signal.direction != "in" and pad.ball == one.pad.ball:
                raise Misfit(
                    f"{machine.file}: {one.name} is an output, but {one.pad.place} is the same net "
                    f"as {pad.place} of {board.file}, whose buffers were turned"
                )


def check_enable(board: Board, machine: Machine, one: Connection) -> None:
    """Refuses an enable of a drive that is high before the configuration."""
    if one.pad.pulled_up and one.signal.group == "drive_enable":
        raise Misfit(
            f"{machine.file}: {one.name} must be low before the configuration, but {one.pad.place} "
            f"of {board.file} is pulled up by the board"
        )


def check_volts(board: Board, machine: Machine, one: Connection) -> None:
    """Refuses an input above the level that its pin takes, and an output of another level than the
    part behind it takes.
    """
    levels, pin = one.between.volts, one.pad.volts
    if one.signal.direction != "out" and max(levels) > pin:
        raise Misfit(
            f"{machine.file}: {one.name} comes with {max(levels):g} V, but {one.pad.place} of "
            f"{board.file} takes {pin:g} V at most"
        )
    if one.signal.direction == "out" and pin not in levels:
        asked = " or ".join(f"{level:g}" for level in levels)
        raise Misfit(
            f"{machine.file}: {one.name} needs {asked} V, but {one.pad.place} of {board.file} "
            f"gives {pin:g} V"
        )


def connected(board: Board, machine: Machine) -> list[Connection]:
    """All signals at their pins."""
    wiring, found = wiring_for(board, machine), []
    where = f"{machine.file}: [wiring.{board.layout}]"
    for name in wiring.turned:
        pads = board.connectors.get(name, {}).values()
        if not any(pad.through for pad in pads):
            raise Misfit(f"{where} turned: {board.file} has no buffers at a connector {name}")
    signals = machine.signals()
    if strange := [name for name in wiring.unused if name not in signals]:
        raise Misfit(f"{where} unused: {strange[0]} is no signal of this machine")
    signals = {name: signal for name, signal in signals.items() if name not in wiring.unused}
    if unknown := [name for name in wiring.pins if name not in signals]:
        raise Misfit(f"{where} {unknown[0]} is no signal of this machine, or it is in `unused`")
    for name, signal in signals.items():
        if name not in wiring.pins:
            raise Misfit(f"{where} {name} has no pin; if it is not connected, list it in `unused`")
        if signal.group not in wiring.between:
            raise Misfit(f"{machine.file}: {name} needs [between.{signal.group}]: part and volts")
        pad = pad_of(board, machine.file, name, wiring.pins[name], wiring.turned)
        if signal.direction == "out":
            pad = replace(pad, pull="none")
        found.append(Connection(name, signal, pad, wiring.between[signal.group]))
    return found


def used_on_board(board: Board, machine: Machine) -> list[Pad]:
    """The pads of the board itself that the node uses."""
    return [
        board.clock,
        *(pad for name, pad in board.on_board.items() if machine.has_flash or name not in FLASH),
        *(board.ethernet.pads.values() if board.ethernet and machine.ip_address else []),
        *board.address,
        *board.leds.values(),
    ]


def check_twice(board: Board, machine: Machine, connections: list[Connection]) -> None:
    """Refuses a pin that is used twice, by its own name or as another pin of the same net."""
    users: dict[str, tuple[str, str]] = {}
    for pad in used_on_board(board, machine):
        if pad.ball in users:
            raise Misfit(
                f"{board.file}: {pad.place} and {users[pad.ball][0]} are both on pin {pad.ball}"
            )
        users[pad.ball] = pad.place, pad.place
    for one in connections:
        if one.pad.ball in users:
            name, place = users[one.pad.ball]
            same = "" if place == one.pad.place else f" (the same net as {place} of {board.file})"
            raise Misfit(f"{machine.file}: {name} and {one.name} both use {one.pad.place}{same}")
        users[one.pad.ball] = one.name, one.pad.place


def check_bus(board: Board, machine: Machine) -> None:
    """Refuses a node that nobody can talk to."""
    on_usb = "usb_rx" in board.on_board and "usb_tx" in board.on_board
    unused = [*machine.unused, *wiring_for(board, machine).unused]
    for name in ("rs485_rx", "rs485_tx"):
        if not on_usb and name in unused:
            raise Misfit(f"{machine.file}: {board.file} has no USB serial port: connect {name}")


def check_ethernet(board: Board, machine: Machine) -> None:
    """Refuses a link over Ethernet on a board whose PHY is not known."""
    if machine.ip_address and not board.ethernet:
        raise Misfit(
            f"{machine.file}: [node.ethernet] needs a board with an Ethernet PHY, and {board.file} "
            "has no [ethernet]"
        )


def check_part(board: Board, machine: Machine, needed: size.Size) -> None:
    """Refuses what the part cannot hold, by estimate."""
    part, count = board.part, len(machine.axes)
    counted = f"{count} axis" if count == 1 else f"{count} axes"
    words = f"{counted} with {machine.memory_kib} KiB need"
    if machine.orders:
        words = f"a relay of {machine.orders} orders needs"
    for of_what, need, most in (
        ("block RAM", needed.block_ram, part.block_ram),
        ("LUT", needed.lut, part.lut),
    ):
        if need > most:
            raise TooLarge(
                f"{machine.file}: {words} about {need} {of_what}, but {part.name} of {board.file} "
                f"has {most}"
            )
    if machine.has_flash:
        reader = "relay" if machine.orders else f"node with core {machine.core!r}"
        if missing := [name for name in FLASH if name not in board.on_board]:
            raise Misfit(f"{machine.file}: a {reader} needs {missing[0]}, {board.file} has none")
    if machine.core == "serial" and not part.family.appendable:
        raise Misfit(
            f"{machine.file}: a serial core has its firmware behind the bitstream, which is a text "
            f"for {part.name} of {board.file}"
        )
    if machine.core == "flash" and board.code is None:
        raise Misfit(
            f"{machine.file}: core 'flash' needs [code] of {board.file}: where in the flash the "
            "firmware may be"
        )
    if machine.core == "flash" and board.node_hz < LEAST_CODE_HZ:
        raise Misfit(
            f"{machine.file}: core 'flash' needs a clock of {LEAST_CODE_HZ} Hz at least, but "
            f"{board.file} has {board.node_hz} Hz"
        )
    cycles = board.node_hz // TICK_HZ
    if (taken := size.tick_cycles(machine)) > cycles:
        raise Misfit(
            f"{machine.file}: a servo tick of {len(machine.axes)} axes takes {taken} cycles, but "
            f"{board.file} has {cycles} at {board.node_hz} Hz"
        )


def fit(board: Board, machine: Machine) -> Design:
    """The machine on the board; Misfit states in one line what does not fit."""
    connections = connected(board, machine)
    check_twice(board, machine, connections)
    for one in connections:
        check_direction(board, machine, one)
        check_turned(board, machine, one)
        check_enable(board, machine, one)
        check_volts(board, machine, one)
    check_bus(board, machine)
    check_ethernet(board, machine)
    interface = board.ethernet.interface if board.ethernet else ""
    spram = SPRAM in board.part.synthesis.split()
    needed = size.estimate(board.part.family.name, machine, interface, spram)
    check_part(board, machine, needed)
    pll = clocks.pll(board.part.family.plls, board.clock_hz, board.node_hz, board.file)
    turned = wiring_for(board, machine).turned
    return Design(board, machine, connections, parameters(board, machine), pll, needed, turned)
