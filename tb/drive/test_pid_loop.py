# SPDX-License-Identifier: Apache-2.0
"""pid_loop: all terms by hand, anti-windup, bumpless transfer when loop, power or gains change,
both ends of the ranges, and random ticks, with changes within them, against the model in every
cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.drive.pid_loop import LATENCY, RETAKEN, PidLoop

INPUTS = "power closed_loop kp ki kd limit target position open_command".split()
ONE = 1 << 16  # of kp
HALF = 1 << 23  # of ki
MOST, LIMIT = (1 << 24) - 1, (1 << 15) - 1


class Loop:
    """The design with the model beside it in every cycle; `set` holds the inputs."""

    def __init__(self, dut):
        self.dut, self.inputs, self.model = dut, dict.fromkeys(INPUTS, 0), PidLoop()

    async def reset(self, **inputs):
        await start(self.dut, tick=0, gains_changed=0, **self.inputs)
        await FallingEdge(self.dut.clk)
        self.set(**dict(power=1, closed_loop=1, limit=LIMIT) | inputs)
        return self

    def set(self, **inputs):
        self.inputs.update(inputs)
        for name, level in inputs.items():
            getattr(self.dut, name).value = level

    async def clk(self, **strobes):
        strobes = dict(tick=0, rst=0, gains_changed=0) | strobes
        for name, level in strobes.items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        want = self.model.clk(**strobes, **self.inputs)
        got = int(self.dut.valid.value), self.dut.command.value.to_signed()
        assert got == want, f"valid, command are {got}, the model has {want}"
        assert int(self.dut.at_limit.value) == self.model.at_limit
        return got

    async def tick(self, **inputs):
        """A whole tick with these inputs; returns the command."""
        self.set(**inputs)
        out = await self.clk(tick=1)
        while not out[0]:
            out = await self.clk()
        return out[1]

    async def commands(self, count, **inputs):
        self.set(**inputs)
        return [await self.tick() for _ in range(count)]

    async def gains(self, **gains):
        """Write the gains as the bus does, one per cycle."""
        for name, value in gains.items():
            self.set(**{name: value})
            await self.clk(gains_changed=1)


@cocotb.test()
async def latency_is_134_and_a_tick_within_the_calculation_is_ignored(dut):
    loop = await Loop(dut).reset(kp=ONE, target=9)
    await loop.tick()
    out, cycles = await loop.clk(tick=1), 1
    while not out[0]:
        out, cycles = await loop.clk(tick=1), cycles + 1
    assert cycles == LATENCY + 1 == 134 and out[1] == 9


@cocotb.test()
async def the_terms_of_kp_and_ki_give_the_command_worked_out_by_hand(dut):
    loop = await Loop(dut).reset(kp=ONE)
    assert await loop.tick(target=70, position=-30) == 100
    assert await loop.tick(kp=ONE // 2, target=-33) == -2  # rounded down
    await loop.tick(closed_loop=0)
    loop.set(closed_loop=1, kp=0, ki=1 << 22, target=6, position=0)  # 6/4 of a count per tick
    assert [await loop.tick() for _ in range(6)] == [0, 1, 3, 4, 6, 7]  # the first is bumpless
    assert [await loop.tick(target=-6) for _ in range(6)] == [6, 4, 3, 1, 0, -2]


@cocotb.test()
async def the_lowest_bit_of_ki_has_no_part_in_the_sum(dut):
    loop = await Loop(dut).reset(ki=1, target=1 << 23)  # half a count per tick
    assert await loop.commands(6) == [0, 0, 1, 1, 2, 2]  # the first is bumpless
    assert await loop.commands(4, target=0) == [2, 2, 2, 2]


@cocotb.test()
async def a_change_of_the_error_adds_to_the_command_for_one_tick(dut):
    loop = await Loop(dut).reset(kd=ONE // 2, limit=1000)
    assert await loop.commands(2) == [0, 0]
    for error, want in ((60, 30), (60, 0), (-40, -50), (-41, -1), (-41, 0), (3000, 1000)):
        assert await loop.tick(target=error) == want
    assert await loop.tick(target=5) == -1000
    loop.set(kp=ONE)
    assert await loop.commands(2, target=1400) == [1000, 1000]
    assert await loop.tick(target=1200) == 900  # 100 below the limit of the sum


@cocotb.test()
async def the_change_of_the_error_is_counted_from_the_open_loop_but_makes_no_jump(dut):
    loop = await Loop(dut).reset(kd=ONE, ki=1, closed_loop=0, open_command=300, target=50)
    assert await loop.commands(2) == [300, 300]
    assert await loop.commands(2, closed_loop=1, target=90) == [300, 300]
    assert await loop.tick(target=100) == 310
    far = (1 << 30) + 100
    assert await loop.commands(3, kp=0, ki=0, target=far) == [300] * 3  # far: no change
    assert await loop.commands(3, target=far - 110) == [300] * 3
    assert await loop.tick(target=far - 120) == 290


@cocotb.test()
async def the_command_and_the_integral_are_limited_at_both_ends(dut):
    loop = await Loop(dut).reset(kp=ONE)
    for limit in (LIMIT, 1000, 1, 0):
        for error in (limit, limit + 1, 1 << 40):
            assert await loop.tick(limit=limit, target=error) == limit
            assert await loop.tick(target=-error) == -limit
    loop.set(kp=0, ki=MOST, limit=100)
    for sign in (1, -1):
        assert (await loop.commands(5, target=sign * 1000))[-1] == sign * 100


@cocotb.test()
async def the_integral_does_not_wind_up_while_the_command_is_at_its_limit(dut):
    loop = await Loop(dut).reset(kp=ONE, ki=HALF, limit=1000)
    for sign in (1, -1):
        assert await loop.commands(1, target=0) == [0]
        assert await loop.commands(20, target=sign * 900) == [sign * 1000] * 20
        assert await loop.tick(target=sign * -100) == sign * 300  # -100 + 450 - 50
        await loop.tick(closed_loop=0)
        loop.set(closed_loop=1)


@cocotb.test()
async def closing_the_loop_continues_from_the_open_command(dut):
    loop = await Loop(dut).reset(kp=ONE, ki=1 << 22, closed_loop=0, open_command=3000, target=400)
    assert await loop.commands(2) == [3000, 3000]
    assert await loop.commands(3, closed_loop=1) == [3000, 3100, 3200]  # 400 / 4 per tick
    assert await loop.commands(1, closed_loop=0, open_command=-20) == [-20]


@cocotb.test()
async def the_power_comes_on_at_zero_however_large_the_error_is(dut):
    loop = await Loop(dut).reset(kp=ONE, ki=1 << 20, target=6400, power=0)
    assert await loop.commands(2) == [0, 0]
    assert await loop.commands(3, power=1) == [0, 400, 800]


@cocotb.test()
async def a_tick_whose_inputs_were_taken_without_power_does_not_count(dut):
    loop = await Loop(dut).reset(kp=ONE)
    for off, on in (
        (dict(closed_loop=0), dict(closed_loop=1)),
        (dict(power=0), dict(power=1)),
    ):
        for wait in (0, 1, 30, LATENCY - 2):
            await loop.commands(1, target=5, **off)
            loop.set(target=1 << 20)
            await loop.clk(tick=1)
            for _ in range(wait):
                await loop.clk()
            loop.set(target=5, **on)
            out = await loop.clk()
            while not out[0]:
                out = await loop.clk()
            assert out[1] == 0, f"power {wait} cycles after the tick"
            assert await loop.tick() == 5


@cocotb.test()
async def a_change_of_kp_makes_no_jump_in_the_command(dut):
    loop = await Loop(dut).reset(kp=ONE, ki=1 << 20, target=640)
    before = (await loop.commands(5))[-1]
    await loop.gains(kp=3 * ONE)
    assert await loop.commands(3) == [before, before + 40, before + 80]
    await loop.tick(closed_loop=0)
    assert await loop.commands(2, closed_loop=1, kp=ONE, ki=0, target=100) == [100, 100]
    await loop.gains(kp=2 * ONE)
    assert await loop.commands(1) == [200]


@cocotb.test()
async def the_ends_of_every_range_match_the_model(dut):
    loop = await Loop(dut).reset()
    low, high = -1 << 47, (1 << 47) - 1
    for target, position in (
        (high, low),
        (low, high),
        (1 << 31, 0),
        ((-1 << 31) - 1, 0),
        ((1 << 30) - 1, 0),
        (-1 << 30, 0),
        (1 << 30, 0),
        ((-1 << 30) - 1, 0),
    ):
        for gain in (0, 1, MOST):
            for limit in (0, 1, LIMIT):
                await loop.tick(
                    kp=gain, ki=gain, kd=gain, target=target, position=position, limit=limit
                )


@cocotb.test()
async def every_bit_of_the_gains_and_of_the_limit_has_its_part_alone(dut):
    loop = await Loop(dut).reset()
    none = dict(kp=0, ki=0, kd=0)
    for n in range(24):
        # 64 or more counts of command; a gain that is kept for a tick too long would show in it
        error, slow = 1 << max(0, 22 - n), 1 << max(0, 30 - n)
        for gain, change in (("kp", error), ("ki", slow), ("kd", error)):
            await loop.tick(**none | {gain: 1 << n}, limit=LIMIT, target=0)
            for sign in (1, -1):
                await loop.tick(target=sign * change)
            await loop.tick(**none, target=random.randrange(-100, 100))
    for n in range(15):
        for limit in (1 << n, LIMIT ^ 1 << n):
            for sign in (1, -1):
                await loop.tick(kp=ONE, limit=limit, target=sign << 20)
                await loop.tick(kp=ONE, limit=LIMIT, target=sign * limit)


@cocotb.test()
async def random_ticks_and_a_reset_in_mid_flow_match_the_model(dut):
    loop = await Loop(dut).reset()
    for n in range(300):
        bits = random.choice((4, 12, 24, 47))
        await loop.tick(
            target=random.getrandbits(bits) - (1 << bits - 1),
            position=random.getrandbits(bits) - (1 << bits - 1),
            power=int(random.random() < 0.9),
            closed_loop=int(random.random() < 0.8),
            open_command=random.getrandbits(16) - (1 << 15),
        )
        if n % 10 == 5:
            loop.set(limit=random.getrandbits(random.randrange(1, 16)))
            await loop.gains(kp=random.getrandbits(18), ki=random.getrandbits(20))
            loop.set(kd=random.getrandbits(20) * random.getrandbits(1))
        if n % 50 == 40:
            await loop.clk(tick=1)
            for _ in range(random.randrange(LATENCY)):
                await loop.clk()
            await loop.clk(rst=1)


@cocotb.test()
async def a_change_of_any_input_within_a_calculation_matches_the_model(dut):
    loop = await Loop(dut).reset()
    for _ in range(100):
        loop.set(target=random.randrange(-5000, 5000), power=1, closed_loop=1)
        out = await loop.clk(tick=1)
        while not out[0]:
            strobes = {}
            if random.random() < 0.02:
                name, value = random.choice(
                    (
                        ("power", random.getrandbits(1)),
                        ("closed_loop", random.getrandbits(1)),
                        ("kp", random.getrandbits(20)),
                        ("ki", random.getrandbits(20) * random.getrandbits(1)),
                        ("kd", random.getrandbits(20)),
                        ("limit", random.getrandbits(random.randrange(1, 16))),
                        ("open_command", random.getrandbits(16) - (1 << 15)),
                        ("position", random.randrange(-5000, 5000)),
                    )
                )
                loop.set(**{name: value})
                strobes = dict(gains_changed=int(name == "kp"))
            out = await loop.clk(**strobes, tick=int(random.random() < 0.05))


@cocotb.test()
async def the_limit_that_was_sampled_with_the_tick_holds_for_its_command(dut):
    loop = await Loop(dut).reset(kp=ONE, target=1000, limit=500)
    for wait in (0, 1, 40, 90):
        assert await loop.tick(limit=500) == 500
        await loop.clk(tick=1)
        for _ in range(wait):
            await loop.clk()
        loop.set(limit=200)
        out = await loop.clk()
        while not out[0]:
            out = await loop.clk()
        assert out[1] == 500 and await loop.tick() == 200


@cocotb.test()
async def latency_is_125_when_the_integral_is_retaken(dut):
    loop = await Loop(dut).reset(kp=ONE, ki=1 << 20, target=9)
    await loop.tick()
    await loop.gains(kp=2 * ONE)
    for want in (RETAKEN, LATENCY):
        out, cycles = await loop.clk(tick=1), 0
        while not out[0]:
            out, cycles = await loop.clk(), cycles + 1
        assert cycles == want
    assert RETAKEN + 1 == 125


def test_pid_loop():
    run("pid_loop", __file__)
