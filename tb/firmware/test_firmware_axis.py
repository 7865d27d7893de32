# SPDX-License-Identifier: Apache-2.0
"""axis.c: enable, move, stop, home and faults, on a simulated axis of CompiledNode."""

import random

import pytest

from tb.bench import seed
from tb.firmware.plan_model import distance, limits
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import DEFINES, FAULT, PARAMETER, PERIOD

SET_TARGET = DEFINES["AXIS_STROBES_SET_TARGET_TO_POSITION_MASK"]
CONTROLLED_STOP = DEFINES["AXIS_STROBES_CONTROLLED_STOP_MASK"]
RESET = DEFINES["AXIS_STROBES_RESET_FAULTS_MASK"]
ENABLE = DEFINES["AXIS_CONTROL_ENABLE_MASK"]
CLOSED_LOOP = DEFINES["AXIS_CONTROL_CLOSED_LOOP_MASK"]
HOMING = DEFINES["AXIS_CONTROL_HOMING_MASK"]
STEPS_OF_HOMING = [
    3,
    40,
    68,
    72,
    76,
    80,
    120,
    170,
    190,
    205,
]  # ms: approach, catch, creep, depart, settle, zero
DISTANCE = 100 * PERIOD  # from switch to zero
SHORT = {
    "travel_low": -50 * PERIOD,
    "travel_high": 2000 * PERIOD,
    "home_distance": DISTANCE,
    "homing_search_speed": 2000,
}


def enabled(*axes, **parameters):
    machine = CompiledNode(*axes)
    machine.set(**{**SHORT, **parameters})
    machine.ask("enable", axis=0, on=1)
    return machine


def homed(axis=None, **parameters):
    machine = enabled(axis or Axis(position=50 * PERIOD, low=0), **parameters)
    machine.ask("home", axis=0)
    assert machine.run(20_000, until=lambda: machine.status()["ended"] != "running")
    assert machine.status()["ended"] == "ok"
    return machine


def finish(machine, ms=20_000):
    assert machine.run(ms, until=lambda: machine.status()["ended"] != "running"), (
        "the motion does not end"
    )
    return machine.status()["ended"]


# enable


def test_the_drive_is_off_at_start():
    machine = CompiledNode()
    machine.run(10)
    status = machine.status()
    assert (status["state"], status["ended"], status["flags"]) == ("off", "no_motion_yet", set())
    assert machine.axes[0].control == 0


def test_enable_holds_the_present_position_before_the_loop_is_closed():
    axis = Axis(position=12345)
    machine = CompiledNode(axis)
    axis.player.target, axis.strobes = 0, []
    machine.ask("enable", axis=0, on=1)
    assert (
        axis.strobes == [(SET_TARGET, 0)]
        and axis.control == ENABLE | CLOSED_LOOP
        and axis.target == 12345
    )
    status = machine.status()
    assert status["state"] == "holding" and status["flags"] == {"enabled", "settled"}


def test_enable_twice_does_not_disturb_a_motion():
    machine = homed()
    machine.ask("move", axis=0, target=500 * PERIOD)
    machine.run(5)
    machine.axes[0].strobes = []
    machine.ask("enable", axis=0, on=1)
    assert machine.axes[0].strobes == [] and machine.status()["state"] == "moving"


def test_enable_off_is_always_allowed_and_ends_a_motion():
    machine = homed()
    machine.ask("move", axis=0, target=500 * PERIOD)
    machine.run(20)
    machine.ask("enable", axis=0, on=0)
    status = machine.status()
    assert (status["state"], status["ended"]) == ("off", "stopped") and "enabled" not in status[
        "flags"
    ]
    assert not machine.axes[0].player.moving and machine.axes[0].control == 0
    machine.ask("enable", axis=0, on=0)
    assert "homed" in machine.status()["flags"]


def test_enable_takes_only_0_and_1():
    assert CompiledNode().request("enable", axis=0, on=2)[0] == "out_of_range"


@pytest.mark.parametrize("fault", ["estop", "drive"])
def test_enable_is_refused_while_a_fault_is_latched(fault):
    machine = CompiledNode()
    machine.axes[0].causes = FAULT[fault]
    machine.run(2)
    assert machine.request("enable", axis=0, on=1)[0] == "faulted" and machine.axes[0].control == 0
    machine.ask("enable", axis=0, on=0)


def test_enable_is_refused_if_the_interlock_refuses():
    """Causes that latch only when the drive is requested."""
    machine = CompiledNode()
    machine.axes[0].causes = FAULT["encoder"]
    assert machine.request("enable", axis=0, on=1)[0] == "faulted"
    assert machine.status()["state"] == "faulted" and machine.axes[0].control == 0


# move


