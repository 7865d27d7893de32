# SPDX-License-Identifier: Apache-2.0
"""The wires of the measuring path in a node: from the pins of a scale to its position, its index,
captures, compare pulses and segment table.
"""

import pytest

from tb.wiring.node import COUNT, TICK

OLDEST_AGE = 0xFFFF  # cycles: the age of a capture does not grow beyond


def other(axis):
    return 1 - axis


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_pins_of_a_scale_move_its_position(node, axis):
    node.start()
    for steps in (9, -14):
        node.count(axis, steps)
        node.run(100)
        for n in range(3):
            expected = node.counts[n]
            assert node.read("axis.quadrature_count", axis=n) == expected
            assert node.read("axis.position", axis=n) == expected * COUNT
    assert not node.bits("axis.encoder_events", axis)


@pytest.mark.parametrize("mode, divisor", [(1, 2), (2, 4)])
def test_the_mode_of_the_decoder_is_its_setting(node, mode, divisor):
    node.start()
    for axis in (0, 1):
        node.write("feedback.decoder_mode", mode, axis=axis)
        node.count(axis, 8)
        node.run(60)
        assert node.read("axis.quadrature_count", axis=axis) == 8 // divisor


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_filter_of_edges_has_its_settings(node, axis):
    """deglitch samples, one in each skip + 1 cycles, of which some may have the old level."""
    node.start()
    node.write("axis.rejected_pulses", 0, axis=axis)
    node.write("axis.sensing", deglitch=8, axis=axis)
    node.run(100)
    node.pulse("encoder_a", axis, 6, node.get("encoder_a") >> axis & 1)
    node.run(40)
    assert node.read("axis.quadrature_count", axis=axis) == 0
    assert node.read("axis.rejected_pulses", axis=axis) == 1
    assert node.read("axis.rejected_pulses", axis=other(axis % 2)) == 0
    node.set_bit("encoder_a", axis, 1)
    node.run(14)
    node.set_bit("encoder_a", axis, 0)
    node.run(80)
    assert node.read("axis.rejected_pulses", axis=axis) == 1, "it was long enough"
    node.write("feedback.edge_filter", skip=9, axis=axis)
    node.set_bit("encoder_a", axis, 1)
    node.run(60)
    node.set_bit("encoder_a", axis, 0)
    node.run(200)
    assert node.read("axis.rejected_pulses", axis=axis) == 2, "8 samples take 80 cycles"

    def edge_with_a_dip():
        before = node.read("axis.quadrature_count", axis=axis)
        node.set_bit("encoder_a", axis, 1)
        node.run(40)
        node.set_bit("encoder_a", axis, 0)
        node.run(10)
        node.set_bit("encoder_a", axis, 1)
        node.run(45)
        moved = node.read("axis.quadrature_count", axis=axis) != before
        node.run(100)
        node.set_bit("encoder_a", axis, 0)
        node.run(200)
        return moved

    assert not edge_with_a_dip()
    node.write("feedback.edge_filter", skip=9, tolerated=4, axis=axis)
    node.run(200)
    assert edge_with_a_dip()


@pytest.mark.parametrize("axis", [0, 1])
def test_the_index_is_found_as_it_is_set_and_latches(node, axis):
    node.start()
    node.write("feedback.index", up=1, down=0, each=0, axis=axis)
    node.write("feedback.capture_sources", 1, axis=axis)
    node.count(axis, 6)
    node.pulse("encoder_z", axis)
    assert node.bits("feedback.index_events", axis) == set(), "it is not armed"
    node.write("feedback.strobes", arm_index=1, axis=axis)
    node.run(10)
    assert node.bits("feedback.index_events", axis) == {"armed"}
    assert not node.bits("feedback.index_events", other(axis))
    node.pulse("encoder_z", axis)
    assert node.bits("feedback.index_events", axis) == {"found"}
    assert not node.bits("feedback.index_events", other(axis))
    node.count(axis, -2)
    node.run(60)
    assert node.read("feedback.index_count", axis=axis) == 6
    assert node.read("axis.quadrature_count", axis=axis) == 4, "the count goes on"
    assert node.read("feedback.capture_state", "present", axis) == 1
    assert node.read("feedback.captured_position", axis=axis) == 6 * COUNT
    assert node.read("feedback.captured", "sources", axis) == 1
    assert node.read("feedback.capture_state", "present", other(axis)) == 0
    free = node.read("feedback.capture_state", "free", axis)
    node.write("feedback.strobes", capture_next=1, axis=axis)
    node.run(6)
    assert node.read("feedback.capture_state", "present", axis) == 0
    assert node.read("feedback.capture_state", "free", axis) == free + 1


