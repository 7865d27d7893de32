# SPDX-License-Identifier: Apache-2.0
"""quadrature_encoder: edges by hand, latency, minimum_edge_separation, hysteresis, index, both ends
of the range, and any target against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.drive.quadrature_encoder import QuadratureEncoder, signed

IDLE = dict(
    minimum_edge_separation=1,
    hysteresis=0,
    counts_per_turn=0,
    load=0,
    target=0,
    home=0,
    home_position=0,
)
STROBES = "home", "load"


class Encoder:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.inputs = dut, dict(IDLE)
        self.w, self.f = int(dut.W.value), int(dut.F.value)
        self.model = QuadratureEncoder(self.w, self.f)

    async def reset(self, **inputs):
        self.inputs.update(inputs)
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        await self.clk()
        return self

    async def clk(self, count=1, rst=0, **inputs):
        for _ in range(count):
            self.inputs.update(inputs)
            for name, level in self.inputs.items():
                getattr(self.dut, name).value = level
            self.dut.rst.value = rst
            self.model.clk(rst=rst, **self.inputs)
            await RisingEdge(self.dut.clk)
            await FallingEdge(self.dut.clk)
            got = int(self.dut.a.value), int(self.dut.b.value), int(self.dut.z.value)
            assert got == self.model.pins(), (
                f"{self.inputs}: pins {got}, the model has {self.model.pins()}"
            )
            assert int(self.dut.position.value) == self.model.position
            assert bool(self.dut.behind.value) == self.model.behind
            for name in STROBES:
                self.inputs[name] = 0
                inputs.pop(name, None)
        return got

    async def at(self, count, **inputs):
        """Set the target to so many counts."""
        return await self.clk(target=signed(int(count * (1 << self.f)), self.w + self.f), **inputs)

    @property
    def position(self):
        return signed(self.model.position, self.w)


@cocotb.test()
async def the_edges_up_3_and_down_2_are_as_drawn_by_hand(dut):
    encoder = await Encoder(dut).reset()
    await encoder.at(3)
    assert [(await encoder.clk())[:2] for _ in range(5)] == [(1, 0), (1, 1), (0, 1), (0, 1), (0, 1)]
    await encoder.at(1)
    assert [(await encoder.clk())[:2] for _ in range(4)] == [(1, 1), (1, 0), (1, 0), (1, 0)]


@cocotb.test()
async def latency_is_2(dut):
    encoder = await Encoder(dut).reset()
    assert (await encoder.at(1))[:2] == (0, 0)
    assert (await encoder.clk())[:2] == (1, 0)
    await encoder.clk(5)
    assert (await encoder.at(0))[:2] == (1, 0)
    assert (await encoder.clk())[:2] == (0, 0)


@cocotb.test()
async def a_half_is_rounded_up(dut):
    encoder = await Encoder(dut).reset()
    least = 1 / (1 << encoder.f)
    for target, settled in (
        (0.5, 1),
        (0.5 - least, 0),
        (-0.5, 0),
        (-0.5 - least, -1),
        (1.5, 2),
        (-1.5, -1),
    ):
        await encoder.at(target)
        await encoder.clk(6)
        assert encoder.position == settled, target


@cocotb.test()
async def edges_keep_their_separation_while_a_jump_is_caught_up_with_and_none_is_lost(dut):
    encoder = await Encoder(dut).reset()
    for minimum_edge_separation in (0, 1, 2, 5, 17):
        await encoder.at(0, minimum_edge_separation=minimum_edge_separation)
        await encoder.clk(40 * max(1, minimum_edge_separation))
        for jump in (12, -11, 0):
            await encoder.at(jump)
            times, before = [], encoder.position
            for n in range(26 * max(1, minimum_edge_separation)):
                was = encoder.position
                await encoder.clk()
                if encoder.position != was:
                    times.append(n)
            assert encoder.position == jump and len(times) == abs(jump - before)
            assert all(
                later - earlier == max(1, minimum_edge_separation)
                for earlier, later in zip(times, times[1:])
            )


@cocotb.test()
async def a_target_that_trembles_within_the_hysteresis_makes_no_edge_but_the_first(dut):
    encoder = await Encoder(dut).reset()
    quarter = 1 << encoder.f - 2
    for hysteresis, expected in ((0, 10), (quarter, 1)):
        await encoder.at(0, hysteresis=hysteresis)
        await encoder.clk(10)
        edges = 0
        for n in range(10):
            was = encoder.position
            await encoder.at(0.75 if n % 2 == 0 else 0.25)
            await encoder.clk(4)
            edges += encoder.position != was
        assert edges == expected


@cocotb.test()
async def hysteresis_holds_to_its_last_bit_at_both_ends(dut):
    encoder = await Encoder(dut).reset()
    one = 1 << encoder.f
    for hysteresis in (0, 1, one // 2, one - 1):
        for sign in (1, -1):
            await encoder.clk(8, target=0, hysteresis=0)
            edge = one // 2 + hysteresis
            inside = edge - 1 if sign > 0 else -edge
            await encoder.clk(6, target=inside, hysteresis=hysteresis)
            assert encoder.position == 0
            await encoder.clk(6, target=inside + sign)
            assert encoder.position == sign


@cocotb.test()
async def z_is_high_for_one_count_once_a_turn_in_both_directions(dut):
    encoder = await Encoder(dut).reset(counts_per_turn=10)
    for _ in range(14):
        assert (await encoder.clk())[2] == 0  # never before home
    await encoder.at(0, home=1, home_position=3)
    await encoder.clk(4)
    for goal in (24, -19):
        await encoder.at(goal)
        for _ in range(60):
            z = (await encoder.clk())[2]
            assert z == ((encoder.position - 3) % 10 == 0)
        assert encoder.position == goal


@cocotb.test()
async def every_bit_of_a_turn_counts(dut):
    encoder = await Encoder(dut).reset()
    whole = 1 << encoder.w
    turns = [(1 << bit) + more for bit in range(2, encoder.w - 1) for more in (0, 1)]
    for turn in turns + [random.randrange(4, whole // 2) for _ in range(32)]:
        mark = random.randrange(4 - whole // 2, whole // 2 - 4)
        for at, all_steps in (
            (mark - 2, (2, -1, 2, -2)),
            (mark + 1 - turn, (-1, 1, -1, -2)),  # above the mark before
        ):
            await encoder.at(at, load=1, home_position=at % whole, counts_per_turn=turn)
            await encoder.clk(2)
            await encoder.clk(3, home=1, home_position=mark % whole)
            for steps in all_steps:
                at += steps
                await encoder.at(at)
                pins = await encoder.clk(5)
                assert pins[2] == ((at - mark) % turn == 0), (turn, mark, at)


@cocotb.test()
async def every_bit_of_the_distance_and_the_position_counts(dut):
    encoder = await Encoder(dut).reset()
    whole = 1 << encoder.w
    for bit in range(encoder.w - 1):
        for begin, goal in (
            (0, 1 + (1 << bit)),
            (0, -1 << bit),
            ((1 << bit) - 1, 1 << bit),
            (1 << bit, (1 << bit) - 1),
        ):
            await encoder.clk(load=1, home_position=begin % whole)
            await encoder.at(goal)
            await encoder.clk(8)
            assert encoder.position == begin + max(-8, min(8, goal - begin))


@cocotb.test()
async def every_bit_of_the_separation_counts(dut):
    for bit in range(2, 16):
        for more in (0, 2):
            encoder = await Encoder(dut).reset(minimum_edge_separation=(1 << bit) + more)
            await encoder.at(9)
            await encoder.clk(4)
            assert encoder.position == 1  # the next edge is allowed later


@cocotb.test()
async def z_stays_low_without_counts_per_turn(dut):
    encoder = await Encoder(dut).reset()
    await encoder.clk(home=1, home_position=0)
    assert {(await encoder.clk())[2] for _ in range(10)} == {0}


@cocotb.test()
async def home_waits_for_a_cycle_without_an_edge(dut):
    encoder = await Encoder(dut).reset(counts_per_turn=100)
    await encoder.at(20)
    await encoder.clk(3)
    await encoder.clk(home=1, home_position=1)
    await encoder.clk(30)
    assert encoder.position == 20 and encoder.model.from_mark == 19


@cocotb.test()
async def it_follows_across_the_wrap_of_position(dut):
    encoder = await Encoder(dut).reset()
    low = -(1 << encoder.w - 1)
    await encoder.clk(load=1, home_position=(low + 1) % (1 << encoder.w))
    await encoder.at(low - 3)
    await encoder.clk(10)
    assert encoder.model.position == (low - 3) % (1 << encoder.w)
    await encoder.at(low + 2)
    await encoder.clk(10)
    assert encoder.position == low + 2


@cocotb.test()
async def behind_reports_more_than_4_counts_2_cycles_later(dut):
    encoder = await Encoder(dut).reset(minimum_edge_separation=3)
    for goal in (9, -8):
        await encoder.at(goal)
        far, late = [], []
        for _ in range(60):
            far.append(abs(goal - encoder.position) > 4)
            await encoder.clk()
            late.append(encoder.model.behind)
        assert any(late) and not late[-1]
        assert late[2:] == far[1:-1]


@cocotb.test()
async def reset_in_motion_clears_the_pins(dut):
    encoder = await Encoder(dut).reset(minimum_edge_separation=3, counts_per_turn=7)
    await encoder.at(50, home=1, home_position=2)
    for wait in range(1, 8):
        await encoder.clk(wait)
        assert await encoder.clk(rst=1, target=0) == (0, 0, 0)
        await encoder.at(50)


@cocotb.test()
async def any_target_matches_the_model(dut):
    encoder = await Encoder(dut).reset()
    target, width = 0, encoder.w + encoder.f
    for n in range(8000):
        inputs = {}
        kind = random.randrange(200)
        if kind < 100:
            target += random.randrange(-1 << encoder.f, (1 << encoder.f) + 1)
        elif kind == 100:
            target = random.getrandbits(width)
        elif kind == 101:
            inputs["minimum_edge_separation"] = random.choice((0, 1, 1, 2, 3, 9))
        elif kind == 102:
            inputs["hysteresis"] = random.getrandbits(encoder.f)
        elif kind == 103:
            inputs["counts_per_turn"] = random.choice((0, 4, 12, 100))
        elif kind == 104:
            near = encoder.model.position + random.randrange(-3, 4)
            inputs.update(home=1, home_position=near % (1 << encoder.w))
        elif kind == 105 and n % 3 == 0:
            inputs.update(load=1, home_position=random.getrandbits(encoder.w))
        await encoder.clk(
            target=signed(target, width), rst=int(kind == 199 and n % 4 == 0), **inputs
        )


@pytest.mark.parametrize("w, f", [(32, 16), (8, 4)])
def test_quadrature_encoder(w, f):
    run("quadrature_encoder", __file__, W=w, F=f)
