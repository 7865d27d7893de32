# SPDX-License-Identifier: Apache-2.0
"""drive_interlock: every cause, how a fault may and may not go, the limit switches, and random
inputs against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge

from tb.bench import run, start
from tb.interlock.drive_interlock import (
    BUS_WATCHDOG,
    CPU,
    DRIVE,
    ENCODER,
    ESTOP,
    FOLLOWING_ERROR,
    INPUTS,
    LIMIT_HIGH,
    LIMIT_LOW,
    PROFILE_UNDERRUN,
    STEP_OVERRUN,
    DriveInterlock,
)

CAUSES = dict(
    limit_low=LIMIT_LOW,
    limit_high=LIMIT_HIGH,
    estop=ESTOP,
    encoder_fault=ENCODER,
    watchdog_expired=BUS_WATCHDOG,
    drive_fault=DRIVE,
    cpu_trap=CPU,
    profile_underrun=PROFILE_UNDERRUN,
    step_overrun=STEP_OVERRUN,
)
ALWAYS = ("estop", "drive_fault", "cpu_trap")
SIGNED = ("command_out", "fault_position")
HIGH, LOW = (1 << 15) - 1, -1 << 15


class Guard:
    """The design with the model beside it in every cycle; `out` is what is on the pins."""

    def __init__(self, dut):
        self.dut, self.model, self.inputs = dut, DriveInterlock(), dict(INPUTS)

    async def reset(self):
        await start(self.dut, **INPUTS)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, **inputs):
        """One clk; strobes last for it, levels stay."""
        self.inputs.update(inputs)
        for name, level in self.inputs.items():
            getattr(self.dut, name).value = level
        self.dut.rst.value = rst
        await RisingEdge(self.dut.clk)
        await ReadOnly()
        want = self.model.clk(rst, **self.inputs)
        self.out = {
            name: port.value.to_signed() if name in SIGNED else int(port.value)
            for name, port in ((name, getattr(self.dut, name)) for name in want)
        }
        assert self.out == want, f"{self.inputs}: the pins are {self.out}, the model has {want}"
        await FallingEdge(self.dut.clk)
        self.inputs.update(reset_faults=0, error_valid=0, valid_in=0, profile_underrun=0)
        return self.out

    async def enable(self):
        """Clear what is latched and switch the drive on."""
        await self.clk(enable_request=0)
        await self.clk(reset_faults=1)
        assert (await self.clk(enable_request=1))["enabled"] == 1

    async def command(self, command):
        return (await self.clk(valid_in=1, command_in=command))["command_out"]


@cocotb.test()
async def the_drive_is_off_one_clk_after_any_cause(dut):
    guard = await Guard(dut).reset()
    for name, bit in CAUSES.items():
        await guard.enable()
        assert await guard.command(1234) == 1234
        position = random.randrange(-1 << 47, 1 << 47)
        out = await guard.clk(**{name: 1}, position=position)
        assert (out["enabled"], out["faults"], out["first_fault"], out["fault_position"]) == (
            0,
            bit,
            bit,
            position,
        )
        assert (out["command_out"], out["valid_out"], out["block_up"], out["block_down"]) == (
            0,
            1,
            1,
            1,
        )
        out = await guard.clk(**{name: 0}, position=0)
        assert (out["enabled"], out["faults"], out["fault_position"]) == (
            0,
            bit,
            position,
        )  # latched


@cocotb.test()
async def a_fault_goes_only_by_reset_with_the_request_gone_and_the_cause_gone(dut):
    guard = await Guard(dut).reset()
    for name, bit in CAUSES.items():
        await guard.enable()
        await guard.clk(**{name: 1})
        strobe = name == "profile_underrun"  # gone by itself
        assert (await guard.clk(reset_faults=1))["faults"] == bit  # requested, cause stands
        assert (await guard.clk(enable_request=0))["faults"] == bit
        if not strobe:
            assert (await guard.clk(reset_faults=1))["faults"] == bit  # cause stands
        assert (await guard.clk(enable_request=1, **{name: 0}))["faults"] == bit
        assert (await guard.clk(reset_faults=1))["faults"] == bit  # requested
        assert (await guard.clk(enable_request=0))["faults"] == bit
        out = await guard.clk(reset_faults=1)
        assert (out["faults"], out["first_fault"], out["enabled"]) == (0, 0, 0)
        assert (await guard.clk())["enabled"] == 0  # nothing restarts by itself
        assert (await guard.clk(enable_request=1))["enabled"] == 1


@cocotb.test()
async def with_the_drive_not_asked_for_only_estop_drive_and_cpu_latch(dut):
    guard = await Guard(dut).reset()
    for name, bit in CAUSES.items():
        out = await guard.clk(**{name: 1})
        assert out["faults"] == (bit if name in ALWAYS else 0)
        assert out["causes_now"] == bit
        await guard.clk(**{name: 0})
        await guard.clk(reset_faults=1)


@cocotb.test()
async def a_standing_cause_never_lets_the_drive_on(dut):
    guard = await Guard(dut).reset()
    for name, bit in CAUSES.items():
        await guard.clk(enable_request=0, **{name: 1})
        for _ in range(3):
            out = await guard.clk(enable_request=1, **{name: 1})
            assert (out["enabled"], out["faults"]) == (0, bit)
        await guard.clk(enable_request=0, **{name: 0})
        await guard.clk(reset_faults=1)


@cocotb.test()
async def the_first_fault_is_kept_and_of_several_at_once_the_lowest(dut):
    guard = await Guard(dut).reset()
    await guard.enable()
    out = await guard.clk(drive_fault=1, encoder_fault=1, position=77)
    assert (out["faults"], out["first_fault"]) == (ENCODER | DRIVE, ENCODER)
    out = await guard.clk(limit_low=1, position=88)
    assert (out["faults"], out["first_fault"], out["fault_position"]) == (
        ENCODER | DRIVE | LIMIT_LOW,
        ENCODER,
        77,
    )
    await guard.clk(enable_request=0, encoder_fault=0)
    out = await guard.clk(reset_faults=1)  # the others stand
    assert (out["faults"], out["first_fault"]) == (DRIVE | LIMIT_LOW, ENCODER)
    await guard.clk(limit_low=0, drive_fault=0)
    out = await guard.clk(reset_faults=1, estop=1, position=-5)  # a new one in the clk of the reset
    assert (out["faults"], out["first_fault"], out["fault_position"]) == (ESTOP, ESTOP, -5)


@cocotb.test()
async def no_command_into_a_pressed_switch_passes(dut):
    guard = await Guard(dut).reset()
    await guard.clk(homing=1)
    for switch, into, away in (
        ("limit_high", HIGH, LOW),
        ("limit_high", 1, -1),
        ("limit_low", LOW, HIGH),
        ("limit_low", -1, 1),
    ):
        await guard.enable()
        for command in (into, away, 0):
            assert await guard.command(command) == command
        assert await guard.command(into) == into
        out = await guard.clk(**{switch: 1})  # pressed on the way: zero in one clk, and told
        assert (out["command_out"], out["valid_out"], out["enabled"], out["faults"]) == (0, 1, 1, 0)
        assert (out["block_up"], out["block_down"]) == (
            (1, 0) if switch == "limit_high" else (0, 1)
        )
        assert (await guard.clk())["valid_out"] == 0
        assert await guard.command(into) == 0
        assert await guard.command(away) == away
        out = await guard.clk(**{switch: 0})
        assert out["command_out"] == away
        await guard.command(into)
        await guard.clk(**{switch: 1})
        assert (await guard.clk(**{switch: 0}))["command_out"] == 0  # zero until the next command


@cocotb.test()
async def a_limit_switch_is_a_fault_unless_homing(dut):
    guard = await Guard(dut).reset()
    for switch, bit in (("limit_low", LIMIT_LOW), ("limit_high", LIMIT_HIGH)):
        await guard.enable()
        out = await guard.clk(homing=1, **{switch: 1})
        assert (out["enabled"], out["faults"], out["causes_now"]) == (1, 0, 0)
        out = await guard.clk(homing=0)  # still on the switch
        assert (out["enabled"], out["faults"], out["causes_now"]) == (0, bit, bit)
        await guard.clk(enable_request=0)
        assert (await guard.clk(reset_faults=1))["faults"] == bit
        await guard.clk(homing=1)  # the way off a switch
        assert (await guard.clk(reset_faults=1))["faults"] == 0
        assert (await guard.clk(enable_request=1))["enabled"] == 1
        await guard.clk(homing=0, **{switch: 0})


async def measure(guard, error, times=2):
    for _ in range(times):
        await guard.clk(error_valid=1, error=error)
        await guard.clk()
    return guard.out["faults"]


@cocotb.test()
async def the_following_error_is_checked_against_its_limit(dut):
    guard = await Guard(dut).reset()
    top, bottom = (1 << 31) - 1, -1 << 31
    for limit, good, bad in (
        (1, 1, 2),
        (100, -100, 101),
        (100, 100, -101),
        (top, top, bottom),
        (top - 1, 1 - top, top),
    ):
        await guard.enable()
        await guard.clk(closed_loop=1, following_limit=limit)
        assert await measure(guard, good, 5) == 0
        assert await measure(guard, bad, 1) == FOLLOWING_ERROR
    for setting in (
        dict(following_limit=0),
        dict(following_limit=1, closed_loop=0),
        dict(closed_loop=1, following_limit=1 << 31),
    ):
        await guard.enable()
        await guard.clk(**setting)
        assert await measure(guard, bottom, 5) == 0  # off; open loop; as large as it gets


@cocotb.test()
async def an_error_measured_before_the_drive_was_on_does_not_count(dut):
    guard = await Guard(dut).reset()
    await guard.clk(closed_loop=1, following_limit=10)
    await measure(guard, 5000, 3)
    await guard.enable()
    assert await measure(guard, 5000, 1) == 0  # may have been taken before
    assert await measure(guard, 5000, 1) == FOLLOWING_ERROR
    assert (await guard.clk())[
        "causes_now"
    ] == 0  # the drive is off: nothing stands in the way of a reset


@cocotb.test()
async def the_following_error_turns_the_drive_off_2_clk_after_it(dut):
    guard = await Guard(dut).reset()
    await guard.enable()
    await guard.clk(closed_loop=1, following_limit=10)
    await measure(guard, 0)
    assert (await guard.clk(error_valid=1, error=11))["enabled"] == 1
    out = await guard.clk()
    assert (out["enabled"], out["first_fault"]) == (0, FOLLOWING_ERROR)


@cocotb.test()
async def without_the_drive_no_command_passes(dut):
    guard = await Guard(dut).reset()
    for command in (HIGH, 1, 0, -1, LOW):
        out = await guard.clk(valid_in=1, command_in=command)
        assert (out["command_out"], out["valid_out"]) == (0, 1)
    await guard.enable()
    for command in (HIGH, 1, 0, -1, LOW):
        assert await guard.command(command) == command
    out = await guard.clk(enable_request=0)
    assert (out["command_out"], out["valid_out"], out["enabled"]) == (0, 1, 0)


@cocotb.test()
async def reset_in_mid_flow(dut):
    guard = await Guard(dut).reset()
    await guard.enable()
    await guard.command(999)
    await guard.clk(estop=1, position=5)
    out = await guard.clk(rst=1, estop=0, enable_request=0)
    assert not any(
        out[name]
        for name in (
            "enabled",
            "faults",
            "first_fault",
            "fault_position",
            "command_out",
            "valid_out",
        )
    )
    await guard.enable()
    out = await guard.clk(rst=1)
    assert out["enabled"] == 0
    assert (await guard.clk())["enabled"] == 1  # the request still stands and no fault was latched


@cocotb.test()
async def any_inputs_match_the_model(dut):
    guard = await Guard(dut).reset()
    rare = lambda one_in: int(random.randrange(one_in) == 0)
    for _ in range(12_000):
        inputs = dict(
            reset_faults=rare(8),
            valid_in=rare(3),
            command_in=random.choice((HIGH, LOW, 0, random.randrange(LOW, HIGH))),
            error_valid=rare(4),
            error=random.choice((0, -3, random.randrange(-1 << 31, 1 << 31))),
            position=random.randrange(-1 << 47, 1 << 47),
            profile_underrun=rare(150),
        )
        for name in (*CAUSES, "enable_request", "closed_loop", "homing"):
            if name != "profile_underrun" and rare(40):
                inputs[name] = rare(5) if name in CAUSES else random.getrandbits(1)
        if rare(60):
            inputs["following_limit"] = random.choice((0, 2, random.getrandbits(32)))
        await guard.clk(rst=rare(700), **inputs)


def test_drive_interlock():
    run("drive_interlock", __file__)