@pytest.mark.parametrize("axis", [0, 1])
def test_the_edges_level_and_gate_of_the_index_are_settings(node, axis):
    node.start()
    up, down = dict(up=1, down=0, each=1), dict(up=0, down=1, each=1)

    def counted(settings, moved):
        """Whether an index is used after the scale has moved so."""
        node.write("feedback.index", axis=axis, **settings)
        node.count(axis, 4 * moved)
        node.write("feedback.index_events", 3, axis=axis)
        node.pulse("encoder_z", axis)
        return "found" in node.bits("feedback.index_events", axis)

    assert counted(up, 1) and not counted(up, -1)
    assert counted(down, -1) and not counted(down, 1)
    gated = {}
    for settings in (
        dict(up=1, down=1, each=1, gate_mask=1, gate=1),
        dict(up=1, down=1, each=1, gate_mask=2, gate=2),
        dict(up=1, down=1, each=1, gate_mask=3, gate=0),
    ):
        node.write("feedback.index", axis=axis, **settings)
        seen = []
        for _ in range(4):
            node.count(axis, 1)
            node.write("feedback.index_events", 3, axis=axis)
            node.pulse("encoder_z", axis)
            if "found" in node.bits("feedback.index_events", axis):
                seen.append((node.get("encoder_b") >> axis & 1, node.get("encoder_a") >> axis & 1))
        gated[settings["gate_mask"]] = sorted(seen)
    assert gated == {1: [(0, 1), (1, 1)], 2: [(1, 0), (1, 1)], 3: [(0, 0)]}
    for low in (0, 1):
        node.write("feedback.index", up=1, down=1, each=1, active_low=low, axis=axis)
        node.set_bit("encoder_z", axis, low)
        node.run(20)
        node.write("feedback.index_events", 3, axis=axis)
        node.set_bit("encoder_z", axis, 1 - low)
        node.run(20)
        assert "found" in node.bits("feedback.index_events", axis)
        node.write("feedback.index_events", 3, axis=axis)
        node.set_bit("encoder_z", axis, low)
        node.run(20)
        assert "found" not in node.bits("feedback.index_events", axis)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_wrong_count_between_two_indexes_is_reported(node, axis):
    node.start()
    node.write("feedback.counts_per_revolution", 8, axis=axis)
    node.write("feedback.index", up=1, down=1, each=1, axis=axis)
    for counts, wrong in ((3, False), (8, False), (9, True), (8, False)):
        node.count(axis, counts)
        node.write("feedback.index_events", 3, axis=axis)
        node.pulse("encoder_z", axis)
        assert ("revolution_wrong" in node.bits("feedback.index_events", axis)) == wrong


@pytest.mark.parametrize("axis", [0, 1])
def test_the_time_of_the_last_edge_is_a_time_stamp(node, axis):
    node.start()
    node.count(axis, 1, 0)
    stamp = node.read("node.time_stamp")
    node.run(500)
    assert abs(node.read("feedback.edge_time", axis=axis) - stamp) < 200
    node.count(axis, 1)
    node.run(50)
    assert node.read("feedback.edge_time", axis=axis) > stamp + 400


