# SPDX-License-Identifier: Apache-2.0
"""bridge_pwm: the duty cycle by hand and by counting, both ends of it, switching off within one
cycle, and random commands against the model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import clk_now, run, start
from tb.drive.bridge_pwm import BridgePwm

FULL = 1 << 15
IDLE = dict(period=0, enable=0, valid=0, command=0)


class Bridge:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.inputs = dut, BridgePwm(), dict(IDLE)

    async def reset(self, period):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.inputs.update(enable=1, period=period)
        return self

    async def clk(self, **inputs):
        self.inputs.update(inputs)
        once = dict(self.inputs, rst=self.inputs.pop("rst", 0))
        for name, level in once.items():
            getattr(self.dut, name).value = level
        self.inputs["valid"] = 0
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        got, want = (
            (int(self.dut.bridge_a.value), int(self.dut.bridge_b.value)),
            self.model.clk(**once),
        )
        assert got == want, f"{once}: the pins are {got}, the model has {want}"
        return got

    async def give(self, command):
        """Give a command and wait until the period in which it came has ended."""
        await self.clk(valid=1, command=command)
        for _ in range(9 + self.inputs["period"]):
            await self.clk()
        while self.model.left < self.model.period:
            await self.clk()

    async def periods(self, count):
        """What each cycle of so many periods drives: +1 a alone, -1 b alone, 0 brake."""
        out = []
        for _ in range(count * self.inputs["period"]):
            a, b = await self.clk()
            out.append(a - b)
        return out


@cocotb.test()
async def a_half_a_quarter_and_an_eighth_of_a_period_drive_as_worked_out_by_hand(dut):
    bridge = await Bridge(dut).reset(period=4)
    await bridge.give(FULL // 2)
    assert await bridge.periods(2) == [1, 1, 0, 0] * 2
    await bridge.give(-FULL // 4)
    assert await bridge.periods(2) == [-1, 0, 0, 0] * 2
    await bridge.give(FULL // 8)  # half a cycle per period: one cycle in every second period
    assert await bridge.periods(4) in (([0] * 4 + [1, 0, 0, 0]) * 2, ([1, 0, 0, 0] + [0] * 4) * 2)


@cocotb.test()
async def latency_is_4(dut):
    bridge = await Bridge(dut).reset(period=1)
    pins, latency = await bridge.clk(valid=1, command=-FULL), 1
    while not pins[1]:
        pins = await bridge.clk()
        latency += 1
    assert latency == 4


@cocotb.test()
async def a_command_in_each_cycle_is_taken_and_the_last_one_before_a_border_is_applied(dut):
    bridge = await Bridge(dut).reset(period=1)
    seen = [await bridge.clk(valid=1, command=-FULL if n % 2 else 0) for n in range(20)]
    assert seen[5:] == [(0, 1) if n % 2 == 0 else (1, 1) for n in range(5, 20)]
    await bridge.give(-FULL)
    bridge.inputs["period"] = 10
    await bridge.give(-FULL)
    await bridge.clk(valid=1, command=0)
    await bridge.clk(valid=1, command=-FULL)
    assert await bridge.periods(3) == [-1] * 30  # the zero never reached the pins


@cocotb.test()
async def over_any_number_of_periods_the_driven_time_is_right_to_one_cycle(dut):
    bridge = await Bridge(dut).reset(period=20)
    for command in (1, -1, 819, -5000, 12345, -20001, 32767, -32767):
        await bridge.give(command)
        exact, driven = 0, 0
        for n in range(1, 40):
            driven += sum(await bridge.periods(1))
            exact = command * 20 * n / FULL
            assert abs(driven - exact) < 1


async def two_pulses(dut, pin, clk_between, clk_long=1):
    """Await two low pulses on the pin that does not drive: the first is `clk_long` cycles long, and
    they are `clk_between` cycles apart. The model does not watch these cycles.
    """
    dut.valid.value = 0
    await FallingEdge(pin)
    first = clk_now()
    await RisingEdge(pin)
    assert clk_now() - first == clk_long
    await FallingEdge(pin)
    assert clk_now() - first == clk_between


@cocotb.test(timeout_time=2, timeout_unit="ms")
async def the_smallest_command_drives_one_cycle_in_32768(dut):
    bridge = await Bridge(dut).reset(period=1)
    await bridge.give(1)
    await two_pulses(dut, dut.bridge_b, FULL)


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def the_longest_period_is_65535(dut):
    bridge = await Bridge(dut).reset(period=1)
    for command, cycles in ((-1, 1), (-10923, 0x5555), (21846, 0xAAAB)):
        await bridge.give(0)
        await bridge.clk(valid=1, command=command, period=65535)
        await two_pulses(dut, dut.bridge_a if command < 0 else dut.bridge_b, 65535, cycles)
        await bridge.clk(enable=0)
        bridge.inputs.update(enable=1, period=1)


@cocotb.test()
async def full_scale_drives_always_and_zero_never(dut):
    bridge = await Bridge(dut).reset(period=1)
    for period in (1, 2, 3, 30):
        bridge.inputs["period"] = period
        await bridge.give(-FULL)
        assert set(await bridge.periods(20)) == {-1}  # all the time
        await bridge.give(0)
        assert set(await bridge.periods(20)) == {0}
        await bridge.give(FULL - 1)
        pins = await bridge.periods(20)
        assert pins.count(0) <= 1 and -1 not in pins


@cocotb.test()
async def a_period_of_0_is_off(dut):
    bridge = await Bridge(dut).reset(period=0)
    await bridge.clk(valid=1, command=-FULL)
    assert {await bridge.clk() for _ in range(50)} == {(0, 0)}


@cocotb.test()
async def a_new_command_waits_for_the_border(dut):
    bridge = await Bridge(dut).reset(period=40)
    await bridge.give(FULL // 2)
    await bridge.clk(valid=1, command=-FULL)
    assert [await bridge.clk() for _ in range(39)] == [(1, 0)] * 19 + [(1, 1)] * 20
    assert await bridge.clk() == (0, 1)


@cocotb.test()
async def latency_is_1_from_enable_low_to_both_pins_low_and_only_a_new_command_drives_again(dut):
    bridge = await Bridge(dut).reset(period=10)
    for command, pins in ((-FULL, (0, 1)), (FULL - 1, (1, 0))):
        await bridge.give(command)
        assert await bridge.clk() == pins
        assert await bridge.clk(enable=0) == (0, 0)
        assert {await bridge.clk(enable=1) for _ in range(40)} == {(0, 0)}
        await bridge.clk(enable=0, valid=1, command=command)  # a command while off is forgotten
        assert {await bridge.clk(enable=1) for _ in range(40)} == {(0, 0)}


@cocotb.test()
async def reset_in_a_period_switches_off_until_the_next_command(dut):
    bridge = await Bridge(dut).reset(period=10)
    for wait in range(12):
        await bridge.give(-FULL)
        for _ in range(wait):
            await bridge.clk(valid=int(wait == 5), command=-FULL)
        assert await bridge.clk(rst=1) == (0, 0)
        assert {await bridge.clk() for _ in range(25)} == {(0, 0)}


@cocotb.test()
async def any_commands_match_the_model(dut):
    bridge = await Bridge(dut).reset(period=10)
    for _ in range(12_000):
        inputs = {}
        if random.randrange(12) == 0:
            inputs.update(
                valid=1,
                command=random.choice((0, 1, -1, -FULL, FULL - 1, random.randrange(-FULL, FULL))),
            )
        if random.randrange(100) == 0:
            inputs["period"] = random.choice((0, 1, 2, 3, 17, 200, random.getrandbits(8)))
        if random.randrange(200) == 0:
            inputs["enable"] = int(random.randrange(3) > 0)
        if random.randrange(1000) == 0:
            inputs["rst"] = 1
        await bridge.clk(**inputs)


def test_bridge_pwm():
    run("bridge_pwm", __file__)
