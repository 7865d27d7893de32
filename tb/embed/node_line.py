# SPDX-License-Identifier: Apache-2.0
"""A whole node, asked on its RS-485 line: the simulation of its FuseSoC core, with the firmware
that embed/fusesoc.py gives it.
"""

import cocotb
from cocotb.triggers import ClockCycles, FallingEdge

from moire.bus.protocol import TO_NODE, command_byte, ready_byte
from tb.bench import start

BAUD = 115_200  # of the firmware after a reset
START_CYCLES = 20_000  # of the firmware, more than it needs
MOST_CYCLES = 20_000  # until it answers
HIGH = ("drive_fault_n", "i2c_scl", "i2c_sda", "keyboard_clock", "keyboard_data", "edm_clock")
HIGH += ("edm_data", "peer_rx", "sensor_rx", "rs485_rx", "link_rx", "link_cs_n")
LOW = ("flash_miso", "estop_open", "encoder_a", "encoder_b", "encoder_z", "probe", "adc_sin")
LOW += ("adc_cos", "limit_low_open", "limit_high_open", "edm_status")


async def answer(clk, rx, tx, address, clk_hz):
    """The first byte that a node answers with when it is commanded to take a request. clk, rx and
    tx: clock, receiver and transmitter of the node.
    """
    bit = round(clk_hz / BAUD)
    await ClockCycles(clk, START_CYCLES)
    command = command_byte(address, TO_NODE)
    for level in (0, *(command >> n & 1 for n in range(8)), 1, 1):
        rx.value = level
        await ClockCycles(clk, bit)
    waited = 0
    while int(tx.value):
        assert waited < MOST_CYCLES, "no answer"
        await ClockCycles(clk, 8)
        waited += 8
    levels = []
    await ClockCycles(clk, bit // 2)
    for _ in range(9):
        levels.append(int(tx.value))
        await ClockCycles(clk, bit)
    return sum(level << n for n, level in enumerate(levels[1:]))


@cocotb.test()
async def the_firmware_runs_and_answers_to_its_address(dut):
    await start(dut, address=5, **dict.fromkeys(HIGH, 1), **dict.fromkeys(LOW, 0))
    await FallingEdge(dut.clk)
    got = await answer(dut.clk, dut.rs485_rx, dut.rs485_tx, 5, int(dut.CLK_HZ.value))
    assert got == ready_byte(5, TO_NODE)
    assert int(dut.rs485_driver_enable.value) and not int(dut.drive_enable.value)
