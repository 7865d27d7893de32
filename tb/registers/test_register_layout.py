# SPDX-License-Identifier: Apache-2.0
"""register_layout: every word of the register map, and addresses without a block."""

import random

import cocotb
import pytest
from cocotb.triggers import Timer

from tb.bench import run
from tb.registers.register_block import WORD
from tb.registers.register_layout import RegisterLayout, built_of, parameters

OPEN_COMMAND = 0x4A4 // 4


def model(dut):
    return RegisterLayout(int(dut.AXES.value), built_of(dut))


async def outputs(dut, address, wdata):
    dut.address.value, dut.wdata.value = address, wdata
    await Timer(1, "ns")
    return {x: int(getattr(dut, x).value) for x in ("place", "stored_bits", "first", "low", "high")}


@cocotb.test()
async def every_word_matches_the_model(dut):
    layout = model(dut)
    for address in [*range(28 << 6), *(random.getrandbits(14) for _ in range(200)), (1 << 14) - 1]:
        for wdata in (WORD, 0, random.getrandbits(32), random.getrandbits(32)):
            got = await outputs(dut, address, wdata)
            want = {x: getattr(layout, x)(address) for x in ("place", "first", "low", "high")}
            if not want["low"]:
                want["stored_bits"] = layout.stored_bits(address, wdata)
            assert got | want == got, f"word {address:#x}, {wdata:#x}: {got}, the model has {want}"


@cocotb.test()
async def latency_is_0(dut):
    """A signed setting of 16 bits, axis.open_command: the output follows within the cycle."""
    there = model(dut).has(model(dut).entries[OPEN_COMMAND][0].fields[0], 0)
    assert (await outputs(dut, OPEN_COMMAND, 0x1_8000))["stored_bits"] == (
        0xFFFF_8000 if there else 0
    )
    assert (await outputs(dut, OPEN_COMMAND, 0x7FFF))["stored_bits"] == (0x7FFF if there else 0)


@cocotb.test()
async def no_two_words_of_the_map_share_a_place(dut):
    layout = model(dut)
    places = {}
    for address in layout.entries:
        place = (await outputs(dut, address, 0))["place"]
        assert places.setdefault(place, address) == address
        assert place < layout.words - 64, "the last 64 words belong to no block"


ALIKE = [(1, {}), (2, {}), (8, {}), (1, dict.fromkeys(parameters(), 0))]
DIFFERING = [(5, dict(HAS_SINE=0b00101, HAS_DRIVE=0b11100)), (8, dict(HAS_STEPPER=0x0F))]


@pytest.mark.parametrize("axes, masks", ALIKE + DIFFERING)
def test_register_layout(axes, masks):
    run("register_layout", __file__, AXES=axes, **masks)
