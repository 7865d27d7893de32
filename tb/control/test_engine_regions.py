# SPDX-License-Identifier: Apache-2.0
"""engine_regions: the region of every line against the generator."""

import cocotb
from cocotb.triggers import Timer

from tables.microcode.assembler import LINES
from tb.bench import run
from tb.control.engine_regions import region_of


@cocotb.test()
async def latency_is_0_and_every_region_is_that_of_the_model(dut):
    for line in range(LINES):
        dut.line.value = line
        await Timer(1, "ns")
        assert int(dut.region.value) == region_of(line), f"line {line}"


def test_engine_regions():
    run("engine_regions", __file__)
