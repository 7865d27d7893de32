# SPDX-License-Identifier: Apache-2.0
"""The example of an axis behind Wishbone, with the test as the master of the bus."""

import cocotb
import pytest
from cocotb.triggers import ClockCycles, FallingEdge

from moire.made.registers import MAP_CRC
from tb.bench import run, start
from tb.embed.encoder import Encoder
from tb.embed.registers_of import AxisRegisters
from tb.registers.bus_masters import BusError, WishboneMaster

COUNT = 1 << 14  # of a position, in 2^-16 period
CLK_HZ, TICK_HZ = 8_000_000, 4000


async def axis(dut):
    """The registers of the axis, ready, and its encoder."""
    master, encoder = WishboneMaster(dut), Encoder(dut)
    idle = dict.fromkeys(("encoder_z", "probe", "adc_sin", "adc_cos", "estop_open"), 0)
    await start(dut, limit_low_open=0, limit_high_open=0, drive_fault_n=1, **idle)
    await FallingEdge(dut.clk)
    registers = AxisRegisters(master)
    assert await registers.get("node", "map_crc") == MAP_CRC, "the first access waits"
    await registers.put("node", "tick_period", value=CLK_HZ // TICK_HZ)
    return registers, encoder


@cocotb.test()
async def the_processor_reads_the_position_of_the_axis(dut):
    registers, encoder = await axis(dut)
    assert await registers.get("node", "clk_hz") == CLK_HZ
    assert await registers.get("axis", "built", "drive") == 1
    assert await registers.get("axis", "built", "sine") == 0
    await registers.put("axis", "sensing", deglitch=3)
    assert await registers.get("axis", "sensing", "deglitch") == 3, "settings are read back"
    for distance in (12, -30):
        await encoder.move(distance, 8)
        await ClockCycles(dut.clk, 40)
        assert await registers.get("axis", "position") == encoder.count * COUNT
    with pytest.raises(BusError):
        await registers.master.access(0x400, 1, sel=1)


@cocotb.test()
async def the_processor_drives_the_axis_until_the_emergency_stop(dut):
    registers, _ = await axis(dut)
    await registers.put("actuator", "pwm_period", value=100)
    await registers.put("axis", "strobes", reset_faults=1, set_target_to_position=1)
    await registers.put("axis", "output_limit", value=0x7FFF)
    await registers.put("axis", "open_command", value=0x4000)
    await registers.put("axis", "control", enable=3)
    await registers.put("node", "heartbeat", kick=1)
    await ClockCycles(dut.clk, 2 * CLK_HZ // TICK_HZ)
    assert int(dut.drive_enable.value) and await registers.get("axis", "state", "enabled")
    high = 0
    for _ in range(400):
        await FallingEdge(dut.clk)
        assert int(dut.bridge_a.value), "no pulse is negative"
        high += not int(dut.bridge_b.value)
    assert 190 <= high <= 210, f"half of full scale: {high} of 400 cycles"
    dut.estop_open.value = 1
    await ClockCycles(dut.clk, 10)
    assert not int(dut.drive_enable.value) and not int(dut.bridge_a.value)
    assert await registers.get("axis", "faults", "estop") == 1
    assert await registers.get("axis", "state", "enabled") == 0


def test_axis_on_wishbone():
    run("axis_on_wishbone", __file__, CLK_HZ=CLK_HZ, TICK_HZ=TICK_HZ)
