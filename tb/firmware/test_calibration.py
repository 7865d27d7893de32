# SPDX-License-Identifier: Apache-2.0
"""The calibration of the firmware: equal to its model in every integer, complete from reset, each
check refuses with its reason, values are stored and restored.
"""

import ctypes
import itertools
import math
import random

import numpy as np
import pytest

from figures import calibration as signals
from tb.bench import seed
from tb.firmware import calibration_model as model
from twin.compiled.calibration import (
    CALIBRATES,
    FOLLOWS,
    FROZEN,
    LOADING,
    NOTHING,
    PHASES,
    PHASES_OF_BURST,
    SAMPLES,
    WORK,
    Calibration,
    CalibrationRun,
    Ellipse,
    Values,
    library,
)


def circle(turns, count=1024, size=0.8, gain=1.0, phase=0.0, offset=(0.0, 0.0)):
    """Samples (cos, sin) at equal steps over `turns` turns, full scale 2^15."""
    angles = [math.tau * (0.1 + turns * n / count) for n in range(count)]
    hold = lambda sample: max(-32768, min(32767, round(sample * size * 32768)))
    return [
        (hold(math.cos(p) + offset[0]), hold(gain * math.sin(p + phase) + offset[1]))
        for p in angles
    ]


def words(samples):
    return [(cos & 65535) << 16 | sin & 65535 for cos, sin in samples]


def line(periods, count=PHASES_OF_BURST):
    return [round(65536 * periods * n / count) & 65535 for n in range(count)]


def fit(samples, **window):
    """(reason, values) of the firmware's ellipse."""
    calibration, sums, values = Calibration(), Ellipse(), Values()
    calibration.amplitude_low, calibration.amplitude_high = (
        window.get("low", 0),
        window.get("high", 65535),
    )
    values.gain = 65536
    library().ellipse_start(ctypes.byref(sums))
    for word in words(samples):
        library().ellipse_take(ctypes.byref(sums), ctypes.byref(calibration), ctypes.c_uint32(word))
    return library().ellipse_fit(ctypes.byref(sums), ctypes.byref(values)), values.as_dict()


def fresh(complete=False):
    """A calibration that needs samples; `complete`: one that needs phases."""
    machine = CalibrationRun()
    if complete:
        assert machine.call("restore", ctypes.byref(machine.calibration.values))
    assert machine.idle() == (PHASES if complete else SAMPLES)
    return machine


def calibrated():
    machine, _, _, curve = signals.calibrated(5, 150)
    assert machine.calibration.complete and machine.calibration.reason == model.RUNNING
    return machine, curve


# ---- equal to the model


def test_any_samples_give_the_ellipse_of_the_model():
    draw, seen = random.Random(seed()), set()
    for _ in range(150):
        samples = circle(
            draw.choice((0, 0.01, 0.3, 1, 1.5, 7.3)),
            draw.choice((8, 64, 200)),
            draw.uniform(0.02, 1.3),
            draw.choice((0.3, 1, 1.06, 1.9)),
            draw.uniform(-1, 1),
            (draw.uniform(-0.3, 0.3), draw.uniform(-0.3, 0.3)),
        )
        noise = draw.choice((0, 30, 3000))
        samples = [
            tuple(
                max(-32768, min(32767, sample + draw.randint(-noise, noise))) for sample in sample
            )
            for sample in samples
        ]
        window = dict(low=draw.choice((0, 5000)), high=draw.choice((65535, 30000)))
        got, expected = fit(samples, **window), model.ellipse_fit(samples, **window)
        assert got == expected
        seen.add(got[0])
    assert seen >= {
        model.RUNNING,
        model.STANDSTILL,
        model.PARTIAL_CIRCLE,
        model.AMPLITUDE,
        model.DISTORTED,
    }


def test_the_corners_of_the_range_give_what_the_model_gives():
    corners = [(x, y) for x in (-32768, 32767) for y in (-32768, 32767)]
    for samples in (corners, corners * 512, [(-32768, -32768)] * 2048, [(0, 0)] * 9, []):
        assert fit(samples) == model.ellipse_fit(samples)


