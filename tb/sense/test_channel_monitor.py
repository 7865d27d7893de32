# SPDX-License-Identifier: Apache-2.0
"""Tests of channel_monitor: each flag of each channel at its limit and one count below it, both
ends of every range, and random samples against the model.
"""

import random

import cocotb
import numpy as np
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.channel_monitor import NEVER, ChannelMonitor

LATENCY = 12
OFF = {
    "clip_level": NEVER,
    "jump": NEVER,
    "band": 0,
    "span": NEVER,
    "no_noise_samples": 0,
    "sign_threshold": NEVER,
}
OUTPUTS = (
    "clipped",
    "jumped",
    "channel_stuck",
    "no_noise",
    "comparator_mismatch",
    "comparator_stuck",
    "channel_missing",
)


async def begin(dut, sine=False, **settings):
    """`sine`: what sample() calls the channel is the sine, else the cosine."""
    settings = OFF | settings
    await start(dut, valid=0, sin=0, cos=0, a=0, b=0, **settings)
    model = ChannelMonitor()
    model.settings, model.sine = settings, sine
    return model


async def sample(dut, model, channel, other=0, level=0, other_level=0, gap=0):
    """Send one sample and compare the flags with the model when they are done, then wait some
    cycles. Returns the names of the flags that are high.
    """
    cos, sin, a, b = channel, other, level, other_level
    if model.sine:
        cos, sin, a, b = other, channel, other_level, level
    want = tuple(
        int(x[0])
        for x in model.sample(*(np.array([x]) for x in (sin, cos, a, b)), **model.settings)
    )
    dut.valid.value, dut.sin.value, dut.cos.value = 1, sin, cos
    dut.a.value, dut.b.value = a, b
    for n in range(1, LATENCY + gap + 1):
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        # a sample that comes too soon is not seen
        dut.valid.value = int(n < LATENCY - 1 and random.random() < 0.1)
        dut.cos.value, dut.sin.value = random.getrandbits(6), random.getrandbits(6)
        dut.a.value, dut.b.value = random.getrandbits(1), random.getrandbits(1)
        assert int(dut.done.value) == (n == LATENCY)
        got = tuple(int(getattr(dut, name).value) for name in OUTPUTS)
        assert n < LATENCY or got == want, (
            f"cycle {n} after channel {channel}, other {other}, levels {level}{other_level}: "
            f"{OUTPUTS} are {got}, not {want}"
        )
    return [name for name, flag in zip(OUTPUTS, want) if flag]


async def rows(dut, model, *samples):
    return [await sample(dut, model, *s, gap=random.choice([0, 0, 2])) for s in samples]


@cocotb.test()
async def latency_is_12_and_a_code_beyond_the_limit_is_reported_at_once(dut):
    for sine in (False, True):
        low = -(1 << int(dut.W.value) - 1)
        model = await begin(dut, sine, clip_level=-low - 2)
        flags = await rows(
            dut, model, (-low - 2,), (-low - 1,), (low + 2,), (low + 1,), (low,), (0,)
        )
        assert flags == [[], ["clipped"], [], ["clipped"], ["clipped"], []]


@cocotb.test()
async def a_channel_at_rest_while_the_other_moves_is_stuck_from_the_fourth_sample(dut):
    for sine in (False, True):
        model = await begin(dut, sine, band=2, span=50)
        flags = await rows(
            dut,
            model,
            (10, 0),
            (12, 60),
            (8, 60),
            (10, 60),
            (10, 0),
            (13, 0),
            (13, 50),
            (13, -50),
            (13, 51),
            (13, 51),
        )
        assert flags == [
            [],
            [],
            [],
            ["channel_stuck"],
            ["channel_stuck"],
            [],
            [],
            [],
            [],
            ["channel_stuck"],
        ]


@cocotb.test()
async def the_other_channel_must_be_far_away_twice_within_four_samples(dut):
    for sine in (False, True):
        model = await begin(dut, sine, band=2, span=50)
        flags = await rows(
            dut, model, *[(10, 0)] * 5, (10, 60), *[(10, 0)] * 3, (10, 60), *[(10, 0)] * 2, (10, 60)
        )
        assert flags == [[]] * 12 + [["channel_stuck"]]


