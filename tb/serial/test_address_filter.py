# SPDX-License-Identifier: Apache-2.0
"""address_filter: every word with the 9th bit at every address, the gate by hand, and random words
against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.serial.address_filter import AddressFilter


async def clk(dut, valid, data=0, ninth=0, rst=0):
    dut.valid_in.value, dut.data_in.value, dut.ninth.value, dut.rst.value = valid, data, ninth, rst
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    return int(dut.valid.value)


async def begin(dut, address):
    await start(dut, address=address, valid_in=0, data_in=0, ninth=0)
    await clk(dut, 0, rst=1)


@cocotb.test()
async def latency_is_1_and_the_gate_opens_and_closes(dut):
    await begin(dut, 5)
    assert await clk(dut, 1, 0x42) == 0  # the gate is closed
    assert await clk(dut, 1, 0x25, 1) == 1
    assert await clk(dut, 1, 0x42) == 1
    assert await clk(dut, 0, 0x42) == 0
    assert await clk(dut, 1, 0x26, 1) == 0  # a command for node 6
    assert await clk(dut, 1, 0x42) == 0
    assert await clk(dut, 1, 0x15, 1) == 1


@cocotb.test()
async def only_two_commands_and_the_broadcast_open_the_gate_of_a_node(dut):
    for address in range(16):
        await begin(dut, address)
        passed = []
        for data in range(256):
            command = await clk(dut, 1, data, 1)
            assert await clk(dut, 1, ~data & 255) == command  # so does the next word
            passed += [data] * command
        assert passed == sorted({0x10 | address, 0x20 | address, 0x20})


@cocotb.test()
async def reset_closes_the_gate(dut):
    await begin(dut, 9)
    await clk(dut, 1, 0x29, 1)
    assert await clk(dut, 1, 0x77, rst=1) == 0
    assert await clk(dut, 1, 0x77) == 0


@cocotb.test()
async def any_word_matches_the_model(dut):
    for address in (0, 7, 15):
        await begin(dut, address)
        model = AddressFilter()
        for n in range(1500):
            likely = random.choice([0x10, 0x20, 0x30, 0x00]) | random.choice(
                [address, 0, random.getrandbits(4)]
            )
            word = (
                random.getrandbits(1),
                random.choice([likely, random.getrandbits(8)]),
                int(random.random() < 0.3),
            )
            rst = int(random.random() < 0.01)
            got, want = await clk(dut, *word, rst), model.step(address, *word, rst)
            assert got == want, f"cycle {n}: valid is {got}, the model has {want}"


def test_address_filter():
    run("address_filter", __file__)