def test_a_move_ends_exactly_at_its_target():
    machine = homed()
    for target in (500 * PERIOD + 1, 500 * PERIOD, 0, SHORT["travel_low"], SHORT["travel_high"]):
        ticks = machine.ask("move", axis=0, target=target)["duration_ticks"]
        assert machine.status()["state"] in ("moving", "settling")
        assert finish(machine, ticks / 4 + 100) == "ok"
        status = machine.status()
        assert status["target"] == status["position"] == target and status["state"] == "holding"


def test_the_duration_is_that_of_the_profile():
    machine = homed()
    ticks = machine.ask("move", axis=0, target=700 * PERIOD)["duration_ticks"]
    machine.run(ticks // 4)
    assert machine.axes[0].player.moving == bool(ticks % 4)
    machine.run(1)
    assert not machine.axes[0].player.moving and machine.axes[0].target == 700 * PERIOD


def test_each_limit_of_the_motion_is_in_force_from_when_it_is_set():
    machine = homed()
    last = machine.ask("move", axis=0, target=100 * PERIOD)["duration_ticks"]
    assert finish(machine) == "ok"
    for n, (name, value) in enumerate(
        (("jerk", 1_000_000), ("acceleration", 20_000), ("velocity", 700))
    ):
        machine.set(**{name: value})
        ticks = machine.ask("move", axis=0, target=100 * PERIOD * (n % 2))["duration_ticks"]
        assert finish(machine) == "ok" and ticks > last
        last = ticks
    assert (
        machine.axes[0].word[DEFINES["AXIS_STOP_DECELERATION"]]
        == limits(700, 20_000, 1_000_000)[1] >> 8
    )


def test_a_move_to_where_the_axis_is_ends_after_the_settling_time():
    machine = homed()
    assert machine.ask("move", axis=0, target=0)["duration_ticks"] == 0
    assert machine.status()["ended"] == "running"
    assert finish(machine, PARAMETER["settle_time"]["default"] + 2) == "ok"


def test_any_sequence_of_moves_lands_exactly():
    draw = random.Random(seed())
    machine = homed(jerk=2_000_000_000, acceleration=3_000_000)
    for _ in range(60):
        target = draw.randrange(SHORT["travel_low"], SHORT["travel_high"] + 1)
        machine.ask("move", axis=0, target=target)
        assert finish(machine) == "ok" and machine.status()["position"] == target


def test_motions_are_refused_in_the_documented_order():
    axis = Axis(position=50 * PERIOD, low=0)
    machine = CompiledNode(axis)
    machine.set(**SHORT)

    def move(target=0):
        return machine.request("move", axis=0, target=target)[0]

    beyond = SHORT["travel_high"] + 1
    axis.causes = FAULT["estop"]
    machine.run(1)
    assert move(beyond) == machine.request("home", axis=0)[0] == "faulted"
    axis.causes = 0
    machine.ask("reset_faults", axis=0)
    assert move(beyond) == machine.request("home", axis=0)[0] == "not_enabled"
    machine.ask("enable", axis=0, on=1)
    assert move(beyond) == "not_homed"
    machine.ask("home", axis=0)
    assert move(beyond) == machine.request("home", axis=0)[0] == "busy"
    assert finish(machine) == "ok"
    assert (
        move(beyond)
        == move(SHORT["travel_low"] - 1)
        == move(-(2**63))
        == move(2**63 - 1)
        == "out_of_travel"
    )
    assert move(1000 * PERIOD) == "ok"
    assert (
        machine.request("home", axis=0)[0]
        == machine.request("prepare", axis=0, target=0)[0]
        == "busy"
    )
    assert move(beyond) == "out_of_travel"


def test_parameters_are_refused_while_the_axis_moves():
    machine = homed()
    machine.ask("move", axis=0, target=500 * PERIOD)
    assert (
        machine.request("set_parameter", axis=0, parameter=PARAMETER["kp"]["id"], value=1)[0]
        == "busy"
    )
    machine.ask("get_parameter", axis=0, parameter=PARAMETER["kp"]["id"])
    finish(machine)
    machine.set(kp=1)


# prepared motions, override


def begun(machine):
    """The axes that the node had to start together."""
    return machine.word.pop(DEFINES["NODE_START_AXES"], 0)


def two_homed():
    machine = CompiledNode(Axis(position=50 * PERIOD, low=0), Axis(position=60 * PERIOD, low=0))
    for n in (0, 1):
        machine.set(n, **SHORT)
        machine.ask("enable", axis=n, on=1)
        machine.ask("home", axis=n)
        assert machine.run(20_000, until=lambda n=n: machine.status(n)["ended"] == "ok")
    return machine


def test_prepared_motions_begin_in_one_write_and_land_exactly():
    machine = two_homed()
    targets = 700 * PERIOD + 3, 300 * PERIOD - 5
    for n, target in enumerate(targets):
        assert machine.ask("prepare", axis=n, target=target)["duration_ticks"] > 0
    before = [machine.status(n)["position"] for n in (0, 1)]
    machine.run(50)
    for n in (0, 1):
        status = machine.status(n)
        assert (status["state"], status["ended"], status["position"]) == (
            "prepared",
            "running",
            before[n],
        )
    machine.ask("start", axes=3)
    assert begun(machine) == 3
    assert machine.run(
        20_000, until=lambda: all(machine.status(n)["ended"] == "ok" for n in (0, 1))
    )
    assert tuple(machine.status(n)["target"] for n in (0, 1)) == targets


def test_none_begins_if_one_of_them_is_not_prepared():
    machine = two_homed()
    machine.ask("prepare", axis=1, target=9 * PERIOD)
    assert machine.request("start", axes=3)[0] == "not_prepared" and begun(machine) == 0
    assert (
        machine.request("start", axes=0)[0] == machine.request("start", axes=4)[0] == "out_of_range"
    )
    assert machine.status(1)["state"] == "prepared"
    machine.ask("start", axes=2)
    assert begun(machine) == 2 and machine.request("start", axes=2)[0] == "not_prepared"


def sync(machine):
    """Does as the hardware: counts the sync, and plays the queued segments of the waiting axes."""
    line = DEFINES["BUS_BASE"]
    machine.word[line + DEFINES["BUS_SYNCS"]] = machine.word.get(line + DEFINES["BUS_SYNCS"], 0) + 1
    for n, axis in enumerate(machine.axes):
        axis.player.moving |= bool(
            machine.word[line + DEFINES["BUS_SYNC_AXES"]] >> n & 1 and axis.player.queue
        )
    return machine.receive(
        [
            0x20 | DEFINES["BUS_RECEIVE_COMMAND_MASK"],
            1,
            7,
            0,
            0,
            0,
            DEFINES["BUS_RECEIVE_GOOD_MASK"],
        ]
    )


def test_a_sync_starts_the_axes_that_wait_for_it_and_no_other_and_has_no_reply():
    machine = two_homed()
    for n in (0, 1):
        machine.ask("prepare", axis=n, target=100 * PERIOD)
    machine.ask("start_at_sync", axes=2)
    machine.run(20)
    assert [machine.status(n)["state"] for n in (0, 1)] == ["prepared", "prepared"]
    assert sync(machine) == b""
    assert [machine.status(n)["state"] for n in (0, 1)] == ["prepared", "moving"]
    assert (
        machine.run(20_000, until=lambda: machine.status(1)["ended"] == "ok")
        and machine.status(1)["target"] == 100 * PERIOD
    )
    sync(machine)
    machine.run(20)
    assert machine.status(0)["state"] == "prepared"


def test_the_wait_for_a_sync_can_be_cancelled_and_only_prepared_axes_can_wait():
    machine = two_homed()
    machine.ask("prepare", axis=0, target=100 * PERIOD)
    assert (
        machine.request("start_at_sync", axes=3)[0] == "not_prepared"
        and machine.request("start_at_sync", axes=4)[0] == "out_of_range"
    )
    machine.ask("start_at_sync", axes=1)
    machine.ask("start_at_sync", axes=0)
    sync(machine)
    machine.run(20)
    assert machine.status()["state"] == "prepared"


@pytest.mark.parametrize("end", ["stop", "disable", "estop", "start"])
def test_an_axis_that_waits_no_longer_is_not_started_by_a_sync(end):
    machine = two_homed()
    for n in (0, 1):
        machine.ask("prepare", axis=n, target=100 * PERIOD)
    machine.ask("start_at_sync", axes=3)
    if end == "start":
        machine.ask("start", axes=1)
        assert finish(machine) == "ok"
    elif end == "stop":
        machine.ask("stop", axis=0)
    elif end == "disable":
        machine.ask("enable", axis=0, on=0)
        machine.ask("enable", axis=0, on=1)
    else:
        machine.axes[0].causes = FAULT["estop"]
        machine.run(1)
        machine.axes[0].causes = 0
        machine.ask("reset_faults", axis=0)
        machine.ask("enable", axis=0, on=1)
    machine.ask("prepare", axis=0, target=200 * PERIOD)
    sync(machine)
    assert [machine.status(n)["state"] for n in (0, 1)] == ["prepared", "moving"]
    assert not machine.axes[0].player.moving and machine.axes[1].player.moving


@pytest.mark.parametrize("end", ["stop", "disable", "estop"])
def test_a_prepared_motion_that_is_cancelled_does_not_start_later(end):
    machine = two_homed()
    machine.ask("prepare", axis=0, target=9 * PERIOD)
    if end == "stop":
        machine.ask("stop", axis=0)
    elif end == "disable":
        machine.ask("enable", axis=0, on=0)
    else:
        machine.axes[0].causes = FAULT["estop"]
        machine.run(1)
    assert machine.axes[0].strobes[-1][0] == SET_TARGET
    assert machine.request("start", axes=1)[0] == "not_prepared" and begun(machine) == 0
    assert machine.status()["ended"] == ("ended_by_fault" if end == "estop" else "stopped")


def test_the_override_changes_in_motion_and_nothing_else_does():
    machine = homed()
    machine.ask("move", axis=0, target=500 * PERIOD)
    for share in (65536, 32768, 1, 0):
        machine.ask(
            "set_parameter", axis=0, parameter=PARAMETER["feed_override"]["id"], value=share
        )
        assert machine.axes[0].read(DEFINES["AXIS_FEED_OVERRIDE"]) == share
    assert (
        machine.request(
            "set_parameter", axis=0, parameter=PARAMETER["feed_override"]["id"], value=65537
        )[0]
        == "out_of_range"
    )
    assert (
        machine.request("set_parameter", axis=0, parameter=PARAMETER["velocity"]["id"], value=100)[
            0
        ]
        == "busy"
    )


@pytest.mark.parametrize(
    "name, value", [("drive", 1), ("position_source", 1), ("step_output", 1), ("step_invert", 1)]
)
def test_the_kind_of_drive_changes_only_with_the_drive_off(name, value):
    machine = enabled()
    assert (
        machine.request("set_parameter", axis=0, parameter=PARAMETER[name]["id"], value=value)[0]
        == "busy"
    )
    machine.ask("enable", axis=0, on=0)
    machine.ask("set_parameter", axis=0, parameter=PARAMETER[name]["id"], value=value)
    assert machine.ask("get_parameter", axis=0, parameter=PARAMETER[name]["id"])["value"] == value


@pytest.mark.parametrize("name", ["decoder_mode", "position_source"])
def test_with_another_count_the_zero_is_unknown(name):
    machine = homed()
    machine.ask("enable", axis=0, on=0)
    fields = {"axis": 0, "parameter": PARAMETER[name]["id"]}
    machine.set(**{name: machine.ask("get_parameter", **fields)["value"]})
    assert "homed" in machine.status()["flags"]
    machine.set(**{name: machine.ask("get_parameter", **fields)["value"] + 1})
    assert "homed" not in machine.status()["flags"]
    machine.ask("enable", axis=0, on=1)
    assert machine.request("move", axis=0, target=PERIOD)[0] == "not_homed"


def test_a_drive_that_was_not_built_is_refused():
    machine = CompiledNode(absent=("stepper", "dac", "fine_stage"))
    for name, value in (("drive", 1), ("drive", 2), ("fine_reach", 65536)):
        assert (
            machine.request("set_parameter", axis=0, parameter=PARAMETER[name]["id"], value=value)[
                0
            ]
            == "not_built"
        )
    machine.ask("set_parameter", axis=0, parameter=PARAMETER["drive"]["id"], value=0)


WITHOUT_SINE = ("sine", "monitor", "harmonics", "recorder")
NEEDY = {  # of each feature, the parameters that need it
    feature: [p for p in PARAMETER.values() if p.get("needs") == feature]
    for feature in sorted({p["needs"] for p in PARAMETER.values() if "needs" in p})
}


def another_value(parameter):
    """A value that requests what the parameter needs: neither 0 nor the default."""
    values = (parameter["min"] + 1, parameter["min"] + 2, parameter["max"])
    return next(v for v in values if v not in (0, parameter["default"]))


@pytest.mark.parametrize("feature", NEEDY)
def test_a_parameter_whose_need_was_not_built_accepts_only_0_and_its_default(feature):
    machine = CompiledNode(absent=(feature.lower(),))
    for parameter in NEEDY[feature]:
        request = {"axis": 0, "parameter": parameter["id"]}
        for value in (0, parameter["default"]):
            if parameter["min"] <= value <= parameter["max"]:
                machine.ask("set_parameter", **request, value=value)
                assert machine.ask("get_parameter", **request)["value"] == value
        assert (
            machine.request("set_parameter", **request, value=another_value(parameter))[0]
            == "not_built"
        )
        assert (
            machine.request("set_parameter", **request, value=parameter["max"] + 1)[0]
            == "out_of_range"
        )
        assert machine.ask("get_parameter", **request)["value"] == parameter["default"]


def test_every_parameter_is_accepted_where_its_need_was_built():
    machine = CompiledNode()
    for parameter in (parameter for needy in NEEDY.values() for parameter in needy):
        request = {"axis": 0, "parameter": parameter["id"], "value": another_value(parameter)}
        assert machine.request("set_parameter", **request)[0] == "ok", parameter


def test_an_axis_without_a_drive_refuses_every_motion_and_still_measures():
    machine = CompiledNode(absent=("drive", "bridge", "stepper", "dac", "fine_stage", "filters"))
    for operation, fields in (
        ("enable", {"on": 1}),
        ("home", {}),
        ("move", {"target": 0}),
        ("prepare", {"target": 0}),
        ("arm_scope", dict(trigger=0, before=0, every=1, level=65536, amplitude=100)),
    ):
        assert machine.request(operation, axis=0, **fields)[0] == "not_built", operation
    for operation, fields in (("enable", {"on": 0}), ("stop", {}), ("status", {}), ("encoder", {})):
        machine.ask(operation, axis=0, **fields)
    assert not machine.axes[0].word.get(DEFINES["AXIS_CONTROL"], 0)


def test_captures_compare_and_check_that_were_not_built_are_refused_and_the_index_is_not():
    base = DEFINES["FEEDBACK_BASE"]
    sources, strobes = (
        base + DEFINES["FEEDBACK_CAPTURE_SOURCES"],
        base + DEFINES["FEEDBACK_STROBES"],
    )
    mask = {name: DEFINES[f"FEEDBACK_STROBES_{name}_MASK"] for name in (
        "ARM_INDEX", "CAPTURE_NOW", "CAPTURE_NEXT", "COMPARE_ARM", "COMPARE_DISARM"
    )}  # fmt: skip
    queue = [(sources, 2), (strobes, mask["CAPTURE_NOW"])]
    compare = [
        *((strobes, mask[name]) for name in ("COMPARE_ARM", "COMPARE_DISARM")),
        *((base + DEFINES[f"FEEDBACK_COMPARE_{name}"], 1) for name in ("COUNT", "PULSE", "GAP")),
    ]
    always = [(sources, 1), (strobes, mask["ARM_INDEX"]), (strobes, mask["CAPTURE_NEXT"])]
    check = [(base + DEFINES["FEEDBACK_COUNTS_PER_REVOLUTION"], 4096)]
    for absent, refused in (("capture", queue), ("compare", compare), ("encoder_check", check)):
        machine = CompiledNode(absent=(absent,))
        for address, value in (*queue, *compare, *check, *always):
            cause, _ = machine.request("write_register", address=address, value=value)
            assert cause == ("not_built" if (address, value) in refused else "ok")


def test_without_sine_and_cosine_the_position_comes_from_counts_after_power_up():
    machine, source = (
        CompiledNode(absent=WITHOUT_SINE),
        {"axis": 0, "parameter": PARAMETER["position_source"]["id"]},
    )
    chosen = DEFINES["FEEDBACK_POSITION_SOURCE_COUNTS_MASK"]
    assert machine.ask("get_parameter", **source)["value"] == 1
    assert machine.feedback_channels[0].word[DEFINES["FEEDBACK_POSITION_SOURCE"]] & chosen
    assert machine.request("set_parameter", **source, value=0)[0] == "not_built"
    machine.ask("set_parameter", **source, value=2)
    machine.ask("set_parameter", **source, value=1)
    assert CompiledNode().ask("get_parameter", **source)["value"] == 0


def test_without_sine_and_cosine_their_operations_are_not_built_and_the_others_work():
    operations = (
        ("signal", {}),
        ("calibration", {"action": 0}),
        ("get_correction", {}),
        ("get_harmonic", {"order": 1}),
        ("set_harmonic", {"order": 1, "cosine": 0, "sine": 0}),
        (
            "set_correction",
            {"sin_offset": 0, "cos_offset": 0, "gain": 65536, "quadrature_error": 0, "apply": 1},
        ),
    )
    machine = CompiledNode()
    for operation, fields in operations:
        machine.ask(operation, axis=0, **fields)
    machine = CompiledNode(absent=WITHOUT_SINE)
    for operation, fields in operations:
        assert machine.request(operation, axis=0, **fields)[0] == "not_built"
    machine.ask("encoder", axis=0)
    machine.ask("arm_scope", axis=0, trigger=0, before=0, every=1, level=0, amplitude=0)
    machine.run(50)
    assert not machine.feedback_channels[0].records


def test_a_move_of_days_is_refused():
    machine = homed()
    machine.set(velocity=1, travel_high=2**46)
    assert machine.request("move", axis=0, target=2**46)[0] == "too_long"
    assert machine.status()["state"] == "holding"


def test_an_axis_that_does_not_arrive_is_not_settled_but_continues_to_hold():
    machine = homed(settle_timeout=200, following_limit=2**31 - 1)
    machine.axes[0].seized = True
    machine.ask("move", axis=0, target=PERIOD)
    assert finish(machine) == "not_settled"
    assert machine.status()["state"] == "holding" and "enabled" in machine.status()["flags"]
    assert "settled" not in machine.status()["flags"]


def test_settling_means_the_whole_time_inside_the_window():
    machine = homed(settle_time=50, settle_timeout=2000)
    axis = machine.axes[0]
    machine.ask("move", axis=0, target=PERIOD)
    assert machine.run(5000, until=lambda: machine.status()["state"] == "settling")
    for _ in range(5):
        machine.run(30)
        assert machine.status()["ended"] == "running"
        axis.machine += PERIOD  # pushed out
        machine.poll()
    machine.run(60)
    assert machine.status()["ended"] == "ok"


# stop


def test_stop_decelerates_and_keeps_the_drive_on():
    machine = homed()
    machine.ask("move", axis=0, target=1500 * PERIOD)
    machine.run(100)
    before = machine.axes[0].position
    machine.axes[0].strobes = []
    machine.ask("stop", axis=0)
    assert [strobes for strobes, _ in machine.axes[0].strobes] == [
        CONTROLLED_STOP
    ] and machine.status()["state"] == "stopping"
    machine.ask("stop", axis=0)  # a second stop changes nothing
    assert len(machine.axes[0].strobes) == 1
    assert machine.request("move", axis=0, target=0)[0] == "busy"
    assert finish(machine) == "stopped"
    status = machine.status()
    assert status["state"] == "holding" and "enabled" in status["flags"]
    assert before < status["position"] < before + 200 * PERIOD
    machine.ask("move", axis=0, target=0)
    assert finish(machine) == "ok"


def test_stop_while_nothing_moves_is_done():
    machine = homed()
    machine.ask("stop", axis=0)
    assert machine.status()["ended"] == "ok" and machine.status()["state"] == "holding"
    machine.ask("enable", axis=0, on=0)
    machine.ask("stop", axis=0)


def test_stop_while_settling_ends_it():
    machine = homed(settle_time=500)
    machine.ask("move", axis=0, target=PERIOD)
    assert machine.run(5000, until=lambda: machine.status()["state"] == "settling")
    machine.ask("stop", axis=0)
    assert machine.status()["ended"] == "stopped"


# faults


@pytest.mark.parametrize(
    "fault", [name for name in FAULT if name not in ("limit_low", "limit_high", "following_error")]
)
def test_a_fault_ends_the_motion_and_is_named(fault):
    machine = homed()
    axis = machine.axes[0]
    machine.ask("move", axis=0, target=1500 * PERIOD)
    machine.run(100)
    axis.causes = FAULT[fault]
    machine.run(2)
    where, status = axis.position, machine.status()
    assert (status["state"], status["ended"]) == (
        "faulted",
        "ended_by_fault",
    ) and "enabled" not in status["flags"]
    assert (
        status["faults"] == status["first_fault"] == FAULT[fault]
        and not axis.player.moving
        and axis.control == 0
    )
    assert machine.ask("encoder", axis=0)["fault_position"] == where
    assert ("homed" in status["flags"]) == (
        fault != "encoder"
    )  # only an encoder fault loses the zero
    assert machine.request("move", axis=0, target=0)[0] == "faulted"

    if fault in ("estop", "drive", "cpu"):
        assert machine.request("reset_faults", axis=0)[0] == "fault_persists"
    axis.causes = 0
    machine.ask("reset_faults", axis=0)
    assert machine.status()["state"] == "off" and machine.status()["faults"] == 0
    machine.ask("enable", axis=0, on=1)
    assert machine.request("move", axis=0, target=0)[0] == (
        "ok" if fault != "encoder" else "not_homed"
    )


def test_a_fault_while_nothing_moves_leaves_the_outcome_of_the_last_motion():
    machine = homed()
    machine.axes[0].causes = FAULT["estop"]
    machine.run(2)
    assert machine.status()["state"] == "faulted" and machine.status()["ended"] == "ok"


def test_an_axis_that_cannot_follow_is_a_fault():
    machine = homed(following_limit=3 * PERIOD)
    machine.axes[0].seized = True
    machine.ask("move", axis=0, target=100 * PERIOD)
    assert (
        finish(machine) == "ended_by_fault"
        and machine.status()["faults"] == FAULT["following_error"]
    )
    machine.axes[0].seized = False
    machine.ask("reset_faults", axis=0)
    machine.ask("enable", axis=0, on=1)
    assert machine.status()["state"] == "holding"


def test_reset_without_a_fault_does_not_switch_the_drive_off():
    machine = homed()
    machine.axes[0].strobes = []
    machine.ask("reset_faults", axis=0)
    assert machine.status()["state"] == "holding" and machine.axes[0].strobes == []


def test_a_pulse_that_was_too_short_is_a_fault_only_where_the_mask_says_so():
    machine, short = CompiledNode(), DEFINES["AXIS_ENCODER_EVENTS_PULSE_TOO_SHORT_MASK"]
    assert machine.axes[0].word[DEFINES["AXIS_ENCODER_FAULT_MASK"]] & short == 0
    machine.set(encoder_fault_mask=short)
    assert machine.axes[0].word[DEFINES["AXIS_ENCODER_FAULT_MASK"]] == short == 32


def test_reset_clears_the_encoder_events():
    machine = CompiledNode()
    machine.axes[0].word[DEFINES["AXIS_ENCODER_EVENTS"]] = 0b110101
    assert machine.status()["encoder_events"] == 0b110101
    machine.ask("reset_faults", axis=0)
    assert machine.status()["encoder_events"] == 0


def test_reset_is_requested_with_enable_off():
    machine = homed()
    axis = machine.axes[0]
    axis.causes = FAULT["estop"]
    machine.run(1)
    axis.causes, axis.strobes = 0, []
    machine.ask("reset_faults", axis=0)
    assert [(strobes, control & ENABLE) for strobes, control in axis.strobes] == [(RESET, 0)]


def test_running_into_a_switch_is_a_fault_and_the_axis_can_leave_it():
    machine = homed(Axis(position=50 * PERIOD, low=0, high=300 * PERIOD))
    axis = machine.axes[0]
    machine.ask("move", axis=0, target=1000 * PERIOD)
    assert (
        finish(machine) == "ended_by_fault"
        and machine.status()["first_fault"] == FAULT["limit_high"]
    )
    machine.ask("reset_faults", axis=0)
    machine.ask("enable", axis=0, on=1)
    machine.run(10)
    assert axis.pressed_high and axis.control & HOMING and machine.status()["state"] == "holding"
    machine.ask("move", axis=0, target=0)
    assert (
        finish(machine) == "ok" and not axis.control & HOMING
    )  # off the switch it is a fault again
    machine.ask("move", axis=0, target=1000 * PERIOD)
    assert finish(machine) == "ended_by_fault"


def test_faults_of_one_axis_leave_the_other_alone():
    machine = CompiledNode(Axis(), Axis())
    for axis in (0, 1):
        machine.ask("enable", axis=axis, on=1)
    machine.axes[1].causes = FAULT["encoder"]
    machine.run(5)
    assert (
        machine.status(axis=0)["state"] == "holding"
        and machine.status(axis=1)["state"] == "faulted"
    )


# home


def zero_position(axis):
    """Position of the zero of the node, in coordinates of the machine."""
    return -axis.origin


@pytest.mark.parametrize(
    "offset", [0, 1, PERIOD // 2 - 1, PERIOD // 2, PERIOD - 1, 17 * PERIOD + 12345]
)
def test_home_puts_the_zero_at_a_phase_zero_a_distance_from_the_edge(offset):
    machine = homed(Axis(position=50 * PERIOD, low=-10 * PERIOD + offset))
    axis, answer = machine.axes[0], machine.ask("encoder", axis=0)
    edge = axis.low_at + PERIOD // 2  # where the switch opens
    assert zero_position(axis) % PERIOD == 0
    request = (
        zero_position(axis) + answer["home_phase"]
    )  # edge + distance, as the firmware measured it
    assert abs(answer["home_phase"]) <= PERIOD // 2
    assert abs(request - edge - DISTANCE) < PERIOD // 8  # the motion of a poll
    assert axis.position == axis.target == 0 and machine.status()["state"] == "holding"
    assert (
        machine.status()["flags"] == {"enabled", "homed", "settled"} and not axis.control & HOMING
    )


def test_home_stops_its_latch_motion_when_the_switch_opens():
    machine = homed()
    assert [strobes for strobes, _ in machine.axes[0].strobes].count(CONTROLLED_STOP) == 1


def test_the_target_follows_an_axis_that_slides_into_its_switch():
    axis = Axis(position=50 * PERIOD, low=0)
    machine = enabled(axis, following_limit=8 * PERIOD)
    machine.ask("home", axis=0)
    assert machine.run(1000, until=lambda: axis.pressed_low)
    machine.poll()
    axis.seized = True
    for _ in range(20):
        axis.machine -= PERIOD
        machine.run(1)
    axis.seized = False
    assert axis.machine < -19 * PERIOD and finish(machine) == "ok"


def test_the_longest_search_stays_inside_the_numbers():
    axis = Axis()
    machine = enabled(
        axis, travel_low=-(2**47), travel_high=2**47 - 1, homing_search_speed=1_000_000
    )
    machine.ask("home", axis=0)
    while not axis.pushed[-1][4]:
        axis.player.queue.clear()  # as if they had been played
        machine.poll()
    assert distance(segment[:4] for segment in axis.pushed) == -(2**46) << 24


def test_home_returns_to_a_switch_that_the_axis_bounced_off():
    axis = Axis(position=50 * PERIOD, low=0)
    machine = enabled(axis)
    machine.ask("home", axis=0)
    assert machine.run(1000, until=lambda: axis.pressed_low)
    axis.machine = 7 * PERIOD
    assert finish(machine) == "ok"
    request = zero_position(axis) + machine.ask("encoder", axis=0)["home_phase"]
    assert abs(request - DISTANCE - PERIOD // 2) < PERIOD // 8


def test_home_works_at_the_high_end_too():
    machine = homed(Axis(position=0, high=33 * PERIOD), home_end=1)
    request = zero_position(machine.axes[0]) + machine.ask("encoder", axis=0)["home_phase"]
    assert abs(request - (33 * PERIOD - PERIOD // 2 - DISTANCE)) < PERIOD // 8


@pytest.mark.parametrize("depth", [0, PERIOD // 3, 20 * PERIOD])
def test_home_from_a_pressed_switch_leaves_it_first(depth):
    axis = Axis(position=-depth, low=0)
    machine = homed(axis)
    assert axis.pushed[0][2] > 0  # the first jerk leads away
    request = zero_position(axis) + machine.ask("encoder", axis=0)["home_phase"]
    assert abs(request - DISTANCE - PERIOD // 2) < PERIOD // 8


def test_home_twice_finds_the_same_zero():
    axis = Axis(position=50 * PERIOD, low=777)
    machine = homed(axis)
    first = zero_position(axis)
    machine.ask("move", axis=0, target=500 * PERIOD)
    assert finish(machine) == "ok"
    machine.ask("home", axis=0)
    assert "homed" not in machine.status()["flags"] and machine.status()["state"] == "homing"
    assert finish(machine) == "ok" and zero_position(axis) == first


def test_home_without_a_switch_ends_within_the_travel():
    machine = enabled(Axis(position=0))
    machine.ask("home", axis=0)
    assert finish(machine) == "no_switch"
    span = SHORT["travel_high"] - SHORT["travel_low"] + DISTANCE
    assert machine.axes[0].target == -span and machine.status()["flags"] == {"enabled", "settled"}


def test_home_with_a_switch_that_does_not_open_ends_after_the_home_distance():
    axis = Axis(position=30 * PERIOD, low=0)
    axis.stuck_low = True
    machine = enabled(axis)
    machine.ask("home", axis=0)
    assert finish(machine) == "switch_stuck" and axis.position < DISTANCE + PERIOD
    assert machine.request("move", axis=0, target=0)[0] == "not_homed"


def test_home_that_does_not_settle_reports_it():
    axis = Axis(position=30 * PERIOD, low=0)
    machine = enabled(axis, settle_timeout=100, following_limit=2**31 - 1)
    machine.ask("home", axis=0)
    assert machine.run(20_000, until=lambda: axis.position > DISTANCE)
    axis.seized = True
    axis.machine += PERIOD
    assert finish(machine) == "not_settled" and "homed" not in machine.status()["flags"]


@pytest.mark.parametrize("ms", STEPS_OF_HOMING)
def test_home_can_be_stopped_at_any_time(ms):
    axis = Axis(position=100 * PERIOD, low=0)
    machine = enabled(axis)
    machine.ask("home", axis=0)
    machine.run(ms)
    machine.ask("stop", axis=0)
    assert finish(machine) == "stopped"
    status = machine.status()
    assert status["state"] == "holding" and "homed" not in status["flags"] and status["faults"] == 0
    assert bool(axis.control & HOMING) == axis.pressed_low
    machine.ask("home", axis=0)
    assert finish(machine) == "ok"


@pytest.mark.parametrize("ms", STEPS_OF_HOMING)
def test_a_fault_ends_homing(ms):
    axis = Axis(position=100 * PERIOD, low=0)
    machine = enabled(axis)
    machine.ask("home", axis=0)
    machine.run(ms)
    axis.causes = FAULT["estop"]
    machine.run(2)
    status = machine.status()
    assert (
        (status["state"], status["ended"]) == ("faulted", "ended_by_fault")
        and axis.control == 0
        and "homed" not in status["flags"]
    )
