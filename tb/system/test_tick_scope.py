# SPDX-License-Identifier: Apache-2.0
"""Recorder of ticks and excitation of a node: RTL and firmware, S0's stage, the host package. The
figure frf_error_db compares the frequency response with the true one.
"""

import numpy
import pytest

from moire.analysis import frequency_response
from moire.analysis.tick_scope import TickScope
from moire.analysis.tune import NotTuned
from moire.client.bus import Bus
from tb.bench import seed
from twin import WITH_SCOPE, Twin, TwinTransport

SEED = seed()
HERE = 37  # home_method: the zero is where the axis stands
ALL = ("sine_cosine", "target", "target_velocity", "velocity", "error", "command")


@pytest.fixture(scope="module")
def axis():
    print(f"SEED={SEED}")
    twin = Twin(nodes=(1,), seed=SEED, node_parameters=WITH_SCOPE)
    twin.run_until_ready()
    made = Bus(TwinTransport(twin)).axis(1)
    made.set_parameter("home_method", HERE)
    made.enable()
    return made


def test_before_homing_the_response_is_not_measured(axis):
    with pytest.raises(NotTuned, match="home it first"):
        frequency_response.measure(axis)


def test_a_move_is_recorded_at_each_tick_with_every_signal(axis):
    axis.home()
    scope = TickScope(axis)
    scope.start(ALL, 300)
    status = axis.move("20um")
    values = scope.read().values
    assert {len(signal) for signal in values.values()} == {300}
    # the target moves by its velocity at every tick; the first time it begins at the position
    beyond = numpy.abs(numpy.diff(values["target"]) - values["target_velocity"][1:]) > 2
    assert beyond.sum() <= 1 and numpy.count_nonzero(values["target_velocity"]) > 100
    assert values["target"][-1] > values["target"][0]
    assert values["position"][-1] == values["target"][-1] - values["error"][-1]
    assert numpy.abs(values["velocity"]).max() > 0 and numpy.abs(values["command"]).max() > 0
    assert numpy.hypot(values["sine"], values["cosine"]).min() > 60, "ADC counts"
    assert status.ended == "ok"


def test_an_excitation_adds_its_waveform_from_its_first_value_on(axis):
    scope = TickScope(axis)
    pulses = numpy.zeros(64, int)
    pulses[[0, 1]] = 3000, -3000
    scope.load(pulses)
    with scope.excited(64):
        scope.start(("command",), 64 * 4)
        axis.dwell(0.15)
    command = scope.read().values["command"].reshape(4, 64)
    other = numpy.median(command[:, 2:], axis=1, keepdims=True)
    assert numpy.all(command[:, :1] - other > 2000), "value 0 is in the first sample"
    assert numpy.all(command[:, 1:2] - other < -2000)
    scope.start(("command",), 64)
    axis.dwell(0.05)
    assert numpy.ptp(scope.read().values["command"]) < 1000, "the excitation has ended"


def test_a_peak_without_room_is_refused_and_nothing_moves(axis):
    before = axis.status().position_nm
    with pytest.raises(NotTuned, match="more than half of the output_limit"):
        frequency_response.measure(axis, "90%")
    assert axis.status().position_nm == pytest.approx(before, abs=50)
