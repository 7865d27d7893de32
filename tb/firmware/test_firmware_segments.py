# SPDX-License-Identifier: Apache-2.0
"""The segment table: it is loaded in order and used only when complete, in force only at rest and
with a zero, and it begins at the zero.
"""

import pytest

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import CAUSE, DEFINES, PARAMETER, PERIOD

POINTS = [100 * n - 500 for n in range(30)]
LENGTH, FIRST = 1000 * PERIOD, -2000 * PERIOD


def table(machine, points=POINTS, **more):
    for border in range(0, len(points), 12):
        block = points[border : border + 12]
        filled = {f"point_{n}": point for n, point in enumerate([*block, *[0] * 12][:12])}
        machine.ask("set_segments", axis=0, border=border, points=len(block), **filled)
    machine.set(segment_count=len(points) - 1, segment_length=LENGTH, segment_first=FIRST, **more)


def state(machine):
    reported = machine.ask("segments", axis=0)
    return reported["loaded"], reported["in_force"], CAUSE[reported["reason"]]


def refused(machine, name, value):
    return machine.request("set_parameter", axis=0, parameter=PARAMETER[name]["id"], value=value)[0]


def homed(**more):
    machine = CompiledNode(Axis(position=5 * PERIOD))
    machine.set(home_method=37, **more)
    machine.ask("enable", axis=0, on=1)
    machine.ask("home", axis=0)
    machine.run(300)
    return machine


def block(point=0, border=0, points=1):
    return dict(axis=0, border=border, points=points, **{f"point_{n}": point for n in range(12)})


def test_a_table_in_force_is_the_one_that_was_loaded_and_reads_back():
    machine = homed()
    table(machine)
    assert state(machine) == (30, 0, "ok")
    machine.set(segments=2)
    machine.poll(4)
    channel = machine.feedback_channels[0]
    assert state(machine) == (30, 2, "ok") and channel.use == dict(
        linear=True, segments=29, length=LENGTH, origin=FIRST
    )
    assert [channel.segments[n] for n in range(30)] == POINTS
    back = [
        machine.ask("get_segments", axis=0, border=border)[f"point_{n}"]
        for border in (0, 12, 24)
        for n in range(12)
    ]
    assert back[:30] == POINTS


@pytest.mark.parametrize("offset", [-3, 0, 70])
def test_the_table_counts_from_the_position_that_homing_finds_whatever_its_number(offset):
    machine = homed(home_offset=offset)
    table(machine, segments=1)
    machine.set(home_offset=offset + 5)  # counts from the next homing on
    machine.poll(4)
    assert machine.feedback_channels[0].use["origin"] == FIRST + offset * PERIOD
    machine.ask("home", axis=0)
    assert machine.feedback_channels[0].use is None
    machine.run(300)
    assert machine.feedback_channels[0].use["origin"] == FIRST + (offset + 5) * PERIOD and state(
        machine
    ) == (30, 1, "ok")


def test_without_a_zero_the_table_is_not_in_force_and_the_reason_is_reported():
    machine = CompiledNode(Axis(position=0))
    table(machine, segments=1)
    machine.poll(4)
    assert state(machine) == (30, 0, "not_homed") and machine.feedback_channels[0].use is None


def test_losing_the_zero_takes_the_table_out_of_force():
    machine = homed()
    table(machine, segments=1)
    machine.poll(4)
    machine.axes[0].causes = 1 << 4  # encoder
    machine.poll(4)
    machine.axes[0].causes = 0
    assert state(machine) == (30, 0, "not_homed") and machine.feedback_channels[0].use is None


def test_an_incomplete_table_is_not_in_force_and_the_reason_is_reported():
    machine = homed()
    table(machine, POINTS[:24])
    machine.set(segment_count=24, segments=1)
    machine.poll(4)
    assert state(machine) == (24, 0, "no_segments")
    machine.set(segments=0)
    machine.set(segment_count=23)
    machine.set(segments=1)
    machine.poll(4)
    assert state(machine) == (24, 1, "ok")


