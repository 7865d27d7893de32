# SPDX-License-Identifier: Apache-2.0
"""Machines as twins in lockstep with LinuxCNC, RTL and firmware: each packet is a servo period of
the machine's time. MILL is that of constraints/machines/mill_linuxcnc.toml: three steppers, 1 um
scales, and a touch probe over SURFACE. LATHE has two of its axes, X and Z, and a spindle with an
encoder. STAGE is that of S0, both axes in one node: interferometers and motors.
"""

import random
import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from types import TracebackType
from typing import Self

import numpy

from experiments.s2_stage import CLK_HZ, Scale
from experiments.s2_stage import NODE as STEPPERS
from linuxcnc_config.generate import SERVO_MS, Configuration, Joint, Spindle, load
from linuxcnc_config.programs import REST, SURFACE, Points, Surface
from linuxcnc_config.set_up import Backlash, set_up
from moire.analysis.tune import COEFFICIENT, notch
from moire.bus.link_gateway import LinkGateway
from moire.client.bus import Bus
from moire.client.values import FILTER
from moire.errors import MoireError
from moire.units import Value
from twin import Twin, TwinTransport, build
from twin.nodes.twin import ALL_AXES, NODE, Axis, Node

PERIOD_S = 4e-3  # a request and a reply of three axes take 2.7 ms of the slow clock of the twin
DELAY_MS = 12.0  # until a set-point: two periods, the packet, and 4 ticks
SESSION = 0x4D1
PARTS = 8  # of a period, at whose ends the positions are recorded
TICK_S = 0.25e-3  # of the servo
LSB = 1 << 16  # of a position, in a signal period
SETTLED_MM = 0.003  # of a stepper that settles on its scale of 1 um
PATIENCE_S = 1500.0  # with a step of the operator: the twin is slower than real time
READINGS, RESTING_MM = 50, 0.1e-3  # of a table at rest, which may make a step meanwhile
SPINDLE_LINES, SPINDLE_TURNS_S = 1024, 5.0
# LinuxCNC follows the spindle by stretches of its largest acceleration, and hunts by about that
# times the square of its period: 8 um at 500 mm/s2 and 4 ms, 0.5 um at the usual 1 ms
LATHE_MM_S2 = 60.0
SCALE = Scale(Fraction(1), 150, Fraction(5, 4), 60)
START_M = {"travel_start_lowest": 0.5e-3, "travel_start_highest": 1.5e-3}  # a short way to home
# The friction of the stage disturbs the path where an axis reverses. `moire tune` finds the
# resonance of S0 at 553 Hz; with a notch there, a phase margin of 45 degrees and a gain margin of
# 2.6 are left for gains that are half as stiff again, at 15 Hz, as those of the parameters.
STAGE_SERVO: dict[str, Value] = {
    "kp": 0.03,
    "ki": 0.0015,
    "kd": 0.35,
    **{f"filter_1_{n}": c / COEFFICIENT for n, c in zip(FILTER, notch(553, TICK_S), strict=True)},
    "filters": "first",
}


@dataclass(frozen=True)
class Plant:
    """What a machine is made of; the index or phase zero of each axis is at whole periods."""

    configuration: Configuration
    axis: Axis
    image: str
    parameters: Mapping[str, int]  # of rtl/node.sv
    settings: Mapping[str, Value] = field(default_factory=dict)  # parameters of each axis
    backlash: Backlash | None = None
    surface: Surface | None = None  # under a touch probe, in mm from where the model has its zeros
    spindle: Axis | None = None  # the axis after those with a drive
    spindle_settings: Mapping[str, Value] = field(default_factory=dict)


CONFIGURATION = load("mill_linuxcnc")
SCREW = CONFIGURATION.axes[0]
MILL = Plant(
    CONFIGURATION,
    replace(SCALE.machine(), parameters=SCALE.machine().parameters | START_M),
    "steps_stream",
    {**STEPPERS, "HAS_BACKLASH": ALL_AXES},
    {**SCALE.settings(), "home_offset": 0, "travel_low": "-2mm", "travel_high": "150mm"},
    Backlash(f"{SCREW.backlash}um", f"{SCREW.take_up}mm/s", f"{SCREW.hysteresis}um", False),
    SURFACE,
)
DRIVEN = 0b11  # axes of the lathe
LATHE = replace(
    MILL,
    configuration=replace(
        MILL.configuration,
        name="lathe",
        title="lathe",
        probe=False,
        axes=[
            replace(axis, acceleration=LATHE_MM_S2)
            for axis in MILL.configuration.axes
            if axis.name in "XZ"
        ],
        spindle=Spindle("S", SPINDLE_LINES),
    ),
    parameters={
        **MILL.parameters,
        **dict.fromkeys(("HAS_DRIVE", "HAS_STEPPER", "HAS_BACKLASH", "HAS_SET_POINTS"), DRIVEN),
    },
    surface=None,
    spindle=Axis("spindle", {"drive_speed": SPINDLE_TURNS_S, "encoder_lines": SPINDLE_LINES}),
    spindle_settings={"counts_per_period": 4, "position_source": 1, "deglitch": 0},
)
STAGE = Plant(
    Configuration(
        name="stage",
        file="",
        title="S0",
        address=1,
        bus="",
        node="",
        delay_ms=DELAY_MS,
        period_ns=round(SERVO_MS * 1e6),
        axes=[Joint(name, 0.8, -0.5, 100, 4, 50, 0, 0, 0) for name in "XY"],
    ),
    Axis("stage", {"travel_start_lowest": -0.8e-3, "travel_start_highest": -0.6e-3}),
    "stream",
    {**NODE, "FILTERS": 2},
    STAGE_SERVO,
)


