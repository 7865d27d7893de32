# SPDX-License-Identifier: Apache-2.0
"""The clock of a node as the driver follows it, and the motion through commanded positions."""

import ctypes
import math
import random

import pytest

from tb.bench import seed
from tb.linuxcnc.compiled import Clock, Motion, driver

CLK_HZ, TICK, PERIOD_S = 60e6, 15_000, 1e-3
CYCLES = CLK_HZ * PERIOD_S
WORD = 1 << 32


def followed(periods, drift=0.0, jitter_s=0.0, lost=0.0, start=WORD - 5_000_000):
    """A clock that has followed a node for some periods, and the true time of the node."""
    dice, clock, true = random.Random(seed()), Clock(), float(start)
    doubles = (ctypes.c_double(value) for value in (PERIOD_S, CLK_HZ, TICK))
    driver().node_clock_start(ctypes.byref(clock), *doubles)
    errors = []
    for _ in range(periods):
        driver().node_clock_step(ctypes.byref(clock))
        true += CYCLES * (1 + drift)
        if dice.random() >= lost:
            late = dice.uniform(0, jitter_s) * CLK_HZ
            time = int(true + late) % WORD
            driver().node_clock_take(
                ctypes.byref(clock), time, int((true + late) / TICK) % WORD, time
            )
            errors.append((clock.now - clock.base) - (true - start))
    return clock, errors


def test_it_finds_the_difference_of_the_clocks():
    clock, errors = followed(5000, drift=80e-6)
    assert driver().node_clock_drift(ctypes.byref(clock)) == pytest.approx(80, abs=1)
    assert max(errors[-100:]) - min(errors[-100:]) < 10


def test_it_takes_jitter_and_loss_out_of_the_time():
    _, errors = followed(8000, drift=-40e-6, jitter_s=300e-6, lost=0.01)
    late = errors[2000:]
    mean = sum(late) / len(late)
    assert max(abs(error - mean) for error in late) < 0.15 * 300e-6 * CLK_HZ


def test_its_ticks_are_those_of_the_node_over_a_wrap_of_the_time():
    clock, _ = followed(200)
    base = clock.base_tick
    tick = driver().node_clock_tick(ctypes.byref(clock), ctypes.c_double(TICK * 4.0))
    assert tick == pytest.approx(base + 199 * CYCLES / TICK + 4, abs=0.01)


def test_a_node_that_was_restarted_is_followed_from_its_new_time():
    clock, _ = followed(100)
    driver().node_clock_step(ctypes.byref(clock))
    driver().node_clock_take(ctypes.byref(clock), 10**9, 3, 10**9)
    assert (clock.now, clock.base_tick, clock.step) == (10**9, 3, CYCLES)


def test_a_tick_that_was_read_before_the_request_belongs_to_the_time_of_its_reading():
    for time in (10**9, 2 * TICK):  # the time wraps between reading and request
        clock, _ = followed(100, start=5 * 10**8)
        driver().node_clock_step(ctypes.byref(clock))
        driver().node_clock_take(ctypes.byref(clock), time, 40, (time - 3 * TICK) % WORD)
        assert clock.now == time
        assert driver().node_clock_tick(ctypes.byref(clock), ctypes.c_double(0)) == 43


def test_a_parabola_is_met_exactly_at_any_time_between():
    def position(t):
        return 3 + 20 * t - 400 * t * t

    at = (ctypes.c_double * 3)(*(position(n * PERIOD_S) for n in (-1, 0, 1)))
    motion = driver().motion_through(at, ctypes.c_double(PERIOD_S))
    assert motion.velocity == pytest.approx(20) and motion.acceleration == pytest.approx(-800)
    for part in (-1, -0.25, 0, 0.7):
        after = driver().motion_after(motion, ctypes.c_double(part * PERIOD_S))
        assert isinstance(after, Motion)
        assert after.position == pytest.approx(position(part * PERIOD_S), abs=1e-12)
        assert math.isclose(after.velocity, 20 - 800 * part * PERIOD_S)
