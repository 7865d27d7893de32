# SPDX-License-Identifier: Apache-2.0
"""set_point_piece: a piece by hand, refusals, reset in mid-flow, random set-points against the
model in every cycle, and a sine at 1 kHz for two axes of which set-points are lost.
"""

import math
import random
from math import comb

import cocotb
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.control.set_point_piece import FARTHEST, SetPointPiece, played

ONE = 1 << 40  # a period
TOP = (1 << 47) - 1
FREE = (TOP, TOP)


class Pieces:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, SetPointPiece()
        self.inputs = dict(begin=(0, 0), set_point=(0, 0), ticks=2, limits=FREE)

    async def clk(self, rst=0, begin_piece=0):
        dut, i = self.dut, self.inputs
        dut.rst.value, dut.begin_piece.value, dut.ticks.value = rst, begin_piece, i["ticks"]
        dut.begin_position.value, dut.begin_velocity.value = i["begin"]
        dut.position.value, dut.velocity.value = i["set_point"]
        dut.velocity_limit.value, dut.acceleration_limit.value = i["limits"]
        want, piece = self.model.clk(rst, begin_piece, **i)
        await FallingEdge(dut.clk)
        valid = int(dut.valid.value)
        got = (int(dut.busy.value), valid, int(dut.refused.value) & valid)
        assert got == want, f"{i}: {got}, the model has {want}"
        if piece:
            names = ("acceleration", "jerk", "end_position", "end_velocity")
            found = tuple(getattr(dut, name).value.to_signed() for name in names)
            assert found == piece, f"{i}: {found}, the model has {piece}"
        return got, piece

    async def of(self, **inputs):
        """(cycles, piece or None) of one set-point."""
        self.inputs.update(inputs)
        (_, valid, _), piece = await self.clk(begin_piece=1)
        cycles = 1
        while not valid:
            (_, valid, _), piece = await self.clk()
            cycles += 1
        return cycles, piece


async def begin(dut):
    inputs = dict.fromkeys(("begin_piece", "velocity_limit", "acceleration_limit", "position"), 0)
    inputs |= dict.fromkeys(("velocity", "begin_position", "begin_velocity"), 0) | {"ticks": 2}
    await start(dut, **inputs)
    await FallingEdge(dut.clk)
    pieces = Pieces(dut)
    await pieces.clk(rst=1)
    return pieces


