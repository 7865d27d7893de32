# SPDX-License-Identifier: Apache-2.0
"""Tests of velocity_estimator: by hand, both ends, shifts, a sweep of speeds, resolution, and every
cycle against the model.
"""

import math
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.position.velocity_estimator import VelocityEstimator

X4 = 1 << 14  # quantum of a plain scale
IDLE = dict(quantum=X4, tick=0, position=0, shift=0, shift_periods=0)
LATENCY = 5


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)


async def again(dut):
    """Reset while the clock runs."""
    dut.rst.value = 1
    await FallingEdge(dut.clk)
    dut.rst.value = 0


async def clock(dut, position, tick=0, shift=0, shift_periods=0, quantum=0):
    dut.tick.value, dut.position.value, dut.shift.value, dut.shift_periods.value = (
        tick,
        position,
        shift,
        shift_periods,
    )
    dut.quantum.value = quantum
    await FallingEdge(dut.clk)
    return dut.velocity.value.to_signed()


async def ticks(dut, positions, quantum=0):
    """Send a tick at each position; returns the last velocity."""
    for position in positions:
        await clock(dut, position, 1, quantum=quantum)
        for _ in range(LATENCY):
            velocity = await clock(dut, position, quantum=quantum)
    return velocity


@cocotb.test()
async def latency_is_5(dut):
    await begin(dut)
    await clock(dut, 100, 1)
    for _ in range(20):
        await clock(dut, 103)
    dut.tick.value, seen = 1, []
    for _ in range(LATENCY):
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        dut.tick.value = 0
        seen.append(dut.velocity.value.to_signed())
    assert seen == [0] * (LATENCY - 1) + [3]


@cocotb.test()
async def with_quantum_0_the_velocity_is_the_distance_of_the_tick(dut):
    await begin(dut)
    seen = [await ticks(dut, [p]) for p in (1000, 1004, 1004, 900, 70_000, 69_999)]
    assert seen == [0, 4, 0, -104, 69_100, -1]


@cocotb.test()
async def with_a_tick_in_every_cycle_the_velocity_is_the_distance_of_a_cycle(dut):
    await begin(dut)
    where = [n * n for n in range(20)]
    seen = [await clock(dut, p, 1) for p in where]
    assert seen[LATENCY:] == [b - a for a, b in zip(where, where[1:])][: 20 - LATENCY]


@cocotb.test()
async def a_shift_leaves_no_trace(dut):
    await begin(dut)
    await ticks(dut, [1000])
    assert await ticks(dut, [1010]) == 10
    await clock(dut, 1015, 0, 1, -7)  # between ticks
    assert await ticks(dut, [1020 - (7 << 16)]) == 10
    await clock(
        dut, 1030 - (7 << 16), 1, 1, 100_000
    )  # the cycle of a tick still uses the old origin
    here = 1030 + (99_993 << 16)
    assert [await clock(dut, here) for _ in range(LATENCY)][-1] == 10
    assert await ticks(dut, [here + 10]) == 10


@cocotb.test()
async def the_velocity_saturates_at_both_ends(dut):
    await begin(dut)
    end = 1 << 31
    for far, want in (
        (end - 1, end - 1),
        (end, end - 1),
        (2 * end - 1, end - 1),
        (-end, -end),
        (-end - 1, -end),
        (1 - 2 * end, -end),
    ):
        assert await ticks(dut, [0, far]) == want
        await ticks(dut, [0])


@cocotb.test()
async def the_wrap_of_the_position_is_no_velocity(dut):
    await begin(dut)
    assert await ticks(dut, [(1 << 47) - 1, -1 << 47]) == 1
    assert await ticks(dut, [(1 << 47) - 3]) == -3


