# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.harmonic_fit: harmonics made by hand and in noise, how many orders the readings
carry, and errors in a table reported with their lines.
"""

import math

import numpy as np
import pytest

from moire.analysis.harmonic_fit import (
    Readings,
    design,
    fit,
    fit_drifting,
    least_squares,
    read_readings,
    signal_power,
)
from moire.errors import BadFile, OutOfRange
from tb.bench import seed

TEN = np.arange(0, 361, 10.0)
FINE = np.arange(0, 360, 0.05) + 0.013


def ring(angle, cosine, sine):
    turn = np.radians(angle)
    return sum(
        c * np.cos(k * turn) + s * np.sin(k * turn)
        for k, (c, s) in enumerate(zip(cosine, sine, strict=True), start=1)
    )


def readings(error, angle=TEN):
    return Readings(angle, error, np.arange(1, len(angle) + 1))


def written(tmp_path, lines):
    path = tmp_path / "ring.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def table(angles=TEN, change=None):
    """Lines of a correct table; change: {number of a line: text}, None removes the line."""
    lines = ["angle_deg,error_arcsec"] + [
        f"{angle:g},{ring(np.array([angle]), [100, 20], [0, -7])[0]:.4f}" for angle in angles
    ]
    for number, text in (change or {}).items():
        lines[number - 1] = text
    return [line for line in lines if line is not None]


def test_harmonics_without_noise_are_found_exactly():
    cosine, sine = [80, -20, 3, 0, 1.5], [50, 10, 0, -2, 0]
    found = fit(readings(7 + ring(TEN, cosine, sine)), orders=5)
    assert (
        np.allclose(found.cosine, cosine)
        and np.allclose(found.sine, sine)
        and found.constant == pytest.approx(7)
    )
    assert found.left < 1e-9 and np.allclose(found.at(FINE), ring(FINE, cosine, sine))


@pytest.mark.parametrize(
    ("angles", "orders"),
    [
        (TEN, 17),
        (np.arange(0, 1441, 10.0), 17),
        (np.arange(0, 361, 1.0), 32),
        (np.arange(0, 361, 60.0), 2),
    ],
)
def test_as_many_orders_are_fitted_as_the_angles_carry(angles, orders):
    made = readings(ring(angles, [100], [0]), angles)
    assert fit(made).orders == orders
    with pytest.raises(OutOfRange, match=f"carry 1 to {orders} orders, not {orders + 1}"):
        fit(made, orders=orders + 1)


def test_no_order_at_all_is_refused():
    with pytest.raises(OutOfRange, match="carry 1 to 17 orders, not 0"):
        fit(readings(ring(TEN, [100], [0])), orders=0)


def test_angles_at_the_same_position_count_once_also_around_0():
    angles = np.array([0, 90, 359.99999999, 360, 450.0000001])
    assert readings(np.zeros(5), angles).angles == 2
    assert readings(np.zeros(5), np.array([0, 90, 359.9999, 360, 450.0])).angles == 3


def test_revolutions_are_counted_to_the_nearest_one():
    for last, revolutions in ((350, 1), (539, 1), (541, 2), (1440, 4)):
        angles = np.array([0, 10, last - 20, last], float)
        assert readings(np.zeros(4), angles).revolutions == revolutions


def test_an_order_above_half_the_angles_looks_like_its_alias():
    found = fit(readings(ring(TEN, [0] * 33 + [5], [0] * 34)))  # order 34 at 36 angles
    assert (
        found.amplitude[1] == pytest.approx(5)
        and "34 as 2" in found.words()
        and "35 as 1" in found.words()
    )


def test_noise_is_estimated_and_reduced_by_weights():
    source = np.random.default_rng(seed())
    angle = np.arange(0, 3600.5, 10.0)
    gains = []
    for _ in range(20):
        error = ring(angle, [90, 25, 8], [0, 0, 0]) + source.uniform(-2, 2, len(angle))
        weighted, plain = (fit(readings(error, angle), weighted=w) for w in (True, False))
        assert weighted.noise == pytest.approx(2 / math.sqrt(3), rel=0.2)
        assert np.all(weighted.weight[:3] > 0.99) and np.all(weighted.weight[3:] < 0.9)
        truth = ring(FINE, [90, 25, 8], [0, 0, 0])
        gains.append(
            np.max(np.abs(truth - plain.at(FINE))) / np.max(np.abs(truth - weighted.at(FINE)))
        )
    assert np.median(gains) > 1.5


def test_the_noise_of_one_revolution_is_unknown_unless_given():
    error = ring(TEN, [90, 25, 8], [0, 0, 0]) + np.random.default_rng(seed()).uniform(
        -2, 2, len(TEN)
    )
    assert fit(readings(error)).noise is None and np.all(fit(readings(error)).weight == 1)
    assert np.all(fit(readings(error), noise=1.15).weight[3:] < 1)


def test_the_noise_is_that_of_the_residual_if_12_degrees_of_freedom_are_left():
    error = np.random.default_rng(seed()).normal(0, 3, len(TEN))
    made = readings(error)
    residual = error - design(TEN, 12) @ least_squares(made, 12)
    assert fit(made, orders=12).noise == pytest.approx(math.sqrt(np.sum(residual**2) / 12))
    assert fit(made, orders=13).noise is None


def test_the_noise_is_that_of_the_repeated_readings_if_there_are_12():
    source = np.random.default_rng(seed())
    angle = np.concatenate([np.arange(0, 360, 10.0), 360 + 10.0 * np.arange(12)])
    error = source.normal(0, 3, 48)
    apart = error[:12] - error[36:]
    found = fit(readings(error, angle), orders=17)
    assert found.noise == pytest.approx(math.sqrt(np.sum(apart**2) / 2 / 12))
    fewer = readings(error[:47], angle[:47])
    residual = fewer.error - design(fewer.angle, 17) @ least_squares(fewer, 17)
    assert fit(fewer, orders=17).noise == pytest.approx(math.sqrt(np.sum(residual**2) / 12))


def test_the_power_of_the_signal_follows_a_law_if_there_are_four_orders_above_the_third():
    floor, power = 1.0, np.array([50.0, 0.5, 9.0, 6.0, 1.0, 3.0, 0.2])
    single = np.maximum(power - floor, 0)
    assert np.array_equal(signal_power(power[:6], floor), single[:6])
    found = signal_power(power, floor)
    assert np.array_equal(found[:3], single[:3]) and np.all(np.diff(found[3:]) < 0)


def most_probable(made, noise, drift, lasting, carried):
    """fit_drifting by the textbook: the inverse of the sum of what is known before and by the
    readings.
    """
    solved = least_squares(made, carried)
    count = len(made.error)
    floor = 4 * (noise**2 + drift**2) / count
    power = signal_power(solved[1::2] ** 2 + solved[2::2] ** 2, floor)
    slope = math.log(power[3] / power[carried - 1]) / math.log(4 / carried)
    before = [1e4] + [
        1e4 if order < 4 else power[3] * (order / 4) ** slope / 2
        for order in range(1, 33)
        for _ in "cs"
    ]
    scatter = [
        [drift**2 * math.exp(-abs(a - b) / lasting) + noise**2 * (a == b) for a in range(count)]
        for b in range(count)
    ]
    matrix, weights = design(made.angle, 32), np.linalg.inv(scatter)
    by_readings = matrix.T @ weights @ matrix
    after = np.linalg.inv(np.diag(1 / np.array(before)) + by_readings)
    return after @ matrix.T @ weights @ made.error, np.diag(after @ by_readings)


def test_the_fit_with_a_drift_is_the_most_probable_one():
    source, angle = np.random.default_rng(seed()), np.arange(37) * 50.0
    sizes = [90, 25, 8, *(6.4 / k for k in range(4, 18))]
    for noise, drift, lasting in ((0.5, 1.15, 5), (2.0, 0.7, 12)):
        turns = source.uniform(0, 2 * math.pi, len(sizes))
        error = ring(angle, sizes * np.cos(turns), sizes * np.sin(turns))
        made = readings(error + source.normal(0, noise, 37), angle)
        found = fit_drifting(made, 16, noise, drift, lasting)
        solved, known = most_probable(made, noise, drift, lasting, 17)
        assert found.constant == pytest.approx(solved[0], abs=1e-4)
        assert np.allclose(found.cosine, solved[1:33:2], atol=1e-4)
        assert np.allclose(found.sine, solved[2:34:2], atol=1e-4)
        assert np.allclose(found.weight, (known[1:33:2] + known[2:34:2]) / 2, atol=1e-4)
        assert found.noise == pytest.approx(math.hypot(noise, drift))


def test_a_fit_in_words():
    error = 7 + ring(TEN, [80, -20, 3], [50, 10, 0])
    found = fit(readings(error), orders=3)
    assert found.words().splitlines() == [
        "3 orders; noise of a reading 0.00 arcsec rms",
        f"largest error {max(abs(error)):.2f} arcsec before, 0.00 after",
        "order   amplitude   phase / deg   weight",
        "    1      94.340        +57.99     1.00",
        "    2      22.361        -63.43     1.00",
        "    3       3.000        +90.00     1.00",
        "36 angles cannot distinguish: order 35 as 1, 34 as 2, 33 as 3",
    ]
    found = fit(readings(error))
    words = found.words().splitlines()
    assert len(words) == 21 and words[0].endswith("not known: one revolution does not show it")
    assert words[-1].endswith("order 35 as 1, 34 as 2, 33 as 3, ...")


def test_a_slow_drift_is_told_from_the_low_orders_by_strides_of_50_degrees():
    source = np.random.default_rng(seed())
    angle, left = np.arange(37) * 50.0, {fit: [], fit_drifting: []}
    for _ in range(20):
        turns = source.uniform(0, 2 * math.pi, 20)
        size = np.array([90, 25, 8, *(6.4 / k for k in range(4, 21))])
        orders = size * np.cos(turns), size * np.sin(turns)
        slow = 1.6 * np.sin(2 * math.pi * np.arange(37) / 14 + source.uniform(0, 2 * math.pi))
        made, truth = readings(ring(angle, *orders) + slow, angle), ring(FINE, *orders)
        for method, found in (
            (fit, fit(made, orders=16, noise=1.15)),
            (fit_drifting, fit_drifting(made, 16, 0.1, 1.15, 5)),
        ):
            left[method].append(np.std(truth - found.at(FINE)))
        assert np.all(found.weight[:3] > 0.99) and np.all((0 < found.weight) & (found.weight < 1))
    assert np.mean(left[fit_drifting]) < 0.9 * np.mean(left[fit])


def test_a_drift_needs_readings_at_many_angles_and_orders_that_the_relay_has():
    few, made = np.arange(0, 361, 30.0), readings(ring(TEN, [100], [0]))
    with pytest.raises(OutOfRange, match="12 angles carry 5 orders; .* it takes 8"):
        fit_drifting(readings(ring(few, [100], [0]), few), 5, 0.1, 1, 5)
    for orders in (0, 33):
        with pytest.raises(OutOfRange, match=f"1 to 32 orders, not {orders}"):
            fit_drifting(made, orders, 0.1, 1, 5)


# files


def test_a_correct_table_is_read_with_or_without_heading_and_comments(tmp_path):
    for lines in (table(), table()[1:], ["# laser, 2026-11-21", "", *table()]):
        read = read_readings(written(tmp_path, lines))
        assert np.array_equal(read.angle, TEN) and read.angles == 36 and read.revolutions == 1


def test_angles_that_fall_back_begin_the_next_revolution(tmp_path):
    read = read_readings(
        written(tmp_path, table(np.concatenate([np.arange(0, 360, 10), np.arange(0, 361, 10)])))
    )
    assert (
        np.array_equal(read.angle, np.arange(0, 721, 10))
        and read.angles == 36
        and read.revolutions == 2
    )


def test_errors_and_angles_are_taken_to_the_ends_of_their_ranges(tmp_path):
    large = [f"{angle:g},{3600 * math.cos(math.radians(angle)):.3f}" for angle in TEN]
    assert read_readings(written(tmp_path, large)).error.max() == 3600
    far = [f"{angle:g},1" for angle in np.arange(35640, 36001, 10.0)]
    assert read_readings(written(tmp_path, far)).angle[-1] == 36000
    for lines, words in (
        (["0,3600.5", *large[1:]], "an error of 3600.5 arcsec is absurd; at most 3600 are taken"),
        ([*far, "36001,1"], "an angle of 36001 degrees is outside 0 to 36000"),
        (["-0.5,1", *far], "an angle of -0.5 degrees is outside"),
    ):
        with pytest.raises(BadFile, match=words):
            read_readings(written(tmp_path, lines))


def test_an_angle_that_falls_back_in_the_second_revolution_is_reported_as_in_the_file(tmp_path):
    lines = table(np.concatenate([np.arange(0, 360, 10), np.arange(0, 361, 10)]))
    lines[40] = "12,99"
    with pytest.raises(BadFile, match="line 41: the angle 12 comes after 20 in line 40"):
        read_readings(written(tmp_path, lines))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({5: "40"}, "line 5: it needs two columns"),
        ({5: "30,1,2"}, "line 5: it needs two columns"),
        ({5: "30,abc"}, "line 5: the error is no number: 'abc'"),
        ({5: "x,1"}, "line 5: the angle is no number: 'x'"),
        ({5: "30,nan"}, "line 5: the error is nan"),
        ({5: "30,9999"}, "line 5: an error of 9999 arcsec is absurd"),
        ({5: "-30,1"}, "line 5: an angle of -30 degrees is outside"),
        ({5: "20,99"}, "line 5: the angle 20 is there twice, also in line 4"),
        ({5: "12,99"}, "line 5: the angle 12 comes after 20 in line 4"),
        ({8: None, 9: None}, "line 8: from 50 to 80 degrees a reading is missing"),
        ({8: None}, "line 8: from 50 to 70 degrees a reading is missing; the others are 10 deg"),
        (
            {20: "180,-20"},
            "line 20: the error -20 arcsec at 180 degrees is 31.7 off what the other readings say; "
            "they scatter by 2.5",
        ),
    ],
)
def test_an_error_in_a_table_is_reported_with_its_line(tmp_path, change, words):
    with pytest.raises(BadFile, match=words):
        read_readings(written(tmp_path, table(change=change)))


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([], "0 readings are too few"),
        (["angle,error"], "0 readings are too few"),
        (table(np.arange(0, 181, 10)), "cover 180 degrees; a whole revolution"),
    ],
)
def test_a_table_with_too_few_readings_is_refused(tmp_path, lines, words):
    with pytest.raises(BadFile, match=words):
        read_readings(written(tmp_path, lines))


def test_a_missing_file_is_reported(tmp_path):
    with pytest.raises(BadFile, match="cannot be read: No such file"):
        read_readings(tmp_path / "none.csv")
