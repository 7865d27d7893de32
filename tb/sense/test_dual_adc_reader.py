# SPDX-License-Identifier: Apache-2.0
"""Tests of dual_adc_reader against a pair of ADCs that time their bits as the data sheet says:
known codes, timing, and every cycle against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.dual_adc_reader import DualAdcReader


class Adc:
    """Two ADCs: they sample when cs_n falls and send one bit per falling edge of sclk; their
    outputs are wrong until half an sclk period later.
    """

    def __init__(self, leading, bits):
        self.leading, self.bits, self.codes, self.cs_n, self.sclk, self.edges = (
            leading,
            bits,
            (0, 0),
            1,
            1,
            0,
        )

    def lines(self, codes, cs_n, sclk):
        """The levels of sdata_a, sdata_b for these levels of cs_n and sclk; `codes` are the present
        values of the inputs.
        """
        if self.cs_n and not cs_n:
            self.codes, self.edges = codes, 0
        elif self.sclk and not sclk:
            self.edges += 1
        early = sclk == 0  # in the first half after the falling edge the bit is not valid yet
        self.cs_n, self.sclk = cs_n, sclk
        if cs_n:
            return random.getrandbits(1), random.getrandbits(1)  # high impedance
        bit = self.bits - 1 - (self.edges - self.leading)
        levels = [code >> bit & 1 if 0 <= bit < self.bits else 0 for code in self.codes]
        return tuple(1 - level if early else level for level in levels)


def sizes(dut):
    return int(dut.W.value), int(dut.LEADING.value), int(dut.FRAME.value)


async def cycle(dut, model, start_now, lines, rst=0):
    """Advance one cycle; return the outputs after it, which equal those of the model."""
    dut.start.value, dut.rst.value = start_now, rst
    dut.sdata_a.value, dut.sdata_b.value = lines
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    pins = [int(getattr(dut, name).value) for name in ("cs_n", "sclk", "valid")]
    want = model.step(start_now, *lines, rst)
    assert pins == list(want[:3]), f"(cs_n, sclk, valid) is {pins}, the model has {want[:3]}"
    sample = None
    if pins[2] or model.known:
        model.known = True
        sample = dut.sin.value.to_signed(), dut.cos.value.to_signed()
        assert sample == want[3:], f"(sin, cos) is {sample}, the model has {want[3:]}"
    return (*pins, sample)


async def begin(dut):
    await start(dut, start=0, sdata_a=0, sdata_b=0)
    w, leading, frame = sizes(dut)
    model = DualAdcReader(w, leading, frame)
    model.known = False  # sin and cos are undefined before the first sample
    model.step(0, 0, 0, 1)
    return model, Adc(leading, frame - leading)


async def convert(dut, model, adc, codes):
    """Run one conversion: (sin, cos), cycles to valid, cycles until cs_n is high again, falling
    edges of sclk.
    """
    sample, latency, falls, was, n, lines = None, None, 0, 1, 0, (0, 0)
    while True:
        n += 1
        cs_n, sclk, valid, now = await cycle(dut, model, int(n == 1), lines)
        lines = adc.lines(
            codes if n == 1 else (random.getrandbits(8), random.getrandbits(8)), cs_n, sclk
        )
        falls, was = falls + (was and not sclk), sclk
        if valid:
            assert latency is None, "one valid a conversion"
            sample, latency = now, n
        if cs_n:
            return sample, latency, n, falls


@cocotb.test()
async def known_codes_are_read_right(dut):
    model, adc = await begin(dut)
    w, leading, frame = sizes(dut)
    bits = frame - leading  # resolution of this ADC
    one = 1 << bits - w  # codes of this ADC per count of sin
    half, top = 1 << bits - 1, (1 << bits) - 1
    low, high = -(1 << w - 1), (1 << w - 1) - 1
    for codes, want in {
        (0, top): (low, high),
        (top, 0): (high, low),
        (half, half - 1): (0, -1),
        (half + 5 * one, half - 5 * one): (5, -5),
    }.items():
        assert (await convert(dut, model, adc, codes))[0] == want


@cocotb.test()
async def latency_is_2_times_leading_plus_w_and_the_rate_is_2_times_frame_plus_1(dut):
    model, adc = await begin(dut)
    w, leading, frame = sizes(dut)
    for _ in range(3):  # back to back: each start is in the first cycle with cs_n high
        _, latency, length, falls = await convert(dut, model, adc, (1, 2))
        assert (latency, length, falls) == (2 * (leading + w), 2 * frame + 1, frame)
    assert 2 * frame + 1 <= 40  # 100 kS/s at 4 MHz


@cocotb.test()
async def latency_is_1_from_start_to_the_falling_edge_of_cs_n(dut):
    model, _ = await begin(dut)
    assert (await cycle(dut, model, 0, (0, 0)))[0] == 1
    assert (await cycle(dut, model, 1, (0, 0)))[0] == 0


@cocotb.test()
async def start_is_ignored_during_a_conversion(dut):
    model, adc = await begin(dut)
    lines, starts, valids = (0, 0), 0, 0
    for n in range(10 * (2 * sizes(dut)[2] + 1)):
        cs_n, sclk, valid, _ = await cycle(dut, model, 1, lines)
        starts, valids = starts + (adc.cs_n and not cs_n), valids + valid
        lines = adc.lines((n, n), cs_n, sclk)
    assert starts == valids == 10


@cocotb.test()
async def a_dead_adc_reads_as_the_end_of_the_range(dut):
    model, _ = await begin(dut)
    w, _, frame = sizes(dut)
    for level, value in ((0, -(1 << w - 1)), (1, (1 << w - 1) - 1)):
        for n in range(2 * frame + 1):
            sample = (await cycle(dut, model, int(n == 0), (level, level)))[3]
        assert sample == (value, value)


@cocotb.test()
async def reset_in_a_frame_ends_it_without_a_sample(dut):
    model, adc = await begin(dut)
    w, leading, frame = sizes(dut)
    for at in (1, 2, 2 * (leading + w) - 1, 2 * (leading + w), 2 * frame):
        for n in range(at):
            await cycle(dut, model, int(n == 0), (1, 1))
        assert (await cycle(dut, model, 0, (1, 1), rst=1))[:3] == (1, 1, 0)
        for _ in range(2 * frame):
            assert (await cycle(dut, model, 0, (1, 1)))[:3] == (1, 1, 0)
        assert (await convert(dut, model, adc, (0, 0)))[0] == (-(1 << w - 1),) * 2


@cocotb.test()
async def any_signal_matches_the_model(dut):
    model, adc = await begin(dut)
    w, leading, frame = sizes(dut)
    bits = frame - leading
    for _ in range(60):
        codes = random.getrandbits(bits), random.getrandbits(bits)
        sample = (await convert(dut, model, adc, codes))[0]
        assert sample == tuple((code >> bits - w) - (1 << w - 1) for code in codes)
        for _ in range(random.choice([0, 0, 1, 7])):
            await cycle(dut, model, 0, (random.getrandbits(1), random.getrandbits(1)))


@pytest.mark.parametrize("w, leading, frame", [(8, 2, 14), (12, 2, 14), (14, 2, 16), (16, 0, 16)])
def test_dual_adc_reader(w, leading, frame):
    run("dual_adc_reader", __file__, W=w, LEADING=leading, FRAME=frame)
