# SPDX-License-Identifier: Apache-2.0
"""amplitude_monitor: known lengths, the stated bound over every 8-bit pair, the three-in-a-row rule, and the model."""
import math
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from amplitude_monitor import IN_A_ROW, AmplitudeMonitor, amplitude
from bench import run, start


async def begin(dut):
    await start(dut, valid=0, sin=0, cos=0, low=0, high=65535)
    return AmplitudeMonitor()


def pins(dut):
    return int(dut.amplitude.value), int(dut.too_low.value), int(dut.too_high.value)


async def sample(dut, model, sin, cos, low=0, high=65535, gap=0):
    """One sample: its amplitude stands 8 clk later and the flags 9 clk later, not sooner. Returns what then stands."""
    before = pins(dut)
    dut.low.value, dut.high.value = low, high
    dut.valid.value, dut.sin.value, dut.cos.value = 1, sin, cos
    want = model.sample(sin, cos, low, high)
    for n in range(1, 10 + gap):
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        dut.valid.value, dut.sin.value, dut.cos.value = 0, random.getrandbits(7), random.getrandbits(7)
        stands = before if n < 8 else (want[0], *before[1:]) if n == 8 else want
        assert pins(dut) == stands, f"clk {n} after ({sin}, {cos}): (amplitude, too_low, too_high) is {pins(dut)}, not {stands}"
    return want


@cocotb.test()
async def known_lengths_by_hand_latency_is_8_and_9(dut):
    model = await begin(dut)
    for sin, cos, length in [(0, 0, 0), (100, 0, 100), (0, -100, 100), (-60, 80, 100), (3, 4, 5), (-5, -12, 13), (1, 0, 1)]:
        assert (await sample(dut, model, sin, cos))[0] == length


@cocotb.test()
async def ends_of_the_range(dut):
    model = await begin(dut)
    low, high = -(1 << int(dut.W.value) - 1), (1 << int(dut.W.value) - 1) - 1
    for sin in (low, -1, 0, 1, high):
        for cos in (low, -1, 0, 1, high):
            now = (await sample(dut, model, sin, cos))[0]
            assert abs(now - math.hypot(sin, cos)) <= 0.7 + 0.002 * math.hypot(sin, cos)


@cocotb.test()
async def flags_stand_only_after_three_in_a_row_and_until_the_first_good_one(dut):
    model = await begin(dut)
    window = {"low": 32, "high": 100}
    flags = [(await sample(dut, model, s, 0, **window))[1:] for s in [31, 31, 32, 31, 31, 31, 31, 32, 31]]
    assert flags == [(0, 0)] * 5 + [(1, 0)] * 2 + [(0, 0)] * 2
    flags = [(await sample(dut, model, 0, c, **window))[1:] for c in [101, 101, 100, 101, 101, -101, -101, -100, 101]]
    assert flags == [(0, 0)] * 5 + [(0, 1)] * 2 + [(0, 0)] * 2
    flags = [(await sample(dut, model, s, 0, **window))[1:] for s in [31, 31, 101, 31, 31, 101]]
    assert flags == [(0, 0)] * 6                        # low and high in turn are not three in a row


@cocotb.test()
async def the_widest_window_never_flags(dut):
    model = await begin(dut)
    low = -(1 << int(dut.W.value) - 1)
    for _ in range(5):
        assert (await sample(dut, model, 0, 0))[1:] == (0, 0)
        assert (await sample(dut, model, low, low))[1:] == (0, 0)


@cocotb.test()
async def samples_that_come_too_soon_are_not_heard(dut):
    await begin(dut)
    dut.valid.value, dut.sin.value, dut.cos.value = 1, 50, 0
    seen = []
    for _ in range(27):
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        dut.sin.value = 50 + len(seen)
        seen.append(int(dut.amplitude.value))
    assert seen == [0] * 7 + [50] * 9 + [50 + 8] * 9 + [50 + 17] * 2


@cocotb.test()
async def reset_drops_the_sample_in_flight_and_the_flags(dut):
    model = await begin(dut)
    for _ in range(3):
        await sample(dut, model, 1, 0, low=32)
    assert pins(dut) == (1, 1, 0)
    dut.valid.value, dut.sin.value = 1, 99
    for n in range(4):
        dut.rst.value = int(n == 3)
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        dut.valid.value = 0
    dut.rst.value = 0
    assert pins(dut) == (0, 0, 0)
    for _ in range(12):
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        assert pins(dut) == (0, 0, 0)
    model = AmplitudeMonitor()
    assert [(await sample(dut, model, 1, 0, low=32))[1] for _ in range(3)] == [0, 0, 1]


@cocotb.test()
async def any_samples_match_the_model(dut):
    model = await begin(dut)
    w = int(dut.W.value)
    for _ in range(250):
        size = 1 << random.randrange(1, w)
        sin, cos = random.randrange(-size, size), random.randrange(-size, size)
        window = random.choice([(0, 65535), (size // 2, size), (size, min(2 * size, 65535))])
        await sample(dut, model, sin, cos, *window, gap=random.choice([0, 0, 3]))


def test_every_pair_of_8_bits_is_within_the_stated_bound():
    worst = max(abs(amplitude(sin, cos) - math.hypot(sin, cos)) for sin in range(-128, 128) for cos in range(-128, 128))
    assert worst <= 0.7


def test_any_pair_of_16_bits_is_within_the_stated_bound():
    draw = random.Random(1)
    for _ in range(50_000):
        size = 1 << draw.randrange(1, 16)
        sin, cos = draw.randrange(-size, size), draw.randrange(-size, size)
        true = math.hypot(sin, cos)
        assert abs(amplitude(sin, cos) - true) <= 0.7 + 0.002 * true
    assert IN_A_ROW == 3


@pytest.mark.parametrize("w", [8, 16])
def test_amplitude_monitor(w):
    run("amplitude_monitor", __file__, W=w)
