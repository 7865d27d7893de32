# SPDX-License-Identifier: Apache-2.0
"""Tests of fringe_tracker: steps by hand, speeds up to a period per sample, bad samples, and every
cycle against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import needs, run, start
from tb.interpolate.fringe_tracker import QUARTER, FringeTracker

IDLE = dict(valid=0, axis=0, phase=0)


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)


async def again(dut):
    """Reset while the clock runs."""
    dut.rst.value, dut.valid.value = 1, 0
    await FallingEdge(dut.clk)
    dut.rst.value = 0


async def clock(dut, valid, phase, axis=0):
    """Advance one cycle; returns done, step, overspeed."""
    dut.valid.value, dut.phase.value, dut.axis.value = valid, phase % 65536, axis
    before = dut.phase_out.value
    await FallingEdge(dut.clk)
    assert dut.phase_out.value == (phase % 65536 if valid else before)
    return int(dut.done.value), dut.step.value.to_signed(), int(dut.overspeed.value)


async def feed(dut, phases):
    return [(await clock(dut, 1, p))[1:] for p in phases]


@cocotb.test()
async def latency_is_1(dut):
    await begin(dut)
    dut.valid.value = 1
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert dut.done.value == 1


@cocotb.test()
async def known_phases_give_the_right_steps(dut):
    await begin(dut)
    assert await feed(dut, [65000, 65000, 65500, 500, 500, 65000]) == [
        (0, 0),
        (0, 0),
        (500, 0),
        (536, 0),
        (0, 0),
        (-1036, 0),
    ]


@cocotb.test()
async def the_step_has_no_lag(dut):
    await begin(dut)
    where = [n * n * 40 for n in range(200)]
    got = await feed(dut, where)
    assert got == [(0, 0)] + [(b - a, 0) for a, b in zip(where, where[1:])]


@cocotb.test()
async def a_change_of_speed_below_a_quarter_period_is_followed_up_to_a_period_a_sample(dut):
    await begin(dut)
    for change in (QUARTER - 1, 1 - QUARTER, 100, -100):
        await again(dut)
        where, speed = [0], 0
        while -65536 <= speed + change <= 65535:
            speed += change
            where.append(where[-1] + speed)
        while abs(speed) > abs(change):
            speed -= change
            where.append(where[-1] + speed)
        got = await feed(dut, where)
        assert got[1:] == [(b - a, 0) for a, b in zip(where, where[1:])]


@cocotb.test()
async def a_quarter_period_from_the_predicted_phase_is_an_overspeed(dut):
    await begin(dut)
    for jump, strobe in ((QUARTER - 1, 0), (QUARTER, 1), (1 - QUARTER, 0), (-QUARTER, 1)):
        await again(dut)
        assert (await feed(dut, [7, 7, 7 + jump]))[2] == (jump, strobe)


@cocotb.test()
async def the_limit_of_a_quarter_period_is_exact_at_any_speed(dut):
    await begin(dut)
    for n in range(1500):
        await again(dut)
        model, axis = FringeTracker(), n % int(dut.AXES.value)
        speed, phases = random.randrange(1 - QUARTER, QUARTER), [random.getrandbits(16)]
        for _ in range(random.choice((0, 3))):  # up to nearly a period a sample
            phases.append(phases[-1] + speed)
            speed += (QUARTER - 1) * (1 if speed > 0 else -1)
        phases += [phases[-1] + n * speed for n in range(1, 6)]
        for bad in (-3, -2):
            phases[bad] += random.choice((1, -1)) * (QUARTER + random.randrange(-1, 2))
        for phase in phases:
            want = model.step(1, phase % 65536)
            assert await clock(dut, 1, phase, axis) == want, (phases, phase)


@cocotb.test()
async def a_speed_of_a_period_a_sample_is_an_overspeed(dut):
    await begin(dut)
    for direction in (1, -1):
        await again(dut)
        steps = [n * 16000 for n in range(5)] + [65000, 66000]
        where = [direction * sum(steps[: n + 1]) for n in range(len(steps))]
        assert [o for _, o in await feed(dut, where)] == [0] * 6 + [1]


@cocotb.test()
async def one_bad_sample_costs_only_itself(dut):
    await begin(dut)
    for _ in range(60):
        await again(dut)
        speed, where = random.randrange(1 - QUARTER, QUARTER), random.getrandbits(16)
        phases, truth = [], []
        for n in range(30):
            phases.append(random.getrandbits(16) if n % 4 == 2 and n > 2 else where)
            truth.append(None if n % 4 == 2 and n > 2 else where)
            where += speed
        sum_of_steps = phases[0]
        for (step, _), true in zip(await feed(dut, phases), truth):
            sum_of_steps += step
            assert true is None or sum_of_steps == true


@cocotb.test()
async def after_noise_a_slow_scale_is_tracked_again(dut):
    await begin(dut)
    await feed(dut, [random.getrandbits(16) for _ in range(50)])
    slow = await feed(dut, [n * 4000 for n in range(20)])
    assert slow[6:] == [(4000, 0)] * 14


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    await begin(dut)
    model, phase, speed = FringeTracker(), 0, 0
    for cycle in range(20_000):
        rst, valid = int(random.random() < 0.003), random.getrandbits(1)
        speed = (
            max(-70_000, min(70_000, speed + random.randrange(-3000, 3000)))
            if random.random() > 0.01
            else -speed
        )
        phase += speed
        if random.random() < 0.02:
            phase = random.getrandbits(16)
        dut.rst.value = rst
        got = await clock(dut, valid, phase)
        want = model.step(valid, phase % 65536)
        if rst:
            model, want = FringeTracker(), (0, 0, 0)
        assert got == want, f"cycle {cycle}"


@cocotb.test()
async def axes_do_not_disturb_each_other(dut):
    axes = int(dut.AXES.value)
    needs(axes > 1, "one axis")
    await begin(dut)
    models = [FringeTracker() for _ in range(axes)]
    phases, speeds = [0] * axes, [random.randrange(-50_000, 50_000) for _ in range(axes)]
    for cycle in range(10_000):
        axis = random.randrange(axes)
        if random.random() < 0.01:
            speeds[axis] = -speeds[axis]
        phases[axis] += speeds[axis] + random.randrange(-1000, 1000)
        phase = random.getrandbits(16) if random.random() < 0.02 else phases[axis] % 65536
        rst = int(random.random() < 0.001)
        dut.rst.value = rst
        got, want = await clock(dut, 1, phase, axis), models[axis].step(1, phase)
        if rst:
            models, want = [FringeTracker() for _ in range(axes)], (0, 0, 0)
        assert got == want, f"cycle {cycle}"


@pytest.mark.parametrize("axes", [1, 5])
def test_fringe_tracker(axes):
    run("fringe_tracker", __file__, AXES=axes)
