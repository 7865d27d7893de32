# SPDX-License-Identifier: Apache-2.0
"""register_layout: every word of the register map, and addresses without a block."""

import random

import cocotb
import pytest
from cocotb.triggers import Timer

from tb.bench import run
from tb.registers.register_block import WORD
from tb.registers.register_layout import RegisterLayout


def model(dut):
    without = [] if int(dut.HAS_SINE.value) else ["HAS_SINE"]
    return RegisterLayout(int(dut.AXES.value), without)


async def outputs(dut, address, wdata):
    dut.address.value, dut.wdata.value = address, wdata
    await Timer(1, "ns")
    return {x: int(getattr(dut, x).value) for x in ("place", "kept", "first", "low", "high")}


@cocotb.test()
async def every_word_matches_the_model(dut):
    layout = model(dut)
    for address in [*range(28 << 6), *(random.getrandbits(14) for _ in range(200)), (1 << 14) - 1]:
        for wdata in (WORD, 0, random.getrandbits(32), random.getrandbits(32)):
            got = await outputs(dut, address, wdata)
            want = {x: getattr(layout, x)(address) for x in ("place", "first", "low", "high")}
            if not want["low"]:
                want["kept"] = layout.kept(address, wdata)
            assert got | want == got, f"word {address:#x}, {wdata:#x}: {got}, the model has {want}"


@cocotb.test()
async def latency_is_0(dut):
    """A signed setting of 16 bits, axis.open_command: the output follows within the cycle."""
    assert (await outputs(dut, 0x4A4 // 4, 0x1_8000 & WORD))["kept"] == 0xFFFF_8000
    assert (await outputs(dut, 0x4A4 // 4, 0x7FFF))["kept"] == 0x7FFF


@cocotb.test()
async def no_two_words_of_the_map_share_a_place(dut):
    layout = model(dut)
    places = {}
    for address in layout.entries:
        place = (await outputs(dut, address, 0))["place"]
        assert places.setdefault(place, address) == address
        assert place < layout.words - 64, "the last 64 words belong to no block"


@pytest.mark.parametrize("axes, sine", [(1, 1), (1, 0), (2, 1), (5, 0), (8, 1)])
def test_register_layout(axes, sine):
    run("register_layout", __file__, AXES=axes, HAS_SINE=sine)
