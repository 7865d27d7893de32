# SPDX-License-Identifier: Apache-2.0
"""Tests of arctan_rom: every word, one per cycle, against its generator."""

import cocotb
from cocotb.triggers import Timer

from tables import arctan
from tb.bench import run


@cocotb.test()
async def latency_is_1_and_every_word_equals_its_generator(dut):
    dut.clk.value = 0
    for index, want in enumerate(zip(arctan.BASE, arctan.SLOPE)):
        dut.index.value = index
        await Timer(1, "ns")
        dut.clk.value = 1
        await Timer(1, "ns")
        dut.clk.value = 0
        assert (int(dut.base.value), int(dut.slope.value)) == want, f"index {index}"


def test_arctan_rom():
    run("arctan_rom", __file__)
