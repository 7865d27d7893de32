# SPDX-License-Identifier: Apache-2.0
"""Tests of outlier_filter: a spike by hand, both ends of both settings, the filter of S0, and
random samples with gaps against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import needs, run, start
from tb.sense.outlier_filter import OutlierFilter


async def begin(dut):
    await start(dut, valid=0, axis=0, sin=0, cos=0, step=0, hold=0)
    return OutlierFilter()


async def stream(dut, model, samples, step, hold, gaps=False, axis=0):
    """Send the samples and compare each with the model one cycle later; return (sin_out, cos_out,
    rejected) of each.
    """
    dut.step.value, dut.hold.value, dut.axis.value, out = step, hold, axis, []
    for sin, cos in samples:
        while gaps and random.getrandbits(1):
            dut.valid.value, dut.sin.value, dut.cos.value = (
                0,
                random.getrandbits(7),
                random.getrandbits(7),
            )
            await RisingEdge(dut.clk)
            await FallingEdge(dut.clk)
            assert not int(dut.done.value) and not int(dut.rejected.value)
            held = dut.sin_out.value.to_signed(), dut.cos_out.value.to_signed()
            assert not out or held == out[-1][:2], f"{held} after {out[-1]}"
        dut.valid.value, dut.sin.value, dut.cos.value = 1, sin, cos
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        dut.valid.value = 0
        assert int(dut.done.value)
        got = dut.sin_out.value.to_signed(), dut.cos_out.value.to_signed(), int(dut.rejected.value)
        want = model.sample(sin, cos, step, hold)
        assert got == want, (
            f"sample {len(out)}: (sin_out, cos_out, rejected) is {got}, the model has {want}"
        )
        out.append(got)
    return out


@cocotb.test()
async def latency_is_1_and_a_spike_is_held_back_on_its_own_channel(dut):
    model = await begin(dut)  # stream() checks done 1 cycle after valid
    out = await stream(
        dut, model, [(0, 100), (5, 99), (90, 98), (10, 97), (15, -100), (20, 95)], 10, 3
    )
    assert out == [(0, 100, 0), (5, 99, 0), (5, 98, 1), (10, 97, 0), (15, 97, 1), (20, 95, 0)]


@cocotb.test()
async def a_step_equal_to_the_setting_is_taken_and_one_count_more_is_not(dut):
    model = await begin(dut)
    out = await stream(dut, model, [(0, 0), (7, -7), (15, -15), (14, -14)], 7, 3)
    assert out == [(0, 0, 0), (7, -7, 0), (7, -7, 1), (14, -14, 0)]


@cocotb.test()
async def step_0_takes_every_sample(dut):
    model = await begin(dut)
    low, high = -(1 << int(dut.W.value) - 1), (1 << int(dut.W.value) - 1) - 1
    samples = [(low, high), (high, low)] * 10
    assert await stream(dut, model, samples, 0, 255) == [(*sample, 0) for sample in samples]


@cocotb.test()
async def the_whole_range_in_one_step_is_seen_as_a_jump(dut):
    model = await begin(dut)
    low, high = -(1 << int(dut.W.value) - 1), (1 << int(dut.W.value) - 1) - 1
    out = await stream(
        dut, model, [(low, high), (high, low), (low, high)], 255 if low < -128 else 254, 255
    )
    assert out == [(low, high, 0), (low, high, 1), (low, high, 0)]


@cocotb.test()
async def after_hold_samples_the_next_is_taken(dut):
    for hold in (0, 1, 3, 254):
        model = await begin(dut)
        out = await stream(dut, model, [(0, 0)] + [(100, -100)] * (hold + 2), 10, hold)
        assert out == [(0, 0, 0)] + [(0, 0, 1)] * hold + [(100, -100, 0)] * 2


@cocotb.test()
async def hold_255_is_the_filter_of_s0_and_never_returns(dut):
    for near, far in (((9, 0), (100, 0)), ((0, 9), (0, 100))):
        model = await begin(dut)
        out = await stream(dut, model, [(0, 0)] + [far] * 600, 10, 255)
        assert out == [(0, 0, 0)] + [(0, 0, 1)] * 600
        assert await stream(dut, model, [near, far], 10, 255) == [(*near, 0), (*near, 1)]
        await stream(dut, model, [far] * 299, 10, 255)  # the count of samples stops at its end
        assert await stream(dut, model, [far], 10, 100) == [(*far, 0)]


@cocotb.test()
async def a_good_sample_restarts_the_count_of_held_samples(dut):
    model = await begin(dut)
    out = await stream(
        dut, model, [(0, 0), (99, 0), (99, 0), (1, 0), (99, 0), (99, 0), (99, 0)], 10, 2
    )
    assert [sin for sin, _, _ in out] == [0, 0, 0, 1, 1, 1, 99]


@cocotb.test()
async def reset_takes_the_next_sample_whatever_it_is(dut):
    model = await begin(dut)
    await stream(dut, model, [(0, 0), (100, 0)], 10, 255)
    dut.rst.value, dut.valid.value = 1, 1
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert not int(dut.done.value) and not int(dut.rejected.value)
    dut.rst.value, dut.valid.value = 0, 0
    assert await stream(dut, OutlierFilter(), [(-100, 77)], 10, 255) == [(-100, 77, 0)]


@cocotb.test()
async def any_samples_match_the_model(dut):
    model = await begin(dut)
    w = int(dut.W.value)
    for _ in range(60):
        step, hold = random.choice([0, 1, 20, 100, 255]), random.choice([0, 1, 2, 5, 255])
        near = [(random.randrange(-30, 30), random.randrange(-30, 30)) for _ in range(30)]
        far = [tuple(random.randrange(-(1 << w - 1), 1 << w - 1) for _ in "ab") for _ in range(10)]
        samples = near + far
        random.shuffle(samples)
        await stream(dut, model, samples, step, hold, gaps=True)


@cocotb.test()
async def axes_with_settings_of_their_own_do_not_disturb_each_other(dut):
    axes = int(dut.AXES.value)
    needs(axes > 1, "one axis")
    await begin(dut)
    models = [OutlierFilter() for _ in range(axes)]
    settings = [(random.choice([0, 20, 100]), random.choice([1, 3, 255])) for _ in range(axes)]
    for _ in range(3000):
        axis = random.randrange(axes)
        sample = (random.randrange(-30, 30), random.randrange(-128, 128))
        await stream(dut, models[axis], [sample], *settings[axis], axis=axis)


@pytest.mark.parametrize("w, axes", [(8, 1), (16, 1), (8, 5)])
def test_outlier_filter(w, axes):
    run("outlier_filter", __file__, W=w, AXES=axes)
