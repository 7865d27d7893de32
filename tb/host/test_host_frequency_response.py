# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.frequency_response, measured_plant and proposals: the plant of a simulated loop is
measured, its model is fitted, gains and a notch keep the margins that they announce, and what shows
no response is refused.
"""

import io
import math

import numpy
import pytest
from PIL import Image

from moire.analysis import frequency_response as measured
from moire.analysis import measured_plant, proposals, tune
from tb.bench import seed

TICK = 1 / 4000
PERIOD_NM = 800.0
SEED = seed()
RIGID = tune.Plant(math.exp(-TICK / 0.011), 2.0 * (1 - math.exp(-TICK / 0.011)), 2, TICK)
RESONANT = tune.Plant(RIGID.a, RIGID.b, 1, TICK, resonance_hz=550.0, part=0.4, damping=0.05)
SLOW = tune.propose(RIGID, 30)


def loop(plant, tuning, excitation, periods, noise=0.0, drift=0.0):
    """Errors and commands at each tick in closed loop, whole LSB; the first period is left out.

    It computes the plant tick by tick, and shares no code with the code under test.
    """
    draw = numpy.random.default_rng(SEED)
    kp, ki, kd = (tuning.real(name) for name in ("kp", "ki", "kd"))
    c1, c2 = 0.0, 0.0
    if plant.damping is not None:
        w = 2 * math.pi * plant.resonance_hz * TICK
        c1 = 2 * math.exp(-plant.damping * w) * math.cos(w * math.sqrt(1 - plant.damping**2))
        c2 = -math.exp(-2 * plant.damping * w)
    position = velocity = total = one = two = last = before = 0.0
    queue, errors, commands = [0.0] * plant.delay, [], []
    for n in range((periods + 1) * len(excitation.values)):
        seen = round(position + noise * draw.standard_normal())
        error = round(drift * n) - seen
        total += ki * error
        servo = kp * error + total - kd * (seen - last)
        last = seen
        command = round(servo) + int(excitation.values[n % len(excitation.values)])
        errors.append(error)
        commands.append(command)
        queue.append(command)
        given = queue.pop(0)
        velocity = plant.a * velocity + plant.b * ((1 - plant.part) * given + plant.part * before)
        before = given
        one, two = (1 - c1 - c2) * velocity + c1 * one + c2 * two, one
        position += one
    skip = len(excitation.values)
    return numpy.array(errors[skip:], float), numpy.array(commands[skip:], float)


@pytest.fixture(scope="module")
def excitation():
    return measured.multisine(TICK)


@pytest.fixture(scope="module")
def response(excitation):
    print(f"SEED={SEED}")
    return measured.computed(
        excitation, *loop(RESONANT, SLOW, excitation, 2, noise=20, drift=0.3), PERIOD_NM
    )


def test_a_multisine_has_equal_lines_a_small_crest_factor_and_its_peak(excitation):
    spectrum = numpy.abs(excitation.spectrum(excitation.values)[0])
    assert spectrum.std() / spectrum.mean() < 0.01
    rest = numpy.abs(numpy.fft.rfft(excitation.values))
    rest[excitation.lines] = 0
    assert rest.max() * 2 / measured.PERIOD < 0.01 * spectrum.mean()
    assert excitation.crest < 2.1
    assert numpy.abs(excitation.values).max() == round(0.15 * 32767)
    assert excitation.hz[0] == pytest.approx(1, rel=0.03) and excitation.hz[-1] > 790


@pytest.mark.parametrize(
    "wrong, message",
    [
        (dict(low_hz=0.5), "from 0.977 Hz"),
        (dict(low_hz=900), "from 900 to 800 Hz"),
        (dict(high_hz=1900), "the tick rate allows 1800 Hz"),
        (dict(peak="0%"), "above 0 and below 100 %"),
        (dict(peak=1), "above 0 and below 100 %"),
    ],
)
def test_a_multisine_that_cannot_be_is_refused(wrong, message):
    with pytest.raises(tune.NotTuned, match=message):
        measured.multisine(TICK, **wrong)


def test_the_plant_is_measured_within_a_decibel_and_the_loop_with_it(response):
    beyond = 20 * numpy.log10(numpy.abs(response.plant / RESONANT.response(response.hz)))
    assert numpy.abs(beyond[response.hz > 3]).max() < 0.3 and numpy.abs(beyond).max() < 1
    known = RESONANT.response(response.hz) * SLOW.response(response.hz, TICK)
    clear = response.hz > 3
    assert numpy.abs(response.open_loop / known - 1)[clear].max() < 0.05
    assert numpy.abs(response.closed_loop - known / (1 + known))[clear].max() < 0.05
    assert response.clear.all() and response.periods == 2
    assert len(response.csv().splitlines()) == len(response.hz) + 1


def test_one_sample_in_some_ticks_suffices_for_low_frequencies():
    low = measured.multisine(TICK, 1.0, 12.0, "5%")
    assert low.sparse == 64
    rows = [row[:: low.sparse] for row in loop(RESONANT, SLOW, low, 2)]
    found = measured.computed(low, *rows, PERIOD_NM, low.sparse)
    beyond = numpy.abs(found.plant / RESONANT.response(found.hz) - 1)
    assert beyond[1:].max() < 0.02 and beyond[0] < 0.12


def test_a_model_is_fitted_with_its_resonance(response):
    plant = measured_plant.fit(response)
    assert plant.resonance_hz == pytest.approx(550, abs=2)
    assert plant.damping == pytest.approx(0.05, rel=0.05)
    assert plant.time_constant_s == pytest.approx(0.011, rel=0.05)
    assert plant.delay + plant.part == pytest.approx(1.4, abs=0.05) and plant.unexplained < 0.02
    hz = numpy.array([10.0, 100.0, 550.0])
    assert plant.response(hz) == pytest.approx(RESONANT.response(hz), rel=0.02)


def test_a_plant_without_a_resonance_gets_none(excitation):
    response = measured.computed(excitation, *loop(RIGID, SLOW, excitation, 2), PERIOD_NM)
    plant = measured_plant.fit(response)
    assert plant.damping is None and plant.resonance_hz is None
    assert plant.b == pytest.approx(RIGID.b, rel=0.02)


def test_proposals_keep_their_margins_and_a_notch_makes_the_loop_faster(response):
    plant = measured_plant.fit(response)
    found = {one.name: one for one in proposals.of(plant, SLOW)}
    assert list(found) == [proposals.IN_FORCE, proposals.GAINS, proposals.NOTCHED]
    for one in list(found.values())[1:]:
        assert one.stable and one.gain_margin_db >= 6 and one.sensitivity < 2.5
        hz = numpy.geomspace(1, 1900, 20000)
        known = RESONANT.response(hz) * one.tuning.response(hz, TICK)
        at = numpy.flatnonzero(numpy.abs(known) > 1)[-1]
        assert hz[at] == pytest.approx(one.tuning.bandwidth_hz, rel=0.03)
        assert numpy.degrees(numpy.angle(known[at])) + 180 == pytest.approx(50, abs=3)
    speeds = [one.tuning.bandwidth_hz for one in found.values()]
    assert speeds == sorted(speeds) and speeds[2] > 2 * speeds[1]
    assert proposals.best(list(found.values())) is found[proposals.NOTCHED]
    alone = proposals.of(plant, SLOW, has_filters=False)
    assert [one.name for one in alone] == [proposals.IN_FORCE, proposals.GAINS]
    drawn = Image.open(io.BytesIO(proposals.picture(plant, list(found.values()))))
    assert drawn.format == "PNG" and drawn.width > 500


def test_margins_that_nothing_keeps_are_refused(response):
    plant = measured_plant.fit(response)
    with pytest.raises(tune.NotTuned, match="less bandwidth"):
        proposals.of(plant, SLOW, bandwidth_hz=900)
    late = tune.Plant(0.0, 1e5, 9, TICK)
    with pytest.raises(tune.NotTuned, match="smaller phase margin"):
        proposals.of(late, SLOW, margin_degree=79)


def test_what_shows_no_response_is_refused(excitation):
    size = 2 * len(excitation.values)
    still, noise = numpy.zeros(size), numpy.random.default_rng(SEED).standard_normal(size)
    for errors, commands, message in (
        (still, noise, "no motion"),
        (noise, noise[:-1], "whole periods"),
        (noise[:-1], noise[:-1], "whole periods"),
    ):
        with pytest.raises(tune.NotTuned, match=message):
            measured.computed(excitation, errors, commands, PERIOD_NM)
    unclear = measured.computed(excitation, noise, noise[::-1], PERIOD_NM)
    with pytest.raises(measured.NotCoherent, match="use a larger peak"):
        measured_plant.fit(unclear)
    errors, commands = loop(RESONANT, SLOW, excitation, 2)
    with pytest.raises(tune.NotTuned, match="swap"):
        measured_plant.fit(measured.computed(excitation, -errors, commands, PERIOD_NM))
    chaos = measured.computed(excitation, errors, commands, PERIOD_NM)
    turned = measured.Response(
        **{**vars(chaos), "plant": -1j * numpy.exp(1j * numpy.arange(len(chaos.hz)) * 0.9)}
    )
    with pytest.raises(tune.NotTuned, match="not that of a motor"):
        measured_plant.fit(turned)
