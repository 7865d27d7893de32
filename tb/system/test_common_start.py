# SPDX-License-Identifier: Apache-2.0
"""Prepared moves of two nodes begin at one sync. The machines are compared cycle by cycle, and the
nodes did not power up together.
"""

import random

import pytest

from experiments.s2_stage import SCALES
from experiments.s4_job import CLK_HZ, NODE
from moire.bus.protocol import sync_words
from moire.client.bus import Bus
from moire.errors import BusError
from tb.bench import seed
from twin import Node, Twin, TwinTransport
from twin.nodes.twin import ALL_PERIPHERALS

ADDRESSES = (1, 2)
SCALE = SCALES["Z"]
SETTINGS = {
    **SCALE.settings(),
    "position_source": 2,
    "period": "1um",
    "steps_per_period": 4,
    "step_trim": 0,
    "ki": 0,
    "home_method": 35,
    "acceleration": "5m/s2",
    "jerk": "500m/s3",
}
MOVE = "200um"
LONGEST_S = 0.05  # time until a table has moved
MOVED_M = 1e-9


@pytest.fixture(scope="module")
def axes():
    """The axes of two nodes at zero. The second lost its power for a moment, so its ticks come at
    other moments.
    """
    with Twin(
        [Node(address, [SCALE.machine()]) for address in ADDRESSES],
        clk_hz=CLK_HZ,
        seed=seed() % 1000,
        node_parameters=ALL_PERIPHERALS | NODE,
    ) as twin:
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed()))
        twin.run_until_ready()
        twin.power_cut(1)
        twin.run(random.Random(seed()).uniform(0.0101, 0.0102))
        twin.power_on(1)
        twin.run_until_ready()
        made = [bus.axis(address) for address in ADDRESSES]
        for axis in made:
            for name, value in SETTINGS.items():
                axis.set_parameter(name, value)
            axis.enable()
            axis.home()
        yield made


@pytest.fixture
def prepared(axes):
    for axis in axes:
        if not axis.status().enabled:
            axis.reset()
            axis.enable()
        axis.prepare(MOVE, by=True)
    return axes


def began(twin):
    """When each table was first seen to have moved, and each driver to have taken a step: seconds,
    clk by clk.
    """
    first = [twin.truth(n) for n in range(2)]
    moved, stepped = {}, {}
    while len(moved) + len(stepped) < 4 and twin.time() - first[0].time_s < LONGEST_S:
        twin.run(1 / CLK_HZ)
        for n, before in enumerate(first):
            now = twin.truth(n)
            if abs(now.position_m - before.position_m) > MOVED_M:
                moved.setdefault(n, now.time_s)
            if now.steps != before.steps:
                stepped.setdefault(n, now.time_s)
    return moved, stepped


def test_two_tables_on_two_nodes_begin_to_move_within_a_microsecond(prepared):
    bus, twin = prepared[0].node.bus, prepared[0].transport.twin
    ticks = [bus.node(address).read_named("node.time_stamp")["value"] for address in ADDRESSES]
    assert ticks[0] - ticks[1] > 0.01 * CLK_HZ  # the nodes have not begun together
    for axis in prepared:
        bus.request(axis.node.address, "start_at_sync", axes=1)
    bus.transport.send(sync_words(1))
    moved, stepped = began(twin)
    assert abs(stepped[1] - stepped[0]) <= 1e-6 and abs(moved[1] - moved[0]) <= 1e-6
    reached = [axis.wait() for axis in prepared]
    assert all(status.position_nm == pytest.approx(200_000, abs=500) for status in reached)


def test_a_node_that_missed_the_sync_is_reported_and_does_not_move(prepared):
    bus, twin = prepared[0].node.bus, prepared[0].transport.twin
    steps = [twin.truth(n).steps for n in range(2)]

    class CableOff:
        """The second node's cable is off while a sync is sent."""

        def __getattr__(self, name):
            return getattr(twin_bus, name)

        def send(self, words):
            if words[0] == sync_words(1)[0]:
                with twin.fault("line_cut", 1, True):
                    twin_bus.send(words)
            else:
                twin_bus.send(words)

    twin_bus, bus.transport = bus.transport, CableOff()
    with pytest.raises(
        BusError, match="did not receive the sync at which its motion should begin"
    ) as caught:
        bus.start(*prepared)
    bus.transport = twin_bus
    assert caught.value.address == 2
    assert (
        twin.truth(1).steps == steps[1] and twin.truth(0).steps != steps[0]
    )  # the first had begun and was stopped
    started, missed = (axis.status() for axis in prepared)
    assert started.ended == "stopped" and not started.in_motion and missed.state != "prepared"
    bus.sync()
    twin.run(0.02)
    assert twin.truth(1).steps == steps[1]  # a later sync does not begin it
