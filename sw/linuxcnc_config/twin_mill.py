# SPDX-License-Identifier: Apache-2.0
"""The mill of constraints/machines/mill_linuxcnc.toml as a twin: three steppers and 1 um scales on one node,
RTL and firmware, in lockstep with LinuxCNC: each packet is a servo period of the machine's time.
"""

import random
import threading
from dataclasses import replace
from fractions import Fraction
from types import TracebackType
from typing import Self

import numpy

from experiments.s2_stage import CLK_HZ, Scale
from experiments.s2_stage import NODE as STEPPERS
from linuxcnc_config.generate import Configuration, load
from linuxcnc_config.programs import Points
from linuxcnc_config.set_up import set_up
from moire.bus.link_gateway import LinkGateway
from moire.client.bus import Bus
from moire.units import Value
from twin import Twin, TwinTransport, build
from twin.nodes.twin import ALL_AXES, Node

PERIOD_S = 4e-3  # a request and a reply of three axes take 2.7 ms of the slow clock of the twin
DELAY_MS = 12.0  # until a set-point: two periods, the packet, and 4 ticks
SESSION = 0x4D1
PARTS = 8  # of a period, at whose ends the positions are recorded
SCALE = Scale(Fraction(1), 150, Fraction(5, 4), 60)
SETTINGS: dict[str, Value] = {
    "watchdog_time": 0,  # of the bus, which is silent
    "home_offset": 0,
    "travel_low": "-2mm",
    "travel_high": "150mm",
}


class TwinMill:
    """The powered-up mill, its link set up, served at a UDP port of this computer."""

    def __init__(self, seed: int = 1, axes: int = 3) -> None:
        parameters = {**STEPPERS, "HAS_SET_POINTS": ALL_AXES, "HAS_LINK": 1}
        self.twin = Twin(
            [Node(1, [SCALE.machine()] * axes)],
            seed=seed,
            clk_hz=CLK_HZ,
            firmware=build.firmware("stream", axes),
            node_parameters=parameters,
        )
        bus = Bus(TwinTransport(self.twin), random_source=random.Random(seed))
        self.twin.run_until_ready()
        for number in range(axes):
            axis = bus.axis(1, number)
            for name, value in (SCALE.settings() | SETTINGS).items():
                axis.set_parameter(name, value)
        self.node, self.axes = bus.node(1), axes
        self.line = self.twin.link()
        set_up(self.node, axes, SESSION, bit_time=self.line.bit_time, watchdog_s=0)
        self.path: list[tuple[float, ...]] = []  # mm of each axis, from the index, at each part
        self.gateway = LinkGateway(self, PERIOD_S)
        self.thread = threading.Thread(target=self.gateway.serve, daemon=True)

    def configuration(self) -> Configuration:
        """That of LinuxCNC for this twin."""
        found = load("mill_linuxcnc")
        behind_ms = DELAY_MS + 2e3 * PERIOD_S
        axes = [
            replace(axis, following=axis.velocity * behind_ms * 2e-3)
            for axis in found.axes[: self.axes]
        ]
        return replace(
            found,
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
        return self.line.take()

    def true_path(self) -> Points:
        """Rows of X, Y, Z in mm, true positions of the tables, from the indexes."""
        index = SCALE.machine().parameters["scale_index_position"] * 1e3
        found: Points = numpy.array(self.path) - index
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
