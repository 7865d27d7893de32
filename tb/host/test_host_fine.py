# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.fine: a flexure is identified from its steps, the loop that is computed with it is
the one that a simulation shows, and gains that do not fit are refused with what to change.
moire.analysis.fine_steps and the commands `moire fine`: the requests, and what they print.
"""

import io
import math
import re
from functools import cache
from pathlib import Path

import numpy
import pytest
from PIL import Image

from moire.analysis import fine, fine_steps
from moire.analysis.tune import NotTuned
from moire.client.bus import Bus
from moire.errors import OutOfRange
from tb.bench import ROOT, seed
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.call import Call, sentence
from twin.compiled.tables import FAULT, PERIOD

SEED = seed()
TICK = 1 / 4000
CLK_HZ = 2.4e6
STEP = 1e-5  # of the simulations, s
GAIN = 12.5  # LSB of position per LSB of the DAC: S0
DELAY_S = 80e-6
S0 = fine.Gains(0, 20_000, 0)  # what s0_fine sets, for 500 Hz and an amplification of 25
DAMPED = fine.Gains(360, 126_500, 6540)  # those of docs/control.md for 250 Hz
SIZE = 262.0


def motion(command, resonance_hz, damping, second=None):
    """The positions of a flexure at each STEP; shares no code with the code under test. `second`
    is (frequency, damping, share) of another mode.
    """

    def mode(hz, share, damping):
        natural, x, v, out = 2 * math.pi * hz, 0.0, 0.0, []
        for value in command:
            out.append(share * x)
            v += STEP * (natural**2 * (value - x) - 2 * damping * natural * v)
            x += STEP * v
        return numpy.array(out)

    share = second[2] if second else 0.0
    first = mode(resonance_hz, 1 - share, damping)
    return first + mode(second[0], share, second[1]) if second else first


@cache
def measured(resonance_hz=500.0, damping=0.02, noise=40.0, gain=GAIN, second=None, rows=6):
    """The steps of a flexure as fine_steps.measure() returns them."""
    draw = numpy.random.default_rng(SEED)
    samples, every = fine_steps.PHASES, round(1e-4 / STEP)
    time = numpy.arange(samples * every) * STEP
    rise = motion((time >= DELAY_S) * 1.0, resonance_hz, damping, second)[::every]
    creep = 0.015 * numpy.log10(1 + numpy.maximum(time[::every] - DELAY_S, 0) / 0.01)
    positions = gain * SIZE * (rise + creep) + noise * draw.standard_normal((rows, samples))
    return fine_steps.Steps(
        numpy.round(positions), 1e-4, SIZE, TICK, fine_steps.LOOP_CYCLES / CLK_HZ
    )


@cache
def plant_of(*values, **more):
    return fine.identify(measured(*values, **more))


@pytest.fixture(scope="module")
def soft():
    """A flexure that S0's gains do not fit: 300 Hz with 1 % damping."""
    print(f"SEED={SEED}")
    return plant_of(300.0, 0.01)


@pytest.fixture(scope="module")
def stiff():
    print(f"SEED={SEED}")
    return plant_of(500.0, 0.02)


# identification


@pytest.mark.parametrize(
    "hz, damping", [(250.0, 0.01), (500.0, 0.02), (800.0, 0.005), (400.0, 0.3)]
)
def test_resonance_damping_gain_and_delay_are_identified(hz, damping):
    plant = plant_of(hz, damping)
    assert plant.model.resonance_hz == pytest.approx(hz, rel=0.005)
    assert plant.model.damping == pytest.approx(damping, rel=0.03)
    assert plant.model.gain == pytest.approx(GAIN * 1.02, rel=0.02), "with the creep of 0.2 s"
    assert plant.model.delay_s == pytest.approx(DELAY_S, abs=1e-5)
    assert plant.delay_s == plant.model.delay_s + fine_steps.LOOP_CYCLES / CLK_HZ
    assert plant.unexplained < 0.02


def test_the_points_are_the_true_response_within_a_decibel_to_600_hz():
    plant = plant_of(400.0, 0.02, noise=20.0)
    hz = numpy.linspace(20, 600, 200)
    points, _ = plant.points.at(hz)
    ratio = hz / 400.0
    true = GAIN / (1 - ratio**2 + 2j * 0.02 * ratio)
    assert abs(20 * numpy.log10(abs(plant.response(hz) / true))).max() < 1
    assert abs(20 * numpy.log10(abs(points / true)))[hz < 450].max() < 1


