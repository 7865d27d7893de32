# SPDX-License-Identifier: Apache-2.0
"""POWER_UP starts registers and memories without a first value in random states: a block that
depends on them is found.
"""

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import rtl_only, run, start


@cocotb.test()
async def what_has_no_reset_is_random_and_the_rest_is_not(dut):
    await start(dut, take=0)
    await FallingEdge(dut.clk)
    assert int(dut.reset.value) == 0
    assert int(dut.unknown.value) != 0 and int(dut.stored.value) != 0


def test_power_up(monkeypatch):
    rtl_only("the flip-flops of a part start as its maker says")
    monkeypatch.setenv("POWER_UP", "1")
    assert run("power_up_bench", __file__) is None, "a failure is an exception"


def test_icarus_has_no_random_states(monkeypatch):
    monkeypatch.setenv("POWER_UP", "1")
    monkeypatch.setenv("SIM", "icarus")
    with pytest.raises(AssertionError, match="POWER_UP needs Verilator"):
        run("power_up_bench", __file__)
