# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.ellipse: known ellipses are found, and amplitudes judged at their limits."""

import math
import random

import pytest

from moire.analysis.ellipse import OFF, Ellipse, Limits, NoEllipse, fit, judged, widest_gap_deg
from tb.bench import seed

KNOWN = Ellipse(5.0, -7.5, 101.0, 88.0, 6.0, 0.0)
LIMITS = Limits(32, 160, 126)


def samples(ellipse, turns):
    error = math.radians(ellipse.quadrature_error_deg)
    return (
        [ellipse.cos_offset + ellipse.cos_amplitude * math.cos(turn) for turn in turns],
        [ellipse.sin_offset + ellipse.sin_amplitude * math.sin(turn + error) for turn in turns],
    )


def evenly(count, share=1.0):
    return [math.tau * share * n / count for n in range(count)]


@pytest.mark.parametrize("share", [1.0, 0.8])
@pytest.mark.parametrize("quadrature_error_deg", [-65, -20, 0, 6, 65])
def test_offsets_amplitudes_and_quadrature_error_are_found(share, quadrature_error_deg):
    known = Ellipse(5.0, -7.5, 101.0, 88.0, quadrature_error_deg, 0.0)
    found = fit(*samples(known, evenly(40, share)))
    assert vars(found) == pytest.approx(vars(known), abs=1e-6)
    assert found.amplitude == pytest.approx(94.5)


def test_an_ellipse_is_found_whose_offsets_are_far_larger_than_its_amplitudes():
    known = Ellipse(30_000.0, -20_000.0, 101.0, 88.0, 6.0, 0.0)
    assert vars(fit(*samples(known, evenly(40)))) == pytest.approx(vars(known), abs=1e-6)


def test_an_ellipse_is_found_whose_extremes_no_sample_meets():
    source = random.Random(seed())
    for _ in range(50):
        turns = [math.radians(37 * n + source.uniform(-5, 5)) for n in range(12)]
        assert vars(fit(*samples(KNOWN, turns))) == pytest.approx(vars(KNOWN), abs=1e-6)


def test_noise_of_the_adc_is_the_deviation():
    noise = random.Random(4)
    cos, sin = samples(KNOWN, evenly(512))
    found = fit(*([value + noise.gauss(0, 1) for value in one] for one in (cos, sin)))
    assert found.deviation == pytest.approx(1, rel=0.15)
    for name in ("cos_offset", "sin_offset", "cos_amplitude", "sin_amplitude"):
        assert getattr(found, name) == pytest.approx(getattr(KNOWN, name), abs=0.4)


def test_the_curve_lies_on_the_ellipse_and_is_closed():
    cos, sin = KNOWN.points(25)
    assert len(cos) == len(sin) == 25
    assert (cos[0], sin[0]) == pytest.approx((cos[-1], sin[-1]))
    assert vars(fit(cos, sin)) == pytest.approx(vars(KNOWN), abs=1e-6)
    assert len(KNOWN.points()[0]) == 96


def all_but(first_deg, last_deg):
    """Turns around the circle with a gap between these two."""
    return [math.radians(last_deg + n * (360 + first_deg - last_deg) / 59) for n in range(60)]


def test_the_samples_may_leave_a_quarter_of_the_circle_empty():
    circle = Ellipse(0, 0, 100, 100, 0, 0)
    assert fit(*samples(circle, all_but(0.25, 90))).amplitude == pytest.approx(100)
    with pytest.raises(NoEllipse, match="leave 9[01] degrees of the circle empty"):
        fit(*samples(circle, all_but(-0.25, 90.25)))


@pytest.mark.parametrize(
    "turns, words",
    [
        (evenly(11), "too few different samples: 11 of at least 12"),
        (evenly(60, 0.5), "degrees of the circle empty: move the axis by some signal periods"),
        ([0.3] * 20, "degrees of the circle empty"),
    ],
)
def test_samples_that_determine_no_ellipse_are_refused_with_the_reason(turns, words):
    with pytest.raises(NoEllipse, match=words):
        fit(*samples(KNOWN, turns))


def test_samples_on_a_hyperbola_or_on_few_points_are_no_ellipse():
    steps = [n / 10 for n in range(-20, 21)]
    right, high = [math.cosh(n) for n in steps], [2 * math.sinh(n) for n in steps]
    both = [*right, *(-one for one in right)], high + high
    with pytest.raises(NoEllipse, match="on no ellipse"):
        fit(*both)
    with pytest.raises(NoEllipse, match="on no ellipse"):
        fit([100, 0, -100, 0] * 4, [0, 100, 0, -100] * 4)


def test_a_long_hyperbola_is_no_ellipse():
    """(x + y)^2 - 0.04 (x - y)^2 = 1, which is near to two parallel lines."""
    sums = [
        (side * math.cosh(n / 10), math.sinh(n / 10) / 0.2)
        for n in range(-20, 21)
        for side in (1, -1)
    ]
    with pytest.raises(NoEllipse, match="on no ellipse"):
        fit([(u + v) / 2 for u, v in sums], [(u - v) / 2 for u, v in sums])


@pytest.mark.parametrize(
    "turns_deg, gap_deg", [((100, 160, -160, -60, 20), 100), ((-100, -20, 50, 100), 160)]
)
def test_a_gap_may_reach_across_the_angle_of_180_degrees(turns_deg, gap_deg):
    turns = [math.radians(one) for one in turns_deg]
    xs, ys = [math.cos(one) for one in turns], [math.sin(one) for one in turns]
    assert widest_gap_deg(xs, ys) == pytest.approx(gap_deg)


@pytest.mark.parametrize(
    "amplitude, largest, limits, kind",
    [
        (32, 100, LIMITS, "good"),
        (31.9, 100, LIMITS, "weak"),
        (160, 126, LIMITS, "good"),
        (160.1, 126, LIMITS, "large"),
        (100, 126, LIMITS, "good"),
        (100, 127, LIMITS, "saturated"),
        (100, 127, Limits(32, 160, OFF), "good"),
        (100, 127, None, "unknown"),
    ],
)
def test_an_amplitude_is_judged_at_its_limits(amplitude, largest, limits, kind):
    found = judged(Ellipse(0, 0, amplitude, amplitude, 0, 0), largest, limits)
    assert found.kind == kind and f"{amplitude:.1f} ADC counts" in found.words
    assert bool(found.to_do) == (kind in ("weak", "large", "saturated"))


def test_the_smaller_channel_may_be_weak_and_the_larger_one_too_large():
    assert judged(Ellipse(0, 0, 100, 20, 0, 0), 100, LIMITS).kind == "weak"
    assert judged(Ellipse(0, 0, 170, 100, 0, 0), 126, LIMITS).kind == "large"
