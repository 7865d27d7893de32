# SPDX-License-Identifier: Apache-2.0
"""Tests of harmonic_correction: by hand, the ends of table and phase, its two tables, and random
use against the model in every cycle.
"""

import math
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.interpolate.harmonic_correction import LATENCY, POINTS, HarmonicCorrection, corrected

IDLE = dict(valid=0, axis=0, phase=0, enable=0, write=0, table_axis=0, point=0, value=0, swap=0)


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    model = HarmonicCorrection(int(dut.AXES.value))
    for axis in range(2 * len(model.tables)):  # both tables are known to design and model
        await load(dut, model, [0] * POINTS, axis // 2)
    await cycle(dut, model, rst=1)
    return model


async def cycle(
    dut, model, valid=0, phase=0, enable=None, write=None, swap=0, rst=0, axis=0, table_axis=0
):
    enable = (1 << len(model.tables)) - 1 if enable is None else enable
    dut.valid.value, dut.phase.value, dut.enable.value, dut.swap.value, dut.rst.value = (
        valid,
        phase,
        enable,
        swap,
        rst,
    )
    dut.axis.value, dut.table_axis.value = axis, table_axis
    dut.write.value = int(write is not None)
    if write:
        dut.point.value, dut.value.value = write
    await FallingEdge(dut.clk)
    got, want = (
        (int(dut.done.value), dut.phase_out.value.to_unsigned()),
        model.step(valid, phase, enable, write, swap, rst, axis, table_axis),
    )
    assert got == want, f"got {got}, the model has {want}"
    return got


async def load(dut, model, table, axis=0):
    for entry in enumerate(table):
        await cycle(dut, model, write=entry, table_axis=axis)
    await cycle(dut, model)
    await cycle(dut, model, swap=1, table_axis=axis)


async def ask(dut, model, phase, **inputs):
    await cycle(dut, model, 1, phase, **inputs)
    for _ in range(LATENCY - 2):
        await cycle(dut, model)
    done, out = await cycle(dut, model)
    assert done
    return out


@cocotb.test()
async def latency_is_4_and_phases_may_come_every_cycle(dut):
    model = await begin(dut)
    done = [(await cycle(dut, model, n in (2, 3, 4, 7), n))[0] for n in range(13)]
    assert [n for n, d in enumerate(done) if d] == [5, 6, 7, 10]


@cocotb.test()
async def known_corrections_are_right(dut):
    model = await begin(dut)
    table = [0] * POINTS
    table[3], table[4] = 160, -320  # 10 and -20 LSB of phase
    await load(dut, model, table)
    assert await ask(dut, model, 3 * 256) == 3 * 256 - 10
    assert await ask(dut, model, 3 * 256 + 128) == 3 * 256 + 128 + 5
    assert await ask(dut, model, 4 * 256) == 4 * 256 + 20
    assert await ask(dut, model, 5 * 256) == 5 * 256
    assert await ask(dut, model, 3 * 256, enable=0) == 3 * 256


@cocotb.test()
async def the_line_closes_over_the_period_and_the_phase_wraps(dut):
    model = await begin(dut)
    await load(dut, model, [-131072] + [0] * 254 + [131071])
    for phase in (0, 1, 255, 256, 65535, 65535 - 255, 65535 - 256):
        assert await ask(dut, model, phase) == corrected(phase, model.in_force())
    assert await ask(dut, model, 0) == 8192
    assert await ask(dut, model, 255 * 256) == 255 * 256 - 8192


@cocotb.test()
async def nothing_is_corrected_before_the_first_swap_or_by_a_partially_written_table(dut):
    model = await begin(dut)
    for entry in enumerate([1600] * POINTS):
        assert await cycle(dut, model, 1, 777, write=entry) in ((0, 0), (0, 777), (1, 777))
        await cycle(dut, model)
    assert await ask(dut, model, 777, swap=1) == 677
    for entry in enumerate([3200] * POINTS):
        assert (await cycle(dut, model, 1, 777, write=entry))[1] in (677,)
        await cycle(dut, model)
    assert await ask(dut, model, 777, swap=1) == 577


@cocotb.test()
async def an_entry_is_stored_in_the_next_cycle_without_a_phase(dut):
    model = await begin(dut)
    await cycle(dut, model, 1, write=(3, 160))
    for _ in range(5):
        await cycle(dut, model, 1)
    await cycle(dut, model, 1, swap=1)  # a swap does not move it into the other table
    await cycle(dut, model)
    assert await ask(dut, model, 3 * 256) == 3 * 256 - 10
    await cycle(dut, model, 1, write=(3, 320))
    await cycle(dut, model, 1, write=(3, 480))  # takes the place of the one before
    await cycle(dut, model)
    assert await ask(dut, model, 3 * 256, swap=1) == 3 * 256 - 30


@cocotb.test()
async def reset_in_mid_flow_drops_the_phase_and_the_correction(dut):
    model = await begin(dut)
    await load(dut, model, [1600] * POINTS)
    await cycle(dut, model, 1, 5)
    await cycle(dut, model, rst=1)
    for _ in range(6):
        assert (await cycle(dut, model))[0] == 0
    assert await ask(dut, model, 500) == 500


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    model, axes = await begin(dut), int(dut.AXES.value)
    for _ in range(4000):
        write = (
            (random.randrange(POINTS), random.randrange(-1 << 17, 1 << 17))
            if random.getrandbits(1)
            else None
        )
        await cycle(
            dut,
            model,
            random.getrandbits(1),
            random.choice((0, 65535, random.getrandbits(16))),
            random.getrandbits(axes) | random.getrandbits(axes),
            write,
            int(random.random() < 0.05),
            int(random.random() < 0.003),
            random.randrange(axes),
            random.randrange(axes),
        )


@cocotb.test()
async def each_axis_has_a_table_of_its_own(dut):
    model = await begin(dut)
    for axis in range(len(model.tables)):
        await load(dut, model, [160 * (axis + 1)] * POINTS, axis)
    for axis in range(len(model.tables)):
        assert await ask(dut, model, 30_000, axis=axis) == 30_000 - 10 * (axis + 1)


def test_the_chords_leave_no_more_of_a_sine_than_the_header_says():
    for order, share in ((2, 0.0003), (9, 0.0062)):
        size = 100_000
        table = [round(size * math.sin(math.tau * order * n / POINTS)) for n in range(POINTS)]
        worst = max(
            abs(
                (phase - corrected(phase, table) + 32768 & 65535)
                - 32768
                - size / 16 * math.sin(math.tau * order * phase / 65536)
            )
            for phase in range(0, 65536, 7)
        )
        assert worst <= size / 16 * share + 0.55


@pytest.mark.parametrize("axes", [1, 3])
def test_harmonic_correction(axes):
    run("harmonic_correction", __file__, AXES=axes)
