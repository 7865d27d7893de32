# SPDX-License-Identifier: Apache-2.0
"""Makes a configuration of LinuxCNC from a machine file.

    python -m linuxcnc_config MACHINE --out FOLDER

MACHINE is a machine of constraints/machines, or a .toml file. docs/linuxcnc.md describes the tables
[linuxcnc] and [axis.linuxcnc] of a machine file.
"""

import math
import random
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jinja2

from boards import machine as machines
from boards.toml_file import Misfit, Table, read
from linuxcnc_config.lists import READS, WRITES
from linuxcnc_config.set_up import LATE_S, LONGEST_SESSION
from moire.bus.cobs import sealed
from moire.client.link import MOST_LEAD, places
from moire.made import link_tables as layout

TEMPLATES = Path(__file__).resolve().parent / "templates"
LETTERS = "XYZABCUVW"
ROTARY = "ABC"
LEAST_DELAY_MS = 4.0  # a set-point is sent when the next one is known, 8 servo ticks ahead
MARGIN = 2.0  # of the following error that LinuxCNC sees, over the one of the delay
SERVO_MS = 1.0
MOST_DELAY_MS = 15 * SERVO_MS  # a set-point is a piece, and the node queues 16 of them
# a controlled stop with limited jerk that just reaches its acceleration takes twice as long as one
# without
STOP = 2.0
LONGEST_WATCHDOG_MS = 1000
BITS = {"serial": 10, "spi": 8}  # of a byte on the line
CARRIERS = {"udp": "udp:HOST:PORT", "serial": "serial:DEVICE:BAUD", "spi": "spi:DEVICE:HZ"}


@dataclass(frozen=True)
class Joint:
    """An axis as LinuxCNC has it: mm, or degrees."""

    name: str
    period_um: float  # or thousandths of a degree
    low: float
    high: float
    velocity: float
    acceleration: float
    rest: float  # where it moves after homing
    sequence: int  # in which it is homed
    following: float  # largest difference between command and position
    backlash: float = 0.0  # of the screw, in um; not used for a rotary axis
    take_up: float = 0.0  # how fast the motor takes it up, beyond the target, in mm/s
    hysteresis: float = 0.0  # how far the target must come back until that is a reversal, in um
    sensor: str = "table"  # the side of the backlash on which the sensor is, or "motor"
    gantry: str = ""  # the axis whose second side it is
    apart: float = 0.0  # most that its position may differ from that of the other side
    latch: float = 0.0  # velocity at which LinuxCNC itself searches the index; 0: the node homes

    @property
    def letter(self) -> str:
        """The axis of LinuxCNC that it moves."""
        return self.gantry or self.name

    @property
    def rotary(self) -> bool:
        """Whether it is measured in degrees."""
        return self.letter in ROTARY


@dataclass(frozen=True)
class Spindle:
    """An axis without a drive, the encoder of the spindle."""

    name: str
    periods_per_turn: float


@dataclass(frozen=True)
class Configuration:
    """What a configuration of LinuxCNC is made from."""

    name: str
    file: str
    title: str
    address: int  # on the bus
    bus: str  # port of the bus, for the set-up; empty: another program sets the link up
    node: str  # real-time link, in one of the forms of CARRIERS
    delay_ms: float  # of a set-point
    period_ns: int
    axes: list[Joint]
    spindle: Spindle | None = None  # the axis of the node after the joints
    capture_us: float | None = None  # that captures lead a packet; None: read with the packet
    probe: bool = False  # whether the axes capture edges of a touch probe
    session: int = 0  # of the link; 0: one is drawn for each configuration that is made
    simulated: bool = False
    display: str = "axis"
    python: str = sys.executable  # that runs the set-up

    @property
    def gantries(self) -> list[tuple[int, int]]:
        """The numbers of the joints of each gantry, its first side before the second one."""
        first = {axis.name: number for number, axis in enumerate(self.axes)}
        return [(first[axis.gantry], n) for n, axis in enumerate(self.axes) if axis.gantry]

    @property
    def sequences(self) -> list[int]:
        """HOME_SEQUENCE of each joint; below 0: with the others of this number, which move to
        their places after homing together.
        """
        shift = 1 if self.gantries else 0  # there is no -0
        both = {number for pair in self.gantries for number in pair}
        ranks = sorted({axis.sequence for axis in self.axes})  # LinuxCNC ends at a gap
        found = [ranks.index(axis.sequence) + shift for axis in self.axes]
        return [-sequence if n in both else sequence for n, sequence in enumerate(found)]

    @property
    def behind_ms(self) -> float:
        """How much later than commanded an axis is at a position, seen from LinuxCNC."""
        return self.delay_ms + 2 * self.period_ns * 1e-6 + 1e-3 * (self.capture_us or 0)

    @property
    def baud(self) -> str:
        """The baud rate of a serial link; empty for another carrier."""
        kind, *_, rate = self.node.split(":")
        return rate if kind == "serial" else ""

    @property
    def watchdog_ms(self) -> int:
        """The silence after which the node switches its drives off: by then its axes have played
        the last set-points, gone on for LATE_S and stopped under control, unless that takes longer
        than LONGEST_WATCHDOG_MS.
        """
        stop_s = STOP * max(axis.velocity / axis.acceleration for axis in self.axes)
        return min(round(self.delay_ms + 1e3 * (LATE_S + stop_s)), LONGEST_WATCHDOG_MS)


