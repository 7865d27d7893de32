# SPDX-License-Identifier: Apache-2.0
"""leg_monitor: each verdict at its limit and one short of it, both ends of every range, and the model sample by sample."""
import random

import cocotb
import numpy as np
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.leg_monitor import NEVER, LegMonitor

OFF = {"rail": NEVER, "band": 0, "span": NEVER, "quiet": 0, "dead": NEVER}
OUTPUTS = ("at_rail", "frozen", "silent", "opposed", "level_stuck", "leg_missing")


async def begin(dut, **settings):
    settings = OFF | settings
    await start(dut, valid=0, leg=0, other=0, level=0, other_level=0, **settings)
    model = LegMonitor()
    model.settings = settings
    return model


async def sample(dut, model, leg, other=0, level=0, other_level=0, gap=0):
    """One sample, 1 clk later its flags as the model has them; then some clk without one. Returns the names that stand."""
    dut.valid.value, dut.leg.value, dut.other.value, dut.level.value, dut.other_level.value = 1, leg, other, level, other_level
    want = tuple(int(x[0]) for x in model.sample(*(np.array([x]) for x in (leg, other, level, other_level)), **model.settings))
    for n in range(1 + gap):
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        dut.valid.value, dut.leg.value, dut.level.value = 0, random.getrandbits(6), random.getrandbits(1)
        got = tuple(int(getattr(dut, name).value) for name in OUTPUTS)
        assert got == want, f"clk {n} after leg {leg}, other {other}, levels {level}{other_level}: {OUTPUTS} are {got}, not {want}"
    return [name for name, stands in zip(OUTPUTS, want) if stands]


async def rows(dut, model, *samples):
    return [await sample(dut, model, *s, gap=random.choice([0, 0, 2])) for s in samples]


@cocotb.test()
async def a_code_beyond_the_rail_is_told_at_once_latency_is_1(dut):
    low = -(1 << int(dut.W.value) - 1)
    model = await begin(dut, rail=-low - 2)
    told = await rows(dut, model, (-low - 2,), (-low - 1,), (low + 2,), (low + 1,), (low,), (0,))
    assert told == [[], ["at_rail"], [], ["at_rail"], ["at_rail"], []]


@cocotb.test()
async def a_leg_that_stands_while_the_other_moves_is_frozen_from_the_fourth_sample(dut):
    model = await begin(dut, band=2, span=50)
    told = await rows(dut, model, (10, 0), (12, 60), (8, 60), (10, 60), (10, 0), (13, 0), (13, 50), (13, -50), (13, 51), (13, 51))
    assert told == [[], [], [], ["frozen"], ["frozen"], [], [], [], [], ["frozen"]]


@cocotb.test()
async def the_other_leg_must_be_far_away_twice_within_four_samples(dut):
    model = await begin(dut, band=2, span=50)
    told = await rows(dut, model, *[(10, 0)] * 5, (10, 60), *[(10, 0)] * 3, (10, 60), *[(10, 0)] * 2, (10, 60))
    assert told == [[]] * 12 + [["frozen"]]


@cocotb.test()
async def a_leg_at_its_turning_point_is_not_frozen(dut):
    model = await begin(dut, band=3, span=80)
    for degrees in np.arange(0, 720, 0.5):
        cos, sin = 100 * np.cos(np.radians(degrees)), 100 * np.sin(np.radians(degrees))
        assert not await sample(dut, model, round(cos), round(sin))


@cocotb.test()
async def the_same_code_for_quiet_samples_is_silent_until_it_changes(dut):
    model = await begin(dut, quiet=5)
    told = await rows(dut, model, *[(7,)] * 7, (8,), *[(8,)] * 4, (7,))
    assert told == [[]] * 5 + [["silent"]] * 2 + [[]] * 6


@cocotb.test()
async def a_signal_without_noise_is_good_while_quiet_is_0(dut):
    model = await begin(dut, rail=100, band=2, span=50, dead=20)
    for _ in range(300):
        assert not await sample(dut, model, 71, 71, 1, 1)