def test_each_source_captures_with_its_bit_position_and_time(node):
    """Software, the two edges of the two probes, the tick, the index and the sync pulse."""
    node.start()
    node.write("bus.bit_time", 256)
    node.write("feedback.index", up=1, down=1, each=1)
    counted = []  # times between which the last count was

    def count(steps):
        began = node.read("node.time_stamp")
        node.count(0, steps)
        counted[:] = began, node.read("node.time_stamp")

    count(5)

    def captured(source, action):
        node.write("feedback.capture_sources", source)
        before = node.read("node.time_stamp")  # a tick may come at any time from here on
        node.write("feedback.strobes", capture_clear=1)
        node.run(10)
        action()
        node.run(10)
        after = node.read("node.time_stamp")
        assert node.read("feedback.capture_state", "present") == 1, source
        assert node.read("feedback.captured_position") == node.counts[0] * COUNT
        time = node.read("feedback.captured_time")
        assert before <= time <= after
        oldest, youngest = (min(time - moment, OLDEST_AGE) for moment in counted)
        assert youngest <= node.read("feedback.captured", "age") <= oldest
        return node.read("feedback.captured", "sources")

    def probe(bit, level):
        node.set_bit("probe", bit, level)
        node.run(20)

    assert captured(4, lambda: node.write("feedback.strobes", capture_now=1)) == 4
    count(-2)
    assert captured(8 | 32, lambda: probe(0, 1)) == 8
    assert captured(8 | 32, lambda: probe(0, 0)) == 32
    assert captured(16 | 64, lambda: probe(1, 1)) == 16
    count(3)
    assert captured(16 | 64, lambda: probe(1, 0)) == 64
    assert captured(2, lambda: node.ticks(1)) == 2
    assert captured(1, lambda: node.pulse("encoder_z", 0)) == 1
    assert captured(4, node.send_sync) == 4
    node.write("feedback.capture_sources", 8 | 16 | 32 | 64)
    node.write("feedback.strobes", capture_clear=1)
    node.pulse("probe", 2)
    node.pulse("probe", 3)
    assert node.read("feedback.capture_state", "present") == 0, "probes of the other axis"


def test_the_state_of_an_axis_shows_the_levels_of_its_probes_if_they_capture(node):
    node.start()
    for levels in (0b01, 0b10, 0b00):
        for bit in range(4):
            node.set_bit("probe", bit, levels >> bit % 2 & 1)
        node.run(20)
        assert node.read("axis.state", "probe", axis=0) == levels
        assert node.read("axis.state", "probe", axis=1) == 0, "it has no queue of captures"


def test_captures_queue_in_order_and_overrun_is_reported(node):
    node.start()
    node.write("feedback.capture_sources", 4)
    node.write("feedback.strobes", capture_clear=1)
    node.run(10)
    assert node.fields("feedback.capture_state") == {"present": 0, "free": 16, "overrun": 0}
    for _ in range(16):
        node.write("feedback.strobes", capture_now=1)
        node.count(0, 1)
        node.run(50)
    assert node.fields("feedback.capture_state") == {"present": 1, "free": 0, "overrun": 0}
    node.write("feedback.strobes", capture_now=1)
    node.run(10)
    assert node.fields("feedback.capture_state") == {"present": 1, "free": 0, "overrun": 1}
    for n in range(3):
        assert node.read("feedback.captured_position") == n * COUNT
        node.write("feedback.strobes", capture_next=1)
        node.run(4)
    assert node.read("feedback.capture_state", "free") == 3
    node.write("feedback.strobes", capture_clear=1)
    node.run(4)
    assert node.fields("feedback.capture_state") == {"present": 0, "free": 16, "overrun": 1}


def test_the_index_alone_captures_without_a_queue_and_overrun_is_reported(node):
    node.start()
    node.write("feedback.index", up=1, down=1, each=1, axis=1)
    node.count(1, 3)
    node.pulse("encoder_z", 1)
    assert node.read("feedback.capture_state", "present", 1) == 0, "it is no source"
    node.write("feedback.capture_sources", 1, axis=1)
    node.pulse("encoder_z", 1)
    node.count(1, 3)
    assert node.fields("feedback.capture_state", 1) == {"present": 1, "free": 0, "overrun": 0}
    node.pulse("encoder_z", 1)
    assert node.fields("feedback.capture_state", 1) == {"present": 1, "free": 0, "overrun": 1}
    assert node.read("feedback.captured_position", axis=1) == 3 * COUNT
    node.write("feedback.strobes", capture_clear=1, axis=1)
    node.run(4)
    assert node.fields("feedback.capture_state", 1) == {"present": 0, "free": 1, "overrun": 1}