@cocotb.test()
async def a_channel_at_its_turning_point_is_not_stuck(dut):
    for sine in (False, True):
        model = await begin(dut, sine, band=3, span=80)
        for degrees in np.arange(0, 360, 1):
            cos, sin = 100 * np.cos(np.radians(degrees)), 100 * np.sin(np.radians(degrees))
            assert not await sample(dut, model, round(cos), round(sin))


@cocotb.test()
async def the_same_code_for_no_noise_samples_is_no_noise_until_it_changes(dut):
    for sine in (False, True):
        model = await begin(dut, sine, no_noise_samples=5)
        flags = await rows(
            dut, model, *[(code, n) for n, code in enumerate([7] * 7 + [8] * 5 + [7])]
        )
        assert flags == [[]] * 5 + [["no_noise"]] * 2 + [[]] * 6


@cocotb.test()
async def a_new_no_noise_samples_acts_at_the_next_sample(dut):
    for sine in (False, True):
        model = await begin(dut, sine, no_noise_samples=0)
        assert not any(await rows(dut, model, *[(7, n) for n in range(20)]))
        model.settings["no_noise_samples"] = dut.no_noise_samples.value = 8
        assert await rows(dut, model, (7, 50), (8, 51), (8, 52)) == [["no_noise"], [], []]


@cocotb.test()
async def a_signal_without_noise_is_good_while_no_noise_samples_is_0(dut):
    for sine in (False, True):
        model = await begin(dut, sine, clip_level=100, band=2, span=50, sign_threshold=20)
        for _ in range(300):
            assert not await sample(dut, model, 71, 71, 1, 1)


@cocotb.test()
async def a_comparator_a_sample_early_or_late_is_good(dut):
    for sine in (False, True):
        channels = [95, 59, 0, -59, -95, -95, -59, 0, 59, 95] * 4
        for shift in (-1, 0, 1):
            model = await begin(dut, sine, sign_threshold=20)
            levels = [
                int(channel > 0 or (channel == 0 and before < 0))
                for channel, before in zip(channels, channels[-1:] + channels)
            ]
            levels = levels[-shift:] + levels[:-shift]
            others = [int(1 <= (n - shift) % 10 <= 5) for n in range(len(channels))]
            assert not any(
                await rows(
                    dut,
                    model,
                    *[(channel, 0, a, b) for channel, a, b in zip(channels, levels, others)],
                )
            )


@cocotb.test()
async def three_sure_samples_against_the_comparator_are_a_mismatch(dut):
    for sine in (False, True):
        model = await begin(dut, sine, sign_threshold=20)
        flags = await rows(
            dut,
            model,
            (21, 0, 0),
            (21, 0, 0),
            (21, 0, 0),
            (20, 0, 0),
            (21, 0, 0),
            (21, 0, 1),
            (21, 0, 0),
            (-21, 0, 0),
            (-21, 0, 1),
            (-21, 0, 1),
        )
        assert flags == [
            [],
            [],
            ["comparator_mismatch"],
            [],
            [],
            [],
            [],
            [],
            [],
            ["comparator_mismatch"],
        ]


@cocotb.test()
async def a_comparator_that_is_constant_over_three_sign_changes_is_stuck(dut):
    for sine in (False, True):
        model = await begin(dut, sine, sign_threshold=20)
        flags = await rows(
            dut, model, (50,), (-50,), (50,), (0,), (10,), (-21,), (0, 0, 1), (50, 0, 1)
        )
        assert flags == [[], [], [], [], [], ["comparator_stuck"], [], []]


@cocotb.test()
async def comparators_that_move_without_the_channel_show_that_it_is_missing(dut):
    for sine in (False, True):
        model = await begin(dut, sine, sign_threshold=20)
        turn = [(0, 1), (1, 1), (1, 0), (0, 0)]  # (other level, level), a quarter period each
        flags = await rows(
            dut, model, (50, 0, 1, 0), *[(50, 0, level, other) for other, level in turn * 3]
        )
        assert "channel_missing" in flags[-1] and "channel_missing" not in sum(flags[:7], [])
        assert "channel_missing" not in (await rows(dut, model, (-50, 0, 0, 0)))[0]


