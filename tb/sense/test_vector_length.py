# SPDX-License-Identifier: Apache-2.0
"""Tests of vector_length: known vectors, the stated bound over every 8-bit pair, the sectors, and
every cycle against the model.
"""

import random

import cocotb
import numpy as np
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.vector_length import vector_length

LATENCY = 8


def model(sin, cos):
    return tuple(int(x) for x in vector_length(sin, cos))


async def cycle(dut, sample=None, rst=0):
    """Advance one cycle with this sample or none; returns the outputs, None without done."""
    dut.valid.value, dut.rst.value = int(sample is not None), rst
    dut.sin.value, dut.cos.value = sample or (random.getrandbits(6), random.getrandbits(6))
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    if not int(dut.done.value):
        return None
    return tuple(int(pin.value) for pin in (dut.length, dut.axis, dut.quadrant, dut.tilt))


async def drive(dut, samples):
    """Compare the outputs with the model in every cycle; None in `samples` is a gap."""
    want = [None] * (LATENCY - 1) + [sample and model(*sample) for sample in samples]
    for n, sample in enumerate([*samples, *[None] * (LATENCY - 1)]):
        got = await cycle(dut, sample)
        assert got == want[n], f"cycle {n}: {got}, the model has {want[n]}"
    return [w for w in want if w]


@cocotb.test()
async def latency_is_8_and_known_vectors_are_right_by_hand(dut):
    await start(dut, valid=0, sin=0, cos=0)
    got = await drive(dut, [(0, 100), (100, 0), (0, -100), (-100, 0), (60, 80), (-60, -80), (0, 0)])
    assert got == [
        (100, 0, 0, 0),
        (100, 1, 0, 0),
        (100, 2, 1, 0),
        (100, 3, 3, 0),
        (100, 0, 0, 3),
        (100, 2, 2, 3),
        (0, 0, 0, 0),
    ]


@cocotb.test()
async def the_ends_of_the_range_are_right(dut):
    await start(dut, valid=0, sin=0, cos=0)
    low, high = -(1 << int(dut.W.value) - 1), (1 << int(dut.W.value) - 1) - 1
    ends = (low, low + 1, -1, 0, 1, high)
    await drive(dut, [(sin, cos) for sin in ends for cos in ends])


@cocotb.test()
async def reset_drops_the_samples_in_progress(dut):
    await start(dut, valid=0, sin=0, cos=0)
    for _ in range(5):
        await cycle(dut, (50, 60))
    assert [await cycle(dut, rst=int(n == 0)) for n in range(12)] == [None] * 12
    await drive(dut, [(3, 4)])


@cocotb.test()
async def any_samples_with_any_gaps_match_the_model(dut):
    await start(dut, valid=0, sin=0, cos=0)
    w = int(dut.W.value)
    draw = lambda: random.randrange(-(1 << w - 1), 1 << w - 1) >> random.randrange(w)
    await drive(
        dut, [random.choice([None, (draw(), draw()), (draw(), draw())]) for _ in range(1500)]
    )


def test_every_pair_of_8_bits_is_within_the_stated_bound():
    sin, cos = np.meshgrid(np.arange(-128, 128), np.arange(-128, 128))
    assert abs(vector_length(sin, cos)[0] - np.hypot(sin, cos)).max() <= 0.7


def test_any_pair_of_16_bits_is_within_the_stated_bound():
    source = np.random.default_rng(1)
    sin, cos = source.integers(-32768, 32768, (2, 200_000)) >> source.integers(0, 15, 200_000)
    true = np.hypot(sin, cos)
    assert (abs(vector_length(sin, cos)[0] - true) <= 0.7 + 0.002 * true).all()


def test_a_turn_passes_the_sectors_in_order():
    turn = np.radians(np.arange(0, 360, 0.25) + 0.1)
    _, axis, quadrant, tilt = vector_length(
        np.rint(20000 * np.sin(turn)), np.rint(20000 * np.cos(turn))
    )
    assert (axis == np.floor(np.degrees(turn) / 90 + 0.5) % 4).all()
    assert (quadrant == np.floor(np.degrees(turn) / 90)).all()
    away = abs((np.degrees(turn) + 45) % 90 - 45)
    assert (tilt == np.floor(np.tan(np.radians(away)) * 4 + 0.5)).all()


@pytest.mark.parametrize("w", [8, 16])
def test_vector_length(w):
    run("vector_length", __file__, W=w)
