# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.metrology: signals whose density, Allan deviation, harmonics and settling time are
known, a test by ISO 230-2 that is computed by hand, and circles of a known shape.
"""

import io
import math

import numpy
import pytest
from PIL import Image

from moire.analysis import metrology, metrology_pictures
from moire.analysis.metrology import Circle, NotMeasured, Positioning
from tb.bench import seed

RATE_HZ = 4000.0


def white(sigma, count, number=0):
    return numpy.random.default_rng(seed() + number).normal(0, sigma, count)


# ------------------------------------------------------------------ standstill


def test_white_noise_has_a_flat_density_of_sigma_times_the_root_of_two_over_the_rate():
    """2 nm rms up to 2 kHz are 2 / sqrt(2000) nm/sqrt(Hz)."""
    found = metrology.density(white(2.0, 1 << 17), RATE_HZ, segments=256)
    level = 2 / math.sqrt(RATE_HZ / 2)
    inside = found.amplitude[2:-2]
    assert inside.mean() == pytest.approx(level, rel=0.01)
    assert abs(inside / level - 1).max() < 0.2
    assert found.frequency_hz[-1] == RATE_HZ / 2


def test_the_cumulative_rms_ends_at_the_rms_of_the_values():
    values = 7.0 + white(2.0, 1 << 16)
    assert metrology.density(values, RATE_HZ).cumulative_rms[-1] == pytest.approx(
        values.std(), rel=0.02
    )


@pytest.mark.parametrize("count", [1024, 1025])
def test_the_density_of_one_segment_obeys_parsevals_theorem(count):
    """The integral of the density is the mean square of the windowed values, less the bin at 0."""
    values = white(3.0, count)
    found = metrology.density(values, RATE_HZ, segments=1)
    window = 0.5 - 0.5 * numpy.cos(2 * numpy.pi * numpy.arange(count) / count)
    windowed = window * (values - values.mean())
    expected = (windowed**2).sum() - windowed.sum() ** 2 / count
    assert found.cumulative_rms[-1] ** 2 == pytest.approx(expected / (window**2).sum(), rel=1e-9)


def test_a_sine_raises_the_cumulative_rms_by_its_own_at_its_frequency():
    time_s = numpy.arange(1 << 15) / RATE_HZ
    found = metrology.density(5 * numpy.sin(2 * math.pi * 150 * time_s), RATE_HZ)
    at = numpy.searchsorted(found.frequency_hz, [140, 160])
    below, above = found.cumulative_rms[at]
    assert below < 0.05 and above == pytest.approx(5 / math.sqrt(2), rel=0.01)
    assert found.frequency_hz[found.power.argmax()] == pytest.approx(150, abs=1)


def test_the_allan_deviation_of_white_noise_falls_with_the_root_of_the_time():
    tau_s, deviation = metrology.allan_deviation(white(2.0, 1 << 17), RATE_HZ)
    assert tau_s[0] == 1 / RATE_HZ and deviation[0] == pytest.approx(2, rel=0.02)
    slope = numpy.polyfit(numpy.log(tau_s[:9]), numpy.log(deviation[:9]), 1)[0]
    assert slope == pytest.approx(-0.5, abs=0.03)


def test_the_allan_deviation_of_a_drift_rises_with_the_time():
    """Adjacent means of a drift d differ by d tau."""
    tau_s, deviation = metrology.allan_deviation(3 * numpy.arange(4096) / RATE_HZ, RATE_HZ)
    assert deviation == pytest.approx(3 * tau_s / math.sqrt(2))


def test_the_allan_deviation_of_a_short_series_by_hand():
    """0, 2, 0, 2 …: neighbours differ by 2, and means of two are equal."""
    tau_s, deviation = metrology.allan_deviation([0.0, 2.0] * 12, 1.0)
    assert tau_s.tolist() == [1, 2, 4, 8]
    assert deviation == pytest.approx([2 / math.sqrt(2), 0, 0, 0])


# ------------------------------------------------------------------ ISO 230-2

# Position minus target in um, five runs. The sums are chosen so that every step is short by hand:
# target 1 up: mean 1, squares 4+1+0+1+4 = 10, s = sqrt(10 / 4); down: mean 3, s = 0
# target 2 up: mean -2, s = 0; down: mean -1, squares 1+1+0+1+1 = 4, s = 1
DEVIATIONS_UP = [[-1, 0, 1, 2, 3], [-2, -2, -2, -2, -2]]
DEVIATIONS_DOWN = [[3, 3, 3, 3, 3], [-2, 0, -1, 0, -2]]


def by_hand():
    return Positioning(
        numpy.array([10.0, 20.0]), -numpy.array(DEVIATIONS_UP), -numpy.array(DEVIATIONS_DOWN)
    )


def test_a_test_by_iso_230_2_matches_the_calculation_by_hand():
    test, s = by_hand(), math.sqrt(2.5)
    assert test.scatter_up == pytest.approx([s, 0]) and test.scatter_down == pytest.approx([0, 1])
    assert test.reversals.tolist() == [1 - 3, -2 + 1] and test.reversal == 2
    # R_1 = max(2 s + 0 + 2, 4 s, 0) = 6.32; R_2 = max(0 + 2 + 1, 0, 4) = 4
    assert test.repeatability == pytest.approx(4 * s)
    # the largest mean is 3, the smallest -2; the means of both directions are 2 and -1.5
    assert test.systematic == 5 and test.mean_deviation == 3.5
    # highest: 1 + 2 s = 4.16; lowest: -1 - 2 = -3
    assert test.accuracy == pytest.approx(1 + 2 * s + 3)


def test_a_large_reversal_is_part_of_the_repeatability():
    test = Positioning(
        numpy.array([0.0, 1.0]),
        numpy.array([[0.0, 1.0], [0.0, 1.0]]),
        numpy.array([[50.0, 51.0], [0.0, 1.0]]),
    )
    s = math.sqrt(0.5)
    assert test.repeatability == pytest.approx(50 + 4 * s)
    assert test.reversals.tolist() == [50, 0]  # from below the axis stops 50 further up


@pytest.mark.parametrize(
    "up, down",
    [
        ([[0.0, 1.0]], [[0.0, 1.0]]),
        ([[0.0], [1.0]], [[0.0], [1.0]]),
        ([[0.0, 1.0], [0.0, 1.0]], [[0.0, 1.0], [0.0, 1.0], [0.0, 1.0]]),
        ([0.0, 1.0], [0.0, 1.0]),
    ],
)
def test_a_test_by_iso_230_2_with_too_little_is_refused(up, down):
    with pytest.raises(NotMeasured, match="at least 2 targets and 2 runs"):
        Positioning(numpy.arange(len(up)), numpy.array(up), numpy.array(down))


# ------------------------------------------------------------------ ISO 230-4


def turn(shape, centre=(0.0, 0.0), count=7200):
    """Points of a path whose radius is a function of its angle."""
    angle = 2 * math.pi * (numpy.arange(count) + 0.5) / count
    unit = numpy.stack([numpy.cos(angle), numpy.sin(angle)], axis=-1)
    return unit * shape(angle)[:, None] + numpy.asarray(centre)


def oval(angle):
    return 5.0 + 0.003 * numpy.cos(2 * angle)


def test_an_oval_has_its_range_as_circular_deviation_and_no_hysteresis():
    test = Circle(5.0, turn(oval), turn(oval))
    assert test.deviation == pytest.approx(0.006, rel=1e-4)
    assert test.deviations == pytest.approx((0.006, 0.006), rel=1e-4)
    assert test.radial_deviation == pytest.approx(0.003, rel=1e-4)
    assert test.hysteresis == 0 and abs(test.centre).max() < 1e-9
    assert test.rms == pytest.approx(0.003 / math.sqrt(2), rel=1e-4)


def test_a_shifted_circle_is_round_but_deviates_from_the_programmed_one():
    shifted = turn(lambda angle: numpy.full(len(angle), 5.001), (0.02, -0.01))
    test = Circle(5.0, shifted, shifted)
    assert test.centre == pytest.approx([0.02, -0.01], abs=1e-9)
    assert test.deviation < 1e-9
    assert test.radial_deviation == pytest.approx(0.001 + math.hypot(0.02, 0.01), rel=1e-3)


def test_two_directions_that_differ_have_a_hysteresis():
    """A backlash of 4 um on X: each direction lies to another side of the centre of both."""
    one, other = (turn(lambda angle: numpy.full(len(angle), 5.0), (x, 0)) for x in (2e-3, -2e-3))
    test = Circle(5.0, one, other)
    assert abs(test.centre).max() < 1e-9
    assert test.hysteresis == pytest.approx(4e-3, rel=1e-3)
    assert test.deviation == pytest.approx(4e-3, rel=1e-3)


def test_a_circle_with_a_gap_is_refused():
    whole = turn(oval)
    with pytest.raises(NotMeasured, match="no point in one of 360 sectors"):
        Circle(5.0, whole, whole[100:])


# ------------------------------------------------------------------ motion and signals


@pytest.mark.parametrize(
    "error, expected",
    [
        ([0.0, 1.0, -2.0, 2.0], 0.0),
        ([9.0, 1.0, -5.0, 2.0], 0.3),
        ([9.0, -9.0, 1.0, -1.0], 0.2),
        ([0.0, 0.0, 0.0, 2.1], None),
    ],
)
def test_an_axis_has_settled_when_its_error_stays_inside_the_window(error, expected):
    found = metrology.settling_time([1.0, 1.1, 1.2, 1.3], error, 2.0)
    assert found == (None if expected is None else pytest.approx(expected))


def test_harmonics_are_found_whatever_their_phase_and_the_constant():
    turns = numpy.arange(16) / 16 + 3
    error = 40 + 3 * numpy.cos(2 * math.pi * turns + 1) - 0.5 * numpy.sin(8 * math.pi * turns + 2)
    assert metrology.harmonics(turns, error, 5) == pytest.approx([3, 0, 0, 0.5, 0], abs=1e-12)


def test_what_cannot_be_computed_is_refused():
    with pytest.raises(NotMeasured, match="50 values are too few .* 8 segments: 72 at least"):
        metrology.density(numpy.zeros(50), RATE_HZ)
    assert len(metrology.density(numpy.zeros(72), RATE_HZ).power) == 8
    with pytest.raises(NotMeasured, match="Allan deviation: 16 at least"):
        metrology.allan_deviation(numpy.zeros(15), RATE_HZ)
    with pytest.raises(NotMeasured, match="at least 7 errors"):
        metrology.harmonics(numpy.arange(6) / 6, numpy.zeros(6), 3)
    with pytest.raises(NotMeasured, match="too close together"):
        metrology.harmonics(numpy.zeros(7), numpy.zeros(7), 3)


# ------------------------------------------------------------------ pictures


@pytest.mark.parametrize(
    "picture",
    [
        lambda: metrology_pictures.standstill(white(2.0, 4096), RATE_HZ),
        lambda: metrology_pictures.allan(white(2.0, 4096), RATE_HZ),
        lambda: metrology_pictures.positioning(by_hand()),
        lambda: metrology_pictures.circles(
            {"one": Circle(5.0, turn(oval), turn(oval)), "two": Circle(5.0, turn(oval), turn(oval))}
        ),
        lambda: metrology_pictures.settling({"X": [0.01, 0.02, 0.02], "Y": []}, 20.0),
        lambda: metrology_pictures.harmonic_bars({"before": [3.0, 1.0], "after": [0.1, 0.2]}),
    ],
)
def test_every_picture_is_drawn(picture):
    image = Image.open(io.BytesIO(picture()))
    colours = set(image.convert("RGB").resize((60, 60)).get_flattened_data())
    assert image.format == "PNG" and image.width > 400 and len(colours) > 3
