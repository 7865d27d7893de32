# SPDX-License-Identifier: Apache-2.0
"""profile_player: by hand, against the closed form, at the ends of every range, and random events against the model."""
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from bench import run, start
from profile_player import ProfilePlayer, moved, wrap

PERIOD = 1 << 40                        # of velocity, acceleration and jerk
LSB = 1 << 24                           # of target, in the same unit
IDLE = dict(tick=0, push=0, segment_velocity=0, segment_acceleration=0, segment_jerk=0, segment_ticks=0, segment_last=0, start=0,
            brake=0, brake_rate=0, hold_here=0, position=0, shift=0, shift_periods=0)


class Player:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.clk_count, self.brake_rate = dut, ProfilePlayer(int(dut.DEPTH.value)), 0, 0

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.model.clk(rst=1)
        return self

    async def clk(self, **events):
        """One clk with these events (as ProfilePlayer.clk takes them); returns the pins after it."""
        dut, push, shift = self.dut, events.get("push"), events.get("shift")
        events.setdefault("brake_rate", self.brake_rate)
        for name in ("rst", "tick", "start", "brake", "hold_here", "position", "brake_rate"):
            getattr(dut, name).value = events.get(name, 0)
        dut.push.value, dut.shift.value, dut.shift_periods.value = push is not None, shift is not None, shift or 0
        (dut.segment_velocity.value, dut.segment_acceleration.value, dut.segment_jerk.value, dut.segment_ticks.value,
         dut.segment_last.value) = push or (random.getrandbits(63), 0, 0, 0, 0)
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        self.clk_count += 1
        want = self.model.clk(**events)
        got = (dut.target.value.to_signed(), dut.target_velocity.value.to_signed(), dut.target_acceleration.value.to_signed(),
               int(dut.moving.value), int(dut.queue_free.value), int(dut.underrun.value))
        assert got == want, f"clk {self.clk_count}, {events}: {got}, the model has {want}"
        self.target, self.velocity, self.acceleration, self.moving, self.free, self.underrun = got
        return got

    async def play(self, *segments):
        for segment in segments:
            await self.clk(push=segment)
        await self.clk(start=1)

    async def tick(self, idle=5, **events):
        """One tick and the clk after it; returns the underrun strobes seen."""
        strobes = (await self.clk(tick=1, **events))[-1]
        for _ in range(idle):
            strobes += (await self.clk())[-1]
        return strobes

    async def finish(self, most=10_000):
        ticks = 0
        while self.moving:
            await self.tick()
            ticks += 1
            assert ticks <= most
        return ticks