def test_a_pass_of_any_phases_gives_the_values_of_the_model():
    """Among them a vibration, a reversal of the motion, a change of the recorder's setting, a burst
    that is refused between.
    """
    draw, machine = np.random.default_rng(seed()), fresh(complete=True)
    expected = model.Pass(model.IDENTITY)
    line_of_vibration = draw.uniform(3, 120)
    while machine.calibration.accepted + machine.calibration.refused < 2:
        ramp = np.arange(PHASES_OF_BURST) / PHASES_OF_BURST
        position = (
            draw.uniform()
            + draw.uniform(10, 22) * ramp * draw.choice([-1, 1])
            + draw.uniform(-1, 1) * ramp**2
        )
        position = position + 0.02 * np.sin(2 * np.pi * (line_of_vibration * ramp + draw.uniform()))
        position = (
            position
            + 0.01 * np.sin(2 * np.pi * 2 * position)
            + draw.normal(0, 0.001, len(position))
        )
        phases, every = (
            (np.rint(position * 65536).astype(int) & 65535).tolist(),
            1 + (expected.bursts > 6),
        )
        assert model.judge(phases)[0] == model.RUNNING and expected.take(phases, every)
        machine.phases(phases, every=every)
        if expected.bursts == 20:
            assert machine.phases(line(0)) == model.STANDSTILL
        if expected.bursts < model.PASS:
            got = machine.calibration.pass_
            assert (got.bursts, got.spectra, got.every, got.squares) == (
                expected.bursts,
                expected.spectra,
                expected.every,
                expected.squares,
            )
            assert (list(got.line), list(got.information), list(got.cosine), list(got.sine)) == (
                expected.line,
                expected.information,
                expected.cosine,
                expected.sine,
            )
            assert (got.slowest, got.fastest) == (min(expected.travels), max(expected.travels))
    assert (
        expected.bursts == model.PASS
        and machine.calibration.accepted == 1
        and machine.calibration.refused == 1
    )
    assert (
        machine.values == expected.candidate() and machine.calibration.scatter == expected.scatter()
    )
    assert machine.table == model.table_of(machine.values)
    assert machine.values["sine"][1] == pytest.approx(0.01 * 2**24, rel=0.02)


def test_any_values_give_the_table_of_the_model_held_to_18_bits():
    draw = random.Random(seed())
    for size in (0, 100, 100_000, 1 << 21):
        values = Values()
        values.cosine[:] = [draw.randint(-size, size) for _ in range(model.ORDERS)]
        values.sine[:] = [draw.randint(-size, size) for _ in range(model.ORDERS)]
        values.shift = draw.randint(-size, size)
        for point in range(0, 256, 5):
            entry = library().harmonics_table_entry(ctypes.byref(values), point)
            assert entry == model.table_entry(values.as_dict(), point) and -131072 < entry < 131072


def test_the_sine_is_true_within_its_points():
    assert all(
        abs(model.sine_of(n) - 32767 * math.sin(math.tau * n / 65536)) <= 3.5 for n in range(65536)
    )


# ---- what is found


def test_an_ellipse_is_found_to_the_last_bits():
    gain, phase, offset = 1.06, math.radians(4), (0.05, -0.04)
    reason, values = fit(circle(3.3, gain=gain, phase=phase, offset=offset))
    assert reason == model.RUNNING
    size = 0.8 * 32768
    assert (
        abs(values["cos_offset"] - offset[0] * size) <= 1.5
        and abs(values["sin_offset"] - offset[1] * size) <= 1.5
    )
    assert (
        abs(values["gain"] / 65536 - 1 / (gain * math.cos(phase))) < 1e-4
        and abs(values["quadrature_error"] / 65536 + math.tan(phase)) < 1e-4
    )


def test_one_turn_of_64_samples_is_enough_for_the_ellipse():
    assert fit(circle(1, 64))[0] == model.RUNNING


def test_a_harmonic_of_the_phase_is_found_whatever_its_size_in_one_pass():
    draw, machine = np.random.default_rng(3), fresh(complete=True)
    while not machine.calibration.accepted:
        phase = position = (
            draw.uniform() + draw.uniform(12, 20) * np.arange(PHASES_OF_BURST) / PHASES_OF_BURST
        )
        for _ in range(30):  # the phase at which position = phase - 0.01 sin 3 phase
            phase = position + 0.01 * np.sin(6 * np.pi * phase)
        machine.phases((np.rint(phase * 65536).astype(int) & 65535).tolist())
    found = np.array(machine.values["sine"]) / 2**24, np.array(machine.values["cosine"]) / 2**24
    assert (
        abs(found[0][2] - 0.01) < 3e-5
        and np.abs(np.delete(found[0], 2)).max() < 4e-5
        and np.abs(found[1]).max() < 2e-5
    )


