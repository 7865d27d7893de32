# SPDX-License-Identifier: Apache-2.0
"""Tests of vector_length: known vectors, the rounded length of every 8-bit pair, the sectors, and
every cycle against the model.
"""

import random

import cocotb
import numpy as np
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.vector_length import vector_length


def model(sin, cos):
    return tuple(int(x) for x in vector_length(sin, cos))


class Bench:
    """The design, and what the model has after each cycle: the results stay until the next one."""

    def __init__(self, dut):
        self.dut, self.left, self.next, self.want = dut, 0, None, None
        self.latency = int(dut.W.value) + 6

    async def cycle(self, sample=None, rst=0):
        """Advance one cycle with this sample or none; returns the outputs, None without done."""
        dut = self.dut
        dut.valid.value, dut.rst.value = int(sample is not None), rst
        dut.sin.value, dut.cos.value = sample or (random.getrandbits(6), random.getrandbits(6))
        if not self.left and sample:
            self.left, self.next = self.latency, model(*sample)
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        self.want = self.next if self.left == 1 else self.want
        done = self.left == 1 and not rst
        self.left = 0 if rst else max(self.left - 1, 0)
        assert int(dut.done.value) == done
        if self.want:
            got = tuple(int(pin.value) for pin in (dut.length, dut.axis, dut.quadrant, dut.tilt))
            assert got == self.want
        return self.want if done else None

    async def drive(self, samples):
        """Send these samples as soon as each is taken; returns their results."""
        results = []
        for sample in samples:
            results += [await self.cycle(sample)]
            results += [await self.cycle() for _ in range(self.latency - 1)]
        return [result for result in results if result]


async def begin(dut):
    await start(dut, valid=0, sin=0, cos=0)
    return Bench(dut)


@cocotb.test()
async def latency_is_w_plus_6(dut):
    bench = await begin(dut)
    done = [await bench.cycle((3, 4))] + [await bench.cycle() for _ in range(30)]
    assert [n for n, result in enumerate(done, 1) if result] == [int(dut.W.value) + 6]


@cocotb.test()
async def known_vectors_are_right_by_hand(dut):
    bench = await begin(dut)
    got = await bench.drive(
        [(0, 100), (100, 0), (0, -100), (-100, 0), (60, 80), (-60, -80), (0, 0), (1, 1), (2, 1)]
    )
    assert got == [
        (100, 0, 0, 0),
        (100, 1, 0, 0),
        (100, 2, 1, 0),
        (100, 3, 3, 0),
        (100, 0, 0, 3),
        (100, 2, 2, 3),
        (0, 0, 0, 0),
        (1, 0, 0, 4),
        (2, 1, 0, 2),
    ]


@cocotb.test()
async def the_ends_of_the_range_are_right(dut):
    bench = await begin(dut)
    low, high = -(1 << int(dut.W.value) - 1), (1 << int(dut.W.value) - 1) - 1
    ends = (low, low + 1, -1, 0, 1, high)
    assert len(await bench.drive([(sin, cos) for sin in ends for cos in ends])) == 36


@cocotb.test()
async def reset_drops_the_sample_in_progress_at_any_step(dut):
    bench = await begin(dut)
    for cycles in range(bench.latency):
        await bench.cycle((50, 60))
        for _ in range(cycles):
            await bench.cycle()
        await bench.cycle(rst=1)
        assert await bench.drive([(3, 4)]) == [(5, 0, 0, 3)]


@cocotb.test()
async def any_samples_with_any_gaps_match_the_model(dut):
    bench = await begin(dut)
    w = int(dut.W.value)
    draw = lambda: random.randrange(-(1 << w - 1), 1 << w - 1) >> random.randrange(w)
    results = 0
    for _ in range(8000):
        sample = (draw(), draw()) if random.random() < 0.5 else None
        results += (await bench.cycle(sample)) is not None
    assert results > 250


def test_every_pair_of_8_bits_is_within_the_stated_bound():
    sin, cos = np.meshgrid(np.arange(-128, 128), np.arange(-128, 128))
    assert abs(vector_length(sin, cos)[0] - np.hypot(sin, cos)).max() <= 0.5


def test_any_pair_of_16_bits_is_within_the_stated_bound():
    source = np.random.default_rng(1)
    sin, cos = source.integers(-32768, 32768, (2, 200_000)) >> source.integers(0, 15, 200_000)
    true = np.hypot(sin, cos)
    assert (abs(vector_length(sin, cos)[0] - true) <= 0.5).all()


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
