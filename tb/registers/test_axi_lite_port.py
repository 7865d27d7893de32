# SPDX-License-Identifier: Apache-2.0
"""axi_lite_port: whole accesses by a master, each order of address and word, a master that lets
responses wait, refused writes, reads and writes that come together, and random levels against the
model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.registers.axi_lite_port import AxiLitePort
from tb.registers.bus_masters import AxiLiteMaster, BusError, Registers

ANSWERS = ("awready", "arready", "bvalid", "rvalid")


def latency_of(dut):
    return int(dut.LATENCY.value)


async def begin(dut):
    """A master, and the registers behind the port."""
    master = AxiLiteMaster(dut)
    registers = Registers(dut, latency_of(dut))
    await start(dut)
    await FallingEdge(dut.clk)
    cocotb.start_soon(registers.serve())
    return master, registers


async def cycles_until(dut, name):
    """Cycles until this output is high, for the inputs as they are."""
    for cycles in range(1, 50):
        await FallingEdge(dut.clk)
        if int(getattr(dut, f"axi_{name}").value):
            return cycles
    raise AssertionError(f"{name} is not high within 50 cycles")


@cocotb.test()
async def latency_is_3_cycles_more_than_that_of_the_register_bus(dut):
    master, registers = await begin(dut)
    registers.words[4] = 77
    dut.axi_araddr.value, dut.axi_arvalid.value = 4, 1
    assert await cycles_until(dut, "rvalid") == latency_of(dut) + 3
    assert int(dut.axi_rdata.value) == 77
    dut.axi_arvalid.value = 0
    await master.response("r")
    dut.axi_awaddr.value, dut.axi_awvalid.value, dut.axi_wvalid.value = 8, 1, 1
    dut.axi_wdata.value, dut.axi_wstrb.value = 78, 15
    assert await cycles_until(dut, "bvalid") == latency_of(dut) + 3
    assert registers.words[8] == 78


@cocotb.test()
async def latency_is_2_cycles_to_the_answer_of_a_refused_write(dut):
    master, registers = await begin(dut)
    for strobes in range(15):
        dut.axi_awvalid.value = dut.axi_wvalid.value = 1
        dut.axi_wstrb.value = strobes
        assert await cycles_until(dut, "bvalid") == 2
        assert int(dut.axi_bresp.value) == 2
        dut.axi_awvalid.value = dut.axi_wvalid.value = 0
        with pytest.raises(BusError):
            await master.response("b")
    assert not registers.accesses
    await master.write(4, 5)
    assert await master.read(4) == 5, "the next access is as usual"


@cocotb.test()
async def each_word_that_was_written_is_read_again(dut):
    master, registers = await begin(dut)
    top = (1 << int(dut.ADDRESS_W.value)) - 4
    words = {address: random.getrandbits(32) for address in (0, 4, 8, top - 4, top)}
    for address, word in words.items():
        await master.write(address, word, wait=random.randrange(4))
    assert registers.accesses == [(1, address, word) for address, word in words.items()]
    for address, word in words.items():
        assert await master.read(address + random.randrange(4), wait=random.randrange(4)) == word


@cocotb.test()
async def address_and_word_of_a_write_may_come_in_any_order(dut):
    master, registers = await begin(dut)
    for first, second in (("aw", "w"), ("w", "aw")):
        dut.axi_awaddr.value, dut.axi_wdata.value, dut.axi_wstrb.value = 4, len(first), 15
        getattr(dut, f"axi_{first}valid").value = 1
        for _ in range(10):
            await FallingEdge(dut.clk)
            assert not int(dut.axi_awready.value) and not int(dut.axi_wready.value)
        await master.transfer(first, second)
        await master.response("b")
        assert registers.accesses.pop() == (1, 4, len(first)) and not registers.accesses


@cocotb.test()
async def a_read_and_a_write_that_wait_together_take_turns(dut):
    master, registers = await begin(dut)
    dut.axi_awaddr.value, dut.axi_wstrb.value, dut.axi_araddr.value = 4, 15, 8
    for name in ("awvalid", "wvalid", "arvalid", "bready", "rready"):
        getattr(dut, f"axi_{name}").value = 1
    for _ in range(20 * (latency_of(dut) + 4)):
        await FallingEdge(dut.clk)
    kinds = [write for write, *_ in registers.accesses]
    assert len(kinds) in (19, 20) and all(a != b for a, b in zip(kinds, kinds[1:]))


@cocotb.test()
async def any_levels_match_the_model(dut):
    model = AxiLitePort(latency_of(dut))
    names = (*AxiLiteMaster.INPUTS, "ready", "rdata", "rst")
    pins = {
        name: getattr(dut, name if name in ("ready", "rdata", "rst") else f"axi_{name}")
        for name in names
    }
    inputs = dict.fromkeys(names, 0)
    pins["ready"].value = pins["rdata"].value = 0
    AxiLiteMaster(dut)
    await start(dut)
    await FallingEdge(dut.clk)
    accessed, seen = False, dict.fromkeys(ANSWERS, 0)
    width = int(dut.ADDRESS_W.value)
    for n in range(2000):
        answers = {name: getattr(model, name) for name in ANSWERS}
        if not inputs["awvalid"] or answers["awready"]:
            inputs |= {"awvalid": int(random.random() < 0.4), "awaddr": random.getrandbits(width)}
        if not inputs["wvalid"] or answers["awready"]:
            inputs |= {"wvalid": int(random.random() < 0.4), "wdata": random.getrandbits(32)}
            inputs["wstrb"] = random.choice([15, 15, 15, random.getrandbits(4)])
        if not inputs["arvalid"] or answers["arready"]:
            inputs |= {"arvalid": int(random.random() < 0.4), "araddr": random.getrandbits(width)}
        inputs |= {name: int(random.random() < 0.6) for name in ("bready", "rready")}
        inputs["ready"], inputs["rdata"] = int(random.random() < 0.8), random.getrandbits(32)
        inputs["rst"] = int(n == 0 or random.random() < 0.005)
        for name, level in inputs.items():
            pins[name].value = level
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        model.step(**inputs)
        for name in ANSWERS:
            assert int(getattr(dut, f"axi_{name}").value) == getattr(model, name), f"cycle {n}"
            seen[name] += getattr(model, name)
        assert int(dut.axi_wready.value) == model.awready and not int(dut.axi_rresp.value)
        assert int(dut.select.value) == model.access.select
        accessed |= not model.access.free
        if accessed:
            assert int(dut.address.value) == model.access.address
            assert int(dut.wdata.value) == model.access.wdata
            assert int(dut.write.value) == model.access.write
        if model.bvalid:
            assert int(dut.axi_bresp.value) == model.bresp
        if model.rvalid:
            assert int(dut.axi_rdata.value) == model.rdata
    assert min(seen.values()) > 30


def test_axi_lite_port():
    run("axi_lite_port", __file__, LATENCY=2, ADDRESS_W=16)
