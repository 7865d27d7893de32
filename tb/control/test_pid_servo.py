# SPDX-License-Identifier: Apache-2.0
"""pid_servo: each term by hand, wind-up, the dead band, the blocked directions, both ends, and random ticks against the model."""
import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from bench import run, start
from pid_servo import LATENCY, PidServo

INPUTS = ("closed_loop kp ki kd kv ka output_limit integral_limit dead_band target target_velocity target_acceleration moving "
          "position velocity open_command block_up block_down").split()
ONE = 1 << 16                           # of kp, kd, kv
HALF = 1 << 23                          # of ki
MOST, LIMIT = (1 << 24) - 1, (1 << 15) - 1


class Servo:
    """The design with the model beside it in every cycle; `set` holds the inputs."""

    def __init__(self, dut):
        self.dut, self.model, self.inputs = dut, PidServo(), dict.fromkeys(INPUTS, 0)

    async def reset(self, **inputs):
        await start(self.dut, tick=0, **self.inputs)
        await FallingEdge(self.dut.clk)
        self.model.reset()
        self.set(**dict(closed_loop=1, output_limit=LIMIT, integral_limit=LIMIT) | inputs)
        return self

    def set(self, **inputs):
        self.inputs.update(inputs)
        for name, level in inputs.items():
            getattr(self.dut, name).value = level

    async def clk(self, tick=0, rst=0):
        self.dut.tick.value, self.dut.rst.value = tick, rst
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        want = self.model.clk(tick=tick, rst=rst, **self.inputs)
        dut = self.dut
        got = int(dut.valid.value), dut.command.value.to_signed(), dut.error.value.to_signed(), int(dut.saturated.value)
        assert got == want, f"valid, command, error, saturated are {got}, the model has {want}"
        return got

    async def tick(self, **inputs):
        """A whole tick with these inputs; returns command and saturated."""
        self.set(**inputs)
        out = await self.clk(tick=1)
        while not out[0]:
            out = await self.clk()
        return out[1], out[3]


