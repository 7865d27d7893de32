# SPDX-License-Identifier: Apache-2.0
"""The survey of an index, on a scale whose edges are drawn again in each pass: what it finds, what
it warns of, what it refuses, and what it leaves behind.
"""

import random
import re

import pytest

from moire.client.index_survey import (
    LEAST_MARGIN,
    STATE_ERROR,
    Edge,
    Survey,
    best_count,
    margin,
    shift_of_index,
)
from moire.errors import MotionFailed, NotSurveyed, OutOfRange
from tb.bench import seed
from tb.fakes.bus_node import BusNode
from tb.fakes.index_axis import COUNT_NM, IndexAxis
from tb.host.call import Call, sentence
from twin.compiled.axis import Axis
from twin.compiled.tables import PERIOD

SHIFTS = (1 / 6, -1 / 9, -1 / 18, 1 / 9)  # duty 20 degrees, phase 10 degrees, rounded


def survey(axis, passes=6):
    return Survey(axis, passes, None).run()


@pytest.mark.parametrize("method", ["s3", "33", "34"])
def test_any_index_has_a_gate_that_always_finds_the_same_count_or_a_warning(method):
    source, warned, several = random.Random(seed()), 0, 0
    for number in range(150):
        axis = IndexAxis(
            (source.uniform(0, 4), source.choice((1, 1.5, source.uniform(1, 16)))),
            shifts=SHIFTS,
            scatter=0.05,
            index_scatter=source.uniform(0, 0.1),
            hysteresis=0.3,
            seed=number,
            home_method=method,
        )
        several += len(axis.zeros(20)) > 1
        found = survey(axis)
        zeros = axis.zeros(40)
        if found.warnings:
            warned += 1
        else:
            assert len(zeros) == 1 and found.margin_nm >= found.least_margin_nm, (
                axis.indexes,
                found,
            )
    assert warned <= 7 and several >= 10  # without a gate, many of them find several counts


