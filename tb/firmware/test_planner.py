# SPDX-License-Identifier: Apache-2.0
"""planner: every move ends exactly at its target, keeps its limits and is nearly the shortest."""

import ctypes
import random

import pytest

from tb.bench import seed
from tb.firmware.plan_model import distance, gone, limits, peaks, shortest, steps
from twin.compiled.firmware import Plan, Segment, SteppedProfile, library

FOREVER, LONGEST = 1 << 40, 0x800000
S0 = 6000, 125_000, 12_500_000  # the stage of S0: period/s, /s2, /s3
FEWEST_TICKS = 5
LONGER_TICKS = 4  # a move is at most this many ticks ...
LONGER = 1.001  # ... and this factor longer than the continuous optimum (jerk >= 10 000)
LONGER_AT_LOW_JERK = 1.03  # down to 1 period/s3, where one unit of jerk is 6 percent of it


def plan_of(length, rates=S0):
    """The segments of a move, and its ticks; None if it is refused."""
    made, plan = library().planner_limits(*rates), Plan()
    assert (made.velocity, made.acceleration, made.jerk) == limits(*rates)
    if not library().planner_move(ctypes.byref(plan), ctypes.byref(made), length):
        return None
    ticks = plan.ticks
    return segments_of(plan), ticks


def check(length, rates):
    plan, ticks = plan_of(length, rates)
    assert distance(plan) == length << 24, f"{length} at {rates}"
    assert (
        sum(s[3] for s in plan) == ticks
        and all(s[3] > 0 for s in plan)
        and (len(plan) <= 40 or ticks > LONGEST)
    )
    for peak, limit, name in zip(peaks(plan), limits(*rates), ("velocity", "acceleration", "jerk")):
        assert peak <= limit, f"{name} {peak} above {limit}: {length} at {rates}"
    best = shortest(abs(length) << 24, *limits(*rates))
    factor = LONGER if rates[2] >= 10_000 else LONGER_AT_LOW_JERK
    assert ticks <= max(FEWEST_TICKS, factor * best + LONGER_TICKS), (
        f"{ticks} ticks, optimum {best}: {length} at {rates}"
    )
    return ticks, best


def random_rates(draw):
    def spread(low, high):
        return int(low * (high / low) ** draw.random())

    return spread(1, 1_000_000), spread(1, 100_000_000), spread(1, 2_000_000_000)


def test_a_move_of_one_lsb_takes_five_ticks():
    plan, ticks = plan_of(1)
    assert ticks == 5 and distance(plan) == 1 << 24 and min(steps(plan)) >= -1


def test_the_closed_form_is_the_recursion():
    segment = (123456789, -98765, 432, 300)
    path = 0
    for n, step in enumerate(steps([segment])):
        assert gone(segment, n) == path
        path += step


def test_no_distance_is_no_segment():
    assert plan_of(0) == ([], 0)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    "length", [1, 2, 3, 65535, 65536, 65537, 125 << 16, 150_000 << 16, (1 << 38) - 1]
)
def test_a_move_of_s0_ends_exactly_at_its_target_inside_its_limits(length, sign):
    check(sign * length, S0)


def test_the_reverse_motion_is_the_mirror():
    for length in (1, 777, 123_456_789):
        there, back = plan_of(length)[0], plan_of(-length)[0]
        assert back == [(-v, -a, -j, n) for v, a, j, n in there]


def test_any_move_lands_exactly_inside_its_limits():
    draw = random.Random(seed())
    worst = {"S0": (0, 0), "any": (0, 0)}
    for n in range(6000):
        kind = "S0" if n % 3 == 0 else "any"
        rates = S0 if kind == "S0" else random_rates(draw)
        length = int(2 ** (draw.random() * 40)) * draw.choice((1, -1))
        if plan_of(length, rates) is None:
            assert shortest(abs(length) << 24, *limits(*rates)) > 2**29
            continue
        ticks, best = check(length, rates)
        if best > 40:
            worst[kind] = max(worst[kind], (ticks / best, ticks - best))
    print(
        f"worst time over optimum: S0 {worst['S0'][0]:.4f}, any limits {worst['any'][0]:.4f} "
        f"(moves above 40 ticks, seed {seed()})"
    )


@pytest.mark.parametrize(
    "rates",
    [
        (1_000_000, 1_000_000, 1),
        (1_000_000, 1_000_000, 2),
        (1_000_000, 1, 1_000_000_000),
        (30, 100_000_000, 2_000_000_000),
        (100, 300, 1),
    ],
)
def test_limits_of_few_units_are_reached_but_not_exceeded(rates):
    draw = random.Random(seed())
    highest = [0, 0, 0]
    for _ in range(1500):
        length = int(2 ** (10 + draw.random() * 26))
        check(length, rates)
        highest = [max(pair) for pair in zip(highest, peaks(plan_of(length, rates)[0]))]
    assert any(
        high >= limit - 9 - limit // 2**13 for high, limit in zip(highest, limits(*rates))
    )  # kept free for a retarget


