# SPDX-License-Identifier: Apache-2.0
"""half_duplex: all inputs against the model."""

import itertools

import cocotb
from cocotb.triggers import Timer

from tb.bench import run
from tb.serial.half_duplex import levels


async def outputs(dut, driver_enable, tx_level, rx_pin):
    """(tx_pin, rx_level), without a clock."""
    dut.driver_enable.value, dut.tx_level.value, dut.rx_pin.value = driver_enable, tx_level, rx_pin
    await Timer(1, "ns")
    return int(dut.tx_pin.value), int(dut.rx_level.value)


@cocotb.test()
async def latency_is_0_and_a_start_bit_passes_in_its_own_cycle(dut):
    assert await outputs(dut, driver_enable=1, tx_level=0, rx_pin=0) == (0, 1)
    assert await outputs(dut, driver_enable=0, tx_level=0, rx_pin=0) == (1, 0)


@cocotb.test()
async def all_inputs_match_the_model(dut):
    for inputs in itertools.product((0, 1), repeat=3):
        assert await outputs(dut, *inputs) == levels(*inputs)


def test_half_duplex():
    run("half_duplex", __file__)
