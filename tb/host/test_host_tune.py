# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.tune: a plant is identified from its own response, gains hold the margin that they
announce, and records without information are refused.
"""

import dataclasses
import io
import math
import re

import numpy
import pytest
from PIL import Image

from moire.analysis import tune
from tb.control.motion_engine import Axis, Filter

TICK = 1 / 4000


def simulated(plant, command, noise=0.0, friction=0.0, seed=1):
    """Whole LSB at each tick, as a node reports them; shares no code with the code under test."""
    draw = numpy.random.default_rng(seed)
    position = velocity = 0.0
    out = []
    for n in range(len(command)):
        out.append(round(position + noise * draw.standard_normal()))
        velocity = (
            plant.a * velocity
            + plant.b * (command[n - plant.delay] if n >= plant.delay else 0)
            - friction
        )
        position += velocity
    return tune.Record(command, out, TICK)


PLANTS = [
    tune.Plant(math.exp(-TICK / tau), gain * (1 - math.exp(-TICK / tau)), delay, TICK)
    for tau, gain, delay in ((0.02, 0.05, 0), (0.005, 0.3, 1), (0.1, 1.0, 3))
]


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize(
    "kind", [dict(kind="steps"), dict(kind="chirp", tick_s=TICK, low_hz=1, high_hz=800)]
)
def test_a_plant_is_identified_from_its_record(plant, kind):
    found = tune.identify(
        simulated(plant, tune.excitation(3000, 8000, **kind), noise=0.3, friction=0.5)
    )
    assert found.delay == plant.delay
    assert found.b == pytest.approx(plant.b, rel=0.05) and found.time_constant_s == pytest.approx(
        plant.time_constant_s, rel=0.15
    )
    assert found.resonance_hz is None


def sampled(time_constant_s, gain, delay_s, noise=0.0, seed=1, count=128):
    """Times, commands and positions of a continuous plant, sampled unevenly.

    It is computed in small steps, and shares no code with the code under test.
    """
    draw, step = numpy.random.default_rng(seed), 5e-6
    lengths = numpy.round((0.002 + 0.0008 * draw.random(count)) / step).astype(int)
    commands = numpy.repeat(numpy.where(draw.random(count // 4 + 1) < 0.5, 6000, -6000), 4)[:count]
    given = numpy.concatenate(
        [numpy.zeros(round(delay_s / step)), numpy.repeat(commands, lengths)]
    )[: lengths.sum()]
    position = velocity = 0.0
    track = []
    for command in given:
        track.append(position)
        velocity += (gain * command - velocity) * step / time_constant_s
        position += velocity * step
    at = numpy.concatenate([[0], numpy.cumsum(lengths)[:-1]])
    return (
        at * step,
        commands,
        numpy.round(numpy.array(track)[at] + noise * draw.standard_normal(count)),
    )


@pytest.mark.parametrize(
    "time_constant_s, gain, delay_s",
    [(0.008, 50.0, 0.0), (0.008, 5.0, 0.0005), (0.03, 200.0, 0.001)],
)
def test_a_plant_is_identified_from_few_uneven_samples(time_constant_s, gain, delay_s):
    plant = tune.identify_samples(*sampled(time_constant_s, gain, delay_s, noise=1.0), TICK)
    assert plant.time_constant_s == pytest.approx(time_constant_s, rel=0.05)
    assert plant.gain == pytest.approx(
        gain * TICK, rel=0.05
    ) and plant.delay * TICK == pytest.approx(delay_s, abs=1.01 * TICK)
    assert plant.unexplained < 0.05


@pytest.mark.parametrize(
    "change, message",
    [
        (dict(count=20), "20 samples are too few"),
        (dict(noise=1e4), "too noisy"),
        (dict(gain=0.0), "no motion"),
        (dict(gain=-50.0), "moves the axis down"),
    ],
)
def test_samples_without_information_are_refused(change, message):
    with pytest.raises(tune.NotTuned, match=message):
        tune.identify_samples(
            *sampled(**{**dict(time_constant_s=0.008, gain=50.0, delay_s=0.0), **change}), TICK
        )


def test_a_gain_matches_a_calculation_by_hand():
    plant = tune.Plant(0.9, 0.5, 0, TICK)
    assert plant.gain == pytest.approx(5.0)
    assert plant.time_constant_s == pytest.approx(TICK / 0.10536, rel=1e-4)
    tuning = tune.propose(plant, 40)
    assert (tuning.kv, tuning.ka) == (round(0.2 * 65536), 2 * 256)  # u = v / 5 + acceleration * 2


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("bandwidth_hz, margin", [(20, 60), (60, 45)])
def test_gains_hold_bandwidth_and_margin(plant, bandwidth_hz, margin):
    tuning = tune.propose(plant, bandwidth_hz, margin)
    assert tuning.bandwidth_hz == pytest.approx(bandwidth_hz, rel=0.02)
    assert tuning.phase_margin_degree >= margin - 1.5 and tuning.gain_margin > 1.5
    assert abs(tune.open_loop(plant, tuning, bandwidth_hz)) == pytest.approx(1, rel=0.02)
    target, position = tune.step(plant, tuning, ticks=8000)
    assert (
        position.max() < 1.6 * target[0]
        and abs(position[-400:] - target[-1]).max() < 0.02 * target[-1]
    )


def test_the_servo_itself_comes_to_rest_with_these_gains():
    """With the model of motion_engine, which equals the RTL, around the plant."""
    plant = PLANTS[1]
    tuning = tune.propose(plant, 60, filters=[tune.notch(700, TICK), tune.low_pass(900, TICK)])
    axis = Axis(filters=2)
    axis.settings |= dict(
        kp=tuning.kp,
        ki=tuning.ki,
        kd=tuning.kd,
        kv=tuning.kv,
        ka=tuning.ka << 8,
        output_limit=32767 << 16,
        integral_limit=32767 << 24,
    )
    for section, values in zip(axis.filters, tuning.filters, strict=True):
        section.coefficients, section.in_use = [value << 2 for value in values], 1
    position, velocity, queue = 0.0, 0.0, [0] * plant.delay
    reached = []
    for n in range(700):
        axis.target = 2000 if n > 4 else 0
        axis.tick(round(position), 1000)
        queue.append(axis.command)
        velocity = plant.a * velocity + plant.b * queue.pop(0)
        position += velocity
        reached.append(position)
    assert max(reached) < 3200 and all(abs(p - 2000) < 8 for p in reached[-100:]), reached[-5:]


def test_a_resonance_is_found_and_notched():
    command = tune.excitation(6000, 12000, kind="chirp", tick_s=TICK, low_hz=20, high_hz=1500)
    plant = PLANTS[1]
    w, damping = 2 * math.pi * 500 * TICK, 0.01
    c1, c2 = 2 * math.exp(-damping * w) * math.cos(w), -math.exp(-2 * damping * w)
    rigid, y1, y2, out = simulated(plant, command).position, 0.0, 0.0, []
    for x in rigid:
        y1, y2 = (1 - c1 - c2) * x + c1 * y1 + c2 * y2, y1
        out.append(round(y1))
    found = tune.identify(tune.Record(command, out, TICK))
    assert found.resonance_hz == pytest.approx(500, abs=20)
    tuning = tune.propose(found, 30)
    assert abs(tune.filter_response(tuning.filters[0], found.resonance_hz, TICK)) < 1e-3


@pytest.mark.parametrize("make", [tune.low_pass, tune.notch])
def test_filters_pass_a_constant_exactly_in_the_block(make):
    values = make(300, TICK)
    assert sum(values) == tune.COEFFICIENT and all(-1 << 31 <= v < 1 << 31 for v in values)
    section = Filter()
    section.coefficients, section.in_use = [value << 2 for value in values], 1
    for n in range(80):
        y = section.sample(1000 if n > 3 else 0, passing=0)
    assert abs(y - 1000) <= 1


@pytest.mark.parametrize(
    "record, word",
    [
        (tune.Record([5] * 100, [0] * 100, TICK), "too few"),
        (tune.Record([5] * 300, [0] * 299, TICK), "one of each"),
        (tune.Record([5] * 300, list(range(300)), TICK), "did not change"),
        (tune.Record([5, -5] * 200, [7] * 400, TICK), "no motion"),
        (tune.Record([32767, -32768] * 200, [0, 500] * 200, TICK), "full scale"),
        (tune.Record([5, -5] * 200, [0, math.nan] * 200, TICK), "no numbers"),
        (simulated(PLANTS[0], tune.excitation(1000, 50), noise=400), "too noisy"),
        (simulated(tune.Plant(0.95, -0.01, 0, TICK), tune.excitation(1000, 8000)), "swap"),
    ],
)
def test_a_record_without_information_is_refused(record, word):
    with pytest.raises(tune.NotTuned, match=word):
        tune.identify(record)


def test_requirements_that_no_gains_meet_are_refused():
    for plant, bandwidth, margin, word in (
        (PLANTS[2], 600, 60, "less bandwidth"),
        (PLANTS[0], 0, 50, "quarter"),
        (PLANTS[0], 2000, 50, "quarter"),
        (PLANTS[0], 20, 90, "from 20 to 80"),
        (tune.Plant(0.9, 1e-6, 0, TICK), 50, 50, "too little"),
        (tune.Plant(0.9, 1e4, 0, TICK), 5, 50, "too much"),
    ):
        with pytest.raises(tune.NotTuned, match=word):
            tune.propose(plant, bandwidth, margin)
    for arguments in (
        dict(ticks=100, amplitude=5),
        dict(ticks=1000, amplitude=0),
        dict(ticks=1000, amplitude=40000),
        dict(ticks=1000, amplitude=5, kind="noise"),
        dict(ticks=1000, amplitude=5, kind="chirp"),
    ):
        with pytest.raises(tune.NotTuned):
            tune.excitation(**arguments)
    for frequency in (0, 2000):
        with pytest.raises(tune.NotTuned):
            tune.low_pass(frequency, TICK)


def test_steps_leave_the_axis_where_it_is_and_a_seed_repeats_them():
    steps = tune.excitation(2000, 700)
    assert (
        set(steps) == {700, -700}
        and abs(steps.sum()) <= 32 * 700
        and (steps == tune.excitation(2000, 700)).all()
    )
    assert (steps != tune.excitation(2000, 700, seed=2)).any()


def test_the_picture_is_a_png():
    plant = PLANTS[0]
    image = Image.open(io.BytesIO(tune.picture(plant, tune.propose(plant, 30))))
    assert image.format == "PNG" and image.size[0] > 400


# ------------------------------------------------------------------ gains that an axis has


def test_gains_that_were_proposed_pass_the_check_with_the_same_margins():
    for plant in PLANTS:
        tuning = tune.propose(plant, 30)
        assert tune.check(plant, tuning) == tuning


@pytest.mark.parametrize(
    "change, name",
    [(dict(ki=60), "ki"), (dict(kp=40), "kp"), (dict(kd=60), "kd")],
)
def test_one_gain_that_is_too_large_is_named_with_a_value_that_fits(change, name):
    plant = PLANTS[1]
    fitting = tune.propose(plant, 60)
    assert tune.check(plant, fitting)
    scaled = {gain: getattr(fitting, gain) * factor for gain, factor in change.items()}
    with pytest.raises(tune.Unsuitable) as caught:
        tune.check(plant, dataclasses.replace(fitting, **scaled))
    found, value = re.findall(r"set (k[pid]) to (\S+) at most", str(caught.value))[0]
    assert found == name
    counts = round(float(value) * (1 << tune.SCALES[name]))
    tune.check(plant, dataclasses.replace(fitting, **{**scaled, name: counts}))


def test_a_servo_without_gains_is_refused():
    silent = dataclasses.replace(tune.propose(PLANTS[0], 30), kp=0, ki=0, kd=0)
    with pytest.raises(tune.Unsuitable, match="set kp, which is 0"):
        tune.check(PLANTS[0], silent)