def test_every_step_of_short_moves_is_inside_the_limits():
    """Checks `peaks` itself: all steps one by one, instead of the ends of segments."""
    draw = random.Random(seed())
    for _ in range(300):
        rates = random_rates(draw)
        plan = plan_of(int(2 ** (draw.random() * 30)) + 1, rates)
        if plan is None or plan[1] > 5000:
            continue
        seen = [0, 0, *steps(plan[0]), 0, 0]
        first = [b - a for a, b in zip(seen, seen[1:])]
        second = [b - a for a, b in zip(first, first[1:])]
        assert [max(map(abs, x)) for x in (seen, first, second)] == peaks(plan[0])


def test_a_plan_taken_in_pieces_is_the_same_motion():
    for length, rates in ((20_000 << 16, (1, 1, 1)), (9 << 16, S0), (1 << 35, (3, 1000, 77))):
        made, plan, piece, last = (
            library().planner_limits(*rates),
            Plan(),
            Segment(),
            ctypes.c_bool(),
        )
        assert library().planner_move(ctypes.byref(plan), ctypes.byref(made), length)
        pieces = []
        while library().planner_take_up_to(
            ctypes.byref(plan), ctypes.byref(piece), ctypes.byref(last), LONGEST
        ):
            pieces.append((piece.velocity, piece.acceleration, piece.jerk, piece.ticks))
            assert piece.ticks <= 0x800000 and last.value == (
                sum(p[3] for p in pieces) == plan.ticks
            )
        assert distance(pieces) == length << 24 and peaks(pieces) == peaks(
            plan_of(length, rates)[0]
        )


def continues(segment, other):
    """Whether a segment of a tick goes on as another one."""
    velocity, acceleration, jerk, _ = segment
    return other[:3] == (velocity + acceleration, acceleration + jerk, jerk)


QUEUE, SHORT = 16, 2  # segments that the player queues; ticks that become one segment


@pytest.mark.parametrize("rates", [S0, (125, *S0[1:]), "any", "trapezoid"])
def test_ticks_that_are_joined_to_one_segment_are_the_same_motion(rates):
    """Against the plan taken tick by tick. Only the last segment and one whose jerk does not fit
    into 32 bits, which a trapezoid alone can have, are shorter than two ticks.
    """
    draw = random.Random(seed())
    for _ in range(400):
        made = random_rates(draw) if rates == "any" else S0 if rates == "trapezoid" else rates
        inner = library().planner_limits(*made)
        if rates == "trapezoid":
            inner.jerk = 2**32 - 1
        length = int(2 ** (draw.random() * 22)) * draw.choice((1, -1))
        whole, ticked = Plan(), Plan()
        if not library().planner_move(ctypes.byref(whole), ctypes.byref(inner), length):
            continue
        if whole.ticks > 3000:
            continue
        ctypes.pointer(ticked)[0] = whole
        joined, single = segments_of(whole), taken(ticked, FOREVER, 1)
        assert list(steps(joined)) == list(steps(single))
        at = 0
        for _, acceleration, jerk, ticks in joined[:-1]:
            if ticks == SHORT and not continues(*single[at : at + 2]):
                assert acceleration + jerk == single[at + 2][0] - single[at + 1][0]
            at += ticks
        if rates != "trapezoid":
            assert all(segment[3] >= SHORT for segment in joined[:-1])


def test_a_short_motion_is_queued_as_a_whole_before_it_starts():
    """A motion of less than 8 ms never waits for the soft core; of a longer one, the full queue
    lasts 8 ms.
    """
    for length in range(1, 1 << 17, 61):
        ticks = [segment[3] for segment in plan_of(length)[0]]
        assert len(ticks) <= QUEUE or all(
            sum(ticks[n : n + QUEUE]) >= SHORT * QUEUE for n in range(len(ticks) - QUEUE)
        ), length


def test_a_move_of_days_is_refused():
    assert plan_of(1 << 47, (1, 1, 1)) is None


def plan_for(length, rates):
    made, plan = library().planner_limits(*rates), Plan()
    assert library().planner_move(ctypes.byref(plan), ctypes.byref(made), length)
    return plan, made


def segments_of(plan):
    return taken(plan, FOREVER, LONGEST)


def taken(plan, ticks, longest=64):
    """Takes pieces for a number of ticks."""
    pieces, piece, last = [], Segment(), ctypes.c_bool()
    while ticks and library().planner_take_up_to(
        ctypes.byref(plan), ctypes.byref(piece), ctypes.byref(last), min(longest, ticks)
    ):
        pieces.append((piece.velocity, piece.acceleration, piece.jerk, piece.ticks))
        ticks -= piece.ticks
    return pieces