def test_a_second_resonance_counts_although_the_model_has_one():
    one, two = (plant_of(400.0, 0.1, second=mode) for mode in (None, (700.0, 0.004, 0.15)))
    assert two.unexplained > 2 * one.unexplained
    gains = fine.Gains(0, 80_000, 0)
    assert fine.loop(one, gains).good
    found = fine.loop(two, gains)
    assert not found.good and found.worst_hz == pytest.approx(700, rel=0.02)


@pytest.mark.parametrize(
    "change, message",
    [
        (dict(gain=0.0, noise=0.5), "no motion"),
        (dict(noise=4000.0), "not that of a fine stage"),
        (dict(gain=-GAIN), "down: swap the leads of the piezo"),
    ],
)
def test_steps_that_show_no_fine_stage_are_refused(change, message):
    with pytest.raises(NotTuned, match=message):
        plant_of(500.0, 0.02, **change)


# the loop


def rings(resonance_hz, damping, gains, ticks=2400):
    """Whether the loop of this flexure oscillates, in a simulation of the loop of pid_loop."""
    per_tick, late = round(TICK / STEP), round((DELAY_S + fine_steps.LOOP_CYCLES / CLK_HZ) / STEP)
    natural, x, v, total, last, command = 2 * math.pi * resonance_hz, 0.0, 0.0, 0.0, 0.0, 0.0
    errors = []
    kp, ki, kd = (gains.real(name) for name in fine.NAMES)
    for tick in range(ticks):
        error = 1000.0 - GAIN * x
        total += ki * error
        new = total + kp * error + (kd * (error - last) if tick else 0.0)
        last = error
        errors.append(abs(error))
        for part in range(per_tick):
            if part == late:
                command = new
            v += STEP * (natural**2 * (command - x) - 2 * damping * natural * v)
            x += STEP * v
        if error > 1e9:
            return True
    return max(errors[-200:]) > 0.5 * max(errors[:400])


@pytest.mark.parametrize(
    "hz, damping",
    [(300.0, 0.01), (500.0, 0.02), (250.0, 0.01)],
)
def test_stable_loops_come_to_rest_in_a_simulation_and_others_oscillate(hz, damping):
    plant = plant_of(hz, damping)
    for gains in (
        S0,
        DAMPED,
        fine.scaled(DAMPED, 0.4),
        fine.propose(plant),
        fine.scaled(fine.propose(plant), 4.0),
    ):
        assert fine.loop(plant, gains).stable != rings(hz, damping, gains), gains


def test_the_margins_of_an_integrator_are_those_of_the_rule_in_the_docs(stiff):
    found = fine.loop(stiff, S0)
    crossover = S0.real("fine_ki") * GAIN / TICK / (2 * math.pi)
    assert found.crossover_hz == pytest.approx(crossover, rel=0.05)
    assert found.gain_margin == pytest.approx(500 / crossover / 25, rel=0.15)
    assert found.phase_margin_degree == pytest.approx(90, abs=3)
    assert found.good


# proposals and refusals


@pytest.mark.parametrize(
    "hz, damping", [(250.0, 0.01), (300.0, 0.01), (500.0, 0.02), (800.0, 0.005)]
)
def test_what_is_proposed_passes_the_check(hz, damping):
    plant = plant_of(hz, damping)
    gains = fine.propose(plant)
    assert gains.fine_kp == gains.fine_kd == 0 < gains.fine_ki
    assert fine.check(plant, gains).sensitivity <= fine.PROPOSED_SENSITIVITY
    assert not rings(hz, damping, gains)


def test_a_derivative_makes_the_integral_several_times_as_large():
    plant = plant_of(250.0, 0.01)
    gains, plain = fine.propose(plant, damping=True), fine.propose(plant)
    assert gains.fine_kd > 0 and gains.fine_ki > 10 * plain.fine_ki
    assert gains.fine_ki == pytest.approx(DAMPED.fine_ki, rel=0.1), "as docs/control.md computes"
    assert gains.fine_kd == pytest.approx(DAMPED.fine_kd, rel=0.1)
    assert not rings(250.0, 0.01, gains)


@pytest.mark.parametrize("hz, damping, times", [(300.0, 0.01, 9.0), (500.0, 0.02, 1.5)])
def test_a_derivative_helps_less_at_a_higher_resonance(hz, damping, times):
    plant = plant_of(hz, damping)
    ratio = fine.propose(plant, damping=True).fine_ki / fine.propose(plant).fine_ki
    assert ratio == pytest.approx(times, rel=0.15)


