# SPDX-License-Identifier: Apache-2.0
"""profile_player: motions by hand, motions against the spline of the profile, the ends of every
range, controlled stops within their limits, feed override, and random events against the model.
"""

import random
from fractions import Fraction

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.control.profile_player import FULL, ProfilePlayer, moved, wrap

PERIOD = 1 << 40  # of velocity, acceleration and jerk
LSB = 1 << 24  # of target, in the same unit
GAP, STOP_GAP, PUSH_GAP = 160, 350, 7  # cycles from tick to tick, as the header requires
SETTINGS = "slope", "curve", "feed_fraction", "pause", "stop_deceleration", "stop_jerk"
WORDS = "segment_velocity", "segment_acceleration", "segment_jerk", "segment_ticks", "segment_last"
EVENTS = (
    "rst",
    "tick",
    "start",
    "controlled_stop",
    "set_target_to_position",
    "position",
    "arm",
    "start_at",
    "now",
)
IDLE = dict.fromkeys(
    (
        "tick",
        "push",
        "segment_velocity",
        "segment_acceleration",
        "segment_jerk",
        "segment_ticks",
        "segment_last",
        "start",
        "controlled_stop",
        "set_target_to_position",
        "position",
        "shift",
        "shift_by",
        "arm",
        "start_at",
        "now",
        *SETTINGS,
    ),
    0,
)


class Player:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.clk_count = dut, ProfilePlayer(int(dut.DEPTH.value)), 0
        self.settings = dict(
            slope=0, curve=0, feed_fraction=65536, pause=0, stop_deceleration=0, stop_jerk=0
        )
        self.driven = {}
        self.constant = -1  # cycles for which the words of a segment must stay constant

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.model.clk(rst=1)
        return self

    async def clk(self, **events):
        """Advance one cycle with these events (as ProfilePlayer.clk takes them); return the outputs
        after it.
        """
        dut, push, shift = self.dut, events.get("push"), events.get("shift")
        events = self.settings | events
        pins = (
            dict.fromkeys(EVENTS, 0)
            | events
            | dict(push=int(push is not None), shift=int(shift is not None), shift_by=shift or 0)
        )
        for name, value in pins.items():
            if self.driven.get(name) != value:
                getattr(dut, name).value = value
        self.driven = pins
        if push is not None:
            self.constant = 7
            for name, word in zip(WORDS, push):
                getattr(dut, name).value = word
        elif self.constant == 0:
            dut.segment_velocity.value, dut.segment_ticks.value = (
                random.getrandbits(63),
                random.getrandbits(24),
            )
        self.constant -= self.constant >= 0
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        self.clk_count += 1
        want = self.model.clk(**events)
        got = (
            dut.target.value.to_signed(),
            dut.target_velocity.value.to_signed(),
            dut.target_acceleration.value.to_signed(),
            int(dut.moving.value),
            int(dut.armed.value),
            int(dut.queue_free.value),
            int(dut.underrun.value),
        )
        assert got == want, f"clk {self.clk_count}, {events}: {got}, the model has {want}"
        (
            self.target,
            self.velocity,
            self.acceleration,
            self.moving,
            self.armed,
            self.free,
            self.underrun,
        ) = got
        return got

    async def push(self, segment):
        """Queue a segment; its words are written when this returns."""
        await self.clk(push=segment)
        for _ in range(PUSH_GAP - 1):
            await self.clk()

    async def play(self, *segments):
        """Queue the segments, start, and give the first tick, which only prepares."""
        for segment in segments:
            await self.push(segment)
        await self.clk(start=1)
        await self.tick()

    async def tick(self, gap=None, **events):
        """Give a tick and the cycles after it; return the number of underrun strobes."""
        strobes = (await self.clk(tick=1, **events))[-1]
        for _ in range(
            (gap or (STOP_GAP if self.model.braking and not self.model.stop_ramp else GAP)) - 1
        ):
            strobes += (await self.clk())[-1]
        return strobes

    async def finish(self, most=10_000):
        """The targets to the end of the profile, one per tick."""
        targets = []
        while self.moving:
            await self.tick()
            targets.append(self.target)
            assert len(targets) <= most
        return targets


