# SPDX-License-Identifier: Apache-2.0
"""Tests of feedback_channel as a whole: the latency of its header, from the ADC pins on. Its blocks
are tested one by one, their work together in motion in tb/system.
"""

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.interpolate.feedback_inputs import INPUTS, SETTINGS

LATENCY = 22  # cycles from an ADC word to its position; 1 more with a segment table


async def converted(dut):
    """Start a conversion and wait until its word is in the register of the ADC reader."""
    dut.sample_tick.value = 1
    await FallingEdge(dut.clk)
    dut.sample_tick.value = 0
    for _ in range(100):
        if int(dut.g_sine.converted.value):
            return
        await FallingEdge(dut.clk)
    raise AssertionError("no word came from the ADC")


@cocotb.test()
async def latency_is_22_from_an_adc_word_to_position_and_23_with_a_segment_table(
    dut,
):
    latency = LATENCY + bool(int(dut.SEGMENTS.value))
    await start(dut, **SETTINGS, **INPUTS)
    await FallingEdge(dut.clk)
    for adc_cos, eighths in ((1, 1), (0, 3), (1, 1)):  # sin is at its upper end
        dut.adc_cos.value = adc_cos
        await converted(dut)
        for cycle in range(1, latency + 4):
            await FallingEdge(dut.clk)
            assert int(dut.position_valid.value) == (cycle == latency)
        assert (
            abs(dut.position.value.to_signed() - eighths * 8192) < 50
        )  # the ends of 8 bits are 127 and -128
        assert int(dut.phase.value) == dut.position.value.to_unsigned() % 65536


@cocotb.test()
async def reset_in_mid_flow_drops_the_word(dut):
    await start(dut, **SETTINGS, **INPUTS)
    await FallingEdge(dut.clk)
    await converted(dut)
    for cycle in range(LATENCY + 4):
        dut.rst.value = int(cycle == 9)
        await FallingEdge(dut.clk)
        assert not int(dut.position_valid.value)
    assert dut.position.value == 0


@pytest.mark.parametrize("segments", [0, 255])
def test_feedback_channel(segments):
    run("feedback_channel", __file__, SEGMENTS=segments)
