# SPDX-License-Identifier: Apache-2.0
"""A LiteX SoC with an axis and a node: the test is its processor. Without LiteX (`make litex`) the
test is skipped.
"""

import json
import os
import subprocess
import sys

import cocotb
import pytest
from cocotb.triggers import ClockCycles, FallingEdge

from embed.litex_parts import FOLDER, NAME, is_there
from firmware.build import stem_of
from moire.bus.protocol import TO_NODE, ready_byte
from moire.made.registers import MAP_CRC
from tb.bench import ROOT, run, start
from tb.embed.encoder import Encoder
from tb.embed.node_line import answer
from tb.embed.registers_of import AxisRegisters
from tb.registers.bus_masters import WishboneMaster
from tb.simulator import BENCHES
from twin import build as twin_build

COUNT = 1 << 14  # of a position, in 2^-16 period


class Pins:
    """The pins `axis_...` of the SoC by their names at the axis."""

    def __init__(self, dut, prefix):
        self.dut, self.prefix = dut, prefix

    def __getattr__(self, name):
        return getattr(self.dut, name if name == "clk" else f"{self.prefix}_{name}")


async def soc(dut):
    """(master of the bus, map of the SoC)"""
    master = WishboneMaster(dut)
    pins = {"axis_encoder_a": 0, "axis_encoder_b": 0, "axis_estop_open": 0}
    await start(dut, node_rs485_rx=1, node_estop_open=0, wb_cti=0, wb_bte=0, **pins)
    await FallingEdge(dut.clk)
    return master, json.loads((BENCHES / f"{NAME}.json").read_text())


@cocotb.test()
async def the_axis_is_a_device_on_the_bus_and_its_drive_a_csr(dut):
    master, described = await soc(dut)
    base = described["memories"]["axis"]["base"]
    state = described["csr_registers"]["axis_state"]["addr"]
    registers = AxisRegisters(master, base)
    clk_hz = described["constants"]["config_clock_frequency"]
    assert await registers.get("node", "map_crc") == MAP_CRC
    assert await registers.get("node", "clk_hz") == clk_hz
    await registers.put("node", "tick_period", value=clk_hz // 4000)
    await registers.put("axis", "sensing", deglitch=1)
    assert await registers.get("axis", "sensing", "deglitch") == 1
    await ClockCycles(dut.clk, 40)  # the filter has forgotten the start
    encoder = Encoder(Pins(dut, "axis"))
    await encoder.move(2, 8)
    await encoder.move(-8, 8)
    await ClockCycles(dut.clk, 40)
    await FallingEdge(dut.clk)
    assert await registers.get("axis", "position") == -6 * COUNT
    assert await master.read(state) == 0
    await registers.put("axis", "strobes", reset_faults=1)
    await registers.put("axis", "control", enable=3)
    assert await master.read(state) == 1 and int(dut.axis_drive_enable.value)
    await registers.put("axis", "control", enable=0)
    assert await master.read(state) == 0


@cocotb.test()
async def the_node_starts_when_a_csr_releases_it_and_answers_on_its_line(dut):
    master, described = await soc(dut)
    control = described["csr_registers"]["node_control"]["addr"]
    clk_hz = described["constants"]["config_clock_frequency"]
    address = 5
    assert await master.read(control) & 1, "it is held after power-up"
    await master.write(control, address << 4)
    got = await answer(dut.clk, dut.node_rs485_rx, dut.node_rs485_tx, address, clk_hz)
    assert got == ready_byte(address, TO_NODE)


def with_litex(*command):
    """Run Python with LiteX; skip the test without it."""
    if not is_there():
        pytest.skip("LiteX is not set up: make litex")
    return subprocess.run(
        [sys.executable, *command],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(FOLDER), *sys.path])},
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


def test_litex_soc():
    if is_there():
        twin_build.firmware("counter", 1)
    firmware = ROOT / "build" / "firmware" / f"{stem_of('counter', 1)}.hex"
    done = with_litex("-m", "embed.litex_soc", BENCHES, firmware)
    assert done.returncode == 0, done.stderr[-2000:]
    run(NAME, __file__)


@pytest.mark.parametrize(
    "idle, why",
    [
        ({}, "the input encoder_a of axis_on_wishbone has no pad: pin"),
        ({"encoder": 0}, "axis_on_wishbone has no port encoder"),
    ],
)
def test_an_input_without_a_pad_is_named(idle, why):
    program = (
        "from litex.build.generic_platform import GenericPlatform as Platform\n"
        "from embed.litex_blocks import MoireAxis\n"
        f"MoireAxis(Platform('none', [], name='none'), 8e6, None, {idle})"
    )
    done = with_litex("-c", program)
    assert done.returncode == 1 and why in done.stderr