@cocotb.test()
async def each_term_by_hand(dut):
    servo = await Servo(dut).reset()
    none = dict(kp=0, kd=0, kv=0, ka=0, target=0, position=0, target_velocity=0, velocity=0, target_acceleration=0)
    assert await servo.tick(**none, ) == (0, 0)
    assert await servo.tick(**none | dict(kp=ONE, target=70, position=-30)) == (100, 0)
    assert await servo.tick(**none | dict(kp=ONE // 2, target=-3)) == (-2, 0)                       # rounded down
    assert await servo.tick(**none | dict(kd=ONE, target_velocity=50, velocity=80)) == (-30, 0)
    assert await servo.tick(**none | dict(kv=2 * ONE, target_velocity=50, velocity=80)) == (100, 0)
    assert await servo.tick(**none | dict(ka=256, target_acceleration=-7)) == (-7, 0)
    assert await servo.tick(kp=ONE, kd=ONE, kv=ONE, ka=256, target=1, position=0, target_velocity=20, velocity=10,
                            target_acceleration=300) == (331, 0)


@cocotb.test()
async def the_integral_grows_by_ki_each_tick(dut):
    servo = await Servo(dut).reset(ki=1 << 22, target=6)           # 6/4 of a count a tick
    assert [(await servo.tick())[0] for _ in range(5)] == [1, 3, 4, 6, 7]
    assert [(await servo.tick(target=-6))[0] for _ in range(6)] == [6, 4, 3, 1, 0, -2]


@cocotb.test()
async def latency_is_135(dut):
    servo = await Servo(dut).reset()
    latency = 1
    out = await servo.clk(tick=1)
    while not out[0]:
        out = await servo.clk()
        latency += 1
    assert latency == 135 == LATENCY + 1
    for _ in range(2):                                  # and a command every 135 clk
        assert not (await servo.clk(tick=1))[0]
        outs = [(await servo.clk())[0] for _ in range(134)]
        assert outs == [0] * 133 + [1]


@cocotb.test()
async def inputs_are_taken_8_clk_after_tick(dut):
    servo = await Servo(dut).reset(kp=ONE)
    for change, want in ((8, 500), (9, 0)):
        out, n = await servo.clk(tick=1), 0
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
    out, n = await servo.clk(tick=1), 1
    while not out[0]:
        out = await servo.clk(tick=1)
        n += 1
    assert n == 135 and out[1] == 9


@cocotb.test()
async def both_ends_of_the_command(dut):
    servo = await Servo(dut).reset(kp=ONE)
    for limit in (LIMIT, 1000, 1, 0):
        assert await servo.tick(output_limit=limit, target=limit) == (limit, 0)
        assert await servo.tick(target=limit + 1) == (limit, 1)
        assert await servo.tick(target=-limit) == (-limit, 0)
        assert await servo.tick(target=-limit - 1) == (-limit, 1)


@cocotb.test()
async def ends_of_every_range(dut):
    servo = await Servo(dut).reset()
    low32, high32, low48, high48 = -1 << 31, (1 << 31) - 1, -1 << 47, (1 << 47) - 1
    for target, position, error in ((high48, low48, high32), (low48, high48, low32), (high32, 0, high32), (low32, 0, low32),
                                    (1 << 31, 0, high32), (low32 - 1, 0, low32)):
        for rate in (low32, high32):
            for gains in (0, 1, MOST):
                command, saturated = await servo.tick(kp=gains, ki=gains, kd=gains, kv=gains, ka=gains, target=target,
                                                      position=position, target_velocity=rate, velocity=-1 - rate,
                                                      target_acceleration=rate, dead_band=random.getrandbits(16))
                assert dut.error.value.to_signed() == error
                if gains == MOST:
                    assert (command, saturated) == (LIMIT if rate > 0 else -LIMIT, 1)       # ka outweighs them all


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
async def the_integral_does_not_wind_up_while_the_command_stands_at_its_limit(dut):
    servo = await Servo(dut).reset(kp=ONE, ki=HALF, output_limit=1000)
    for sign in (1, -1):
        out = [await servo.tick(target=sign * 900) for _ in range(20)]
        assert out == [(sign * 1000, 1)] * 20           # 900 + 450, which the first tick could not know
        assert await servo.tick(target=sign * -100) == (sign * 300, 0)      # -100 + 450 - 50
        assert await servo.tick(target=sign * 100) == (sign * 550, 0)
        await servo.tick(closed_loop=0)
        servo.set(closed_loop=1)


@cocotb.test()
async def the_integral_rests_in_the_dead_band_only_at_standstill(dut):
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


@cocotb.test()
async def the_integral_is_zero_in_open_loop_and_while_the_drive_is_off(dut):
    servo = await Servo(dut).reset(ki=HALF, target=100)
    for off, on in ((dict(closed_loop=0), dict(closed_loop=1)), (dict(block_up=1, block_down=1), dict(block_up=0, block_down=0))):
        assert [(await servo.tick())[0] for _ in range(2)] == [50, 100]
        servo.set(**off)
        await servo.clk()                               # one clk is enough
        servo.set(**on)
        assert (await servo.tick())[0] == 50
        servo.set(**off)
        assert (await servo.tick())[0] == 0
        servo.set(**on)


@cocotb.test()
async def a_command_whose_inputs_were_taken_without_power_is_zero(dut):
    """The firmware holds the target here and closes the loop; a tick that still saw the old target must not kick the motor."""
    servo = await Servo(dut).reset(kp=ONE, target=1 << 20, position=0)
    for off, on in ((dict(closed_loop=0), dict(closed_loop=1)), (dict(block_up=1, block_down=1), dict(block_up=0, block_down=0))):
        for wait in (0, 9, 10, 60, 133):
            servo.set(target=1 << 20, **off)
            await servo.clk(tick=1)
            for _ in range(wait):
                await servo.clk()
            servo.set(target=5, **on)
            out = await servo.clk()
            while not out[0]:
                out = await servo.clk()
            assert out[1] == (5 if wait == 0 else 0), f"power {wait} clk after the tick"
            assert await servo.tick() == (5, 0)


@cocotb.test()
async def open_loop_passes_open_command_and_measures_the_error(dut):
    servo = await Servo(dut).reset(kp=ONE, target=44)
    for command in (-1 << 15, -1, 0, 1, (1 << 15) - 1):
        assert await servo.tick(closed_loop=0, open_command=command, output_limit=3) == (command, 0)
        assert dut.error.value.to_signed() == 44


@cocotb.test()
async def reset_in_mid_flow(dut):
    servo = await Servo(dut).reset(kp=ONE, ki=HALF, target=100)
    for wait in (0, 1, 8, 9, 33, 34, 35, 133, 134):
        await servo.tick()
        await servo.clk(tick=1)
        for _ in range(wait):
            await servo.clk()
        assert await servo.clk(rst=1) == (0, 0, 0, 0)
        for _ in range(3):
            assert (await servo.clk())[0] == 0
        assert await servo.tick() == (150, 0)           # integral from zero: 100 + 50


@cocotb.test()
async def any_tick_matches_the_model(dut):
    servo = await Servo(dut).reset()
    word = lambda bits: random.randrange(-1 << bits - 1, 1 << bits - 1) >> random.randrange(bits)
    gain = lambda bits: random.getrandbits(bits) >> random.randrange(bits)
    for n in range(120):
        if n % 8 == 0:
            servo.set(kp=gain(24), ki=gain(24), kd=gain(24), kv=gain(24), ka=gain(24), output_limit=gain(15),
                      integral_limit=gain(15), dead_band=gain(16), closed_loop=1, block_up=0, block_down=0)
        servo.set(target=word(48), position=word(48) if n % 3 else servo.inputs["target"] - word(20) >> 1, target_velocity=word(32),
                  target_acceleration=word(32), velocity=word(32), moving=random.getrandbits(1), open_command=word(16))
        out = await servo.clk(tick=1)
        while not out[0]:
            if random.randrange(60) == 0:               # the guard and the firmware act in any clk
                servo.set(block_up=random.getrandbits(1), block_down=random.getrandbits(1), closed_loop=random.randrange(4) > 0)
            out = await servo.clk()
        for _ in range(random.randrange(4)):
            await servo.clk()


def test_pid_servo():
    run("pid_servo", __file__)
