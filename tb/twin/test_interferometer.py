# SPDX-License-Identifier: Apache-2.0
"""The interferometer and its converters: phase, codes, frames, levels, spikes, faults."""

import math

import numpy
import pytest

from figures import calibration as figures_calibration
from twin.machines.stage import Stage

PERIOD = 0.8e-6
IDEAL = dict(
    signal_offset_sin=0,
    signal_offset_cos=0,
    signal_gain_cos=1,
    signal_phase_error=0,
    signal_noise=0,
    comparator_spike_rate=0,
)


@pytest.mark.parametrize("base", (0.0, -0.9e-3, 60e-3, 119.6e-3))
def test_phase_is_right_to_a_picometre_over_the_whole_travel(base):
    stage = Stage(**IDEAL)
    start = round(base / PERIOD) * PERIOD
    for n in range(64):
        sine, cosine = stage.analogue(start + n / 64 * PERIOD)
        measured = math.atan2(sine, cosine) / (2 * math.pi) * PERIOD
        assert abs((measured - n / 64 * PERIOD + PERIOD / 2) % PERIOD - PERIOD / 2) < 1e-12
        assert math.hypot(sine, cosine) == pytest.approx(0.85)


def reading(stage, position):
    """The error of the scale at a position, modulo a period."""
    sine, cosine = stage.analogue(position)
    error = math.atan2(sine, cosine) / (2 * math.pi) * PERIOD - position
    return error - PERIOD * round(error / PERIOD)


def test_the_error_of_the_scale_is_as_stated():
    linear = Stage(**IDEAL, scale_linear=2e-6)
    cyclic = Stage(**IDEAL, scale_cyclic=150e-9, scale_pitch=8e-3)
    for position in (0, -1e-3, 5e-3, 40e-3, 119e-3):
        assert reading(linear, position) == pytest.approx(2e-6 * position, abs=1e-12)
        assert reading(cyclic, position) == pytest.approx(
            150e-9 * math.sin(2 * math.pi * position / 8e-3), abs=1e-12
        )


def test_the_random_walk_of_a_scale_is_that_of_its_seed_and_begins_at_zero():
    first, again, other = (Stage(seed=seed, **IDEAL, scale_walk=5e-9) for seed in (1, 1, 2))
    positions = [n * 1e-3 for n in range(121)]
    walk = numpy.array([reading(first, position) for position in positions])
    assert walk[0] == pytest.approx(0, abs=1e-12) and 3e-9 < numpy.std(numpy.diff(walk)) < 7e-9
    assert (
        walk.tolist()
        == [reading(again, position) for position in positions]
        != [reading(other, position) for position in positions]
    )
    assert reading(first, 20.5e-3) == pytest.approx((walk[20] + walk[21]) / 2, abs=1e-12)


def test_the_phase_zero_lies_at_the_offset():
    stage = Stage(**IDEAL, grating_offset=0.3e-6)
    sine, cosine = stage.analogue(0.3e-6)
    assert abs(sine) < 1e-9 and cosine == pytest.approx(0.85)


def test_offset_gain_and_phase_error_are_as_stated():
    stage = Stage(
        signal_offset_sin=0.03,
        signal_offset_cos=-0.02,
        signal_gain_cos=1.03,
        signal_phase_error=2.0,
    )
    points = numpy.array([stage.analogue(n / 360 * PERIOD) for n in range(360)]) / 0.85
    assert points.mean(axis=0) == pytest.approx([0.03, -0.02], abs=1e-9)
    spectrum = numpy.fft.fft(points, axis=0)[1] / 180
    assert abs(spectrum[1] / spectrum[0]) == pytest.approx(1.03)
    assert math.degrees(numpy.angle(spectrum[1] / spectrum[0])) == pytest.approx(90 + 2)


def vector(stage, count=64):
    """cos + i sin with an amplitude of 1, at equally spaced points of a period."""
    points = numpy.array([stage.analogue(n / count * PERIOD) for n in range(count)]) / 0.85
    return points[:, 1] + 1j * points[:, 0]


@pytest.mark.parametrize("harmonic", [*range(-8, -1), *range(2, 9)])
def test_a_harmonic_of_the_vector_is_that_one_and_no_other(harmonic):
    stage = Stage(
        **IDEAL, **{f"harmonic_{'plus' if harmonic > 0 else 'minus'}_{abs(harmonic)}": 0.01}
    )
    expected = numpy.zeros(64)
    expected[1], expected[harmonic] = 1, 0.01
    assert numpy.abs(numpy.fft.fft(vector(stage)) / 64 - expected).max() < 1e-9


def test_harmonics_come_before_gain_phase_and_offset_as_the_figures_take_them():
    cos, sin = figures_calibration.curve_of_twin()(2 * numpy.pi * numpy.arange(64) / 64)
    assert (
        numpy.abs(vector(Stage(**figures_calibration.HARMONICS_OF_TWIN)) - (cos + 1j * sin)).max()
        < 1e-9
    )


def test_codes_by_hand():
    stage = Stage(**IDEAL)
    assert stage.convert(0.0) == (128, 237)  # 128 + 0.85 * 128 = 236.8
    assert stage.convert(PERIOD / 4) == (237, 128)
    assert stage.convert(PERIOD / 2) == (128, 19)  # 128 - 108.8 = 19.2
    assert stage.convert(3 * PERIOD / 4) == (19, 128)
    assert Stage(**IDEAL, signal_bits=12).convert(PERIOD / 4) == (3789, 2048)
    assert Stage(**{**IDEAL, "signal_offset_sin": 1.0}).convert(PERIOD / 4)[0] == 255
    assert Stage(**{**IDEAL, "signal_offset_sin": -1.0}).convert(-PERIOD / 4)[0] == 0


