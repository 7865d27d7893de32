# SPDX-License-Identifier: Apache-2.0
"""What is worse in the world than in the ideal stage: each effect compared with a calculation by
hand.
"""

import math

import numpy
import pytest

from tb.twin.test_interferometer import IDEAL, PERIOD, count, reading
from tb.twin.test_stage import SMOOTH
from twin.machines.stage import Stage
from twin.parameters import tables

WHERE = (0.0, -1e-3, 5e-3, 40e-3, 119e-3)
LATE = 1e9  # s: everything has drifted


def ellipse(stage, position=0.0, seconds=0.0):
    """(amplitude, offsets of sine and cosine, gain of the cosine, phase error in degrees)"""
    points = numpy.array(
        [stage.analogue(position + n / 64 * PERIOD, 0.0, seconds) for n in range(64)]
    )
    sine, cosine = numpy.fft.fft(points, axis=0)[1] / 32
    amplitude = abs(sine)
    offsets = points.mean(axis=0) / amplitude
    phase = math.degrees(numpy.angle(cosine / sine)) - 90
    return amplitude, *offsets, abs(cosine) / amplitude, phase


def test_a_world_names_all_its_effects_and_a_wrong_one_is_refused():
    typical, bad = tables.world("typical"), tables.world("bad")
    assert set(typical) == set(bad) and len(bad) > 30
    assert all(
        abs(typical[name]) <= abs(bad[name])
        for name in bad
        if "piezo_mode" not in name and name not in ("signal_bandwidth", "screw_preload")
    )
    with pytest.raises(ValueError, match="no world good; there are typical, bad"):
        tables.world("good")


def test_mounting_angle_tilt_and_straightness_shift_what_the_scale_shows():
    angle = Stage(**IDEAL, scale_angle=1e-3)
    abbe = Stage(**IDEAL, scale_abbe_arm=20e-3, guide_tilt=5e-6, guide_length=60e-3)
    aside = Stage(**IDEAL, scale_rotation=2e-3, guide_straightness=3e-6, guide_length=60e-3)
    for x in WHERE:
        turns = 2 * math.pi * x / 60e-3
        assert reading(angle, x) == pytest.approx(-5e-7 * x, abs=1e-12)
        assert reading(abbe, x) == pytest.approx(1e-7 * math.sin(turns), abs=1e-12)
        assert reading(aside, x) == pytest.approx(6e-9 * (math.cos(turns) - 1), abs=1e-12)


def test_the_scale_grows_with_the_temperature_from_its_anchor():
    stage = Stage(**IDEAL, temperature_change=0.5, scale_expansion=2e-6, scale_anchor=10e-3)
    for seconds, share in ((0.0, 0.0), (1800.0, 1 - math.exp(-1)), (LATE, 1.0)):
        for x in WHERE:
            sine, cosine = stage.analogue(x, 0.0, seconds)
            error = math.atan2(sine, cosine) / (2 * math.pi) * PERIOD - x
            error -= PERIOD * round(error / PERIOD)
            assert error == pytest.approx(1e-6 * share * (x - 10e-3), abs=1e-12)


def test_signals_drift_with_time_and_change_along_the_travel():
    plain = dict(IDEAL, signal_amplitude=0.8)
    for name, changes in (
        ("drift", dict(offset=0.02, gain=-0.03, phase=1.5, amplitude=-0.05)),
        ("travel", dict(offset=-0.01, gain=0.02, phase=-0.5, amplitude=0.1)),
    ):
        stage = Stage(**plain, **{f"{name}_{key}": value for key, value in changes.items()})
        for share in (0.0, 0.5, 1.0):
            where = (0.0, 600 * share) if name == "drift" else (0.12 * share, 0.0)
            found = ellipse(stage, *where)
            amplitude = 0.8 * (1 + share * changes["amplitude"])
            offset = share * changes["offset"]
            assert found == pytest.approx(
                (amplitude, offset, offset, 1 + share * changes["gain"], share * changes["phase"]),
                abs=2e-5,  # the signals change within the period that is looked at
            )
    drifted = Stage(**plain, drift_offset=0.02)
    assert ellipse(drifted, 0.0, 600.0) == pytest.approx(ellipse(drifted, 0.0, LATE))


def test_receivers_of_limited_bandwidth_lag_and_weaken():
    stage = Stage(**IDEAL, signal_bandwidth=10e3)
    for speed in (8e-3, -8e-3, 0.8e-3):  # 10 kHz, and a tenth of it
        sine, cosine = stage.analogue(0.0, speed)
        share = speed / PERIOD / 10e3
        assert math.atan2(sine, cosine) == pytest.approx(-math.atan(share), abs=1e-9)
        assert math.hypot(sine, cosine) == pytest.approx(0.85 / math.hypot(1, share))


def test_the_cosine_is_sampled_later_by_the_skew():
    stage = Stage(**IDEAL, signal_skew=1e-6, signal_bits=12)
    later = Stage(**IDEAL, signal_bits=12)
    for n in range(16):
        x = n / 16 * PERIOD
        assert stage.convert(x, 5e-3) == (
            later.convert(x)[0],
            later.convert(x + 5e-9)[1],
        )


def test_the_nonlinearity_is_an_s_with_its_largest_value_as_stated():
    plain = Stage(**IDEAL, signal_bits=12, signal_amplitude=1.0)
    bent = Stage(**IDEAL, signal_bits=12, signal_amplitude=1.0, signal_inl=20.0)
    for n in range(64):
        x = n / 64 * PERIOD
        value = math.sin(2 * math.pi * n / 64)
        added = bent.convert(x)[0] - plain.convert(x)[0]
        assert added == pytest.approx(20 * 1.5 * math.sqrt(3) * (value - value**3), abs=1.01)


