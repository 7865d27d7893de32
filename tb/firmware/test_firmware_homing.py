# SPDX-License-Identifier: Apache-2.0
"""homing.c: the methods of CiA 402, and of S3 with an index, on a simulated axis. The method of S0
is tested in test_firmware_axis.py.
"""

import random

import pytest

from tb.bench import seed
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import DEFINES, FAULT, INDEX, PARAMETER, PERIOD

QUARTER = PERIOD // 4
COUNTS = 1  # position_source
TRAVEL = {
    "travel_low": -500 * PERIOD,
    "travel_high": 500 * PERIOD,
    "home_distance": 300 * PERIOD,
    "homing_search_speed": 2000,
    "following_limit": 2**31 - 1,
}


def home(axis, method, source=COUNTS, meanwhile=None, **parameters):
    """How the homing ended, and the machine; `meanwhile` is called with it when the homing has
    begun.
    """
    machine = CompiledNode(axis)
    machine.set(**{**TRAVEL, "home_method": method, "position_source": source, **parameters})
    machine.ask("enable", axis=0, on=1)
    machine.ask("home", axis=0)
    if meanwhile:
        meanwhile(machine)
    assert machine.run(60_000, until=lambda: machine.status()["ended"] != "running")
    assert ("homed" in machine.status()["flags"]) == (machine.status()["ended"] == "ok")
    return machine.status()["ended"], machine


def zero_of(machine):
    """Position of the zero of the node on the machine."""
    return -machine.axes[0].origin


def zero_position(machine):
    machine.run(300)
    return machine.axes[0].machine


# to an index


@pytest.mark.parametrize(
    ("method", "start"),
    [(33, 90), (34, -90), (-2, 90), (-2, -90), (-2, 250), (-2, -250), (-2, 1), (-2, -1)],
)
@pytest.mark.parametrize("quarters", range(4))
def test_the_zero_is_the_count_of_the_index_from_either_side(method, start, quarters):
    index = 3 * PERIOD + quarters * QUARTER
    ended, machine = home(Axis(position=index + start * PERIOD, index=[index]), method)
    assert ended == "ok" and zero_of(machine) == index
    assert abs(zero_position(machine) - index) <= 1638  # and the axis is at that position


def test_many_searches_of_s3_give_the_same_count():
    source, zeros = random.Random(seed()), set()
    for _ in range(40):
        ended, machine = home(
            Axis(position=source.randrange(-290 * PERIOD, 290 * PERIOD), index=[QUARTER]), -2
        )
        assert ended == "ok"
        zeros.add(zero_of(machine))
    assert zeros == {QUARTER}


@pytest.mark.parametrize(("apart", "want"), [(4, 0), (9, 9)])
def test_a_search_of_s3_that_may_have_started_on_a_wide_index_passes_it_again(apart, want):
    """A gated index that is wider than a period is met a period later by an axis on it."""
    marks = [0, apart * QUARTER]
    ended, machine = home(Axis(position=0, index=marks), -2)
    assert ended == "ok" and zero_of(machine) == want * QUARTER


@pytest.mark.parametrize("distance", [PERIOD, 3 * PERIOD, 15 * PERIOD])
@pytest.mark.parametrize("side", [1, -1])
def test_s3_passes_the_index_from_far_enough_below_though_the_home_distance_is_short(
    distance, side
):
    index = 3 * PERIOD + QUARTER
    axis = Axis(position=index + side * (distance - QUARTER), index=[index])
    ended, machine = home(axis, -2, home_distance=distance)
    assert ended == "ok" and zero_of(machine) == index


DIRECTIONS = DEFINES["FEEDBACK_INDEX_UP_MASK"] | DEFINES["FEEDBACK_INDEX_DOWN_MASK"]


def uses_of_the_index(machine):
    """The directions in which the index is used, and the sources that are captured."""
    word = machine.feedback_channels[0].word
    return word[DEFINES["FEEDBACK_INDEX"]] & DIRECTIONS, word[DEFINES["FEEDBACK_CAPTURE_SOURCES"]]


