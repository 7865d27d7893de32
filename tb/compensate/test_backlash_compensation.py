# SPDX-License-Identifier: Apache-2.0
"""backlash_compensation: the backlash is taken up at its rate when the target reverses, and the
position of the table follows; every cycle against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tables.microcode.numbers import GIVEN
from tb.bench import run, start
from tb.compensate.backlash_compensation import BacklashCompensation

IDLE = dict.fromkeys(
    "tick backlash take_up_rate hysteresis motor_side valid kind result position".split(), 0
)
MOST = (1 << 24) - 1


class Screw:
    """The design with its model beside it."""

    def __init__(self, dut, **settings):
        self.dut, self.model, self.inputs = dut, BacklashCompensation(), IDLE | settings

    async def reset(self):
        await start(self.dut, **self.inputs)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, **inputs):
        """Advances one cycle; returns take_up."""
        self.inputs |= inputs
        for name, value in (self.inputs | dict(rst=rst)).items():
            getattr(self.dut, name).value = value
        await FallingEdge(self.dut.clk)
        names = "tick backlash take_up_rate hysteresis valid kind result".split()
        self.model.step(*(self.inputs[name] for name in names))
        if rst:
            self.model = BacklashCompensation()
        assert int(self.dut.take_up.value) == self.model.take_up
        want = self.model.position(self.inputs["position"], self.inputs["motor_side"])
        assert self.dut.table_position.value.to_signed() == want
        return self.model.take_up

    async def target(self, moves):
        """The target moves by so much in this tick."""
        await self.clk(tick=0, valid=1, kind=GIVEN.index("target_velocity"), result=moves)
        self.inputs["valid"] = 0

    async def ticks(self, count, **inputs):
        """take_up after each of so many ticks."""
        return [await self.clk(tick=1, **inputs) for _ in range(count)]


@cocotb.test()
async def latency_is_1_from_tick_and_0_from_position(dut):
    screw = await Screw(dut, backlash=7, motor_side=1).reset()
    await screw.target(1)
    dut.tick.value, dut.position.value = 1, 100
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert int(dut.take_up.value) == 7 and dut.table_position.value.to_signed() == 93
    dut.position.value = 50
    await RisingEdge(dut.clk)
    assert dut.table_position.value.to_signed() == 43


@cocotb.test()
async def a_reversal_takes_the_backlash_up_at_its_rate_and_a_rest_lets_it_finish(dut):
    screw = await Screw(dut, backlash=10, take_up_rate=4).reset()
    assert await screw.ticks(2) == [0, 0]  # it has not moved yet
    await screw.target(3)
    assert await screw.ticks(1) == [4]
    await screw.target(0)
    assert await screw.ticks(3) == [8, 10, 10]
    await screw.target(-1)
    assert await screw.ticks(1) == [10]  # what is rounded down
    await screw.target(-2)
    assert await screw.ticks(1) == [6]
    await screw.target(1)
    assert await screw.ticks(1) == [10]
    await screw.target(-(1 << 31))
    assert await screw.ticks(4) == [6, 2, 0, 0]


@cocotb.test()
async def a_motion_back_within_the_hysteresis_is_no_reversal(dut):
    screw = await Screw(dut, backlash=10, hysteresis=1).reset()
    for moves, take_up in (
        (256, 0),  # from the farthest point, where it was after reset
        (1, 10),
        (-201, 10),
        (100, 10),  # 100 back
        (-157, 10),
        (-2, 0),
        (200, 0),
        (-301, 0),
        (256, 0),
        (1, 10),
    ):
        await screw.target(moves)
        assert await screw.ticks(1) == [take_up], moves


@cocotb.test()
async def without_a_rate_it_is_taken_up_at_once_and_a_new_setting_is_followed(dut):
    screw = await Screw(dut, backlash=MOST).reset()
    await screw.target(1)
    assert await screw.ticks(1) == [MOST]
    assert await screw.ticks(1, backlash=5) == [5]
    assert await screw.ticks(1, backlash=MOST, take_up_rate=MOST) == [MOST]
    await screw.target(-2)
    assert await screw.clk(tick=0) == MOST  # until the tick
    assert await screw.ticks(1) == [0]


@cocotb.test()
async def only_a_sensor_on_the_side_of_the_motor_is_corrected(dut):
    screw = await Screw(dut, backlash=9, position=-3).reset()
    await screw.target(1)
    for motor_side, position in ((0, -3), (1, -12)):
        await screw.ticks(1, motor_side=motor_side)
        assert dut.table_position.value.to_signed() == position


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    screw = await Screw(dut).reset()
    for _ in range(8000):
        bits = random.choice((3, 9, 12, 14, 15, 16, 32))
        if random.random() < 0.1:
            screw.inputs |= dict(
                backlash=random.choice((0, MOST, 100, random.getrandbits(24))),
                hysteresis=random.choice((0, 1, 127, random.getrandbits(7))),
            )
        left = abs((screw.inputs["backlash"] if screw.model.up else 0) - screw.model.take_up)
        near = max(0, min(MOST, left + random.choice((-1, 0, 1, 2, -300))))
        # as far back as is no reversal, or farther by one
        back = max(0, (screw.inputs["hysteresis"] << 8) - screw.model.back + random.getrandbits(1))
        reverses = -back - 1 if screw.model.up else back
        power = random.choice((-1, 1)) << random.randrange(31)
        any_distance = random.randrange(-1 << bits - 1, 1 << bits - 1)
        await screw.clk(
            rst=int(random.random() < 0.005),
            tick=random.getrandbits(1),
            take_up_rate=random.choice((0, 1, 30, near, random.getrandbits(24))),
            motor_side=random.getrandbits(1),
            valid=random.getrandbits(1),
            kind=random.choice((GIVEN.index("target_velocity"), random.randrange(8))),
            result=random.choice((reverses, power, any_distance)),
            position=random.randrange(-(1 << 46), 1 << 46),
        )


def test_backlash_compensation():
    run("backlash_compensation", __file__)
