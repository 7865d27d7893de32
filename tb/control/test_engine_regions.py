# SPDX-License-Identifier: Apache-2.0
"""engine_regions: the region of every line against the generator."""

import cocotb
from cocotb.triggers import Timer

from tables.engine_microcode import LINES, REGIONS, assembled, regions
from tb.bench import run


@cocotb.test()
async def latency_is_0_and_every_region_is_that_of_the_generator(dut):
    found = [REGIONS.index(name) for name in regions(assembled())]
    for line, region in enumerate(found + [0] * (LINES - len(found))):
        dut.line.value = line
        await Timer(1, "ns")
        assert int(dut.region.value) == region, f"line {line}"


def test_engine_regions():
    run("engine_regions", __file__)
