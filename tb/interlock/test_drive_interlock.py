# SPDX-License-Identifier: Apache-2.0
"""drive_interlock: every cause, how a fault is and is not cleared, the limit switches, and random
inputs against the model.
"""

import random
from itertools import combinations

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
    LINK_WATCHDOG,
    PROFILE_UNDERRUN,
    SAMPLE_OVERRUN,
    SERVO_OVERRUN,
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
    servo_overrun=SERVO_OVERRUN,
    sample_overrun=SAMPLE_OVERRUN,
    link_expired=LINK_WATCHDOG,
)
STROBES = ("profile_underrun", "servo_overrun", "sample_overrun")  # causes that end by themselves
ALWAYS = ("estop", "drive_fault", "cpu_trap")
SIGNED = ("command_out", "fault_position")
HIGH, LOW = (1 << 15) - 1, -1 << 15


class Interlock:
    """The design with the model beside it in every cycle; `out` holds the outputs."""

    def __init__(self, dut):
        self.dut, self.model, self.inputs = dut, DriveInterlock(), dict(INPUTS)

    async def reset(self):
        await start(self.dut, **INPUTS)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, **inputs):
        """Advance one cycle; strobes last for it, levels stay."""
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
        self.inputs.update(reset_faults=0, error_valid=0, valid_in=0)
        self.inputs.update(dict.fromkeys(STROBES, 0))
        return self.out

    async def enable(self):
        """Clear what is latched and switch the drive on."""
        await self.clk(enable_request=0)
        await self.clk(reset_faults=1)
        assert (await self.clk(enable_request=1))["enabled"] == 1

    async def command(self, command):
        return (await self.clk(valid_in=1, command_in=command))["command_out"]


@cocotb.test()
async def latency_is_1_from_any_cause_to_enabled_low(dut):
    interlock = await Interlock(dut).reset()
    for name, bit in CAUSES.items():
        await interlock.enable()
        assert await interlock.command(1234) == 1234
        position = random.randrange(-1 << 47, 1 << 47)
        out = await interlock.clk(**{name: 1}, position=position)
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
        out = await interlock.clk(**{name: 0}, position=0)
        assert (out["enabled"], out["faults"], out["fault_position"]) == (
            0,
            bit,
            position,
        )  # latched


@cocotb.test()
async def a_fault_is_cleared_only_by_reset_with_neither_request_nor_cause(dut):
    interlock = await Interlock(dut).reset()
    for name, bit in CAUSES.items():
        await interlock.enable()
        await interlock.clk(**{name: 1})
        strobe = name in STROBES
        assert (await interlock.clk(reset_faults=1))[
            "faults"
        ] == bit  # requested, and the cause is present
        assert (await interlock.clk(enable_request=0))["faults"] == bit
        if not strobe:
            assert (await interlock.clk(reset_faults=1))["faults"] == bit  # the cause is present
        assert (await interlock.clk(enable_request=1, **{name: 0}))["faults"] == bit
        assert (await interlock.clk(reset_faults=1))["faults"] == bit  # the drive is requested
        assert (await interlock.clk(enable_request=0))["faults"] == bit
        out = await interlock.clk(reset_faults=1)
        assert (out["faults"], out["first_fault"], out["enabled"]) == (0, 0, 0)
        assert (await interlock.clk())["enabled"] == 0  # nothing restarts by itself
        assert (await interlock.clk(enable_request=1))["enabled"] == 1


@cocotb.test()
async def without_a_request_only_estop_drive_and_cpu_faults_latch(dut):
    interlock = await Interlock(dut).reset()
    for name, bit in CAUSES.items():
        out = await interlock.clk(**{name: 1})
        assert out["faults"] == (bit if name in ALWAYS else 0)
        assert out["causes_now"] == bit
        await interlock.clk(**{name: 0})
        await interlock.clk(reset_faults=1)


@cocotb.test()
async def the_drive_is_never_enabled_while_a_cause_is_present(dut):
    interlock = await Interlock(dut).reset()
    for name, bit in CAUSES.items():
        await interlock.clk(enable_request=0, **{name: 1})
        for _ in range(3):
            out = await interlock.clk(enable_request=1, **{name: 1})
            assert (out["enabled"], out["faults"]) == (0, bit)
        await interlock.clk(enable_request=0, **{name: 0})
        await interlock.clk(reset_faults=1)


