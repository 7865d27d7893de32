# SPDX-License-Identifier: Apache-2.0
"""A machine: what a machine file (constraints/machines/NAME.toml) says of its axes, of what is
between them and the board, and of the pins that they are on. The host reads names, units and
parameters of axes from the same file (moire.description).
"""

import ipaddress
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from boards import front_ends
from boards.toml_file import ROOT, Misfit, Table, read, shown
from firmware.build import CORES, IMAGES
from moire import description
from moire.bus.protocol import MOST_AXES
from moire.errors import BadFile

FOLDER = ROOT / "constraints" / "machines"


@dataclass(frozen=True)
class Signal:
    """A signal of an axis or of the node at a pin."""

    direction: str  # in or out, of the FPGA; both: it only pulls low
    group: str  # signals of one group go through the same part, [between.GROUP]
    meaning: str
    idle: int = 0  # level of an input that is not connected
    needs: str = ""  # drive or feature of the axis, or peripheral; empty: it is always there


DRIVES = {"bridge": "HAS_BRIDGE", "stepper": "HAS_STEPPER", "dac": "HAS_DAC"}
PERIPHERALS = {  # of a node: its parameter of rtl/node.sv
    "i2c": "HAS_I2C",
    "ps2": "HAS_PS2",
    "peer": "HAS_PEER",
    "angle_sensor": "HAS_ANGLE_SENSOR",
    "display": "HAS_DISPLAY",
    "status_inputs": "HAS_STATUS_INPUTS",
    "link": "HAS_LINK",
    "link_spi": "HAS_LINK",
}
SERIAL_LINK, SPI_LINK = LINKS = ("link", "link_spi")  # a node has one of them
FEATURES = {  # of an axis: its parameter of rtl/node.sv, and the feature that it needs
    "sine": ("HAS_SINE", ""),
    "own_chain": ("HAS_OWN_CHAIN", "sine"),
    "monitor": ("HAS_MONITOR", "sine"),
    "harmonics": ("HAS_HARMONICS", "sine"),
    "recorder": ("HAS_RECORDER", "sine"),
    "segments": ("HAS_SEGMENTS", ""),
    "capture": ("HAS_CAPTURE", ""),
    "compare": ("HAS_COMPARE", ""),
    "encoder_check": ("HAS_ENCODER_CHECK", ""),
    "velocity": ("HAS_VELOCITY", ""),
    "filters": ("HAS_FILTERS", "drive"),
    "fine_stage": ("HAS_FINE_STAGE", "dac"),
    "set_points": ("HAS_SET_POINTS", "drive"),
    "backlash": ("HAS_BACKLASH", "drive"),
}
AXIS_SIGNALS = {
    "encoder_a": Signal("in", "encoder", "A of the scale"),
    "encoder_b": Signal("in", "encoder", "B of the scale"),
    "encoder_z": Signal("in", "encoder", "index of the scale"),
    "probe_0": Signal("in", "probe", "touch probe 0"),
    "probe_1": Signal("in", "probe", "touch probe 1"),
    "adc_sin": Signal("in", "adc", "sine, synchronous to adc_sclk", needs="sine"),
    "adc_cos": Signal("in", "adc", "cosine, synchronous to adc_sclk", needs="sine"),
    "adc_cs_n": Signal("out", "adc", "low during a conversion", needs="sine"),
    "adc_sclk": Signal("out", "adc", "clock of the ADC, idles high", needs="sine"),
    "compare_pulse": Signal("out", "compare", "high during a compare pulse", needs="compare"),
    "limit_low_open": Signal("in", "limit", "1: pressed or wire cut", needs="drive"),
    "limit_high_open": Signal("in", "limit", "1: pressed or wire cut", needs="drive"),
    "drive_fault_n": Signal("in", "drive_fault", "0: fault of the drive", 1, "drive"),
    "drive_enable": Signal("out", "drive_enable", "1: the drive may be on", needs="drive"),
    "bridge_a": Signal("out", "bridge", "alone high for a positive command", needs="bridge"),
    "bridge_b": Signal("out", "bridge", "alone high for a negative command", needs="bridge"),
    "step": Signal("out", "stepper", "step", needs="stepper"),
    "direction": Signal("out", "stepper", "direction", needs="stepper"),
    "dac_cs_n": Signal("out", "dac", "low during a word", needs="dac"),
    "dac_sclk": Signal("out", "dac", "clock of the DAC, idles low", needs="dac"),
    "dac_sdi": Signal("out", "dac", "data of the DAC", needs="dac"),
}
NODE_SIGNALS = {
    "rs485_rx": Signal("in", "rs485", "receiver of the bus, idles high", 1),
    "rs485_tx": Signal("out", "rs485", "driver of the bus, idles high"),
    "rs485_driver_enable": Signal("out", "rs485", "1: drive the bus"),
    "estop_open": Signal("in", "estop", "1: emergency stop pressed or wire cut", needs="drive"),
    "link_rx": Signal("in", "link", "line of the real-time link, idles high", 1, "link"),
    "link_tx": Signal("out", "link", "line of the real-time link, idles high", needs="link"),
    "link_driver_enable": Signal("out", "link", "1: drive the line", needs="link"),
    "link_cs_n": Signal("in", "link_spi", "chip select of the host, idles high", 1, "link_spi"),
    "link_sclk": Signal("in", "link_spi", "clock of the host, idles low", needs="link_spi"),
    "link_mosi": Signal("in", "link_spi", "data of the host", needs="link_spi"),
    "link_miso": Signal("out", "link_spi", "data to the host, always driven", needs="link_spi"),
    "i2c_scl": Signal("both", "i2c", "clock of the I2C bus", 1, "i2c"),
    "i2c_sda": Signal("both", "i2c", "data of the I2C bus", 1, "i2c"),
    "keyboard_clock": Signal("both", "keyboard", "clock of the keyboard", 1, "ps2"),
    "keyboard_data": Signal("both", "keyboard", "data of the keyboard", 1, "ps2"),
    "edm_clock": Signal("both", "edm", "clock to the PC that has the keyboard", 1, "ps2"),
    "edm_data": Signal("both", "edm", "data to the PC that has the keyboard", 1, "ps2"),
    "peer_rx": Signal("in", "peer", "from the other controller, idles high", 1, "peer"),
    "peer_tx": Signal("out", "peer", "to the other controller, idles high", needs="peer"),
    "sensor_rx": Signal("in", "sensor", "frames of the angle, idles high", 1, "angle_sensor"),
    "display_cs_n": Signal("out", "display", "low during a word", needs="display"),
    "display_sclk": Signal("out", "display", "clock of the display, idles low", needs="display"),
    "display_data": Signal("out", "display", "data of the display", needs="display"),
    "edm_cutting": Signal("in", "edm_status", "1: the machine cuts", needs="status_inputs"),
    "edm_alarm": Signal("in", "edm_status", "1: the machine needs somebody", needs="status_inputs"),
}
RELAY_SIGNALS = {
    **{name: AXIS_SIGNALS[name] for name in ("encoder_a", "encoder_b", "encoder_z")},
    "relay_a": Signal("out", "relay", "A to the controller"),
    "relay_b": Signal("out", "relay", "B to the controller"),
    "relay_z": Signal("out", "relay", "index to the controller"),
    "correcting": Signal("out", "status", "1: the output is corrected"),
    "fault": Signal("out", "status", "1: a flag is set"),
    **{name: NODE_SIGNALS[name] for name in ("rs485_rx", "rs485_tx", "rs485_driver_enable")},
}
SIGNALS = AXIS_SIGNALS | NODE_SIGNALS | RELAY_SIGNALS
GROUPS = sorted({signal.group for signal in SIGNALS.values()})
SCOPE_WORDS = [1 << n for n in range(8, 17)]  # of the recorder of ticks
SCOPE_IMAGES = ("axis", "stream")  # whose firmware has its requests
STREAM_IMAGES = ("stream", "steps_stream")  # whose firmware supervises set-points
LOCAL_MAC = 0x024D  # the first two bytes of MAC addresses that we choose ourselves
MOST_ORDERS = 16  # of a relay whose timing and size are known
MOST_KIB, MOST_SEGMENTS = 4096, 255  # memory; segments of an axis
MOST_FILTERS = 2  # biquads of an axis that have parameters; the engine has room for four
LEAST_SEGMENTS = 3
OF_THE_TOP = ("led", "node")  # names that its own pins and signals begin with


