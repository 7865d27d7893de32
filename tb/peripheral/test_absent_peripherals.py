# SPDX-License-Identifier: Apache-2.0
"""peripherals: a peripheral that is not built stays idle, whatever is written and whatever its pins
do; the register `built` reports it.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from moire.made.registers import BY_NAME
from tb import bench
from twin.nodes.twin import PERIPHERALS

INPUTS = (
    "i2c_scl",
    "i2c_sda",
    "keyboard_clock",
    "keyboard_data",
    "edm_clock",
    "edm_data",
    "peer_rx",
    "sensor_rx",
    "edm_status",
)
IDLE = [  # in the order of PERIPHERALS, which is that of the register `built`
    dict(i2c_scl_low=0, i2c_sda_low=0),
    dict(keyboard_clock_low=0, keyboard_data_low=0, edm_clock_low=0, edm_data_low=0),
    dict(peer_tx=1),
    {},
    dict(display_cs_n=1, display_sclk=0, display_data=0),
    {},
]
BUILT, I2C, BIT_TIME, TRANSMIT = (
    BY_NAME["peripherals", register, field].offset // 4
    for register, field in (
        ("built", "i2c"),
        ("i2c", "command"),
        ("peer_bit_time", "value"),
        ("peer_transmit", "value"),
    )
)
RECOVER = 4  # command of the I2C port


@cocotb.test()
async def absent_peripherals_are_idle(dut):
    built = sum(int(getattr(dut, name).value) << n for n, name in enumerate(PERIPHERALS))
    await bench.start(dut, select=0, write=0, word=0, wdata=0, **dict.fromkeys(INPUTS, 0))
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)
    active = set()
    # at the beginning, since the random settings and levels below may make both ports wait
    for word, value in ((I2C, RECOVER << 8), (BIT_TIME, 2 << 4), (TRANSMIT, 0)):
        dut.select.value, dut.write.value, dut.word.value, dut.wdata.value = 1, 1, word, value
        await FallingEdge(dut.clk)
    for n in range(6000):
        dut.select.value, dut.write.value, dut.word.value = 1, n % 2, random.randrange(64)
        dut.wdata.value = random.choice([0, 0xFFFFFFFF, random.getrandbits(32)])
        for name in INPUTS:
            getattr(dut, name).value = random.getrandbits(2 if name == "edm_status" else 1)
        await FallingEdge(dut.clk)
        if not built:
            assert int(dut.rdata.value) == 0
        for bit, idle in enumerate(IDLE):
            for name, level in idle.items():
                if int(getattr(dut, name).value) != level:
                    active.add(bit)
    assert active == {bit for bit, outputs in enumerate(IDLE) if built >> bit & 1 and outputs}, (
        "what was built, and only that, moves"
    )
    dut.write.value, dut.word.value = 0, BUILT
    await FallingEdge(dut.clk)
    assert int(dut.rdata.value) == built


@pytest.mark.parametrize("peripherals", [0, 1, 2, 4, 8, 16, 32, 63])
def test_absent_peripherals(peripherals):
    built = {name: peripherals >> n & 1 for n, name in enumerate(PERIPHERALS)}
    bench.run("peripherals", __file__, CLK_HZ=1_000_000, **built)
