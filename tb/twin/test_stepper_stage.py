# SPDX-License-Identifier: Apache-2.0
"""The axis of S2, driven by pulses at its pins: its motion, lost steps, and its scale."""

import math

import numpy
import pytest

from twin import Machine

PULSE_M = 5e-3 / 2000
FREE = dict(
    motor_coulomb=1e-9,
    motor_static=1e-9,
    motor_viscous=0,
    motor_presliding_damping=0,
    table_coulomb=1e-9,
    table_static=1e-9,
    table_viscous=0,
    table_presliding_damping=0,
    screw_backlash=0,
)


def stepper(clk_hz=1_000_000, position=20e-3, **values):
    machine = Machine("stepper_stage", clk_hz=clk_hz, **values)
    machine.pins(drive_enable=1)
    machine.set_position(position)
    machine.run(0.01)
    return machine


def ramp(machine, rate_hz, sign=1):
    """Send pulses at a rate that grows in steps, as a profile does; returns their number."""
    rates = numpy.arange(500, rate_hz, 500)
    for rate in rates:
        machine.steps(sign * max(1, round(rate * 2e-3)), rate)
    return int(sum(max(1, round(rate * 2e-3)) for rate in rates))


def test_pulses_move_the_table_by_their_distance():
    machine = stepper(**FREE)
    start = machine.state.position_m
    for count, sign in ((400, 1), (300, -1), (1, -1)):
        machine.steps(sign * count, 2000)
        machine.run(0.3)
        start += sign * count * PULSE_M
        assert machine.state.position_m == pytest.approx(start, abs=2e-9)
    assert (
        machine.state.steps == 99
        and machine.state.lost_steps == 0
        and machine.state.step_timing_errors == 0
    )


def test_friction_and_backlash_leave_it_short_of_the_pulses_and_the_scale_sees_it():
    machine = stepper(
        stepper_microsteps=100
    )  # smooth and slow, so that the table does not coast through the backlash
    machine.steps(1000, 1000)
    machine.run(0.2)
    forward = machine.state.field_m - machine.state.position_m
    machine.steps(-1000, 1000)
    machine.run(0.2)
    lead = 5e-3 / (2 * math.pi)
    wound_up = (
        (0.033 + 9 * lead) / (50 * 1.2) * lead + 9 / 3e7 + 1e-6
    )  # rotor on its field, screw, presliding
    lost_motion = forward - (machine.state.field_m - machine.state.position_m)
    assert 5e-6 <= lost_motion < 5e-6 + 2 * wound_up
    assert machine.state.scale_counts == pytest.approx(machine.state.position_m / 0.5e-6, abs=1.1)


def test_the_rotor_rings_on_its_field():
    machine = stepper(**FREE, screw_stiffness=1.0, screw_damping=0, stepper_damping=0)
    machine.trace(100_000)
    machine.steps(1, 1000)
    machine.run(0.05)
    trace = machine.take_trace()
    speed, time = trace["motor_rad_s"], trace["time_s"]
    rises = time[1:][(speed[:-1] < 0) & (speed[1:] >= 0)]
    assert (len(rises) - 1) / (rises[-1] - rises[0]) == pytest.approx(
        math.sqrt(50 * 1.2 / 4e-5) / (2 * math.pi), rel=5e-3
    )


def test_a_load_above_the_computed_pull_out_loses_steps_by_four_full_steps():
    pull_out = 1.2 * 2 * math.pi / 5e-3  # N at the table
    for share, slips in ((0.97, False), (1.03, True)):
        machine = stepper(**FREE, travel_low_stop=-1.0, travel_high_stop=1.0)
        for n in range(1, 101):
            machine.push(-share * pull_out * n / 100)
            machine.run(2e-3)
        machine.run(0.05)
        lost = machine.state.lost_steps
        assert lost % 40 == 0 and (lost > 0) == slips and machine.state.steps == 0


def test_the_torque_falls_with_speed():
    """At twice the corner speed 1 / sqrt(5) of the torque is left."""
    for torque, holds in ((0.4, True), (0.65, False)):  # Nm, of 1.2 / sqrt(5) = 0.54
        machine = stepper(
            **{**FREE, "motor_viscous": torque / 120}, travel_high_stop=9.0
        )  # 120 rad/s = 38200 pulses a second
        ramp(machine, 38_200)
        machine.steps(8000, 38_200)
        assert (machine.state.lost_steps == 0) == holds, machine.state


