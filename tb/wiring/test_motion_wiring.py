# SPDX-License-Identifier: Apache-2.0
"""The wires of time, registers and motion engine in a node: ticks, profiles, starts, servo, and the
drives that follow them.
"""

import pytest

from tb.wiring.node import CLK_HZ, COUNT, REGISTERS, TICK

FULL = 1 << 15


def other(axis):
    return 1 - axis


def play(node, axis, velocity, ticks):
    node.segment(axis, velocity, ticks)
    node.write("axis.strobes", start=1, axis=axis)


def test_the_node_reports_what_it_is(node):
    build = node.fields("node.build")
    assert build == {"axes": 3, "address": 5, "memory": 4, "scope": 1}
    assert node.fields("peripherals.built") == dict.fromkeys(node.fields("peripherals.built"), 1)
    assert node.read("node.clk_hz") == CLK_HZ
    first = node.now, node.read("node.time_stamp")
    node.run(1000)
    second = node.now, node.read("node.time_stamp")
    apart = second[1] - first[1] - (second[0] - first[0])
    assert abs(apart) < 100, "it counts cycles"


def test_each_axis_reports_what_it_is_built_with(node):
    full = dict.fromkeys(node.fields("axis.built"), 1) | {"filters": 2, "segments": 255}
    assert node.fields("axis.built", 0) == full
    assert node.fields("axis.built", 1) == full | {"capture": 0}
    assert node.fields("axis.built", 2) == dict.fromkeys(full, 0)


def test_settings_read_back_in_each_block(node):
    settings = {
        "node.tick_period": 123456,
        "bus.watchdog_time": 4321,
        "peripherals.edm_filter": 77,
    }
    of_axes = {"axis.kp": 0x123456, "feedback.compare_count": 99, "actuator.pwm_period": 345}
    for name, value in settings.items():
        node.write(name, value)
    for axis in (0, 1):
        for name, value in of_axes.items():
            node.write(name, value + axis, axis=axis)
    for name, value in settings.items():
        assert node.read(name) == value
    for axis in (0, 1):
        for name, value in of_axes.items():
            assert node.read(name, axis=axis) == value + axis
    assert node.read("axis.kp", axis=2) == 0, "it has no servo"
    assert ("axis", "kp") in REGISTERS


@pytest.mark.parametrize("axis", [0, 1])
def test_a_profile_moves_the_target_of_its_axis_at_the_ticks(node, axis):
    node.start()
    node.enable(axis)
    assert node.read("axis.state", "queue_free", axis) == 16
    node.segment(axis, 3000, 6, last=False)
    node.segment(axis, -1000, 4)
    assert node.read("axis.state", "queue_free", axis) == 14
    node.write("axis.strobes", start=1, axis=axis)
    node.ticks(4)
    assert "moving" in node.bits("axis.state", axis)
    assert "moving" not in node.bits("axis.state", other(axis))
    assert 0 < node.read("axis.target", axis=axis) < 18000
    node.ticks(9)
    assert node.read("axis.target", axis=axis) == 6 * 3000 - 4 * 1000
    assert "moving" not in node.bits("axis.state", axis)
    assert node.read("axis.target", axis=other(axis)) == 0
    assert not node.bits("axis.faults", axis)


OFF, PREPARED, STREAMING, EXTRAPOLATING, ENDED = range(5)
RELEASED, STOPPED, LATE, FAULT = 1, 2, 3, 4
TOO_LATE, OUT_OF_TRAVEL = 1, 3


def stream(node, axis, ticks=200):
    """Open a stream of an axis, with wide limits, from where it is."""
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    limits = {"velocity": 1 << 30, "acceleration": 1 << 30}
    for name, value in limits.items():
        node.write(f"axis.stream_{name}_limit", value, axis=axis)
    for register in ("axis.stop_deceleration", "axis.stop_jerk"):
        node.write(register, 1 << 31, axis=axis)
    node.write("axis.stream_travel_low", -(1 << 30), axis=axis)
    node.write("axis.stream_travel_high", 1 << 30, axis=axis)
    node.write("node.late_limit", ticks)
    node.write("node.stream_axes", 1 << axis)
    node.ticks(4)


def commit(node, axis, tick, position, velocity=0):
    """A set-point at a tick: position in 2^-16 period, velocity in that per tick."""
    node.write("axis.set_point_position", position, axis=axis)
    node.write("axis.set_point_velocity", velocity << 8, axis=axis)
    node.write("node.set_point_tick", tick)
    node.write("node.set_point_commit", 1 << axis)


