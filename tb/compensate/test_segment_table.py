# SPDX-License-Identifier: Apache-2.0
"""segment_table: the rectangle of S0 by hand, the straight line, the borders, the sign in both
directions, and any table against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.compensate.segment_table import SegmentTable

IDLE = dict(
    enable=1,
    linear=0,
    origin=0,
    segment_length=1,
    segments=1,
    write=0,
    point=0,
    value=0,
    read_point=0,
    valid=0,
    position=0,
)
FAR = 1 << 47


class Table:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.inputs = (
            dut,
            SegmentTable(),
            dict(rst=0, valid=0, position=0, linear=0, enable=1),
        )
        self.errors, self.origin, self.length = [0, 0], 0, 1

    async def reset(self, errors, origin=0, length=1000):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        await self.give(errors, origin, length)
        return self

    async def give(self, errors, origin, length):
        dut = self.dut
        dut.origin.value, dut.segment_length.value, dut.segments.value = (
            origin,
            length,
            len(errors) - 1,
        )
        for n, error in enumerate(errors):
            dut.write.value, dut.point.value, dut.value.value = 1, n, error
            await self.clk()
        dut.write.value = 0
        self.errors, self.origin, self.length = errors, origin, length

    async def clk(self, count=1, **inputs):
        dut, model = self.dut, self.model
        self.inputs.update(inputs)
        for name, level in inputs.items():
            getattr(dut, name).value = level
        for _ in range(count):
            model.clk(errors=self.errors, origin=self.origin, length=self.length, **self.inputs)
            await RisingEdge(dut.clk)
            await FallingEdge(dut.clk)
            assert int(dut.done.value) == model.done
            if model.done:
                got = (
                    dut.corrected.value.to_signed(),
                    bool(dut.outside.value),
                    dut.error.value.to_signed(),
                )
                want = model.corrected, model.outside, model.error
                assert got == want, (
                    f"{self.inputs}, segments of {self.length} from {self.origin}: {got}, "
                    f"the model has {want}"
                )

    async def at(self, position, linear=0, enable=1):
        """Return (corrected, outside); self.cycles is how long it took."""
        await self.clk(valid=1, position=position, linear=linear, enable=enable)
        self.cycles = 1
        while not self.model.done:
            await self.clk(valid=0)
            self.cycles += 1
        return self.model.corrected, self.model.outside


@cocotb.test()
async def the_rectangle_of_s0_by_hand(dut):
    table = await Table(dut).reset([0, 10, 30, -20], origin=500)
    for position, error in ((500, 5), (1499, 5), (1500, 20), (2499, 20), (2500, 5), (3499, 5)):
        assert await table.at(position) == (position - error, False)


@cocotb.test()
async def the_straight_line_by_hand(dut):
    table = await Table(dut).reset([0, 10, 30, -20], origin=-500)
    for position, error in (
        (-500, 0),
        (0, 5),
        (500, 10),
        (1000, 20),
        (1500, 30),
        (2000, 5),
        (2499, -20),
    ):
        assert await table.at(position, linear=1) == (position - error, False)


@cocotb.test()
async def latency_is_index_plus_22(dut):
    table = await Table(dut).reset([1, 2])
    for position in (0, 500, -1, 5000):
        await table.at(position)
        assert table.cycles == int(dut.INDEX.value) + 22


@cocotb.test()
async def the_sign_is_right_in_both_directions(dut):
    errors = [100 * n for n in range(9)]  # the scale reads 100 more with each segment
    table = await Table(dut).reset(errors, length=10_000)
    for linear in (0, 1):
        for true in [*range(0, 79_000, 3950), *range(79_000, 0, -3950)]:
            corrected, _ = await table.at(true + true // 100, linear)
            assert abs(corrected - true) <= (60 if not linear else 10)


@cocotb.test()
async def beyond_the_table_the_error_is_that_of_its_border(dut):
    table = await Table(dut).reset([7, 0, -9], origin=-1000)
    for linear in (0, 1):
        for position, error in ((-1001, 7), (-FAR, 7), (1000, -9), (FAR - 1, -9)):
            corrected, outside = await table.at(position, linear)
            assert outside and (corrected - (position - error)) % (2 * FAR) == 0


@cocotb.test()
async def without_enable_the_position_passes_unchanged(dut):
    table = await Table(dut).reset([7, 8, -9])
    assert (await table.at(1234, enable=0))[0] == 1234


@cocotb.test()
async def points_are_read_back_while_no_position_is_processed(dut):
    points = [random.randrange(-1 << 23, 1 << 23) for _ in range(256)]
    table = await Table(dut).reset(points)
    for n in (0, 255, *random.sample(range(256), 20)):
        dut.read_point.value = n
        await table.clk()
        assert dut.read_value.value.to_signed() == points[n]
        await table.at(random.randrange(255_000), random.getrandbits(1))  # which reads other points
        await table.clk(valid=0)
        assert dut.read_value.value.to_signed() == points[n]


@cocotb.test()
async def the_largest_errors_in_the_longest_table_match_the_model(dut):
    ends = -(1 << 23), (1 << 23) - 1
    table = await Table(dut).reset(
        [ends[n % 2] for n in range(256)], origin=-FAR // 2, length=(FAR - 1) // 256
    )
    for n in (0, 1, 127, 254):
        for linear in (0, 1):
            for inside in (0, 1, table.length // 2, table.length - 1):
                await table.at(table.origin + n * table.length + inside, linear)


@cocotb.test()
async def a_position_that_comes_too_early_is_ignored(dut):
    table = await Table(dut).reset([3, 4, 5])
    for n in range(200):
        await table.clk(
            valid=random.getrandbits(1), position=random.randrange(-100, 2100), enable=int(n < 150)
        )


@cocotb.test()
async def reset_drops_the_running_position(dut):
    table = await Table(dut).reset([3, 4, 5])
    for wait in range(1, 30, 4):
        await table.clk(valid=1, position=100)
        await table.clk(wait - 1, valid=0)
        await table.clk(rst=1)
        await table.clk(32, rst=0)
        await table.at(1500)


@cocotb.test()
async def any_table_matches_the_model(dut):
    table = await Table(dut).reset([0, 0])
    for _ in range(25):
        count = random.choice((1, 2, 7, 100, 255))
        length = random.choice((1, 3, 1000, random.getrandbits(30) + 1, random.getrandbits(38) + 1))
        await table.give(
            [random.randrange(-1 << 23, 1 << 23) for _ in range(count + 1)],
            random.randrange(-1 << 40, 1 << 40),
            length,
        )
        for _ in range(12):
            distance = random.choice(
                (
                    random.randrange(count * length),
                    random.randrange(count) * length,
                    -1,
                    count * length,
                    random.randrange(-length, (count + 1) * length),
                )
            )
            await table.at(table.origin + distance, random.getrandbits(1))
            await table.clk(random.choice((0, 0, 3)))


def test_segment_table():
    run("segment_table", __file__)