@pytest.mark.parametrize("harmonic", [2, 5, -2, -5])
def test_the_length_of_the_vector_distinguishes_plus_from_minus(harmonic):
    order, size = (harmonic - 1 if harmonic > 0 else 1 - harmonic), 0.001 * np.exp(0.7j)
    turn = np.arange(64) / 64 * 2 * np.pi
    wave = np.exp(1j * turn) + size * np.exp(1j * harmonic * turn)
    part = lambda real: 2 * np.mean(real * np.exp(-1j * order * turn))
    p, r = part(np.angle(wave * np.exp(-1j * turn))), part(np.abs(wave) - 1)
    plus, minus = (r + 1j * p) / 2, np.conj((r - 1j * p) / 2)
    assert (
        abs((plus if harmonic > 0 else minus) - size) < 2e-6
        and abs(minus if harmonic > 0 else plus) < 2e-6
    )


def test_a_calibration_waits_while_another_one_works_on_its_burst():
    first, second = fresh(complete=True), fresh(complete=True)
    assert first.call("open", ctypes.c_uint16(1), False) and not second.call(
        "open", ctypes.c_uint16(1), False
    )
    assert second.calibration.need == PHASES and second.calibration.refused == 0
    first.call("set_mode", FROZEN)  # releases its burst
    assert second.phases(line(15)) == model.RUNNING and second.calibration.pass_.bursts == 1


def test_the_test_signal_is_calibrated_from_reset_within_610_fringes():
    machine, curve = calibrated()
    assert signals.remaining_nm(machine.values, machine.table, curve) <= 0.1
    assert machine.calibration.accepted == 2 and machine.calibration.refused == 0


# ---- what is refused


@pytest.mark.parametrize(
    "samples, spoiled, reason",
    [
        (circle(0.001), False, model.STANDSTILL),
        (circle(0.6), False, model.PARTIAL_CIRCLE),
        (circle(0.87), False, model.PARTIAL_CIRCLE),
        (circle(3, size=0.1), False, model.AMPLITUDE),
        (circle(3, size=1.4), False, model.AMPLITUDE),
        (circle(3), True, model.AMPLITUDE),
        (circle(3, gain=0.4), False, model.DISTORTED),
        (circle(3, phase=0.9), False, model.DISTORTED),
    ],
)
def test_samples_that_give_no_ellipse_are_refused(samples, spoiled, reason):
    machine = fresh()
    machine.calibration.amplitude_low, machine.calibration.amplitude_high = 8000, 40000
    before = machine.values
    for _ in range(2):
        got = machine.burst(words(samples), spoiled)
    assert got == reason
    assert (
        machine.values == before
        and machine.calibration.accepted == 0
        and machine.calibration.refused >= 1
        and machine.calibration.need == SAMPLES
    )
    for _ in range(2):
        machine.burst(words(circle(3)))
    assert (
        machine.calibration.reason == model.RUNNING and machine.calibration.accepted == 1
    )  # and it recovers by itself


@pytest.mark.parametrize(
    "phases, spoiled, reason",
    [
        (line(0), False, model.STANDSTILL),
        (line(0.2), False, model.STANDSTILL),
        (line(7.9), False, model.PARTIAL_CIRCLE),
        (
            [round(3e4 * math.sin(n / 30)) & 65535 for n in range(PHASES_OF_BURST)],
            False,
            model.PARTIAL_CIRCLE,
        ),
        (line(15), True, model.AMPLITUDE),
        (line(300), False, model.TOO_FAST),
        (line(-300), False, model.TOO_FAST),
        (
            [
                round(65536 * 20 * (n / PHASES_OF_BURST) ** 2) & 65535
                for n in range(PHASES_OF_BURST)
            ],
            False,
            model.UNSTEADY,
        ),
        (line(30, 1300) + line(-15, PHASES_OF_BURST - 1300), False, model.UNSTEADY),
    ],
)
def test_a_burst_of_phases_that_cannot_be_used_is_refused(phases, spoiled, reason):
    machine = fresh(complete=True)
    assert machine.phases(phases, spoiled) == reason == model.judge(phases, spoiled)[0]
    assert machine.calibration.pass_.bursts == 0 and machine.calibration.refused == 1
    assert machine.phases(line(-15)) == model.RUNNING and machine.calibration.pass_.bursts == 1


@pytest.mark.parametrize("multiple", [1, 2, 3])
def test_a_vibration_locked_to_the_fringe_at_one_of_two_speeds_is_subtracted(multiple):
    speeds = iter([600, 700] * 100)
    machine, _, _, curve = signals.calibrated(3, 600 * multiple, speeds=lambda: next(speeds))
    assert (
        machine.calibration.complete
        and signals.remaining_nm(machine.values, machine.table, curve) <= 0.1
    )