@pytest.mark.parametrize(
    ("begins", "ends", "count", "clear"),
    [
        (0.25, 1.25, 0, 0.75 - STATE_ERROR),  # until the index begins after the end of count 0
        (0.6, 1.6, 1, 0.6),  # until it ends before count 1 begins
        (0.0, 1.0, 0, 1 - STATE_ERROR),
        (0.9, 9.0, 2, 1.9 - STATE_ERROR),  # until it begins in count -1, which has the same gate
        (0.2, 0.5, 0, 0.5 - STATE_ERROR + 0.3),
    ],
)
def test_the_gate_that_is_clear_of_both_edges_is_chosen(begins, ends, count, clear):
    leading, trailing = ([Edge(int(place // 1), place % 1)] for place in (begins, ends))
    found, margin_found = best_count(leading, trailing)
    assert found == count and margin_found == pytest.approx(clear)
    assert all(margin(other, leading, trailing) <= margin_found for other in range(-4, 12))


def test_the_margin_is_the_worst_of_all_passes():
    trailing = [Edge(5, 0.5)]
    one, other = Edge(1, 0.1), Edge(1, 0.4)
    assert margin(1, [one, other], trailing) == margin(1, [other], trailing)
    assert margin(4, [one, other], trailing) == pytest.approx(0.1)  # 1 has the same gate
    assert margin(4, [other], [Edge(4, 0.5), Edge(4, 0.2)]) == pytest.approx(0.2)
    assert margin(6, [other], trailing) < 0 and margin(0, [other], trailing) < 0


def test_a_narrow_index_on_an_edge_is_named_and_the_shift_that_it_needs_helps():
    axis = IndexAxis((4.9, 0.2), index_scatter=0.02, home_method="34")
    found = survey(axis)
    assert found.warnings == ("index_on_edge",) and found.margin_nm < found.least_margin_nm
    assert f"shift the index or the reading head by {found.shift_nm / 1000:+.2f} um" in (
        found.warning_words
    )
    moved = survey(IndexAxis((4.9 + found.shift_nm / COUNT_NM, 0.2), index_scatter=0.02))
    assert not moved.warnings and not moved.warning_words


def test_the_shift_of_a_downward_search_has_the_sign_of_the_position():
    found = survey(IndexAxis((4.97, 0.3), index_scatter=0.02, home_method="33"))
    assert found.warnings and found.shift_nm < 0  # most of it is in count 5 already
    moved = IndexAxis((4.97 + found.shift_nm / COUNT_NM, 0.3), index_scatter=0.02, home_method="33")
    assert not survey(moved).warnings


def test_where_no_shift_helps_the_warning_says_so():
    leading, trailing = [Edge(0, 0.1), Edge(0, 0.9)], [Edge(1, 0.0), Edge(1, 0.9)]
    assert shift_of_index(leading, trailing, 0.9) is None
    found = survey(IndexAxis((5.0, 1.0), index_scatter=0.45, seed=3))
    assert found.warnings and found.shift_nm is None and "no shift helps" in found.warning_words


def test_what_it_measures_is_what_the_scale_has_and_what_it_changed_is_restored():
    axis = IndexAxis((2.3, 3.5), index_scatter=0.05)
    axis.registers["index"] |= dict(up=0, each=0)
    found = survey(axis)
    assert found.width_nm == pytest.approx(3500, abs=100) and 20 < found.scatter_nm <= 100
    assert found.least_margin_nm == pytest.approx(LEAST_MARGIN * COUNT_NM + found.scatter_nm)
    assert found.gate == axis.get_parameter("index_gate").written() != "any"
    assert axis.zeros(20) == {axis.origin} and axis.homings == 22
    index = axis.registers["index"]
    assert (index["each"], index["active_low"], index["gate_mask"]) == (0, 0, 3)
    assert axis.registers["capture_sources"]["value"] == 0
    assert axis.get_parameter("velocity").written() == "50mm/s"


@pytest.mark.parametrize(
    ("axis", "cause", "words"),
    [
        (IndexAxis((0.3, 2), (250.3, 2)), "two_indexes", "2 indexes within 1mm, up to 250um apart"),
        (IndexAxis((0.3, 2), missed=0.5), "index_missed", "passes found it, the next one did not"),
        (IndexAxis((0.3, 2), travel_high="0.2mm"), "no_room", "travel is -5mm to 200um"),
        (IndexAxis((0.3, 2), slowness=8), "unsteady", "slower than homing_search_speed"),
        (IndexAxis((0.3, 1500)), "index_missed", "the index is wider than"),
    ],
)
def test_an_index_that_cannot_be_surveyed_is_refused_and_its_gate_remains(axis, cause, words):
    axis.write_parameter("index_gate", 2)
    with pytest.raises(NotSurveyed, match=words) as refused:
        survey(axis)
    assert refused.value.cause == cause
    assert axis.get_parameter("index_gate").written() == "a_high"
    assert axis.get_parameter("velocity").written() == "50mm/s"
    assert axis.registers["index"]["each"] == 0 and axis.registers["index"]["gate_mask"] == 3


def test_if_the_homing_at_the_end_fails_the_gate_is_as_before(monkeypatch):
    axis = IndexAxis((2.3, 3.5))
    axis.write_parameter("index_gate", 2)

    def home(*_):
        if axis.get_parameter("index_gate").written() not in ("any", "a_high"):
            raise MotionFailed("limit_low", 1, "the limit switch at the low end")
        real()

    real = axis.home
    monkeypatch.setattr(axis, "home", home)
    with pytest.raises(MotionFailed):
        survey(axis)
    assert axis.get_parameter("index_gate").written() == "a_high"


def test_an_index_that_its_gate_may_miss_is_reported_with_the_warning():
    causes = set()
    for number in range(40):
        try:
            survey(IndexAxis((4.95, 0.1), index_scatter=0.049, scatter=0.2, seed=number))
        except NotSurveyed as refused:
            causes.add(refused.cause)
            assert refused.cause != "index_on_edge" or "for every gate" in str(refused)
    assert "index_on_edge" in causes


def test_no_index_at_all_is_the_failure_of_homing():
    with pytest.raises(MotionFailed, match="no index was found"):
        survey(IndexAxis())


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"home_method": "35"}, "home_method 35 does not search the index"),
        ({"position_source": "phases"}, "needs position_source counts, not phases"),
        ({"decoder_mode": "every_second"}, "needs decoder_mode every_edge"),
        ({"segments": "linear"}, "needs segments off"),
        (
            {"homing_search_speed": "1.6mm/s"},
            r"homing_search_speed 1.6mm/s is too slow for a survey: .* to 1.09ms .* needs 1.65mm/s",
        ),
        ({"queue": False}, "needs the ages of captures: it needs HAS_CAPTURE of rtl/node.sv"),
    ],
)
def test_an_axis_that_has_no_such_count_is_refused_before_it_moves(parameters, words):
    axis = IndexAxis((0.3, 2), **parameters)
    with pytest.raises(OutOfRange, match=words):
        survey(axis)
    assert not axis.homings


# ---- through the command line, on the firmware: its index has no width, so it lies on an edge

SET = "params set position_source counts -- params set home_method s3 -- "


def test_the_command_prints_the_warning_and_its_remedy():
    node = BusNode(axes=[Axis(position=-90 * PERIOD, index=[PERIOD])])
    call = Call(f"{SET}index survey --passes 2 -- status", node)
    assert call.code == 0 and call.err == ""
    assert re.search(
        r"index_gate \w+, 0nm clear of the edges of A and B \(needed 20nm\)\n"
        r"WARNING index_on_edge: the index lies on an edge .* shift the index .* by [+-]0\.\d+ um",
        call.out,
    )
    assert "zero known" in call.out
    [*_, result] = Call(f"{SET}index survey --passes 2 --json", node).results
    assert result["warnings"] == ["index_on_edge"] and result["passes"] == 2


def test_the_command_refuses_with_the_cause():
    node = BusNode(axes=[Axis(position=-90 * PERIOD)])
    assert "no index was found" in sentence(Call(f"{SET}index survey", node), 1)
    assert "does not search the index" in sentence(
        Call("params set position_source counts -- index survey", BusNode()), 2
    )
