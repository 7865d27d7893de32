# SPDX-License-Identifier: Apache-2.0
"""The wires of the drive-enable interlock in a node: each cause comes from its pin or its block,
switches off the drives that it concerns, and is reported by its name and position.
"""

import pytest

from tb.wiring.node import COUNT, TICK

LIMIT = 640  # cycles that a limit switch must be stable, and a few more
WATCHDOG = 1_324_000  # cycles after the last heartbeat at which the soft core counts as stopped


def other(axis):
    return 1 - axis


def judge(node, axis, cause, both=False):
    """The drive of the axis is off by this cause; the other one is on, or off as well."""
    assert not node.get("drive_enable") >> axis & 1
    assert node.bits("axis.faults", axis) == {cause}
    bit = 1 << list(node.fields("axis.faults", axis)).index(cause)
    assert node.read("axis.first_fault", axis=axis) == bit
    if both:
        assert not node.get("drive_enable")
        assert node.bits("axis.faults", other(axis)) == {cause}
    else:
        assert node.get("drive_enable") == 1 << other(axis)
        assert not node.bits("axis.faults", other(axis))
    return bit


def both_on(node):
    node.start()
    for axis in (0, 1):
        node.enable(axis)
    assert node.get("drive_enable") == 3
    for axis in (0, 1):
        assert node.bits("axis.state", axis) == {"enabled", "queue_free"}
        assert node.read("axis.causes_now", axis=axis) == 0


def test_each_drive_is_switched_on_by_its_own_request(node):
    node.start()
    for axis in (0, 1):
        assert node.get("drive_enable") == 0
        node.enable(axis)
        assert node.get("drive_enable") == 1 << axis
        assert "enabled" in node.bits("axis.state", axis)
        assert "enabled" not in node.bits("axis.state", other(axis))
        node.write("axis.control", 0, axis=axis)