@pytest.mark.parametrize(("end", "fields"), [("stop", {}), ("enable", {"on": 0}), ("estop", {})])
@pytest.mark.parametrize("caught", [False, True])
def test_a_search_that_is_given_up_leaves_the_index_for_both_directions(end, fields, caught):
    axis = Axis(position=0, low=-PERIOD if caught else None)

    def give_up(machine):
        machine.run(10, until=lambda: caught and axis.pressed_low)
        assert uses_of_the_index(machine) == (DEFINES["FEEDBACK_INDEX_DOWN_MASK"], INDEX)
        if end == "estop":
            axis.causes = FAULT["estop"]
        else:
            machine.ask(end, axis=0, **fields)

    ended, machine = home(axis, 33, meanwhile=give_up)
    assert ended == ("ended_by_fault" if end == "estop" else "stopped")
    assert uses_of_the_index(machine) == (DIRECTIONS, 0)


def test_a_search_that_the_planner_refuses_leaves_the_index_for_both_directions():
    machine = CompiledNode(Axis())
    machine.set(**{**TRAVEL, "home_method": 34, "profile": 2})
    machine.set(stepped_border_2=50_000, stepped_border_3=20_000)
    machine.ask("enable", axis=0, on=1)
    assert machine.request("home", axis=0)[0] == "stepped_profile_invalid"
    assert uses_of_the_index(machine) == (DIRECTIONS, 0)


def test_the_index_is_gated_by_the_levels_of_the_parameter_and_keeps_its_other_settings():
    machine = CompiledNode(Axis())
    register = machine.feedback_channels[0].word
    offset = DEFINES["FEEDBACK_INDEX"]

    def field(name):
        mask = DEFINES[f"FEEDBACK_INDEX_{name}_MASK"]
        return (register[offset] & mask) >> DEFINES[f"FEEDBACK_INDEX_{name}_SHIFT"]

    other = DEFINES["FEEDBACK_INDEX_ACTIVE_LOW_MASK"] | DEFINES["FEEDBACK_INDEX_UP_MASK"]
    register[offset] = other
    for value, (gate_mask, gate) in enumerate([(0, 0), (3, 0), (3, 1), (3, 3), (3, 2)]):
        machine.set(index_gate=value)  # {b, a}: A leads on the way up
        assert (field("GATE_MASK"), field("GATE")) == (gate_mask, gate)
        gates = gate_mask << DEFINES["FEEDBACK_INDEX_GATE_MASK_SHIFT"] | (
            gate << DEFINES["FEEDBACK_INDEX_GATE_SHIFT"]
        )
        assert register[offset] == other | gates
    known = PARAMETER["index_gate"]
    assert (
        machine.request("set_parameter", axis=0, parameter=known["id"], value=5)[0]
        == "out_of_range"
    )


def test_an_interpolated_scale_takes_the_phase_zero_nearest_to_the_index():
    index = 7 * PERIOD + PERIOD // 3
    ended, machine = home(Axis(position=-50 * PERIOD, index=[index]), 34, source=0)
    assert ended == "ok" and zero_of(machine) == 7 * PERIOD
    assert machine.ask("encoder", axis=0)["home_phase"] == PERIOD // 3


def test_the_zero_gets_the_position_home_offset():
    ended, machine = home(Axis(position=-50 * PERIOD, index=[PERIOD]), 34, home_offset=-20)
    assert (
        ended == "ok"
        and machine.axes[0].origin == -21 * PERIOD
        and abs(machine.status()["position"] + 20 * PERIOD) <= 1638
    )


@pytest.mark.parametrize(
    ("method", "start"), [(33, -90), (34, 90), (34, -320), (-2, -650), (-2, 650)]
)
def test_no_index_within_the_home_distance_is_reported(method, start):
    ended, machine = home(Axis(position=start * PERIOD, index=[0]), method)
    assert ended == "no_index" and machine.axes[0].enabled and machine.axes[0].faults == 0


def test_a_switch_on_the_way_reverses_s3_and_ends_the_one_sided_methods():
    def axis():
        return Axis(position=50 * PERIOD, low=-80 * PERIOD, high=100 * PERIOD, index=[0])

    ended, machine = home(axis(), -2)
    assert ended == "ok" and zero_of(machine) == 0 and machine.axes[0].faults == 0
    ended, machine = home(axis(), 34)
    assert ended == "no_index" and machine.axes[0].faults == 0 and machine.axes[0].enabled


