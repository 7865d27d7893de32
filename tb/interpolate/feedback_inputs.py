# SPDX-License-Identifier: Apache-2.0
"""Settings and idle inputs of feedback_channel for its tests: no filters, no monitor, no motion."""

from cocotb.triggers import FallingEdge

from tb.bench import start

SETTINGS = dict(
    deglitch=0,
    amplitude_low=0,
    amplitude_high=65535,
    encoder_fault_mask=0,
)
INPUTS = dict(
    tick=0,
    sample_tick=0,
    sync=0,
    now=0,
    select=0,
    write=0,
    word=0,
    wdata=0,
    wdata_low=0,
    sensing_written=0,
    limit_written=0,
    shift=0,
    shift_periods=0,
    a=0,
    b=0,
    z=0,
    probe=0,
    own_step=0,
    own_downward=1,
    adc_sin=1,
    adc_cos=1,
    chain_sampled=0,
    chain_sin=0,
    chain_cos=0,
    chain_rejected=0,
    chain_phase_valid=0,
    chain_plain_phase=0,
    chain_done=0,
    chain_step=0,
    chain_phase=0,
    chain_overspeed=0,
    chain_disagreement=0,
    chain_lost=0,
)


async def begin(dut, **levels):
    """Start the design with these levels and else idle inputs, and let one cycle pass."""
    await start(dut, **SETTINGS, **{**INPUTS, **levels})
    await FallingEdge(dut.clk)
