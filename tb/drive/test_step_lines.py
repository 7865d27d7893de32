# SPDX-License-Identifier: Apache-2.0
"""step_lines: the rates of lines by hand, exact ends over any number of lines, restarts, ticks that
come too soon, and random targets against the model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tb.bench import run, start
from tb.drive.step_lines import StepLines

ONE = 1 << 16
RATE_F = 36
STEP = 1 << RATE_F  # a step, as a line counts it
IDLE = dict(period=100, tick=0, valid=0, axis=0, target=0, restart_in=0, stopped=0)


class Lines:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.axes = dut, int(dut.AXES.value)
        self.model, self.inputs = StepLines(self.axes, RATE_F), dict(IDLE)
        self.given = []  # (cycle, axis, (rate, restart, steep)) of all rates
        self.starts, self.cycle = [], 0  # cycles in which lines began; this cycle

    async def reset(self, **inputs):
        self.inputs.update(inputs)
        await start(self.dut, **self.inputs)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        self.given, self.starts = [], []
        return self

    async def clk(self, rst=0, **inputs):
        self.inputs.update(inputs)
        levels = self.inputs | dict(rst=rst)
        self.inputs.update(tick=0, valid=0, restart_in=0)
        dut = self.dut
        for name, level in levels.items():
            getattr(dut, name).value = level
        await Timer(1, "ns")
        begins, idle, valid, given = self.model.clk(**levels)
        got = tuple(int(port.value) for port in (dut.line_start, dut.line_idle, dut.rate_valid))
        if self.cycle or not rst:
            assert got == (begins, idle, valid), f"cycle {self.cycle}, {levels}"
        if given:
            flags = (dut.rate_restart, dut.rate_steep)
            rate = (dut.rate.value.to_signed(), *(int(flag.value) for flag in flags))
            assert rate == given, f"cycle {self.cycle}, {levels}"
            self.given.append((self.cycle, valid.bit_length() - 1, given))
        if begins:
            self.starts.append(self.cycle)
        self.cycle += 1
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)

    async def wait(self, cycles):
        for _ in range(cycles):
            await self.clk()

    async def line(self, target, axis=0, **inputs):
        """A target (in 2^-16 step) and then the tick that begins its line; returns its rate."""
        first = len(self.given)
        await self.clk(valid=1, axis=axis, target=target, **inputs)
        await self.wait(self.inputs["period"] - 2)
        await self.clk(tick=1)
        return [rate for _, n, rate in self.given[first:] if n == axis][-1]


@cocotb.test()
async def rates_are_as_computed_by_hand(dut):
    lines = await Lines(dut).reset()
    assert await lines.line(5 * ONE // 2, stopped=1) == (0, 1, 0), "begins at 2"
    # 8 steps in 100 cycles, and 99 of the rest that rounds up: (8 2^36 + 99) / 100
    assert await lines.line(10 * ONE, stopped=0) == ((8 * STEP + 99) // 100, 0, 0)
    rest = (8 * STEP + 99) % 100
    assert await lines.line(7 * ONE) == ((-3 * STEP + rest) // 100, 0, 0)
    assert (await lines.line(7 * ONE))[0] == 0


@cocotb.test()
async def latency_is_rate_f_plus_4_from_a_target_to_its_rate(dut):
    lines = await Lines(dut).reset()
    for axis in range(lines.axes):
        await lines.line(0, axis=axis, restart_in=1)
    lines.given.clear()
    while int(lines.model.n) != lines.axes - 1:  # the first axis is looked at next
        await lines.clk()
    first = lines.cycle
    await lines.clk(valid=1, axis=0, target=ONE)
    await lines.wait(60)
    assert [cycle - first for cycle, *_ in lines.given] == [RATE_F + 4]


@cocotb.test()
async def the_end_of_every_line_is_its_target_and_less_than_a_period_of_the_lsb_more(dut):
    period = 61
    lines = await Lines(dut).reset(period=period)
    await lines.line(0, restart_in=1)
    place = target = 0  # of the line in 2^-36 step, of its end in 2^-16 step
    for _ in range(200):
        target += random.choice((0, 1, -1, random.randrange(-30 * ONE, 30 * ONE)))
        rate = (await lines.line(target))[0]
        place += rate * period
        above = place - (target << RATE_F - 16)
        assert 0 <= above < period and place >> RATE_F == target >> 16


@cocotb.test()
async def a_line_of_a_step_per_cycle_is_too_steep_and_one_of_less_is_not(dut):
    for period in (50, 100):
        top = period * ONE
        for distance, steep in ((top, 1), (top - 1, 0), (-top, 0), (-top - 1, 1), (-(2**47), 1)):
            lines = await Lines(dut).reset(period=period)
            await lines.line(0, restart_in=1)
            rate = await lines.line(distance)
            assert rate[1:] == (0, steep)
            if not steep:
                assert rate[0] == (STEP - 1 if distance > 0 else -STEP) or abs(rate[0]) < STEP


@cocotb.test()
async def the_wrap_of_target_is_no_distance(dut):
    lines = await Lines(dut).reset()
    await lines.line(2**47 - ONE, restart_in=1)
    assert await lines.line(-(2**47)) == ((STEP + 99) // 100, 0, 0)


@cocotb.test()
async def a_restart_that_a_later_target_replaces_is_not_lost(dut):
    lines = await Lines(dut).reset()
    await lines.line(0, restart_in=1)
    await lines.clk(valid=1, target=50 * ONE)
    await lines.wait(50)  # its rate waits for the next tick
    await lines.clk(valid=1, target=900 * ONE, restart_in=1)
    await lines.clk(valid=1, target=901 * ONE)
    await lines.clk(tick=1)
    await lines.wait(60)
    assert [rate[1] for *_, rate in lines.given][-2:] == [0, 1]


@cocotb.test()
async def a_tick_that_comes_too_soon_waits_and_no_line_is_lost(dut):
    period = 60
    lines = await Lines(dut).reset(period=period)
    await lines.line(0, restart_in=1)
    target, seen = 0, len(lines.given)
    lines.starts.clear()
    for _ in range(100):
        target += random.randrange(-4 * ONE, 8 * ONE)
        await lines.clk(valid=1, target=target)
        await lines.wait(random.randrange(45, 90))
        await lines.clk(tick=1)
    await lines.wait(3 * period)
    await lines.clk(tick=1)
    await lines.wait(3 * period)
    await lines.clk(tick=1)
    gaps = [later - sooner for sooner, later in zip(lines.starts, lines.starts[1:])]
    assert min(gaps) >= period
    place = sum(rate[0] * period for *_, rate in lines.given[seen:])
    assert place >> RATE_F - 16 == target


@cocotb.test()
async def after_a_tick_that_came_too_soon_lines_begin_with_the_ticks_again_once_no_axis_moves(dut):
    period = 60
    lines = await Lines(dut).reset(period=period)
    for wait in (20, *[period - 1] * 4):  # the first tick comes too soon
        await lines.clk(tick=1)
        await lines.wait(wait)
    assert lines.starts[-1] % period != (lines.cycle - period) % period, "lines are late"
    await lines.clk(stopped=(1 << lines.axes) - 1)
    await lines.wait(period // 3)
    lines.starts.clear()
    ticks = []
    for stopped in ((1 << lines.axes) - 1, 0, 0, 0):
        ticks.append(lines.cycle)
        await lines.clk(tick=1, stopped=stopped)
        await lines.wait(period - 1)
    assert lines.starts == ticks


@cocotb.test()
async def with_a_period_of_0_no_line_begins(dut):
    lines = await Lines(dut).reset(period=0)
    for _ in range(5):
        await lines.clk(valid=1, target=ONE, tick=1)
        await lines.wait(50)
    assert not lines.starts and all(rate[1] for *_, rate in lines.given)


@cocotb.test()
async def any_targets_match_the_model(dut):
    lines = await Lines(dut).reset()
    for axis in range(lines.axes):  # as after power-up: its step generator is stopped
        await lines.line(0, axis=axis, restart_in=1)
    targets = [0] * lines.axes
    for _ in range(15_000):
        inputs = {}
        if random.randrange(40) == 0:
            axis = random.randrange(lines.axes)
            speed = random.choice((0, 1, ONE, 20 * ONE, 90 * ONE, 2**47))
            targets[axis] += random.randint(-speed, speed)
            targets[axis] = (targets[axis] + 2**47) % 2**48 - 2**47
            restart = int(random.randrange(10) == 0)
            inputs.update(valid=1, axis=axis, target=targets[axis], restart_in=restart)
        if random.randrange(inputs.get("period", 90) + 2) == 0:
            inputs["tick"] = 1
        if random.randrange(300) == 0:
            inputs["stopped"] = random.choice((random.getrandbits(lines.axes), -1)) % 2**lines.axes
        if lines.model.state == "seek" and random.randrange(600) == 0:
            inputs["period"] = random.choice((0, 1, 2, 60, 100, 100, 2**18 - 1))
        await lines.clk(rst=int(random.randrange(3000) == 0), **inputs)


@pytest.mark.parametrize("axes", [1, 3, 8])
def test_step_lines(axes):
    run("step_lines", __file__, AXES=axes)
