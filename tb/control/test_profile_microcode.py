# SPDX-License-Identifier: Apache-2.0
"""profile_microcode: every line against its generator, and that the file is not stale. What the
lines do is tested with profile_player.
"""

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from tables import profile_microcode
from tb.bench import run


@cocotb.test()
async def latency_is_1_and_every_line_is_that_of_the_generator(dut):
    codes = [code for _, _, code in profile_microcode.assembled()]
    codes += [0] * (128 - len(codes))
    Clock(dut.clk, 10, "ns").start()
    await FallingEdge(dut.clk)
    for number, code in enumerate(codes):
        dut.next.value = number
        await FallingEdge(dut.clk)
        assert int(dut.code.value) == code, f"line {number}"


def test_profile_microcode():
    run("profile_microcode", __file__)


def test_the_made_file_is_fresh():
    assert profile_microcode.main(["--check"]) == 0
