# SPDX-License-Identifier: Apache-2.0
"""register_access: single accesses with and without waiting, requests that come too soon, reset in
the middle, and random requests against the model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.registers.register_access import RegisterAccess

OUTPUTS = ("free", "waits", "done", "select")
OF_ACCESS = ("write", "address", "wdata")  # from the first access on


class Bench:
    def __init__(self, dut):
        self.dut, self.model = dut, RegisterAccess(int(dut.LATENCY.value))
        self.accessed = False

    async def begin(self):
        await start(self.dut, take=0, put=0, at=0, value=0, ready=0)
        await self.clk(rst=1)
        return self

    async def clk(self, **inputs):
        """Advance one cycle: the outputs after it, all compared with the model."""
        inputs = dict(take=0, put=0, at=0, value=0, ready=0, rst=0) | inputs
        for name, level in inputs.items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        self.accessed |= bool(inputs["take"])
        self.model.step(**inputs)
        names = OUTPUTS + OF_ACCESS if self.accessed else OUTPUTS
        got = {name: int(getattr(self.dut, name).value) for name in names}
        assert got == {name: getattr(self.model, name) for name in names}
        return got


@cocotb.test()
async def latency_is_2_from_take_to_select_and_latency_from_there_to_done(dut):
    bench = await Bench(dut).begin()
    seen = [await bench.clk(take=n == 0, put=1, at=0xC, value=0x1234, ready=1) for n in range(6)]
    latency = int(dut.LATENCY.value)
    assert [one["select"] for one in seen] == [0, 1, 0, 0, 0, 0]
    assert [one["done"] for one in seen].index(1) == 1 + latency
    assert [one["free"] for one in seen] == [0] * (2 + latency) + [1] * (4 - latency)
    assert all((one["write"], one["address"], one["wdata"]) == (1, 0xC, 0x1234) for one in seen)


@cocotb.test()
async def an_access_waits_for_ready_and_its_address_is_there_one_cycle_before(dut):
    bench = await Bench(dut).begin()
    await bench.clk(take=1, put=0, at=8, ready=1)
    for _ in range(20):
        waiting = await bench.clk()
        assert not waiting["select"] and not waiting["free"] and waiting["address"] == 8
    assert (await bench.clk(ready=1))["select"]


@cocotb.test()
async def a_request_during_an_access_has_no_effect(dut):
    bench = await Bench(dut).begin()
    await bench.clk(take=1, put=1, at=4, value=1)
    for _ in range(5):
        assert (await bench.clk(take=1, put=0, at=0, value=2))["wdata"] == 1
    selects = [(await bench.clk(ready=1))["select"] for _ in range(10)]
    assert sum(selects) == 1


@cocotb.test()
async def a_reset_ends_an_access_at_each_point(dut):
    bench = await Bench(dut).begin()
    for cycles in range(6):
        await bench.clk(take=1, put=1, at=4, value=cycles, ready=1)
        for _ in range(cycles):
            await bench.clk(ready=1)
        assert (await bench.clk(rst=1, ready=1))["free"]
        assert not any([(await bench.clk(ready=1))["done"] for _ in range(5)])


@cocotb.test()
async def any_requests_match_the_model(dut):
    bench = await Bench(dut).begin()
    done = 0
    for _ in range(1500):
        done += (
            await bench.clk(
                take=random.random() < 0.6,
                put=random.getrandbits(1),
                at=random.getrandbits(int(dut.ADDRESS_W.value)),
                value=random.getrandbits(32),
                ready=random.random() < 0.7,
                rst=random.random() < 0.01,
            )
        )["done"]
    assert done > 150


def test_register_access():
    run("register_access", __file__, LATENCY=2, ADDRESS_W=16)