@cocotb.test()
async def one_edge_in_five_ticks_gives_a_fifth_of_a_quantum_by_hand(dut):
    await begin(dut)
    period, seen = 100, []
    for cycle in range(0, 4000):
        velocity = await clock(dut, cycle // 500 * X4, cycle % period == 0, quantum=X4)
        if cycle > 1500 and cycle % period == 99:
            seen.append((velocity, dut.fine.value.to_signed()))
    ((velocity, fine),) = set(seen)
    assert (
        velocity == round(X4 / 5) and abs(fine / 256 - X4 / 5) < X4 * 2**-19
    )  # 3276.8: fine holds the fraction


@cocotb.test()
async def an_edge_that_trembles_has_no_velocity(dut):
    await begin(dut)
    seen = []
    for cycle in range(3000):
        position = X4 * (
            7 + (cycle // 13 + cycle // 101) % 2
        )  # to and fro over one edge of the scale
        seen.append(await clock(dut, position, cycle % 97 == 0, quantum=X4))
    assert set(seen[300:]) == {0}
    assert max(map(abs, seen)) <= X4


@cocotb.test()
async def after_a_stop_the_velocity_falls_as_one_over_the_time_to_0(dut):
    await begin(dut)
    position, seen, longest = 0, [], (1 << int(dut.TIME_W.value)) - 1
    for cycle in range(4000):
        if cycle < 1500:
            position = cycle // 50 * X4
        velocity = await clock(dut, position, cycle % 100 == 0, quantum=X4)
        if cycle % 100 == 50:
            seen.append(velocity)
    assert seen[10] == 2 * X4
    for n, velocity in enumerate(seen[17:], 2):  # n ticks or more since the last edge
        assert velocity <= X4 // (n - 1)
        assert velocity > X4 // (n + 2) or n * 100 > longest - 200
    assert (seen[-1] == 0) == (longest < 2000)


@cocotb.test()
async def latency_is_24_to_50_from_the_step_that_is_used_to_its_tick(dut):
    await begin(dut)
    for age in (23, 24, 49, 50):
        taken = set()
        for late in range(0, 24, 5):  # relative to the divisions, one every 24 cycles
            await again(dut)
            # two edges, the second one `age` cycles before the tick
            for cycle in range(820 + late):
                position = X4 * ((cycle >= 100) + (cycle >= 800 + late - age))
                velocity = await clock(dut, position, cycle in (400 + late, 800 + late), quantum=X4)
            taken.add(velocity > 0)
        assert taken == {True} if age >= 50 else taken == {False} if age < 24 else True


def ride(speed, period, count, quantum=X4, backwards=False):
    """(speed, velocity / quantum) at each tick of the model on a scale with this speed(cycle), in
    quanta per tick.
    """
    model, where, out = VelocityEstimator(), 0.5, []
    for cycle in range(period * count):
        where += (-speed(cycle) if backwards else speed(cycle)) / period
        _, fine = model.step(quantum, cycle % period == 0, math.floor(where) * quantum, 0, 0)
        if cycle % period == LATENCY:
            out.append((speed(cycle), (-fine if backwards else fine) / 256 / quantum))
    return out


@pytest.mark.parametrize("backwards", [False, True])
def test_at_constant_speed_the_error_is_below_2_cycles_of_a_tick(backwards):
    period = 500
    for speed in (0.04, 0.37, 0.77, 0.99, 1, 1.01, 1.99, 2, 2.5, 7.3, 50.1):
        for true, got in ride(
            lambda cycle, speed=speed: speed, period, int(10 + 3 / speed), backwards=backwards
        )[int(4 + 2 / speed) :]:
            assert abs(got - true) <= 2 / period * true + 2**-17


@pytest.mark.parametrize("backwards", [False, True])
def test_no_speed_has_a_step_where_time_stamps_and_differences_meet(backwards):
    count, period, slow, fast = 200, 400, 0.1, 10
    growth = math.log(fast / slow) / count  # of the speed, per tick
    seen = ride(
        lambda cycle: slow * math.exp(growth * cycle / period), period, count, backwards=backwards
    )[30:]
    for (_, before), (true, now) in zip(seen, seen[1:]):
        assert -4 / period * true <= now - before
        assert (
            now - before <= (growth * (2 + 1 / true) + 4 / period) * true
        )  # increase of the speed from edge to edge


def test_a_fraction_of_a_unit_per_tick_is_resolved():
    for speed in (0.15, 1.4):
        for true, got in ride(
            lambda cycle, speed=speed: speed, 500, int(10 + 4 / speed), quantum=1
        )[int(5 + 3 / speed) :]:
            assert abs(got - true) <= 2 / 500 * true + 1 / 256


@cocotb.test()
async def a_ramp_from_low_to_high_speed_matches_the_model(dut):
    await begin(dut)
    model, period, where = VelocityEstimator(int(dut.TIME_W.value)), 150, 0.5
    for cycle in range(9_000):
        where += (cycle / 9_000) ** 2 * 4 / period  # up to four quanta per tick
        position, tick = int(where) * X4, int(cycle % period == 0)
        got = await clock(dut, position, tick, quantum=X4)
        assert (got, dut.fine.value.to_signed()) == model.step(X4, tick, position, 0, 0), (
            f"cycle {cycle}"
        )


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    await begin(dut)
    time_w = int(dut.TIME_W.value)
    model, position, lively, tick_share, quantum = VelocityEstimator(time_w), 0, 0.5, 0.1, X4
    await again(dut)
    for cycle in range(12_000):
        if cycle % 500 == 0:
            lively, tick_share = (
                random.choice((0, 0.003, 0.05, 0.5, 1)),
                random.choice((0.0, 0.004, 0.02, 0.3)),
            )
            quantum = random.choice((0, 1, 128, X4, 65535))
        rst, tick, shift = (int(random.random() < share) for share in (0.001, tick_share, 0.02))
        if random.random() < lively:
            position += random.choice(
                (
                    quantum,
                    -quantum,
                    3 * quantum,
                    random.randrange(-99, 99),
                    random.randrange(-1 << 34, 1 << 34) if random.random() < 0.02 else 0,
                )
            )
        position = (position + (1 << 47)) % (1 << 48) - (1 << 47)
        periods = random.randrange(-1 << 31, 1 << 31)
        dut.rst.value = rst
        got = await clock(dut, position, tick, shift, periods, quantum), dut.fine.value.to_signed()
        want = model.step(quantum, tick, position, shift, periods)
        if rst:
            model, want, shift = VelocityEstimator(time_w), (0, 0), 0
        assert got == want, f"cycle {cycle}"
        position = (position + (shift * periods << 16) + (1 << 47)) % (1 << 48) - (1 << 47)


@pytest.mark.parametrize("time_w", [24, 10])
def test_velocity_estimator(time_w):
    run("velocity_estimator", __file__, TIME_W=time_w)