def backlash_of(row: Table, table: Table, sensor: str) -> tuple[float, float]:
    """The backlash of an axis with its sensor on this side of it, in um, and the velocity in mm/s
    with which it is taken up.
    """
    backlash, take_up = table.take("backlash_um", float, 0.0), table.take("take_up", float, 1.0)
    if backlash < 0 or take_up <= 0:
        raise table.misfit(
            f"backlash_um {backlash:g} with take_up {take_up:g}: the first must not be below 0, "
            "the second must be above 0"
        )
    if backlash and "backlash" not in row.left.get("features", []):
        raise table.misfit("backlash_um needs the feature backlash of the axis")
    if backlash and sensor == "table" and "stepper" not in row.left.get("drives", []):
        raise table.misfit(
            'backlash_um needs a stepper, or sensor = "motor": a servo with its sensor on the '
            "table takes the backlash up itself"
        )
    return backlash, take_up


def second_side(row: Table, joints: Sequence[Joint]) -> Joint:
    """The table [axis.linuxcnc] of the second side of a gantry: travel, velocities and the order of
    homing are those of the first.
    """
    table = row.table("linuxcnc", True)
    gantry = table.take("gantry", str)
    first = next((one for one in joints if one.name == gantry and not one.gantry), None)
    if first is None or any(one.gantry == gantry for one in joints):
        raise table.misfit(f"gantry {gantry!r} must be an axis before this one with a single side")
    period, apart = table.take("period_um", float, first.period_um), table.take("apart_um", float)
    if period <= 0 or apart <= 0:
        raise table.misfit(f"period_um {period:g} and apart_um {apart:g} must be above 0")
    backlash, take_up = backlash_of(row, table, first.sensor)
    table.close()
    return replace(
        first,
        name=row.take("name", str),
        gantry=gantry,
        period_um=period,
        apart=apart / 1000,
        backlash=backlash,
        take_up=take_up,
    )


def joint_of(row: Table, number: int, behind_ms: float) -> Joint:
    """The table [axis.linuxcnc] of an axis."""
    name, table = row.take("name", str), row.table("linuxcnc", True)
    if name not in LETTERS or len(name) != 1:
        raise row.misfit(f"name {name!r}: LinuxCNC knows the axes {', '.join(LETTERS)}")
    travel = table.take("travel", list)
    if len(travel) != 2 or not all(isinstance(end, int | float) for end in travel):
        raise table.misfit("travel must be two numbers")
    low, high = (float(end) for end in travel)
    values = {key: table.take(key, float) for key in ("period_um", "velocity", "acceleration")}
    for key, value in values.items():
        if not value > 0:
            raise table.misfit(f"{key} {value:g} must be above 0")
    if low >= high:
        raise table.misfit(f"travel from {low:g} to {high:g} has no length")
    rest = table.take("rest", float, 0.0)
    if not low <= rest <= high:
        raise table.misfit(f"rest {rest:g} is outside the travel, {low:g} to {high:g}")
    hysteresis = table.take("hysteresis_um", float, values["period_um"] / 16)
    sensor = table.take("sensor", str, "table")
    if sensor not in ("table", "motor"):
        raise table.misfit(f"sensor {sensor!r} is none of table, motor")
    backlash, take_up = backlash_of(row, table, sensor)
    sequence = table.take("home_sequence", int, number)
    if sequence < 0:
        raise table.misfit(f"home_sequence {sequence} must not be below 0")
    table.close()
    following = values["velocity"] * behind_ms * 1e-3 * MARGIN
    return Joint(
        name,
        low=low,
        high=high,
        rest=rest,
        sequence=sequence,
        following=following,
        backlash=backlash,
        take_up=take_up,
        hysteresis=hysteresis,
        sensor=sensor,
        period_um=values["period_um"],
        velocity=values["velocity"],
        acceleration=values["acceleration"],
    )


def spindle_of(row: Table) -> Spindle:
    """The table [axis.linuxcnc] of an axis without a drive."""
    table = row.table("linuxcnc", True)
    periods = table.take("periods_per_turn", float)
    if not periods > 0:
        raise table.misfit(f"periods_per_turn {periods:g} must be above 0")
    table.close()
    return Spindle(row.take("name", str), periods)


def capture_of(table: Table, has_pll: bool) -> float | None:
    """The key capture_us of [linuxcnc]; None without one."""
    if "capture_us" not in table.left:
        return None
    capture, most = table.take("capture_us", float), MOST_LEAD * SERVO_MS * 1e3
    if not 0 <= capture <= most:
        raise table.misfit(f"capture_us {capture:g} must be 0 to {most:g}, 3/8 of the period")
    if not has_pll:
        raise table.misfit("capture_us needs link_pll = true in [node]")
    return capture


