# SPDX-License-Identifier: Apache-2.0
"""The node of an iCE40 UP5K as it ships: four axes that count, on the serial core, whose firmware
comes out of a flash and can be replaced there. It serves the host at its own clock and baud rate.
"""

import random

import pytest

from moire.client.bus import Bus
from moire.client.update import ACTIONS, Firmware, update_state, wait_for, write
from moire.errors import Refused
from moire.made.bus_tables import PROTOCOL_CRC
from moire.made.registers import MAP_CRC
from tb.bench import seed
from twin import Axis, Node, Twin, TwinTransport, build

AXES = 4
CLK_HZ = 20_000_000
BAUD = 115_200
NODE = {  # as constraints/machines/counter_box.toml builds it, with updates of the firmware
    "FILTERS": 0,
    "HAS_SINE": 0,
    "HAS_COMPARE": 0,
    "HAS_ENCODER_CHECK": 0,
    "HAS_VELOCITY": 0,
    "HAS_DRIVE": 0,
    "HAS_SERIAL_CORE": 1,
    "HAS_UPDATE": 1,
}
START_S = 0.06  # 26 ms to copy 32 KiB, and the start of the firmware
ANSWER_S = 0.012  # longest time from a request for the status to the answer's last character
PROGRAM = bytes(range(70))  # of an update
PERIOD = "4um"  # of the scale of S3: 4 counts of 1 um


@pytest.fixture(scope="module")
def node():
    with Twin(
        [Node(1, [Axis("linear_motor")] * AXES)],
        clk_hz=CLK_HZ,
        baud=BAUD,
        seed=seed() % 1000,
        node_parameters=NODE,
        firmware=build.firmware("counter", AXES, "serial", update=True),
    ) as twin:
        twin.run(START_S)
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed()))
        yield twin, [bus.axis(1, number) for number in range(AXES)]


def stand_still(twin):
    """Wait until friction has stopped all machines."""
    counts = None
    while counts != (counts := [machine.state.scale_counts for machine in twin.machines]):
        assert twin.time() < 2
        twin.run(0.03)


def test_the_firmware_of_the_flash_runs_and_reports_what_is_built(node):
    _, axes = node
    assert [set(axis.built().names) for axis in axes] == [{"capture"}] * AXES


def test_each_axis_counts_the_motion_of_its_own_scale(node):
    twin, axes = node
    for axis in axes:
        for name, value in (("deglitch", 0), ("period", PERIOD), ("counts_per_period", 4)):
            axis.set_parameter(name, value)
    stand_still(twin)
    before = [axis.status().counts for axis in axes]
    start = [machine.state.scale_counts for machine in twin.machines]
    for machine, force in zip(twin.machines, (8.0, -8.0, 12.0, -12.0), strict=True):
        machine.push(force)
    twin.run(0.02)
    for machine in twin.machines:
        machine.push(0.0)
    stand_still(twin)
    after = [axis.status() for axis in axes]
    moved = [m.state.scale_counts - first for m, first in zip(twin.machines, start, strict=True)]
    print(f"counts: {moved}")
    assert [s.counts - first for s, first in zip(after, before, strict=True)] == moved
    assert all(abs(counts) > 100 for counts in moved)
    assert not any(status.encoder_events for status in after)


def test_all_axes_are_captured_at_the_same_moment_by_a_sync(node):
    twin, axes = node
    for axis in axes:
        axis.capture_from("software")
        axis.capture_now()
    assert [len(axis.captures()[0]) for axis in axes] == [1] * AXES


def test_an_answer_takes_a_few_milliseconds(node):
    twin, axes = node
    longest = 0.0
    for axis in axes * 3:
        begin = twin.time()
        axis.status()
        longest = max(longest, twin.time() - begin)
    print(f"longest exchange: {longest * 1e3:.1f} ms")
    assert longest < ANSWER_S


def test_new_firmware_is_written_into_the_flash_and_read_back(node):
    """Up to the trial, whose firmware would need minutes to be sent."""
    _, axes = node
    firmware = Firmware("counter", AXES, "serial", 65536, MAP_CRC, PROTOCOL_CRC, PROGRAM)
    bus = axes[0].node.bus
    assert update_state(bus, 1).words == "its factory firmware"
    sent = dict(bytes=len(PROGRAM), crc=firmware.crc, map_crc=MAP_CRC, memory=65536, axes=AXES)
    bus.request(1, "begin_update", **sent)
    wait_for(bus, 1, "writing")
    write(bus, 1, PROGRAM, lambda words, share: None)
    bus.request(1, "update", action=ACTIONS["check"])
    wait_for(bus, 1, "checked")


def test_what_needs_a_drive_is_refused(node):
    _, axes = node
    with pytest.raises(Refused, match=r"it needs HAS_DRIVE of rtl/node\.sv"):
        axes[0].enable()