def retargeted(plan, made, goal, ticks=0):
    """Whether the plan was changed; if not, it holds the cause."""
    new = Plan()
    done = library().planner_retarget(
        ctypes.byref(new), ctypes.byref(plan), ticks, ctypes.byref(made), goal, None
    )
    if done:
        ctypes.pointer(plan)[0] = new
    plan.cause = new.cause
    return done


def test_the_state_after_some_ticks_is_that_of_the_steps():
    every = list(steps(plan_of(125 << 16)[0]))
    for ticks in (0, 1, 7, 100, len(every) - 1, len(every)):
        plan, _ = plan_for(125 << 16, S0)
        pieces = taken(plan, ticks)
        assert all(piece[3] <= 64 for piece in pieces) and distance(
            pieces
        ) == plan.at.state.moved == sum(every[:ticks])
        assert list(steps(segments_of(plan))) == every[ticks:]


def test_retargets_land_exactly_inside_the_limits():
    """Up to four in a row, some of them a few ticks apart; none is refused."""
    draw = random.Random(seed())
    for n in range(1500):
        rates = (
            S0
            if n % 3 == 0
            else (
                draw.randrange(100, 50_000),
                draw.randrange(10_000, 5_000_000),
                draw.randrange(10**5, 10**9),
            )
        )
        goal = int(2 ** (10 + draw.random() * 20)) * draw.choice((1, -1))
        plan, made = plan_for(goal, rates)
        played = []
        for _ in range(draw.randrange(1, 5)):
            if plan.ticks - plan.at.tick < 2:
                break
            played += taken(
                plan, draw.randrange(1, min(plan.ticks - plan.at.tick, draw.choice((6, 1 << 30))))
            )
            goal += draw.choice((1, -1)) * int(2 ** (draw.random() * 30))
            assert retargeted(plan, made, goal)
        whole = played + segments_of(plan)
        assert distance(whole) == goal << 24, (rates, goal)
        for peak, limit, name in zip(
            peaks(whole), limits(*rates), ("velocity", "acceleration", "jerk")
        ):
            assert peak <= limit, (name, peak, limit, rates, goal)