@cocotb.test()
async def of_any_two_causes_at_once_first_fault_is_the_lower_bit(dut):
    interlock = await Interlock(dut).reset()
    for one, other in combinations(CAUSES, 2):
        await interlock.enable()
        out = await interlock.clk(**{one: 1, other: 1})
        both = CAUSES[one], CAUSES[other]
        assert (out["faults"], out["first_fault"]) == (sum(both), min(both)), (one, other)
        await interlock.clk(**{one: 0, other: 0})


@cocotb.test()
async def first_fault_stays_and_is_the_lowest_of_several_at_once(dut):
    interlock = await Interlock(dut).reset()
    await interlock.enable()
    out = await interlock.clk(drive_fault=1, encoder_fault=1, position=77)
    assert (out["faults"], out["first_fault"]) == (ENCODER | DRIVE, ENCODER)
    out = await interlock.clk(limit_low=1, position=88)
    assert (out["faults"], out["first_fault"], out["fault_position"]) == (
        ENCODER | DRIVE | LIMIT_LOW,
        ENCODER,
        77,
    )
    await interlock.clk(enable_request=0, encoder_fault=0)
    out = await interlock.clk(reset_faults=1)  # the other causes are present
    assert (out["faults"], out["first_fault"]) == (DRIVE | LIMIT_LOW, ENCODER)
    await interlock.clk(limit_low=0, drive_fault=0)
    out = await interlock.clk(
        reset_faults=1, estop=1, position=-5
    )  # a new cause in the cycle of the reset
    assert (out["faults"], out["first_fault"], out["fault_position"]) == (ESTOP, ESTOP, -5)


@cocotb.test()
async def no_command_into_a_pressed_switch_passes(dut):
    interlock = await Interlock(dut).reset()
    await interlock.clk(homing=1)
    for switch, into, away in (
        ("limit_high", HIGH, LOW),
        ("limit_high", 1, -1),
        ("limit_low", LOW, HIGH),
        ("limit_low", -1, 1),
    ):
        await interlock.enable()
        for command in (into, away, 0):
            assert await interlock.command(command) == command
        assert await interlock.command(into) == into
        out = await interlock.clk(
            **{switch: 1}
        )  # pressed in motion: zero after one cycle, and reported
        assert (out["command_out"], out["valid_out"], out["enabled"], out["faults"]) == (0, 1, 1, 0)
        assert (out["block_up"], out["block_down"]) == (
            (1, 0) if switch == "limit_high" else (0, 1)
        )
        assert (await interlock.clk())["valid_out"] == 0
        assert await interlock.command(into) == 0
        assert await interlock.command(away) == away
        out = await interlock.clk(**{switch: 0})
        assert out["command_out"] == away
        await interlock.command(into)
        await interlock.clk(**{switch: 1})
        assert (await interlock.clk(**{switch: 0}))[
            "command_out"
        ] == 0  # zero until the next command


@cocotb.test()
async def a_limit_switch_is_a_fault_unless_homing(dut):
    interlock = await Interlock(dut).reset()
    for switch, bit in (("limit_low", LIMIT_LOW), ("limit_high", LIMIT_HIGH)):
        await interlock.enable()
        out = await interlock.clk(homing=1, **{switch: 1})
        assert (out["enabled"], out["faults"], out["causes_now"]) == (1, 0, 0)
        out = await interlock.clk(homing=0)  # still on the switch
        assert (out["enabled"], out["faults"], out["causes_now"]) == (0, bit, bit)
        await interlock.clk(enable_request=0)
        assert (await interlock.clk(reset_faults=1))["faults"] == bit
        await interlock.clk(homing=1)  # the axis can move off the switch
        assert (await interlock.clk(reset_faults=1))["faults"] == 0
        assert (await interlock.clk(enable_request=1))["enabled"] == 1
        await interlock.clk(homing=0, **{switch: 0})


