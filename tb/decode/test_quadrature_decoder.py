# SPDX-License-Identifier: Apache-2.0
"""Tests of quadrature_decoder: a known turn in each mode, the jitter of S0, the wrap, the illegal
edge, clearing, start-up, and random levels against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge

from tb.bench import run, start
from tb.decode.quadrature_decoder import PULSES, X1, X2, X4, QuadratureDecoder

TURN = [(0, 0), (1, 0), (1, 1), (0, 1)]  # a leads b: up


async def begin(dut, a=0, b=0, mode=X4, ready=True):
    """Reset with the pins at these levels; the model has seen the same cycle."""
    await start(dut, a=a, b=b, mode=mode, clear=0)
    model = QuadratureDecoder(int(dut.W.value), int(dut.SETTLE.value))
    model.mode = mode
    model.step(a, b, mode, 0, 1)
    if ready:
        await drive(dut, model, [(a, b)] * int(dut.SETTLE.value))
    return model


async def drive(dut, model, levels, rst=0, clear=0):
    """Apply each (a, b) for one cycle and compare design and model; return (count, step, illegal)
    of each cycle.
    """
    out = []
    dut.rst.value, dut.clear.value, dut.mode.value = rst, clear, model.mode
    for cycle, (a, b) in enumerate(levels):
        dut.a.value, dut.b.value = a, b
        await ReadOnly()
        direction, moves, _ = model.classify(a, b, model.mode)
        assert (int(dut.direction.value), int(dut.stepping.value), int(dut.ready.value)) == (
            direction,
            abs(moves),
            model.ready,
        )
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        want = model.step(a, b, model.mode, clear, rst)
        got = dut.count.value.to_signed(), dut.step.value.to_signed(), int(dut.illegal.value)
        assert got == want, (
            f"cycle {cycle}, mode {model.mode}: (count, step, illegal) is {got}, "
            f"the model has {want}"
        )
        out.append(got)
    dut.rst.value, dut.clear.value = 0, 0
    return out


async def turn(dut, model, positions):
    """Visit these quarters of the period; the count after each."""
    return [
        count
        for count, _, _ in await drive(dut, model, [TURN[position % 4] for position in positions])
    ]


@cocotb.test()
async def latency_is_1(dut):
    model = await begin(dut)
    assert await drive(dut, model, [(1, 0), (1, 0)]) == [(1, 1, 0), (1, 0, 0)]


@cocotb.test()
async def one_turn_is_four_counts(dut):
    model = await begin(dut)
    assert [count for count, _, _ in await drive(dut, model, TURN[1:] + TURN[:1])] == [1, 2, 3, 4]
    assert [count for count, _, _ in await drive(dut, model, TURN[::-1])] == [3, 2, 1, 0]


@cocotb.test()
async def s0_up_is_a_rising_while_b_is_low_and_down_while_b_is_high(dut):
    model = await begin(dut)
    assert (await drive(dut, model, [(1, 0)]))[-1] == (1, 1, 0)
    await drive(dut, model, [(1, 1), (0, 1)])
    assert (await drive(dut, model, [(1, 1)]))[-1] == (2, -1, 0)


@cocotb.test()
async def s0_jitter_reversal_over_falling_edge_c_leaves_no_count_too_many(dut):
    model = await begin(dut)
    before, _, _ = (await drive(dut, model, [(1, 0), (1, 1)]))[-1]
    for _ in range(5):  # past C (a falls, b high) and back over it
        out = await drive(dut, model, [(0, 1), (1, 1)])
        assert out == [(before + 1, 1, 0), (before, -1, 0)]
    assert (await drive(dut, model, [(1, 0), (0, 0)]))[-1][0] == 0


@cocotb.test()
async def s0_jitter_reversal_over_rising_edge_b_is_not_half_a_pulse_off(dut):
    model = await begin(dut)
    for _ in range(5):  # past B (a rises, b low) and back over it
        assert await drive(dut, model, [(1, 0), (0, 0)]) == [(1, 1, 0), (0, -1, 0)]
    assert (await drive(dut, model, TURN[1:] + TURN[:1]))[-1][0] == 4


@cocotb.test()
async def x2_counts_the_edges_of_a_and_x1_those_with_b_low(dut):
    model = await begin(dut, mode=X2)
    assert await turn(dut, model, range(1, 9)) == [1, 1, 2, 2, 3, 3, 4, 4]
    assert await turn(dut, model, range(7, -1, -1)) == [4, 3, 3, 2, 2, 1, 1, 0]
    model = await begin(dut, mode=X1)
    assert await turn(dut, model, range(1, 9)) == [1, 1, 1, 1, 2, 2, 2, 2]
    assert await turn(dut, model, range(7, -1, -1)) == [2, 2, 2, 1, 1, 1, 1, 0]


@cocotb.test()
async def s0_jitter_over_any_edge_leaves_no_trace_in_x4_x2_and_x1(dut):
    for mode in (X4, X2, X1):
        for before in range(4):  # S0's edge B follows quarter 0, its edge C follows quarter 2
            model = await begin(dut, *TURN[before], mode=mode)
            (there,) = await turn(dut, model, [before + 1])
            for _ in range(3):
                assert await turn(dut, model, [before, before + 1]) == [0, there]
            assert (await turn(dut, model, [before]))[-1] == 0
            assert (await turn(dut, model, range(before + 1, before + 5)))[-1] == 4 >> mode


@cocotb.test()
async def pulses_count_where_a_rises_by_the_level_of_b(dut):
    model = await begin(dut, mode=PULSES)
    assert await drive(dut, model, [(1, 0), (0, 0), (1, 0), (0, 0)]) == [
        (1, 1, 0),
        (1, 0, 0),
        (2, 1, 0),
        (2, 0, 0),
    ]
    assert await drive(dut, model, [(0, 1), (1, 1), (1, 0), (0, 1)]) == [
        (2, 0, 0),
        (1, -1, 0),
        (1, 0, 0),
        (1, 0, 0),
    ]


@cocotb.test()
async def a_pulse_whose_direction_changes_with_it_is_illegal_and_not_counted(dut):
    model = await begin(dut, mode=PULSES)
    assert await drive(dut, model, [(1, 1), (0, 0), (0, 1), (1, 0)]) == [
        (0, 0, 1),
        (0, 0, 0),
        (0, 0, 0),
        (0, 0, 1),
    ]


@cocotb.test()
async def clear_makes_the_state_at_the_end_of_its_cycle_zero(dut):
    for here, then in ((1, 2), (2, 1), (1, 1)):
        model = await begin(dut)
        await turn(dut, model, [1, 2] if here == 2 else [1])
        assert await drive(dut, model, [TURN[then]], clear=1) == [(0, then - here, 0)]
        assert (await turn(dut, model, [then + 1, then + 2, then + 1])) == [1, 2, 1]


@cocotb.test()
async def a_change_of_mode_makes_no_count(dut):
    model = await begin(dut)
    await turn(dut, model, range(1, 7))
    for mode in (X2, X1, PULSES, X4):
        model.mode = mode
        assert await turn(dut, model, [6] * 3) == [6] * 3


@cocotb.test()
async def power_up_at_any_levels_makes_no_count(dut):
    for a, b in TURN:
        model = await begin(dut, a, b, ready=False)
        assert await drive(dut, model, [(a, b)] * 20) == [(0, 0, 0)] * 20


@cocotb.test()
async def levels_that_arrive_late_after_reset_make_no_count(dut):
    model = await begin(dut, 0, 0, ready=False)
    late = int(dut.SETTLE.value) - 1  # the blocks before the decoder start up meanwhile
    assert await drive(dut, model, [(0, 0)] * late + [(1, 1)] * 9) == [(0, 0, 0)] * (late + 9)
    assert (await drive(dut, model, [(0, 1)]))[-1] == (1, 1, 0)


@cocotb.test()
async def illegal_edges_are_reported_and_never_count(dut):
    model = await begin(dut)
    for a, b in [(0, 0), (1, 1), (0, 0), (1, 1)] * 5:
        ((count, step, _),) = await drive(dut, model, [(a, b)])
        assert (count, step) == (0, 0)
    assert (await drive(dut, model, [(0, 0)]))[-1] == (0, 0, 1)
    await drive(dut, model, [(1, 0)])
    assert (await drive(dut, model, [(0, 1)]))[-1] == (1, 0, 1)
    assert (await drive(dut, model, [(0, 0)]))[-1] == (
        2,
        1,
        0,
    )  # the new levels become the present state


@cocotb.test()
async def count_wraps_and_comes_back(dut):
    model = await begin(dut)
    there = TURN * (1 << min(int(dut.W.value), 8))
    await drive(dut, model, there)
    assert (await drive(dut, model, there[::-1]))[-1][0] == 0


@cocotb.test()
async def reset_in_mid_flow_makes_the_present_position_zero(dut):
    model = await begin(dut)
    await drive(dut, model, TURN * 2 + TURN[:3])
    assert await drive(dut, model, [TURN[3]], rst=1) == [(0, 0, 0)]
    await drive(dut, model, [TURN[3]] * int(dut.SETTLE.value))
    assert (await drive(dut, model, [TURN[0]]))[-1] == (1, 1, 0)


@cocotb.test()
async def any_levels_match_the_model(dut):
    model = await begin(dut)
    for _ in range(16):
        model.mode = random.choice([X4, X2, X1, PULSES])
        await drive(
            dut, model, [(random.getrandbits(1), random.getrandbits(1)) for _ in range(150)]
        )
        position, path = 0, []
        for _ in range(150):  # legal edges only, with pauses
            position += random.choice([-1, 0, 0, 1])
            path.append(TURN[position % 4])
        await drive(dut, model, path)
        await drive(dut, model, path[:1], clear=1)
        if random.random() < 0.3:
            await drive(dut, model, path[:1], rst=1)


@pytest.mark.parametrize("w, settle", [(32, 8), (4, 1)])
def test_quadrature_decoder(w, settle):
    run("quadrature_decoder", __file__, W=w, SETTLE=settle)