def test_a_resonance_too_fast_for_the_delay_is_not_damped():
    with pytest.raises(NotTuned, match="does not damp this resonance: at 800 Hz the delay of 0.1"):
        fine.propose(plant_of(800.0, 0.005), damping=True)


def test_gains_set_for_500_hz_are_refused_at_300_hz_and_the_value_that_is_named_fits(stiff, soft):
    fine.check(stiff, S0)
    with pytest.raises(fine.Unsuitable) as caught:
        fine.check(soft, S0)
    sentence = str(caught.value)
    assert "oscillates at 299 Hz" in sentence or "oscillates at 300 Hz" in sentence
    assert "amplifies 4" in sentence and "resonance of 300 Hz" in sentence
    (ki,) = re.findall(r"set fine_ki to (\S+) at most", sentence)
    fitting = fine.Gains.of({"fine_kp": 0.0, "fine_ki": float(ki), "fine_kd": 0.0})
    assert fine.check(soft, fitting).good and S0.fine_ki / 4 < fitting.fine_ki < S0.fine_ki


def test_a_stable_loop_with_too_little_margin_is_refused_too(soft):
    most = fine.first_good(soft, lambda share: fine.scaled(S0, share), limit=1e6)
    assert fine.loop(soft, most).stable
    with pytest.raises(fine.Unsuitable, match="amplifies disturbances of 29. Hz .* set fine_ki to"):
        fine.check(soft, most)


def test_where_no_gain_alone_helps_all_three_are_named(stiff):
    with pytest.raises(fine.Unsuitable) as caught:
        fine.check(stiff, DAMPED)
    named = dict(re.findall(r"(fine_k[pid]) to ([0-9.e-]+[0-9])", str(caught.value)))
    assert list(named) == list(fine.NAMES)
    assert fine.check(stiff, fine.Gains.of({name: float(named[name]) for name in named})).good


def test_no_gains_at_all_are_a_quiet_loop(stiff):
    found = fine.check(stiff, fine.Gains(0, 0, 0))
    assert found.sensitivity == 1 and found.crossover_hz == 0


def test_the_picture_has_the_curves(soft):
    image = Image.open(io.BytesIO(fine.picture(soft, fine.propose(soft))))
    assert image.size[0] > 600
    assert numpy.unique(numpy.asarray(image.convert("L"))).size > 50


# the recording


def test_the_cycles_of_the_loop_are_those_of_its_header():
    header = Path(ROOT, "rtl", "drive", "pid_loop.sv").read_text()
    (cycles,) = re.findall(r"latency\s+(\d+) cycles from tick to valid", header)
    assert int(cycles) == fine_steps.LOOP_CYCLES


def test_positions_are_the_phases_in_order_across_the_end_of_a_period():
    phases = [65000, 65500, 464, 1000, 300, 65100]
    words = [first | second << 16 for first, second in zip(phases[::2], phases[1::2])]
    assert list(fine_steps.positions_of(words)) == [0, 500, 1000, 1536, 836, 100]


SHORT = 56  # phases of a record that a test reads over the bus


class Stepped(BusNode):
    """A node whose recorder has these positions after the steps up, and their negatives after the
    steps down; the first step is down, and only goes to where the others begin.
    """

    def __init__(self, positions):
        super().__init__()
        self.rows = iter([numpy.zeros(SHORT), *positions])
        self.set_actuator(FINE_COMMAND=0)
        self.feedback_channels[0].burst = self.burst

    def burst(self, phases, every):
        assert phases and every == 10, "10 kHz of 100 kHz"
        recorded = len(self.feedback_channels[0].records)
        counts = next(self.rows).astype(numpy.int64) * (1 if recorded % 2 == 0 else -1) % PERIOD
        return [int(a) | int(b) << 16 for a, b in zip(counts[::2], counts[1::2])]


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(fine_steps, "PHASES", SHORT)
    monkeypatch.setattr(fine_steps, "PATIENCE_S", 0.2)


def axis_of(node):
    axis = Bus(Rs485Bus(node)).axis()
    axis.enable()
    return axis


def test_measured_steps_come_from_the_node(short):
    expected = measured(rows=4).positions[:, :SHORT]
    node = Stepped(expected)
    steps = fine_steps.measure(axis_of(node), count=4)
    asked = node.written("step_fine")
    assert [fields["offset"] for fields in asked] == [-131, 131, -131, 131, -131]
    assert {fields["every"] for fields in asked} == {10}
    assert numpy.array_equal(steps.positions, expected - expected[:, :1])
    assert steps.size == 262 and steps.interval_s == pytest.approx(1e-4)
    assert steps.tick_s == TICK and steps.compute_s == pytest.approx(134 / 4e6)
    assert node.state() == "holding", "the open loop ends"


