# SPDX-License-Identifier: Apache-2.0
"""Tests of fringe_tracker, unwrap and count_phase_check in series: full resolution without lag up
to a quarter period per sample, and whatever makes the position wrong is reported within two
samples, or the position is right again.
"""

import random
from pathlib import Path

import cocotb
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.interpolate.fringe_tracker import FringeTracker
from tb.position.count_phase_check import CountPhaseCheck
from tb.position.unwrap import Unwrap

PERIOD, QUARTER = 1 << 16, 1 << 14
# the quarter period between two counts, and as much again for comparators and lag
LIMIT = PERIOD // 2
SPACING = 6  # cycles from sample to sample, the fewest that the check can distinguish
LATENCY = 4  # cycles from phase to disagreement


class Scale:
    """The bench and its models; sample() moves the scale to a position and returns (position, alarm
    of this sample).
    """

    def __init__(self, dut):
        self.dut = dut

    async def begin(self):
        dut = self.dut
        dut.rst.value, dut.valid.value, dut.limit.value = 1, 0, LIMIT
        await FallingEdge(dut.clk)
        dut.rst.value = 0
        self.tracker, self.unwrap, self.coarse = FringeTracker(), Unwrap(), CountPhaseCheck()

    async def sample(self, true_position, phase=None, count=None):
        dut = self.dut
        phase = true_position % PERIOD if phase is None else phase
        dut.phase.value, dut.count.value, overspeed = (
            phase,
            true_position // QUARTER if count is None else count,
            0,
        )
        for cycle in range(SPACING):
            dut.valid.value = int(cycle == 0)
            await FallingEdge(dut.clk)
            overspeed |= int(dut.overspeed.value)
        step, expected_overspeed = self.tracker.follow(phase)
        position = self.unwrap.step(1, step, phase, 0)[1]
        for cycle in range(3):
            disagreement = self.coarse.step(
                0, int(cycle == 0), 0, step, dut.count.value.to_signed(), LIMIT
            )
        got = dut.position.value.to_signed(), overspeed, int(dut.disagreement.value)
        assert got == (position, expected_overspeed, disagreement)
        return got[0], bool(overspeed or got[2])


async def begin(dut):
    await start(dut, limit=LIMIT, valid=0, phase=0, count=0)
    return Scale(dut)


@cocotb.test()
async def latency_is_4_from_phase_to_disagreement(dut):
    scale = await begin(dut)
    await scale.begin()
    await scale.sample(100)
    dut.count.value, dut.valid.value = 40, 1
    for cycle in range(1, LATENCY + 1):
        await FallingEdge(dut.clk)
        dut.valid.value = 0
        assert int(dut.disagreement.value) == (cycle == LATENCY)


@cocotb.test()
async def every_bit_comes_through_without_lag_up_to_a_quarter_period_a_sample(dut):
    scale = await begin(dut)
    for speed in (1, -1, 77, -4095, 10_007, QUARTER - 1, 1 - QUARTER):
        await scale.begin()
        first = random.getrandbits(16)
        for n in range(40):  # from standstill to full speed at once, then constant
            true_position = first + n * speed
            assert await scale.sample(true_position) == (true_position, False)


@cocotb.test()
async def no_false_alarm_while_the_speed_changes_by_less_than_a_quarter_period_a_sample(dut):
    scale = await begin(dut)
    await scale.begin()
    true_position = random.getrandbits(16)
    speed, first = 0, None
    for _ in range(1500):
        speed = max(-PERIOD, min(PERIOD - 1, speed + random.randrange(1 - QUARTER, QUARTER)))
        true_position += speed
        position, alarm = await scale.sample(true_position)
        first = position - true_position if first is None else first
        assert (position - true_position, alarm) == (first, False)


@cocotb.test()
async def a_jump_by_whole_periods_is_reported_by_the_count_at_once(dut):
    scale = await begin(dut)
    for periods in (1, -1, 2, -5, 1000):
        await scale.begin()
        for n in range(4):
            assert await scale.sample(500 + n) == (500 + n, False)
        position, alarm = await scale.sample(504 + periods * PERIOD)
        assert (position, alarm) == (504, True)


@cocotb.test()
async def any_jump_that_makes_the_position_wrong_is_reported_within_two_samples(dut):
    scale = await begin(dut)
    for trial in range(300):
        await scale.begin()
        true_position, speed = random.getrandbits(16), random.randrange(1 - QUARTER, QUARTER)
        for _ in range(4):
            true_position += speed
            position, alarm = await scale.sample(true_position)
            assert not alarm
        wrong = position - true_position
        true_position += random.choice(
            (QUARTER, -QUARTER, PERIOD, random.randrange(-8 * PERIOD, 8 * PERIOD))
        )
        alarms = []
        for _ in range(2):
            true_position += speed
            position, alarm = await scale.sample(true_position)
            alarms.append(alarm)
        assert any(alarms) or position - true_position == wrong, f"trial {trial}"


@cocotb.test()
async def a_speed_above_the_limit_is_reported_within_two_samples(dut):
    scale = await begin(dut)
    for speed in (*range(QUARTER, 4 * PERIOD, 7001), PERIOD, 2 * PERIOD):
        for sign in (1, -1):
            await scale.begin()
            for _ in range(3):
                assert not (await scale.sample(9))[1]
            assert any([(await scale.sample(9 + sign * n * speed))[1] for n in (1, 2)])


@cocotb.test()
async def a_phase_that_is_stuck_while_the_count_continues_is_reported_within_two_samples(dut):
    scale = await begin(dut)
    for speed in (
        QUARTER,
        PERIOD // 2,
        -QUARTER,
        -PERIOD,
    ):  # an ADC that hangs: at a lower speed it takes 3/4 period
        await scale.begin()
        true_position = 20_000
        # accelerate in steps that the tracker follows
        while abs(true_position - 20_000) < 3 * PERIOD:
            increment = min(abs(speed), abs(true_position - 20_000) // 4 + QUARTER // 2)
            true_position += increment if speed > 0 else -increment
            _, alarm = await scale.sample(true_position)
            assert not alarm
        stuck, alarms = true_position % PERIOD, []
        for _ in range(2):
            true_position += speed
            alarms.append((await scale.sample(true_position, phase=stuck))[1])
        assert any(alarms), speed


@cocotb.test()
async def a_count_that_is_stuck_or_loses_edges_is_reported_when_it_is_half_a_period_off(dut):
    scale = await begin(dut)
    # counts; with a quarter period between counts, 3 are always detected
    for lost in (3, -3, 4, 100):
        await scale.begin()
        for n in range(4):
            assert not (await scale.sample(1000 + 99 * n))[1]
        assert (await scale.sample(1396, count=1396 // QUARTER - lost))[1]


def test_tracking(monkeypatch):
    monkeypatch.setattr(
        "tb.simulator.source_of", lambda top: Path(__file__).with_name(f"{top}.sv")
    )  # a bench top is not under rtl/
    run("tracking_bench", __file__)