def positions(*segments):
    """The positions of the profile in 2^-40 period, and the number of the first one of each
    segment.
    """
    exact, place = [0], 0
    for velocity, acceleration, jerk, ticks, _ in segments:
        exact += [place + moved(velocity, acceleration, jerk, n + 1) for n in range(ticks)]
        place = exact[-1]
    return exact


def spline(exact, time):
    """The quadratic B-spline of positions that stand before and after, at a time from 0 to their
    number less one.
    """
    k = int(time)
    f = time - k
    before, here, after = (exact[max(0, min(n, len(exact) - 1))] for n in (k, k + 1, k + 2))
    # between the second and the third control point
    return (
        Fraction(before + here, 2) + f * (here - before) + f * f * (after - 2 * here + before) / 2
    )


@cocotb.test()
async def the_targets_of_a_short_profile_are_as_worked_out_by_hand(dut):
    player = await Player(dut).reset()
    await player.play(
        (PERIOD, 0, 0, 2, 0), (PERIOD, -PERIOD // 2, 0, 2, 1)
    )  # 1, 1, 1, 1/2 period, each step the mean of two
    assert player.target == 0
    assert [target / 65536 for target in await player.finish()] == [1.5, 2.5, 3.25, 3.5]
    assert (player.velocity, player.acceleration) == (0, 0)


@cocotb.test()
async def latency_is_2(dut):
    player = await Player(dut).reset()
    await player.play((PERIOD, 0, 0, 2, 1))
    for _ in range(2):  # inside a segment, and its last
        before, latency = player.target, 1
        await player.clk(tick=1)
        while player.target == before:
            await player.clk()
            latency += 1
        assert latency == 2
        for _ in range(GAP):
            await player.clk()


@cocotb.test()
async def latency_is_3_from_tick_to_target_acceleration(dut):
    player = await Player(dut).reset()
    await player.play((PERIOD, 0, 0, 9, 1))
    await player.clk(tick=1)
    await player.clk()
    assert (player.velocity, player.acceleration) != (0, 0) and player.acceleration == 0
    await player.clk()
    assert player.acceleration == player.velocity != 0


@cocotb.test()
async def ticks_may_follow_each_other_in_160_cycles(dut):
    """The first tick of a controlled stop needs 350 cycles here; with less the step would not be
    ready, and the tick would be lost.
    """
    player = await Player(dut).reset()
    player.settings |= dict(feed_fraction=65535, stop_deceleration=1 << 20, stop_jerk=1 << 25)
    await player.play((PERIOD, 0, 0, 9, 0), (PERIOD, 0, 0, 100, 1))
    for _ in range(30):
        before = player.target
        await player.tick(GAP)
        assert player.target != before
    await player.clk(controlled_stop=1)
    for n in range(20):
        before = player.target
        await player.tick(STOP_GAP if n < 2 else GAP)
        assert player.target != before


@cocotb.test()
async def n_ticks_move_by_the_closed_form(dut):
    player = await Player(dut).reset()
    exact = 0  # 2^-40 period, the fraction carried through the profile
    for _ in range(6):
        segments = [
            (
                random.randrange(-1 << 44, 1 << 44),
                random.randrange(-1 << 36, 1 << 36),
                random.randrange(-1 << 31, 1 << 31),
                random.randrange(1, 20),
                0,
            )
            for _ in range(random.randrange(1, 4))
        ]
        segments[-1] = (*segments[-1][:4], 1)
        await player.play(*segments)
        assert len(await player.finish()) == sum(s[3] for s in segments)
        exact += sum(moved(*s[:4]) for s in segments)
        exact = (exact + LSB // 2) // LSB * LSB  # a half is rounded up
        assert player.target == exact // LSB


@cocotb.test()
async def at_a_lower_rate_it_moves_the_same_distance_and_ends_on_the_same_bit(dut):
    """Against the spline in fractions: nothing of the player's own arithmetic but one rounding of
    each step.
    """
    player = await Player(dut).reset()
    jerk = (1 << 30) + 12345
    segments = ((0, 0, jerk, 5, 0), (10 * jerk, 5 * jerk, -jerk, 5, 0), (25 * jerk, 0, 0, 3, 1))
    exact = positions(*segments)
    for feed_fraction in (21845, 65535, 8192):
        rate = feed_fraction << 16
        await player.clk(set_target_to_position=1, position=0)
        player.settings["feed_fraction"] = feed_fraction
        await player.play(*segments)
        targets, time = await player.finish(), 0
        for n, target in enumerate(targets):
            time += rate
            where = Fraction(time, FULL)
            if where < len(exact) - 2:  # the velocity of this profile ends in a step
                assert abs(target + 0.5 - spline(exact, where) / LSB) <= 0.501, n
        assert player.target == (exact[-1] + LSB // 2) // LSB
        assert len(targets) == -(-13 * FULL // rate)


@cocotb.test()
async def at_a_lower_rate_every_step_keeps_the_limits_of_the_profile(dut):
    player = await Player(dut).reset()
    jerk = 1 << 30
    segments = (
        (0, 0, jerk, 8, 0),
        (28 * jerk, 8 * jerk, -jerk, 16, 0),
        (36 * jerk, -8 * jerk, jerk, 8, 1),
    )  # 36 = sum at the middle
    exact = positions(*segments)
    steps = [0, 0, 0, *(b - a for a, b in zip(exact, exact[1:])), 0, 0, 0]
    limits = []
    for _ in range(3):
        limits.append(max(map(abs, steps)))
        steps = [b - a for a, b in zip(steps, steps[1:])]
    for feed_fraction in (65536, 32768 + 123, 65536 // 3):
        rate = feed_fraction << 16
        player.settings["feed_fraction"] = feed_fraction
        await player.clk(set_target_to_position=1, position=0)
        await player.play(*segments)
        seen = [0, 0, 0]
        while player.moving:
            seen.append(player.model.step)  # the step that this tick makes
            await player.tick()
        seen += [0, 0, 0]
        for power, limit in enumerate(limits, start=1):
            assert max(map(abs, seen)) <= limit * (rate / FULL) ** min(power, 2) + 8, (rate, power)
            seen = [b - a for a, b in zip(seen, seen[1:])]


@cocotb.test()
async def after_a_pause_the_profile_continues_to_its_exact_end(dut):
    player = await Player(dut).reset()
    await player.play((PERIOD // 3, 0, 0, 20, 1))
    for _ in range(5):
        await player.tick()
    player.settings["pause"] = 1
    await player.tick()
    await player.tick()
    held = player.target
    for _ in range(5):
        await player.tick()
        assert (player.target, player.velocity, player.moving) == (held, 0, 1)
    player.settings["pause"] = 0
    await player.finish()
    assert player.target == (20 * (PERIOD // 3) + LSB // 2) // LSB


@cocotb.test()
async def the_fraction_is_carried_between_segments_and_rounded_at_the_end(dut):
    player = await Player(dut).reset()
    third = LSB // 3
    await player.play((third, 0, 0, 1, 0), (third, 0, 0, 1, 0), (third, 0, 0, 1, 1))
    await player.tick()
    await player.tick()
    assert player.target == 0
    await player.finish()
    assert player.target == 1  # 3 * floor(1/3 LSB) is just below one, and is rounded to it
    await player.play((third, 0, 0, 1, 1))
    await player.finish()
    assert player.target == 1
    await player.play((LSB // 2, 0, 0, 1, 1))
    await player.finish()
    assert player.target == 2


@cocotb.test()
async def the_ends_of_the_ranges_wrap_or_saturate(dut):
    player = await Player(dut).reset()
    for feed_fraction in (65536, 65535, 1, 131071):
        player.settings["feed_fraction"] = feed_fraction
        for v in (-1 << 63, (1 << 63) - 1):
            for a in (-1 << 63, (1 << 63) - 1):
                for j in (-1 << 31, (1 << 31) - 1):
                    await player.play((v, a, j, 3, 1))
                    await player.tick()
                    await player.tick()
                    await player.clk(set_target_to_position=1)
    player.settings["feed_fraction"] = 65536
    for position in (-1 << 47, (1 << 47) - 1):
        await player.clk(set_target_to_position=1, position=position)
        assert player.target == position
        sign = -1 if position < 0 else 1
        await player.play((sign * LSB, 0, 0, 1, 1))
        await player.finish()
        assert player.target == wrap(position + sign, 48)
        for by in (-1 << 47, -1, (1 << 47) - 1):
            before = player.target
            await player.clk(shift=by)
            assert player.target == wrap(before + by, 48)
    for velocity, shown in ((-1 << 60, -1 << 31), (1 << 60, (1 << 31) - 1)):
        await player.play((velocity, 0, 0, 3, 1))
        await player.tick()
        assert player.velocity == player.acceleration == shown  # saturated
        await player.finish()


@cocotb.test()
async def the_longest_segment_is_counted_in_24_bits(dut):
    player = await Player(dut).reset()
    await player.play((LSB, 0, 0, (1 << 24) - 1, 1))
    for _ in range(200):
        await player.tick()
    assert player.moving and player.target == 200


@cocotb.test()
async def a_full_queue_takes_no_more_segments(dut):
    player = await Player(dut).reset()
    depth = int(dut.DEPTH.value)
    for n in range(depth + 2):
        assert player.model.depth - len(player.model.queue) == max(0, depth - n)
        await player.push((PERIOD, 0, 0, 1, int(n >= depth - 1)))
    assert player.free == 0
    await player.play()
    assert len(await player.finish()) == depth
    assert player.target == 65536 * depth and player.free == depth


@cocotb.test()
async def start_without_a_segment_does_nothing(dut):
    player = await Player(dut).reset()
    await player.clk(start=1)
    assert not player.moving
    assert await player.tick() == 0
    await player.push((PERIOD, 0, 0, 1, 1))
    await player.tick()
    assert player.target == 0 and not player.moving  # a queued segment waits for start


@cocotb.test()
async def an_armed_player_starts_when_its_time_has_come(dut):
    player = await Player(dut).reset()
    for start_at in (
        5,
        2,
        0x7FFF_FFFF,
        0xFFFF_FFFF,
        0,
    ):  # also across the wrap, and a time in the past
        await player.push((PERIOD, 0, 0, 1, 1))
        time = (start_at - 4 if start_at != 2 else 100) % (1 << 32)
        await player.clk(arm=1, start_at=start_at, now=time)
        waited = 0
        assert player.armed
        while not player.moving:
            time = (time + 1) % (1 << 32)
            await player.clk(start_at=start_at, now=time)
            waited += 1
        assert time == start_at or (start_at == 2 and waited == 1)
        assert not player.armed
        await player.finish()
    for event in ("controlled_stop", "set_target_to_position"):
        await player.clk(arm=1, start_at=1000)
        await player.clk(**{event: 1}, start_at=1000)
        assert not player.armed
    await player.clk(arm=1, start_at=1000)
    await player.clk(start_at=1000, now=1000)  # there is nothing to play, now or later
    await player.clk(push=(PERIOD, 0, 0, 1, 1), start_at=1000, now=1001)
    await player.clk(start_at=1000, now=1002)
    assert not player.moving and not player.armed


@cocotb.test()
async def segments_of_0_ticks_are_skipped(dut):
    player = await Player(dut).reset()
    await player.play(
        (5 * PERIOD, 0, 0, 0, 0),
        (7 * PERIOD, 0, 0, 0, 0),
        (PERIOD, 0, 0, 2, 0),
        (9 * PERIOD, 0, 0, 0, 1),
    )
    assert await player.finish() == [65536 * 3 // 2, 65536 * 2]
    await player.play((PERIOD, 0, 0, 0, 1))
    assert await player.finish() == [65536 * 2]


@cocotb.test()
async def an_underrun_is_reported_once_and_stops(dut):
    player = await Player(dut).reset()
    player.settings |= dict(
        stop_deceleration=1 << 30, stop_jerk=0
    )  # a quarter period/tick2, at once
    await player.play((PERIOD, 0, 0, 4, 0))
    strobes, targets = 0, []
    while player.moving:
        strobes += await player.tick(STOP_GAP)
        targets.append(player.target / 65536)
    assert strobes == 1 and player.free == int(dut.DEPTH.value)
    steps = [b - a for a, b in zip([0, *targets], targets)]
    while steps[-1] == 0:
        steps.pop()
    assert steps == [1.5, 1, 1, 0.75, 0.5, 0.25]


@cocotb.test()
async def a_segment_that_comes_before_its_time_is_no_underrun(dut):
    player = await Player(dut).reset()
    await player.play((PERIOD, 0, 0, 2, 0))
    await player.push((PERIOD, 0, 0, 1, 1))
    assert await player.tick() == 0
    await player.finish()
    assert player.target == 3 * 65536


async def stop_from(player, velocity, acceleration, rate, jerk, feed_fraction=65536):
    """The steps of a controlled stop from about this state, and the limits that it must keep."""
    player.settings |= dict(stop_deceleration=rate, stop_jerk=jerk, feed_fraction=feed_fraction)
    await player.clk(set_target_to_position=1, position=0)
    await player.play((velocity - 3 * acceleration, acceleration, 0, 100, 0), (PERIOD, 0, 0, 1, 1))
    for _ in range(3):
        await player.tick()
    steps = []
    await player.clk(controlled_stop=1)
    assert player.free == int(player.dut.DEPTH.value) and player.moving
    await player.push((PERIOD, 0, 0, 1, 1))
    await player.clk(start=1)
    assert player.free == int(player.dut.DEPTH.value)  # no segment is taken while stopping
    first = player.model.change, player.model.step - player.model.change
    while player.moving:
        steps.append(player.model.step)  # the step that this tick makes
        await player.tick()
    assert (player.velocity, player.acceleration) == (0, 0)
    return first, steps


@cocotb.test()
async def a_controlled_stop_ends_at_standstill_within_its_limits_from_any_state(dut):
    player = await Player(dut).reset()
    for n in range(15):
        if n == 0:
            velocity, acceleration, rate, jerk = PERIOD >> 4, 0, 1 << 26, 1 << 31
        elif n == 1:
            velocity, acceleration, rate, jerk = -PERIOD >> 4, -(1 << 33), 1 << 25, 1 << 30
        elif n == 2:
            velocity, acceleration, rate, jerk = (
                1 << 31,
                -(1 << 34),
                1 << 27,
                1 << 31,
            )  # it decelerates too hard and moves back
        else:
            jerk = int(2 ** random.uniform(20, 31.9))
            rate = min((1 << 32) - 1, max(1, int((jerk >> 8) * 2 ** random.uniform(-2, 6))))
            increment = min(jerk, rate << 8)
            velocity = random.choice((1, -1)) * int(increment * 2 ** random.uniform(-2, 9))
            acceleration = random.choice((1, -1, 0)) * int((rate << 8) * random.uniform(0, 2))
        (before, step), steps = await stop_from(
            player, velocity, acceleration, rate, jerk, random.choice((65536, 65536, 21845))
        )
        increment = min(jerk, rate << 8)
        all_steps = [step - 0, *steps, 0, 0]
        changes = [b - a for a, b in zip(all_steps, all_steps[1:])]
        assert steps[-1] == 0
        top = abs(before)
        for old, new in zip(changes, changes[1:]):
            assert abs(new - old) <= increment, (
                f"jerk {abs(new - old)} above {increment} in run {n}"
            )
            assert abs(new) <= max(rate << 8, abs(old)), f"acceleration in run {n}"
        limit = min(rate << 8, 1 << 62)
        bound = (
            abs(step) / limit
            + 2 * (limit + top) / increment
            + (top + 2 * (top * top / increment)) / limit
            + 8
        )
        bound += 2 * (abs(step) / increment) ** 0.5 * 2
        assert len(steps) <= bound, f"{len(steps)} ticks, {bound} in run {n}"


@cocotb.test()
async def a_controlled_stop_takes_at_most_three_ticks_more_than_the_best_one(dut):
    """From constant velocity: v/A + A/J, or 2 sqrt(v/J) where A is not reached."""
    player = await Player(dut).reset()
    for velocity, rate, jerk in (
        (PERIOD >> 4, 1 << 26, 1 << 31),
        (PERIOD >> 3, 1 << 30, 1 << 31),
        (1 << 36, 1 << 25, (1 << 32) - 1),
        (-PERIOD >> 5, 1 << 25, 1 << 31),
    ):
        _, steps = await stop_from(player, velocity, 0, rate, jerk)
        increment, limit = jerk, rate << 8
        size = abs(velocity)
        best = (
            size / limit + limit / increment
            if limit * limit <= size * increment
            else 2 * (size / increment) ** 0.5
        )
        assert len(steps) <= best + 5, (len(steps), best)


@cocotb.test()
async def with_a_stop_deceleration_of_0_it_stops_in_one_step(dut):
    player = await Player(dut).reset()
    for velocity in (PERIOD, -PERIOD, 1):
        _, steps = await stop_from(player, velocity, 0, 0, 1 << 30)
        assert len(steps) == 2 and steps[-1] == 0  # the prepared step, and the stop


@cocotb.test()
async def a_controlled_stop_in_a_pause_ends_the_profile(dut):
    player = await Player(dut).reset()
    player.settings |= dict(stop_deceleration=1 << 30, stop_jerk=1 << 30)
    await player.play((PERIOD, 0, 0, 100, 1))
    await player.tick()
    player.settings["pause"] = 1
    for _ in range(3):
        await player.tick()
    held = player.target
    await player.clk(controlled_stop=1)
    await player.finish(most=6)
    assert abs(player.target - held) <= 1


@cocotb.test()
async def a_controlled_stop_at_standstill_only_empties_the_queue(dut):
    player = await Player(dut).reset()
    await player.push((PERIOD, 0, 0, 1, 1))
    await player.clk(controlled_stop=1)
    assert player.free == int(dut.DEPTH.value) and not player.moving
    await player.play((PERIOD, 0, 0, 2, 1))
    assert len(await player.finish()) == 2


@cocotb.test()
async def set_target_to_position_ends_the_profile_there_with_an_empty_queue(dut):
    player = await Player(dut).reset()
    for wait in (*range(8), 30, 60, 90):  # in every phase of a tick
        for segment in ((PERIOD + 5, 0, 0, 5, 0), (PERIOD, 0, 0, 1, 1)):
            await player.push(segment)
        await player.clk(start=1, feed_fraction=21845)
        if wait < 8:  # and in the cycle that makes a step
            for n in range(GAP):
                await player.clk(tick=int(n == 0), feed_fraction=21845)
        await player.clk(tick=1, feed_fraction=21845)
        for _ in range(wait):
            await player.clk(feed_fraction=21845)
        await player.clk(set_target_to_position=1, position=-777)
        assert (player.target, player.velocity, player.moving, player.free) == (
            -777,
            0,
            0,
            int(dut.DEPTH.value),
        )


@cocotb.test()
async def a_shift_loses_no_step_in_any_cycle(dut):
    player = await Player(dut).reset()
    for wait in range(7):
        await player.clk(set_target_to_position=1, position=0)
        await player.play((PERIOD, 0, 0, 1, 1))
        await player.clk(tick=1)
        for n in range(9):
            await player.clk(shift=-3 * 65536 if n == wait else None)
        assert player.target == -2 * 65536 and not player.moving


@cocotb.test()
async def reset_ends_the_profile_at_zero(dut):
    player = await Player(dut).reset()
    for wait in (*range(5), 40, 75):
        await player.play((PERIOD, 0, 0, 5, 0), (PERIOD, 0, 0, 5, 1))
        await player.tick()
        await player.clk(tick=1, feed_fraction=32768)
        for _ in range(wait):
            await player.clk(feed_fraction=32768)
        await player.clk(rst=1)
        assert (player.target, player.moving, player.free) == (0, 0, int(dut.DEPTH.value))


async def rates(player, ticks):
    """The rates of so many ticks, read from the velocity of a segment that shows them in 2^-30."""
    seen = []
    for _ in range(ticks):
        await player.tick()
        seen.append(player.velocity)
    return seen


ENDLESS = (1 << 54, 0, 0, (1 << 24) - 1, 1)


@cocotb.test()
async def the_rate_ramps_to_its_setting_as_worked_out_by_hand(dut):
    player = await Player(dut).reset()
    await player.play(ENDLESS)
    await rates(player, 3)
    player.settings |= dict(slope=1 << 29, curve=1 << 28, feed_fraction=0)
    assert [rate * 16 >> 30 for rate in await rates(player, 12)] == [
        16,
        15,
        13,
        11,
        9,
        7,
        5,
        3,
        1,
        0,
        0,
        0,
    ]


@cocotb.test()
async def every_ramp_of_the_rate_keeps_slope_and_curve_and_ends_at_the_setting(dut):
    player = await Player(dut).reset()
    await player.play(ENDLESS)
    seen = (await rates(player, 3))[-1:]  # the first step is half a step
    slope, curve = 1 << 29, 1 << 27
    player.settings |= dict(slope=slope, curve=curve)
    for _ in range(25):  # settings that change during a ramp make no jump
        player.settings |= dict(
            feed_fraction=random.choice((0, 1, 65535, 131071, random.randrange(65536))),
            pause=int(random.randrange(4) == 0),
        )
        seen += await rates(player, random.choice((1, 2, 5, 30)))
    seen += await rates(player, 40)
    setting = 0 if player.settings["pause"] else min(player.settings["feed_fraction"], 65536) << 14
    assert seen[-1] == setting
    increments = [b - a for a, b in zip(seen, seen[1:])]
    assert max(map(abs, increments)) <= slope + 4 >> 2 and all(
        abs(b - a) <= (curve >> 2) + 2 for a, b in zip(increments, increments[1:])
    )


@cocotb.test()
async def a_setting_that_changes_in_any_cycle_makes_no_jump(dut):
    """Without the model, which takes settings at once: the rate is read from the outputs alone."""
    player = await Player(dut).reset()
    await player.play(ENDLESS)
    seen = (await rates(player, 3))[-1:]  # the first step is half a step
    slope, curve = 1 << 29, 1 << 27
    dut.slope.value, dut.curve.value = slope, curve
    for _ in range(60):
        moment = random.randrange(50)
        for n in range(GAP):
            dut.tick.value = int(n == 0)
            if n == moment:
                dut.feed_fraction.value = random.randrange(65537)
            await RisingEdge(dut.clk)
            await FallingEdge(dut.clk)
        seen.append(dut.target_velocity.value.to_signed())
    increments = [b - a for a, b in zip(seen, seen[1:])]
    assert max(map(abs, increments)) <= slope + 4 >> 2 and all(
        abs(b - a) <= (curve >> 2) + 2 for a, b in zip(increments, increments[1:])
    )


@cocotb.test()
async def any_events_match_the_model(dut):
    player = await Player(dut).reset()
    chance = lambda one_in: random.randrange(one_in) == 0
    word = lambda bits: random.randrange(-1 << bits - 1, 1 << bits - 1) >> random.randrange(bits)
    setting = lambda bits: random.getrandbits(bits) >> random.randrange(bits + 1)
    wait = now = start_at = 0
    for _ in range(12000):
        wait, now = wait - 1, (now + 1) % (1 << 32)
        if chance(100):
            start_at = (now + random.randrange(-20, 100)) % (1 << 32)
        events = dict(now=now, start_at=start_at)
        if wait <= 0 and chance(3):
            if wait < -STOP_GAP or chance(
                3
            ):  # the settings stay constant until the step is prepared
                wait = STOP_GAP
                player.settings |= dict(
                    stop_deceleration=setting(32),
                    stop_jerk=setting(32),
                    slope=setting(32),
                    curve=setting(32),
                    feed_fraction=random.choice((65536, 65536, 0, setting(17))),
                    pause=int(chance(6)),
                )
            events["tick"], wait = (
                1,
                random.choice((GAP, GAP, STOP_GAP)) if chance(4) else STOP_GAP,
            )
        if chance(30) and player.constant <= 0:  # the words of the last segment are written
            events["push"] = (
                word(64),
                word(64),
                word(32),
                random.choice((0, 1, 1, 2, 3, 5)),
                int(chance(4)),
            )
        for name, one_in in (
            ("start", 60),
            ("arm", 300),
            ("controlled_stop", 1500),
            ("set_target_to_position", 2500),
            ("rst", 5000),
        ):
            if chance(one_in):
                events[name] = 1
        events["position"] = word(48)
        if chance(20):
            events["shift"] = word(48)
        await player.clk(**events)


@pytest.mark.parametrize("depth", [4, 16])
def test_profile_player(depth):
    run("profile_player", __file__, DEPTH=depth)
