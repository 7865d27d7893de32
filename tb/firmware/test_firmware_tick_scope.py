# SPDX-License-Identifier: Apache-2.0
"""tick_scope.c: signals at each servo tick, read in order, from a trigger on or without end; a
waveform that ends with any request to its axis but a motion, and what is refused.
"""

import pytest

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import DEFINES, FAULT, PERIOD, TABLE

SIGNAL = {name: code for name, (code, _) in TABLE["tick_signal"].items()}
MODE = {name: code for name, (code, _) in TABLE["tick_trigger"].items()}
STATE = {code: name for name, (code, _) in TABLE["scope_state"].items()}
WORDS, AT_ONCE, VALUES = 1024, 14, 24
LIMIT = 12345


@pytest.fixture
def machine():
    made = CompiledNode(Axis(), Axis(), address=1, scope_words=WORDS)
    for axis in (0, 1):
        made.set(axis, home_method=37, settle_time=1, output_limit=LIMIT)
        made.ask("enable", axis=axis, on=1)
        made.ask("home", axis=axis)
    made.run(200, until=lambda: made.status(1)["ended"] == "ok" and made.status(0)["ended"] == "ok")
    return made


def record(machine, channels=("error",), every=1, samples=100, axis=0, **settings):
    """Channels are names of signals of this axis, or (name, axis)."""
    pairs = [(one, axis) if isinstance(one, str) else one for one in channels]
    codes = [SIGNAL[name] | number << 4 for name, number in pairs]
    settings = dict(trigger=0, mode=0, earlier=0, delay=0, level=0) | settings
    settings |= {f"channel_{n}": code for n, code in enumerate(codes + [0] * (8 - len(codes)))}
    settings |= dict(axis=axis, last=len(codes) - 1, every=every, samples=samples)
    return machine.request("record_ticks", **settings)[0]


def state(machine):
    return STATE[machine.ask("read_ticks")["state"]]


def words(machine):
    out = []
    while True:
        reply = machine.ask("read_ticks")
        assert reply["first"] == len(out)
        out += [reply[f"word_{n}"] for n in range(reply["count"])]
        assert not any(reply[f"word_{n}"] for n in range(reply["count"], AT_ONCE))
        if reply["count"] < AT_ONCE:
            return out


def excite(machine, period=100, axis=0):
    return machine.request("excite", axis=axis, period=period)[0]


def period(machine):
    return machine.scope.field("EXCITATION_PERIOD")


def test_a_record_has_each_signal_of_each_sample_in_order(machine):
    assert state(machine) == "empty"
    machine.ask("move", axis=1, target=3 * PERIOD)
    assert record(machine, ("target", "error"), 2, 50, axis=1) == "ok"
    assert state(machine) == "waiting" and machine.scope.field("SCOPE_AXIS") == 1
    machine.run(2)
    assert state(machine) == "recording" and machine.ask("read_ticks")["count"] == 0
    machine.run(30)
    assert state(machine) == "full"
    # reading the state has passed the first words
    assert machine.ask("read_ticks")["first"] == AT_ONCE
    assert record(machine, ("target", "error"), 2, 50, axis=1) == "ok"
    machine.run(30)
    got = words(machine)
    assert len(got) == 100 and got == machine.scope.recorded


def test_every_setting_of_a_recording_reaches_its_register(machine):
    settings = dict(trigger=SIGNAL["faults"], mode=MODE["bits"], earlier=3, delay=7, level=-5)
    channels = ("error", ("command", 0), "integral", ("faults", 0), ("phase", 0), "position")
    assert record(machine, channels, 9, 77, axis=1, **settings) == "ok"
    fields = dict(
        SCOPE_AXIS=1,
        SCOPE_LAST=5,
        SCOPE_TRIGGER=SIGNAL["faults"],
        SCOPE_MODE=MODE["bits"],
        SCOPE_SAMPLES_LENGTH=77,
        SCOPE_SAMPLES_EVERY=9,
        SCOPE_PLACE_EARLIER=3,
        SCOPE_PLACE_DELAY=7,
    )
    assert {name: machine.scope.field(name) for name in fields} == fields
    assert machine.scope.word[DEFINES["NODE_SCOPE_LEVEL"]] == 0xFFFF_FFFB
    assert machine.scope.word[DEFINES["NODE_SCOPE_CHANNELS_0"]] == 0x0A16_0514
    assert machine.scope.word[DEFINES["NODE_SCOPE_CHANNELS_4"]] == 0x1708
    assert record(machine, axis=2) == "no_such_axis"


def test_a_recording_waits_for_its_trigger_and_keeps_what_came_before(machine):
    settings = dict(trigger=SIGNAL["faults"], mode=MODE["bits"], level=FAULT["drive"], earlier=10)
    assert record(machine, ["faults"], samples=20, **settings) == "ok"
    machine.run(20)
    assert state(machine) == "waiting"
    machine.axes[0].causes |= FAULT["drive"]
    machine.run(10)
    assert state(machine) == "full"
    assert machine.scope.recorded == [0] * 10 + [FAULT["drive"]] * 10