def set_point(node, axis, tick, position, velocity=0):
    """A set-point, until the engine has its pieces."""
    commit(node, axis, tick, position, velocity)
    node.run(TICK // 2)


@pytest.mark.parametrize("axis", [0, 1])
def test_an_axis_follows_set_points_until_it_is_released(node, axis):
    node.start()
    node.enable(axis)
    node.ticks(2)
    assert node.read("axis.stream_state", "mode", axis) == OFF
    stream(node, axis)
    assert node.read("axis.stream_state", "mode", axis) == PREPARED
    first = node.read("node.tick_count") + 20
    set_point(node, axis, first, 10_000, 1_000)
    set_point(node, axis, first + 10, 20_000, 1_000)
    assert node.read("axis.stream_state", "mode", axis) == STREAMING
    assert node.read("axis.stream_state", "mode", other(axis)) == OFF
    assert "moving" in node.bits("axis.state", axis)
    set_point(node, axis, first + 30, 30_000)
    node.ticks(55)
    assert abs(node.read("axis.target", axis=axis) - 30_000) <= 1, (
        "jerk and acceleration are rounded"
    )
    assert node.read("axis.target", axis=other(axis)) == 0
    assert node.fields("axis.stream_counts", axis) == {"accepted": 3, "late": 0, "refused": 0}
    node.write("node.stream_axes", 0)
    node.ticks(3)
    assert node.read("axis.stream_state", "mode", axis) == OFF
    assert node.read("axis.stream_state", "ended", axis) == RELEASED
    assert not node.bits("axis.faults", axis)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_stream_has_room_for_16_set_points_and_says_why_it_refuses_one(node, axis):
    node.start()
    node.enable(axis)
    node.ticks(2)
    stream(node, axis)
    assert node.read("axis.stream_state", "room", axis) == 16
    first = node.read("node.tick_count") + 40
    commit(node, axis, first, 0, 250)
    assert node.read("axis.stream_state", "room", axis) == 15
    assert node.read("axis.state", "queue_free", axis) == 16, "it waits for the engine"
    node.run(TICK // 2)
    for number in (1, 2, 3):
        set_point(node, axis, first + 4 * number, 1000 * number, 250)
    assert 10 <= node.read("axis.stream_state", "room", axis) <= 13
    assert node.read("axis.stream_state", "refusal", axis) == 0
    set_point(node, axis, first, 0)
    assert node.read("axis.stream_state", "refusal", axis) == TOO_LATE
    set_point(node, axis, first + 20, 1 << 31)
    assert node.read("axis.stream_state", "refusal", axis) == OUT_OF_TRAVEL
    assert node.fields("axis.stream_counts", axis) == {"accepted": 4, "late": 1, "refused": 1}
    assert node.read("axis.stream_state", "refusal", other(axis)) == 0


@pytest.mark.parametrize("axis", [0, 1])
def test_a_stream_without_set_points_goes_on_and_stops_and_a_late_one_is_counted(node, axis):
    node.start()
    node.enable(axis)
    node.ticks(2)
    stream(node, axis, ticks=30)
    now = node.read("node.tick_count")
    set_point(node, axis, now + 20, 10_000, 1_000)
    node.ticks(28)
    assert node.read("axis.stream_state", "mode", axis) == EXTRAPOLATING
    assert node.read("axis.target", axis=axis) > 12_000
    set_point(node, axis, now + 15, 10_000)
    assert node.read("axis.stream_counts", "late", axis) == 1
    node.ticks(40)
    assert node.read("axis.stream_state", "ended", axis) == LATE
    assert 20 <= node.read("axis.stream_state", "extrapolated", axis) < 80
    assert "moving" not in node.bits("axis.state", axis)
    assert not node.bits("axis.faults", axis), "the player stops it, before the queue is empty"


def test_segments_in_the_registers_are_left_out_while_an_axis_is_streamed(node):
    node.start()
    node.enable(0)
    node.ticks(2)
    stream(node, 0)
    set_point(node, 0, node.read("node.tick_count") + 20, 10_000, 1_000)
    free = node.read("axis.state", "queue_free")
    node.segment(0, 0x4000, 100)
    assert node.read("axis.state", "queue_free") >= free
    node.ticks(12)
    assert abs(node.read("axis.target")) < 10_000


def test_a_reset_ends_a_stream(node):
    node.start()
    node.enable(0)
    node.ticks(2)
    stream(node, 0)
    assert node.read("axis.stream_state", "mode") == PREPARED
    node.reset()
    node.run(4000)
    assert node.read("axis.stream_state", "mode") == OFF
    assert node.read("node.tick_count") == 0


def test_a_stream_ends_in_a_stop_and_needs_a_drive(node):
    node.start()
    node.enable(0)
    node.ticks(2)
    stream(node, 0)
    set_point(node, 0, node.read("node.tick_count") + 20, 10_000, 1_000)
    node.ticks(8)
    node.write("axis.strobes", controlled_stop=1)
    node.ticks(8)
    assert node.read("axis.stream_state", "ended") == STOPPED
    node.write("node.stream_axes", 0)
    node.write("axis.control", 0)
    node.ticks(2)
    stream(node, 0)
    assert node.read("axis.stream_state", "mode") == ENDED
    assert node.read("axis.stream_state", "ended") == FAULT


def stepper(node, axis):
    """A stepper with 40 steps in a period."""
    node.start()
    node.write("actuator.drive", 1, axis=axis)
    node.write("actuator.step_ratio", 40 << 32, axis=axis)


def stepper_with_backlash(node, axis, hysteresis, rate=0):
    """A stepper with 40 steps in a period and half a period of backlash, on; hysteresis in 2^-8
    period, rate in 2^-16 period/tick.
    """
    stepper(node, axis)
    node.write("feedback.backlash", 0x8000, axis=axis)
    node.write("feedback.backlash_rate", value=rate, hysteresis=hysteresis, axis=axis)
    node.enable(axis)
    node.ticks(3)


@pytest.mark.parametrize("axis", [0, 1])
def test_steps_take_the_backlash_up_at_a_reversal(node, axis):
    stepper_with_backlash(node, axis, hysteresis=1)
    steps = []
    for velocity in (0x4000, -0x4000, -0x4000):
        before = node.read("actuator.steps", axis=axis)
        play(node, axis, velocity, 4)
        node.ticks(16)
        steps.append(node.read("actuator.steps", axis=axis) - before)
    assert steps[1:] == [-60, -40], "20 more in the first motion back"
    assert node.read("actuator.steps", axis=other(axis)) == 0


@pytest.mark.parametrize("axis", [0, 1])
def test_the_table_is_behind_a_sensor_at_the_motor_until_a_reset(node, axis):
    stepper_with_backlash(node, axis, hysteresis=1)
    before = node.read("axis.position", axis=axis)
    play(node, axis, 0x4000, 4)
    node.ticks(16)
    assert node.read("axis.position", axis=axis) == before
    node.write("feedback.backlash_rate", hysteresis=1, motor_side=1, axis=axis)
    node.run(100)
    assert node.read("axis.position", axis=axis) == before - 0x8000
    node.reset()
    stepper_with_backlash(node, axis, hysteresis=1)
    node.write("feedback.backlash_rate", hysteresis=1, motor_side=1, axis=axis)
    node.ticks(3)
    assert node.read("axis.position", axis=axis) >= 0


@pytest.mark.parametrize("axis", [0, 1])
def test_backlash_is_taken_up_at_its_rate(node, axis):
    stepper_with_backlash(node, axis, hysteresis=1, rate=0x1000)  # in eight ticks
    play(node, axis, 0x4000, 4)
    node.ticks(16)
    before = node.read("actuator.steps", axis=axis)
    play(node, axis, -0x4000, 2)
    node.ticks(6)
    assert before - node.read("actuator.steps", axis=axis) < 33
    node.ticks(10)
    assert before - node.read("actuator.steps", axis=axis) == 20 + 20


@pytest.mark.parametrize("axis", [0, 1])
def test_a_small_motion_back_takes_no_backlash_up(node, axis):
    stepper_with_backlash(node, axis, hysteresis=127)
    play(node, axis, 0x4000, 4)
    node.ticks(16)
    steps = node.read("actuator.steps", axis=axis)
    node.segment(other(axis), -0x4000, 12)
    node.segment(axis, -0x400, 20)  # 0x5000 of 0x7F00
    node.write("node.start_axes", 3)
    node.ticks(30)
    assert node.read("axis.target", axis=axis) == 0x10000 - 20 * 0x400
    assert abs(node.read("actuator.steps", axis=axis) - steps + 12.5) <= 1


def test_the_profiles_of_two_axes_start_at_the_same_tick_by_one_write(node):
    node.start()
    for axis in (0, 1):
        node.segment(axis, 3000 + axis, 40)
    node.write("node.start_axes", 2)
    node.ticks(5)
    assert node.read("axis.target", axis=0) == 0 < node.read("axis.target", axis=1)
    node.write("node.start_axes", 1)
    node.ticks(3)
    assert node.read("axis.target", axis=0) > 0


def test_a_sync_pulse_begins_a_tick(node):
    """So the motions of several nodes begin together."""
    node.start()
    node.write("bus.bit_time", 256)
    node.write("bus.sync_axes", 1)
    node.write("feedback.capture_sources", 2)
    delays = set()
    for quarter in range(4):
        node.run(quarter * TICK // 4)
        node.send_sync()
        at = node.now
        node.write("feedback.strobes", capture_clear=1)
        node.ticks(3)
        times = []
        for _ in range(2):
            times.append(node.read("feedback.captured_time"))
            node.write("feedback.strobes", capture_next=1)
        assert times[1] - times[0] == TICK
        delays.add((times[0] - at) % (1 << 32))
    assert len(delays) == 1 and TICK - 300 < delays.pop() < TICK


def test_a_sync_pulse_starts_the_axes_that_wait_for_it(node):
    node.start()
    node.write("bus.bit_time", 256)
    for axis in (0, 1):
        node.segment(axis, 3000, 40)
    node.write("bus.sync_axes", 2)
    node.send_sync()
    node.ticks(4)
    assert node.read("axis.target", axis=0) == 0 < node.read("axis.target", axis=1)
    assert node.read("bus.syncs") == 1


@pytest.mark.parametrize("axis", [0, 1])
def test_an_armed_profile_starts_at_its_time(node, axis):
    node.start()
    node.segment(axis, 3000, 40)
    node.write("axis.start_at", node.read("node.time_stamp") + 10 * TICK, axis=axis)
    node.write("axis.strobes", arm=1, axis=axis)
    node.ticks(7)
    assert "armed" in node.bits("axis.state", axis)
    assert node.read("axis.target", axis=axis) == 0
    node.ticks(6)
    assert "armed" not in node.bits("axis.state", axis)
    assert node.read("axis.target", axis=axis) > 0


@pytest.mark.parametrize("axis", [0, 1])
def test_a_controlled_stop_ends_a_profile(node, axis):
    node.start()
    play(node, axis, 3000, 1000)
    node.ticks(6)
    node.write("axis.strobes", controlled_stop=1, axis=axis)
    node.ticks(8)
    stopped = node.read("axis.target", axis=axis)
    node.ticks(4)
    assert 0 < stopped == node.read("axis.target", axis=axis)
    assert "moving" not in node.bits("axis.state", axis)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_target_takes_the_position_and_follows_a_shift_of_the_origin(node, axis):
    node.start()
    node.count(axis, 9)
    node.count(other(axis), -2)
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    node.ticks(3)
    assert node.read("axis.target", axis=axis) == 9 * COUNT
    assert node.read("axis.position", axis=axis) == 9 * COUNT
    assert node.read("axis.following_error", axis=axis) == 0
    assert node.read("axis.following_error", axis=other(axis)) == 2 * COUNT
    node.write("axis.shift_origin", -5, axis=axis)
    node.ticks(3)
    for register in ("axis.target", "axis.position"):
        assert node.read(register, axis=axis) == 9 * COUNT - (5 << 16)
        assert node.read(register, axis=other(axis)) == (0 if "target" in register else -2 * COUNT)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_velocity_is_measured_and_has_its_sign(node, axis):
    node.start()
    for sign in (1, -1):
        for _ in range(4):
            node.count(axis, sign * 10, TICK // 10)
        assert node.read("axis.velocity", axis=axis) == pytest.approx(sign * 10 * COUNT, rel=0.15)
        assert abs(node.read("axis.velocity", axis=other(axis))) < COUNT
        node.ticks(3)


def test_the_velocity_between_two_steps_has_the_sign_of_the_steps(node):
    """A slow motion is measured by the time between two steps, and their sign."""
    node.start()
    for axis in (0, 1):
        node.write("feedback.velocity_quantum", COUNT, axis=axis)
    for axis in (0, 1):
        for sign in (1, -1):
            for _ in range(6):
                node.count(axis, sign, 2 * TICK)
            expected = sign * COUNT / 2
            assert node.read("axis.velocity", axis=axis) == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("axis", [0, 1])
def test_an_edge_that_is_passed_up_and_down_is_at_one_place(node, axis):
    """Between the step up over an edge and the step down over it the way is 0."""
    node.start()
    node.write("feedback.velocity_quantum", COUNT, axis=axis)
    node.count(axis, 4, 2 * TICK)
    for sign in (-1, 1):
        node.count(axis, sign, 2 * TICK)
        assert abs(node.read("axis.velocity", axis=axis)) < COUNT / 10
        node.count(axis, 3 * sign, 2 * TICK)
        expected = sign * COUNT / 2
        assert node.read("axis.velocity", axis=axis) == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_servo_answers_an_error_with_the_gains_of_its_axis(node, axis):
    node.start()
    node.write("axis.kp", 1000, axis=axis)
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    node.enable(axis, closed_loop=1)
    node.ticks(2)
    node.count(axis, -4)
    node.ticks(3)
    assert node.read("axis.command", axis=axis) == 1000 * 4 * COUNT >> 16
    assert node.read("axis.command", axis=other(axis)) == 0
    assert "saturated" not in node.bits("axis.state", axis)
    node.write("axis.output_limit", 700, axis=axis)
    node.ticks(3)
    assert node.read("axis.command", axis=axis) == 700
    assert "saturated" in node.bits("axis.state", axis)
    assert "saturated" not in node.bits("axis.state", other(axis))


@pytest.mark.parametrize("axis", [0, 1])
def test_the_servo_takes_a_new_gain_without_a_bump(node, axis):
    node.start()
    node.write("axis.kp", 1000, axis=axis)
    node.write("axis.ki", 1, axis=axis)
    node.write("axis.integral_limit", 0x7FFF, axis=axis)
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    node.enable(axis, closed_loop=1)
    node.ticks(2)
    node.count(axis, -4)
    node.ticks(3)
    held = node.read("axis.command", axis=axis)
    assert held == pytest.approx(1000 * 4 * COUNT >> 16, abs=5)
    node.write("axis.kp", 3000, axis=axis)
    node.ticks(4)
    assert node.read("axis.command", axis=axis) == pytest.approx(held, abs=5)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_filters_of_an_axis_act_on_its_command(node, axis):
    node.start()
    node.write("axis.kp", 1000, axis=axis)
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    node.enable(axis, closed_loop=1)
    node.count(axis, -4)
    for number, filter in enumerate((0.5, 0.25)):
        node.write("axis.filter_address", 8 * number, axis=axis)
        node.write("axis.filter_value", int(filter * 2**30), axis=axis)
        node.write("axis.filter_address", 8 * number + 5, axis=axis)
        node.write("axis.filter_value", 1, axis=axis)
    node.ticks(4)
    assert node.read("axis.command", axis=axis) == 1000 >> 3


@pytest.mark.parametrize("axis", [0, 1])
def test_the_integral_rests_while_a_switch_blocks_its_direction(node, axis):
    node.start()
    node.write("axis.ki", 1 << 16, axis=axis)  # 256 in each tick, with an error of 4 counts
    node.write("axis.integral_limit", 0x7FFF, axis=axis)
    for sign, pin, opposite in (
        (1, "limit_high_open", "limit_low_open"),
        (-1, "limit_low_open", "limit_high_open"),
    ):
        for pressed, grows in ((pin, False), (opposite, True)):
            node.write("axis.strobes", set_target_to_position=1, axis=axis)
            node.enable(axis, closed_loop=1, homing=3)
            node.set_bit(pressed, axis, 1)
            node.run(640)
            node.count(axis, -4 * sign)
            node.ticks(12)
            node.set_bit(pressed, axis, 0)
            node.run(640)
            node.ticks(2)
            command = sign * node.read("axis.command", axis=axis)
            assert (command > 10 * 256) == grows and command > 0
            node.write("axis.control", 0, axis=axis)
            node.ticks(2)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_bridge_drives_by_the_command_of_its_axis(node, axis):
    node.start()
    node.enable(axis)
    for sign in (1, -1):
        node.write("axis.open_command", sign * FULL // 4, axis=axis)
        node.ticks(3)
        node.watch("bridge_a", "bridge_b")
        node.run(20 * 200)
        changes = node.changes()
        moving, still = ("bridge_a", "bridge_b") if sign > 0 else ("bridge_b", "bridge_a")
        off = [c for c in changes if c.pin == still and not c.value >> axis & 1]
        on = [c for c in changes if c.pin == still and c.value >> axis & 1]
        assert not [c for c in changes if c.pin == moving]
        assert node.get(moving) == 1 << axis and abs(len(off) - 20) <= 1
        lengths = {
            b.cycle - a.cycle for a, b in zip(off, [c for c in on if c.cycle > off[0].cycle])
        }
        assert lengths <= {49, 50, 51}
    node.write("axis.control", 0, axis=axis)
    node.run(8)
    assert node.levels("bridge_a", "bridge_b") == (0, 0)


def test_the_period_of_a_bridge_is_its_setting(node):
    node.start()
    node.enable(0)
    node.write("actuator.pwm_period", 100)
    node.write("axis.open_command", FULL // 2)
    node.ticks(3)
    node.watch("bridge_b")
    node.run(1000)
    falls = [c.cycle for c in node.changes() if not c.value]
    assert {b - a for a, b in zip(falls, falls[1:])} == {100}


def test_a_bridge_takes_its_period_with_a_command(node):
    node.start()
    node.write("node.tick_period", 20_000)
    node.enable(0)
    node.write("axis.open_command", FULL // 2)
    node.run(40_000)
    delays = []
    for period, wait in ((100, 7_000), (200, 7_000), (100, 0)):
        node.write("actuator.pwm_period", period)
        node.watch("bridge_b")
        node.run(25_000)
        falls = [c.cycle for c in node.changes() if not c.value]
        changed = next(a for a, b in zip(falls, falls[1:]) if b - a == period)
        delays.append(changed - falls[0])
        node.run(wait)
    assert max(delays) > 2_000, "some of them were written long before the next command"


def test_a_dac_gets_a_word_with_each_command(node):
    node.start()
    node.write("actuator.drive", 2)
    node.write("actuator.dac", half_period=1, refresh=0xFFFF)
    node.enable(0)
    node.ticks(3)
    node.watch("dac_cs_n")
    node.ticks(8)
    assert len([c for c in node.changes() if not c.value & 1]) in (7, 8, 9)


@pytest.mark.parametrize("drive", [0, 2, 3])
def test_an_axis_with_another_drive_makes_no_steps(node, drive):
    node.start()
    node.write("actuator.drive", drive)
    node.write("actuator.step_ratio", 40 << 32)
    node.enable(0)
    node.ticks(3)
    node.watch("step", "direction")
    play(node, 0, 0x4000, 4)
    node.ticks(8)
    assert not node.changes() and node.read("actuator.steps") == 0


@pytest.mark.parametrize("step_low, direction_low", [(0, 1), (1, 0)])
def test_each_pin_of_a_stepper_has_its_own_polarity(node, step_low, direction_low):
    node.start()
    node.write("actuator.drive", 1)
    node.write("actuator.step_output", step_low=step_low, direction_low=direction_low)
    node.run(80)
    assert (node.get("step") & 1, node.get("direction") & 1) == (step_low, direction_low)


def test_a_tick_that_comes_late_adds_no_steps(node):
    """A sync pulse begins a new tick, so the line of the one before ends before the next begins."""
    node.start()
    node.write("bus.bit_time", 256)
    node.write("actuator.drive", 1)
    node.write("actuator.step_ratio", 40 << 32)
    node.enable(0)
    node.ticks(3)
    node.write("bus.sync_axes", 2)  # another axis; the tick is that of both
    play(node, 0, 0x4000, 20)
    node.ticks(6)
    for _ in range(3):
        node.send_sync()
    node.ticks(20)
    assert node.read("bus.syncs") == 3
    assert node.read("actuator.steps") == 200


def test_steps_faster_than_the_clock_are_a_fault(node):
    node.start()
    node.write("actuator.drive", 1)
    node.write("actuator.step_ratio", 32767 << 32)
    node.enable(0)
    node.ticks(3)
    play(node, 0, 0x4000, 4)
    node.ticks(8)
    assert "step_overrun" in node.bits("axis.faults")


def steps_of(node, axis, name="step"):
    return [c.cycle for c in node.changes() if c.pin == name and c.value >> axis & 1]


@pytest.mark.parametrize("axis", [0, 1])
def test_a_stepper_makes_the_steps_of_its_target(node, axis):
    stepper(node, axis)
    node.enable(axis)
    node.ticks(3)
    assert node.read("actuator.steps", axis=axis) == 0
    total = 0
    for sign in (1, -1):
        node.watch("step", "direction")
        play(node, axis, sign * 0x4000, 4)
        node.ticks(10)
        changes = node.changes()
        rises = [c for c in changes if c.pin == "step" and c.value >> axis & 1]
        assert len(rises) == 40
        assert not [c for c in changes if c.value >> other(axis) & 1]
        assert node.get("direction") >> axis & 1 == (sign > 0)
        total += 40 * sign
        assert node.read("actuator.steps", axis=axis) == total
        falls = [c for c in changes if c.pin == "step" and not c.value >> axis & 1]
        assert {b.cycle - a.cycle for a, b in zip(rises, falls)} == {10}
    assert not node.bits("axis.faults", axis)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_new_origin_makes_no_steps(node, axis):
    stepper(node, axis)
    node.enable(axis)
    node.ticks(3)
    node.watch("step", "direction")
    node.write("axis.shift_origin", 3, axis=axis)
    node.ticks(4)
    assert node.read("axis.target", axis=axis) == 3 << 16
    assert not node.changes()
    node.watch("step", "direction")
    play(node, axis, 0x4000, 4)
    node.ticks(10)
    assert len(steps_of(node, axis)) == 40


def test_the_times_and_levels_of_steps_are_the_settings(node):
    node.start()
    node.write("actuator.drive", 1)
    node.write("actuator.step_ratio", 400 << 32)
    node.write("actuator.step_pulse", high=23, low=31)
    node.write("actuator.step_direction", setup=47, hold=59)
    node.write("actuator.step_output", step_low=1, direction_low=1)
    node.run(80)
    assert node.get("step") & 1 == 1
    node.enable(0)
    node.ticks(3)
    node.watch("step", "direction")
    node.segment(0, 0x4000, 2, last=False)
    node.segment(0, -0x4000, 2)
    node.write("axis.strobes", start=1)
    node.ticks(12)
    changes = [(c.cycle, c.pin, c.value & 1) for c in node.changes()]
    turn = [c for c in changes if c[1] == "direction"]
    assert turn
    steps = [c for c in changes if c[1] == "step"]
    pulses = list(zip(steps[::2], steps[1::2]))
    assert {on[2] for on, _ in pulses} == {0}, "active low"
    assert {off[0] - on[0] for on, off in pulses} == {23}
    gaps = [b[0] - a[0] for (_, a), (b, _) in zip(pulses, pulses[1:])]
    assert min(gaps) >= 31 and 31 in gaps or min(gaps) > 31
    last_turn = turn[-1]
    before = [off for _, off in pulses if off[0] <= last_turn[0]]
    after = [on for on, _ in pulses if on[0] >= last_turn[0]]
    if before:
        assert last_turn[0] - before[-1][0] == 59
    assert after[0][0] - last_turn[0] >= 47
    assert last_turn[2] == 1, "down is high"


def test_quadrature_steps_change_both_pins(node):
    node.start()
    node.write("actuator.drive", 1)
    node.write("actuator.step_ratio", 40 << 32)
    node.write("actuator.step_output", mode=1)
    node.enable(0)
    node.ticks(3)
    node.watch("step", "direction")
    play(node, 0, 0x4000, 4)
    node.ticks(10)
    changes = [c.pin for c in node.changes()]
    assert changes == ["step", "direction"] * 20


def test_a_pressed_switch_stops_the_steps_into_it(node):
    node.start()
    for axis, (sign, pin) in enumerate(((1, "limit_high_open"), (-1, "limit_low_open"))):
        node.write("actuator.drive", 1, axis=axis)
        node.write("actuator.step_ratio", 40 << 32, axis=axis)
        node.enable(axis, homing=3)
        node.ticks(3)
        play(node, axis, sign * 0x2000, 4)
        node.ticks(8)
        assert node.read("actuator.steps", axis=axis) == sign * 20
        node.set_bit(pin, axis, 1)
        node.run(640)
        play(node, axis, sign * 0x2000, 4)
        node.ticks(8)
        assert node.read("actuator.steps", axis=axis) == sign * 20, "blocked"
        play(node, axis, -sign * 0x2000, 4)
        node.ticks(8)
        assert node.read("actuator.steps", axis=axis) != sign * 20
        node.set_bit(pin, axis, 0)


def test_a_switch_that_is_pressed_at_a_reversal_stops_the_steps_still_to_come(node):
    """The steps follow their target one tick later, and so does what a switch lets pass."""
    node.start()
    node.write("actuator.drive", 1)
    node.write("actuator.step_ratio", 40 << 32)
    node.ticks(3)
    for wait in range(5 * TICK, 8 * TICK, 380):
        node.enable(0, homing=3)
        node.segment(0, 0x4000, 5, last=False)
        node.segment(0, -0x4000, 5)
        node.write("axis.strobes", start=1)
        node.run(wait)
        node.set_bit("limit_high_open", 0, 1)
        node.run(660)
        node.watch("step", "direction")
        up = node.get("direction") & 1
        node.ticks(5)
        for change in node.changes():
            if change.pin == "direction":
                up = change.value & 1
            else:
                assert not (change.value & 1 and up), wait
        node.set_bit("limit_high_open", 0, 0)
        node.run(660)
        node.write("axis.control", 0)
        node.ticks(4)


@pytest.mark.parametrize("mode, low", [(0, 0), (0, 1), (1, 1), (2, 1)])
def test_own_steps_are_the_position_of_a_stepper_whatever_its_pins_show(node, mode, low):
    node.start()
    for axis in (0, 1):
        node.write("feedback.decoder_mode", 3, axis=axis)
        node.write("feedback.position_source", counts=1, steps=1, axis=axis)
        node.write("actuator.drive", 1, axis=axis)
        node.write("actuator.step_ratio", 4 << 32, axis=axis)
        node.run(640)
        node.write("actuator.step_output", mode=mode, step_low=low, direction_low=low, axis=axis)
        node.run(640)
        assert node.read("axis.position", axis=axis) == 0, "of a polarity"
        node.enable(axis)
        node.ticks(3)
        for sign, expected in ((1, 4), (-1, 0), (-1, -4)):
            play(node, axis, sign * 0x4000, 4)
            node.ticks(10)
            assert node.read("actuator.steps", axis=axis) == expected
            assert node.read("axis.position", axis=axis) == expected * COUNT
        # the pins take another polarity only while the drive is off
        node.write("actuator.step_output", mode=mode, direction_low=1 - low, axis=axis)
        play(node, axis, 0x4000, 4)
        node.ticks(10)
        assert node.read("axis.position", axis=axis) == 0


def test_an_own_step_counts_when_its_pulse_begins(node):
    node.start()
    for axis in (0, 1):
        node.write("feedback.decoder_mode", 3, axis=axis)
        node.write("feedback.position_source", counts=1, steps=1, axis=axis)
        node.write("actuator.drive", 1, axis=axis)
        node.write("actuator.step_ratio", 4 << 32, axis=axis)
        node.write("actuator.step_pulse", high=16000, low=10, axis=axis)
        node.enable(axis)
        node.ticks(3)
        play(node, axis, 0x4000, 1)
        node.ticks(10)
        for pin in (1, 0):
            assert node.get("step") >> axis & 1 == pin
            assert node.read("axis.position", axis=axis) == COUNT
            node.run(16000)


def words(node, axis, names=("dac_cs_n", "dac_sclk", "dac_sdi")):
    """The words of 16 bits that a serial output has sent, and the time of their ends."""
    cs, clock, data = names
    level = {name: node.last[name] for name in names}
    found, word, bits = [], 0, 0
    for c in node.changes():
        before, level[c.pin] = level[c.pin], c.value
        if c.pin == clock and c.value >> axis & 1 and not before >> axis & 1:
            if not level[cs] >> axis & 1:
                word, bits = word << 1 | level[data] >> axis & 1, bits + 1
        if c.pin == cs and c.value >> axis & 1 and not before >> axis & 1:
            found.append((c.cycle, word, bits))
            word, bits = 0, 0
    return found


@pytest.mark.parametrize("axis", [0, 1])
def test_a_dac_gets_the_command_of_its_axis(node, axis):
    node.start()
    node.write("actuator.drive", 2, axis=axis)
    node.write("actuator.dac_trim", 7, axis=axis)
    node.write("axis.open_command", 12345, axis=axis)
    node.enable(axis)
    node.ticks(3)
    node.watch_words("dac_cs_n", "dac_sclk", "dac_sdi")
    node.run(2000)
    sent = words(node, axis)
    assert {(word, bits) for _, word, bits in sent} == {(32768 + 12345 + 7, 16)}
    node.write("actuator.dac", half_period=3, refresh=700, axis=axis)
    node.run(800)
    node.watch_words("dac_cs_n", "dac_sclk", "dac_sdi")
    node.run(TICK)
    node.write("axis.control", 0, axis=axis)
    node.run(400)
    sent = words(node, axis)
    assert sent[-1][1] == 32768 + 7, "0 V while the drive is off"
    node.watch("dac_sclk")
    node.run(900)
    rises = [c.cycle for c in node.changes() if c.value >> axis & 1]
    assert {b - a for a, b in zip(rises, rises[1:])} >= {6}


def test_a_dac_repeats_its_word_after_the_refresh_time(node):
    node.start()
    node.write("actuator.drive", 2)
    node.write("actuator.dac", half_period=1, refresh=300)
    node.run(700)
    node.watch_words("dac_cs_n", "dac_sclk", "dac_sdi")
    node.run(1500)
    ends = [cycle for cycle, *_ in words(node, 0)]
    assert all(abs(b - a - 300) < 40 for a, b in zip(ends, ends[1:])) and len(ends) > 2


@pytest.mark.parametrize("axis", [0, 1])
def test_the_clock_of_a_dac_rests_low_and_a_reset_ends_a_word(node, axis):
    node.start()
    node.write("actuator.drive", 2, axis=axis)
    node.write("actuator.dac", half_period=20, refresh=2000, axis=axis)
    node.enable(axis)
    node.run(4000)
    for level in (-1, 0, -1):  # after a word, before one, after it
        assert node.reaches("dac_cs_n", level, 4000, 1 << axis)
        assert not node.get("dac_sclk") >> axis & 1
    assert node.reaches("dac_cs_n", 0, 4000, 1 << axis)
    node.run(100)
    node.set(rst=1)
    node.run(2)
    assert node.get("dac_cs_n") >> axis & 1
    node.set(rst=0)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_fine_stage_holds_by_its_gains_and_limit(node, axis):
    node.start()
    node.count(axis, 9)
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    node.write("actuator.fine_kp", 1000, axis=axis)
    node.write("actuator.fine_ki", 0, axis=axis)
    node.write("actuator.fine_limit", 20000, axis=axis)
    node.enable(axis)
    node.ticks(2)
    node.count(axis, -4)
    node.ticks(3)
    assert node.read("actuator.fine_command", axis=axis) == 0, "it is not in control"
    node.enable(axis, fine=1)
    node.ticks(4)
    assert node.read("actuator.fine_command", axis=axis) == 1000
    assert node.read("actuator.fine_command", axis=other(axis)) == 0
    node.watch_words("dac_cs_n", "dac_sclk", "dac_sdi")
    node.run(TICK)
    assert {word for _, word, _ in words(node, axis)} == {32768 + 1000}
    node.write("actuator.fine_kd", 4000, axis=axis)
    node.watch_words("dac_cs_n", "dac_sclk", "dac_sdi")
    node.count(axis, -1)
    node.ticks(3)
    assert {32768 + 1250 + 1000, 32768 + 1250} <= {word for _, word, _ in words(node, axis)}
    node.write("actuator.fine_ki", 1 << 16, axis=axis)
    node.ticks(3)
    now = node.read("actuator.fine_command", axis=axis)
    node.ticks(3)
    assert node.read("actuator.fine_command", axis=axis) > now > 1000
    assert "fine_saturated" not in node.bits("axis.state", axis)
    node.write("actuator.fine_limit", 900, axis=axis)
    node.ticks(3)
    assert node.read("actuator.fine_command", axis=axis) == 900
    assert "fine_saturated" in node.bits("axis.state", axis)
    node.write("axis.control", 0, axis=axis)
    node.ticks(2)
    node.watch_words("dac_cs_n", "dac_sclk", "dac_sdi")
    node.run(TICK)
    assert {word for _, word, _ in words(node, axis)} == {32768}
    assert node.read("actuator.fine_command", axis=axis) == 0


@pytest.mark.parametrize("axis", [0, 1])
def test_the_fine_stage_leaves_its_command_slowly_but_at_once_in_a_reset(node, axis):
    node.start()
    node.write("actuator.fine_kp", 1000, axis=axis)
    node.write("actuator.fine_ki", 1, axis=axis)
    node.write("actuator.fine_limit", 20000, axis=axis)
    node.enable(axis, fine=1)
    node.ticks(2)
    node.count(axis, -4)
    node.ticks(3)
    held = node.read("actuator.fine_command", axis=axis)
    assert held == 1000
    node.write("actuator.fine_kp", 3000, axis=axis)
    node.ticks(4)
    assert abs(node.read("actuator.fine_command", axis=axis) - held) < 50, "no bump"
    node.enable(axis)
    node.ticks(4)
    returning = node.read("actuator.fine_command", axis=axis)
    assert held - 5 * 16 - 50 < returning < held - 3 * 16 + 50
    node.reset()
    assert node.read("actuator.fine_command", axis=axis) == 0


@pytest.mark.parametrize("axis", [0, 1])
def test_crossings_of_zero_are_reported_with_their_direction(node, axis):
    node.start()
    node.count(axis, 3)
    node.run(100)
    node.write("axis.zero_crossing", 3, axis=axis)
    node.count(axis, -5)
    node.run(100)
    assert node.bits("axis.zero_crossing", axis) == {"down"}
    node.write("axis.zero_crossing", 3, axis=axis)
    node.count(axis, 5)
    node.run(100)
    assert node.bits("axis.zero_crossing", axis) == {"up"}
    node.write("axis.zero_crossing", 3, axis=axis)
    node.write("axis.shift_origin", -5, axis=axis)
    node.run(100)
    assert node.bits("axis.zero_crossing", axis) == set(), "a shift is no motion"


def test_the_first_position_after_a_reset_crosses_no_zero(node):
    node.start()
    for axis in (0, 1):
        node.count(axis, -6)
    node.run(200)
    node.reset()
    node.write("node.sample_period", 40)
    node.run(400)
    for axis in (0, 1):
        assert node.read("axis.position", axis=axis) >= 0
        assert node.bits("axis.zero_crossing", axis) == set()
