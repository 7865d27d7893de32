# SPDX-License-Identifier: Apache-2.0
"""A node whose axes differ: a stepper with a scale, an axis that only measures, and the sine axis
of S0 with its servo and its bridge.
"""

import random

import numpy
import pytest

from experiments.s2_stage import SCALES
from moire.analysis.tick_scope import TickScope, Trigger
from moire.client.bus import Bus
from moire.errors import Refused
from tb.bench import seed
from twin import Axis, Node, Twin, TwinTransport

STEPPER, COUNTER, SERVO = range(3)
SCALE = SCALES["Z"]
CLK_HZ = 6_200_000  # the motion engine needs 1528 cycles a tick for three axes with filters
NODE = {  # bit n: axis n
    "HAS_SINE": 1 << SERVO,
    "HAS_DRIVE": 1 << STEPPER | 1 << SERVO,
    "HAS_STEPPER": 1 << STEPPER,
    "HAS_BRIDGE": 1 << SERVO,
    "HAS_DAC": 0,
    "HAS_CAPTURE": 1 << COUNTER,
    "HAS_COMPARE": 1 << COUNTER,
    "HAS_ENCODER_CHECK": 1 << COUNTER,
    "HAS_FILTERS": 1 << SERVO,
    "SCOPE_WORDS": 1024,
}
BUILT = (
    {"velocity", "drive", "stepper"},
    {"velocity", "capture", "compare", "encoder_check"},
    {"sine", "monitor", "harmonics", "recorder", "velocity", "drive", "bridge", "filters"},
)


@pytest.fixture(scope="module")
def axes():
    with Twin(
        [Node(1, [SCALE.machine(), Axis("unconnected"), Axis()])],
        clk_hz=CLK_HZ,
        seed=seed() % 1000,
        node_parameters=NODE,
    ) as twin:
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed()))
        twin.run_until_ready()
        made = [bus.axis(1, number) for number in range(3)]
        for name, value in SCALE.settings().items():
            made[STEPPER].set_parameter(name, value)
        yield made


def test_each_axis_reports_what_it_was_built_with(axes):
    assert [set(axis.built().names) for axis in axes] == list(BUILT)


def test_both_drives_home_and_move_in_one_node(axes):
    stepper, servo = axes[STEPPER], axes[SERVO]
    for axis in (stepper, servo):
        axis.enable()
        axis.request("home")
    for axis in (stepper, servo):
        assert axis.wait().homed, "the index is captured without a queue"
    # one recording has signals of all axes, each sample of one tick
    scope = TickScope(servo)
    began = Trigger("beyond", "target_velocity", "0.1mm/s", earlier=20)
    signals = ["target", "target_velocity", "integral"]
    for axis in (STEPPER, COUNTER):
        signals += [f"{axis}.target", f"{axis}.target_velocity"]
    scope.start(signals, 100, trigger=began)
    stepper.begin_move("2mm")
    ended = servo.move("50um")
    assert ended.ended == "ok" and abs(ended.target_nm - ended.position_nm) < 1000
    ended = stepper.wait()
    assert ended.ended == "ok" and abs(ended.target_nm - ended.position_nm) < 1000
    values = scope.read().values
    for axis in ("", f"{STEPPER}.", f"{COUNTER}."):
        target, speed = values[f"{axis}target"], values[f"{axis}target_velocity"]
        assert numpy.abs(numpy.diff(target) - speed[1:]).max() <= 2
        assert (numpy.count_nonzero(speed) > 30) == (axis != f"{COUNTER}.")
    speed = numpy.abs(values["target_velocity"])
    assert speed[19] < began.counts(servo.period_nm, scope.tick_hz) <= speed[20]
    assert numpy.ptp(values["integral"]) > 0
    assert len({values[f"{axis}target"][50] for axis in ("", f"{STEPPER}.", f"{COUNTER}.")}) == 3
    axes[COUNTER].status()
    for axis in (stepper, servo):
        axis.disable()


def test_an_axis_without_a_drive_refuses_motion_and_measures(axes):
    counter = axes[COUNTER]
    for refused in (counter.enable, counter.home, lambda: counter.set_parameter("kp", 1)):
        with pytest.raises(Refused, match=r"it needs HAS_DRIVE of rtl/node\.sv"):
            refused()
    counter.disable()
    counter.capture_from("software")
    counter.capture_now()
    assert len(counter.captures()[0]) == 1
    assert not counter.status().enabled and not counter.status().faults


def test_what_an_axis_lacks_is_refused_with_its_parameter(axes):
    for axis, name, value, parameter in (
        (axes[STEPPER], "position_source", 0, "HAS_SINE"),
        (axes[STEPPER], "filters", 1, "FILTERS"),
        (axes[SERVO], "drive", "steps", "HAS_STEPPER"),
        (axes[SERVO], "steps_per_period", 4, "HAS_STEPPER"),
        (axes[SERVO], "segments", "linear", "SEGMENTS"),
    ):
        with pytest.raises(Refused, match=f"it needs {parameter} of"):
            axis.set_parameter(name, value)
    for axis in (axes[STEPPER], axes[SERVO]):
        with pytest.raises(Refused, match="it needs HAS_CAPTURE of"):
            axis.capture_now()
        with pytest.raises(Refused, match="it needs HAS_COMPARE of"):
            axis.compare_off()


def test_a_touch_probe_over_a_surface_is_seen_by_an_axis_that_captures(axes):
    node = axes[STEPPER].node
    twin = node.bus.transport.twin
    slopes, here_m = (1.0, 0.0, 0.0), twin.truth(STEPPER).position_m
    for height_m, touches in ((1e-6, 0), (-1e-6, 1)):
        twin.fit_probe(slopes, here_m - height_m)
        twin.run(1e-4)
        levels = [node.read_named("axis.state", axis)["probe"] for axis in range(3)]
        assert levels == [0, touches, 0]
    with pytest.raises(ValueError, match="2 slopes for a node of 3 axes"):
        twin.fit_probe(slopes[:2], 0.0)