@cocotb.test()
async def latency_is_323_and_two_for_each_tick_and_a_piece_by_hand_is_right(dut):
    pieces = await begin(dut)
    # constant velocity: the piece ends half a tick before the set-point
    cycles, piece = await pieces.of(
        begin=(-(1 << 23), 1 << 24), set_point=(4, 1 << 24), ticks=4, limits=(1 << 24, 0)
    )
    assert piece == (0, 0, (4 << 24) - (1 << 23), 1 << 24)
    assert cycles == 323 + 2 * 4
    # from rest to rest over 10 units in 4 ticks, from the two equations
    _, piece = await pieces.of(begin=(0, 0), set_point=(10, 0), limits=FREE)
    assert piece[:2] == (2 * 3 * (10 << 24) // 20, -12 * (10 << 24) // 60)


@cocotb.test()
async def a_piece_of_one_tick_has_the_velocity_that_leads_to_its_end(dut):
    pieces = await begin(dut)
    inputs = dict(begin=(5 << 24, 1 << 24), set_point=(8, 4 << 24), ticks=1)
    cycles, piece = await pieces.of(**inputs, limits=(1 << 24, 0))
    assert cycles == 3 and piece == (0, 0, 6 << 24, 1 << 24)
    inputs["set_point"] = (9, 4 << 24)  # twice as fast
    assert (await pieces.of(**inputs, limits=(2 << 24, 1 << 24)))[1] == (0, 0, 7 << 24, 2 << 24)
    assert (await pieces.of(**inputs, limits=((2 << 24) - 1, 1 << 24)))[1] is None
    assert (await pieces.of(**inputs, limits=(2 << 24, (1 << 24) - 1)))[1] is None
    far = (FARTHEST >> 24) - 1
    for position in (far, -far):
        found = await pieces.of(begin=(0, 0), set_point=(position, 0), limits=FREE)
        assert found == (3, None)


@cocotb.test()
async def what_breaks_a_limit_is_refused_and_what_meets_it_is_not(dut):
    pieces = await begin(dut)
    _, piece = await pieces.of(begin=(0, 0), set_point=(1000, 0), ticks=8, limits=FREE)
    steps = played((0, 0), *piece[:2], 8)
    fast, steep = (max(abs(s[n]) for s in steps) for n in (1, 2))
    assert (await pieces.of(limits=(fast, steep)))[1] == piece
    assert (await pieces.of(limits=(fast - 1, steep)))[1] is None
    assert (await pieces.of(limits=(fast, steep - 1)))[1] is None
    far = FARTHEST >> 24
    for position in (far, -far, (1 << 47) - 1, -(1 << 47)):
        assert await pieces.of(set_point=(position, 0), limits=FREE) == (1, None)
    for position in (far - 1, 1 - far):
        for ticks in (2, 255):
            assert (await pieces.of(set_point=(position, 0), ticks=ticks))[1] is None


async def check_limits(pieces, fast, steep):
    """The piece that was computed last is accepted with these limits, and with none below them."""
    assert (await pieces.of(limits=(fast, steep)))[1]
    assert not fast or (await pieces.of(limits=(fast - 1, steep)))[1] is None
    assert not steep or (await pieces.of(limits=(fast, steep - 1)))[1] is None


@cocotb.test()
async def limits_of_each_size_are_kept_both_ways(dut):
    pieces = await begin(dut)
    for bits in range(1, 47):
        for sign in (1, -1):
            velocity, change = (sign * random.getrandbits(bits) for _ in range(2))
            at_begin = (-velocity, velocity - change)
            await pieces.of(begin=at_begin, set_point=(0, 0), ticks=1, limits=FREE)
            await check_limits(pieces, abs(velocity), abs(change))
    for bits in range(4, 46, 2):
        for sign in (1, -1):
            ticks, speed = random.randrange(2, 8), sign * random.getrandbits(bits)
            target = speed + sign * random.getrandbits(min(bits, 28))
            way = (ticks * (speed + target) + target) // 2 >> 24  # half a tick after the piece
            at_begin = (0, speed)
            _, piece = await pieces.of(
                begin=at_begin, set_point=(way, target), ticks=ticks, limits=FREE
            )
            steps = played(at_begin, *piece[:2], ticks)
            await check_limits(pieces, *(max(abs(step[n]) for step in steps) for n in (1, 2)))


@cocotb.test()
async def a_reset_ends_what_is_being_computed(dut):
    pieces = await begin(dut)
    for wait in (0, 1, 5, 150, 200, 327):
        pieces.inputs.update(set_point=(50, 0), ticks=5)
        await pieces.clk(begin_piece=1)
        for _ in range(wait):
            await pieces.clk()
        await pieces.clk(rst=1)
        assert (await pieces.of())[1]


@cocotb.test()
async def random_set_points_match_the_model(dut):
    pieces = await begin(dut)
    accepted = 0
    for _ in range(120):
        ticks = random.choice((1, 2, 3, 4, 40, 255, random.randrange(1, 256)))
        at = random.randrange(-(1 << 71), 1 << 71) >> random.randrange(2, 71)
        speed = random.randrange(-TOP, TOP + 1) >> random.randrange(47)
        target = random.randrange(-TOP, TOP + 1) >> random.randrange(47)
        way = ticks * (speed + target) // 2 + (random.randrange(-ONE, ONE) >> random.randrange(40))
        position = max(-TOP, min(TOP, at + way >> 24))
        limits = FREE if random.random() < 0.7 else (TOP >> random.randrange(47),) * 2
        _, piece = await pieces.of(
            begin=(at, speed), set_point=(position, target), ticks=ticks, limits=limits
        )
        if piece:
            accepted += 1
            error = piece[2] - ((position << 24) - (target >> 1))
            assert abs(error) <= comb(ticks, 2) + comb(ticks, 3) < ticks**3
    assert accepted > 20


@cocotb.test()
async def a_sine_with_lost_set_points_stays_inside_the_limits(dut):
    """Two axes, a set-point every 4 ticks; a lost one makes the next piece longer."""
    pieces = await begin(dut)
    size, turn = 300_000, 2 * math.pi / 800  # 2^-16 period; per tick
    limits = (round(size * turn * 1.5 * 2**24), round(size * turn**2 * 2 * 2**24))
    for axis in range(2):
        state, last, refused = (0, 0), 0, 0
        for k in range(1, 45):
            if k > 2 and random.random() < 0.2:
                continue
            angle = 4 * k * turn
            raised = 1 - math.cos(angle)  # from rest
            point = round(size * raised), round(size * turn * math.sin(angle) * 2**24)
            n = 4 * (k - last)
            _, piece = await pieces.of(begin=state, set_point=point, ticks=n, limits=limits)
            if piece is None:
                refused += 1
                continue
            for _, fast, steep in played(state, *piece[:2], n):
                assert abs(fast) <= limits[0] and abs(steep) <= limits[1]
            assert abs(piece[2] + (piece[3] >> 1) - (point[0] << 24)) < 2 * n**3
            state, last = piece[2:], k
        assert refused == 0, f"axis {axis}"


def test_set_point_piece():
    run("set_point_piece", __file__)