def test_an_edge_of_the_bridge_is_in_the_words_after_it():
    plain = dict(IDEAL, signal_bits=12)
    stage = Stage(**plain, signal_coupling=40.0, signal_coupling_time=2e-6)
    quiet = Stage(**plain).convert(stage.state.position_m)
    stage.hold(rotor=True, table=True)
    for wait in (2, 8, 16):  # cycles of 0.25 us
        for bridge_a, sign in ((1, 1), (0, -1)):
            stage.pins(bridge_a=bridge_a, drive_enable=1)
            stage.run(wait / 4e6)
            stage.pins(adc_cs_n=0)
            stage.run(1 / 4e6)
            added = stage.state.code_sin - quiet[0], stage.state.code_cos - quiet[1]
            stage.pins(adc_cs_n=1)
            stage.run(1e-3)
            expected = sign * 40 * math.exp(-wait / 8)
            assert added == pytest.approx((expected, expected), abs=1.01)


def test_noisy_comparators_chatter_at_their_edges_only():
    """Within a small multiple of the noise around the hysteresis; elsewhere never."""
    stage = Stage(**IDEAL, comparator_noise=0.02)
    a, b = stage.levels(5e-3, PERIOD / 8, 0.0)
    assert count(a[1:], b[1:])[0] == 0 and len(set(a[1:])) == len(set(b[1:])) == 1
    noisy = Stage(**IDEAL, comparator_noise=0.1)
    a, b = noisy.levels(5e-3, 0.0, 0.0)  # B is at its edge
    assert numpy.abs(numpy.diff(b[1:].astype(int))).sum() > 100 and len(set(a[1:])) == 1


def test_the_floor_shakes_the_table_as_its_spectrum_says():
    """Far below its resonance on the screw the table lags by acceleration / (2 pi f)^2."""
    velocity = 12.5e-6
    stage = Stage(**SMOOTH, screw_damping=200.0, floor_velocity=velocity)
    stage.set_position(60e-3)
    stage.hold(rotor=True)
    stage.trace(1_000)
    stage.run(4.0)
    moved = stage.take_trace()["position_m"][1000:]
    stiffness, mass = stage.plant["screw_stiffness"], stage.plant["table_mass"]
    bands = 4.0 * 2.0 ** (numpy.arange(14) / 3)
    expected = velocity * 2 * math.pi * bands * mass / stiffness
    assert moved.std() == pytest.approx(math.sqrt((expected**2).sum()), rel=0.1)
    still = Stage(**SMOOTH)
    still.set_position(60e-3)
    still.hold(rotor=True)
    still.run(0.5)
    assert abs(still.state.position_m - 60e-3) < 1e-9


def test_the_floor_goes_on_when_a_parameter_changes():
    """A changed parameter takes over nothing but itself: the tones keep their phases."""
    moved = []
    for changes in (False, True):
        stage = Stage(**SMOOTH, screw_damping=200.0, floor_velocity=12.5e-6)
        stage.set_position(60e-3)
        stage.hold(rotor=True)
        stage.run(0.3)
        if changes:
            stage.set(signal_noise=0.25)
        stage.run(0.3)
        moved.append(stage.state.position_m)
    assert moved[0] == moved[1]


def test_cogging_and_ripple_are_torques_of_the_angle():
    """A motor without friction rests where its cogging pulls it."""
    stage = Stage(**SMOOTH, motor_cogging=2e-3, screw_preload=0.0)
    stage.set_position(60e-3)
    start = stage.state.motor_rad_s
    stage.run(2e-3)
    angle = 60e-3 / (1e-3 / (2 * math.pi))
    push = 2e-3 * math.sin(14 * angle)
    assert start == 0 and math.copysign(1, stage.state.motor_rad_s) == math.copysign(1, push)


def test_the_screw_carries_the_table_off_its_line_once_a_revolution():
    stage = Stage(screw_error=2e-6)
    plain = Stage()
    for one in (stage, plain):
        one.set_position(60e-3)
        one.bridge(0.2, 0.3)
    angles = [one.state.nut_m for one in (stage, plain)]
    assert angles[0] != angles[1] and abs(angles[0] - angles[1]) < 4e-6


def test_the_amplifier_of_the_piezo_is_noisy():
    """White noise through the mode: variance density * pi / 2 * natural frequency / (2 damping)."""
    density = 5e-12
    stage = Stage(piezo_fitted=1, piezo_creep=0, piezo_mode_damping=0.2, piezo_noise=density)
    stage.hold(rotor=True, table=True)
    stage.run(0.05)
    stage.trace(100_000)
    stage.run(2.0)
    found = stage.take_trace()["piezo_m"].std()
    assert found == pytest.approx(density * math.sqrt(math.pi / 2 * 500 / (2 * 0.2)), rel=0.1)


def test_the_supply_hums():
    stage = Stage(supply_ripple=1.0)
    stage.set_position(60e-3)
    stage.hold(rotor=True)
    stage.trace(10_000)
    stage.bridge(0.1, 1.0)
    trace = stage.take_trace()
    voltage = trace["voltage_v"][200:]
    time = trace["time_s"][200:]
    assert voltage.min() == pytest.approx(11, abs=0.02) and voltage.max() == pytest.approx(
        13, abs=0.02
    )
    crossings = time[1:][numpy.diff(numpy.sign(voltage - 12)) > 0]
    assert numpy.diff(crossings).mean() == pytest.approx(0.01, rel=0.02)