@pytest.mark.parametrize("axis", [0, 1])
def test_compare_pulses_come_at_their_points(node, axis):
    node.start()
    for wide, value in (("start", 3 * COUNT), ("step", 2 * COUNT)):
        node.write(f"feedback.compare_{wide}", value, axis=axis)
    node.write("feedback.compare_count", 3, axis=axis)
    node.write("feedback.compare_pulse", 17, axis=axis)
    node.write("feedback.compare_gap", 23, axis=axis)
    node.count(axis, 1)
    node.watch("compare_pulse")
    node.count(axis, 3, 60)
    assert not node.changes(), "it is not armed"
    node.count(axis, -3)
    node.write("feedback.strobes", compare_arm=1, axis=axis)
    node.run(60)
    assert node.read("feedback.compare_state", "armed", axis) == 1
    assert node.read("feedback.compare_state", "armed", other(axis)) == 0
    at = []
    for _ in range(11):
        node.count(axis, 1, 80)
        changes = node.changes()
        if changes:
            at.append(node.counts[axis])
            assert [c.value for c in changes] == [1 << axis, 0]
            assert changes[1].cycle - changes[0].cycle == 17
    assert at == [3, 5, 7]
    assert node.read("feedback.compare_passed", axis=axis) == 3
    assert node.fields("feedback.compare_state", axis) == {"armed": 0, "late": 0}


def test_points_that_come_too_soon_are_late_and_keep_their_gap(node):
    node.start()
    for axis in (0, 1):
        node.write("feedback.compare_start", 2 * COUNT, axis=axis)
        node.write("feedback.compare_step", COUNT, axis=axis)
        node.write("feedback.compare_pulse", 100, axis=axis)
        node.write("feedback.compare_gap", 230, axis=axis)
        node.count(axis, 1)
        node.write("feedback.strobes", compare_arm=1, axis=axis)
        node.run(60)
        node.watch("compare_pulse")
        node.count(axis, 4, 50)
        node.run(2000)
        rises = [c.cycle for c in node.changes() if c.value]
        assert {b - a for a, b in zip(rises, rises[1:])} == {330} and len(rises) == 4
        assert node.fields("feedback.compare_state", axis) == {"armed": 1, "late": 1}
        node.write("feedback.strobes", compare_disarm=1, axis=axis)
        node.run(4)
        assert node.read("feedback.compare_state", "armed", axis) == 0


def test_compare_points_stay_on_the_scale_when_the_origin_is_shifted(node):
    node.start()
    for axis in (0, 1):
        node.write("feedback.compare_start", 4 * COUNT, axis=axis)
        node.write("feedback.compare_step", 0, axis=axis)
        node.write("feedback.compare_pulse", 10, axis=axis)
        node.count(axis, 1)
        node.write("feedback.strobes", compare_arm=1, axis=axis)
        node.run(60)
        node.watch("compare_pulse")
        node.write("axis.shift_origin", 2, axis=axis)
        node.run(100)
        node.count(axis, 2, 60)
        assert not node.changes(), "the position is above the point now, but not on the scale"
        node.count(axis, 1, 60)
        assert len(node.changes()) == 2


@pytest.mark.parametrize("axis", [0, 1])
def test_align_moves_the_position_by_counts(node, axis):
    node.start()
    node.count(axis, 6)
    node.run(60)
    for by, at in ((2, 8), (-1, 7)):
        node.write("feedback.align", by, axis=axis)
        node.run(100)
        assert node.read("axis.position", axis=axis) == at * COUNT
        assert node.read("axis.position", axis=other(axis)) == 0
    assert node.read("axis.target", axis=axis) == 0, "the target does not follow"


def test_a_lost_step_of_pulses_is_an_event(node):
    node.start()
    for axis in (0, 1):
        node.write("axis.sensing", deglitch=8, axis=axis)
        node.run(40)
        node.pulse("encoder_a", axis, 5)
        node.run(40)
        assert not node.bits("axis.encoder_events", axis), "of A and B it is a disturbance"
        node.write("feedback.decoder_mode", 3, axis=axis)
        node.run(40)
        node.pulse("encoder_a", axis, 5)
        node.run(40)
        assert node.bits("axis.encoder_events", axis) == {"pulse_too_short"}
        node.write("feedback.position_source", counts=1, steps=1, axis=axis)
        node.write("axis.encoder_events", 63, axis=axis)
        node.pulse("encoder_a", axis, 5)
        node.run(40)
        assert not node.bits("axis.encoder_events", axis), "the pins are not in use"


# ------------------------------------------------------------------ segment table


