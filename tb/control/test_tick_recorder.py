# SPDX-License-Identifier: Apache-2.0
"""Tests of tick_recorder: recordings by hand, all signals, signals of two axes, decimation, each
trigger, samples from before it, delay, streams, what is left out, and random use against the model
in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.control.tick_recorder import (
    ALWAYS,
    BEYOND,
    BITS,
    CHANNELS,
    COMMAND,
    EMPTY,
    ERROR,
    FALLS,
    FAULTS,
    FINE_COMMAND,
    FULL,
    IDLE,
    INTEGRAL,
    PHASE,
    POSITION,
    RECORDING,
    RISES,
    SIGNALS,
    TARGET,
    TARGET_VELOCITY,
    WAITING,
    TickRecorder,
    channel,
    packed,
)

AXES = 2
KINDS = (3, TARGET, TARGET_VELOCITY, ERROR, INTEGRAL, COMMAND, 6, 0)  # in the order of the engine
EMPTIED = 10  # cycles in which the channels and what triggers are taken


async def begin(dut):
    await start(dut, **{name: value for name, value in IDLE.items() if name != "rst"})
    await FallingEdge(dut.clk)
    model = TickRecorder(int(dut.WORDS.value), AXES)
    await cycle(dut, model, rst=1)
    return model


async def cycle(dut, model, **inputs):
    """Advance one cycle; returns (word or None, phase, available, triggered, seen_axis)."""
    for name, value in (IDLE | inputs).items():
        getattr(dut, name).value = value
    await FallingEdge(dut.clk)
    want = model.step(**inputs)
    word = None if want[0] is None else dut.word.value.to_unsigned()
    got = (
        word,
        dut.phase.value.to_unsigned(),
        dut.available.value.to_unsigned(),
        int(dut.triggered.value),
        None if want[4] is None else dut.seen_axis.value.to_unsigned(),
    )
    assert got == want, f"(word, phase, available, triggered, axis) is {got}, not {want}"
    return got


def word_of(number, signal, axis=0):
    """What served() gives a signal of an axis in this sample."""
    return 256 * axis + 16 * number + signal


async def served(dut, model, number, ready=1, values=None, **settings):
    """A tick and the results of both axes, in the order of the engine. `values` replaces those of
    some channels; returns phase, available, triggered."""
    given = {channel(n, a): word_of(number, n, a) for n in range(SIGNALS) for a in range(AXES)}
    given |= values or {}
    held = dict(settings, ready=ready)

    async def next_cycle(**inputs):
        axis = dut.seen_axis.value
        axis = axis.to_unsigned() if axis.is_resolvable else 0
        levels = dict(
            sine_cosine=given[channel(0, axis)],
            target=word_of(number - 1, TARGET, axis) & 0xFFFF_FFFF,
            position=given[channel(POSITION, axis)],
            interpolated=given[channel(PHASE, axis)],
            fine_command=given[channel(FINE_COMMAND, axis)],
            faults=given[channel(FAULTS, axis)],
        )
        return await cycle(dut, model, **inputs, **levels, **held)

    await next_cycle(tick=1)
    for _ in range(EMPTIED):
        await next_cycle()
    for axis in range(AXES):
        for n, kind in enumerate(KINDS):
            is_integral = n == KINDS.index(INTEGRAL)
            last = await next_cycle(
                valid=int(not is_integral),
                integral_valid=int(is_integral),
                result_axis=axis,
                kind=0 if is_integral else kind,
                result=given[channel(kind, axis)],
            )
    return last[1:4]


async def words(dut, model, count, **settings):
    """The recording as the firmware reads it."""
    out = []
    for _ in range(count):
        await cycle(dut, model, **settings)
        out.append((await cycle(dut, model, **settings))[0])
        await cycle(dut, model, read=1, **settings)
    return out


async def recorded(dut, model, errors, **settings):
    """Records these errors until it is full; returns how many were served and what was kept."""
    settings = packed(ERROR) | dict(trigger=ERROR) | settings
    await cycle(dut, model, start=1, **settings)
    for number, error in enumerate(errors):
        phase, count, _ = await served(
            dut, model, number, values={ERROR: error & 0xFFFF_FFFF}, **settings
        )
        if phase == FULL:
            kept = await words(dut, model, count, **settings)
            return number + 1, [(word + (1 << 31)) % (1 << 32) - (1 << 31) for word in kept]
    return None


@cocotb.test()
async def latency_is_1_to_full_and_2_to_the_first_and_each_next_word(dut):
    model = await begin(dut)
    settings = packed(COMMAND) | dict(length=2)
    await cycle(dut, model, start=1, **settings)
    await served(dut, model, 0, **settings)
    await cycle(dut, model, tick=1, **settings)
    await cycle(dut, model, valid=1, kind=COMMAND, result=99, **settings)
    assert dut.phase.value.to_unsigned() == RECORDING
    await cycle(dut, model, valid=1, kind=COMMAND, result_axis=1, result=11, **settings)
    assert dut.phase.value.to_unsigned() == FULL and dut.available.value.to_unsigned() == 2
    await cycle(dut, model)
    assert (await cycle(dut, model))[0] == word_of(0, COMMAND)
    await cycle(dut, model, read=1)
    assert (await cycle(dut, model))[0] == 99


@cocotb.test()
async def each_sample_has_the_signals_of_its_tick_in_the_order_of_the_channels(dut):
    model = await begin(dut)
    every_one = [channel(n, axis) for n in range(SIGNALS) for axis in range(AXES)]
    groups = [every_one[n : n + CHANNELS] for n in range(0, len(every_one), CHANNELS)]
    groups += [[channel(COMMAND, 1)], [channel(FAULTS, 1), channel(0), channel(ERROR, 1)]]
    for channels in groups:
        length = model.words // len(channels)
        settings = packed(*channels) | dict(length=length)
        await cycle(dut, model, start=1, **settings)
        for number in range(length):
            assert dut.phase.value.to_unsigned() != FULL
            await served(dut, model, number, **settings)
        count = dut.available.value.to_unsigned()
        assert await words(dut, model, count) == [
            word_of(number, one & 15, one >> 4) for number in range(length) for one in channels
        ]
        assert dut.available.value.to_unsigned() == 0


@cocotb.test()
async def a_signal_waits_for_the_results_that_come_with_it(dut):
    model = await begin(dut)
    settings = packed(1, 2, 3, 4, 5, INTEGRAL, POSITION, FAULTS)
    settings |= dict(length=1, faults=9, position=6, target=99)
    await cycle(dut, model, start=1, **settings)
    await cycle(dut, model, tick=1, **settings)
    for kind in (1, 2, 3, 4):
        await cycle(dut, model, valid=1, kind=kind, result=kind, **settings)
    await cycle(dut, model, integral_valid=1, result=66, **settings)
    for _ in range(EMPTIED):
        await cycle(dut, model, **settings)
    await cycle(dut, model, valid=1, kind=COMMAND, result=5, **settings)
    await cycle(dut, model, valid=1, kind=COMMAND, result_axis=1, result=55, **settings)
    assert await words(dut, model, 8) == [1, 2, 3, 4, 5, 66, 6, 9]


@cocotb.test()
async def of_two_channels_that_are_the_same_the_first_one_has_the_results(dut):
    model = await begin(dut)
    settings = packed(ERROR, POSITION, ERROR) | dict(length=2)
    await cycle(dut, model, start=1, **settings)
    for number in range(2):
        await served(dut, model, number, **settings)
    kept = await words(dut, model, 5)
    assert kept[0] == word_of(0, ERROR) and kept[3:] == [word_of(1, ERROR), word_of(1, POSITION)]


@cocotb.test()
async def a_target_at_rest_gives_no_results_and_is_recorded_with_no_velocity(dut):
    model = await begin(dut)
    settings = packed(TARGET, TARGET_VELOCITY) | dict(length=3, target=99)
    settings |= dict(trigger=TARGET_VELOCITY, trigger_mode=RISES, level=1, earlier=1)
    await cycle(dut, model, start=1, **settings)
    for velocity in (None, 7, 7, None, 7):
        await cycle(dut, model, tick=1, **settings)
        for _ in range(EMPTIED):
            await cycle(dut, model, **settings)
        for kind, result in ((1, 50), (2, velocity)):
            if velocity:
                await cycle(dut, model, valid=1, kind=kind, result=result, **settings)
        await cycle(dut, model, valid=1, kind=COMMAND, result_axis=1, **settings)
    assert await words(dut, model, 6) == [99, 0, 50, 7, 50, 7]


@cocotb.test()
async def one_tick_in_so_many_is_kept_and_0_acts_as_1(dut):
    model = await begin(dut)
    for every in (0, 1, 2, 5):
        settings = packed(ERROR) | dict(length=3, every=every)
        await cycle(dut, model, start=1, **settings)
        number = 0
        while dut.phase.value.to_unsigned() != FULL:
            await served(dut, model, number, **settings)
            number += 1
        step = max(every, 1)
        assert await words(dut, model, 3) == [word_of(step * n, ERROR) for n in range(3)]


@cocotb.test()
async def each_trigger_finds_its_sample_and_keeps_those_before_it(dut):
    model = await begin(dut)
    errors = [9, 1, -3, 4, 6, 8, 3, -7, -9, 2, 0, 0, 0]
    for settings, first in (
        (dict(trigger_mode=ALWAYS), 0),
        (dict(trigger_mode=RISES, level=5), 4),
        (dict(trigger_mode=RISES, level=0), 3),
        (dict(trigger_mode=FALLS, level=5), 1),
        (dict(trigger_mode=FALLS, level=-8 & 0xFFFF_FFFF), 8),
        (dict(trigger_mode=BEYOND, level=9), 0),
        (dict(trigger_mode=BITS, level=4), 2),
    ):
        served_count, kept = await recorded(dut, model, errors, length=3, **settings)
        assert kept == errors[first : first + 3] and served_count == first + 3
    for before in (1, 2, 4):
        settings = dict(trigger_mode=BEYOND, level=7, length=5, earlier=before)
        _, kept = await recorded(dut, model, errors, **settings)
        assert kept == errors[5 - before : 10 - before], "9 came before there were samples"


@cocotb.test()
async def what_triggers_need_not_be_recorded_nor_be_of_the_same_axis(dut):
    model = await begin(dut)
    for axis in range(AXES):
        for signal in (FAULTS, INTEGRAL, COMMAND):
            settings = packed(channel(POSITION, 1 - axis)) | dict(trigger_mode=BITS, level=0b110)
            settings |= dict(trigger=channel(signal, axis), length=2, earlier=1)
            await cycle(dut, model, start=1, **settings)
            for number, bits in enumerate((0b110, 0, 1, 0b1000, 0b100, 0, 0)):
                values = {channel(signal, axis): bits, channel(signal, 1 - axis): 0b110}
                await served(dut, model, number, values=values, **settings)
                want = FULL if number >= 4 else WAITING
                assert dut.phase.value.to_unsigned() == want
            kept = [word_of(n, POSITION, 1 - axis) for n in (3, 4)]
            assert await words(dut, model, 2) == kept


@cocotb.test()
async def after_a_delay_the_first_sample_waits_until_it_is_ready(dut):
    model = await begin(dut)
    for delay, first in ((1, 3), (2, 4), (5, 7)):
        settings = packed(ERROR) | dict(length=2, delay=delay)
        settings |= dict(trigger=ERROR, trigger_mode=RISES, level=word_of(2, ERROR))
        await cycle(dut, model, start=1, **settings)
        for number in range(11):
            phase, _, triggered = await served(
                dut, model, number, ready=int(number != first), **settings
            )
            assert triggered == (2 <= number < first + 2), "until the recording is full"
            assert phase == (
                WAITING if number <= first else FULL if number >= first + 2 else RECORDING
            )
        assert await words(dut, model, 2) == [word_of(first + n, ERROR) for n in (1, 2)]


@cocotb.test()
async def a_recording_that_is_too_long_ends_when_the_memory_is_full(dut):
    model = await begin(dut)
    settings = packed(0, 1, 2) | dict(length=1000)
    await cycle(dut, model, start=1, **settings)
    number = 0
    while dut.phase.value.to_unsigned() != FULL:
        await served(dut, model, number, **settings)
        number += 1
    assert number == model.words // 3 and dut.available.value.to_unsigned() == 3 * number


@cocotb.test()
async def a_stream_is_read_while_it_records_until_nobody_reads(dut):
    model = await begin(dut)
    settings = packed(ERROR, POSITION) | dict(length=0)
    await cycle(dut, model, start=1, **settings)
    got, number = [], 0
    for number in range(3 * model.words):
        await served(dut, model, number, **settings)
        assert dut.phase.value.to_unsigned() == RECORDING
        got += await words(dut, model, dut.available.value.to_unsigned(), **settings)
    assert got == [word_of(n, s) for n in range(number + 1) for s in (ERROR, POSITION)]
    while dut.phase.value.to_unsigned() != FULL:
        number += 1
        await served(dut, model, number, **settings)
    rest = await words(dut, model, dut.available.value.to_unsigned(), **settings)
    assert len(rest) == model.words // 2 * 2 and rest[-1] == word_of(number, POSITION)


@cocotb.test()
async def results_between_two_ticks_change_nothing(dut):
    model = await begin(dut)
    settings = packed(TARGET, ERROR) | dict(length=2)
    await cycle(dut, model, start=1, **settings)
    for number in range(2):
        await served(dut, model, number, **settings)
        await cycle(dut, model, valid=1, kind=1, result=77, **settings)
    assert await words(dut, model, 4) == [1, ERROR, 17, 16 + ERROR]


@cocotb.test()
async def start_or_reset_in_the_middle_forgets_the_recording(dut):
    model = await begin(dut)
    settings = packed(ERROR) | dict(length=2)
    for how in ("start", "rst"):
        await cycle(dut, model, start=1, **settings)
        await served(dut, model, 50, **settings)
        await cycle(dut, model, **{how: 1}, **settings)
        for number in range(2):
            await served(dut, model, number, **settings)
        assert dut.phase.value.to_unsigned() == (FULL if how == "start" else EMPTY)


@cocotb.test()
async def any_use_matches_the_model_in_every_cycle(dut):
    model = await begin(dut)
    for _ in range(80):
        channels = random.getrandbits(64)  # of any axis, some of these two
        if random.getrandbits(1):
            channels &= 0x1F1F_1F1F_1F1F_1F1F
        last = random.randrange(CHANNELS)
        most = model.words // (last + 1)
        length = random.choice((0, most, random.randrange(1, most + 2)))
        settings = dict(
            last=last,
            channels=channels,
            trigger=random.choice((random.getrandbits(8), channel(random.randrange(SIGNALS)))),
            trigger_mode=random.randrange(8),
            level=random.choice((0, 5, random.getrandbits(32))),
            length=length,
            every=random.choice((0, 1, 1, 2, 3)),
            earlier=random.choice((0, 0, random.randrange(max(length, 2)))),
            delay=random.choice((0, 0, 1, 3)),
        )
        await cycle(dut, model, start=1, **settings)
        for _ in range(random.choice((10, 300))):
            await cycle(
                dut,
                model,
                tick=int(random.random() < 0.1),
                ready=random.getrandbits(1),
                sine_cosine=random.getrandbits(32),
                target=random.getrandbits(32),
                position=random.getrandbits(32),
                interpolated=random.getrandbits(16),
                fine_command=random.getrandbits(32),
                faults=random.getrandbits(4),
                valid=random.getrandbits(1),
                integral_valid=int(random.random() < 0.2),
                result_axis=random.choice([*range(AXES), random.randrange(8)]),
                kind=random.choice([COMMAND, random.randrange(8)]),
                result=random.getrandbits(32),
                read=random.getrandbits(1),
                rst=int(random.random() < 0.002),
                **settings,
            )


@pytest.mark.parametrize("words", [16, 32])
def test_tick_recorder(words):
    run("tick_recorder", __file__, AXES=AXES, WORDS=words)
