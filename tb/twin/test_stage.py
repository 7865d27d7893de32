# SPDX-License-Identifier: Apache-2.0
"""The plant alone, compared with calculations by hand."""

import math

import pytest

from twin.machines.stage import Stage
from twin.parameters import tables as parameters

SMOOTH = dict(
    motor_coulomb=1e-9,
    motor_static=1e-9,
    motor_viscous=0,
    motor_presliding_damping=0,
    table_coulomb=1e-9,
    table_static=1e-9,
    table_viscous=0,
    table_presliding_damping=0,
)
LEAD = 1e-3 / (2 * math.pi)  # m/rad


def test_every_parameter_has_a_unit_and_a_reason():
    for machine in parameters.MACHINES:
        for name, entry in parameters.load(machine).items():
            assert {"value", "unit", "why"} <= set(entry), (machine, name)
            known = {"value", "unit", "why", "typical", "bad", "lowest"}
            assert set(entry) <= known, (machine, name)
            lowest = entry.get("lowest", -math.inf)
            possible = {entry[key] for key in ("value", "typical", "bad") if key in entry}
            assert lowest <= min(possible), (machine, name)
            assert "bad" in entry or "typical" not in entry, (machine, name)
            assert entry["unit"] and len(entry["why"]) >= 2, (machine, name)
    with pytest.raises(KeyError, match="no parameter screw_pitch"):
        Stage(screw_pitch=1)


def steady_speed(stage, voltage):
    """The speed in rad/s at which the torque of the motor equals the friction."""
    p = stage.plant
    torque = p["motor_coulomb"] + LEAD * p["table_coulomb"]
    per_speed = p["motor_viscous"] + LEAD**2 * p["table_viscous"]
    return (p["motor_constant"] * voltage / p["motor_resistance"] - torque) / (
        p["motor_constant"] ** 2 / p["motor_resistance"] + per_speed
    )


@pytest.mark.parametrize("duty", (0.1, 0.5, 1.0, -1.0))
def test_the_motor_reaches_the_speed_of_theory_when_the_bridge_brakes(duty):
    stage = Stage()
    stage.set_position(60e-3)
    stage.bridge(0.3, duty)
    expected = math.copysign(steady_speed(stage, 12 * abs(duty)), duty)
    assert stage.state.motor_rad_s == pytest.approx(expected, rel=1e-3)
    assert stage.state.velocity_m_s == pytest.approx(expected * LEAD, rel=1e-3)


def test_top_speed_has_reserve():
    assert steady_speed(Stage(), 12) * LEAD > 2 * 5e-3


def test_a_bridge_that_coasts_gives_the_charge_of_a_triangle():
    """Below half duty the current ends in every period: its mean is that of a triangle with two
    slopes.
    """
    stage = Stage(motor_resistance=1e-6, **SMOOTH)
    stage.hold(rotor=True)
    period, on, volt, back, henry = 50e-6, 12.5e-6, 12.0, 12.0 + 1.6, 1e-3
    stage.bridge(1e-3, on / period, brakes=False)
    peak = volt * on / henry
    mean = peak * (on + peak * henry / back) / 2 / period
    seen = []
    for _ in range(20):  # four periods of five plant steps
        stage.bridge(10e-6, on / period, brakes=False)
        seen.append(stage.state.current_a)
    assert max(seen) == pytest.approx(volt * 10e-6 / henry, rel=0.3) and min(seen) == 0
    assert mean < 0.25 * peak


def test_the_speed_rises_with_the_mechanical_time_constant():
    stage = Stage(motor_inductance=1e-6, **SMOOTH)
    stage.set_position(20e-3)
    p = stage.plant
    tau = (
        (p["motor_inertia"] + p["table_mass"] * LEAD**2)
        * p["motor_resistance"]
        / p["motor_constant"] ** 2
    )
    stage.bridge(tau, 1.0)
    assert stage.state.motor_rad_s == pytest.approx(
        (1 - math.exp(-1)) * 12 / p["motor_constant"], rel=5e-3
    )


