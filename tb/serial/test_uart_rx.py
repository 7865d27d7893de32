# SPDX-License-Identifier: Apache-2.0
"""uart_rx: characters by hand, the tolerance of the bit time either way, glitches, breaks, and
noise against the model.
"""

import random
from fractions import Fraction

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.serial.uart_rx import UartRx, character, line

BIT_TIMES = [128, 133, 256, 256 + 15, 555]  # 1/16 cycle: 8 cycles, …, 115 200 baud at 4 MHz


async def listen(dut, levels, bit_time, model=None):
    """Put the levels on rx, one per cycle, with the model beside the design if there is one. Return
    the characters, framing errors and glitches.
    """
    got, errors, glitches = [], 0, 0
    dut.bit_time.value = bit_time
    last = None
    for n, level in enumerate(levels):
        if level != last:
            dut.rx.value = last = level
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        flags = (
            int(dut.valid.value),
            int(dut.framing_error.value),
            int(dut.start_glitch.value),
            int(dut.busy.value),
        )
        if flags[0]:
            got.append((int(dut.data.value), int(dut.ninth.value)))
        errors, glitches = errors + flags[1], glitches + flags[2]
        if model:
            valid, data, ninth, *others = model.step(level, bit_time)
            want = valid, *others
            assert flags == want, (
                f"cycle {n}: (valid, framing_error, start_glitch, busy) is {flags}, "
                f"the model has {want}"
            )
            if valid:
                assert got[-1] == (data, ninth), f"cycle {n}"
    return got, errors, glitches


async def quiet(dut, bit_time=256):
    await start(dut, rx=1, bit_time=bit_time)
    dut.rst.value = 1
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)
    dut.rst.value = 0
    await listen(dut, [1] * 4, bit_time)


def some(n):
    return [(random.getrandbits(8), random.getrandbits(1)) for _ in range(n)]


def bits_of(characters):
    return [b for c in characters for b in character(*c)]


@cocotb.test()
async def a_character_drawn_by_hand_is_received(dut):
    await quiet(dut)
    start_bit, data, ninth, stop = (
        [0],
        [0, 1, 0, 0, 1, 0, 0, 0],
        [1],
        [1],
    )  # 0x12: a command for node 2
    assert await listen(dut, line([1, *start_bit, *data, *ninth, *stop, 1], 16), 256) == (
        [(0x12, 1)],
        0,
        0,
    )


@cocotb.test()
async def every_character_is_received_without_any_gap(dut):
    await quiet(dut, 128)
    sent = [(data, (data >> 3 ^ data) & 1) for data in range(256)]
    assert await listen(dut, line([*bits_of(sent), 1], 8), 128) == (sent, 0, 0)


@cocotb.test()
async def latency_is_2_at_most_from_the_middle_of_the_stop_bit(dut):
    for bit_time in BIT_TIMES:
        await quiet(dut, bit_time)
        bit_clk = Fraction(bit_time, 16)
        model = UartRx()
        [model.step(1, bit_time) for _ in range(4)]
        levels = line([*character(0x5A, 0), 1], bit_clk)
        first = next(n for n, level in enumerate(levels) if model.step(level, bit_time)[0])
        assert abs(first + 1 - bit_clk * Fraction(21, 2)) <= 2
        assert (await listen(dut, levels[:first], bit_time))[0] == []
        assert (await listen(dut, levels[first:], bit_time))[0] == [(0x5A, 0)]


@cocotb.test()
async def bit_times_may_differ_by_3_8_percent_from_16_cycles_up(dut):
    for bit_time, most in ((256, 40), (256 + 1, 38), (256 + 15, 40), (555, 40)):
        for permille in (-most, most):
            await quiet(dut, bit_time)
            for _ in range(2):
                sent = some(4)
                bits = [*bits_of(sent), 1]
                levels = line(
                    bits,
                    Fraction(bit_time, 16) * (1000 + permille) / 1000,
                    Fraction(random.randrange(100), 100),
                )
                assert await listen(dut, levels, bit_time) == (sent, 0, 0), (bit_time, permille)


@cocotb.test()
async def the_tolerance_ends_above_3_8_percent_either_way(dut):
    """Measured on the model, which is equal in every bit: the smallest mismatch at which a
    character is misread.
    """

    def clean(bit_time, permille):
        for trial in range(12):
            model, sent = UartRx(), [(0x00, 0), (0xFF, 1), (0x80, 0)] if trial < 8 else some(3)
            levels = line(
                [1, *bits_of(sent), 1, 1],
                Fraction(bit_time, 16) * (1000 + permille) / 1000,
                Fraction(trial % 8, 8),
            )
            out = [model.step(level, bit_time) for level in levels]
            if [o[1:3] for o in out if o[0]] != sent:
                return False
        return True

    await quiet(dut)
    # 16, 16.06, 16.5 and 34.7 cycles per bit
    for bit_time, least in ((256, 40), (256 + 1, 38), (256 + 8, 40), (555, 40)):
        slow, fast = (
            next(p for p in range(38, 99, 2) if not clean(bit_time, sign * p)) for sign in (1, -1)
        )
        dut._log.info(
            f"bit_time {bit_time / 16} cycles: first error at +{slow / 10} % and "
            f"-{fast / 10} % of the sender's bit"
        )
        assert least < slow <= 56 and least < fast <= 56