@pytest.mark.parametrize("fringes", [610, 5200])
def test_vibrations_locked_to_the_fringe_at_each_speed_are_refused(fringes):
    """By a pass of usual length, and by one that was made longer in vain."""
    speeds = itertools.cycle([600, 700])
    machine, *_ = signals.calibrated(3, (600, 700), speeds=lambda: next(speeds), fringes=fringes)
    assert machine.calibration.reason == model.VIBRATION
    assert machine.calibration.refused == (fringes > 610)
    assert not machine.calibration.complete and not any(machine.values["cosine"])


def test_a_broadband_vibration_is_averaged_out_by_a_longer_pass():
    machine, left, _ = signals.broadband(1, 4800)
    assert machine.calibration.accepted == 2 and machine.calibration.complete
    assert machine.calibration.refused == 0 and left <= 0.3
    early, left, _ = signals.broadband(1, 2000)
    assert early.calibration.reason == model.VIBRATION and not early.calibration.complete
    assert early.calibration.pass_.bursts > model.PASS and left > 3


def test_one_speed_is_refused_since_a_locked_vibration_would_not_show():
    machine, *_ = signals.calibrated(3, 0, 0, speeds=lambda: 600)
    assert machine.calibration.reason == model.ONE_SPEED
    assert not machine.calibration.complete and not any(machine.values["cosine"])
    draw = random.Random(1)
    machine.call("set_mode", FROZEN)  # a pass of the same signal from its start
    machine.call("set_mode", CALIBRATES)
    machine.calibration.reason = model.ONE_SPEED
    for _ in range(model.PASS - 1):  # the reason of a refused pass stays while the next one runs
        assert machine.phases(line(draw.uniform(12, 18))) == model.ONE_SPEED
    assert machine.phases(line(15)) == model.RUNNING and machine.calibration.complete


# ---- read, freeze, store, restore


def test_restored_values_equal_the_stored_ones():
    machine, _ = calibrated()
    stored, table, again = bytes(machine.calibration.values), machine.table, fresh()
    assert (
        again.call("restore", ctypes.byref(Values.from_buffer_copy(stored)))
        and again.calibration.need == LOADING
    )
    again.idle()
    assert (
        bytes(again.calibration.values) == stored
        and again.table == table
        and again.calibration.complete
        and again.calibration.need == PHASES
    )


def test_values_out_of_range_are_not_restored():
    for name, value in (
        ("gain", 0),
        ("gain", 131072),
        ("quadrature_error", 65537),
        ("sin_offset", -32768),
        ("cos_offset", 16385),
    ):
        machine, wrong = fresh(), Values(gain=65536)
        setattr(wrong, name, value)
        assert not machine.call("restore", ctypes.byref(wrong)) and machine.values == model.IDENTITY
    wrong = Values(gain=65536)
    wrong.sine[9] = -(2**31)
    assert not machine.call("restore", ctypes.byref(wrong)) and machine.calibration.need == SAMPLES


def test_frozen_values_stay_and_calibration_continues_when_unfrozen():
    machine, _ = calibrated()
    values = machine.values
    machine.call("set_mode", FROZEN)
    assert machine.calibration.need == NOTHING
    for periods in (12, 15, 18) * 20:
        machine.phases(line(periods))
    assert machine.values == values and machine.calibration.reason == model.FROZEN
    machine.call("set_mode", CALIBRATES)
    assert machine.calibration.need == PHASES and machine.calibration.pass_.bursts == 0
    machine.phases(line(15))
    assert machine.calibration.reason == model.RUNNING and machine.values == values


def drifted_samples(offset=(0.0, 0.0), gain=1.0, phase=0.0):
    """Samples of a circle whose harmonic +3 an ellipse takes for its own, in part."""
    angles = np.linspace(0, math.tau * 15, 2048, endpoint=False)
    cos, sin = (
        np.cos(angles) + 0.01 * np.cos(3 * angles),
        np.sin(angles) + 0.01 * np.sin(3 * angles),
    )
    bent = np.stack(
        [cos + offset[0], gain * (sin * math.cos(phase) + cos * math.sin(phase)) + offset[1]]
    )
    return [tuple(one) for one in np.rint(bent.T * 0.8 * 32767).astype(int).tolist()]


def drifted(*errors, **named):
    """The two bursts of an ellipse of these samples."""
    samples = drifted_samples(*errors, **named)
    return [words(samples[:1024]), words(samples[1024:])]


def follow(machine, bursts):
    for burst in bursts:
        reason = machine.burst(burst)
    return reason