def test_one_recording_has_signals_of_both_axes_and_the_trigger_of_one(machine):
    channels = [("position", 0), ("position", 1), ("faults", 0), ("faults", 1)]
    settings = dict(trigger=SIGNAL["faults"], mode=MODE["bits"], level=FAULT["drive"])
    assert record(machine, channels, samples=5, axis=1, **settings) == "ok"
    machine.axes[0].causes |= FAULT["drive"]
    machine.run(5)
    assert state(machine) == "waiting", "the fault of the other axis does not count"
    machine.axes[1].causes |= FAULT["drive"]
    machine.run(5)
    assert state(machine) == "full"
    places = [axis.position & 0xFFFF_FFFF for axis in machine.axes]
    assert machine.scope.recorded == 5 * [*places, FAULT["drive"], FAULT["drive"]]


def test_a_recording_without_an_end_is_read_while_it_goes_on(machine):
    assert record(machine, samples=0) == "ok"
    got = 0
    for _ in range(20):
        machine.run(2)
        reply = machine.ask("read_ticks")
        assert STATE[reply["state"]] == "recording" and reply["first"] == got
        got += reply["count"]
    assert 150 <= got <= 160, "four in each millisecond"
    machine.run(WORDS // 4 + 1)
    reply = machine.ask("read_ticks")
    assert STATE[reply["state"]] == "full" and reply["count"] == AT_ONCE


def test_a_waveform_is_loaded_up_to_its_longest(machine):
    longest = TABLE["constant"]["waveform_longest"][0]
    values = {f"value_{n}": 100 * n - 900 for n in range(VALUES)}
    machine.ask("load_excitation", first=48, **values)
    assert [machine.scope.waveform[48 + n] for n in range(VALUES)] == list(values.values())
    assert set(machine.scope.waveform) == set(range(48, 48 + VALUES)), "and nothing behind them"
    machine.ask("load_excitation", first=longest - 2, **values)
    assert machine.scope.waveform[longest - 1] == -800 and 0 not in machine.scope.waveform


def test_an_excitation_has_the_limit_of_its_axis_and_ends_on_request(machine):
    assert excite(machine, 4096, axis=1) == "ok" and period(machine) == 4096
    assert machine.scope.field("EXCITATION_AXIS") == 1
    assert machine.scope.field("EXCITATION_LIMIT") == LIMIT
    machine.run(50)
    assert period(machine) == 4096
    assert excite(machine, 0, axis=1) == "ok" and period(machine) == 0


@pytest.mark.parametrize(
    "name, fields",
    [
        ("stop", dict(axis=0)),
        ("home", dict(axis=0)),
        ("enable", dict(axis=0, on=0)),
    ],
)
def test_any_request_to_the_axis_but_a_motion_ends_its_excitation(machine, name, fields):
    assert excite(machine) == "ok"
    machine.ask(name, **fields)
    machine.run(2)
    assert period(machine) == 0


@pytest.mark.parametrize("name, fields", [("stop", {}), ("enable", dict(on=0))])
def test_a_motion_keeps_the_excitation_and_what_ends_it_does_not(machine, name, fields):
    assert excite(machine) == "ok"
    machine.ask("move", axis=0, target=100 * PERIOD)
    machine.run(5)
    assert period(machine) == 100
    machine.ask(name, axis=0, **fields)
    machine.run(2)
    assert period(machine) == 0


def test_a_fault_ends_the_excitation(machine):
    assert excite(machine) == "ok"
    machine.axes[0].causes |= FAULT["drive"]
    machine.run(2)
    assert period(machine) == 0


def test_an_excitation_that_cannot_be_is_refused(machine):
    assert excite(machine, 4097) == "out_of_range"
    assert excite(machine, axis=0) == "ok"
    assert excite(machine, axis=1) == "busy"
    assert excite(machine, 0, axis=0) == "ok"
    machine.ask("home", axis=1)
    assert excite(machine, axis=1) == "busy", "it homes"
    machine.ask("enable", axis=0, on=0)
    assert excite(machine, axis=0) == "not_enabled"


def test_without_a_recorder_all_is_refused():
    machine = CompiledNode(Axis())
    assert machine.request("excite", axis=0, period=5)[0] == "not_built"
    assert record(machine) == "not_built"
    values = {f"value_{n}": 0 for n in range(VALUES)}
    assert machine.request("load_excitation", first=0, **values)[0] == "not_built"
    assert state(machine) == "empty"


def test_the_node_waits_between_requests_unless_it_excites(machine):
    idle = machine.firmware.firmware_idle_ticks
    before = idle()
    assert excite(machine) == "ok"
    assert idle() == 0
    assert excite(machine, 0) == "ok"
    machine.run(2)
    assert idle() == before
