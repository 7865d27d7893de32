# SPDX-License-Identifier: Apache-2.0
"""pid_servo: each term by hand, anti-windup, the dead band, blocked directions, bumpless transfer
when loop, drive or gains change, filters, both ends of the ranges, and random ticks against the
model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import needs, run, start
from tb.control.pid_servo import PidServo

INPUTS = (
    "closed_loop kp ki kd kv ka output_limit integral_limit dead_band "
    "target target_velocity target_acceleration moving "
    "position velocity open_command block_up block_down filters_in_use"
).split()
ONE = 1 << 16  # of kp, kd, kv
HALF = 1 << 23  # of ki
MOST, LIMIT = (1 << 24) - 1, (1 << 15) - 1
UNITY = 1 << 30  # of a filter's coefficients
STROBES = dict(gains_changed=0, coefficient_write=0, coefficient_address=0, coefficient=0)


class Servo:
    """The design with the model beside it in every cycle; `set` holds the inputs."""

    def __init__(self, dut):
        self.dut, self.inputs = dut, dict.fromkeys(INPUTS, 0)
        self.terms, self.biquads = dut.TERMS.value.to_signed(), dut.BIQUADS.value.to_signed()
        self.model = PidServo(self.terms, self.biquads)

    async def reset(self, **inputs):
        await start(self.dut, tick=0, **STROBES, **self.inputs)
        await FallingEdge(self.dut.clk)
        self.model.reset()
        self.set(**dict(closed_loop=1, output_limit=LIMIT, integral_limit=LIMIT) | inputs)
        return self

    def set(self, **inputs):
        self.inputs.update(inputs)
        for name, level in inputs.items():
            getattr(self.dut, name).value = level

    async def clk(self, **strobes):
        strobes = dict(STROBES, tick=0, rst=0) | strobes
        for name, level in strobes.items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        want = self.model.clk(**strobes, **self.inputs)
        dut = self.dut
        got = (
            int(dut.valid.value),
            dut.command.value.to_signed(),
            dut.error.value.to_signed(),
            int(dut.saturated.value),
        )
        assert got == want, f"valid, command, error, saturated are {got}, the model has {want}"
        return got

    async def tick(self, **inputs):
        """A whole tick with these inputs; returns command and saturated."""
        out = await self.begin(**inputs)
        while not out[0]:
            out = await self.clk()
        return out[1], out[3]

    async def begin(self, **inputs):
        """Wait until a tick may come, and give it."""
        self.set(**inputs)
        while self.biquads and not self.model.ready:
            await self.clk()
        return await self.clk(tick=1)

    async def commands(self, count, **inputs):
        self.set(**inputs)
        return [(await self.tick())[0] for _ in range(count)]

    async def gains(self, **gains):
        """Write the gains as the bus does, one per cycle."""
        for name, value in gains.items():
            self.set(**{name: value})
            await self.clk(gains_changed=1)

    async def filter(self, section, *coefficients):
        for number, value in enumerate(coefficients):
            await self.clk(
                coefficient_write=1, coefficient_address=8 * section + number, coefficient=value
            )


@cocotb.test()
async def each_term_gives_the_command_worked_out_by_hand(dut):
    servo = await Servo(dut).reset()
    needs(servo.terms == 5, "built with fewer terms")
    none = dict(
        kp=0,
        kd=0,
        kv=0,
        ka=0,
        target=0,
        position=0,
        target_velocity=0,
        velocity=0,
        target_acceleration=0,
    )
    assert await servo.tick(
        **none,
    ) == (0, 0)
    assert await servo.tick(**none | dict(kp=ONE, target=70, position=-30)) == (100, 0)
    assert await servo.tick(**none | dict(kp=ONE // 2, target=-3)) == (-2, 0)  # rounded down
    assert await servo.tick(**none | dict(kd=ONE, target_velocity=50, velocity=80)) == (-30, 0)
    assert await servo.tick(**none | dict(kv=2 * ONE, target_velocity=50, velocity=80)) == (100, 0)
    assert await servo.tick(**none | dict(ka=256, target_acceleration=-7)) == (-7, 0)
    assert await servo.tick(
        kp=ONE,
        kd=ONE,
        kv=ONE,
        ka=256,
        target=1,
        position=0,
        target_velocity=20,
        velocity=10,
        target_acceleration=300,
    ) == (331, 0)


@cocotb.test()
async def the_integral_grows_by_ki_each_tick(dut):
    servo = await Servo(dut).reset(ki=1 << 22, target=6)  # 6/4 of a count per tick
    assert [(await servo.tick())[0] for _ in range(6)] == [
        0,
        1,
        3,
        4,
        6,
        7,
    ]  # the first tick is bumpless
    assert [(await servo.tick(target=-6))[0] for _ in range(6)] == [6, 4, 3, 1, 0, -2]


@cocotb.test()
async def latency_is_11_plus_terms_times_25_plus_biquads_times_36(dut):
    servo = await Servo(dut).reset()
    latency = 1
    out = await servo.clk(tick=1)
    while not out[0]:
        out = await servo.clk()
        latency += 1
    assert latency == 11 + 25 * servo.terms + 36 * servo.biquads == servo.model.latency + 1
    assert (servo.terms, servo.biquads, latency) in ((5, 2, 208), (5, 0, 136), (2, 0, 61))


@cocotb.test()
async def a_tick_is_taken_every_10_plus_terms_times_25_plus_biquads_times_177_cycles(dut):
    servo = await Servo(dut).reset()
    period = 10 + 25 * servo.terms + 177 * servo.biquads + (servo.biquads == 0)
    assert (servo.terms, servo.biquads, period) in ((5, 2, 489), (5, 0, 136), (2, 0, 61))
    for gap in (period, period - 1):  # one cycle sooner, every second tick is ignored
        ticks = 0
        for n in range(4 * gap):
            ticks += (await servo.clk(tick=n % gap == 0))[0]
        assert ticks == (4 if gap == period else 2)
        for _ in range(period):
            await servo.clk()


@cocotb.test()
async def the_inputs_are_taken_8_cycles_after_tick(dut):
    servo = await Servo(dut).reset(kp=ONE)
    for change, want in ((8, 500), (9, 0)):
        out, n = await servo.begin(), 0
        while not out[0]:
            n += 1
            if n == change:
                servo.set(target=500)
            out = await servo.clk()
        assert out[1] == want
        servo.set(target=0)


@cocotb.test()
async def a_tick_within_the_calculation_is_ignored(dut):
    servo = await Servo(dut).reset(kp=ONE, target=9)
    out, n = await servo.begin(), 1
    while not out[0]:
        out = await servo.clk(tick=1)
        n += 1
    assert n == servo.model.latency + 1 and out[1] == 9


@cocotb.test()
async def the_command_is_limited_at_both_ends(dut):
    servo = await Servo(dut).reset(kp=ONE)
    for limit in (LIMIT, 1000, 1, 0):
        assert await servo.tick(output_limit=limit, target=limit) == (limit, 0)
        assert await servo.tick(target=limit + 1) == (limit, 1)
        assert await servo.tick(target=-limit) == (-limit, 0)
        assert await servo.tick(target=-limit - 1) == (-limit, 1)


@cocotb.test()
async def the_ends_of_every_range_match_the_model(dut):
    servo = await Servo(dut).reset()
    low32, high32, low48, high48 = -1 << 31, (1 << 31) - 1, -1 << 47, (1 << 47) - 1
    for target, position, error in (
        (high48, low48, high32),
        (low48, high48, low32),
        (high32, 0, high32),
        (low32, 0, low32),
        (1 << 31, 0, high32),
        (low32 - 1, 0, low32),
    ):
        for rate in (low32, high32):
            for gains in (0, 1, MOST):
                command, saturated = await servo.tick(
                    kp=gains,
                    ki=gains,
                    kd=gains,
                    kv=gains,
                    ka=gains,
                    target=target,
                    position=position,
                    target_velocity=rate,
                    velocity=-1 - rate,
                    target_acceleration=rate,
                    dead_band=random.getrandbits(16),
                )
                assert dut.error.value.to_signed() == error
                if gains == MOST and servo.terms == 5:
                    assert (command, saturated) == (
                        LIMIT if rate > 0 else -LIMIT,
                        1,
                    )  # ka outweighs all others


@cocotb.test()
async def the_integral_stops_at_its_limit(dut):
    servo = await Servo(dut).reset(ki=MOST, integral_limit=100)
    for sign in (1, -1):
        for _ in range(5):
            command = (await servo.tick(target=sign * 1000))[0]
        assert command == sign * 100
    assert (await servo.tick(target=0, integral_limit=40))[0] == -40
    assert (await servo.tick(integral_limit=0))[0] == 0


@cocotb.test()
async def the_integral_does_not_wind_up_while_the_command_is_at_its_limit(dut):
    servo = await Servo(dut).reset(kp=ONE, ki=HALF, output_limit=1000)
    for sign in (1, -1):
        assert await servo.commands(1, target=0) == [0]
        out = [await servo.tick(target=sign * 900) for _ in range(20)]
        assert out == [(sign * 1000, 1)] * 20  # 900 + 450; the first tick is not limited yet
        assert await servo.tick(target=sign * -100) == (sign * 300, 0)  # -100 + 450 - 50
        assert await servo.tick(target=sign * 100) == (sign * 550, 0)
        await servo.tick(closed_loop=0)
        servo.set(closed_loop=1)


@cocotb.test()
async def the_integral_stays_constant_in_the_dead_band_only_at_standstill(dut):
    servo = await Servo(dut).reset(ki=HALF, dead_band=10)
    for sign in (1, -1):
        assert [(await servo.tick(target=sign * 10))[0] for _ in range(3)] == [0, 0, 0]
        assert (await servo.tick(target=sign * 12))[0] == sign * 6
        assert (await servo.tick(target=sign * 10))[0] == sign * 6
        assert (await servo.tick(moving=1))[0] == sign * 11
        await servo.tick(moving=0, closed_loop=0)
        servo.set(closed_loop=1)


@cocotb.test()
async def the_integral_does_not_grow_into_a_blocked_direction(dut):
    servo = await Servo(dut).reset(ki=HALF)
    for sign, block in ((1, "block_up"), (-1, "block_down")):
        servo.set(**{block: 1})
        assert [(await servo.tick(target=sign * 10))[0] for _ in range(3)] == [0, 0, 0]
        assert (await servo.tick(target=sign * -10))[0] == sign * -5
        await servo.tick(closed_loop=0)
        servo.set(closed_loop=1, **{block: 0})


OFF = (
    (dict(closed_loop=0), dict(closed_loop=1)),
    (dict(block_up=1, block_down=1), dict(block_up=0, block_down=0)),
)


@cocotb.test()
async def the_integral_is_zero_in_open_loop_and_while_the_drive_is_off(dut):
    servo = await Servo(dut).reset(ki=HALF, target=100)
    for off, on in OFF:
        assert await servo.commands(3) == [0, 50, 100]  # it is held for the first tick
        servo.set(**off)
        await servo.clk()  # one cycle is enough
        servo.set(**on)
        assert await servo.commands(2, open_command=0) == (
            [100, 150] if "closed_loop" in off else [0, 50]
        )
        assert await servo.commands(2, **off) == [0, 0]
        servo.set(**on)


@cocotb.test()
async def the_command_is_held_if_its_inputs_were_taken_without_power(dut):
    """The firmware holds the target here and closes the loop; a tick that still saw the old target
    must not kick the motor.
    """
    servo = await Servo(dut).reset(kp=ONE, target=1 << 20, position=0)
    for off, on in OFF:
        for wait in (0, 9, 10, 40, servo.model.limit - 1):
            await servo.commands(1, target=5, **off)
            await servo.begin(target=1 << 20)
            for _ in range(wait):
                await servo.clk()
            servo.set(target=5, **on)
            out = await servo.clk()
            while not out[0]:
                out = await servo.clk()
            assert out[1] == (5 if wait == 0 else 0), f"power {wait} cycles after the tick"
            assert await servo.tick() == (5, 0)


@cocotb.test()
async def closing_the_loop_continues_from_the_open_command(dut):
    servo = await Servo(dut).reset(kp=ONE, ki=1 << 22, closed_loop=0, open_command=3000, target=400)
    assert await servo.commands(2) == [3000, 3000]
    assert await servo.commands(3, closed_loop=1) == [3000, 3100, 3200]  # 400 / 4 per tick
    assert (await servo.tick(target=410))[0] == 3200 + 10 + 102


@cocotb.test()
async def opening_the_loop_is_continuous_if_open_command_equals_the_command(dut):
    servo = await Servo(dut).reset(kp=ONE, target=700)
    assert await servo.commands(2) == [700, 700]
    assert await servo.commands(2, closed_loop=0, open_command=700) == [700, 700]
    assert await servo.commands(1, open_command=-20) == [-20]


@cocotb.test()
async def the_drive_comes_on_at_zero_however_large_the_error_is(dut):
    servo = await Servo(dut).reset(kp=ONE, ki=1 << 20, target=6400, block_up=1, block_down=1)
    assert await servo.commands(2) == [0, 0]
    assert await servo.commands(3, block_up=0, block_down=0) == [0, 400, 800]


@cocotb.test()
async def a_change_of_gains_makes_no_jump_in_the_command(dut):
    servo = await Servo(dut).reset(kp=ONE, ki=1 << 20, target=640)
    await servo.commands(4)
    before = (await servo.tick())[0]
    await servo.gains(kp=3 * ONE, kv=ONE * (servo.terms == 5))
    assert await servo.commands(3, target_velocity=5) == [before, before + 40, before + 80]
    await servo.gains(kp=0)
    assert await servo.commands(2) == [before + 80, before + 120]
    await servo.gains(kp=100 * ONE)  # more than the integral may absorb
    assert await servo.commands(2, integral_limit=1000) == [before + 120, LIMIT]


@cocotb.test()
async def a_change_of_gains_within_a_calculation_makes_no_jump(dut):
    servo = await Servo(dut).reset(ki=1 << 20, target=640)
    await servo.commands(5)
    for wait in range(0, servo.model.latency, 19):
        before = (await servo.tick())[0]
        await servo.begin()
        for _ in range(wait):
            dut.tick.value = 0
            await RisingEdge(dut.clk)
            await FallingEdge(dut.clk)  # the model does not take gains that change now
        dut.kp.value, dut.gains_changed.value = ONE * (wait % 2), 1
        out = []
        while len(out) < 2:
            await RisingEdge(dut.clk)
            await FallingEdge(dut.clk)
            dut.gains_changed.value, dut.tick.value = (
                0,
                int(bool(dut.valid.value) and servo.biquads == 0),
            )
            if dut.valid.value:
                out.append(dut.command.value.to_signed())
            elif servo.biquads and len(out) == 1:
                dut.tick.value = int(dut.g_filters.u_filters.ready.value)
        assert all(abs(command - before) <= 80 for command in out), (
            f"{out} after {before}, changed {wait} cycles after tick"
        )
        dut.tick.value = 0
        servo.set(kp=0)
        await servo.clk(rst=1)
        await servo.commands(5)


@cocotb.test()
async def with_ki_0_the_command_follows_the_gains_at_once(dut):
    servo = await Servo(dut).reset(kp=ONE, target=100)
    assert await servo.commands(2) == [100, 100]
    await servo.gains(kp=2 * ONE)
    assert await servo.commands(1) == [200]


@cocotb.test()
async def a_filter_acts_on_the_command_and_its_limits_hold(dut):
    servo = await Servo(dut).reset(kp=ONE, target=1000)
    needs(servo.biquads, "built without filters")
    await servo.filter(0, UNITY // 2, 0, 0, UNITY // 2, 0)  # y covers half the distance each tick
    assert await servo.commands(3, filters_in_use=1) == [1000, 1000, 1000]
    assert await servo.commands(4, target=2000) == [1500, 1750, 1875, 1937]
    assert await servo.commands(2, target=-1 << 20, output_limit=3000) == [
        -532,
        -1766,
    ]  # from 1937.5 half the distance to -3000, and again
    servo.set(filters_in_use=0)
    assert await servo.tick(target=100) == (100, 0)
    await servo.filter(0, UNITY, UNITY - 1, 0, 0, 0)  # up to twice the command
    await servo.commands(3, filters_in_use=1)
    assert await servo.tick(target=2000, output_limit=2050) == (2050, 1)


@cocotb.test()
async def the_drive_comes_on_without_a_jump_through_a_filter(dut):
    servo = await Servo(dut).reset(kp=ONE, ki=1 << 20, target=6400, filters_in_use=0)
    needs(servo.biquads, "built without filters")
    await servo.filter(0, UNITY // 2, 0, 0, UNITY // 2, 0)
    await servo.commands(3, filters_in_use=1)
    assert await servo.commands(2, closed_loop=0, open_command=500) == [500, 500]
    assert await servo.commands(4, closed_loop=1) == [
        500,
        700,
        1000,
        1350,
    ]  # half the distance to 900, 1300, 1700


@cocotb.test()
async def open_loop_passes_open_command_and_measures_the_error(dut):
    servo = await Servo(dut).reset(kp=ONE, target=44)
    for command in (-1 << 15, -1, 0, 1, (1 << 15) - 1):
        assert await servo.tick(closed_loop=0, open_command=command, output_limit=3) == (command, 0)
        assert dut.error.value.to_signed() == 44


@cocotb.test()
async def reset_clears_command_and_integral(dut):
    servo = await Servo(dut).reset(kp=ONE, ki=HALF, target=100)
    for wait in (0, 1, 8, 9, 33, 34, 35, servo.model.limit, servo.model.latency - 1):
        await servo.tick()
        await servo.begin()
        for _ in range(wait):
            await servo.clk()
        assert await servo.clk(rst=1) == (0, 0, 0, 0)
        for _ in range(3):
            assert (await servo.clk())[0] == 0
        assert await servo.commands(2) == [
            0,
            50,
        ]  # from zero, and the integral absorbs the proportional term


@cocotb.test()
async def any_tick_matches_the_model(dut):
    servo = await Servo(dut).reset()
    word = lambda bits: random.randrange(-1 << bits - 1, 1 << bits - 1) >> random.randrange(bits)
    gain = lambda bits: random.getrandbits(bits) >> random.randrange(bits)
    for n in range(40):
        if n % 8 == 0:
            await servo.clk(gains_changed=random.getrandbits(1))
            for section in range(servo.biquads):
                servo.set(filters_in_use=0)
                await servo.filter(section, *(random.randrange(-UNITY, UNITY) for _ in range(5)))
                servo.set(filters_in_use=random.getrandbits(servo.biquads))
            servo.set(
                kp=gain(24),
                ki=gain(24),
                kd=gain(24),
                kv=gain(24),
                ka=gain(24),
                output_limit=gain(15),
                integral_limit=gain(15),
                dead_band=gain(16),
                closed_loop=1,
                block_up=0,
                block_down=0,
            )
        servo.set(
            target=word(48),
            position=word(48) if n % 3 else servo.inputs["target"] - word(20) >> 1,
            target_velocity=word(32),
            target_acceleration=word(32),
            velocity=word(32),
            moving=random.getrandbits(1),
            open_command=word(16),
        )
        out = await servo.begin()
        while not out[0]:
            if random.randrange(60) == 0:  # the interlock and the firmware act in any cycle
                servo.set(
                    block_up=random.getrandbits(1),
                    block_down=random.getrandbits(1),
                    closed_loop=random.randrange(4) > 0,
                )
            out = await servo.clk()
        for _ in range(random.randrange(4)):
            await servo.clk()


@pytest.mark.parametrize("terms, biquads", [(5, 2), (5, 0), (2, 0)])
def test_pid_servo(terms, biquads):
    run("pid_servo", __file__, TERMS=terms, BIQUADS=biquads)
