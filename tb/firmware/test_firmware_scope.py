# SPDX-License-Identifier: Apache-2.0
"""scope.c: samples before and after each trigger, their distance in time, and the open loop."""

import pytest

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import CLK_HZ, DEFINES, FAULT, PERIOD, TABLE

TRIGGER = {name: code for name, (code, _) in TABLE["scope_trigger"].items()}
SCOPE_STATE = {code: name for name, (code, _) in TABLE["scope_state"].items()}
SAMPLES, CYCLES = 128, 64
TICK_CYCLES = CLK_HZ // 4000
SETTING = dict(axis=0, trigger=TRIGGER["now"], before=0, every=4, level=0, amplitude=0)


def arm(machine, **setting):
    return machine.request("arm_scope", **{**SETTING, **setting})[0]


def state(machine):
    return SCOPE_STATE[machine.ask("scope")["state"]]


def samples(machine):
    reported, out = machine.ask("scope"), []
    assert SCOPE_STATE[reported["state"]] == "full"
    while len(out) < reported["count"]:
        fields = machine.ask("read_scope", first=len(out))
        out += [
            {name: fields[f"{name}_{n}"] for name in ("position", "error", "command", "time")}
            for n in range(5)
        ]
    assert all(set(sample.values()) == {0} for sample in out[reported["count"] :])
    return out[: reported["count"]], reported["before"]


@pytest.fixture
def machine():
    made = CompiledNode(Axis(), Axis(), address=1)
    for axis in (0, 1):
        made.set(axis, home_method=37, settle_time=1)
        made.ask("enable", axis=axis, on=1)
        made.ask("home", axis=axis)
    made.run(200, until=lambda: made.status(1)["ended"] == "ok" and made.status(0)["ended"] == "ok")
    return made


def test_before_the_first_record_there_is_nothing_to_read(machine):
    assert state(machine) == "empty" and machine.request("read_scope", first=0)[0] == "out_of_range"