def test_stiction_of_the_motor_holds_below_break_away_and_never_creeps():
    stage = Stage()
    stage.set_position(20e-3)
    p = stage.plant
    torque = [
        p["motor_constant"] * 12 / p["motor_resistance"] * on / stage.PERIOD for on in (2, 3, 5)
    ]
    assert (
        torque[0]
        < 0.7 * p["motor_coulomb"]
        < torque[1]
        < p["motor_static"]
        < torque[2] - LEAD * p["table_static"]
    )
    for on, limit in (
        (2, 1e-12),
        (3, 1e-9),
    ):  # the ripple of the PWM may work on it close to break-away
        stage.bridge(0.2, on / stage.PERIOD)
        there = stage.state.position_m
        stage.bridge(1.0, on / stage.PERIOD)
        assert abs(stage.state.position_m - there) < limit
        assert there - 20e-3 < 1e-6  # the transmission is elastic, nothing slid
    stage.bridge(0.2, 5 / stage.PERIOD)
    assert stage.state.position_m - there > 5e-6


def test_stiction_of_the_table_is_a_spring_that_lets_go_at_break_away():
    stage = Stage(
        screw_stiffness=1.0, screw_damping=0, screw_preload=0
    )  # the screw has almost no stiffness
    stage.set_position(20e-3)
    p, start = stage.plant, stage.state.position_m

    def ramp(begin, end):  # slowly, since a step would overshoot
        for n in range(1, 21):
            stage.push((begin + (end - begin) * n / 20) * p["table_coulomb"])
            stage.bridge(0.02)

    ramp(0, 0.6)  # inside the elastic part
    assert stage.state.position_m - start == pytest.approx(0.6 * p["table_presliding"], rel=1e-4)
    ramp(0.6, 0)
    assert stage.state.position_m == pytest.approx(start, abs=1e-11)
    ramp(0, 0.97)
    there = stage.state.position_m
    stage.bridge(0.5)
    assert stage.state.position_m - there < 2e-9  # the last of the ramp dies away
    there = stage.state.position_m
    stage.bridge(0.5)
    assert abs(stage.state.position_m - there) < 1e-14
    stage.push(1.02 * p["table_static"])
    stage.bridge(0.5)
    assert stage.state.position_m - there > 1e-5


@pytest.mark.parametrize("share", (0.1, 0.5, 1, 2, 10, 1000))
def test_steady_sliding_gives_the_curve_of_stribeck(share):
    coulomb, static, stribeck, viscous = 4.0, 4.8, 1e-4, 40.0
    v = share * stribeck
    expected = coulomb + (static - coulomb) * math.exp(-(share**2)) + viscous * v
    steps = 20000 if share > 1 else 200000
    for sign in (1, -1):
        force = Stage().friction(coulomb, static, stribeck, viscous, 1e-6, 4000.0, sign * v, steps)
        assert force == pytest.approx(sign * expected, rel=1e-3)


def test_friction_is_stable_at_any_speed():
    stage = Stage()
    for v in (1e-9, 1e-3, 1.0, 1e3):
        force = stage.friction(4.0, 4.2, 1e-4, 0.0, 1e-6, 0.0, v)
        assert 0 < force <= 4.2001


def push_both_ways(stage, newton):
    """Distance in m of the table between a push up and a push down; the rotor is held."""
    stage.set_position(20e-3)
    stage.hold(rotor=True)
    ends = []
    for sign in (1, -1):
        stage.push(sign * newton)
        stage.bridge(0.3)
        ends.append(stage.state.position_m)
    return ends[0] - ends[1]


def test_the_backlash_equals_its_parameter():
    calm = {**SMOOTH, "table_viscous": 2000.0}
    for backlash in (0, 0.4e-6, 1e-6):
        stage = Stage(screw_preload=0, screw_backlash=backlash, **calm)
        assert push_both_ways(stage, 1.0) == pytest.approx(
            backlash + 2 * 1.0 / stage.plant["screw_stiffness"], abs=1e-10
        )


def test_the_preload_closes_the_backlash_until_a_greater_force_opens_it():
    calm = {**SMOOTH, "table_viscous": 2000.0}
    stage = Stage(**calm)
    spring, preload = stage.plant["screw_stiffness"], stage.plant["screw_preload"]
    assert push_both_ways(stage, 0.9 * preload) == pytest.approx(
        2 * 0.9 * preload / spring, rel=1e-3
    )
    assert push_both_ways(stage, 1.1 * preload) == pytest.approx(
        1e-6 + 2 * 1.1 * preload / spring, rel=1e-3
    )


