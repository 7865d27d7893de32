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


async def check(dut, model, select, address, answering=True):
    """Advance one cycle with this address and another with the access, if `select` is set. Return
    the selects and the answer of the memory; without `answering` the memory alone answers.
    """
    await cycle(dut, model, 0, address, answering)
    return await cycle(dut, model, select, address, answering)


async def cycle(dut, model, select, address, answering=True):
    """Advance one cycle; arguments and result as for `check`."""
    word = lambda: random.getrandbits(32) if answering else 0
    memory, alone = random.getrandbits(32), [word() for _ in ALONE]
    several = [[word() for _ in range(model.axes)] for _ in OF_AXES]
    dut.select.value, dut.address.value, dut.memory_rdata.value = select, address, memory
    for block, answer in zip(ALONE, alone, strict=True):
        getattr(dut, f"{block}_rdata").value = answer
    for block, words in zip(OF_AXES, several, strict=True):
        getattr(dut, f"{block}_rdata").value = sum(x << 32 * n for n, x in enumerate(words))
    await Timer(1, "ns")  # much less than a cycle
    got = selects(dut)
    assert got == model.selects(select), f"address {address:#x}: selects {got}"
    await FallingEdge(dut.clk)
    model.step(select, address, memory, *alone, *several)
    assert int(dut.rdata.value) == model.rdata
    return got, memory


def selects(dut):
    """The selects as RegisterBus.selects returns them."""
    return tuple(int(getattr(dut, f"{block}_select").value) for block in (*ALONE, *OF_AXES))


async def begin(dut):
    Clock(dut.clk, 10, "ns", impl="gpi").start()
    for name in ("select", "address", *(f"{b}_rdata" for b in ("memory", *ALONE, *OF_AXES))):
        getattr(dut, name).value = 0
    dut.select.value = 1
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)
    dut.select.value = 0
    await FallingEdge(dut.clk)
    return RegisterBus(int(dut.AXES.value))


@cocotb.test()
async def each_block_is_selected_at_both_ends_of_its_range(dut):
    model = await begin(dut)
    bases = [
        *ALONE.values(),
        *(first + 0x100 * n for first in OF_AXES.values() for n in range(model.axes)),
    ]
    for block, base in enumerate(bases):
        for address in (base, base + 0xFC):
            got, _ = await check(dut, model, 1, address)
            alone, several = got[: len(ALONE)], got[len(ALONE) :]
            chosen = [*alone, *(mask >> n & 1 for mask in several for n in range(model.axes))]
            assert chosen == [n == block for n in range(len(bases))]


@cocotb.test()
async def latency_is_1_from_an_address_and_0_from_select_to_the_select_of_its_block(dut):
    await begin(dut)
    chosen = {}
    for name, base in (("node", ALONE["node"]), ("axis", OF_AXES["axis"])):
        dut.address.value = base
        await FallingEdge(dut.clk)
        dut.select.value = 1
        await Timer(1, "ns")  # much less than a cycle
        chosen[name] = selects(dut)
        dut.select.value = 0
        await Timer(1, "ns")
        assert not any(selects(dut))
        await FallingEdge(dut.clk)
    assert chosen == {"node": (1, 0, 0, 0, 0, 0, 0), "axis": (0, 0, 0, 0, 1, 0, 0)}


@cocotb.test()
async def latency_is_1_from_the_answers_to_rdata(dut):
    await begin(dut)
    dut.select.value = 1
    await FallingEdge(dut.clk)
    dut.node_rdata.value, dut.memory_rdata.value = 0x11, 0x2200
    await FallingEdge(dut.clk)
    assert int(dut.rdata.value) == 0x2211
    dut.node_rdata.value, dut.select.value = 0, 0
    await Timer(1, "ns")
    assert int(dut.rdata.value) == 0x2211
    await FallingEdge(dut.clk)
    assert int(dut.rdata.value) == 0x2200
    dut.memory_rdata.value = 0
    await FallingEdge(dut.clk)
    assert int(dut.rdata.value) == 0x2200


@cocotb.test()
async def each_bit_of_each_answer_is_a_bit_of_the_word(dut):
    await begin(dut)
    dut.select.value = 1
    await FallingEdge(dut.clk)
    for block in ("memory", *ALONE, *OF_AXES):
        port = getattr(dut, f"{block}_rdata")
        for bit in range(len(port)):
            port.value = 1 << bit
            await FallingEdge(dut.clk)
            assert int(dut.rdata.value) == 1 << bit % 32, f"{block}, bit {bit}"
        port.value = 0


@cocotb.test()
async def no_block_is_selected_at_other_addresses(dut):
    model = await begin(dut)
    for address in (
        0x1C00,
        *(first + 0x100 * model.axes for first in OF_AXES.values()),
        0xFFFC,
    ):
        got, _ = await check(dut, model, 1, address)
        _, memory = await cycle(dut, model, 0, address, answering=False)
        assert not any(got) and int(dut.rdata.value) == memory
    got, _ = await check(dut, model, 0, 0)
    assert not any(got)


@cocotb.test()
async def any_access_matches_the_model(dut):
    model = await begin(dut)
    for _ in range(500):
        await check(
            dut,
            model,
            random.getrandbits(1),
            random.choice([random.getrandbits(13), random.getrandbits(16)]) & ~3,
            answering=random.getrandbits(1),
        )


@pytest.mark.parametrize("axes", [1, 3])
def test_register_bus(axes):
    run("register_bus", __file__, AXES=axes)
