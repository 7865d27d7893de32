# SPDX-License-Identifier: Apache-2.0
"""relay_status: each event alone, and all inputs against the model."""

import itertools
import random

import cocotb
from cocotb.triggers import Timer

from tb.bench import run
from tb.relay.relay_status import (
    BEHIND,
    CORRECTING,
    ILLEGAL,
    KNOWN,
    LOADED,
    MISSING,
    REVOLUTION_WRONG,
    SET_REFUSED,
    status,
)

LEVELS = (
    "known loaded reading moved illegal revolution_wrong missing behind set_bad".split()
)  # of one bit


async def outputs(dut, **inputs):
    """All outputs, without a clock; inputs that are not named are 0."""
    inputs = dict.fromkeys([*LEVELS, "rejected", "flags"], 0) | inputs
    for name, level in inputs.items():
        getattr(dut, name).value = level
    await Timer(1, "ns")
    want = status(**inputs)
    assert {name: int(getattr(dut, name).value) for name in want} == want
    return want


@cocotb.test()
async def latency_is_0_and_each_event_has_its_own_bit(dut):
    for name, bit in (
        ("illegal", ILLEGAL),
        ("revolution_wrong", REVOLUTION_WRONG),
        ("missing", MISSING),
        ("behind", BEHIND),
        ("set_bad", SET_REFUSED),
    ):
        assert (await outputs(dut, **{name: 1}))["events"] == bit


@cocotb.test()
async def each_flag_alone_is_a_fault(dut):
    for bit in range(8):
        assert (await outputs(dut, flags=1 << bit))["fault"]
    assert not (await outputs(dut))["fault"]


@cocotb.test()
async def it_corrects_with_a_set_and_a_known_angle(dut):
    assert (await outputs(dut, known=1, loaded=1))["levels"] == KNOWN | LOADED | CORRECTING
    assert not (await outputs(dut, known=1))["correcting"]
    assert not (await outputs(dut, loaded=1))["correcting"]


@cocotb.test()
async def a_set_of_the_flash_that_is_refused_is_no_event(dut):
    assert (await outputs(dut, set_bad=1, reading=1))["events"] == 0


@cocotb.test()
async def all_levels_with_random_flags_match_the_model(dut):
    for levels in itertools.product((0, 1), repeat=len(LEVELS)):
        rejected, flags = random.getrandbits(3), random.choice([0, random.getrandbits(8)])
        await outputs(dut, rejected=rejected, flags=flags, **dict(zip(LEVELS, levels, strict=True)))


def test_relay_status():
    run("relay_status", __file__)
