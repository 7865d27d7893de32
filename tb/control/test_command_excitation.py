# SPDX-License-Identifier: Apache-2.0
"""Tests of command_excitation: a waveform by hand, its period and its start, limits, what passes
unchanged, and random use against the model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, Timer

from tb.bench import run, start
from tb.control.command_excitation import COMMAND, CommandExcitation

IDLE = dict(
    axis=0,
    period=0,
    running=1,
    limit=32767,
    store=0,
    store_at=0,
    store_value=0,
    valid=0,
    result_axis=0,
    kind=0,
    result=0,
)
PASSED = ("axis", "period", "running", "limit", "valid", "result_axis", "kind", "result")


def known(n):
    """A value of the waveform."""
    return min(32767, 100 * n + 100)


async def begin(dut, values=16):
    """A waveform of which so many values are known, or all."""
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    model = CommandExcitation(int(dut.DEPTH.value))
    for n in range(min(values, model.depth)):
        await cycle(dut, model, store=1, store_at=n, store_value=known(n))
    await cycle(dut, model)
    return model


async def cycle(dut, model, **inputs):
    """Advance one cycle; the result as it passed."""
    given = IDLE | dict(rst=0) | inputs
    for name, value in given.items():
        getattr(dut, name).value = value
    await Timer(1, "ns")
    want = model.excited(**{name: given[name] for name in PASSED})
    got = dut.excited.value.to_signed()
    assert got == want, f"{got} passed, the model has {want}"
    assert int(dut.first.value) == model.first()
    await FallingEdge(dut.clk)
    model.step(**given)
    return got


async def command(dut, model, result=0, **settings):
    """A command of the axis, as far from the next one as commands are at least."""
    got = await cycle(dut, model, valid=1, kind=COMMAND, result=result, **{"period": 3} | settings)
    for _ in range(2):
        await cycle(dut, model, **{"period": 3} | settings)
    return got


@cocotb.test()
async def latency_is_0_and_2_to_the_next_value(dut):
    model = await begin(dut)
    assert [await command(dut, model, 7) for _ in range(7)] == [
        7 + value for value in (100, 200, 300, 100, 200, 300, 100)
    ]


@cocotb.test()
async def it_begins_with_value_0_after_it_was_off(dut):
    model = await begin(dut)
    assert [await command(dut, model) for _ in range(2)] == [100, 200]
    for off in (dict(period=0), dict(running=0)):
        assert await command(dut, model, 7, **off) == 7
        assert [await command(dut, model) for _ in range(2)] == [100, 200]
    await cycle(dut, model, period=3, rst=1)
    await cycle(dut, model, period=3)
    assert await command(dut, model) == 100


@cocotb.test()
async def the_sum_keeps_the_limit_both_ways(dut):
    model = await begin(dut)
    assert await command(dut, model, 32767) == 32767
    assert await command(dut, model, -32768, limit=500) == -500
    assert await command(dut, model, 32767, limit=500) == 500
    assert await command(dut, model, 5, limit=0) == 0
    await cycle(dut, model, store=1, store_at=0, store_value=-32768)
    await cycle(dut, model)
    assert await command(dut, model, -32768) in (-32767, -32768 + 200)


@cocotb.test()
async def a_sum_at_the_limit_passes_and_one_beyond_it_does_not(dut):
    model = await begin(dut)
    await cycle(dut, model, store=1, store_value=0)
    await cycle(dut, model)
    for limit in (*range(1, 9), 500, 32766):
        for size in (limit - 1, limit, limit + 1):
            for sign in (1, -1):
                got = await command(dut, model, sign * size, period=1, limit=limit)
                assert got == sign * min(size, limit)


@cocotb.test()
async def other_results_and_other_axes_pass_unchanged(dut):
    model = await begin(dut)
    for kind in range(8):
        for result_axis in range(8):
            if (kind, result_axis) != (COMMAND, 2):
                got = await cycle(
                    dut,
                    model,
                    axis=2,
                    period=3,
                    limit=1,
                    valid=1,
                    kind=kind,
                    result_axis=result_axis,
                    result=-(1 << 47),
                )
                assert got == -(1 << 47)
    assert int(dut.first.value)


@cocotb.test()
async def the_longest_periods_use_every_value(dut):
    model = await begin(dut, 4096)
    longest = model.depth
    for period in (longest, longest - 1, longest // 3, longest * 2 // 3):
        for n in (*range(period), 0):
            assert await command(dut, model, period=period) == known(n)
        for _ in range(2):
            await cycle(dut, model)  # off


@cocotb.test()
async def any_use_matches_the_model_in_every_cycle(dut):
    model, period, axis, since, running = await begin(dut), 0, 0, 9, 1
    for _ in range(8000):
        running ^= random.random() < 0.02
        if random.random() < 0.02:
            period, axis = random.randrange(min(16, model.depth) + 1), random.randrange(8)
            since = 0
        kind = COMMAND if since >= 3 and random.getrandbits(1) else random.choice([0, 1, 4, 7])
        valid = random.getrandbits(1)
        since = 0 if valid and kind == COMMAND else since + 1
        limit = random.choice([0, 32767, random.getrandbits(15), random.getrandbits(9)])
        near = random.choice([-limit, limit]) - (model.value or 0)
        near += random.choice([-1, 0, 1]) << random.randrange(10)
        await cycle(
            dut,
            model,
            axis=axis,
            period=period,
            running=running,
            limit=limit,
            valid=valid,
            result_axis=random.choice([axis, random.randrange(8)]),
            kind=kind,
            result=random.choice([random.randrange(-(1 << 15), 1 << 15), near]),
            rst=int(random.random() < 0.002),
        )
        if period == 0:
            await cycle(
                dut,
                model,
                axis=axis,
                store=1,
                store_at=random.randrange(4096),
                store_value=random.randrange(-(1 << 15), 1 << 15),
            )


@pytest.mark.parametrize("depth", [4, 4096])
def test_command_excitation(depth):
    run("command_excitation", __file__, DEPTH=depth)