def test_friction_of_the_table_is_well_below_the_preload():
    p = parameters.values()
    assert 2 * p["table_static"] + p["table_mass"] * 0.1 < p["screw_preload"]


def test_the_table_rings_on_the_screw_with_its_natural_frequency_and_damping():
    stage = Stage(**SMOOTH)
    stage.set_position(20e-3)
    stage.hold(rotor=True)
    p = stage.plant
    stage.push(10)
    stage.bridge(0.1)
    stage.push(0)
    equilibrium, dt = 20e-3, p["time_step"]
    trace = []
    for _ in range(1000):
        stage.bridge(dt)
        trace.append(stage.state.position_m - equilibrium)
    rises = [
        n + trace[n] / (trace[n] - trace[n + 1])
        for n in range(len(trace) - 1)
        if trace[n] < 0 <= trace[n + 1]
    ]
    assert len(rises) >= 4
    damping = p["screw_damping"] / (2 * math.sqrt(p["screw_stiffness"] * p["table_mass"]))
    frequency = math.sqrt(p["screw_stiffness"] / p["table_mass"] * (1 - damping**2)) / (2 * math.pi)
    assert 1 / ((rises[3] - rises[0]) / 3 * dt) == pytest.approx(frequency, rel=2e-3)
    peaks = [max(trace[int(a) : int(b)]) for a, b in zip(rises, rises[1:])]
    measured = math.log(peaks[0] / peaks[1]) / (2 * math.pi)
    assert measured == pytest.approx(damping / math.sqrt(1 - damping**2), rel=0.05)


def actuations(seed, end, cycles=6):
    """Positions at which a switch presses and releases, driven slowly over its edge."""
    stage = Stage(seed=seed)
    outward = -1 if end == "low" else 1
    stage.set_position(stage.plant[f"switch_{end}"] - outward * 1e-6)
    presses, releases = [], []
    for _ in range(cycles):
        for positions, direction, pressed in (
            (presses, outward, True),
            (releases, -outward, False),
        ):
            for _ in range(3000):
                stage.bridge(10e-6, direction * 0.05)
                if getattr(stage.state, f"limit_{end}") == pressed:
                    break
            positions.append(stage.state.position_m)
    return presses, releases


@pytest.mark.parametrize("end", ("low", "high"))
def test_switches_have_hysteresis_and_scatter_each_time(end):
    p = parameters.values()
    presses, releases = actuations(3, end)
    outward, slack = (-1 if end == "low" else 1), p["switch_scatter"] + 10e-9
    assert all(abs(position - p[f"switch_{end}"]) <= slack for position in releases)
    assert all(
        abs(position - p[f"switch_{end}"] - outward * p["switch_hysteresis"]) <= slack
        for position in presses
    )
    assert max(releases) - min(releases) > 0.1e-6 and max(presses) - min(presses) > 0.1e-6
    assert actuations(3, end) == (presses, releases)
    assert actuations(4, end) != (presses, releases)


def test_the_stop_holds_the_table_at_full_voltage():
    stage = Stage()
    for position, duty, inside in (
        (-1.5e-3, -1.0, lambda x: -4e-3 < x < -2e-3),
        (121.5e-3, 1.0, lambda x: 122e-3 < x < 124e-3),
    ):
        stage.set_position(position)
        stage.bridge(0.5, duty)
        assert inside(stage.state.position_m) and abs(stage.state.velocity_m_s) < 1e-6


def test_a_free_motor_does_not_move():
    stage = Stage()
    start = stage.state.position_m
    stage.bridge(0.5, 0.0, brakes=False)
    assert abs(stage.state.position_m - start) < 1e-13 and stage.state.current_a == 0


def test_start_lies_in_its_range_and_follows_the_seed():
    p = parameters.values()
    starts = [Stage(seed=n).state.position_m for n in range(20)]
    assert (
        all(p["travel_start_lowest"] <= x <= p["travel_start_highest"] for x in starts)
        and len(set(starts)) == 20
    )
    assert starts[7] == Stage(seed=7).state.position_m
