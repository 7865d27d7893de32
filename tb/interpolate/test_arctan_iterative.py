# SPDX-License-Identifier: Apache-2.0
"""Tests of arctan_iterative: by hand, its latency, samples that come too soon, and every cycle
against the model; the model against math.atan2.

The model is tested with every pair of 8 bits. The RTL is compared with it for all of them under
SIM=verilator, and under Icarus for every fourth pair of one octant, each turned into one of the
octants in rotation. For 9 and 10 bits every pair that the bound leaves open is tested.
"""

import math
import random
from itertools import product

import cocotb
import pytest
from cocotb.triggers import ClockCycles, FallingEdge

from tb.bench import needs, run, start
from tb.interpolate.arctan_iterative import ArctanIterative, arctan_rotation, latency, sample
from tb.interpolate.phase_judge import close_calls, error, pairs_of_8_bits
from tb.simulator import source_of

IDLE = dict(valid=0, sin=0, cos=0)
PLAN = arctan_rotation.ITERATIVE


def out(dut):
    return int(dut.done.value), dut.phase.value.to_unsigned(), dut.amplitude.value.to_unsigned()


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    return int(dut.W.value)


async def ask(dut, sin, cos):
    """Send one sample after the last one is done; return when its phase is ready."""
    dut.valid.value, dut.sin.value, dut.cos.value = 1, sin, cos
    await FallingEdge(dut.clk)
    dut.valid.value = 0
    await ClockCycles(dut.clk, latency(int(dut.W.value)) - 1, FallingEdge)
    done, *result = out(dut)
    assert done == 1
    return tuple(result)


@cocotb.test()
async def the_octant_borders_are_exact(dut):
    full = 1 << await begin(dut) - 1
    for size in (full // 4, full // 2, full - 1):
        for eighth, (sin, cos) in enumerate(
            [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
        ):
            assert (await ask(dut, sin * size, cos * size))[0] == eighth * 8192


@cocotb.test()
async def known_angles_are_right(dut):
    unit = 1 << await begin(dut) - 8
    for sin, cos, phase in (
        (48, 64, 6712),
        (64, 48, 16384 - 6712),
        (-48, 64, 65536 - 6712),
    ):  # atan 0.75; 3, 4, 5
        got, size = await ask(dut, sin * unit, cos * unit)
        assert got == phase and abs(size - 80 * unit) <= arctan_rotation.amplitude_bound(80 * unit)
    assert (await ask(dut, -unit, -100 * unit))[0] == 32768 + 104  # atan 0.01
    assert await ask(dut, 0, 0) == (0, 0)


@cocotb.test()
async def the_ends_of_the_range_match_the_model(dut):
    w = await begin(dut)
    low, high = -(1 << w - 1), (1 << w - 1) - 1
    for sin, cos in product((low, low + 1, -1, 0, 1, high - 1, high), repeat=2):
        assert await ask(dut, sin, cos) == sample(w, sin, cos), (sin, cos)


@cocotb.test()
async def latency_is_24_28_30_or_23_by_width(dut):
    w = await begin(dut)
    want = {8: 24, 9: 28, 10: 30}.get(w, 23)
    assert want == latency(w)
    dut.valid.value, dut.cos.value, seen = 1, -5, []
    for _ in range(want + 3):
        await FallingEdge(dut.clk)
        dut.valid.value = 0
        seen.append(out(dut)[0])
    assert seen == [0] * (want - 1) + [1] + [0] * 3


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    w = await begin(dut)
    model = ArctanIterative(w)
    for cycle in range(3000):
        rst, size = int(random.random() < 0.005), 1 << random.choice((w - 1, w - 1, 3))
        valid, sin, cos = (
            random.choice((0, 0, 1)),
            random.randrange(-size, size),
            random.randrange(-size, size),
        )
        dut.rst.value, dut.valid.value, dut.sin.value, dut.cos.value = rst, valid, sin, cos
        await FallingEdge(dut.clk)
        want = model.step(valid, sin, cos)
        if rst:
            model, want = ArctanIterative(w), (0, 0, 0)
        assert out(dut) == want, f"cycle {cycle}"


@cocotb.test()
async def all_pairs_of_8_bits_match_the_model(dut):
    needs(await begin(dut) == 8, "wider samples are drawn at random")
    whole = not cocotb.SIM_NAME.startswith("Icarus")
    for sin, cos in pairs_of_8_bits(whole)[:: 1 if whole else 5]:
        assert await ask(dut, sin, cos) == sample(8, sin, cos), (sin, cos)


def test_every_sample_of_8_bits_is_correctly_rounded():
    pairs = [pair for pair in product(range(-128, 128), repeat=2) if pair != (0, 0)]
    results = [sample(8, *pair) for pair in pairs]
    assert max(abs(error(phase, *pair)) for (phase, _), pair in zip(results, pairs)) < 0.5
    assert all(
        abs(size - math.hypot(*pair)) <= arctan_rotation.amplitude_bound(math.hypot(*pair))
        for (_, size), pair in zip(results, pairs)
    )


@pytest.mark.parametrize("w", [9, 10])
def test_every_sample_of_9_and_10_bits_is_correctly_rounded(w):
    pairs = close_calls(w, lambda radius: arctan_rotation.bound(PLAN[w], w, radius, True) - 0.5)
    assert len(pairs) > 200
    assert max(abs(error(sample(w, *pair)[0], *pair)) for pair in pairs) < 0.5


def test_any_wider_sample_is_within_the_bounds():
    draw = random.Random(1)
    for w in range(11, 17):
        full = 1 << w - 1
        for _ in range(3000):
            sin, cos = (
                draw.randrange(-full, full),
                draw.randrange(-full, full) or 1,
            )  # (0, 0) has no phase
            radius = math.hypot(sin, cos)
            phase, size = sample(w, sin, cos)
            assert abs(error(phase, sin, cos)) <= arctan_rotation.bound(PLAN[w], w, radius, True)
            assert abs(size - radius) <= arctan_rotation.amplitude_bound(radius)


def test_the_header_has_the_bounds_of_the_generator():
    text = " ".join(source_of("arctan_iterative").read_text().replace("//", " ").split())
    widest = max(arctan_rotation.quarter_bound(PLAN, w) for w in range(11, 17))
    assert f"within {widest:.3f} LSB" in text and widest < 0.52
    assert "within 1.5 counts plus 0.00015 of itself" in text
    assert arctan_rotation.amplitude_bound(10000) == 3


@pytest.mark.parametrize("w", [8, 10, 12, 16])
def test_arctan_iterative(w):
    run("arctan_iterative", __file__, W=w)