def test_a_jammed_motor_and_a_start_too_fast_lose_steps():
    machine = stepper()
    with machine.fault("motor_jam"):
        machine.steps(400, 2000)
    machine.run(0.1)
    assert machine.state.lost_steps == 400 and machine.state.steps == 400
    assert machine.state.position_m == pytest.approx(20e-3, abs=2e-6)
    machine = stepper()
    machine.steps(4000, 40_000)
    assert machine.state.lost_steps > 0


def test_a_disabled_driver_takes_no_steps_and_holds_nothing():
    machine = stepper(**FREE)
    machine.pins(drive_enable=0)
    machine.steps(100, 2000)
    assert machine.state.steps == 0
    machine.push(5.0)
    machine.run(0.1)
    assert machine.state.position_m - 20e-3 > 1e-4


def test_pulses_too_short_for_the_driver_are_counted():
    machine = stepper(clk_hz=10_000_000)
    machine.steps(10, 2000, high_s=1e-6, setup_s=1e-6)
    machine.run(1e-3)
    assert machine.state.step_timing_errors == 0
    machine.steps(10, 2000, high_s=0.9e-6)
    assert machine.state.step_timing_errors == 10
    machine.run(1e-3)
    machine.steps(-10, 2000, setup_s=0.9e-6)
    assert machine.state.step_timing_errors == 11
    machine.pins(step=1)
    machine.run(0.5e-6)
    machine.pins(direction=1)  # too early behind the edge
    machine.run(1e-5)
    assert machine.state.step_timing_errors == 12


def quarters(levels):
    a, b = levels["encoder_a"].astype(int), levels["encoder_b"].astype(int)
    return numpy.diff(b << 1 | (a ^ b))


def test_the_scale_gives_an_edge_a_count_and_never_two_at_once():
    machine = stepper(clk_hz=4_000_000)
    for sign in (1, -1):
        machine.steps(sign, 1000)
        before = machine.state
        machine.pins(step=0)
        total = edges = 0
        for _ in range(40):
            machine.pins(step=1, direction=sign > 0)
            moved = (quarters(machine.watch(0.5e-3)) + 1) % 4 - 1
            machine.pins(step=0)
            moved = numpy.concatenate([moved, (quarters(machine.watch(0.5e-3)) + 1) % 4 - 1])
            assert abs(moved).max() <= 1
            total, edges = total + moved.sum(), edges + abs(moved).sum()
        after = machine.state
        # an edge may be between two calls of watch
        assert abs(total - (after.scale_counts - before.scale_counts)) <= 1
        assert 0 <= after.scale_changes - before.scale_changes - edges <= 1
        assert abs(total) > 150


def test_the_index_is_at_its_position_one_count_wide_from_both_sides():
    machine = stepper(position=74.98e-3, scale_index_scatter=0, clk_hz=1_000_000)
    for sign in (1, -1):
        machine.trace(100_000)
        machine.steps(sign * 20, 2000)
        machine.run(0.05)
        trace = machine.take_trace()
        inside = trace["position_m"][trace["z"] > 0]
        assert (
            len(inside) and 75e-3 - 2e-9 <= inside.min() and inside.max() <= 75e-3 + 0.5e-6 + 2e-9
        )


def test_the_switches_open_at_the_ends():
    for position, low, high in (
        (-2.5e-3, True, False),
        (70e-3, False, False),
        (152.5e-3, False, True),
    ):
        machine = stepper(position=position)
        assert (machine.state.limit_low, machine.state.limit_high) == (low, high)
        assert (machine.level("limit_low_open"), machine.level("limit_high_open")) == (low, high)
    machine = stepper()
    with machine.fault("limit_low"):
        machine.run(1e-5)
        assert machine.state.limit_low
    with machine.fault("encoder_cut"):
        machine.run(1e-5)
        assert (
            machine.level("encoder_a") and machine.level("encoder_b") and machine.level("encoder_z")
        )
    with pytest.raises(KeyError, match="a machine stepper_stage has no fault sensor_cut"):
        machine.inject("sensor_cut")
