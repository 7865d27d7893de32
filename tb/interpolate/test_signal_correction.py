# SPDX-License-Identifier: Apache-2.0
"""Tests of signal_correction: by hand, both ends of every range, load, and random samples against
the model in every cycle.
"""

import math
import random
from itertools import product

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import needs, run, start
from tb.interpolate.signal_correction import LATENCY, Settings, SignalCorrection, corrected

IDLE = dict(
    valid=0,
    axis=0,
    sin=0,
    cos=0,
    load=0,
    load_axis=0,
    sin_offset=0,
    cos_offset=0,
    gain=0,
    quadrature_error=0,
)


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    return SignalCorrection(int(dut.W.value), int(dut.AXES.value))


async def cycle(dut, model, valid=0, sin=0, cos=0, load=None, rst=0, axis=0, load_axis=0):
    """Advance design and model by one cycle; returns (done, sin_out, cos_out)."""
    dut.axis.value, dut.load_axis.value = axis, load_axis
    dut.rst.value, dut.valid.value, dut.sin.value, dut.cos.value, dut.load.value = (
        rst,
        valid,
        sin,
        cos,
        int(load is not None),
    )
    if load:
        for name, value in load._asdict().items():
            getattr(dut, name).value = value
    await FallingEdge(dut.clk)
    got = int(dut.done.value), dut.sin_out.value.to_signed(), dut.cos_out.value.to_signed()
    want = model.step(valid, sin, cos, load, rst, axis, load_axis)
    assert got == want, f"got {got}, the model has {want}"
    return got


async def ask(dut, model, sin, cos):
    await cycle(dut, model, 1, sin, cos)
    for _ in range(LATENCY - 2):
        await cycle(dut, model)
    done, *out = await cycle(dut, model)
    assert done
    return tuple(out)


def anything(w, draw):
    full = 1 << w - 1
    return draw.choice((-full, full - 1, 0, draw.randrange(-full, full))), draw.choice(
        (-full, full - 1, 0, draw.randrange(-full, full))
    )


@cocotb.test()
async def latency_is_3_and_samples_may_come_every_cycle(dut):
    model = await begin(dut)
    done = [(await cycle(dut, model, n in (2, 3, 4, 7), n, -n))[0] for n in range(12)]
    assert [n for n, d in enumerate(done) if d] == [4, 5, 6, 9]


@cocotb.test()
async def known_corrections_are_right(dut):
    model, scale = await begin(dut), 1 << 16 - int(dut.W.value)
    assert await ask(dut, model, 100, -50) == (50 * scale, -25 * scale)  # half the size
    await cycle(dut, model, load=Settings(256, -512, 65536 * 3 // 2, -32768))
    u, v = 40 * scale + 512, 60 * scale - 256
    assert await ask(dut, model, 60, 40) == ((3 * v - u + 2) // 4, (u + 1) // 2)


@cocotb.test()
async def a_value_that_is_too_large_saturates(dut):
    model, full = await begin(dut), 1 << int(dut.W.value) - 1
    await cycle(dut, model, load=Settings(-32768, -32768, 131071, 65535))
    assert await ask(dut, model, full - 1, full - 1) == (
        32767,
        min(32767, 32768 - (1 << 16 - int(dut.W.value)) // 2),
    )
    await cycle(dut, model, load=Settings(32767, 32767, 131071, 65535))
    assert (await ask(dut, model, -full, -full)) == (-32768, -32767)


@cocotb.test()
async def both_ends_of_every_range_match_the_model(dut):
    model, full = await begin(dut), 1 << int(dut.W.value) - 1
    for settings in product((-32768, 32767), (-32768, 32767), (0, 131071), (-65536, 65535)):
        await cycle(dut, model, load=Settings(*settings))
        for sin, cos in product((-full, full - 1), repeat=2):
            await cycle(dut, model, 1, sin, cos)
    for _ in range(LATENCY):
        await cycle(dut, model)


@cocotb.test()
async def the_settings_change_between_two_samples(dut):
    model = await begin(dut)
    first, second = Settings(100, 200, 65536, 0), Settings(-3000, 5000, 80000, 9000)
    await cycle(dut, model, load=first)
    await cycle(dut, model, 1, 50, 20, load=second)  # the sample of this cycle has the first ones
    await cycle(dut, model, 1, 50, 20)
    w = int(dut.W.value)
    for settings in (first, second):
        assert await cycle(dut, model) == (1, *corrected(50, 20, settings, w))


@cocotb.test()
async def reset_in_mid_flow_drops_samples_and_settings(dut):
    model = await begin(dut)
    await cycle(dut, model, 1, 5, 5, load=Settings(1, 2, 3, 4))
    await cycle(dut, model, 1, 5, 5, rst=1)
    for _ in range(5):
        assert (await cycle(dut, model))[0] == 0
    assert await ask(dut, model, 0, 0) == (0, 0)


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    model, w = await begin(dut), int(dut.W.value)
    for _ in range(3000):
        load = (
            Settings(
                random.randrange(-32768, 32768),
                random.randrange(-32768, 32768),
                random.randrange(131072),
                random.randrange(-65536, 65536),
            )
            if random.random() < 0.1
            else None
        )
        await cycle(
            dut,
            model,
            random.getrandbits(1),
            *anything(w, random),
            load,
            int(random.random() < 0.005),
            random.randrange(int(dut.AXES.value)),
            random.randrange(int(dut.AXES.value)),
        )


@cocotb.test()
async def each_axis_has_settings_of_its_own(dut):
    axes = int(dut.AXES.value)
    needs(axes > 1, "one axis")
    model = await begin(dut)
    for axis in range(axes - 1):
        await cycle(dut, model, load=Settings(256 * axis, 0, 65536, 0), load_axis=axis)
    for axis in (*range(axes), 0):
        await cycle(dut, model, 1, 100, 0, axis=axis)
    shift = 16 - int(dut.W.value)
    want = [((100 << shift) - 256 * axis) // 2 for axis in range(axes - 1)] + [50 << shift]
    got = [model.out[0]] + [(await cycle(dut, model))[1] for _ in range(LATENCY - 1)]
    assert got == [*want[-2:], want[0]]


def test_the_ellipse_of_its_own_settings_becomes_a_circle():
    """An ellipse with offset, gain and phase error, and the settings that follow from them by
    Heydemann's formulas.
    """
    gain, phase, ox, oy, size = 1.06, math.radians(4), 0.05, -0.04, 26000
    settings = Settings(
        round(oy * size),
        round(ox * size),
        round(65536 / (gain * math.cos(phase))),
        round(-65536 * math.tan(phase)),
    )
    for n in range(1000):
        turn = n / 1000 * math.tau
        sin, cos = (
            round(size * (gain * math.sin(turn + phase) + oy)),
            round(size * (math.cos(turn) + ox)),
        )
        out = corrected(sin, cos, settings, 16)
        assert (
            abs(out[0] - size / 2 * math.sin(turn)) < 2.5
            and abs(out[1] - size / 2 * math.cos(turn)) < 1.5
        )


@pytest.mark.parametrize("w, axes", [(8, 1), (12, 1), (16, 1), (8, 5)])
def test_signal_correction(w, axes):
    run("signal_correction", __file__, W=w, AXES=axes)
