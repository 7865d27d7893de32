# SPDX-License-Identifier: Apache-2.0
"""Tests of calibration_recorder: a burst by hand, decimation, disturbed bursts, read-out, and
random use against the model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import ClockCycles, FallingEdge

from tb.bench import needs, run, start
from tb.interpolate.calibration_recorder import CalibrationRecorder

IDLE = dict(
    start=0,
    phases=0,
    decimation=1,
    sampled=0,
    sin=0,
    cos=0,
    phase_valid=0,
    phase=0,
    disturbed=0,
    read=0,
)


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    return CalibrationRecorder(int(dut.W.value), int(dut.DEPTH.value))


async def cycle(dut, model, **inputs):
    """Advance one cycle; returns (word or None, full, invalid)."""
    for name, value in (IDLE | dict(rst=0) | inputs).items():
        getattr(dut, name).value = value
    await FallingEdge(dut.clk)
    want = model.step(**inputs)
    word = None if want[0] is None else dut.word.value.to_unsigned()
    got = word, int(dut.full.value), int(dut.invalid.value)
    assert got == want, f"(word, full, invalid) is {got}, the model has {want}"
    return got


async def words(dut, model):
    """The burst as the firmware reads it."""
    assert dut.full.value == 1
    out = []
    for _ in range(int(dut.DEPTH.value)):
        await cycle(dut, model)
        out.append((await cycle(dut, model))[0])
        await cycle(dut, model, read=1)
    return out


@cocotb.test()
async def latency_is_1_to_full_and_2_to_the_first_and_each_next_word(dut):
    model, depth, shift = await begin(dut), int(dut.DEPTH.value), 16 - int(dut.W.value)
    await cycle(dut, model, start=1)
    for n in range(depth):
        assert not int(dut.full.value)
        await cycle(dut, model, sampled=1, sin=n % 100)
    assert int(dut.full.value)
    await cycle(dut, model)
    assert (await cycle(dut, model))[0] == 0
    for n in (1, 2, 3):
        await cycle(dut, model, read=1)
        assert int(dut.word.value) == (n - 1) % depth % 100 << shift
        assert (await cycle(dut, model))[0] == n % depth % 100 << shift


@cocotb.test()
async def a_burst_of_samples_is_read_back_left_aligned(dut):
    model, depth, shift = await begin(dut), int(dut.DEPTH.value), 16 - int(dut.W.value)
    await cycle(dut, model, start=1)
    for n in range(depth):
        assert not (await cycle(dut, model, sampled=0))[1]
        assert (await cycle(dut, model, sampled=1, sin=-n % 100, cos=-(n % 100)))[1] == (
            n == depth - 1
        )
    await cycle(dut, model, sampled=1, sin=1, cos=1)  # one strobe too many
    want = [
        ((-(n % 100) << shift) & 65535) << 16 | (-n % 100 << shift) & 65535 for n in range(depth)
    ]
    # the read-out starts again at the first word
    assert await words(dut, model) == want == await words(dut, model)


@cocotb.test()
async def a_word_holds_two_phases_the_earlier_one_low(dut):
    model, depth = await begin(dut), int(dut.DEPTH.value)
    await cycle(dut, model, start=1, phases=1)
    for n in range(2 * depth):
        await cycle(dut, model, phases=1, sampled=1, sin=7, phase_valid=1, phase=65535 - n)
    assert await words(dut, model) == [(65534 - 2 * n) << 16 | 65535 - 2 * n for n in range(depth)]


@cocotb.test()
async def one_in_decimation_is_kept_and_0_acts_as_1(dut):
    model, depth = await begin(dut), int(dut.DEPTH.value)
    for decimation in (0, 1, 2, 5):
        await cycle(dut, model, start=1, phases=1)
        n = 0
        while not int(dut.full.value):
            await cycle(dut, model, phases=1, decimation=decimation, phase_valid=1, phase=n)
            n += 1
        step = max(decimation, 1)
        assert n == (2 * depth - 1) * step + 1
        assert (await words(dut, model))[:3] == [
            (2 * k + 1) * step << 16 | 2 * k * step for k in range(3)
        ]


@cocotb.test()
async def a_decimation_counts_with_each_of_its_bits(dut):
    model, depth = await begin(dut), int(dut.DEPTH.value)
    needs(depth <= 8, "a burst of 32 samples takes two million cycles")
    for decimation in (0x5555, 0xAAAB):  # odd, for bits that alternate
        await cycle(dut, model, start=1, decimation=decimation)
        dut.start.value, dut.sampled.value = 0, 1
        await ClockCycles(dut.clk, (depth - 1) * decimation)
        await FallingEdge(dut.clk)
        assert not int(dut.full.value)
        await FallingEdge(dut.clk)
        assert int(dut.full.value)
        dut.sampled.value = 0


@cocotb.test()
async def a_disturbance_spoils_the_burst_it_falls_into_and_no_other(dut):
    model, depth = await begin(dut), int(dut.DEPTH.value)
    await cycle(dut, model, disturbed=1)
    for n in (-1, 0, depth - 1):
        await cycle(dut, model, start=1)
        for k in range(depth):
            await cycle(dut, model, sampled=1, disturbed=int(k == n))
        assert (await cycle(dut, model, disturbed=1))[1:] == (1, int(n >= 0))


@cocotb.test()
async def start_or_reset_in_the_middle_forgets_the_burst(dut):
    model, depth = await begin(dut), int(dut.DEPTH.value)
    for how in ("start", "rst"):
        await cycle(dut, model, start=1, phases=1)
        for _ in range(depth + 1):
            await cycle(dut, model, phases=1, phase_valid=1, phase=99, disturbed=1)
        assert (await cycle(dut, model, **{how: 1}))[1:] == (0, 0)
        for k in range(depth):
            assert not int(dut.full.value)
            await cycle(dut, model, sampled=1, sin=k % 100)
        assert int(dut.full.value) == (how == "start")


@cocotb.test()
async def any_use_matches_the_model_in_every_cycle(dut):
    model, full = await begin(dut), 1 << int(dut.W.value) - 1
    for _ in range(60):
        phases, decimation = random.getrandbits(1), random.choice((0, 1, 1, 2, 3, 6, 11))
        await cycle(dut, model, start=1, phases=phases, decimation=decimation)
        for _ in range(random.choice((10, 100))):
            await cycle(
                dut,
                model,
                phases=phases,
                decimation=decimation,
                sampled=random.getrandbits(1),
                phase_valid=random.getrandbits(1),
                sin=random.randrange(-full, full),
                cos=random.randrange(-full, full),
                phase=random.getrandbits(16),
                disturbed=int(random.random() < 0.01),
                read=random.getrandbits(1),
                rst=int(random.random() < 0.002),
            )


@pytest.mark.parametrize("w, depth", [(8, 8), (16, 32)])
def test_calibration_recorder(w, depth):
    run("calibration_recorder", __file__, W=w, DEPTH=depth)