@dataclass(frozen=True)
class Axis:
    """One axis: what it is built with and which of its signals are not connected."""

    name: str
    drives: list[str]
    features: list[str]
    unused: list[str]

    def has(self, name: str) -> bool:
        """Whether it has a drive or a feature; `drive` is any drive, the empty name everything."""
        if name == "drive":
            return bool(self.drives)
        if name == "velocity" and self.drives:
            return True
        return name in ("", *self.drives, *self.features)

    def signals(self) -> Iterator[str]:
        """The names of the signals that it has, connected or not."""
        return (name for name, signal in AXIS_SIGNALS.items() if self.has(signal.needs))


@dataclass(frozen=True)
class Between:
    """What is between the pins of a group of signals and the machine."""

    part: str
    volts: list[float]  # levels on the side of the board: given to inputs, taken from outputs
    front_end: str = ""  # of constraints/front_ends; empty: the part is enough


@dataclass(frozen=True)
class Wiring:
    """The pins of a machine on the boards of one layout."""

    pins: dict[str, str]  # {signal, `X.step` or `rs485_rx`: `CONNECTOR PIN`}
    turned: list[str]  # connectors whose buffers were turned into inputs
    unused: list[str]  # signals of the machine that are not connected on these boards
    between: dict[str, Between]


@dataclass(frozen=True)
class Machine:
    """A machine file that has been checked by itself: a node with its axes, or a relay."""

    name: str
    file: str
    title: str
    orders: int  # of the relay; 0: the machine is a node
    image: str  # firmware; a relay has none
    core: str  # soft, serial, or flash: a soft core that executes a part of it from the flash
    memory_kib: int
    update: bool  # of the firmware over the bus, into the flash of a serial core
    address: int  # on the bus, where the board has no switches
    filters: int
    segments: int
    scope_words: int  # memory of the recorder of ticks; 0: none
    axes: list[Axis]
    peripherals: list[str]
    ip_address: str  # of the real-time link over Ethernet; empty: it is not over Ethernet
    link_pll: bool  # the real-time link has a PLL
    unused: list[str]  # signals of the node that are not connected
    wiring: dict[str, Wiring]  # by layout

    @property
    def argument(self) -> str:
        """What names it in a command of make."""
        own = FOLDER / f"{self.name}.toml"
        return self.name if self.file == shown(own) else self.file

    @property
    def module(self) -> str:
        """The module of rtl/ that it is."""
        return "relay" if self.orders else "node"

    @property
    def ip_number(self) -> int:
        """The IP address as a number of 32 bits."""
        return int(ipaddress.IPv4Address(self.ip_address))

    @property
    def mac_address(self) -> int:
        """The MAC address as a number of 48 bits: locally administered, of the IP address."""
        return LOCAL_MAC << 32 | self.ip_number

    @property
    def has_flash(self) -> bool:
        """Whether it reads the flash of the board: firmware, or coefficients of a relay."""
        return self.core in ("serial", "flash") or self.orders > 0

    def signals(self) -> dict[str, Signal]:
        """{name: signal} of all its signals that are to be connected."""
        if self.orders:
            return {n: signal for n, signal in RELAY_SIGNALS.items() if n not in self.unused}
        present = ["", *self.peripherals, *["drive"] * any(axis.drives for axis in self.axes)]
        found = {
            name: signal
            for name, signal in NODE_SIGNALS.items()
            if name not in self.unused and signal.needs in present
        }
        for axis in self.axes:
            found |= {
                f"{axis.name}.{name}": AXIS_SIGNALS[name]
                for name in axis.signals()
                if name not in axis.unused
            }
        return found