def test_noise_is_half_a_count_before_the_conversion():
    stage = Stage(**{**IDEAL, "signal_noise": 0.5, "signal_offset_sin": 0.3 / 0.85 / 128})
    codes = numpy.array([stage.convert(0.0) for _ in range(20000)], dtype=float)
    assert codes[:, 0].mean() == pytest.approx(128.3, abs=0.02)
    assert codes.std(axis=0) == pytest.approx(math.sqrt(0.25 + 1 / 12), rel=0.03)
    assert abs(numpy.corrcoef(codes.T)[0, 1]) < 0.03


def test_sample_spikes_come_at_the_given_rate():
    stage = Stage(**{**IDEAL, "signal_spike_share": 0.05})
    codes = numpy.array([stage.convert(0.0)[0] for _ in range(20000)])
    assert (
        numpy.mean(codes != 128) == pytest.approx(0.05, abs=0.01) and abs(codes - 128.0).max() <= 64
    )


@pytest.mark.parametrize("bits", (8, 12))
def test_a_frame_is_two_zeros_the_word_and_zeros(bits):
    stage = Stage(**IDEAL, signal_bits=bits)
    for n in range(16):
        sine, cosine = stage.convert(n * PERIOD / 16)
        expected = [
            format(word, f"0{bits}b").rjust(bits + 2, "0").ljust(16, "0") for word in (sine, cosine)
        ]
        frame = stage.frame(n * PERIOD / 16, 16)
        assert ["".join(str(bits[k]) for bits in frame) for k in (0, 1)] == expected


def test_both_channels_are_sampled_at_the_same_position():
    stage = Stage(**IDEAL)
    frame = stage.frame(0.1e-6, 10)
    words = [int("".join(str(bits[k]) for bits in frame), 2) for k in (0, 1)]
    assert tuple(words) == stage.convert(0.1e-6)


def count(a, b):
    """The x4 count of two levels, up when A leads B, and the largest number of channels that
    changed at once.
    """
    position = (
        b.astype(int) << 1 | (a ^ b)
    ) & 3  # quarter of the period: 00 10 11 01 of a, b are 0 1 2 3
    steps = numpy.diff(position)
    steps = (steps + 1) % 4 - 1
    return steps.sum(), numpy.abs(steps).max()


@pytest.mark.parametrize("speed", (5e-3, -5e-3, 0.1e-3))
def test_levels_give_four_edges_a_period_and_a_leads_on_the_way_up(speed):
    stage = Stage(**IDEAL)
    seconds = 100 * PERIOD / abs(speed)
    a, b = stage.levels(seconds, PERIOD / 8, speed)
    total, largest = count(a[1:], b[1:])
    assert total == pytest.approx(math.copysign(400, speed), abs=1) and largest == 1
    rises = numpy.flatnonzero((a[1:-1] == 0) & (a[2:] == 1)) + 2
    assert set(b[rises]) == {0 if speed > 0 else 1}  # S0: CKb = 0 at a rising edge of CKa means +X


def test_comparators_have_hysteresis():
    stage = Stage(**IDEAL)
    a_up = numpy.flatnonzero(
        numpy.diff(stage.levels(1e-3, 0.5 * PERIOD, PERIOD / 1e-3)[0].astype(int)) == 1
    )
    a_down = numpy.flatnonzero(
        numpy.diff(stage.levels(1e-3, 1.0 * PERIOD, -PERIOD / 1e-3)[0].astype(int)) == -1
    )
    up, down = 0.5 + a_up[0] / 4000, 1.0 - a_down[0] / 4000
    assert up - down == pytest.approx(2 * math.asin(0.05) / (2 * math.pi), abs=1e-3)


def test_spikes_are_short_and_as_frequent_as_stated():
    stage = Stage(**{**IDEAL, "comparator_spike_rate": 500})
    for level in stage.levels(1.0, PERIOD / 8, 0.0):  # at rest between two edges
        edges = numpy.flatnonzero(numpy.diff(level.astype(int)))
        widths = edges[1::2] - edges[::2]
        assert 400 < len(widths) < 600
        assert 1 <= widths.min() and widths.max() <= 18  # 4.5 us at 4 MHz
        gaps = numpy.diff(edges[::2]) / 4e6
        assert gaps.std() == pytest.approx(gaps.mean(), rel=0.2)  # at random times


def test_faults_show_at_the_pins():
    stage = Stage(**IDEAL)
    normal = stage.convert(0.1e-6)
    stage.inject("encoder_cut")
    assert stage.convert(0.1e-6) == (128, 128)
    assert all(
        set(levels) == {1} for levels in stage.levels(1e-3, 0.0, 5e-3)
    )  # receivers fail safe high
    stage.clear("encoder_cut")
    with stage.fault("converter_stuck"):
        assert stage.convert(0.3e-6) == (128, 128)
    assert stage.convert(0.1e-6) == normal
    for name, which in (("a_stuck", 0), ("b_stuck", 1)):
        for level in (0, 1):
            with stage.fault(name, level):
                levels = stage.levels(1e-3, 0.0, 5e-3)
            assert set(levels[which]) == {level} and set(levels[1 - which]) == {0, 1}


def test_the_seed_gives_noise_and_spikes_again():
    def record(seed):
        stage = Stage(seed=seed, comparator_spike_rate=5000)
        levels = stage.levels(0.01, 0.0, 5e-3)
        return [stage.convert(n * 1e-9) for n in range(100)], levels[0].tolist(), levels[1].tolist()

    assert record(1) == record(1)
    assert record(1) != record(2)
