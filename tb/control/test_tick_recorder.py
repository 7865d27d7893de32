# SPDX-License-Identifier: Apache-2.0
"""Tests of tick_recorder: a recording by hand, all signals, decimation, the wait for a waveform,
what is left out, and random use against the model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.control.tick_recorder import COMMAND, TickRecorder

IDLE = dict(
    start=0,
    axis=0,
    signals=0,
    length=1,
    every=1,
    tick=0,
    ready=1,
    sine_cosine=0,
    valid=0,
    result_axis=0,
    kind=0,
    result=0,
    read=0,
)
ERROR = 4


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    model = TickRecorder(int(dut.WORDS.value))
    await cycle(dut, model, rst=1)
    return model


async def cycle(dut, model, **inputs):
    """Advance one cycle; returns (word or None, recording, full)."""
    for name, value in (IDLE | dict(rst=0) | inputs).items():
        getattr(dut, name).value = value
    await FallingEdge(dut.clk)
    want = model.step(**inputs)
    word = None if want[0] is None else dut.word.value.to_unsigned()
    got = word, int(dut.recording.value), int(dut.full.value)
    assert got == want, f"(word, recording, full) is {got}, the model has {want}"
    return got


async def served(dut, model, number, axis=0, ready=1, **settings):
    """A tick and the results of two axes, in the order of the engine; values name tick and kind."""
    await cycle(dut, model, axis=axis, tick=1, ready=ready, sine_cosine=8 * number, **settings)
    for result_axis in range(2):
        for kind in (3, 1, 2, ERROR, COMMAND, 6, 0):
            await cycle(
                dut,
                model,
                axis=axis,
                valid=1,
                result_axis=result_axis,
                kind=kind,
                result=8 * number + kind + (1 << 20) * (result_axis != axis),
                ready=ready,
                **settings,
            )


async def words(dut, model, count):
    """The recording as the firmware reads it."""
    assert dut.full.value == 1
    out = []
    for _ in range(count):
        await cycle(dut, model)
        out.append((await cycle(dut, model))[0])
        await cycle(dut, model, read=1)
    return out


@cocotb.test()
async def latency_is_1_to_full_and_2_to_the_first_and_each_next_word(dut):
    model = await begin(dut)
    settings = dict(signals=1 << COMMAND, length=2)
    await cycle(dut, model, start=1, **settings)
    await served(dut, model, 0, **settings)
    await cycle(dut, model, tick=1, **settings)
    assert not int(dut.full.value)
    await cycle(dut, model, valid=1, kind=COMMAND, result=99, **settings)
    assert int(dut.full.value)
    await cycle(dut, model)
    assert (await cycle(dut, model))[0] == COMMAND
    await cycle(dut, model, read=1)
    assert (await cycle(dut, model))[0] == 99


@cocotb.test()
async def each_sample_has_the_chosen_signals_of_its_tick_in_order(dut):
    model = await begin(dut)
    for signals in (0b111111, 0b110000, 0b000001, 0b001000, 0b100010):
        kinds = [n for n in range(6) if signals >> n & 1]
        for axis in range(2):
            length = model.words // len(kinds)
            settings = dict(signals=signals, length=length)
            await cycle(dut, model, start=1, axis=axis, **settings)
            for number in range(length):
                assert not int(dut.full.value)
                await served(dut, model, number, axis, **settings)
            assert await words(dut, model, length * len(kinds)) == [
                8 * number + kind for number in range(length) for kind in kinds
            ]


@cocotb.test()
async def one_tick_in_so_many_is_kept_and_0_acts_as_1(dut):
    model = await begin(dut)
    for every in (0, 1, 2, 5):
        settings = dict(signals=1 << ERROR, length=3, every=every)
        await cycle(dut, model, start=1, **settings)
        number = 0
        while not int(dut.full.value):
            await served(dut, model, number, **settings)
            number += 1
        step = max(every, 1)
        assert await words(dut, model, 3) == [8 * step * n + ERROR for n in range(3)]


@cocotb.test()
async def the_first_sample_waits_until_it_is_ready(dut):
    model = await begin(dut)
    settings = dict(signals=1 << ERROR, length=2)
    await cycle(dut, model, start=1, **settings)
    for number in range(3):
        await served(dut, model, number, ready=0, **settings)
        assert int(dut.recording.value)
    await served(dut, model, 3, **settings)
    await served(dut, model, 4, ready=0, **settings)
    assert await words(dut, model, 2) == [8 * 3 + ERROR, 8 * 4 + ERROR]


@cocotb.test()
async def results_between_two_ticks_change_nothing(dut):
    model = await begin(dut)
    settings = dict(signals=0b010010, length=2)
    await cycle(dut, model, start=1, **settings)
    for number in range(2):
        await served(dut, model, number, **settings)
        await cycle(dut, model, valid=1, kind=1, result=77, **settings)
    assert await words(dut, model, 4) == [1, ERROR, 9, 8 + ERROR]


@cocotb.test()
async def start_or_reset_in_the_middle_forgets_the_recording(dut):
    model = await begin(dut)
    settings = dict(signals=1 << ERROR, length=2)
    for how in ("start", "rst"):
        await cycle(dut, model, start=1, **settings)
        await served(dut, model, 50, **settings)
        await cycle(dut, model, **{how: 1}, **settings)
        for number in range(2):
            await served(dut, model, number, **settings)
        assert int(dut.full.value) == (how == "start")


@cocotb.test()
async def any_use_matches_the_model_in_every_cycle(dut):
    model = await begin(dut)
    for _ in range(60):
        signals = random.randrange(1, 64)
        settings = dict(
            axis=random.randrange(8),
            signals=signals,
            length=random.randrange(1, model.words // signals.bit_count() + 1),
            every=random.choice((0, 1, 1, 2, 3)),
        )
        await cycle(dut, model, start=1, **settings)
        for _ in range(random.choice((10, 200))):
            await cycle(
                dut,
                model,
                tick=int(random.random() < 0.1),
                ready=random.getrandbits(1),
                sine_cosine=random.getrandbits(32),
                valid=random.getrandbits(1),
                result_axis=random.choice([settings["axis"], random.randrange(8)]),
                kind=random.randrange(8),
                result=random.getrandbits(32),
                read=random.getrandbits(1),
                rst=int(random.random() < 0.002),
                **settings,
            )


@pytest.mark.parametrize("words", [8, 64])
def test_tick_recorder(words):
    run("tick_recorder", __file__, WORDS=words)