def axis_of(table: Table) -> Axis:
    axis = Axis(
        table.take("name", str),
        table.chosen("drives", DRIVES),
        table.chosen("features", FEATURES),
        table.chosen("unused", AXIS_SIGNALS),
    )
    for name in ("linuxcnc", "unit", "parameters"):  # linuxcnc_config and the host read them
        table.left.pop(name, None)
    table.close()
    if not axis.name.isidentifier() or not axis.name.isascii():
        raise table.misfit(f"name {axis.name!r} must consist of letters, digits and _")
    if axis.name.lower() in OF_THE_TOP:
        raise table.misfit(f"name {axis.name!r} is taken: signals of the top begin with it")
    for name in axis.features:
        needed = FEATURES[name][1]
        if not axis.has(needed):
            raise table.misfit(f"the feature {name} of axis {axis.name} needs {needed}")
    for name in axis.unused:
        if name not in axis.signals():
            raise table.misfit(f"unused: axis {axis.name} has no {name} anyway")
    return axis


def check_front_end(table: Table, group: str, between: Between) -> None:
    """Refuses a front end that is unknown, for other signals or for other levels."""
    if between.front_end not in front_ends.names():
        raise table.misfit(front_ends.unknown(between.front_end))
    found = front_ends.named(between.front_end)
    if group not in found.groups:
        raise table.misfit(f"the front end {found.name} is for {', '.join(found.groups)}")
    if not set(between.volts) <= set(found.volts):
        levels = " or ".join(f"{volts:g}" for volts in found.volts)
        raise table.misfit(f"the front end {found.name} has {levels} V at the board")


