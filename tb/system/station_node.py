# SPDX-License-Identifier: Apache-2.0
"""The nodes of S4 in the tests of whole stations: a twin of them, the bus to it, and the parameters
of the axis that turns the table.
"""

import random
from collections.abc import Sequence
from typing import Any

from experiments.s4_job import CLK_HZ, NODE
from moire.client.bus import Bus
from tb.bench import seed
from twin import Twin, TwinTransport, build
from twin.nodes.twin import Node

AXIS = {
    "period": "1um",
    "drive": "steps",
    "position_source": "own_steps",
    "steps_per_period": 4,
    "counts_per_period": 4,
    "disagreement_limit": 0,
    "encoder_fault_mask": 0,
    "kp": 0,
    "ki": 0,
    "kd": 0,
    "kv": 0,
    "ka": 0,
    "following_limit": "10mm",
    "velocity": "20mm/s",
    "acceleration": "100mm/s2",
    "jerk": "1000mm/s3",
    "homing_latch_speed": "0.2mm/s",
    "settle_window": "1um",
    "settle_time": "5ms",
    "watchdog_time": "60s",
}


def station_twin(nodes: Sequence[Node], **more: Any) -> Twin:
    """A twin of nodes with the image `station`; more: further arguments of Twin."""
    return Twin(
        nodes,
        seed=seed() % 1000,
        clk_hz=CLK_HZ,
        node_parameters=NODE,
        firmware=build.firmware("station"),
        peer_baud=115200,
        **more,
    )


def station_bus(twin: Twin, address: int) -> Bus:
    """The bus of a twin, after the parameters of the table's axis were set in this node."""
    bus = Bus(TwinTransport(twin), random_source=random.Random(seed()), poll_s=0.1)
    bus.transport.wait(0.1)
    for name, value in AXIS.items():
        bus.axis(address).set_parameter(name, value)
    return bus