def test_following_adds_what_the_ellipse_has_changed_and_keeps_the_harmonics():
    machine, curve = calibrated()
    values = machine.values
    accepted, loads, table = machine.calibration.accepted, machine.loads, machine.table
    machine.call("set_mode", FOLLOWS)
    assert machine.calibration.need == SAMPLES
    # the first ellipse is the reference, whatever it is: nothing changes
    assert follow(machine, drifted()) == model.RUNNING
    assert machine.values == values and machine.loads == loads
    assert machine.calibration.referenced and machine.calibration.accepted == accepted
    # the second one has drifted
    assert follow(machine, drifted((0.02, -0.01), 1.03, 0.02)) == model.RUNNING
    _, plain = fit(drifted_samples())
    _, moved = fit(drifted_samples((0.02, -0.01), 1.03, 0.02))
    for name in ("sin_offset", "cos_offset", "gain", "quadrature_error"):
        assert machine.values[name] - values[name] == moved[name] - plain[name] != 0, name
    assert machine.values["cosine"] == values["cosine"] and machine.values["sine"] == values["sine"]
    # half of what the quadrature error turns the phase by, in every point of the table
    turned = (
        (machine.values["quadrature_error"] - values["quadrature_error"]) / 65536 / 2 / math.tau
    )
    assert machine.values["shift"] == pytest.approx(turned * 2**24, abs=1) and abs(turned) > 1e-3
    assert np.subtract(machine.table, table) == pytest.approx(turned * 2**20, abs=1)
    assert machine.calibration.accepted == accepted + 1 and machine.loads == loads + 1
    assert machine.calibration.complete
    # and back again
    follow(machine, drifted())
    assert machine.values == values


def test_following_survives_a_pause_but_not_new_values():
    machine, _ = calibrated()
    machine.call("set_mode", FOLLOWS)
    values = machine.values
    follow(machine, drifted())
    machine.call("set_mode", FROZEN)
    assert machine.calibration.need == NOTHING and machine.calibration.referenced
    machine.call("set_mode", FOLLOWS)
    follow(machine, drifted((0.02, 0.0)))
    assert machine.values["cos_offset"] > values["cos_offset"]  # what drifted in the pause, too
    assert machine.call("restore", ctypes.byref(Values(gain=70000)))
    assert machine.idle() == SAMPLES and not machine.calibration.referenced
    follow(machine, drifted((0.02, 0.0)))
    assert machine.values["gain"] == 70000
    machine.call("forget")
    assert machine.idle() == SAMPLES and not machine.calibration.referenced
    follow(machine, drifted())
    assert machine.values == model.IDENTITY


def test_following_refuses_what_gives_no_ellipse_or_leaves_the_range():
    machine = fresh()
    limits = Values(gain=131000, sin_offset=0, cos_offset=0)
    assert machine.call("restore", ctypes.byref(limits))
    machine.call("set_mode", FOLLOWS)
    machine.idle()
    follow(machine, drifted())
    before, refused = machine.values, machine.calibration.refused
    still = [words([(20000, 100)] * 1024)] * 2
    assert follow(machine, still) == model.STANDSTILL
    assert machine.calibration.ellipse.count == 0 and machine.calibration.need == SAMPLES
    assert follow(machine, drifted(gain=0.9)) == model.DISTORTED  # the gain would be 2.2
    assert machine.values == before and machine.calibration.refused == refused + 2
    assert follow(machine, drifted(gain=1.1)) == model.RUNNING and machine.values["gain"] < 131000


def test_restored_values_are_loaded_even_if_frozen():
    machine = fresh()
    machine.call("set_mode", FROZEN)
    assert (
        machine.call("restore", ctypes.byref(Values(gain=70000)))
        and machine.calibration.need == LOADING
    )
    loads = machine.loads
    assert (
        machine.idle() == NOTHING and machine.loads == loads + 1 and machine.values["gain"] == 70000
    )


def test_forgetting_starts_from_scratch():
    machine, _ = calibrated()
    machine.call("forget")
    assert (
        machine.idle() == SAMPLES
        and machine.values == model.IDENTITY
        and set(machine.table) == {0}
        and not machine.calibration.complete
    )


def test_a_word_that_was_not_requested_changes_nothing():
    machine = fresh()
    machine.call("set_mode", FROZEN)
    before = bytes(machine.calibration)
    machine.call("take", (ctypes.c_uint32 * 4)(0x12345678))
    machine.call("work")
    machine.call("loaded")
    assert bytes(machine.calibration) == before and machine.calibration.need not in (WORK, LOADING)
