# SPDX-License-Identifier: Apache-2.0
"""The linear motor of S3, driven by frames to its DAC, compared with calculations by hand."""

import math

import numpy
import pytest

from twin import Machine
from twin.parameters import tables as parameters

FREE = dict(guide_coulomb=1e-9, guide_static=1e-9, guide_viscous=0, guide_presliding_damping=0)
AMPERE = 0.3 * 10 / 32768  # an LSB of the DAC


def motor(clk_hz=1_000_000, **values):
    machine = Machine("linear_motor", clk_hz=clk_hz, **values)
    machine.pins(drive_enable=1)
    machine.run(1e-3)
    return machine


def test_a_current_holds_it_where_flexure_and_cable_balance():
    machine = motor(**{**FREE, "guide_viscous": 30.0})
    for counts in (500, -300, 0):
        machine.dac(32768 + counts)
        machine.run(5.0)
        expected = (12 * counts * AMPERE + 40 * 3e-3) / (100 + 40)
        assert machine.state.current_a == pytest.approx(counts * AMPERE, abs=1e-9)
        assert machine.state.position_m == pytest.approx(expected, abs=1e-8)


def test_the_amplifier_follows_with_its_bandwidth_and_ends_when_disabled():
    machine = motor()
    machine.inject("motor_jam")
    for start, code, enable, end in (
        (0.0, 42768, 1, 10000 * AMPERE),
        (10000 * AMPERE, 42768, 0, 0.0),
    ):
        machine.dac(code)
        machine.pins(drive_enable=enable)
        machine.run(1 / (2 * math.pi * 500))
        assert machine.state.current_a == pytest.approx(end + (start - end) / math.e, abs=0.02)
        machine.run(0.01)
        assert machine.state.current_a == pytest.approx(end, abs=1e-9)


def test_the_current_is_limited():
    machine = motor(amplifier_limit=1.5)
    machine.inject("motor_jam")
    for code, current in ((65535, 1.5), (0, -1.5)):
        machine.dac(code)
        machine.run(0.01)
        assert machine.state.current_a == pytest.approx(current)


def test_it_accelerates_as_force_over_mass():
    machine = motor(**FREE, flexure_stiffness=0, cable_stiffness=0, amplifier_bandwidth=1e6)
    start = machine.state
    machine.dac(32768 + 5000)
    machine.run(0.01)
    seconds = machine.state.time_s - start.time_s
    assert machine.state.velocity_m_s == pytest.approx(
        12 * 5000 * AMPERE / 1.2 * (seconds - 30e-6), rel=5e-3
    )


def test_it_swings_on_flexure_and_cable_without_losing_energy():
    machine = motor(**FREE, clk_hz=100_000)
    machine.set_position(1e-3)
    machine.trace(10_000)
    machine.run(6.0)
    trace = machine.take_trace()
    equilibrium = 40 * 3e-3 / 140
    x, v = trace["position_m"] - equilibrium, trace["velocity_m_s"]
    energy = 140 * x**2 / 2 + 1.2 * v**2 / 2
    assert numpy.abs(energy / energy[0] - 1).max() < 1e-3
    rises = trace["time_s"][1:][(x[:-1] < 0) & (x[1:] >= 0)]
    assert (len(rises) - 1) / (rises[-1] - rises[0]) == pytest.approx(
        math.sqrt(140 / 1.2) / (2 * math.pi), rel=1e-3
    )


def test_it_rests_anywhere_within_a_millimetre_and_stays_there():
    positions = []
    for seed in range(20):
        machine = Machine("linear_motor", seed=seed, clk_hz=100_000)
        positions.append(machine.state.position_m)
        machine.run(1.0)
        assert machine.state.position_m == pytest.approx(positions[-1], abs=1e-8)
    assert (
        all(-1e-3 <= position <= 1e-3 for position in positions)
        and len(set(positions)) == 20
        and min(positions) < 0 < max(positions)
    )
    p = parameters.values(machine="linear_motor")
    assert (
        p["flexure_stiffness"] * 1e-3 + p["cable_stiffness"] * 4e-3 < 0.7 * p["guide_coulomb"]
    )  # elastic, so it never creeps


def test_friction_holds_it_below_break_away():
    machine = motor(flexure_stiffness=0, cable_stiffness=0)
    machine.set_position(0.0)
    for share, slides in ((0.6, False), (1.2, True)):
        for n in range(1, 51):
            machine.dac(32768 + round(share * 1.1 / 12 / AMPERE * n / 50))
            machine.run(5e-3)
        assert (machine.state.position_m > 10e-6) == slides


