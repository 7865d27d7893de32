# SPDX-License-Identifier: Apache-2.0
"""drive_select: every kind of drive with every level, and commands at both ends of the range,
against the model.
"""

import itertools

import cocotb
from cocotb.triggers import Timer

from tb.bench import run
from tb.drive.drive_select import BRIDGE, DAC, STEPPER, selected

QUIET = dict(
    kind=BRIDGE,
    enable=0,
    valid=0,
    command=0,
    fine_valid=0,
    fine_command=0,
)
LEVELS = ("enable", "valid", "fine_valid")


async def outputs(dut, **inputs):
    """All outputs, without a clock, at inputs that differ from QUIET by these."""
    inputs = QUIET | inputs
    for name, level in inputs.items():
        getattr(dut, name).value = level
    await Timer(1, "ns")
    got = {
        name: getattr(dut, name).value.to_signed()
        if name == "dac_command"
        else int(getattr(dut, name).value)
        for name in selected(**inputs)
    }
    assert got == selected(**inputs)
    return got


@cocotb.test()
async def latency_is_0_and_the_command_reaches_the_drive_in_its_own_cycle(dut):
    got = await outputs(dut, kind=DAC, valid=1, command=-5, fine_command=7)
    assert (got["dac_valid"], got["dac_command"]) == (1, -5)
    got = await outputs(dut, kind=STEPPER, valid=1, command=-5, fine_command=7)
    assert (got["dac_valid"], got["dac_command"], got["stepper_selected"]) == (0, 7, 1)


@cocotb.test()
async def the_bridge_switches_only_when_it_is_the_drive_and_is_enabled(dut):
    for kind, enable in itertools.product(range(4), (0, 1)):
        got = await outputs(dut, kind=kind, enable=enable)
        assert got["bridge_enable"] == (kind == BRIDGE and enable == 1)


@cocotb.test()
async def every_kind_and_level_matches_the_model(dut):
    for kind, *levels in itertools.product(range(4), *[(0, 1)] * len(LEVELS)):
        for command, fine in ((-32768, 32767), (32767, -32768), (0, -1)):
            named = dict(zip(LEVELS, levels, strict=True))
            await outputs(dut, kind=kind, command=command, fine_command=fine, **named)


def test_drive_select():
    run("drive_select", __file__)