def test_the_use_of_the_table_changes_directly_to_another_one():
    machine = homed()
    table(machine, segments=1)
    machine.poll(4)
    machine.feedback_channels[0].uses.clear()
    machine.set(segments=2)
    machine.poll(4)
    assert machine.feedback_channels[0].uses == [None, True] and state(machine) == (30, 2, "ok")
    machine.set(segments=0)
    machine.poll(4)
    assert machine.feedback_channels[0].use is None and state(machine) == (30, 0, "ok")


def test_a_moving_axis_is_refused_a_change():
    machine = homed()
    table(machine)
    machine.ask("move", axis=0, target=5000 * PERIOD)
    machine.run(10)
    assert refused(machine, "segments", 1) == "busy" and machine.feedback_channels[0].use is None


def test_a_table_in_use_is_not_changed():
    machine = homed()
    table(machine, segments=1)
    machine.poll(4)
    assert machine.request("set_segments", **block())[0] == "segments_in_use"
    for name in ("segment_count", "segment_length", "segment_first"):
        assert refused(machine, name, 1) == "segments_in_use"
    assert state(machine) == (30, 1, "ok")


def test_points_out_of_order_too_many_or_too_large_are_refused():
    machine = homed()
    assert machine.request("set_segments", **block(border=12))[0] == "out_of_range"
    machine.ask("set_segments", **block(points=12))
    for wrong in (
        block(border=11),
        block(border=13),
        block(border=12, points=13),
        block(border=12, point=1 << 23),
    ):
        assert machine.request("set_segments", **wrong)[0] == "out_of_range"
    for border in range(12, 252, 12):
        machine.ask("set_segments", **block(point=-(1 << 23) + 1, border=border, points=12))
    assert machine.request("set_segments", **block(border=252, points=5))[0] == "out_of_range"
    machine.ask("set_segments", **block(border=252, points=4))
    assert state(machine)[0] == 256


def test_a_node_without_a_table_reports_that():
    machine = homed()
    machine.built &= ~DEFINES["AXIS_BUILT_SEGMENTS_MASK"]
    assert machine.request("set_segments", **block())[0] == "not_built"
    assert (
        refused(machine, "segments", 1) == "not_built" and refused(machine, "segments", 0) == "ok"
    )


def test_points_have_their_sign():
    machine = homed()
    table(machine, [-1, (1 << 23) - 1, -(1 << 23) + 1])
    assert [machine.feedback_channels[0].segments[n] for n in range(3)] == [
        -1,
        (1 << 23) - 1,
        -(1 << 23) + 1,
    ]


def test_each_axis_has_a_table_and_a_use_of_its_own():
    machine = CompiledNode(*(Axis(position=5 * PERIOD) for _ in range(3)))
    for axis in range(3):
        machine.ask("set_parameter", axis=axis, parameter=PARAMETER["home_method"]["id"], value=37)
        machine.ask("enable", axis=axis, on=1)
        machine.ask("home", axis=axis)
    machine.run(300)
    for axis in (2, 0):
        machine.ask("set_segments", **{**block(point=axis + 1, points=2), "axis": axis})
        for name, value in dict(segment_count=1, segment_length=LENGTH, segments=1).items():
            entry = dict(axis=axis, parameter=PARAMETER[name]["id"], value=value)
            machine.ask("set_parameter", **entry)
    machine.poll(8)
    channels = machine.feedback_channels
    assert [channel.use is not None for channel in channels] == [True, False, True]
    assert [channels[axis].segments[0] for axis in (0, 2)] == [1, 3]
    loaded = [machine.ask("segments", axis=axis)["loaded"] for axis in range(3)]
    assert loaded == [2, 0, 2]


def test_a_table_that_is_to_be_in_force_but_is_not_yet_is_not_changed():
    machine = CompiledNode(Axis(position=0))  # without a zero
    table(machine, segments=1)
    assert state(machine)[1] == 0
    assert machine.request("set_segments", **block())[0] == "segments_in_use"


def test_a_restart_of_the_firmware_takes_the_table_out_of_force():
    machine = homed()
    table(machine, segments=1)
    machine.poll(4)
    machine.feedback_channels[0].uses.clear()
    machine.firmware.segments_start(1)
    assert machine.feedback_channels[0].uses == [None]
    assert state(machine)[:2] == (0, 0)