def exchange_bits(kind: str, axes: int) -> tuple[int, float]:
    """A request and its reply for a node of so many axes: the bits on a line of one of the kinds in
    BITS, and the seconds for which the node plays the request.
    """
    words = (
        layout.FRAME_WORDS + len(places(WRITES, axes)),
        layout.REPLY_FRAME_WORDS + len(places(READS, axes)),
    )
    packets = [b"\1" * 4 * count for count in words]
    played_ns = layout.SPI_TURNROUND_NS + layout.SPI_TURNROUND_BYTE_NS * len(b"".join(packets))
    frames = [sealed(packet) if kind == "serial" else packet for packet in packets]
    return BITS[kind] * len(b"".join(frames)), 1e-9 * played_ns


def node_of(table: Table, axes: int) -> str:
    """The key node of [linuxcnc]; a line must be fast enough for an exchange in each period."""
    node = table.take("node", str)
    kind, _, rest = node.partition(":")
    rate = rest.rpartition(":")[2]
    if kind not in CARRIERS or ":" not in rest or not rate.isdecimal() or int(rate) == 0:
        forms = ", ".join(CARRIERS.values())
        raise table.misfit(f"node {node!r}: write {forms}, with a number at the end")
    if kind in BITS:
        bits, played_s = exchange_bits(kind, axes)
        least = math.ceil(bits / (1e-3 * SERVO_MS - played_s))
        if int(rate) < least:
            unit = "baud" if kind == "serial" else "Hz"
            raise table.misfit(
                f"node {node!r}: the packets of {axes} axes need {least} {unit} at least to fit "
                f"into {SERVO_MS:g} ms"
            )
    return node


def load(name: str) -> Configuration:
    """The configuration of a machine; Misfit, one line, if its file does not describe one."""
    machine = machines.named(name)
    path = Path(name) if name.endswith(".toml") else machines.FOLDER / f"{name}.toml"
    file = read(path)
    if not any(axis.drives for axis in machine.axes):
        raise file.misfit("no axis has a drive: LinuxCNC has nothing to move")
    table = file.table("linuxcnc", True)
    bus, node = table.take("bus", str), node_of(table, len(machine.axes))
    delay = table.take("delay_ms", float, 5.0)
    if not LEAST_DELAY_MS <= delay <= MOST_DELAY_MS:
        raise table.misfit(
            f"delay_ms {delay:g}: a set-point needs {LEAST_DELAY_MS:g} at least, and the node "
            f"queues those of {MOST_DELAY_MS:g} at most"
        )
    capture = capture_of(table, machine.link_pll)
    table.close()
    behind = delay + 2 * SERVO_MS + 1e-3 * (capture or 0)
    rows = file.rows("axis")
    driven = [row for row in rows if row.left.get("drives")]
    joints: list[Joint] = []
    for row in driven:
        number = sum(not joint.gantry for joint in joints)
        is_second = "gantry" in row.left.get("linuxcnc", {})
        joints += [second_side(row, joints) if is_second else joint_of(row, number, behind)]
    others = [spindle_of(row) for row in rows if row not in driven]
    if driven != rows[: len(driven)] or len(others) > 1:
        raise file.misfit("LinuxCNC needs the axes with a drive first, then one spindle at most")
    period = round(SERVO_MS * 1e6)
    return Configuration(
        machine.name,
        machine.file,
        machine.title,
        machine.address,
        bus,
        node,
        delay,
        period,
        joints,
        spindle=others[0] if others else None,
        capture_us=capture,
        probe=all("capture" in row.left.get("features", []) for row in driven),
    )


def rendered(name: str, values: Mapping[str, Any]) -> str:
    """The text of a template."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(f"{name}.jinja").render(values)


def texts(found: Configuration) -> dict[str, str]:
    """{file name: text} of a configuration."""
    values = {
        **{key: getattr(found, key) for key in Configuration.__dataclass_fields__},
        "session": found.session or random.SystemRandom().randint(1, LONGEST_SESSION),
        "behind_ms": found.behind_ms,
        "baud": found.baud,
        "watchdog_ms": found.watchdog_ms,
        "node_axes": len(found.axes) + (found.spindle is not None),
        "letters": "".join(axis.letter for axis in found.axes),
        "gantries": found.gantries,
        "sequences": found.sequences,
        "velocity": max(axis.velocity for axis in found.axes),
        "screen": found.display == "axis",
    }
    return {f"{found.name}.{kind}": rendered(f"machine.{kind}", values) for kind in ("ini", "hal")}


OWN = {  # files that belong to the user: written only where there are none
    "tool.tbl": "T1 P1 D1 Z0 ;the only tool so far\n",
    "custom.hal": "# lines of HAL for this machine alone; run after the made file\n",
}


def write(found: Configuration, folder: Path) -> Path:
    """Writes a configuration into a folder; returns its INI file."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts(found).items():
        (folder / name).write_text(text, encoding="utf-8")
    for name, text in OWN.items():
        if not (folder / name).exists():
            (folder / name).write_text(text, encoding="utf-8")
    return folder / f"{found.name}.ini"


__all__ = ["Configuration", "Joint", "Misfit", "load", "texts", "write"]
