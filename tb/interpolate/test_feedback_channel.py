# SPDX-License-Identifier: Apache-2.0
"""Tests of feedback_channel as a whole: the latency of its header, from the ADC pins on, with a
chain of its own and with a shared one. Its blocks are tested one by one, their work together in
motion in tb/system.
"""

import math

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tables import registers
from tb.bench import needs, rtl_only, run
from tb.interpolate.feedback_inputs import begin

BLOCK = next(block for block in registers.read() if block.name == "feedback")
WORDS = {register.name: register.word for register in BLOCK.registers}
STROBES = {f.name: 1 << f.low for r, f in BLOCK.fields if r.name == "strobes"}
OVERSPEED = 1 << next(
    f.low
    for block in registers.read()
    for r, f in block.fields
    if (block.name, r.name, f.name) == ("axis", "encoder_events", "overspeed")
)
LATENCY = 22  # cycles from an ADC word to its position; 1 more with a segment table


async def converted(dut):
    """Start a conversion and wait until its word is in the register of the ADC reader."""
    dut.sample_tick.value = 1
    await FallingEdge(dut.clk)
    dut.sample_tick.value = 0
    if int(dut.HAS_OWN_CHAIN.value):
        rtl_only("when the word of a channel with its own chain comes is known inside only")
    word = dut.u_sine.g_built.converted if int(dut.HAS_OWN_CHAIN.value) else dut.sample_valid
    for _ in range(100):
        if int(word.value):
            return
        await FallingEdge(dut.clk)
    raise AssertionError("no word came from the ADC")


@cocotb.test()
async def latency_is_22_from_an_adc_word_to_position_and_23_with_a_segment_table(
    dut,
):
    needs(int(dut.HAS_OWN_CHAIN.value), "the chain is shared")
    latency = LATENCY + bool(int(dut.SEGMENTS.value))
    await begin(dut)
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


async def write(dut, name, value):
    """Write a register of the channel."""
    dut.select.value, dut.write.value, dut.word.value, dut.wdata.value = 1, 1, WORDS[name], value
    await FallingEdge(dut.clk)
    dut.select.value = dut.write.value = 0
    dut.wdata.value = 0xFFFF_FFFF  # of another access


async def phase(dut):
    await converted(dut)
    for _ in range(LATENCY + 2):
        await FallingEdge(dut.clk)
    return int(dut.phase.value)


@cocotb.test()
async def correction_and_harmonics_that_are_written_over_the_bus_act_from_their_strobe_on(dut):
    needs(int(dut.HAS_OWN_CHAIN.value), "the chain is shared")
    await begin(dut)
    dut.adc_cos.value = 1
    plain = await phase(dut)
    assert abs(plain - 8192) < 50
    for point in range(256):
        await write(dut, "harmonic_point", point << 18 | 1600)
    await write(dut, "correction_offset", 0x4000 << 16)  # half of the cosine
    assert await phase(dut) == plain
    await write(dut, "strobes", STROBES["swap_harmonics"])
    assert await phase(dut) == plain - 100
    await write(dut, "strobes", STROBES["load_correction"])
    assert abs(await phase(dut) - (math.atan2(127, 63) / math.tau * 65536 - 100)) < 50
    await write(dut, "harmonic_enable", 0)
    assert abs(await phase(dut) - math.atan2(127, 63) / math.tau * 65536) < 50


@cocotb.test()
async def a_shared_chain_has_a_word_at_once_and_its_step_is_in_the_position_1_cycle_later(dut):
    needs(not int(dut.HAS_OWN_CHAIN.value), "the chain is its own")
    await begin(dut)
    await converted(dut)
    assert int(dut.sample_valid.value)
    assert dut.sample_sin.value.to_signed() == dut.sample_cos.value.to_signed() == 127
    dut.chain_done.value, dut.chain_step.value, dut.chain_phase.value = 1, 8192, 8192
    for cycle in range(1, 5):
        await FallingEdge(dut.clk)
        dut.chain_done.value = 0
        assert int(dut.position_valid.value) == (cycle == 1 + bool(int(dut.SEGMENTS.value)))
    assert dut.position.value == 8192 and dut.phase.value == 8192


@cocotb.test()
async def what_a_shared_chain_has_of_another_axis_stays_outside(dut):
    needs(not int(dut.HAS_OWN_CHAIN.value), "the chain is its own")
    await begin(dut)

    def shown():
        return dut.sin.value.to_signed(), dut.cos.value.to_signed(), int(dut.phase.value)

    dut.chain_sin.value, dut.chain_cos.value, dut.chain_sampled.value = 50, -60, 1
    dut.chain_phase.value, dut.chain_done.value = 7000, 1
    await FallingEdge(dut.clk)
    assert shown() == (50, -60, 7000)
    dut.chain_sampled.value = dut.chain_done.value = 0
    dut.chain_sin.value, dut.chain_cos.value, dut.chain_phase.value = -1, 2, 900
    for _ in range(4):
        await FallingEdge(dut.clk)
        assert shown() == (50, -60, 7000)
    dut.chain_sampled.value = 1
    await FallingEdge(dut.clk)
    assert shown() == (-1, 2, 7000)
    dut.chain_sampled.value, dut.chain_done.value = 0, 1
    await FallingEdge(dut.clk)
    assert shown() == (-1, 2, 900)


@cocotb.test()
async def a_sample_that_a_shared_chain_lost_is_the_event_overspeed(dut):
    needs(not int(dut.HAS_OWN_CHAIN.value), "the chain is its own")
    await begin(dut)
    assert not int(dut.events.value)
    dut.chain_lost.value, dut.encoder_fault_mask.value = 1, OVERSPEED
    await FallingEdge(dut.clk)
    assert dut.events.value == OVERSPEED and int(dut.encoder_fault.value)
    dut.chain_lost.value = 0
    await FallingEdge(dut.clk)
    assert not int(dut.events.value) and not int(dut.encoder_fault.value)


@cocotb.test()
async def reset_in_mid_flow_drops_the_word(dut):
    await begin(dut)
    await converted(dut)
    for cycle in range(LATENCY + 4):
        dut.rst.value = int(cycle == 9)
        await FallingEdge(dut.clk)
        assert not int(dut.position_valid.value)
    assert dut.position.value == 0


@pytest.mark.parametrize("own_chain", [0, 1])
@pytest.mark.parametrize("segments", [0, 255])
def test_feedback_channel(segments, own_chain):
    run("feedback_channel", __file__, SEGMENTS=segments, HAS_OWN_CHAIN=own_chain)
