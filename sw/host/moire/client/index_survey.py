# SPDX-License-Identifier: Apache-2.0
"""The survey of an index: where its edges lie between those of A and B, and by which levels of A
and B it is gated so that a search always finds the same count.

The axis passes the index several times, always in the direction of its search. A capture has the
count at which the index began and the time since that count; at a constant speed this is the
distance from the edge of A or B. The same is measured where the index ends. A gated index counts
from the first state of A and B with the levels of the gate. This is always the same state if both
edges of the index keep clear of its ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING

from moire import units
from moire.client.built import remedy
from moire.client.capture import LONGEST_AGE
from moire.client.records import IndexSurvey
from moire.client.values import CHOICES
from moire.errors import MoireError, MotionFailed, NotSurveyed, OutOfRange

if TYPE_CHECKING:
    from moire.client.axis import Axis

STATES = 4  # of A and B in a period: the counts, and the gates
# the direction of the search that each method of homing ends with
DIRECTIONS = {1: 1, 2: -1, 33: -1, 34: 1, -2: 1}
PASSES = 6  # over each edge of the index
CHECKS = 3  # passes over the gated index
# counts by which a state of A and B may be shorter or longer than a quarter period: 30 degrees
STATE_ERROR = 1 / 3
LEAST_MARGIN = 0.1  # count, beside the scatter that was seen
CHATTER = 1.0  # count: edges of the index that are closer are one edge
NO_GATE = {"gate_mask": 0, "gate": 0}  # fields of the register
SLOWEST = 1.8  # counts in the time of one count at the speed of the search: it was not constant
TRIED_SHIFTS = 20  # of the index, in one count


@dataclass(frozen=True)
class Edge:
    """An edge of the index, in the direction of the search: so many counts behind the edge of A or
    B with which this count began.
    """

    count: int
    behind: float

    @property
    def place(self) -> float:
        """The position in counts."""
        return self.count + self.behind

    def shifted(self, counts: float) -> Edge:
        """The edge of an index that is mounted so many counts farther."""
        whole, behind = divmod(self.behind + counts, 1)
        return Edge(self.count + int(whole), behind)


def margin(count: int, leading: Iterable[Edge], trailing: Iterable[Edge]) -> float:
    """By how many counts the edges of the index may move until a gate that is open in this count
    finds another one; 0 or less: it finds another one already.
    """
    kept = []
    for edge in leading:
        if edge.count < count:  # it begins before this state: at least this state is left
            to_end = max(count + 1 - edge.place, count - edge.count) - STATE_ERROR
        else:
            to_end = count + 1 - edge.place - STATE_ERROR
        before = count - STATES + 1  # the state that the gate would find if the index began in it
        kept += [to_end, edge.place - before - (STATE_ERROR if edge.count > before else 0)]
    for edge in trailing:
        kept.append(edge.place - count - (STATE_ERROR if edge.count > count else 0))
    return min(kept)


def scatter(edges: Sequence[Edge]) -> float:
    """The range in which an edge was met, in counts."""
    places = [edge.place for edge in edges]
    return max(places) - min(places)


def best_count(leading: Sequence[Edge], trailing: Sequence[Edge]) -> tuple[int, float]:
    """The count that a gate finds most safely, and its margin in counts."""
    first = min(edge.count for edge in leading)
    last = max(edge.count for edge in trailing)
    found = {
        count: margin(count, leading, trailing)
        for count in range(first, min(last, first + 2 * STATES) + 1)
    }
    best = max(found, key=lambda count: found[count])
    return best, found[best]


def shift_of_index(leading: Sequence[Edge], trailing: Sequence[Edge], least: float) -> float | None:
    """The smallest shift of the index, in counts in the direction of the search, after which a gate
    has at least this margin; None if no shift helps.
    """
    for step in range(1, TRIED_SHIFTS + 1):
        for shift in (step / TRIED_SHIFTS, -step / TRIED_SHIFTS):
            moved = ([edge.shifted(shift) for edge in edges] for edges in (leading, trailing))
            if best_count(*moved)[1] >= least:
                return shift
    return None


class Survey:
    """One survey of the index of an axis."""

    def __init__(self, axis: Axis, passes: int, progress: Callable[[str], object] | None):
        self.axis, self.passes, self.progress = axis, passes, progress
        method = axis.get_parameter("home_method").counts
        if method not in DIRECTIONS:
            raise OutOfRange(f"home_method {method} does not search the index: set s3, 33 or 34")
        for name, needed in (("position_source", "counts"), ("decoder_mode", "every_edge")):
            if (value := axis.get_parameter(name)).written() != needed:
                raise OutOfRange(f"the survey needs {name} {needed}, not {value.written()}")
        if (value := axis.get_parameter("segments")).counts:
            raise OutOfRange("the survey needs segments off; switch them on again afterwards")
        if not axis.built().has("capture"):
            raise OutOfRange(f"the survey needs the ages of captures: {remedy('capture')}")
        self.up = DIRECTIONS[method] > 0
        self.count_nm = axis.period_nm / STATES
        self.index = {**axis.feedback("index"), **NO_GATE}
        self.speed = axis.get_parameter("homing_search_speed")
        longest_s = Fraction(LONGEST_AGE, axis.node.identity.clk_hz)
        least = Fraction(SLOWEST) * self.count_nm / longest_s / 10**6
        if self.speed.value < least:
            raise OutOfRange(
                f"homing_search_speed {self.speed.written(3)} is too slow for a survey: the node "
                f"measures up to {units.format_time(longest_s, 3)} from one count to the next, "
                f"which needs {units.format_speed(least, 3)}"
            )
        self.mark_nm = axis.get_parameter("home_offset").value
        self.travel_nm = tuple(axis.get_parameter(f"travel_{end}").value for end in ("low", "high"))
        acceleration, jerk = (axis.get_parameter(name).value for name in ("acceleration", "jerk"))
        seconds = self.speed.value / acceleration + acceleration / jerk
        # twice the distance after which the speed of the search is constant, from rest
        self.run_up_nm = self.speed.value * seconds * 10**6 + 2 * axis.period_nm

    def say(self, text: str) -> None:
        """Reports what is done next."""
        if self.progress is not None:
            self.progress(text)

    def run(self) -> IndexSurvey:
        """Surveys the index, sets index_gate, and homes the axis with it."""
        before = self.axis.get_parameter("index_gate")
        velocity = self.axis.get_parameter("velocity")
        surveyed = homed = False
        try:
            self.say("searching the index")
            self.axis.write_parameter("index_gate", 0)
            self.axis.home()
            self.axis.write_parameter("velocity", self.speed.counts)
            found = self.measure()
            surveyed = True
        finally:
            self.restore(None if surveyed else before.counts, velocity.counts)
        self.say("homing")
        try:
            self.axis.home()
            homed = True
        except MotionFailed as failed:
            if not found.warnings:
                raise
            raise NotSurveyed("index_on_edge", found.warning_words) from failed
        finally:
            if not homed:
                self.restore(before.counts, velocity.counts)
        return found

    def measure(self) -> IndexSurvey:
        """Passes the index until its gate is known, and sets it."""
        self.refuse_two_marks()
        leading = self.edges("where the index begins", {})
        trailing = self.edges("where the index ends", {"active_low": 1 - self.index["active_low"]})
        count, clear = best_count(leading, trailing)
        widest = max(scatter(leading), scatter(trailing))
        least = LEAST_MARGIN + widest
        gate = self.gate_of(count)
        checks = min(CHECKS, self.passes)
        self.say("checking the gate")
        again = [edge.count for _ in range(checks) for edge in self.cross(gated(gate))]
        self.axis.write_parameter("index_gate", gate)
        width = min(edge.place for edge in trailing) - max(edge.place for edge in leading)
        survey = IndexSurvey(
            gate=CHOICES["index_gate"][gate],
            margin_nm=self.nm(clear),
            least_margin_nm=self.nm(least),
            width_nm=self.nm(width),
            scatter_nm=self.nm(widest),
            passes=self.passes,
            warnings=(),
            shift_nm=None,
        )
        if clear >= least and again == [count] * checks:
            return survey
        shift = shift_of_index(leading, trailing, least + LEAST_MARGIN)
        upwards = 1 if self.up else -1
        return replace(
            survey,
            warnings=("index_on_edge",),
            shift_nm=None if shift is None else self.nm(upwards * shift),
        )

    def refuse_two_marks(self) -> None:
        """One pass over all that a search may reach: there must be one index alone."""
        reach = max(self.axis.get_parameter("home_distance").value, self.run_up_nm)
        edges = self.cross({}, reach)
        if edges and scatter(edges) > CHATTER:
            apart = self.nm(scatter(edges))
            raise NotSurveyed(
                "two_indexes",
                f"{len(edges)} indexes within {units.format_length(reach)}, up to "
                f"{units.format_length(round(apart))} apart: a search may find any of them; reduce "
                "home_distance, or mask all but one",
            )

    def edges(self, where: str, index: Mapping[str, int]) -> list[Edge]:
        """An edge of the index, met in each pass; `index` selects which one."""
        found: list[Edge] = []
        for number in range(self.passes):
            self.say(f"{where}: pass {number + 1} of {self.passes}")
            met = self.cross(index)
            if not met:
                raise NotSurveyed(
                    "index_missed",
                    f"{where}: {number} passes found it, the next one did not; the index is wider "
                    f"than {units.format_length(2 * self.run_up_nm)}, its signal is weak, or it "
                    "is shorter than deglitch at homing_search_speed",
                )
            if scatter(met) > CHATTER:
                raise NotSurveyed(
                    "two_indexes",
                    f"{where}: met {len(met)} times in one pass, "
                    f"{units.format_length(round(self.nm(scatter(met))))} apart: its signal drops "
                    "out, or there are several indexes",
                )
            found += met
        return found

    def gate_of(self, count: int) -> int:
        """The value of index_gate that is open in this count, from an index with any gate."""
        for gate in range(1, STATES + 1):
            self.say(f"looking for the levels of A and B: {CHOICES['index_gate'][gate]}")
            if met := self.cross(gated(gate)):
                states = (count - met[0].count) * (1 if self.up else -1)
                return (gate - 1 + states) % STATES + 1
        raise NotSurveyed(
            "index_missed",
            "the index was never met with a gate: it is shorter than the scatter of its edges; a "
            "slower homing_search_speed or a wider index is needed",
        )

    def cross(self, index: Mapping[str, int], reach_nm: Fraction | None = None) -> list[Edge]:
        """Passes the index once, with these fields of its register, and returns the edges that were
        met.
        """
        axis, reach = self.axis, reach_nm or self.run_up_nm
        near, far = self.ends(reach)
        axis.move(nm=near)
        directions = {"up": int(self.up), "down": int(not self.up)}
        axis.write_feedback("index", **{**self.index, **directions, "each": 1, **index})
        axis.write_feedback("strobes", capture_clear=1)
        axis.write_feedback("capture_sources", value=1)
        axis.move(nm=far)
        axis.write_feedback("capture_sources", value=0)
        captures, _ = axis.captures()
        speed = float(self.speed.value * 10**6 / self.count_nm)  # counts/s
        edges = []
        for capture in captures:
            count = round(Fraction(capture.position_nm) / self.count_nm)
            behind = capture.age_s * speed
            if behind > SLOWEST:
                raise NotSurveyed(
                    "unsteady",
                    f"the axis was slower than homing_search_speed at the index: {behind:.1f} "
                    "counts in the time of one; reduce homing_search_speed, or tune the servo",
                )
            edges.append(Edge(count if self.up else -1 - count, behind))
        return edges

    def ends(self, reach: Fraction) -> tuple[Fraction, Fraction]:
        """Where a pass starts and ends, in nm: as far as it has to, and as the travel allows."""
        mark, (low, high), least = self.mark_nm, self.travel_nm, self.run_up_nm
        if mark - least < low or mark + least > high:
            raise NotSurveyed(
                "no_room",
                f"a pass needs {units.format_length(least, 3)} on both sides of the index, and the "
                f"travel is {units.format_length(low, 6)} to {units.format_length(high, 6)}: "
                "reduce homing_search_speed, or widen the travel",
            )
        ends = max(low, mark - reach), min(high, mark + reach)
        return ends if self.up else (ends[1], ends[0])

    def nm(self, counts: float) -> float:
        """A length in nm."""
        return counts * float(self.count_nm)

    def restore(self, gate: int | None, velocity: int) -> None:
        """Restores what the survey has changed, as far as that is possible; the gate too, if it is
        given. An error here is dropped, since the one that ended the survey explains more.
        """
        try:
            self.axis.write_feedback("capture_sources", value=0)
            own = self.axis.feedback("index")
            gates = {name: own[name] for name in NO_GATE}
            self.axis.write_feedback("index", **{**self.index, **gates})
            self.axis.write_parameter("velocity", velocity)
            if gate is not None:
                self.axis.write_parameter("index_gate", gate)
        except MoireError:
            pass


def gated(gate: int) -> dict[str, int]:
    """The fields of the register that a value of index_gate above 0 sets."""
    state = gate - 1
    return {"gate_mask": 3, "gate": state ^ state >> 1}
