# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.tick_scope: requests to the node, its words as signals in their units, triggers,
streams, and what is refused; test_firmware_tick_scope has the side of the node.
"""

import io
import threading

import numpy
import pytest
from PIL import Image
from pyarrow import parquet

from moire.analysis import tick_scope
from moire.analysis.tick_scope import SIGNALS, NotRecorded, TickScope, Trigger
from moire.client.bus import Bus
from moire.errors import OutOfRange, Refused, UnitError
from moire.made.bus_tables import FAULTS
from tb.fakes.bus_node import START, BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.call import Call, sentence
from twin.compiled.axis import Axis
from twin.compiled.tables import DEFINES, PERIOD

WORDS = 1024


class Ramp(Axis):
    """An axis that moves by itself, by the same distance in each tick."""

    def __init__(self, position=START, step=PERIOD // 16):
        super().__init__(position)
        self.step, self.ticks = step, 0

    def tick(self):
        self.machine += self.step
        self.speed = self.step
        self.ticks += 1
        self.word[DEFINES["AXIS_COMMAND"]] = -16384 + self.ticks & 0xFFFF

    @property
    def error(self):
        return -3 * self.ticks


def node_of(axis=None):
    return BusNode(axes=[axis or Ramp()], scope_words=WORDS)


def scope_of(node):
    return TickScope(Bus(Rs485Bus(node)).axis())


def test_signals_are_read_in_their_units_at_equal_distances():
    node = node_of()
    scope = scope_of(node)
    scope.start(("command", "error", "velocity"), 100, "500us")
    sent = dict(axis=0, last=2, every=2, samples=100)
    sent |= {f"channel_{n}": code for n, code in enumerate((5, 4, 3, 0, 0, 0, 0, 0))}
    sent |= dict(trigger=4, mode=0, earlier=0, delay=0, level=0)
    assert node.written("record_ticks") == [sent]
    record = scope.read()
    columns = record.columns()
    assert list(columns) == ["time_s", "command_of_full_scale", "error_nm", "velocity_nm_per_s"]
    assert columns["time_s"][:3] == pytest.approx([0, 0.0005, 0.001])
    assert len(record.time_s) == 100
    errors = columns["error_nm"] * PERIOD / 800
    assert errors[1:] - errors[:-1] == pytest.approx([-6] * 99)
    commands = columns["command_of_full_scale"] * 32768
    assert commands[1:] - commands[:-1] == pytest.approx([2] * 99)
    assert columns["velocity_nm_per_s"] == pytest.approx([800 / 16 * 4000] * 100)


def test_target_and_error_give_the_position_through_every_wrap_of_a_word():
    axis = Ramp()
    node = node_of(axis)
    scope = scope_of(node)
    scope.start(("target", "error"))
    record = scope.read()
    assert len(record.time_s) == WORDS // 2
    assert list(record.values["target"]) == [axis.target] * (WORDS // 2)
    assert list(record.values["position"]) == list(record.values["target"] - record.values["error"])
    low = [2**31 - 10, -(2**31) + 10, -(2**31) + 30]
    assert list(tick_scope.unwrapped([word % 2**32 for word in low], 5 * 2**32 - 2**31 + 31)) == [
        5 * 2**32 - 2**31 + step for step in (-10, 10, 30)
    ]


def test_sine_and_cosine_are_one_signal():
    node = node_of()
    node.axes[0].word[DEFINES["AXIS_SAMPLE"]] = 0xFFFE_0005
    scope = scope_of(node)
    scope.start(["sine_cosine"], 3)
    columns = scope.read().columns()
    assert list(columns["sine_counts"]) == [5] * 3 and list(columns["cosine_counts"]) == [-2] * 3


def test_position_phase_and_faults_have_their_units():
    scope = scope_of(node_of(Ramp(step=PERIOD // 8)))
    scope.start(["faults", "phase", "position"], 16)
    columns = scope.read().columns()
    assert list(columns) == ["time_s", "faults_bits", "phase_periods", "position_nm"]
    assert columns["position_nm"][1:] - columns["position_nm"][:-1] == pytest.approx([100] * 15)
    assert columns["phase_periods"] == pytest.approx(columns["position_nm"] / 800 % 1)
    assert not columns["faults_bits"].any()


def test_a_trigger_has_a_level_in_the_unit_of_its_signal_and_samples_before_it():
    node = node_of()
    scope = scope_of(node)
    scope.start(["error"], 100, "500us", Trigger("falls", "error", "-200nm", earlier=30))
    record = scope.read()
    level = -200 * PERIOD / 800
    assert record.time_s[30] == 0 and record.time_s[0] == pytest.approx(-0.015)
    assert record.values["error"][30] < level <= record.values["error"][29]
    for signal, level, counts in (
        ("position", "8um", 10 * PERIOD),
        ("velocity", "3.2mm/s", PERIOD),
        ("command", "-25%", -8192),
        ("integral", "-25%", -(1 << 29)),
        ("phase", "100", 100),
        ("faults", None, 0),
    ):
        assert Trigger("rises", signal, level).counts(scope.axis.period_nm, 4000) == counts
    assert Trigger("bits", "faults").counts(scope.axis.period_nm, 4000) == 2 ** len(FAULTS) - 1


@pytest.mark.parametrize(
    "trigger, error, message",
    [
        (Trigger("jumps"), OutOfRange, "no trigger 'jumps': there are now, rises"),
        (Trigger("rises", "noise"), OutOfRange, "no signal 'noise' to trigger"),
        (Trigger("rises", "error", "5"), UnitError, "no unit"),
        (Trigger("rises", "error", "5m"), OutOfRange, "too large for 'error'"),
        (Trigger(earlier=100), OutOfRange, "from 0 to 99"),
        (Trigger(delay=65536), OutOfRange, "or to 65535"),
    ],
)
def test_a_trigger_that_cannot_be_is_refused(trigger, error, message):
    node = node_of()
    with pytest.raises(error, match=message):
        scope_of(node).start(["error"], 100, trigger=trigger)
    assert "record_ticks" not in node.executed


def test_a_trigger_that_does_not_come_is_waited_for_in_the_time_of_the_node():
    scope = scope_of(node_of())
    scope.start(["error"], 100, trigger=Trigger("rises", "error", "1mm"))
    begun = scope.now_s()
    with pytest.raises(NotRecorded, match="was not triggered within 250ms"):
        scope.read(timeout="250ms")
    assert 0.25 < scope.now_s() - begun < 0.5


def test_a_stream_has_every_sample_once_for_as_long_as_it_is_to_last():
    node = node_of()
    scope = scope_of(node)
    records = list(scope.stream(("error", "target"), "500us", "300ms"))
    assert len(records) > 1 and sum(len(one.time_s) for one in records) == 600
    times = [time for one in records for time in one.time_s]
    assert times == pytest.approx([n * 0.0005 for n in range(600)])
    errors = [error for one in records for error in one.values["error"]]
    assert all(after - before == -6 for before, after in zip(errors, errors[1:]))


def test_a_stream_ends_with_its_duration_although_more_samples_wait():
    node = node_of()
    stream = scope_of(node).stream(["error"], duration="100ms")
    got = len(next(stream).time_s)
    node.run(WORDS // 8)
    rest = [len(record.time_s) for record in stream]
    assert got + sum(rest) == 400
    assert len(node.scope.recorded) - node.scope.taken > 100, "and they stay where they are"


def test_a_stream_that_is_not_read_in_time_ends_with_what_the_memory_holds():
    node = node_of()
    scope = scope_of(node)
    stream = scope.stream(["error"])
    got = len(next(stream).time_s)
    node.run(WORDS)
    with pytest.raises(NotRecorded, match="stream fewer signals"):
        for record in stream:
            got += len(record.time_s)
    assert WORDS <= got < WORDS + 50


@pytest.mark.parametrize(
    "wrong, message",
    [
        (dict(signals=["noise"]), "no signal 'noise' to record: there are sine_cosine, target"),
        (dict(signals=[]), "1 to 8 signals, not 0: there are sine_cosine, target"),
        (dict(signals=[*SIGNALS]), "1 to 8 signals, not 11"),
        (dict(signals=["y.error"]), "'y' of 'y.error' is no number of an axis: write 1.error"),
        (dict(signals=["error"], samples=WORDS + 1), "from 1 to 1024"),
        (dict(signals=["error"], samples=0), "from 1 to 1024"),
        (dict(signals=["error"], every="100us"), "250us to 16.38"),
        (dict(signals=["error"], every="17s"), "250us to 16.38"),
    ],
)
def test_wrong_settings_are_not_sent(wrong, message):
    node = node_of()
    with pytest.raises(OutOfRange, match=message):
        scope_of(node).start(**wrong)
    assert "record_ticks" not in node.executed


def test_what_was_not_recorded_is_refused():
    bare = scope_of(BusNode())
    with pytest.raises(NotRecorded, match="build it with SCOPE_WORDS"):
        bare.start(["error"])
    with pytest.raises(NotRecorded, match="has no recording"):
        scope_of(node_of()).read()
    node = node_of()
    scope = scope_of(node)
    scope.start(["error"], 50)
    node.run(1)
    node.scope.tick = lambda axes: None
    with pytest.raises(NotRecorded, match="did not come to its end"):
        scope.read()
    node = node_of()
    scope = scope_of(node)
    scope.start(["error"], 50)
    node.run(50)
    node.ask("read_ticks")
    with pytest.raises(NotRecorded, match="another client"):
        scope.read()


def test_one_recording_has_signals_of_several_axes_each_in_its_own_unit():
    node = BusNode(axes=[Ramp(), Ramp(step=PERIOD // 4)], scope_words=WORDS)
    scope = TickScope(Bus(Rs485Bus(node)).node(1).axis(0))
    other = scope.node.axis(1)
    other.set_parameter("period", "400nm")
    scope.start(("position", "1.position", "1.velocity", "position"), 50)
    columns = scope.read().columns()
    assert list(columns) == [
        *("time_s", "position_nm", "axis_1_position_nm", "axis_1_velocity_nm_per_s")
    ]
    assert numpy.diff(columns["position_nm"]) == pytest.approx([50] * 49)
    assert numpy.diff(columns["axis_1_position_nm"]) == pytest.approx([100] * 49)
    assert columns["axis_1_velocity_nm_per_s"] == pytest.approx([100 * 4000] * 50)
    scope.start(("target", "error", "1.error", "1.target"), 9)
    values = scope.read().values
    assert [*values][4:] == ["position", "1.position"]
    assert list(values["1.position"]) == list(values["1.target"] - values["1.error"])
    with pytest.raises(Refused, match="no axis 2: it has axes 0 to 1"):
        scope.start(["2.error"])


def test_a_recording_of_another_axis_is_not_mistaken_for_its_own():
    node = BusNode(axes=[Ramp(), Ramp()], scope_words=WORDS)
    bus = Bus(Rs485Bus(node))
    TickScope(bus.node(1).axis(1)).start(["error"], 5)
    with pytest.raises(NotRecorded, match="was begun for axis 1, not for axis 0"):
        TickScope(bus.node(1).axis(0)).read()


def test_a_waveform_is_loaded_and_lasts_as_long_as_the_block():
    node = node_of()
    scope = scope_of(node)
    values = [(-1) ** n * n for n in range(100)]
    assert scope.load(values) == 100
    assert [node.scope.waveform[n] for n in range(100)] == values
    scope.axis.enable()
    with pytest.raises(ValueError, match="within"), scope.excited(100):
        assert node.scope.field("EXCITATION_PERIOD") == 100
        raise ValueError("within")
    assert node.scope.field("EXCITATION_PERIOD") == 0
    for wrong in ([], [0] * 4097, [32768]):
        with pytest.raises(OutOfRange, match="1 to 4096 values"):
            scope.load(wrong)
    scope.axis.disable()
    with pytest.raises(Refused, match="the drive is off"), scope.excited(100):
        pass


def test_the_watchdog_hears_requests_while_a_picture_is_drawn_with_the_drive_on(
    tmp_path, monkeypatch
):
    node, heard = node_of(Axis()), threading.Event()
    node.home()

    def picture(record):
        node.port.on_request = lambda name, fields: heard.set()
        assert heard.wait(30)
        return b"drawn"

    monkeypatch.setattr(tick_scope.TickRecord, "picture", picture)
    call = Call(
        f"scope record --samples 9 -- move 1um -- scope save {tmp_path / 'a.csv'} --picture "
        f"{tmp_path / 'a.png'}".split(),
        node,
    )
    assert call.code == 0, call.err
    assert (tmp_path / "a.png").read_bytes() == b"drawn"
    heard.clear()
    call = Call(f"scope save {tmp_path / 'b.csv'}".split(), node_of())
    assert call.code != 0 and not heard.is_set(), "nothing was switched on"


def test_scope_record_and_save_write_files_with_units(tmp_path):
    table, drawn = tmp_path / "a.csv", tmp_path / "a.png"
    call = Call(
        ["scope", "record", "--signals", "error,command", "--samples", "40", "--"]
        + ["scope", "save", str(table), "--picture", str(drawn)],
        node_of(),
    )
    assert call.code == 0, call.err
    assert "40 samples of error, command in 10ms" in call.out
    rows = table.read_text().splitlines()
    assert rows[0] == "time_s,error_nm,command_of_full_scale" and len(rows) == 41
    assert Image.open(drawn).format == "PNG"
    table = tmp_path / "a.parquet"
    node = node_of()
    call = Call(["scope", "record", "--samples", "9", "--", "scope", "save", str(table)], node)
    assert call.code == 0, call.err
    read = parquet.read_table(io.BytesIO(table.read_bytes()))
    assert read.column_names == [
        "time_s",
        "target_nm",
        "error_nm",
        "command_of_full_scale",
        "position_nm",
    ]
    call = Call(
        "scope record --signals velocity --trigger rises --of command --level=-45% --before 5 "
        f"--samples 20 -- scope save {table} --timeout 2s -- "
        f"scope stream {tmp_path / 'b.csv'} --signals error --every 1ms --time 50ms".split(),
        node_of(),
    )
    assert call.code == 0, call.err
    assert "5 of them before the trigger" in call.out and "1000 words/s without a gap" in call.out
    assert parquet.read_table(table)["time_s"].to_pylist()[5] == 0
    assert len((tmp_path / "b.csv").read_text().splitlines()) == 51
    call = Call(
        f"scope record --signals 1.0.error,1.1.velocity,1.command --samples 9 --delay 5ms -- "
        f"scope save {tmp_path / 'c.csv'}".split(),
        BusNode(axes=[Ramp(), Ramp()], scope_words=WORDS),
    )
    assert call.code == 0, call.err
    assert "9 samples of error, 1.velocity, 1.command in 2.25ms, 5ms after" in call.out
    rows = (tmp_path / "c.csv").read_text().splitlines()
    assert rows[0] == "time_s,error_nm,axis_1_velocity_nm_per_s,axis_1_command_of_full_scale"
    assert rows[1].startswith("0.005,")
    wrong = Call("scope record --signals 2.0.error", node_of())
    assert "axis 2.0 is of node 2: the signals of a recording are of one node" in sentence(wrong, 2)
    wrong = Call("scope record --before 5 --delay 1ms", node_of())
    assert "--before and --delay do not go together" in sentence(wrong, 2)
    assert "no signal 'sped'" in sentence(Call("scope record --signals sped", node_of()), 2)