def test_after_a_reset_all_drives_are_off_until_the_faults_are_reset(node):
    """Emergency stop and drive fault count as present during the reset, whatever was before."""
    for _ in range(2):
        assert node.get("drive_enable") == 0
        for axis in (0, 1):
            assert node.bits("axis.faults", axis) == {"estop", "drive"}
            node.enable(axis)
            assert node.get("drive_enable") == 0
            node.write("axis.control", 0, axis=axis)
        node.start()
        for axis in (0, 1):
            node.enable(axis)
        assert node.get("drive_enable") == 3
        node.set(rst=1)
        node.run(8)
        assert node.get("drive_enable") == 0
        node.set(rst=0)
        node.run(40)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_limit_switch_that_opens_for_less_than_a_tenth_of_a_millisecond_stops_nothing(node, axis):
    both_on(node)
    for pin in ("limit_low_open", "limit_high_open"):
        node.pulse(pin, axis, 8 * LIMIT // 10)
        node.run(LIMIT)
    assert node.get("drive_enable") == 3 and not node.bits("axis.faults", axis)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_limit_switch_stops_its_axis_and_its_position_is_latched(node, axis):
    both_on(node)
    for end, pin in (("limit_low", "limit_low_open"), ("limit_high", "limit_high_open")):
        node.count(axis, 7)
        node.count(other(axis), -3)
        node.set_bit(pin, axis, 1)
        node.run(LIMIT)
        bit = judge(node, axis, end)
        assert node.bits("axis.state", axis) == {end, "queue_free"}
        assert node.read("axis.causes_now", axis=axis) == bit
        assert node.read("axis.fault_position", axis=axis) == node.counts[axis] * COUNT
        node.write("axis.control", 0, axis=axis)
        node.count(axis, 2)
        node.set_bit(pin, axis, 0)
        node.run(LIMIT)
        assert node.read("axis.fault_position", axis=axis) == (node.counts[axis] - 2) * COUNT
        assert node.read("axis.causes_now", axis=axis) == 0
        assert node.bits("axis.faults", axis) == {end}, "it stays until it is reset"
        node.reset_faults(axis)
        assert node.read("axis.faults", "limit_low", axis=axis) == 0
        node.enable(axis)
        assert node.get("drive_enable") == 3


def test_a_limit_switch_that_bounces_does_not_stop_its_axis(node):
    both_on(node)
    for pin in ("limit_low_open", "limit_high_open"):
        for axis in (0, 1):
            node.set_bit(pin, axis, 1)
            node.run(LIMIT // 3)
            assert not node.bits("axis.state", axis) & {"limit_low", "limit_high"}
            node.set_bit(pin, axis, 0)
            node.run(LIMIT)
    assert node.get("drive_enable") == 3
    assert not node.bits("axis.faults", 0) | node.bits("axis.faults", 1)


@pytest.mark.parametrize("axis", [0, 1])
def test_while_homing_a_limit_switch_is_no_fault(node, axis):
    both_on(node)
    node.enable(axis, homing=3)
    node.set_bit("limit_low_open", axis, 1)
    node.set_bit("limit_high_open", axis, 1)
    node.run(LIMIT)
    assert node.get("drive_enable") == 3
    assert {"limit_low", "limit_high"} <= node.bits("axis.state", axis)
    assert not node.bits("axis.faults", axis)


def test_a_pressed_switch_blocks_the_command_into_it_and_no_other(node):
    both_on(node)
    for axis in (0, 1):
        node.write("axis.open_command", 16000, axis=axis)
        node.enable(axis, homing=3)
    node.ticks(3)
    for sign, pin in ((1, "limit_high_open"), (-1, "limit_low_open")):
        for axis in (0, 1):
            node.write("axis.open_command", sign * 16000, axis=axis)
        node.ticks(3)
        assert [node.read("axis.command", axis=n) for n in (0, 1)] == [sign * 16000] * 2
        node.set_bit(pin, 0, 1)
        node.ticks(2)
        assert [node.read("axis.command", axis=n) for n in (0, 1)] == [0, sign * 16000]
        node.set_bit(pin, 0, 0)
        node.set_bit(pin, 1, 1)
        node.ticks(3)
        assert [node.read("axis.command", axis=n) for n in (0, 1)] == [sign * 16000, 0]
        node.set_bit(pin, 1, 0)
        node.ticks(3)


def test_the_emergency_stop_stops_all_axes(node):
    both_on(node)
    node.set(estop_open=1)
    node.run(6)
    bit = judge(node, 0, "estop", both=True)
    assert "estop" in node.bits("axis.state", 1)
    assert node.read("axis.causes_now", axis=1) == bit
    for axis in (0, 1):
        node.reset_faults(axis)
        assert node.bits("axis.faults", axis) == {"estop"}, "it is still pressed"
    node.set(estop_open=0)
    node.run(6)
    for axis in (0, 1):
        node.reset_faults(axis)
        node.enable(axis)
    assert node.get("drive_enable") == 3
    assert not node.bits("axis.faults")


@pytest.mark.parametrize("axis", [0, 1])
def test_the_fault_pin_of_a_drive_stops_its_axis(node, axis):
    both_on(node)
    node.set_bit("drive_fault_n", axis, 0)
    node.run(8)
    judge(node, axis, "drive")
    assert "drive_fault" in node.bits("axis.state", axis)
    node.set_bit("drive_fault_n", axis, 1)
    node.run(8)
    node.reset_faults(axis)
    node.enable(axis)
    assert node.get("drive_enable") == 3


@pytest.mark.parametrize("axis", [0, 1])
def test_an_encoder_fault_stops_its_axis_if_the_mask_says_so(node, axis):
    both_on(node)

    def jump():
        node.set_bit("encoder_a", axis, 1 - (node.get("encoder_a") >> axis & 1))
        node.set_bit("encoder_b", axis, 1 - (node.get("encoder_b") >> axis & 1))
        node.run(20)

    jump()
    assert node.get("drive_enable") == 3
    assert node.bits("axis.encoder_events", axis) == {"illegal_edge"}
    assert not node.bits("axis.encoder_events", other(axis))
    node.write("axis.encoder_events", 63, axis=axis)
    node.run(20)
    assert not node.bits("axis.encoder_events", axis), "there is no new one"
    node.write("axis.encoder_fault_mask", 1, axis=axis)
    jump()
    judge(node, axis, "encoder")


@pytest.mark.parametrize("axis, loop", [(0, "closed_loop"), (1, "closed_loop"), (0, "fine")])
def test_a_following_error_stops_its_axis_in_closed_loop(node, axis, loop):
    both_on(node)
    node.write("axis.following_limit", 3 * COUNT, axis=axis)
    node.count(axis, 5)
    node.ticks(4)
    assert node.get("drive_enable") == 3, "the loop is open"
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    node.enable(axis, **{loop: 1})
    node.ticks(4)
    node.count(axis, 2)
    node.ticks(3)
    assert node.get("drive_enable") == 3
    assert node.read("axis.following_error", axis=axis) == -2 * COUNT
    node.count(axis, 2)
    node.ticks(3)
    judge(node, axis, "following_error")


@pytest.mark.parametrize("axis", [0, 1])
def test_the_first_error_after_the_loop_is_closed_does_not_count(node, axis):
    both_on(node)
    node.write("axis.following_limit", 3 * COUNT, axis=axis)
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    node.ticks(2)
    node.count(axis, 5)
    node.write("node.start_axes", 4)  # a tick begins here
    node.run(TICK - 300)
    node.enable(axis, closed_loop=1)
    node.run(400)  # the next tick has seen the error
    node.count(axis, -5)
    node.ticks(3)
    assert node.get("drive_enable") == 3


@pytest.mark.parametrize("axis", [0, 1])
def test_a_profile_that_runs_out_stops_its_axis(node, axis):
    both_on(node)
    node.segment(axis, 100, 5, last=False)
    node.write("axis.strobes", start=1, axis=axis)
    node.ticks(4)
    assert node.get("drive_enable") == 3
    node.ticks(6)
    judge(node, axis, "profile_underrun")


@pytest.mark.parametrize("axis", [0, 1])
def test_overdue_steps_stop_their_axis(node, axis):
    both_on(node)
    node.write("actuator.drive", 1, axis=axis)
    node.write("actuator.step_ratio", 4000 << 32, axis=axis)
    node.ticks(2)
    node.segment(axis, 10000, 400)
    node.write("axis.strobes", start=1, axis=axis)
    node.ticks(60)
    judge(node, axis, "step_overrun")


def test_a_tick_that_comes_too_soon_stops_all_axes(node):
    both_on(node)
    node.write("node.tick_period", 300)
    node.ticks(2)
    judge(node, 0, "servo_overrun", both=True)


def test_a_silent_bus_stops_all_axes_and_a_good_frame_keeps_them_on(node):
    node.start()
    node.write("bus.bit_time", 16 * 16)
    node.write("bus.watchdog_time", 4)
    node.run(8 * 5000)
    for axis in (0, 1):
        node.enable(axis)
    for _ in range(4):
        node.run(2 * 5000)
        node.send_frame()
        assert node.get("drive_enable") == 3
    assert node.read("bus.frames_good") == 4
    node.run(5 * 5000)
    judge(node, 0, "bus_watchdog", both=True)


def test_a_soft_core_that_traps_stops_all_axes(node):
    both_on(node)
    node.crash()
    node.run(200)
    assert node.get("drive_enable") == 0
    node.set(rst=1)
    node.run(4)


def test_the_heartbeat_of_the_soft_core_keeps_the_drives_on(node):
    """They are on until a while after the last heartbeat, not after they were switched on."""
    both_on(node)
    node.run(100_000)
    node.write("node.heartbeat", 1)
    node.run(WATCHDOG - 50_000)
    assert node.get("drive_enable") == 3
    node.run(100_000)
    judge(node, 0, "cpu", both=True)
