# SPDX-License-Identifier: Apache-2.0
"""turn_angle: a turn by hand, the accuracy of the angle, the start at every quarter, a missing
reference mark, and any steps against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.compensate.turn_angle import TurnAngle

IDLE = dict(counts_per_turn=0, angle_per_count=0, a=0, b=0, step=0, index=0)


class Turn:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.inputs = dut, TurnAngle(int(dut.W.value)), dict(IDLE)

    async def reset(self, counts=0, **inputs):
        self.inputs.update(
            counts_per_turn=counts, angle_per_count=round(2**48 / counts) if counts else 0, **inputs
        )
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        return self

    async def clk(self, rst=0, **inputs):
        self.inputs.update(inputs)
        for name, level in self.inputs.items():
            getattr(self.dut, name).value = level
        self.dut.rst.value = rst
        self.model.clk(rst=rst, **self.inputs)
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        for name in ("moved", "position", "angle", "known", "referenced", "missing"):
            got, want = int(getattr(self.dut, name).value), int(getattr(self.model, name))
            assert got == want, f"{self.inputs}: {name} is {got}, the model has {want}"
        self.inputs.update(step=0, index=0)


@cocotb.test()
async def the_angles_of_a_turn_of_4_counts_are_its_quarters(dut):
    turn = await Turn(dut).reset(counts=4)
    await turn.clk(step=1, index=1)
    assert (turn.model.position, turn.model.angle, turn.model.known) == (1, 0, True)
    angles = []
    for step in (1, 1, 1, 1, -1, -1):
        await turn.clk(step=step)
        angles.append(turn.model.angle >> 30)
    assert angles == [1, 2, 3, 0, 3, 2]


@cocotb.test()
async def latency_is_1(dut):
    turn = await Turn(dut).reset(counts=8)
    await turn.clk(step=1, index=1)
    assert (
        int(dut.position.value) == 1
        and int(dut.known.value) == 1
        and int(dut.referenced.value) == 1
    )
    await turn.clk()
    assert int(dut.referenced.value) == 0


@cocotb.test()
async def position_starts_at_the_quarter_that_the_levels_show(dut):
    for quarter, (a, b) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
        turn = await Turn(dut).reset(counts=100, a=1 - a)
        await turn.clk(a=a, b=b)
        assert turn.model.position == quarter
        await turn.clk(a=0, b=0, step=-1)
        assert turn.model.position == (quarter - 1) % 2**32
        await turn.clk(a=0, b=1)
        assert turn.model.position == (quarter - 1) % 2**32


@cocotb.test()
async def the_angle_is_as_accurate_as_the_header_says_for_any_counts_per_turn(dut):
    for counts in (3, 1000, 999_983, 32_768_000, 2**25 - 1):
        turn = await Turn(dut).reset(counts=counts)
        await turn.clk(index=1)
        for direction in (1, -1):
            for n in range(1, 200):
                await turn.clk(step=direction)
                away = (n * direction if direction > 0 else 199 - n) % counts
                error = (turn.model.turned - round(away * 2**48 / counts) + 2**47) % 2**48 - 2**47
                assert abs(error) <= counts / 2 + 1


@cocotb.test()
async def a_turn_without_its_index_is_reported_in_both_directions(dut):
    for direction in (1, -1):
        for counts in (5, 12):
            turn = await Turn(dut).reset(counts=counts)
            await turn.clk(index=1)
            seen = []
            for _ in range(2 * counts + 1):
                await turn.clk(step=direction)
                seen.append(turn.model.missing)
            assert seen.index(True) == (counts - 1 if direction > 0 else counts)
            turn = await Turn(dut).reset(counts=counts)
            place = 0
            for _ in range(5 * counts):
                place = (place + direction) % counts
                await turn.clk(step=direction, index=int(place == 0))
                assert not turn.model.missing


@cocotb.test()
async def trembling_over_a_wide_index_reports_no_missing_one(dut):
    turn = await Turn(dut).reset(counts=6)
    await turn.clk(step=1, index=1)
    for _ in range(20):
        await turn.clk(step=-1)
        await turn.clk(step=1)  # still high: the index is not found again
        assert not turn.model.missing


@cocotb.test()
async def without_counts_per_turn_nothing_is_known(dut):
    turn = await Turn(dut).reset()
    for _ in range(20):
        await turn.clk(step=random.choice((-1, 1)), index=1)
        assert not (turn.model.known or turn.model.referenced or turn.model.missing)


@cocotb.test()
async def reset_forgets_position_and_angle(dut):
    turn = await Turn(dut).reset(counts=10)
    for n in range(8):
        await turn.clk(step=1, index=1)
        for _ in range(n):
            await turn.clk(step=1)
        await turn.clk(rst=1, step=1, index=1)
        assert turn.model.position == 0 and not turn.model.known


@cocotb.test()
async def any_steps_match_the_model(dut):
    for counts in (0, 2, 3, 7, 50):
        turn = await Turn(dut).reset(counts=counts)
        drift = 0
        for _ in range(2000):
            drift = drift if random.randrange(50) else random.choice((-1, 0, 1))
            step = random.choice((-1, 0, 1, drift, drift))
            await turn.clk(
                step=step,
                index=int(random.randrange(40) == 0),
                rst=int(random.randrange(500) == 0),
                a=random.getrandbits(1),
                b=random.getrandbits(1),
            )


@cocotb.test()
async def any_count_and_any_angle_match_the_model(dut):
    turn = await Turn(dut).reset()
    for _ in range(500):
        bits = random.randint(1, 32)
        counts = random.choice((1 << bits - 1, (1 << bits) - 1, random.getrandbits(bits)))
        await turn.clk(index=1, counts_per_turn=counts, angle_per_count=random.getrandbits(48))
        await turn.clk(step=-1)  # at the highest of these counts
        for _ in range(random.randrange(3)):
            await turn.clk(step=-1, angle_per_count=random.getrandbits(48))
        # the turn ends here, or just before or behind
        at = turn.model.from_mark
        near = random.choice((at + 2, at + 1, at, at - 1, at ^ 1 << random.randrange(32)))
        await turn.clk(counts_per_turn=near % (1 << 32))
        for _ in range(3):
            await turn.clk(step=1, angle_per_count=random.getrandbits(48))
        await turn.clk(index=1)
        for step in (1, -1):
            await turn.clk(step=step, angle_per_count=random.getrandbits(48))


def test_turn_angle():
    run("turn_angle", __file__)
