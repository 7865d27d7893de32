# SPDX-License-Identifier: Apache-2.0
"""Tests of peak_offset_tracker: the example of S0 by hand, what the method can and cannot correct,
and every sample against the model.
"""

import math
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import needs, run, start
from tb.sense.peak_offset_tracker import PeakOffsetTracker


class Remover:
    def __init__(self, dut):
        self.dut, self.w = dut, int(dut.W.value)
        self.model, self.top, self.expected = PeakOffsetTracker(self.w), (1 << self.w - 1) - 1, []
        self.last = None  # outputs of the last sample that was done

    async def cycle(self, sin=0, cos=0, valid=1, enable=1, rst=0):
        """Advance design and model by one cycle; return (sin_out, cos_out, sin_offset, cos_offset)
        with done, else None.
        """
        dut = self.dut
        dut.sin.value, dut.cos.value, dut.valid.value, dut.enable.value, dut.rst.value = (
            sin,
            cos,
            valid,
            enable,
            rst,
        )
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        self.expected = [*self.expected, (sin, cos) if valid else None][-2:]
        want = (
            self.model.sample(*self.expected[0], enable)
            if len(self.expected) == 2 and self.expected[0]
            else None
        )
        if rst:
            self.model, self.expected, want = PeakOffsetTracker(self.w), [], None
            self.last = None
        if not int(dut.done.value):
            assert want is None, f"not done, the model has {want}"
            assert self.last is None or self.outputs() == self.last, "they last until the next done"
            return None
        self.last = self.outputs()
        assert self.last == want, f"{self.last}, the model has {want}"
        return self.last

    def outputs(self):
        """(sin_out, cos_out, sin_offset, cos_offset) at this time."""
        names = ("sin_out", "cos_out", "sin_offset", "cos_offset")
        return tuple(getattr(self.dut, name).value.to_signed() for name in names)

    async def feed(self, samples, **settings):
        out = [await self.cycle(sin, cos, **settings) for sin, cos in samples]
        return [o for o in [*out, await self.cycle(valid=0, **settings)] if o]


async def begin(dut):
    await start(dut, enable=1, valid=0, sin=0, cos=0)
    remover = Remover(dut)
    await remover.cycle(valid=0, rst=1)
    return remover


def circle(top, turns, amplitude=0.8, sin_offset=0, cos_offset=0, per_turn=100, noise=0):
    """Samples of a scale in motion, with offsets in LSB."""
    angles = [math.tau * n / per_turn for n in range(int(turns * per_turn))]
    return [
        (
            round(amplitude * top * math.sin(a) + sin_offset + random.uniform(-noise, noise)),
            round(amplitude * top * math.cos(a) + cos_offset + random.uniform(-noise, noise)),
        )
        for a in angles
    ]


@cocotb.test()
async def latency_is_2(dut):
    remover = await begin(dut)
    assert await remover.cycle(5, 6) is None
    assert await remover.cycle(valid=0) == (5, 6, 0, 0)


@cocotb.test()
async def the_offset_is_that_of_s0_by_hand(dut):
    remover = await begin(dut)
    needs(remover.w == 8, "the paper has 8 bits")
    sin = [
        s - 128 for s in (100, 90, 60, 80, 200, 230, 210)
    ]  # Pmin 60, Pmax 230: |255 - 290| / 2 = 17
    out = await remover.feed([(s, -100 + n) for n, s in enumerate(sin)])
    assert [o[2] for o in out] == [0] * 6 + [17] and out[-1][0] == 210 - 128 - 17


@cocotb.test()
async def equal_samples_are_no_turning_point(dut):
    remover = await begin(dut)
    out = await remover.feed([(s, 0) for s in (9, 9, 5, 5, 5, 9, 9, 30, 30, 30, 12)])
    assert [o[2] for o in out] == [0] * 10 + [(5 + 30 + 1) // 2]


@cocotb.test()
async def an_offset_is_gone_after_one_fringe_and_a_quarter(dut):
    remover = await begin(dut)
    for share in (0.1, -0.1, 0.02):
        await remover.cycle(valid=0, rst=1)
        offset = round(share * remover.top)
        out = await remover.feed(circle(remover.top, 4, sin_offset=offset, cos_offset=-offset))
        for sin_out, cos_out, sin_offset, cos_offset in out[125:]:
            assert abs(sin_offset - offset) <= 1 and abs(cos_offset + offset) <= 1
            assert max(abs(sin_out), abs(cos_out)) <= 0.8 * remover.top + 2


@cocotb.test()
async def noise_makes_false_turning_points(dut):
    remover = await begin(dut)
    out = await remover.feed(circle(remover.top, 6, noise=0.03 * remover.top))
    assert (
        max(abs(o[2]) for o in out) > 0.3 * remover.top
    )  # without any offset: the limit of the method


@cocotb.test()
async def with_enable_0_samples_pass_and_the_offset_is_still_known(dut):
    remover = await begin(dut)
    samples = circle(remover.top, 2, sin_offset=9)
    out = await remover.feed(samples, enable=0)
    assert [o[:2] for o in out] == samples and abs(out[-1][2] - 9) <= 1


@cocotb.test()
async def a_corrected_sample_saturates_at_full_scale(dut):
    remover = await begin(dut)
    top = remover.top
    out = await remover.feed(
        zip((-10, -5, -20, -top - 1, -top, top), (5, 10, top, top - 1, 0, -top - 1))
    )
    assert out[-1][:2] == (top, -top - 1)
    assert out[-1][2] < -top // 3 and out[-1][3] > top // 3


@cocotb.test()
async def reset_in_mid_flow_forgets_the_turning_points(dut):
    remover = await begin(dut)
    await remover.feed(circle(remover.top, 2, sin_offset=9))
    await remover.cycle(valid=0, rst=1)
    assert (await remover.feed([(50, 50), (40, 60)])) == [(50, 50, 0, 0), (40, 60, 0, 0)]


@cocotb.test()
async def any_samples_match_the_model_in_every_cycle(dut):
    remover = await begin(dut)
    for cycle in range(6000):
        span = remover.top if cycle // 300 % 2 else 3
        await remover.cycle(
            random.randrange(-span - 1, span + 1),
            random.randrange(-span - 1, span + 1),
            valid=int(random.random() < 0.7),
            enable=int(cycle // 40 % 5 > 0),
            rst=int(random.random() < 0.003),
        )


@pytest.mark.parametrize("w", [8, 12])
def test_peak_offset_tracker(w):
    run("peak_offset_tracker", __file__, W=w)