@pytest.mark.parametrize(
    "wrong, message",
    [
        (dict(amplitude="91%"), "from 0.003 % to 90.8 %, which dac_trim leaves"),
        (dict(amplitude=0), "amplitude of"),
        (dict(count=2), "2 steps: from 3"),
    ],
)
def test_wrong_settings_are_not_sent(wrong, message):
    node = BusNode()
    node.force("dac_trim", -3000)
    with pytest.raises(OutOfRange, match=message):
        fine_steps.measure(axis_of(node), **wrong)
    assert "step_fine" not in node.executed


@pytest.mark.parametrize("absent", ["fine_stage", "recorder"])
def test_what_is_not_built_is_named_before_the_loops_open(absent):
    node = BusNode(absent=(absent,))
    with pytest.raises(fine_steps.NotMeasured, match=f"needs HAS_{absent.upper()} of rtl/node.sv"):
        fine_steps.measure(axis_of(node))
    assert "step_fine" not in node.executed


def test_a_dac_that_is_the_drive_has_no_fine_stage():
    node = BusNode()
    node.force("drive", 2)
    with pytest.raises(fine_steps.NotMeasured, match="the DAC is the drive"):
        fine_steps.measure(axis_of(node))
    assert "step_fine" not in node.executed


def test_a_disturbed_signal_is_one_sentence(short):
    node = Stepped([])
    node.feedback_channels[0].spoiled = True
    with pytest.raises(fine_steps.NotMeasured, match="sine and cosine were disturbed"):
        fine_steps.measure(axis_of(node))
    assert node.state() == "holding"


def test_a_record_that_never_ends_is_one_sentence(short):
    node = Stepped([])
    node.feedback_channels[0].delay = 10**9
    with pytest.raises(fine_steps.NotMeasured, match="was not recorded, within 0.2 s"):
        fine_steps.measure(axis_of(node))
    assert node.state() == "holding"


def test_a_fault_in_open_loop_is_named(short):
    node = Stepped([])
    axis = axis_of(node)
    axis.request("step_fine", offset=1, every=10)
    node.axes[0].causes = FAULT["estop"]
    node.run(5)
    with pytest.raises(fine_steps.NotMeasured, match="ended early: emergency stop"):
        fine_steps.read(axis)


# the commands


@pytest.fixture
def flexure(monkeypatch):
    """A function that gives the fine stage of every axis this flexure."""

    def fit(steps):
        monkeypatch.setattr(fine_steps, "measure", lambda axis, amplitude, count: steps)

    return fit


def node_with(gains):
    node = BusNode()
    for name in fine.NAMES:
        node.force(name, gains.counts(name))
    return node


def test_fine_check_refuses_unsuitable_gains_and_draws_them_first(flexure, tmp_path):
    flexure(measured(300.0, 0.01))
    node, picture = node_with(S0), tmp_path / "fine.png"
    call = Call(["fine", "check", "--picture", str(picture)], node)
    assert "set fine_ki to 0.0004" in sentence(call, 1)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert node.parameter("fine_ki") == S0.fine_ki, "a check changes nothing"


def test_fine_check_reports_gains_that_fit(flexure):
    flexure(measured())
    call = Call("fine check", node_with(S0))
    assert call.code == 0, call.err
    assert "resonance at 500 Hz" in call.out and "gains: in force" in call.out


@pytest.mark.parametrize("write", [False, True])
def test_fine_tune_writes_what_it_proposes_only_when_asked(flexure, write):
    flexure(measured(300.0, 0.01))
    node = node_with(DAMPED)
    call = Call(["fine", "tune", "--json", *(["--write"] if write else [])], node)
    assert call.code == 0, call.err
    (result,) = call.results
    assert result["written"] is write and result["action"] == "tune"
    assert result["resonance_hz"] == pytest.approx(300, rel=0.01)
    proposed = fine.Gains.of(result["gains"])
    assert 0 < proposed.fine_ki < S0.fine_ki and proposed.fine_kd == 0
    for name in fine.NAMES:
        assert node.parameter(name) == (proposed if write else DAMPED).counts(name)


def test_fine_tune_damped_is_refused_where_the_delay_is_too_long(flexure):
    flexure(measured(800.0, 0.005))
    node = node_with(fine.Gains(0, 0, 0))
    call = Call("fine tune --damped --write", node)
    assert "does not damp this resonance" in sentence(call, 1)
    assert node.parameter("fine_ki") == node.parameter("fine_kd") == 0