def sweeps(**scale):
    """Traces of a motor that moves over its mark at 1 mm/s, up and down in turn: (sign, trace)."""
    machine = motor(
        **{**FREE, "guide_viscous": 300.0},
        **scale,
        flexure_stiffness=0,
        cable_stiffness=0,
        clk_hz=1_000_000,
    )
    for sign in (1, -1) * 4:
        machine.set_position(-sign * 5e-6)
        machine.dac(32768 + sign * round(300 * 1e-3 / 12 / AMPERE))
        machine.trace(100_000)
        machine.run(0.015)
        yield sign, machine.take_trace()


def test_the_mark_is_a_count_wide_and_its_edges_scatter_as_stated():
    lows, highs = [], []
    for _, trace in sweeps():
        inside = trace["position_m"][trace["z"] > 0]
        lows.append(inside.min())
        highs.append(inside.max())
    slack = 0.05e-6 + 0.011e-6  # scatter plus a step of the trace
    assert all(abs(low - 0.25e-6) <= slack for low in lows) and all(
        abs(high - 1.25e-6) <= slack for high in highs
    )
    assert max(lows) - min(lows) > 0.02e-6 and max(highs) - min(highs) > 0.02e-6
    widths = numpy.subtract(highs, lows)
    assert widths.max() - widths.min() > 0.02e-6  # each edge scatters on its own


@pytest.mark.parametrize("scatter", [0, 0.04])
def test_edges_are_where_errors_of_duty_and_phase_and_their_hysteresis_put_them(scatter):
    """9 degrees of the period are a tenth of a count; an edge is lower on the way down."""
    shifts = {"a": {1: -0.1, 3: 0.1}, "b": {2: 0.2 - 0.1, 0: 0.2 + 0.1}}  # of counts 0 to 3
    met = {}
    for sign, trace in sweeps(
        scale_duty_error=18,
        scale_phase_error=18,
        scale_edge_scatter=scatter,
        scale_hysteresis=0.15,
        scale_index_hysteresis=0.3e-6,
        scale_index_scatter=scatter * 1e-6,
    ):
        at = trace["position_m"] * 1e6  # counts
        for name, edges in shifts.items():
            changed = at[1:][numpy.diff(trace[name]) != 0]
            places = [4 * period + n + edges[n] for period in (-1, 0, 1) for n in edges]
            places = numpy.sort([place - 0.15 * (sign < 0) for place in places])
            for place in places[(places > -4) & (places < 4)]:
                nearest = changed[abs(changed - place).argmin()]
                met.setdefault((name, sign, round(place, 3)), []).append(nearest - place)
        inside = at[trace["z"] > 0]
        for end, place in ((inside.min(), 0.25), (inside.max(), 1.25)):
            met.setdefault(("z", sign, place), []).append(end - place + 0.3 * (sign < 0))
    for where, errors in met.items():
        assert len(errors) == 4 and max(map(abs, errors)) <= scatter + 0.022, (where, errors)
        assert not scatter or numpy.ptp(errors) > 0.005


def test_the_scale_counts_every_micrometre_both_ways():
    machine = motor(**{**FREE, "guide_viscous": 30.0}, flexure_stiffness=0, cable_stiffness=0)
    machine.set_position(0.5e-6)
    start, total = machine.state.scale_counts, 0
    for sign in (1, -1):
        machine.dac(32768 + sign * round(30 * 50e-3 / 12 / AMPERE))  # 50 mm/s
        levels = machine.watch(0.06)
        a, b = levels["encoder_a"].astype(int), levels["encoder_b"].astype(int)
        steps = (numpy.diff(b << 1 | (a ^ b)) + 1) % 4 - 1
        assert abs(steps).max() == 1
        total += steps.sum()
    assert (
        abs(total - (machine.state.scale_counts - start)) <= 2
    )  # an edge may be between two calls of watch
    machine.set_position(-3e-3)
    machine.run(1e-4)
    assert machine.state.scale_counts in (-3001, -3000)


def test_stops_and_switches():
    machine = motor()
    for code, end in ((65535, 8e-3), (0, -8e-3)):
        machine.dac(code)
        machine.run(0.5)
        assert abs(machine.state.position_m - end) < 0.5e-3 and abs(machine.state.position_m) > 8e-3
        assert (machine.state.limit_low, machine.state.limit_high) == (end < 0, end > 0)
    machine.dac(32768)
    machine.set_position(0.0)
    machine.run(1e-3)
    assert not machine.state.limit_low and not machine.state.limit_high
    assert machine.level("sensor_rx") and not machine.level(
        "drive_fault"
    )  # no sensor: its line idles
    with machine.fault("drive_fault"):
        assert machine.level("drive_fault")
    for level in (False, True):
        with machine.fault("z_stuck", level):
            assert machine.level("encoder_z") == level


def test_the_seed_gives_the_run_again():
    def run(seed):
        machine = Machine("linear_motor", seed=seed, clk_hz=1_000_000)
        machine.pins(drive_enable=1)
        machine.dac(40000)
        machine.run(0.05)
        return machine.state

    assert run(3) == run(3) and run(3) != run(4)