def ip_address_of(table: Table) -> str:
    """The address of [node.ethernet]; empty if there is no such table."""
    if not table.left:
        return ""
    found = table.take("address", str)
    table.close()
    try:
        address = ipaddress.IPv4Address(found)
    except ValueError:
        raise table.misfit(f"address {found!r} is no IP address such as 192.168.1.50") from None
    if address.is_multicast or address.is_unspecified or address.is_loopback or address.is_reserved:
        raise table.misfit(f"address {found!r} is none that a node may have")
    return found


def between_of(table: Table) -> dict[str, Between]:
    found = {}
    for group in list(table.left):
        if group not in GROUPS:
            raise table.misfit(f"{group} is none of {', '.join(GROUPS)}")
        row = table.table(group)
        levels = row.left.pop("volts", None)
        volts = levels if isinstance(levels, list) else [levels]
        if not volts or not all(type(v) in (int, float) and 0 < v < math.inf for v in volts):
            raise row.misfit("volts must be a number above 0 or a list of such numbers")
        part, front_end = row.take("part", str), row.take("front_end", str, "")
        found[group] = Between(part, [float(v) for v in volts], front_end)
        row.close()
        if front_end:
            check_front_end(row, group, found[group])
    return found


def wiring_of(table: Table, between: dict[str, Between]) -> Wiring:
    """The wiring of a layout; its own [between] tables replace those of the machine."""
    turned, own = table.words("turned"), between_of(table.table("between"))
    unused = table.words("unused")
    pins: dict[str, str] = {}
    for key, value in table.left.items():
        found: dict[str, Any] = (
            {f"{key}.{name}": pin for name, pin in value.items()}
            if isinstance(value, dict)
            else {key: value}
        )
        for name, pin in found.items():
            if not isinstance(pin, str) or len(pin.split()) != 2:
                raise table.misfit(f'{name}: a pin is written "CONNECTOR PIN", not {pin!r}')
            pins[name] = " ".join(pin.split())
    return Wiring(pins, turned, unused, between | own)


def check(machine: Machine) -> None:
    """Refuses what contradicts itself, whatever board it is."""
    file, names = machine.file, [axis.name for axis in machine.axes]
    if machine.orders:
        if names:
            raise Misfit(f"{file}: a relay has no [[axis]], but {names[0]} is one")
        return
    if not 1 <= len(names) <= MOST_AXES:
        raise Misfit(f"{file}: {len(names)} axes; a node has 1 to {MOST_AXES}")
    ports = [name.lower() for name in names]
    if twice := [name for name in names if ports.count(name.lower()) > 1]:
        raise Misfit(
            f"{file}: two axes have the name {twice[-1]}, as their pins are in small letters"
        )
    if machine.image not in IMAGES:
        raise Misfit(f"{file}: [node] image {machine.image!r} is none of {', '.join(IMAGES)}")
    image = IMAGES[machine.image]
    if len(names) > image.most_axes:
        raise Misfit(f"{file}: the image {machine.image} serves {image.most_axes} axes at most")
    driven = [axis.name for axis in machine.axes if axis.drives]
    if driven and not image.drives:
        raise Misfit(f"{file}: the image {machine.image} has no drives, but axis {driven[0]} has")
    if not 1 <= machine.address <= 15:
        raise Misfit(f"{file}: [node] address {machine.address} must be 1 to 15")
    if 0 < machine.segments < LEAST_SEGMENTS:
        raise Misfit(
            f"{file}: [node] segments = {machine.segments}: a table has {LEAST_SEGMENTS} at least"
        )
    for size, feature in ((machine.segments, "segments"), (machine.filters, "filters")):
        with_it = [axis.name for axis in machine.axes if feature in axis.features]
        if bool(size) != bool(with_it):
            raise Misfit(
                f"{file}: [node] {feature} = {size}, but "
                f"{f'axis {with_it[0]} has' if with_it else 'no axis has'} the feature {feature}"
            )
    links = [name for name in LINKS if name in machine.peripherals]
    if len(links) + bool(machine.ip_address) > 1:
        raise Misfit(
            f"{file}: [node.ethernet] is the real-time link over Ethernet, the peripheral "
            f"{SERIAL_LINK} the one over a serial line, {SPI_LINK} the one over SPI: a node has "
            "one of them"
        )
    if machine.link_pll and not links and not machine.ip_address:
        raise Misfit(f"{file}: [node] link_pll needs a real-time link")
    if machine.scope_words and machine.scope_words not in SCOPE_WORDS:
        raise Misfit(
            f"{file}: [node] scope_words = {machine.scope_words} must be 0 or a power of two from "
            f"{SCOPE_WORDS[0]} to {SCOPE_WORDS[-1]}"
        )
    if machine.scope_words and machine.image not in SCOPE_IMAGES:
        raise Misfit(
            f"{file}: [node] scope_words needs image {' or '.join(SCOPE_IMAGES)}: "
            f"{machine.image} does not record ticks"
        )
    followers = [axis.name for axis in machine.axes if "set_points" in axis.features]
    if followers and machine.image not in STREAM_IMAGES:
        raise Misfit(
            f"{file}: the feature set_points of axis {followers[0]} needs image "
            f"{' or '.join(STREAM_IMAGES)}: {machine.image} does not play streams"
        )