# to a switch


@pytest.mark.parametrize(
    ("method", "low", "high", "sign"), [(17, -70, None, 1), (18, None, 70, -1)]
)
@pytest.mark.parametrize("start", [0, -90, 90])
def test_methods_17_and_18_take_the_edge_of_the_switch(method, low, high, sign, start):
    edges = {
        name: position * PERIOD
        for name, position in (("low", low), ("high", high))
        if position is not None
    }
    ended, machine = home(Axis(position=start * PERIOD, **edges), method)
    edge = sign * -70 * PERIOD + sign * PERIOD // 2  # where the switch of the node opens
    assert ended == "ok" and 0 <= sign * (zero_of(machine) - edge) <= PERIOD


@pytest.mark.parametrize(("method", "ends"), [(17, {"low": -400}), (18, {"high": 400})])
def test_a_switch_is_searched_over_the_whole_travel_however_short_home_distance_is(method, ends):
    axis = Axis(**{name: position * PERIOD for name, position in ends.items()})
    ended, machine = home(axis, method, home_distance=20 * PERIOD)
    assert ended == "ok" and 399 * PERIOD < abs(zero_of(machine)) < 401 * PERIOD


def test_a_switch_that_opens_while_the_axis_stops_is_approached_again():
    axis = Axis(low=-70 * PERIOD)

    def gives_way(machine):
        assert machine.run(60_000, until=lambda: axis.pressed_low)
        axis.low_at -= 60 * PERIOD

    ended, machine = home(axis, 17, meanwhile=gives_way)
    assert ended == "ok" and axis.faults == 0
    assert 0 <= zero_of(machine) - axis.low_at - PERIOD // 2 <= PERIOD


def test_the_delay_of_the_poll_does_not_shift_the_edge_of_the_switch():
    """The axis moves by more than half a period between two polls; the switch opens somewhere
    between them.
    """
    late = []
    for eighth in range(8):
        low = -70 * PERIOD + eighth * PERIOD // 8
        ended, machine = home(Axis(low=low), 17, homing_latch_speed=1000)
        assert ended == "ok"
        late.append((zero_of(machine) - low - PERIOD // 2) / PERIOD)
    assert max(map(abs, late)) <= 0.4 and abs(sum(late) / len(late)) <= 0.15, late


@pytest.mark.parametrize(("method", "switch", "sign"), [(1, "low", 1), (2, "high", -1)])
def test_methods_1_and_2_take_the_first_index_after_the_switch(method, switch, sign):
    marks = [sign * (-69 + n * 20) * PERIOD + QUARTER for n in range(-3, 5)]
    ended, machine = home(
        Axis(position=0, index=sorted(marks), **{switch: sign * -70 * PERIOD}), method
    )
    assert (
        ended == "ok"
        and zero_of(machine) == sign * -69 * PERIOD + QUARTER
        and machine.axes[0].faults == 0
    )
    ended, machine = home(Axis(position=0, **{switch: sign * -70 * PERIOD}), method)
    assert ended == "no_index"
    ended, machine = home(Axis(position=0), method)
    assert ended == "no_switch"


# here


@pytest.mark.parametrize("method", [35, 37])
def test_methods_35_and_37_take_the_present_position(method):
    ended, machine = home(Axis(position=12 * PERIOD + 3 * QUARTER), method)
    assert (
        ended == "ok"
        and zero_of(machine) == 12 * PERIOD + 3 * QUARTER
        and zero_position(machine) == 12 * PERIOD + 3 * QUARTER
    )


# bad input


@pytest.mark.parametrize("method", [0, 3, 16, 19, 32, 36])
def test_a_method_that_does_not_exist_is_refused(method):
    machine = CompiledNode()
    known = PARAMETER["home_method"]
    assert (
        machine.request("set_parameter", axis=0, parameter=known["id"], value=method)[0]
        == "out_of_range"
    )
    assert machine.ask("get_parameter", axis=0, parameter=known["id"])["value"] == known["default"]
