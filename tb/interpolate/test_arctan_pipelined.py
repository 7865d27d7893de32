# SPDX-License-Identifier: Apache-2.0
"""Tests of arctan_pipelined: by hand, its latency, one sample per cycle, and every cycle against
the model; the model against math.atan2.

The model is tested with every pair of 8 bits. The RTL is compared with it for all of them under
SIM=verilator, and under Icarus for one octant of pairs, each turned into one of the octants in
rotation. For 9 and 10 bits the model is tested with every pair that its bound leaves open.
"""

import math
import random
from itertools import product

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import needs, run, start
from tb.interpolate.arctan_pipelined import ArctanPipelined, arctan_rotation, latency, sample
from tb.interpolate.phase_judge import close_calls, error, pairs_of_8_bits
from tb.simulator import source_of

IDLE = dict(valid=0, sin=0, cos=0)
PLAN = arctan_rotation.PIPELINED


async def begin(dut):
    """Reset; returns the width, and a model that has seen the same."""
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    w = int(dut.W.value)
    return w, ArctanPipelined(w, int(dut.STEPS.value))


def out(dut):
    return int(dut.done.value), dut.phase.value.to_unsigned(), dut.amplitude.value.to_unsigned()


async def cycle(dut, model, pair=None):
    """Advance one cycle with this sample or none, and compare design and model."""
    sin, cos = pair or (random.choice((0, 5)), 0)
    dut.valid.value, dut.sin.value, dut.cos.value = int(pair is not None), sin, cos
    await FallingEdge(dut.clk)
    got, want = out(dut), model.step(pair is not None, sin, cos)
    assert got == want, f"(done, phase, amplitude) is {got}, the model has {want}"
    return got


async def ask(dut, model, pairs):
    """Send the pairs, one per cycle; returns (phase, amplitude) of each."""
    results = [await cycle(dut, model, pair) for pair in pairs]
    results += [await cycle(dut, model) for _ in range(len(model.coming) - 1)]
    assert [done for done, *_ in results].count(1) == len(pairs)
    return [tuple(result) for done, *result in results if done]


@cocotb.test()
async def the_octant_borders_are_exact(dut):
    w, model = await begin(dut)
    full = 1 << w - 1
    eighths = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
    sizes = [full // 4, full // 2, full - 1] + [1, 3] * (w < 11)
    results = await ask(
        dut, model, [(sin * size, cos * size) for size in sizes for sin, cos in eighths]
    )
    assert [phase for phase, _ in results] == [eighth * 8192 for eighth in range(8)] * len(sizes)


@cocotb.test()
async def known_angles_are_right(dut):
    w, model = await begin(dut)
    unit = 1 << w - 8
    results = await ask(
        dut,
        model,
        [
            (s * unit, c * unit)
            for s, c in ((48, 64), (64, 48), (-48, 64), (1, 100), (-1, -100), (0, 0))
        ],
    )
    assert [phase for phase, _ in results] == [
        6712,
        16384 - 6712,
        65536 - 6712,
        104,
        32768 + 104,
        0,
    ]  # atan 0.75, 0.01
    assert all(
        abs(size - 80 * unit) <= arctan_rotation.amplitude_bound(80 * unit)
        for _, size in results[:3]
    )  # 3, 4, 5
    assert results[-1] == (0, 0)


@cocotb.test()
async def the_ends_of_the_range_match_the_model(dut):
    w, model = await begin(dut)
    low, high = -(1 << w - 1), (1 << w - 1) - 1
    await ask(dut, model, list(product((low, low + 1, -1, 0, 1, high - 1, high), repeat=2)))


@cocotb.test()
async def latency_is_24_28_29_or_23_by_width_divided_by_steps(dut):
    w, model = await begin(dut)
    steps = int(dut.STEPS.value)
    want = -(-{8: 24, 9: 28, 10: 29}.get(w, 23) // steps)
    assert want == latency(w, steps)
    results = [await cycle(dut, model, (0, -5))] + [
        await cycle(dut, model) for _ in range(want + 3)
    ]
    assert [done for done, *_ in results] == [0] * (want - 1) + [1] + [0] * 4


@cocotb.test()
async def the_result_is_held_until_the_next(dut):
    w, model = await begin(dut)
    full = (1 << w - 1) - 1
    (result,) = await ask(dut, model, [(full, full)])
    assert result[0] == 8192
    assert {(await cycle(dut, model))[1:] for _ in range(60)} == {result}


@cocotb.test()
async def reset_drops_the_samples_in_progress(dut):
    w, model = await begin(dut)
    for _ in range(2 * latency(w)):
        await cycle(dut, model, (77, -33))
    dut.rst.value, dut.valid.value = 1, 1
    await FallingEdge(dut.clk)
    assert out(dut) == (0, 0, 0)
    dut.rst.value, model = 0, ArctanPipelined(w, int(dut.STEPS.value))
    assert {await cycle(dut, model) for _ in range(40)} == {(0, 0, 0)}


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    w, model = await begin(dut)
    for _ in range(30):
        often, size = random.choice((1, 1, 2, 5)), 1 << random.choice((w - 1, w - 1, w - 2, 3))
        for _ in range(60):
            await cycle(
                dut,
                model,
                None
                if random.randrange(often)
                else (random.randrange(-size, size), random.randrange(-size, size)),
            )


@cocotb.test()
async def all_pairs_of_8_bits_match_the_model(dut):
    w, model = await begin(dut)
    needs(w == 8, "wider samples are drawn at random")
    await ask(dut, model, pairs_of_8_bits(whole=not cocotb.SIM_NAME.startswith("Icarus")))


def test_every_sample_of_8_bits_is_correctly_rounded():
    pairs = [pair for pair in product(range(-128, 128), repeat=2) if pair != (0, 0)]
    results = [sample(8, *pair) for pair in pairs]
    assert len(pairs) == 65535
    assert max(abs(error(phase, *pair)) for (phase, _), pair in zip(results, pairs)) < 0.5
    assert all(
        abs(size - math.hypot(*pair)) <= arctan_rotation.amplitude_bound(math.hypot(*pair))
        for (_, size), pair in zip(results, pairs)
    )


@pytest.mark.parametrize("w", [9, 10])
def test_every_sample_of_9_and_10_bits_is_correctly_rounded(w):
    pairs = close_calls(w, lambda radius: arctan_rotation.bound(PLAN[w], w, radius) - 0.5)
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
            assert abs(error(phase, sin, cos)) <= arctan_rotation.bound(PLAN[w], w, radius)
            assert abs(size - radius) <= arctan_rotation.amplitude_bound(radius)


def test_the_header_has_the_bounds_of_the_generator():
    text = " ".join(source_of("arctan_pipelined").read_text().replace("//", " ").split())
    widest = max(arctan_rotation.quarter_bound(PLAN, w) for w in range(11, 17))
    assert f"within {widest:.3f} LSB" in text and widest < 0.55
    assert "within 1.5 counts plus 0.00015 of itself" in text
    assert arctan_rotation.amplitude_bound(10000) == 3


@pytest.mark.parametrize("w, steps", [(8, 1), (8, 2), (10, 3), (12, 1), (16, 2)])
def test_arctan_pipelined(w, steps):
    run("arctan_pipelined", __file__, W=w, STEPS=steps)
