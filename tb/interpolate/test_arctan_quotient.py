# SPDX-License-Identifier: Apache-2.0
"""Tests of arctan_quotient: by hand, the latency, one sample per cycle or at a time,
and every cycle against the model; the model against math.atan2.
"""

import random
from itertools import product

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tables import arctan_quotient
from tb.bench import needs, run, start
from tb.interpolate.arctan_quotient import LATENCY, ArctanQuotient, phase_of
from tb.interpolate.phase_judge import error
from tb.simulator import source_of

IDLE = dict(valid=0, sin=0, cos=0)
FULL = 1 << 15


async def begin(dut):
    """Reset; returns the cycles between two samples, and a model that has seen the same."""
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    cycles = int(dut.SAMPLE_CYCLES.value)
    return LATENCY if cycles >= LATENCY else 1, ArctanQuotient(cycles)


async def cycle(dut, model, pair=None):
    """Advance one cycle with this sample or none, and compare design and model."""
    sin, cos = pair or (random.randrange(-FULL, FULL), 0)
    dut.valid.value, dut.sin.value, dut.cos.value = int(pair is not None), sin, cos
    await FallingEdge(dut.clk)
    got = int(dut.done.value), dut.phase.value.to_unsigned()
    want = model.step(pair is not None, sin, cos)
    assert got == want, f"(done, phase) is {got}, the model has {want}"
    return got


async def ask(dut, model, pairs, apart):
    """Send the pairs, so many cycles apart; returns the phase of each."""
    results = []
    for pair in pairs:
        results += [await cycle(dut, model, pair if n == 0 else None) for n in range(apart)]
    results += [await cycle(dut, model) for _ in range(LATENCY)]
    phases = [phase for done, phase in results if done]
    assert len(phases) == len(pairs)
    return phases


@cocotb.test()
async def the_octant_borders_are_exact(dut):
    apart, model = await begin(dut)
    eighths = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
    sizes = (1, 2, 3, 100, 16384, FULL - 1)
    pairs = [(sin * size, cos * size) for size in sizes for sin, cos in eighths]
    assert await ask(dut, model, pairs, apart) == [n * 8192 for n in range(8)] * len(sizes)


@cocotb.test()
async def known_angles_are_right(dut):
    apart, model = await begin(dut)
    pairs = [(3, 4), (4, 3), (-3, 4), (1, 100), (-1, -100), (-FULL, -FULL), (0, 0)]
    assert await ask(dut, model, pairs, apart) == [
        6712,
        16384 - 6712,
        65536 - 6712,
        104,
        32768 + 104,
        5 * 8192,
        0,
    ]  # atan 0.75, 0.01


@cocotb.test()
async def the_ends_of_the_range_match_the_model(dut):
    apart, model = await begin(dut)
    ends = (-FULL, 1 - FULL, -1, 0, 1, FULL - 2, FULL - 1)
    await ask(dut, model, list(product(ends, repeat=2)), apart)


@cocotb.test()
async def latency_is_12(dut):
    _, model = await begin(dut)
    results = [await cycle(dut, model, (0, -5))] + [await cycle(dut, model) for _ in range(14)]
    assert [done for done, _ in results] == [0] * 11 + [1] + [0] * 3
    assert [phase for _, phase in results[11:]] == [32768] * 4


@cocotb.test()
async def a_sample_that_comes_too_soon_replaces_the_one_in_progress(dut):
    apart, model = await begin(dut)
    needs(apart > 1, "one sample per cycle")
    results = [await cycle(dut, model, (5, 5) if n in (0, 7) else None) for n in range(40)]
    assert [n for n, (done, _) in enumerate(results) if done] == [18]


@cocotb.test()
async def reset_drops_the_samples_in_progress(dut):
    _, model = await begin(dut)
    for _ in range(2 * LATENCY):
        await cycle(dut, model, (77, -33))
    dut.rst.value, dut.valid.value = 1, 1
    await FallingEdge(dut.clk)
    assert (int(dut.done.value), int(dut.phase.value)) == (0, 0)
    dut.rst.value, model = 0, ArctanQuotient(int(dut.SAMPLE_CYCLES.value))
    assert {await cycle(dut, model) for _ in range(40)} == {(0, 0)}


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    _, model = await begin(dut)
    for _ in range(60):
        often, size = random.choice((1, 2, 12, 15)), 1 << random.choice((15, 15, 14, 8, 3))
        for _ in range(100):
            pair = random.randrange(-size, size), random.randrange(-size, size)
            await cycle(dut, model, None if random.randrange(often) else pair)


def test_any_sample_is_within_the_bound_of_the_header():
    limit = arctan_quotient.bound()
    text = " ".join(source_of("arctan_quotient").read_text().replace("//", " ").split())
    assert f"within {limit:.3f} LSB of the true phase of any sample" in text and limit < 0.548
    draw = random.Random(1)
    for size in (4, 100, 1000, FULL):
        for _ in range(10_000):
            sin, cos = draw.randrange(-size, size), draw.randrange(-size, size) or 1
            assert abs(error(phase_of(sin, cos), sin, cos)) <= limit, (sin, cos)


@pytest.mark.parametrize("cycles", [1, 11, 12])
def test_arctan_quotient(cycles):
    run("arctan_quotient", __file__, SAMPLE_CYCLES=cycles)