@cocotb.test()
async def a_comparator_a_sample_early_or_late_is_good(dut):
    legs = [95, 59, 0, -59, -95, -95, -59, 0, 59, 95] * 4
    for shift in (-1, 0, 1):
        model = await begin(dut, dead=20)
        levels = [int(leg > 0 or (leg == 0 and before < 0)) for leg, before in zip(legs, legs[-1:] + legs)]
        levels = levels[-shift:] + levels[:-shift]
        others = [int(1 <= (n - shift) % 10 <= 5) for n in range(len(legs))]
        assert not any(await rows(dut, model, *[(leg, 0, a, b) for leg, a, b in zip(legs, levels, others)]))


@cocotb.test()
async def three_sure_samples_against_the_comparator_are_opposed(dut):
    model = await begin(dut, dead=20)
    told = await rows(dut, model, (21, 0, 0), (21, 0, 0), (21, 0, 0), (20, 0, 0), (21, 0, 0), (21, 0, 1), (21, 0, 0), (-21, 0, 0),
                      (-21, 0, 1), (-21, 0, 1))
    assert told == [[], [], ["opposed"], [], [], [], [], [], [], ["opposed"]]


@cocotb.test()
async def a_comparator_that_stands_through_three_changes_of_sign_is_stuck(dut):
    model = await begin(dut, dead=20)
    told = await rows(dut, model, (50,), (-50,), (50,), (0,), (10,), (-21,), (0, 0, 1), (50, 0, 1))
    assert told == [[], [], [], [], [], ["level_stuck"], [], []]


@cocotb.test()
async def comparators_that_go_on_without_the_leg_tell_it_missing(dut):
    model = await begin(dut, dead=20)
    turn = [(0, 1), (1, 1), (1, 0), (0, 0)]                        # (other level, level), a quarter period each
    told = await rows(dut, model, (50, 0, 1, 0), *[(50, 0, level, other) for other, level in turn * 3])
    assert "leg_missing" in told[-1] and "leg_missing" not in sum(told[:7], [])
    assert "leg_missing" not in (await rows(dut, model, (-50, 0, 0, 0)))[0]


@cocotb.test()
async def a_comparator_that_chatters_about_zero_tells_nothing(dut):
    model = await begin(dut, dead=20)
    assert not any(await rows(dut, model, (50, 0, 1, 1), *[(random.randrange(-20, 21), 90, n % 2, 1) for n in range(60)]))


@cocotb.test()
async def reset_forgets_all(dut):
    settings = {"rail": 10, "band": 2, "span": 10, "quiet": 2, "dead": 5}
    model = await begin(dut, **settings)
    told = await rows(dut, model, *[(11, 30 * n, 0) for n in range(5)])
    assert told[-1] == ["at_rail", "frozen", "silent", "opposed"]
    model = await begin(dut, **settings)
    assert await rows(dut, model, (11, 150, 0), (11, 180, 0)) == [["at_rail"]] * 2


@cocotb.test()
async def any_samples_match_the_model(dut):
    top = (1 << int(dut.W.value) - 1) - 1
    for _ in range(12):
        model = await begin(dut, rail=random.choice([top - 1, top, 0, NEVER]), band=random.choice([0, 2, 255]),
                            span=random.choice([0, top // 2, top, NEVER]), quiet=random.choice([0, 1, 4, 65535]),
                            dead=random.choice([0, top // 5, top, NEVER]))
        angle, speed, size = 0.0, random.choice([0.01, 0.1, 0.7, 1.5]), random.choice([2, top // 2, top, 2 * top])
        legs, levels = [0, 0], [0, 0]
        for _ in range(150):
            angle += speed * random.choice([1, 1, 1, 1, 1, -1])
            if random.random() < 0.9:
                legs = [round(min(top, max(-top - 1, size * f(angle) + random.gauss(0, 0.7)))) for f in (np.cos, np.sin)]
            levels = [int(leg > 0) if random.random() < 0.8 else level for leg, level in zip(legs, levels)]
            await sample(dut, model, *legs, *levels, gap=random.choice([0, 0, 0, 1]))


@pytest.mark.parametrize("w", [8, 16])
def test_leg_monitor(w):
    run("leg_monitor", __file__, W=w)