def running(names: Iterable[str]) -> list[list[str | float]]:
    """The steps of an operator who homes the machine and runs these programs, `name.ngc`."""
    steps: list[list[str | float]] = [["patience", PATIENCE_S], ["on"], ["home"]]
    for name in names:
        steps += [["start", f"{name}.ngc"], ["finish"]]
    return steps


class TwinMachine:
    """The powered-up machine, its link set up, served at a UDP port of this computer."""

    def __init__(self, plant: Plant, seed: int = 1) -> None:
        self.plant, self.axes = plant, len(plant.configuration.axes)
        axes = [plant.axis] * self.axes + ([plant.spindle] if plant.spindle else [])
        self.twin = Twin(
            [Node(1, axes)],
            seed=seed,
            clk_hz=CLK_HZ,
            firmware=build.firmware(plant.image, len(axes)),
            node_parameters={"HAS_SET_POINTS": ALL_AXES, "HAS_LINK": 1, **plant.parameters},
        )
        if surface := plant.surface:  # Z - slopes * (X, Y) is below its height
            slopes = [-slope for slope in surface.slopes]
            height_mm = surface.height + self.model_zero_mm * (1 - sum(surface.slopes))
            self.twin.fit_probe([*slopes, 1.0], height_mm * 1e-3)
        bus = Bus(TwinTransport(self.twin), random_source=random.Random(seed))
        self.twin.run_until_ready()
        for number in range(self.axes):
            axis = bus.axis(1, number)
            for name, value in plant.settings.items():
                axis.set_parameter(name, value)
            axis.set_parameter("watchdog_time", 0)  # of the bus, which is silent
        for name, value in plant.spindle_settings.items():
            bus.axis(1, self.axes).set_parameter(name, value)
        self.node = bus.node(1)
        self.line = self.twin.link()
        set_up(
            self.node,
            len(axes),
            SESSION,
            bit_time=self.line.bit_time,
            watchdog_s=0,
            backlash=dict.fromkeys(range(self.axes), plant.backlash) if plant.backlash else {},
        )
        self.path: list[tuple[float, ...]] = []  # mm of each axis at each part
        self.turns: list[float] = []  # of the spindle
        self.gateway = LinkGateway(self, PERIOD_S)
        self.thread = threading.Thread(target=self.gateway.serve, daemon=True)

    def configuration(self) -> Configuration:
        """That of LinuxCNC for this twin, whose axes home at the same time."""
        behind_ms = DELAY_MS + 2e3 * PERIOD_S
        axes = [
            replace(axis, following=axis.velocity * behind_ms * 2e-3, sequence=0)
            for axis in self.plant.configuration.axes
        ]
        return replace(
            self.plant.configuration,
            bus="",
            node="udp:{}:{}".format(*self.gateway.address),
            session=SESSION,
            delay_ms=DELAY_MS,
            period_ns=round(PERIOD_S * 1e9),
            axes=axes,
            simulated=True,
        )

    def exchange(self, data: bytes, seconds: float) -> bytes:
        """The machine runs, with bytes to the node at its begin; returns those from the node."""
        self.line.send(data)
        for _ in range(PARTS):
            self.twin.run(seconds / PARTS)
            where = (self.twin.machine(n).state.position_m * 1e3 for n in range(self.axes))
            self.path.append(tuple(where))
            if self.plant.spindle:
                self.turns.append(self.twin.truth(self.axes).turns)
        return self.line.take()

    @property
    def model_zero_mm(self) -> float:
        """The true position at which the model has the index of an axis."""
        return self.plant.axis.parameters.get("scale_index_position", 0.0) * 1e3

    def above_mm(self, points: Points) -> Points:
        """How far points, in mm from the zeros, are truly above the surface, along Z."""
        surface = self.plant.surface
        assert surface
        shift = [self.zero_mm(n) - self.model_zero_mm for n in range(self.axes)]
        return numpy.array([surface.above(point + shift) for point in points])

    def zero_mm(self, number: int) -> float:
        """The true position of the zero of an axis, which is a whole number of periods away from
        where the model has a zero. It is found while the table rests: reading the count takes time.
        MoireError if it does not rest.
        """
        period = self.plant.configuration.axes[number].period_um * 1e-3
        for _ in range(READINGS):
            before = self.twin.machine(number).state.position_m * 1e3
            count = self.node.read_named("axis.position", number)["value"]
            after = self.twin.machine(number).state.position_m * 1e3
            if abs(after - before) < RESTING_MM:
                apart = after - count / LSB * period - self.model_zero_mm
                return float(self.model_zero_mm + round(apart / period) * period)
        raise MoireError(f"axis {number} does not rest")

    def true_path(self) -> Points:
        """Rows of X, Y, Z in mm, true positions of the tables, from the zeros; 0 without an axis.
        After the end of LinuxCNC, which may have seen the end for some periods only: it rests on
        without packets.
        """
        for _ in range(2 * REST // PARTS):
            self.exchange(b"", PERIOD_S)
        found: Points = numpy.zeros((len(self.path), 3))
        columns = ["XYZ".index(axis.name) for axis in self.plant.configuration.axes]
        found[:, columns] = self.path
        found[:, columns] -= [self.zero_mm(n) for n in range(self.axes)]
        return found

    def __enter__(self) -> Self:
        self.thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.gateway.stop()
        self.thread.join()
        self.gateway.socket.close()
        self.twin.close()