@pytest.mark.parametrize("every", [4, 20])
def test_a_record_at_once_is_full_and_evenly_spaced(machine, every):
    assert arm(machine, every=every) == "ok" and state(machine) in ("waiting", "recording")
    assert machine.request("read_scope", first=0)[0] == "out_of_range"
    machine.run(SAMPLES * every // 4 + 5)
    taken, before = samples(machine)
    assert len(taken) == SAMPLES and before == 0
    assert {sample["time"] for sample in taken[1:]} == {
        every * TICK_CYCLES // CYCLES,
        every * TICK_CYCLES // CYCLES + 1,
    } - ({every * TICK_CYCLES // CYCLES + 1} if every * TICK_CYCLES % CYCLES == 0 else set())
    assert sum(sample["time"] for sample in taken[1:]) * CYCLES == pytest.approx(
        (SAMPLES - 1) * every * TICK_CYCLES, abs=CYCLES
    )
    assert machine.request("read_scope", first=SAMPLES)[0] == "out_of_range"


def test_samples_hold_the_values_of_the_registers(machine):
    axis = machine.axes[0]
    axis.word[DEFINES["AXIS_COMMAND"]] = 0xFF9C
    held = []
    arm(machine)
    for _ in range(SAMPLES + 5):
        machine.run(1)
        held.append((axis.position, axis.error))
    taken, _ = samples(machine)
    assert [(sample["position"], sample["error"]) for sample in taken[1:]] == held[: SAMPLES - 1]
    assert {sample["command"] for sample in taken} == {-100}


@pytest.mark.parametrize("before", [0, 1, 40, SAMPLES - 1])
def test_a_motion_triggers_and_the_samples_before_it_are_kept(machine, before):
    assert arm(machine, trigger=TRIGGER["motion"], before=before) == "ok"
    machine.run(SAMPLES + 50)
    assert state(machine) == "waiting"
    rest = machine.axes[0].position & 0xFFFFFFFF
    machine.ask("move", axis=0, target=200 * PERIOD)
    machine.run(SAMPLES + 5)
    taken, reported = samples(machine)
    assert len(taken) == SAMPLES and reported == before
    assert all(sample["position"] & 0xFFFFFFFF == rest for sample in taken[:before])
    if before < SAMPLES - 10:
        assert taken[before + 8]["position"] & 0xFFFFFFFF != rest


def test_a_trigger_that_comes_soon_has_less_before_it(machine):
    arm(machine, trigger=TRIGGER["motion"], before=100)
    machine.run(10)
    machine.ask("move", axis=0, target=200 * PERIOD)
    machine.run(SAMPLES + 5)
    taken, before = samples(machine)
    assert len(taken) == SAMPLES and 9 <= before <= 13


def test_settling_error_and_fault_trigger(machine):
    arm(machine, trigger=TRIGGER["settling"], before=5)
    machine.ask("move", axis=0, target=10 * PERIOD)
    machine.run(400, until=lambda: state(machine) == "full")
    taken, before = samples(machine)
    assert taken[before]["position"] == pytest.approx(10 * PERIOD, abs=PERIOD // 10)

    arm(machine, trigger=TRIGGER["error"], level=1000)
    machine.run(20)
    assert state(machine) == "waiting"
    machine.axes[0].machine -= 1000
    machine.axes[0].seized = True
    machine.run(SAMPLES + 5)
    assert samples(machine)[0][0]["error"] == pytest.approx(1000, abs=2)
    machine.axes[0].seized = False

    arm(machine, trigger=TRIGGER["fault"], before=3)
    machine.run(20)
    machine.axes[0].causes = FAULT["estop"]
    machine.run(SAMPLES + 5)
    assert state(machine) == "full"


def test_only_the_requested_axis_triggers(machine):
    arm(machine, axis=1, trigger=TRIGGER["motion"])
    machine.ask("move", axis=0, target=10 * PERIOD)
    machine.run(50)
    assert state(machine) == "waiting"
    machine.ask("move", axis=1, target=10 * PERIOD)
    machine.run(20)
    assert state(machine) == "recording"


@pytest.mark.parametrize(
    "setting",
    [
        dict(trigger=5),
        dict(before=SAMPLES),
        dict(every=0),
        dict(every=201),
        dict(amplitude=-1),
        dict(amplitude=100, trigger=TRIGGER["motion"]),
        dict(amplitude=100, before=1),
    ],
)
def test_invalid_settings_are_refused(machine, setting):
    assert arm(machine, **setting) == "out_of_range" and state(machine) == "empty"


# ------------------------------------------------------------------ open loop


def excite(machine, **setting):
    return arm(machine, **{"amplitude": 3000, "level": 50 * PERIOD, "every": 8, **setting})


def open_commands(machine, ms):
    given = []
    for _ in range(ms):
        machine.run(1)
        word = machine.axes[0].word.get(DEFINES["AXIS_OPEN_COMMAND"], 0)
        given.append(word - (1 << 32) if word >> 31 else word)
    return given


def test_the_open_loop_has_steps_and_their_negatives_and_then_holds(machine):
    control = DEFINES["AXIS_CONTROL_CLOSED_LOOP_MASK"]
    assert excite(machine) == "ok"
    assert machine.status()["state"] == "excited" and not machine.axes[0].control & control
    given = open_commands(machine, 2 * SAMPLES - 4)
    assert set(given[2:]) == {3000, -3000}
    runs, last = [], None
    for command in given[2:]:
        if command == last:
            runs[-1] += 1
        else:
            runs.append(1)
        last = command
    assert len(runs) > 8 and len(set(runs)) > 3 and max(runs) <= 2 * 2 * 16 + 2
    machine.run(10)
    assert (
        machine.axes[0].control & control
        and machine.status()["state"] == "holding"
        and machine.status()["ended"] == "ok"
    )
    assert len(samples(machine)[0]) == SAMPLES


def test_moves_wait_for_the_end_of_the_open_loop_and_a_second_one_too(machine):
    excite(machine)
    assert machine.request("move", axis=0, target=0)[0] == "busy"
    assert excite(machine) == "busy" and arm(machine) == "busy"


@pytest.mark.parametrize("end", ["stop", "disable", "fault"])
def test_stop_disable_and_fault_end_the_open_loop_and_the_record(machine, end):
    excite(machine)
    machine.run(50)
    if end == "stop":
        machine.ask("stop", axis=0)
    elif end == "disable":
        machine.ask("enable", axis=0, on=0)
    else:
        machine.axes[0].causes = FAULT["estop"]
    machine.run(5)
    reported = machine.status()
    assert reported["state"] == {"stop": "holding", "disable": "off", "fault": "faulted"}[end]
    assert reported["ended"] == ("ended_by_fault" if end == "fault" else "stopped")
    before = machine.axes[0].word[DEFINES["AXIS_OPEN_COMMAND"]]
    machine.run(50)
    assert (
        machine.axes[0].word[DEFINES["AXIS_OPEN_COMMAND"]] == before
        and 20 < len(samples(machine)[0]) < 40
    )


def test_an_axis_that_moves_too_far_is_held(machine):
    excite(machine)
    machine.run(20)
    machine.axes[0].seized = True  # the machine of this bench knows no open loop
    machine.axes[0].machine += 51 * PERIOD
    machine.run(4)
    assert machine.status()["state"] == "holding" and machine.axes[0].error == 0


def test_an_axis_that_is_off_is_not_excited(machine):
    machine.ask("enable", axis=0, on=0)
    assert excite(machine) == "not_enabled" and state(machine) == "empty"


def test_the_position_alone_is_reported(machine):
    machine.axes[0].machine = -5 * PERIOD - 7
    assert machine.ask("position", axis=0)["position"] == machine.axes[0].position