@cocotb.test()
async def a_glitch_instead_of_a_start_bit_is_reported_and_gives_no_character(dut):
    for bit_time in BIT_TIMES:
        await quiet(dut, bit_time)
        bit = bit_time // 16
        for width in range(1, bit // 2 - max(bit // 16, 1) - 1):
            sent = some(1)
            levels = [0] * width + [1] * bit + line([*bits_of(sent), 1], Fraction(bit_time, 16))
            assert await listen(dut, levels, bit_time) == (sent, 0, 1), (bit_time, width)


@cocotb.test()
async def one_wrong_sample_of_three_changes_nothing(dut):
    """A spike of one cycle anywhere before the samples of the stop bit is outvoted."""
    for bit_time, increment in ((128, 1), (256, 3)):
        await quiet(dut, bit_time)
        sent = [(0x96, 1)]
        levels = line([*bits_of(sent), 1], Fraction(bit_time, 16))
        for at in range(1, bit_time // 16 * 21 // 2 - 1, increment):
            bent = list(levels)
            bent[at] ^= 1
            assert await listen(dut, bent, bit_time) == (sent, 0, 0), (bit_time, at)


@cocotb.test()
async def without_a_stop_bit_the_character_is_dropped_and_reported(dut):
    await quiet(dut)
    assert await listen(dut, line([*character(0x55, 0, stop=0), 1, 1], 16), 256) == ([], 1, 0)
    assert await listen(dut, line([*character(0x55, 0), 1], 16), 256) == ([(0x55, 0)], 0, 0)


@cocotb.test()
async def a_break_is_one_framing_error_however_long(dut):
    await quiet(dut)
    assert await listen(dut, [0] * 2000 + [1] * 20, 256) == ([], 1, 0)
    assert await listen(dut, line([*character(0xA3, 1), 1], 16), 256) == ([(0xA3, 1)], 0, 0)


@cocotb.test()
async def reset_drops_the_running_character(dut):
    await quiet(dut)
    levels = line(character(0x00, 0), 16)
    await listen(dut, levels[:100], 256)
    dut.rst.value = 1
    await FallingEdge(dut.clk)
    assert not (dut.valid.value or dut.framing_error.value or dut.start_glitch.value)
    dut.rst.value = 0
    assert await listen(dut, levels[100:] + [1] * 40, 256) == ([], 0, 0)
    assert await listen(dut, line([*character(0x42, 0), 1], 16), 256) == ([(0x42, 0)], 0, 0)


@cocotb.test()
async def less_than_8_cycles_per_bit_count_as_8_more(dut):
    for bit_time in (0, 1, 127):
        await quiet(dut, bit_time)
        sent = some(3)
        levels = line([*bits_of(sent), 1], Fraction(bit_time, 16) + 8)
        assert await listen(dut, levels, bit_time) == (sent, 0, 0)


@cocotb.test()
async def the_longest_bit_is_timed_as_any_other(dut):
    await quiet(dut)
    longest = (1 << 20) - 1
    model = UartRx()
    levels = [1] * 4 + [0] * (longest // 32 - longest // 256 - 8)  # half a start bit
    await quiet(dut, longest)
    dut.rx.value = 0
    for _ in range(40):
        await FallingEdge(dut.clk)
    assert int(dut.busy.value) and not int(dut.start_glitch.value)
    ends = [n for n, level in enumerate(levels + [1] * longest) if model.step(level, longest)[4]]
    assert len(ends) == 1 and abs(ends[0] - 4 - longest * Fraction(5, 8) / 16) < 3


@cocotb.test()
async def noise_matches_the_model(dut):
    for bit_time in (*BIT_TIMES, 0x555, 0xAAA):
        await quiet(dut, bit_time)
        model, levels = UartRx(), []
        for _ in range(4):
            model.step(1, bit_time)
        while len(levels) < 4000:
            kind, bit_clk = (
                random.randrange(4),
                Fraction(bit_time, 16) * random.randrange(930, 1070) / 1000,
            )
            if kind < 2:
                levels += line(bits_of(some(2)), bit_clk)
            elif kind == 2:
                levels += [random.getrandbits(1) for _ in range(random.randrange(60))]
            else:
                levels += [random.getrandbits(1)] * random.randrange(200)
        await listen(dut, levels, bit_time, model)


def test_uart_rx():
    run("uart_rx", __file__)