@cocotb.test()
async def by_hand(dut):
    player = await Player(dut).reset()
    await player.play((PERIOD, 0, 0, 2, 0), (PERIOD, -PERIOD // 2, 0, 2, 1))        # 1, 1, 1, 1/2 period
    targets = []
    for _ in range(5):
        await player.tick()
        targets.append(player.target / 65536)
    assert targets == [1, 2, 3, 3.5, 3.5] and not player.moving
    assert (player.velocity, player.acceleration) == (0, 0)


@cocotb.test()
async def latency_is_3(dut):
    player = await Player(dut).reset()
    await player.play((PERIOD, 0, 0, 2, 1))
    for _ in range(2):                                  # the first of a segment, and one inside it
        before, latency = player.target, 1
        await player.clk(tick=1)
        while player.target == before:
            await player.clk()
            latency += 1
        assert latency == 3
        await player.clk()
        await player.clk()


@cocotb.test()
async def ticks_may_follow_each_other_in_5_clk(dut):
    player = await Player(dut).reset()
    await player.play((PERIOD, 0, 0, 9, 0), (PERIOD, 0, 0, 1, 1))
    for n in range(10):
        await player.tick(idle=4)
        assert player.target == 65536 * (n + 1)
    assert not player.moving


@cocotb.test()
async def n_ticks_move_by_the_closed_form(dut):
    player = await Player(dut).reset()
    exact = 0                                           # 2^-40 period, the fraction carried through the profile
    for _ in range(12):
        segments = [(random.randrange(-1 << 44, 1 << 44), random.randrange(-1 << 36, 1 << 36), random.randrange(-1 << 31, 1 << 31),
                     random.randrange(1, 20), 0) for _ in range(random.randrange(1, 4))]
        segments[-1] = (*segments[-1][:4], 1)
        await player.play(*segments)
        assert await player.finish() == sum(s[3] for s in segments)
        exact += sum(moved(*s[:4]) for s in segments)
        exact = (exact + LSB // 2) // LSB * LSB         # a half goes up
        assert player.target == exact // LSB


@cocotb.test()
async def the_fraction_goes_on_from_segment_to_segment_and_ends_at_the_nearest_lsb(dut):
    player = await Player(dut).reset()
    third = LSB // 3
    await player.play((third, 0, 0, 1, 0), (third, 0, 0, 1, 0), (third, 0, 0, 1, 1))
    await player.tick()
    await player.tick()
    assert player.target == 0
    await player.finish()
    assert player.target == 1                           # 3 * floor(1/3 LSB): just below one, rounded to it
    await player.play((third, 0, 0, 1, 1))
    await player.finish()
    assert player.target == 1
    await player.play((LSB // 2, 0, 0, 1, 1))
    await player.finish()
    assert player.target == 2


@cocotb.test()
async def ends_of_the_range(dut):
    player = await Player(dut).reset()
    for v in (-1 << 63, (1 << 63) - 1):
        for a in (-1 << 63, (1 << 63) - 1):
            for j in (-1 << 31, (1 << 31) - 1):
                await player.play((v, a, j, 3, 1))
                await player.tick()
                assert player.velocity == (-1 << 31 if v < 0 else (1 << 31) - 1)         # held
                assert player.acceleration == (-1 << 31 if a < 0 else (1 << 31) - 1)
                await player.finish()
    for position in (-1 << 47, (1 << 47) - 1):
        await player.clk(hold_here=1, position=position)
        assert player.target == position
        sign = -1 if position < 0 else 1
        await player.play((sign * LSB, 0, 0, 1, 1))
        await player.finish()
        assert player.target == wrap(position + sign, 48)
        for periods in (-1 << 31, (1 << 31) - 1):
            before = player.target
            await player.clk(shift=periods)
            assert player.target == wrap(before + (periods << 16), 48)


@cocotb.test()
async def the_longest_segment_is_counted_in_24_bits(dut):
    player = await Player(dut).reset()
    await player.play((LSB, 0, 0, (1 << 24) - 1, 1))
    for _ in range(300):
        await player.tick()
    assert player.moving and player.target == 300


@cocotb.test()
async def a_full_queue_takes_no_more(dut):
    player = await Player(dut).reset()
    depth = int(dut.DEPTH.value)
    for n in range(depth + 2):
        assert player.model.depth - len(player.model.queue) == max(0, depth - n)
        await player.clk(push=(PERIOD, 0, 0, 1, int(n >= depth - 1)))
    assert player.free == 0
    await player.clk(start=1)
    assert await player.finish() == depth
    assert player.target == 65536 * depth and player.free == depth


@cocotb.test()
async def start_without_a_segment_does_nothing(dut):
    player = await Player(dut).reset()
    await player.clk(start=1)
    assert not player.moving
    assert await player.tick() == 0
    await player.clk(push=(PERIOD, 0, 0, 1, 1))
    await player.tick()
    assert player.target == 0 and not player.moving     # a queued segment waits for start


@cocotb.test()
async def segments_of_0_ticks_are_skipped(dut):
    player = await Player(dut).reset()
    await player.play((5 * PERIOD, 0, 0, 0, 0), (7 * PERIOD, 0, 0, 0, 0), (PERIOD, 0, 0, 2, 0), (9 * PERIOD, 0, 0, 0, 1))
    for want in (1, 2, 2):
        await player.tick()
        assert player.target == 65536 * want
    assert not player.moving
    await player.play((PERIOD, 0, 0, 0, 1))
    assert await player.finish() == 1 and player.target == 65536 * 2


@cocotb.test()
async def an_underrun_strobes_once_and_brakes(dut):
    player = await Player(dut).reset()
    player.brake_rate = 1 << 30                         # a quarter period/tick2
    await player.play((PERIOD, 0, 0, 2, 0))
    strobes, targets = 0, []
    for _ in range(8):
        strobes += await player.tick()
        targets.append(player.target / 65536)
    assert strobes == 1 and not player.moving
    assert targets == [1, 2, 3, 3.75, 4.25, 4.5, 4.5, 4.5]


@cocotb.test()
async def a_segment_that_comes_before_the_next_tick_is_no_underrun(dut):
    player = await Player(dut).reset()
    await player.play((PERIOD, 0, 0, 1, 0))
    await player.tick()
    await player.clk(push=(PERIOD, 0, 0, 1, 1))
    assert await player.tick() == 0 and player.target == 2 * 65536 and not player.moving


@cocotb.test()
async def brake_stops_at_the_rate_in_either_direction(dut):
    player = await Player(dut).reset()
    for sign in (1, -1):
        for velocity, rate in ((PERIOD, 1 << 30), (PERIOD + 12345, 1 << 30), (PERIOD, 0xFFFFFFFF), (PERIOD, 0), (0, 7), (LSB, 99)):
            player.brake_rate = rate
            await player.clk(hold_here=1, position=0)
            await player.play((sign * velocity, 0, 0, 100, 0), (PERIOD, 0, 0, 1, 1))
            await player.tick()
            step = rate << 8
            await player.clk(brake=1)
            assert player.free == int(dut.DEPTH.value) and player.moving
            await player.clk(push=(PERIOD, 0, 0, 1, 1))
            await player.clk(start=1)
            assert player.free == int(dut.DEPTH.value)                       # not while braking
            ticks, v, exact = 0, velocity, velocity
            while player.moving:
                await player.tick()
                ticks += 1
                exact, v = exact + v, max(0, v - step) if step else 0
            assert ticks == (max(1, -(-velocity // step)) if step else 1)
            assert player.target == (sign * exact + LSB // 2) // LSB
            assert (player.velocity, player.acceleration) == (0, 0)


@cocotb.test()
async def brake_at_rest_only_empties_the_queue(dut):
    player = await Player(dut).reset()
    await player.clk(push=(PERIOD, 0, 0, 1, 1))
    await player.clk(brake=1)
    assert player.free == int(dut.DEPTH.value) and not player.moving
    await player.play((PERIOD, 0, 0, 2, 1))
    assert await player.finish() == 2


@cocotb.test()
async def hold_here_stands_at_the_position_with_an_empty_queue(dut):
    player = await Player(dut).reset()
    await player.play((PERIOD + 5, 0, 0, 5, 0), (PERIOD, 0, 0, 1, 1))
    for wait in range(6):                               # in every phase of a tick
        await player.clk(tick=1)
        for _ in range(wait):
            await player.clk()
        await player.clk(hold_here=1, position=-777)
        assert (player.target, player.velocity, player.moving, player.free) == (-777, 0, 0, int(dut.DEPTH.value))
        await player.play((PERIOD + 5, 0, 0, 5, 0))


@cocotb.test()
async def a_shift_loses_no_step_in_any_clk(dut):
    player = await Player(dut).reset()
    for wait in range(7):
        await player.clk(hold_here=1, position=0)
        await player.play((PERIOD, 0, 0, 1, 1))
        await player.clk(tick=1)
        for n in range(9):
            await player.clk(shift=-3 if n == wait else None)
        assert player.target == -2 * 65536 and not player.moving


@cocotb.test()
async def reset_in_mid_flow(dut):
    player = await Player(dut).reset()
    for wait in range(5):
        await player.play((PERIOD, 0, 0, 5, 0), (PERIOD, 0, 0, 5, 1))
        await player.tick()
        await player.clk(tick=1)
        for _ in range(wait):
            await player.clk()
        await player.clk(rst=1)
        assert (player.target, player.moving, player.free) == (0, 0, int(dut.DEPTH.value))


@cocotb.test()
async def any_events_match_the_model(dut):
    player = await Player(dut).reset()
    chance = lambda one_in: random.randrange(one_in) == 0
    word = lambda bits: random.randrange(-1 << bits - 1, 1 << bits - 1) >> random.randrange(bits)
    gap = 0
    for _ in range(8000):
        gap -= 1
        events = dict(brake_rate=random.getrandbits(32) >> random.randrange(32))
        if gap <= 0 and chance(3):
            events["tick"], gap = 1, random.randrange(1, 12)
        if chance(6):
            events["push"] = (word(64), word(64), word(32), random.choice((0, 1, 1, 2, 3, 5)), int(chance(4)))
        if chance(15):
            events["start"] = 1
        if chance(150):
            events["brake"] = 1
        if chance(300):
            events["hold_here"], events["position"] = 1, word(48)
        if chance(20):
            events["shift"] = word(32)
        if chance(1000):
            events["rst"] = 1
        await player.clk(**events)


@pytest.mark.parametrize("depth", [4, 16])
def test_profile_player(depth):
    run("profile_player", __file__, DEPTH=depth)
