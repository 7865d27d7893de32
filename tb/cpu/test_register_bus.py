# SPDX-License-Identifier: Apache-2.0
"""register_bus: every block at both ends of its range, addresses without a block, and random
accesses against the model.
"""

import random

import cocotb
import pytest
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer

from moire.made.registers import BLOCKS
from tb.bench import run
from tb.cpu.register_bus import RegisterBus

# addresses of the blocks of which there is one, and of the first one of those that each axis has
ALONE = {name: base for name, (base, stride) in BLOCKS.items() if not stride}
OF_AXES = {name: base for name, (base, stride) in BLOCKS.items() if stride}


async def access(dut, model, select, address):
    """Advance one cycle with this access and compare the selects with the model. Return the answers
    that the blocks give in the next cycle.
    """
    word = lambda: random.getrandbits(32)
    dut.select.value, dut.address.value = select, address
    await FallingEdge(dut.clk)
    got = tuple(int(getattr(dut, f"{block}_select").value) for block in (*ALONE, *OF_AXES))
    assert got == model.selects(select, address), f"address {address:#x}: selects {got}"
    model.step(select, address)
    alone = [word() for _ in ALONE]
    several = [[word() for _ in range(model.axes)] for _ in OF_AXES]
    for block, answer in zip(ALONE, alone, strict=True):
        getattr(dut, f"{block}_rdata").value = answer
    for block, words in zip(OF_AXES, several, strict=True):
        getattr(dut, f"{block}_rdata").value = sum(x << 32 * n for n, x in enumerate(words))
    dut.select.value = 0
    return *alone, *several


async def check(dut, model, select, address):
    """An access, then the cycle in which its answer passes."""
    blocks = await access(dut, model, select, address)
    dut.select.value = select
    await FallingEdge(dut.clk)
    assert int(dut.rdata.value) == model.rdata(*blocks), f"address {address:#x}"
    return int(dut.rdata.value), blocks


async def begin(dut):
    Clock(dut.clk, 10, "ns").start()
    for name in ("select", "address", *(f"{block}_rdata" for block in (*ALONE, *OF_AXES))):
        getattr(dut, name).value = 0
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)
    return RegisterBus(int(dut.AXES.value))


@cocotb.test()
async def each_block_answers_at_both_ends_of_its_range(dut):
    model = await begin(dut)
    bases = [
        *ALONE.values(),
        *(first + 0x100 * n for first in OF_AXES.values() for n in range(model.axes)),
    ]
    for block, base in enumerate(bases):
        for address in (base, base + 0xFC):
            value, answers = await check(dut, model, 1, address)
            alone, several = answers[: len(ALONE)], answers[len(ALONE) :]
            assert value == [*alone, *(word for words in several for word in words)][block]


@cocotb.test()
async def latency_is_0_from_an_access_to_select(dut):
    await begin(dut)
    dut.select.value, dut.address.value = 1, OF_AXES["axis"]
    await Timer(1, "ns")  # much less than a cycle
    assert int(dut.axis_select.value) == 1
    dut.address.value = ALONE["node"]
    await Timer(1, "ns")
    assert int(dut.axis_select.value) == 0 and int(dut.node_select.value) == 1


@cocotb.test()
async def latency_is_1_from_an_access_to_its_answer(dut):
    await begin(dut)
    dut.node_rdata.value, dut.bus_rdata.value = 11, 22
    dut.select.value, dut.address.value = 1, ALONE["node"]
    await FallingEdge(dut.clk)
    assert int(dut.rdata.value) == 11
    dut.address.value = ALONE["bus"]
    await Timer(1, "ns")
    assert int(dut.rdata.value) == 11
    await FallingEdge(dut.clk)
    assert int(dut.rdata.value) == 22


@cocotb.test()
async def no_block_answers_at_other_addresses(dut):
    model = await begin(dut)
    for address in (
        0x300,
        0x3FC,
        *(first + 0x100 * model.axes for first in OF_AXES.values()),
        0xFFFC,
    ):
        assert (await check(dut, model, 1, address))[0] == 0
    assert (await check(dut, model, 0, 0))[0] == 0


@cocotb.test()
async def any_access_matches_the_model(dut):
    model = await begin(dut)
    for _ in range(500):
        await check(
            dut,
            model,
            random.getrandbits(1),
            random.choice([random.getrandbits(13), random.getrandbits(16)]) & ~3,
        )


@pytest.mark.parametrize("axes", [1, 3])
def test_register_bus(axes):
    run("register_bus", __file__, AXES=axes)
