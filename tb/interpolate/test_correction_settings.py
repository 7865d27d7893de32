# SPDX-License-Identifier: Apache-2.0
"""Tests of correction_settings: the values after reset, load, axes of their own, and random writes
against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.interpolate.correction_settings import CorrectionSettings
from tb.interpolate.signal_correction import Settings

WORDS = ("offset", "gain", "quadrature_error")
IDLE = dict(setting_axis=0, setting=0, load=0) | {f"{word}_written": 0 for word in WORDS}


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    return CorrectionSettings(int(dut.AXES.value))


def draw():
    return Settings(
        random.randrange(-32768, 32768),
        random.randrange(-32768, 32768),
        random.randrange(131072),
        random.randrange(-65536, 65536),
    )


async def cycle(dut, model, axis, word=None, settings=None, load=0, rst=0):
    """Write one word of the settings, or none; returns what is loaded."""
    for name in WORDS:
        getattr(dut, f"{name}_written").value = int(name == word)
    dut.setting_axis.value, dut.load.value, dut.rst.value = axis, load, rst
    dut.setting.value, written = random.getrandbits(32), {}
    if word == "offset":
        written = dict(sin_offset=settings.sin_offset, cos_offset=settings.cos_offset)
        dut.setting.value = (settings.cos_offset % 65536) << 16 | settings.sin_offset % 65536
    elif word:
        written = {word: getattr(settings, word)}
        dut.setting.value = written[word] % (1 << 17) | random.getrandbits(15) << 17
    await FallingEdge(dut.clk)
    loaded = model.step(axis, written, load, rst)
    assert int(dut.load_out.value) == (loaded is not None)
    if loaded:
        assert loaded == (
            int(dut.axis.value),
            Settings(
                dut.sin_offset.value.to_signed(),
                dut.cos_offset.value.to_signed(),
                int(dut.gain.value),
                dut.quadrature_error.value.to_signed(),
            ),
        )
    return loaded


@cocotb.test()
async def latency_is_1_from_load_and_a_value_counts_from_the_next_cycle_on(dut):
    model, last = await begin(dut), int(dut.AXES.value) - 1
    settings = Settings(-32768, 32767, 131071, -65536)
    await cycle(dut, model, last, "offset", settings)
    assert await cycle(dut, model, last, "gain", settings, load=1) == (
        last,
        settings._replace(gain=65536, quadrature_error=0),
    )
    await cycle(dut, model, last, "quadrature_error", settings)
    assert await cycle(dut, model, last, load=1) == (last, settings)


@cocotb.test()
async def after_reset_all_axes_have_the_first_values_again(dut):
    model, axes = await begin(dut), int(dut.AXES.value)
    for axis in range(axes):
        assert await cycle(dut, model, axis, load=1) == (axis, Settings())
        for word in WORDS:
            await cycle(dut, model, axis, word, draw())
    await cycle(dut, model, 0, rst=1)
    for axis in range(axes):
        assert await cycle(dut, model, axis, load=1) == (axis, Settings())


@cocotb.test()
async def any_writes_match_the_model_in_every_cycle(dut):
    model, axes = await begin(dut), int(dut.AXES.value)
    for _ in range(3000):
        word = random.choice((*WORDS, None))
        load, rst = random.getrandbits(1), int(random.random() < 0.01)
        await cycle(dut, model, random.randrange(axes), word, draw(), load, rst)


@pytest.mark.parametrize("axes", [1, 5])
def test_correction_settings(axes):
    run("correction_settings", __file__, AXES=axes)