def segments(node, axis, errors=(400, 3000, -2000, 1000), **use):
    """A table of three segments of 4 counts."""
    node.write("feedback.segment_origin", 0, axis=axis)
    node.write("feedback.segment_length", 4 * COUNT, axis=axis)
    for border, error in enumerate(errors):
        node.write("feedback.segment_point", value=error, border=border, axis=axis)
    node.write("feedback.segment_use", enable=1, segments=3, axis=axis, **use)
    node.ticks(1)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_segment_table_corrects_the_position_and_moves_the_target_with_it(node, axis):
    node.start()
    node.count(axis, 6)
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    node.ticks(2)
    assert not node.bits("feedback.segment_state", axis)
    segments(node, axis)
    assert "in_force" in node.bits("feedback.segment_state", axis)
    assert not node.bits("feedback.segment_state", other(axis))
    assert node.read("feedback.segment_error", axis=axis) == 500, "the mean of 3000 and -2000"
    assert node.read("axis.position", axis=axis) == 6 * COUNT - 500
    assert node.read("axis.target", axis=axis) == 6 * COUNT - 500
    node.write("feedback.capture_sources", 5, axis=axis)
    node.write("feedback.segment_use", enable=0, segments=3, axis=axis)
    node.ticks(2)
    assert node.read("axis.position", axis=axis) == 6 * COUNT == node.read("axis.target", axis=axis)
    node.write("feedback.segment_use", enable=1, segments=3, linear=1, axis=axis)
    node.ticks(2)
    assert node.read("axis.position", axis=axis) == 6 * COUNT - 500
    node.count(axis, 1)
    node.run(400)
    assert node.read("axis.position", axis=axis) == 7 * COUNT + 750
    node.write("feedback.segment_use", enable=1, segments=3, linear=0, axis=axis)
    node.run(400)
    assert node.read("feedback.segment_error", axis=axis) == 500, "the mean, also beside the middle"
    node.write("feedback.segment_use", enable=1, segments=3, linear=1, axis=axis)
    assert "outside" not in node.bits("feedback.segment_state", axis)
    node.count(axis, 9)
    node.run(400)
    assert "outside" in node.bits("feedback.segment_state", axis)
    assert node.read("axis.position", axis=axis) == 16 * COUNT - 1000


@pytest.mark.parametrize("axis", [0, 1])
def test_a_segment_table_stays_on_the_scale_and_can_be_read(node, axis):
    node.start()
    node.count(axis, 6)
    segments(node, axis)
    node.write("axis.shift_origin", 3, axis=axis)
    node.run(300)
    assert node.read("axis.position", axis=axis) == 18 * COUNT - 500
    for border, error in ((1, 3000), (2, -2000)):
        node.write("feedback.segment_read", border, axis=axis)
        node.run(200)
        assert "known" in node.bits("feedback.segment_state", axis)
        assert node.read("feedback.segment_stored", axis=axis) == error
    node.write("feedback.segment_use", enable=0, segments=3, axis=axis)
    node.ticks(1)
    node.write("feedback.segment_origin", 12 * COUNT + 4 * COUNT, axis=axis)
    node.write("feedback.segment_use", enable=1, segments=3, axis=axis)
    node.ticks(1)
    assert node.read("feedback.segment_error", axis=axis) == 1700, "now it is the first segment"


def test_a_position_with_a_segment_table_jumps_in_one_cycle_with_its_target(node):
    """The error of the servo is not disturbed by a table that comes into force."""
    node.start()
    for axis in (0, 1):
        node.count(axis, 6)
        node.write("axis.strobes", set_target_to_position=1, axis=axis)
        node.write("axis.following_limit", 100, axis=axis)
        node.ticks(2)
        node.enable(axis, closed_loop=1)
        node.ticks(4)
        segments(node, axis)
        node.ticks(3)
        node.write("axis.shift_origin", 3, axis=axis)
        node.ticks(3)
        assert not node.bits("axis.faults", axis)


def test_a_velocity_is_not_disturbed_by_a_shift(node):
    node.start()
    for axis in (0, 1):
        node.write("axis.shift_origin", 30, axis=axis)
        for _ in range(3):
            node.run(TICK)
            assert node.read("axis.velocity", axis=axis) == 0
