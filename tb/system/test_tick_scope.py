# SPDX-License-Identifier: Apache-2.0
"""Recorder of ticks and excitation of a node: RTL and firmware, S0's stage, the host package, also
through a server whose machine runs much faster than its clients. The figure frf_error_db compares
the frequency response with the true one.
"""

import numpy
import pytest

from moire.analysis import measured_plant, response_measurement
from moire.analysis.tick_scope import SIGNALS, TickScope, Trigger
from moire.analysis.tune import NotTuned
from moire.bus.transport import open_bus
from moire.client.bus import Bus
from moire.errors import MotionFailed, OutOfRange
from tb.bench import seed
from tb.fakes.served import ServedTransport
from twin import WITH_SCOPE, Twin, TwinTransport

SEED = seed()
HERE = 37  # home_method: the zero is where the axis stands
SHORT = dict(low_hz=16.0, high_hz=400.0, records=1)  # of a measurement, with periods of 1024 ticks


class Hurried(ServedTransport):
    """A server whose machine goes on by 10 ms between two looks at its clients, in work or not."""

    def run(self):
        while not self.ending:
            self.far.wait(0.01)
            self.gateway.poll(0)
        self.gateway.close()


@pytest.fixture(scope="module")
def transport():
    print(f"SEED={SEED}")
    twin = Twin(nodes=(1,), seed=SEED, node_parameters=WITH_SCOPE)
    twin.run_until_ready()
    return TwinTransport(twin)


@pytest.fixture(scope="module")
def axis(transport):
    made = Bus(transport).axis(1)
    made.set_parameter("home_method", HERE)
    made.enable()
    return made


@pytest.fixture
def short_periods(monkeypatch):
    monkeypatch.setattr(response_measurement, "PERIOD", 1024)


def test_before_homing_the_response_is_not_measured(axis):
    with pytest.raises(NotTuned, match="home it first"):
        response_measurement.measure(axis)


def test_a_move_is_recorded_at_each_tick_with_every_signal(axis):
    axis.home()
    scope = TickScope(axis)
    rare = ("sine_cosine", "fine_command", "faults")
    scope.start([name for name in SIGNALS if name not in rare], 300)
    status = axis.move("20um")
    values = dict(scope.read().values)
    scope.start(rare, 300)
    values |= scope.read().values
    assert {len(signal) for signal in values.values()} == {300}
    # the target moves by its velocity at every tick; the first time it begins at the position
    beyond = numpy.abs(numpy.diff(values["target"]) - values["target_velocity"][1:]) > 2
    began = numpy.flatnonzero(values["target_velocity"])[0]
    assert beyond.sum() <= 1 and numpy.count_nonzero(values["target_velocity"]) > 100
    assert numpy.ptp(values["target"][:began]) == 0 < values["target"][-1] - values["target"][0]
    # the recorder takes the position some cycles after the servo
    moved = numpy.abs(values["position"] - (values["target"] - values["error"]))[began:]
    assert moved.max() < 200 and numpy.median(moved) < 50
    assert numpy.all(values["phase"] >= 0) and numpy.ptp(values["phase"]) > 60000
    assert not values["faults"].any() and not values["fine_command"].any()
    assert numpy.abs(values["velocity"]).max() > 0 and numpy.abs(values["command"]).max() > 0
    # each tick adds ki times the error, in 2^-24 command
    parameters = {name: axis.get_parameter(name).counts for name in ("ki", "dead_band")}
    grown = numpy.diff(values["integral"]) * 256 / parameters["ki"]
    assert numpy.median(numpy.abs(grown - values["error"][1:])) < 256 / parameters["ki"] + 1
    assert numpy.hypot(values["sine"], values["cosine"]).min() > 60, "ADC counts"
    assert status.ended == "ok"


def test_a_trigger_on_the_speed_keeps_what_came_before_it(axis):
    scope = TickScope(axis)
    rises = Trigger("rises", "target_velocity", "0.1mm/s", earlier=50)
    scope.start(("target_velocity", "target"), 200, trigger=rises)
    axis.dwell(0.1)
    assert scope.state() == "waiting"
    axis.move("40um")
    record = scope.read()
    speed = record.columns()["target_velocity_nm_per_s"]
    assert record.time_s[50] == 0
    assert speed[50] >= 100_000 > speed[49] and not speed[:20].any()


def test_a_stream_has_each_tick(axis):
    made = list(TickScope(axis).stream(("target", "target_velocity"), duration="50ms"))
    values = {
        name: numpy.concatenate([one.values[name] for one in made]) for name in made[0].values
    }
    assert len(values["target"]) == 200 and numpy.ptp(values["target"]) == 0
    assert not values["target_velocity"].any(), "the axis rests"


def test_an_excitation_lasts_as_long_as_a_recording_and_begins_with_its_first_value(axis):
    scope = TickScope(axis)
    pulses = numpy.zeros(64, int)
    pulses[[0, 1]] = 3000, -3000
    scope.load(pulses)
    with scope.excited(64):
        scope.start(("command",), 64 * 4, trigger=Trigger(delay=1))
        command = scope.read().values["command"].reshape(4, 64)
    other = numpy.median(command[:, 2:], axis=1, keepdims=True)
    assert numpy.all(command[:, :1] - other > 2000), "value 0 is in the first sample"
    assert numpy.all(command[:, 1:2] - other < -2000)
    scope.start(("command",), 64)
    assert numpy.ptp(scope.read().values["command"]) < 1000, "the excitation has ended"


def test_a_peak_without_room_is_refused_and_nothing_moves(axis):
    before = axis.status().position_nm
    with pytest.raises(NotTuned, match="more than half of the output_limit"):
        response_measurement.measure(axis, "90%")
    assert axis.status().position_nm == pytest.approx(before, abs=50)


def test_without_room_on_either_side_nothing_moves(axis, short_periods):
    axis.move("40um")
    before = axis.get_parameter("travel_high")
    axis.set_parameter("travel_high", "50um")
    with pytest.raises(OutOfRange, match="there is no room"):
        response_measurement.measure(axis, **SHORT)
    axis.write_parameter("travel_high", before.counts)
    assert axis.status().target_nm == pytest.approx(40_000, abs=1)


def test_a_fault_in_a_record_is_named_and_nothing_is_measured(axis, short_periods):
    axis.move("3mm")
    limit, override = axis.get_parameter("following_limit"), axis.override()
    axis.set_parameter("following_limit", "4um")
    with pytest.raises(MotionFailed, match="following error"):
        response_measurement.measure(axis, "40%", **SHORT)
    assert axis.override() == override and not axis.status().in_motion
    axis.reset()
    axis.write_parameter("following_limit", limit.counts)
    axis.enable()


def test_the_response_is_measured_through_a_slow_connection_on_the_side_with_room(
    transport, axis, short_periods
):
    axis.move("3mm")
    server = Hurried(transport)
    port = server.gateway.open_tcp("127.0.0.1", 0)
    server.begin()
    try:
        bus = Bus(open_bus(f"socket://127.0.0.1:{port}"))
        far = bus.axis(1)
        far.set_parameter("travel_high", "3.1mm")
        gains, override = far.tuning(), far.override()
        response = response_measurement.measure(far, **SHORT)
        assert far.tuning() == gains and far.override() == override
        assert far.status().target_nm == pytest.approx(3_000_000, abs=1)
        far.disable()
        bus.transport.close()
    finally:
        server.end()
    assert response.clear.mean() > 0.9 and response.hz[0] < 20 < response.hz[-1]
    plant = measured_plant.fit(response)
    assert plant.unexplained < 0.1 and 0.002 < plant.time_constant_s < 0.05
