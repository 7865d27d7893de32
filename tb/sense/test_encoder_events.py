# SPDX-License-Identifier: Apache-2.0
"""encoder_events: each event and signal fault alone, the short pulse, and random inputs against
the model.
"""

import random

import cocotb
from cocotb.triggers import Timer

from tb.bench import run
from tb.sense.encoder_events import (
    AMPLITUDE_HIGH,
    AMPLITUDE_LOW,
    DISAGREEMENT,
    ILLEGAL_EDGE,
    OVERSPEED,
    PULSE_TOO_SHORT,
    PULSES,
    collected,
)

WIDTHS = dict(
    event_mask=6,
    signal_fault_mask=15,
    decoder_mode=2,
    own_steps=1,
    illegal_edge=1,
    overspeed=1,
    disagreement=1,
    signal_faults=15,
    edge_rejected=3,
)


async def outputs(dut, **inputs):
    """All outputs, without a clock; inputs that are not named are 0."""
    inputs = dict.fromkeys(WIDTHS, 0) | inputs
    for name, level in inputs.items():
        getattr(dut, name).value = level
    await Timer(1, "ns")
    want = collected(**inputs)
    assert {name: int(getattr(dut, name).value) for name in want} == want
    return want


@cocotb.test()
async def latency_is_0_and_each_event_has_its_own_bit_and_its_own_mask(dut):
    for cause, bit in (
        (dict(illegal_edge=1), ILLEGAL_EDGE),
        (dict(overspeed=1), OVERSPEED),
        (dict(signal_faults=1), AMPLITUDE_LOW),
        (dict(signal_faults=2), AMPLITUDE_HIGH),
        (dict(disagreement=1), DISAGREEMENT),
        (dict(edge_rejected=1, decoder_mode=PULSES), PULSE_TOO_SHORT),
    ):
        for mask in (bit, 63 - bit):
            got = await outputs(dut, event_mask=mask, **cause)
            assert (got["events"], got["fault"]) == (bit, int(mask == bit))


@cocotb.test()
async def each_signal_fault_counts_only_with_its_bit_of_the_mask(dut):
    for n in range(15):
        assert (await outputs(dut, signal_faults=1 << n, signal_fault_mask=1 << n))["fault"]
        other = await outputs(dut, signal_faults=1 << n, signal_fault_mask=0x7FFF ^ 1 << n)
        assert not other["fault"]


@cocotb.test()
async def a_rejected_pulse_is_a_lost_step_only_with_pulses_and_direction_from_the_pins(dut):
    for mode in range(4):
        for own in (0, 1):
            got = await outputs(dut, decoder_mode=mode, own_steps=own, edge_rejected=1)
            lost = mode == PULSES and not own
            assert (got["events"], got["pulse_rejected"]) == (PULSE_TOO_SHORT * lost, 1)
    assert (await outputs(dut, decoder_mode=PULSES, edge_rejected=6))["events"] == 0


@cocotb.test()
async def random_inputs_match_the_model(dut):
    for _ in range(2000):
        await outputs(dut, **{name: random.getrandbits(w) for name, w in WIDTHS.items()})


def test_encoder_events():
    run("encoder_events", __file__)