@cocotb.test()
async def a_comparator_that_chatters_around_zero_is_no_fault(dut):
    for sine in (False, True):
        model = await begin(dut, sine, sign_threshold=20)
        assert not any(
            await rows(
                dut,
                model,
                (50, 0, 1, 1),
                *[(random.randrange(-20, 21), 90, n % 2, 1) for n in range(60)],
            )
        )


@cocotb.test()
async def reset_clears_the_flags_and_the_history(dut):
    for sine in (False, True):
        settings = {
            "clip_level": 10,
            "band": 2,
            "span": 10,
            "no_noise_samples": 2,
            "sign_threshold": 5,
        }
        model = await begin(dut, sine, **settings)
        flags = await rows(dut, model, *[(11, 30 * n, 0) for n in range(5)])
        assert flags[-1] == ["clipped", "channel_stuck", "no_noise", "comparator_mismatch"]
        model = await begin(dut, sine, **settings)
        assert not any(int(getattr(dut, name).value) for name in OUTPUTS)
        assert await rows(dut, model, (11, 150, 0), (11, 180, 0)) == [["clipped"]] * 2


@cocotb.test()
async def a_step_beyond_jump_and_twice_the_preceding_distance_is_a_jump_from_the_third_sample_on(
    dut,
):
    for sine in (False, True):
        model = await begin(dut, sine, jump=10)
        flags = await rows(
            dut,
            model,
            (90, 0),
            (60, 0),  # a distance of 30, but the first one has no start
            (-10, 0),
            (-90, 0),  # by 80
            (-90, -20),
            (-40, -20),  # by 50: 40 of twice 20, and 10
            (0, -20),
            (91, -20),  # by 91
            (91, -20),
            (102, -20),
            (102, -42),
        )
        jumps = [n for n, names in enumerate(flags) if names]
        assert jumps == [7, 9] and flags[7] == ["jumped"]


@cocotb.test()
async def twice_the_larger_of_the_distances_of_both_channels_is_allowed(dut):
    width = int(dut.W.value)
    low = -(1 << width - 1)
    for larger in (1 << bit for bit in range(width - 2)):
        jump = max(10, larger)
        for sine in (False, True):
            for beyond in (0, 1):
                model = await begin(dut, sine, jump=jump)
                moved = low + larger - 1, low + larger
                far = moved[0] + jump + 2 * larger + beyond
                flags = await rows(dut, model, (low, low), (low, low), moved, (far, moved[1]))
                assert flags == [[], [], [], ["jumped"] * beyond]


@cocotb.test()
async def any_samples_match_the_model(dut):
    top = (1 << int(dut.W.value) - 1) - 1
    for _ in range(10):
        model = await begin(
            dut,
            clip_level=random.choice([top - 1, top, 0, NEVER]),
            jump=random.choice([0, top // 10, top // 2, NEVER]),
            band=random.choice([0, 2, 255]),
            span=random.choice([0, top // 2, top, NEVER]),
            no_noise_samples=random.choice([0, 1, 4, 65535]),
            sign_threshold=random.choice([0, top // 5, top, NEVER]),
        )
        angle, speed, size = (
            0.0,
            random.choice([0.01, 0.1, 0.7, 1.5]),
            random.choice([2, top // 2, top, 2 * top]),
        )
        channels, levels = [0, 0], [0, 0]
        for _ in range(100):
            angle += speed * random.choice([1, 1, 1, 1, 1, -1])
            if random.random() < 0.9:
                channels = [
                    round(min(top, max(-top - 1, size * f(angle) + random.gauss(0, 0.7))))
                    for f in (np.cos, np.sin)
                ]
            levels = [
                int(channel > 0) if random.random() < 0.8 else level
                for channel, level in zip(channels, levels)
            ]
            await sample(dut, model, *channels, *levels, gap=random.choice([0, 0, 0, 1]))


@pytest.mark.parametrize("w", [8, 16])
def test_channel_monitor(w):
    run("channel_monitor", __file__, W=w)