def names() -> list[str]:
    """All machines of the project."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def check_for_host(content: dict[str, Any], file: str) -> None:
    """Refuses what the host would not understand in a file: port, units, parameters."""
    try:
        description.parse(content, file)
    except BadFile as why:
        raise Misfit(str(why)) from None


def load(path: Path) -> Machine:
    """The machine of a machine file."""
    table = read(path)
    content = dict(table.left)
    title, between = table.take("title", str), between_of(table.table("between"))
    for name in ("linuxcnc", "port"):  # linuxcnc_config and the host read them
        table.left.pop(name, None)
    layouts = table.table("wiring")
    if {"node", "relay"} <= set(table.left):
        raise table.misfit("a machine has [node] or [relay], not both")
    is_relay = "relay" in table.left
    kind = table.table("relay" if is_relay else "node", True)
    orders = kind.take("orders", int) if is_relay else 0
    if is_relay and not 1 <= orders <= MOST_ORDERS:
        raise kind.misfit(f"orders {orders} must be 1 to {MOST_ORDERS}")
    core = "" if is_relay else kind.take("core", str, "soft")
    if core and core not in CORES:
        raise kind.misfit(f"core {core!r} is none of {', '.join(CORES)}")
    update = not is_relay and kind.take("update", bool, False)
    if update and core != "serial":
        raise kind.misfit("update needs core 'serial': the firmware of the other comes out of RAM")
    machine = Machine(
        name=path.stem,
        file=table.file,
        title=title,
        orders=orders,
        image="" if is_relay else kind.take("image", str),
        core=core,
        memory_kib=0 if is_relay else kind.within("memory_kib", 1, MOST_KIB),
        update=update,
        address=1 if is_relay else kind.take("address", int),
        filters=0 if is_relay else kind.within("filters", 0, MOST_FILTERS, 0),
        segments=0 if is_relay else kind.within("segments", 0, MOST_SEGMENTS, 0),
        scope_words=0 if is_relay else kind.take("scope_words", int, 0),
        axes=[axis_of(row) for row in table.rows("axis")],
        peripherals=[] if is_relay else kind.chosen("peripherals", PERIPHERALS),
        ip_address="" if is_relay else ip_address_of(kind.table("ethernet")),
        link_pll=not is_relay and kind.take("link_pll", bool, False),
        unused=kind.chosen("unused", RELAY_SIGNALS if is_relay else NODE_SIGNALS),
        wiring={layout: wiring_of(layouts.table(layout), between) for layout in list(layouts.left)},
    )
    for each in (kind, table):
        each.close()
    check(machine)
    if not is_relay:
        check_for_host(content, table.file)
    return machine


def named(name: str) -> Machine:
    """A machine of the project, or the one of a file if the name is that of a file (.toml)."""
    if name.endswith(".toml"):
        return load(Path(name))
    if name not in names():
        raise Misfit(
            f"there is no machine {name!r}; there are: {', '.join(names())}, or name a .toml file"
        )
    return load(FOLDER / f"{name}.toml")