def test_limits_lowered_in_motion_are_kept_afterwards():
    plan, made = plan_for(2000 << 16, S0)
    played = taken(plan, 600)  # it cruises
    lower = library().planner_limits(*(rate // 2 for rate in S0))
    assert retargeted(plan, lower, 3000 << 16)
    remaining = segments_of(plan)
    every = list(steps(remaining))
    assert distance(played + remaining) == 3000 << 40
    assert (
        lower.velocity < every[0] <= made.velocity
        and max(every) <= every[0] + 8
        and every[400] <= lower.velocity
    )
    slopes = [b - a for a, b in zip(every, every[1:])]
    assert (
        max(map(abs, slopes)) <= lower.acceleration
        and max(abs(b - a) for a, b in zip(slopes, slopes[1:])) <= lower.jerk
    )


def test_a_retarget_may_begin_some_ticks_ahead():
    for ticks in (1, 37, 300):
        plan, made = plan_for(2000 << 16, S0)
        taken(plan, 50)
        soon, _ = plan_for(2000 << 16, S0)
        played_soon = taken(soon, 50 + ticks)
        assert retargeted(plan, made, -300 << 16, ticks) and retargeted(soon, made, -300 << 16)
        remaining = segments_of(soon)
        assert segments_of(plan) == remaining and distance(played_soon + remaining) == -300 << 40


def test_a_refused_retarget_leaves_the_plan_as_it_was():
    plan, made = plan_for(125 << 16, S0)
    played = taken(plan, 50)
    assert not retargeted(plan, made, 1 << 38) and plan.cause == 4
    assert distance(played) + distance(segments_of(plan)) == 125 << 40


def test_a_retarget_to_the_same_target_ends_at_the_same_time():
    for ticks in (1, 40, 200):
        plan, made = plan_for(125 << 16, S0)
        whole, played = plan.ticks, taken(plan, ticks)
        assert retargeted(plan, made, 125 << 16)
        assert (
            abs(ticks + plan.ticks - whole) <= 2
            and distance(played + segments_of(plan)) == 125 << 40
        )


def test_an_override_adds_a_quarter_of_acceleration_and_jerk_at_most():
    made, slope, curve = library().planner_limits(*S0), ctypes.c_uint32(), ctypes.c_uint32()
    library().planner_feed_override(ctypes.byref(made), ctypes.byref(slope), ctypes.byref(curve))
    slope, curve = slope.value / 2**32, curve.value / 2**32
    assert (
        made.velocity * slope <= made.acceleration / 4
        and 3 * made.acceleration * slope + made.velocity * curve <= made.jerk / 4
    )
    assert slope > 0.999 * min(
        made.acceleration / made.velocity / 4, made.jerk / made.acceleration / 24
    )


def test_a_trapezoid_lands_exactly_with_steps_of_acceleration():
    made = library().planner_limits(*S0)
    made.jerk = 0xFFFFFFFF
    for length in (1, 100, 65536, 125 << 16, -(150_000 << 16)):
        plan = Plan()
        assert library().planner_move(ctypes.byref(plan), ctypes.byref(made), length)
        segments = segments_of(plan)
        assert distance(segments) == length << 24
        velocity, acceleration, _ = peaks(segments)
        assert velocity <= made.velocity and acceleration <= made.acceleration
        best = (abs(length) << 24) / made.velocity + made.velocity / made.acceleration
        if (abs(length) << 24) < made.velocity**2 / made.acceleration:
            best = 2 * ((abs(length) << 24) / made.acceleration) ** 0.5
        assert plan.ticks <= max(FEWEST_TICKS, LONGER * best + LONGER_TICKS)


def test_impossible_limits_are_refused_with_their_cause():
    for values, cause in (
        ((0, 999, 999), 1),
        ((999, 0, 999), 2),
        ((999, 999, 0), 3),
        ((999, 999, 1), 3),
    ):
        made, plan = library().planner_limits(*S0), Plan()
        made.velocity, made.acceleration, made.jerk = values
        assert (
            not library().planner_move(ctypes.byref(plan), ctypes.byref(made), 1000)
            and plan.cause == cause
        )
        whole, _ = plan_for(1000, S0)
        assert not retargeted(whole, made, 10) and whole.cause == cause


@pytest.mark.parametrize("as_printed", [False, True])
def test_a_stepped_profile_rises_by_sections_and_falls_as_its_mirror(as_printed):
    """S4: f0 = 50 Hz, steps of 50, 100, 200 Hz every 20 ms, to 2450 Hz; a period is a pulse."""
    hertz = 2**40 // 4000
    stepped = SteppedProfile(first=50 * hertz, top=2450 * hertz, ticks=80)
    stepped.rise[:] = 50 * hertz, 100 * hertz, 200 * hertz
    library().planner_stepped_borders(
        ctypes.byref(stepped), 65536 // 6 + 1, 65536 // 3 + 1 if as_printed else 65536 // 2
    )
    assert [round(border / hertz) for border in stepped.border] == [
        450,
        850 if as_printed else 1250,
    ]
    for pulses in (1, 7, 100, 5000, -20000):
        plan = Plan()
        assert library().planner_stepped_move(
            ctypes.byref(plan), ctypes.byref(stepped), pulses << 16
        )
        ticks, pieces = plan.ticks, taken(plan, FOREVER, LONGEST)
        assert distance(pieces) == pulses << 40 and sum(piece[3] for piece in pieces) == ticks
        assert all(piece[1:3] == (0, 0) for piece in pieces)
        assert pieces[0] == (0, 0, 0, 1)  # a tick at rest
        pieces = pieces[1:]
        levels = [abs(piece[0]) for piece in pieces]
        assert max(levels) <= stepped.top
    top = levels.index(max(levels))  # the longest move reaches it
    climb, fall = (
        [level // hertz for level in levels[:top]],
        [level // hertz for level in levels[:top:-1]],
    )
    middle = range(450, 850, 100) if as_printed else range(450, 1250, 100)
    assert climb == [*range(50, 450, 50), *middle, *range(middle.stop, 2450, 200)]
    assert (
        fall[: len(climb)] == climb and len(fall) <= len(climb) + 1
    )  # the top may be two pieces, one unit apart
    assert all(piece[3] == stepped.ticks for piece in pieces[:top] + pieces[-len(climb) :])
    stepped.border[1] = stepped.border[0] - 1
    assert (
        not library().planner_stepped_move(ctypes.byref(plan), ctypes.byref(stepped), 1 << 16)
        and plan.cause == 5
    )


@pytest.mark.parametrize("longest", [1, 30, 79, 81])
def test_a_stepped_profile_taken_in_short_pieces_is_the_same_motion(longest):
    def ticks_of(longest):
        plan, stepped = Plan(), SteppedProfile(first=1 << 20, top=9 << 20, ticks=80)
        stepped.rise[:], stepped.border[:] = [1 << 20] * 3, [3 << 20, 6 << 20]
        assert library().planner_stepped_move(ctypes.byref(plan), ctypes.byref(stepped), 1 << 10), (
            plan.cause
        )
        pieces = taken(plan, FOREVER, longest)
        assert max(piece[3] for piece in pieces) <= longest
        return [velocity for velocity, _, _, ticks in pieces for _ in range(ticks)]

    assert ticks_of(longest) == ticks_of(LONGEST)
