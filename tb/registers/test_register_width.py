# SPDX-License-Identifier: Apache-2.0
"""register_width: every address, in a block and outside all blocks."""

import cocotb
from cocotb.triggers import Timer

from tb.bench import run
from tb.registers.register_width import low_words


@cocotb.test()
async def latency_is_0_and_each_word_is_reported_as_the_model_says(dut):
    low = low_words()
    assert len(low) > 50 and 0x010 // 4 in low
    for address in range(1 << 14):
        dut.address.value = address
        await Timer(1, "ns")
        assert int(dut.low.value) == (address in low), f"word {address:#x}"


def test_register_width():
    run("register_width", __file__)