async def measure(interlock, too_far, times=2):
    for _ in range(times):
        await interlock.clk(error_valid=1, error_too_far=too_far)
        await interlock.clk()
    return interlock.out["faults"]


@cocotb.test()
async def a_following_error_is_a_fault_in_closed_loop(dut):
    interlock = await Interlock(dut).reset()
    await interlock.enable()
    await interlock.clk(closed_loop=1)
    assert await measure(interlock, 0, 5) == 0
    await interlock.clk(error_too_far=1)  # without error_valid
    assert await measure(interlock, 0, 1) == 0
    assert await measure(interlock, 1, 1) == FOLLOWING_ERROR
    await interlock.clk(closed_loop=0)
    await interlock.enable()
    assert await measure(interlock, 1, 5) == 0


@cocotb.test()
async def an_error_measured_before_the_drive_was_on_does_not_count(dut):
    interlock = await Interlock(dut).reset()
    await interlock.clk(closed_loop=1)
    await measure(interlock, 1, 3)
    await interlock.enable()
    assert await measure(interlock, 1, 1) == 0  # it may have been measured before
    assert await measure(interlock, 1, 1) == FOLLOWING_ERROR
    assert (await interlock.clk())["causes_now"] == 0  # the drive is off: nothing prevents a reset


@cocotb.test()
async def latency_is_2_from_a_following_error_to_enabled_low(dut):
    interlock = await Interlock(dut).reset()
    await interlock.enable()
    await interlock.clk(closed_loop=1)
    await measure(interlock, 0)
    assert (await interlock.clk(error_valid=1, error_too_far=1))["enabled"] == 1
    out = await interlock.clk()
    assert (out["enabled"], out["first_fault"]) == (0, FOLLOWING_ERROR)


@cocotb.test()
async def latency_is_1_from_command_in_to_command_out(dut):
    interlock = await Interlock(dut).reset()
    await interlock.enable()
    for command in (5, -7):
        out = await interlock.clk(valid_in=1, command_in=command)
        assert (out["command_out"], out["valid_out"]) == (command, 1)
        assert (await interlock.clk())["valid_out"] == 0


@cocotb.test()
async def with_the_drive_off_no_command_passes(dut):
    interlock = await Interlock(dut).reset()
    for command in (HIGH, 1, 0, -1, LOW):
        out = await interlock.clk(valid_in=1, command_in=command)
        assert (out["command_out"], out["valid_out"]) == (0, 1)
    await interlock.enable()
    for command in (HIGH, 1, 0, -1, LOW):
        assert await interlock.command(command) == command
    out = await interlock.clk(enable_request=0)
    assert (out["command_out"], out["valid_out"], out["enabled"]) == (0, 1, 0)


@cocotb.test()
async def reset_clears_everything_and_a_request_enables_again(dut):
    interlock = await Interlock(dut).reset()
    await interlock.enable()
    await interlock.command(999)
    await interlock.clk(estop=1, position=5)
    out = await interlock.clk(rst=1, estop=0, enable_request=0)
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
    await interlock.enable()
    out = await interlock.clk(rst=1)
    assert out["enabled"] == 0
    assert (await interlock.clk())["enabled"] == 1  # it is still requested and no fault was latched


@cocotb.test()
async def any_inputs_match_the_model(dut):
    interlock = await Interlock(dut).reset()
    rare = lambda one_in: int(random.randrange(one_in) == 0)
    for _ in range(12_000):
        inputs = dict(
            reset_faults=rare(8),
            valid_in=rare(3),
            command_in=random.choice((HIGH, LOW, 0, random.randrange(LOW, HIGH))),
            error_valid=rare(4),
            error_too_far=rare(3),
            position=random.randrange(-1 << 47, 1 << 47),
            profile_underrun=rare(150),
            servo_overrun=rare(150),
            sample_overrun=rare(150),
        )
        for name in (*CAUSES, "enable_request", "closed_loop", "homing"):
            if name not in STROBES and rare(40):
                inputs[name] = rare(5) if name in CAUSES else random.getrandbits(1)
        await interlock.clk(rst=rare(700), **inputs)


def test_drive_interlock():
    run("drive_interlock", __file__)
