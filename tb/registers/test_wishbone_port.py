# SPDX-License-Identifier: Apache-2.0
"""wishbone_port: whole accesses by a master, refused writes, accesses that are given up at each
point, a register bus that is not ready, and random levels against the model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.registers.bus_masters import BusError, Registers, WishboneMaster
from tb.registers.wishbone_port import WishbonePort


def latency_of(dut):
    return int(dut.LATENCY.value)


async def begin(dut):
    """A master, and the registers behind the port."""
    master = WishboneMaster(dut)
    registers = Registers(dut, latency_of(dut))
    await start(dut)
    await FallingEdge(dut.clk)
    cocotb.start_soon(registers.serve())
    return master, registers


@cocotb.test()
async def latency_is_3_cycles_more_than_that_of_the_register_bus(dut):
    master, registers = await begin(dut)
    registers.words[4] = 77
    assert await master.access(4) == (77, latency_of(dut) + 3)
    assert await master.access(4, 78) == (None, latency_of(dut) + 3)


@cocotb.test()
async def each_word_that_was_written_is_read_again(dut):
    master, registers = await begin(dut)
    top = (1 << int(dut.ADDRESS_W.value)) - 4
    words = {address: random.getrandbits(32) for address in (0, 4, 8, top - 4, top)}
    for address, word in words.items():
        await master.write(address, word)
    assert registers.accesses == [(1, address, word) for address, word in words.items()]
    for address, word in words.items():
        assert await master.read(address) == word


@cocotb.test()
async def latency_is_1_to_the_error_of_a_write_without_all_bytes(dut):
    master, registers = await begin(dut)
    for sel in range(15):
        master.begin(4, 1, sel)
        await FallingEdge(dut.clk)
        assert int(dut.wb_err.value) and not int(dut.wb_ack.value)
        with pytest.raises(BusError):
            await master.access(4, 1, sel)
    assert not registers.accesses
    registers.words[4] = 5
    assert (await master.access(4, sel=1))[0] == 5, "a read gives the whole word"


@cocotb.test()
async def an_access_waits_until_the_registers_are_ready(dut):
    master, registers = await begin(dut)
    left = 100

    def is_ready():
        nonlocal left
        left -= 1
        return left < 0

    registers.is_ready, registers.words[8] = is_ready, 9
    word, cycles = await master.access(8)
    assert word == 9 and 100 <= cycles <= 105


@cocotb.test()
async def accesses_follow_each_other_every_latency_plus_4_cycles(dut):
    master, registers = await begin(dut)
    ends = []
    master.begin(4)
    for cycle in range(60):
        await FallingEdge(dut.clk)
        if master.ended():
            ends.append(cycle)
            registers.words[4] = len(ends)
    gaps = {b - a for a, b in zip(ends, ends[1:])}
    assert gaps == {latency_of(dut) + 4} and len(registers.accesses) >= len(ends)


@cocotb.test()
async def an_access_that_is_given_up_gets_no_answer_and_the_next_one_its_own(dut):
    master, registers = await begin(dut)
    registers.words = {4: 111, 8: 222}
    for cycles in range(1, latency_of(dut) + 3):
        for line in ("cyc", "stb"):
            master.begin(4)
            for _ in range(cycles):
                await FallingEdge(dut.clk)
                assert not master.ended()
            master.pins[line].value = 0
            await FallingEdge(dut.clk)
            assert not master.ended()
            assert await master.read(8) == 222


@cocotb.test()
async def any_levels_match_the_model(dut):
    model = WishbonePort(latency_of(dut))
    inputs = dict.fromkeys(("cyc", "stb", "we", "adr", "sel", "dat_w", "ready", "rdata", "rst"), 0)
    pins = {
        name: getattr(dut, name if name in ("ready", "rdata", "rst") else f"wb_{name}")
        for name in inputs
    }
    for pin in pins.values():
        pin.value = 0
    await start(dut)
    await FallingEdge(dut.clk)
    accessed, answered, seen = False, False, {"ack": 0, "err": 0}
    for n in range(2000):
        if n == 0 or random.random() < 0.15 or model.ack or model.err:
            busy = random.random()
            inputs |= {
                "cyc": int(busy < 0.9),
                "stb": int(busy < 0.8),
                "we": random.getrandbits(1),
                "adr": random.getrandbits(int(dut.ADDRESS_W.value) - 2),
                "sel": random.choice([15, 15, random.getrandbits(4)]),
                "dat_w": random.getrandbits(32),
            }
        inputs["ready"], inputs["rdata"] = int(random.random() < 0.8), random.getrandbits(32)
        inputs["rst"] = int(n == 0 or random.random() < 0.005)
        for name, level in inputs.items():
            pins[name].value = level
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        answered |= bool(model.access.done)
        model.step(**inputs)
        for name in ("ack", "err"):
            assert int(getattr(dut, f"wb_{name}").value) == getattr(model, name), f"cycle {n}"
            seen[name] += getattr(model, name)
        assert int(dut.select.value) == model.access.select
        accessed |= not model.access.free
        if accessed:
            assert int(dut.address.value) == model.access.address
            assert int(dut.wdata.value) == model.access.wdata
            assert int(dut.write.value) == model.access.write
        if answered:
            assert int(dut.wb_dat_r.value) == model.dat_r, f"cycle {n}"
    assert min(seen.values()) > 20


@pytest.mark.parametrize("latency, address_w", [(1, 4), (2, 16)])
def test_wishbone_port(latency, address_w):
    run("wishbone_port", __file__, LATENCY=latency, ADDRESS_W=address_w)
