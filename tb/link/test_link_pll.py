# SPDX-License-Identifier: Apache-2.0
"""link_pll: the moment of a capture, what locks and what does not, missing arrivals, the even grid
of the captures while the arrivals jitter, a clock that is faster or slower, and noise against the
model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import rtl_only, run, seed, start
from tb.link.link_pll import FULL, GAIN, INTEGRAL, NAMES, PATIENCE, PENALTY, RANGE, LinkPll
from tb.ports import Ports

PERIOD, LEAD = 2048, 400
REGISTERS = ("phase", "trim", "fraction", "score", "missed", "runs", "seen", "error", "locked")


class Bench:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.cycle = dut, LinkPll(), 0
        self.levels = {"enable": 1, "period": PERIOD, "lead": LEAD}
        self.ports, self.captures, self.arrivals = Ports(dut), [], []

    async def clk(self, arrived=0, rst=0, **levels):
        inputs = self.levels | {"arrived": arrived, "rst": rst} | levels
        self.ports.drive(inputs)
        if arrived:
            self.arrivals.append(self.cycle)
        await FallingEdge(self.dut.clk)
        self.cycle += 1
        want = dict(zip(NAMES, self.model.step(**inputs), strict=True))
        self.ports.check(want, self.cycle)
        if want["capture"]:
            self.captures.append(self.cycle)

    async def idle(self, cycles):
        for _ in range(cycles):
            await self.clk()

    async def arrive(self, at):
        """An arrival in the cycle `at`."""
        await self.idle(at - self.cycle)
        await self.clk(arrived=1)

    async def lock(self, periods=FULL + 2, first=100):
        """Arrivals at equal distances, until the PLL has locked; returns the next one's cycle."""
        for n in range(periods):
            await self.arrive(first + n * PERIOD)
        return first + periods * PERIOD


async def begin(dut, **levels):
    bench = Bench(dut)
    bench.levels |= levels
    await start(dut, **bench.levels, arrived=0)
    await FallingEdge(dut.clk)
    await bench.clk(rst=1)
    return bench


@cocotb.test()
async def a_capture_comes_lead_cycles_before_each_expected_arrival_once_locked(dut):
    bench = await begin(dut)
    following = await bench.lock(FULL + 1)
    assert not bench.captures
    for n in range(4):
        await bench.arrive(following + n * PERIOD)
        assert bench.model.error == 0
    assert bench.captures == [at - LEAD for at in bench.arrivals[-4:]]


@cocotb.test()
async def latency_is_1_from_an_arrival_to_its_error(dut):
    bench = await begin(dut)
    following = await bench.lock(3)
    await bench.idle(following + 77 - bench.cycle)
    assert int(dut.error.value) == 0
    await bench.clk(arrived=1)
    assert int(dut.error.value) == 77


@cocotb.test()
async def an_arrival_shifts_the_next_one_by_the_256th_part_of_its_error(dut):
    for parts in (2, -3):
        bench = await begin(dut)
        following = await bench.lock(3)
        await bench.arrive(following + parts * GAIN)
        await bench.arrive(following + PERIOD)
        assert bench.model.error == -parts


@cocotb.test()
async def the_correction_of_the_period_stops_at_both_ends_of_its_range(dut):
    rtl_only("it sets the correction inside, since it takes too long to get there")
    for end, late in ((RANGE * INTEGRAL - 1, 9), (-RANGE * INTEGRAL, -9)):
        bench = await begin(dut)
        await bench.lock(3)
        dut.trim.value = bench.model.trim = end
        while bench.model.phase > 0:
            await bench.clk()
        await bench.idle(late - bench.model.phase)
        await bench.clk(arrived=1)
        assert bench.model.error == late
        await bench.idle(PERIOD)
        assert bench.model.trim == end, "it would have left its range"
        for _ in range(2):  # the errors show the correction of the design
            await bench.clk(arrived=1)
            await bench.idle(PERIOD)


@cocotb.test()
async def missing_arrivals_are_bridged_until_16_in_a_row(dut):
    bench = await begin(dut)
    following = await bench.lock()
    bench.captures.clear()
    await bench.arrive(following + (PATIENCE - 1) * PERIOD)
    due = [following + n * PERIOD - LEAD for n in range(PATIENCE)]
    assert bench.captures == due and bench.model.error == 0
    bench.captures.clear()
    await bench.idle((PATIENCE + 4) * PERIOD)
    assert not int(dut.locked.value) and len(bench.captures) == PATIENCE


@cocotb.test()
async def after_a_loss_it_locks_again_from_scratch(dut):
    bench = await begin(dut)
    await bench.lock()
    await bench.idle((PATIENCE + 2) * PERIOD)
    assert not bench.model.runs
    begun = bench.cycle + 333
    await bench.lock(first=begun)
    assert int(dut.locked.value) and bench.model.error == 0


@cocotb.test()
async def a_second_arrival_in_a_period_is_ignored(dut):
    bench = await begin(dut)
    following = await bench.lock(3)
    await bench.arrive(following)
    await bench.arrive(following + 300)
    assert bench.model.error == 0


@cocotb.test()
async def arrivals_at_any_time_do_not_lock(dut):
    bench, at = await begin(dut), 0
    for _ in range(FULL + 20):
        at += random.randrange(PERIOD // 2, 3 * PERIOD // 2)
        await bench.arrive(at)
    assert not int(dut.locked.value) and not bench.captures


@cocotb.test()
async def without_enable_or_period_nothing_is_captured(dut):
    bench = await begin(dut)
    await bench.lock()
    assert bench.captures
    for off in ({"enable": 0}, {"period": 0}):
        await bench.clk(**off)
        assert not int(dut.locked.value)
        bench.captures.clear()
        bench.levels |= off
        await bench.clk(arrived=1)
        shown = [getattr(dut, name) for name in REGISTERS if hasattr(dut, name)]  # not in a netlist
        before = [int(register.value) for register in shown]
        for _ in range(50):
            await bench.clk()
            assert [int(register.value) for register in shown] == before
        await bench.idle(3 * PERIOD)
        assert not bench.captures
        bench.levels |= {"enable": 1, "period": PERIOD}
        await bench.lock(first=bench.cycle + 5)
        assert bench.captures


@cocotb.test()
async def a_reset_in_mid_flow_unlocks(dut):
    bench = await begin(dut)
    await bench.lock()
    await bench.clk(rst=1)
    assert not int(dut.locked.value)
    await bench.lock(first=bench.cycle + 50)
    assert int(dut.locked.value)


@cocotb.test()
async def the_ends_of_the_ranges_and_noise_match_the_model(dut):
    for period, lead in ((2048, 0), (2049, 768), (2**20 - 1, 0), (2**20 - 1, 3 * 2**17 - 1)):
        bench = await begin(dut, period=period, lead=lead)
        await bench.arrive(5)
        for _ in range(40):
            await bench.arrive(bench.cycle + random.randrange(1, 300))
            await bench.idle(random.randrange(200))
    for _ in range(6):
        bench = await begin(dut, period=random.randrange(2048, 2100), lead=random.randrange(768))
        often = random.choice([0.0004, 0.002, 0.5])
        for _ in range(30_000):
            await bench.clk(random.random() < often, random.random() < 0.00002)


@cocotb.test()
async def any_state_and_settings_match_the_model_at_the_moments_that_count(dut):
    """Those are the end of a period, the arrival and the capture; long periods and large errors
    take too long to get there by themselves.
    """
    rtl_only("it sets the registers inside")
    bench = await begin(dut)
    for _ in range(400):
        period = random.choice((random.randrange(2048, 1 << 20), 2048 << random.randrange(9)))
        lead = random.randrange(3 * period // 8)
        await bench.clk(enable=0)
        bench.levels |= {"period": period, "lead": lead}
        half = period // 2
        moment = random.choice((half - 3, -lead - 4, random.randrange(-half, half - 6)))
        state = {
            "runs": 1,
            "phase": moment,
            "trim": random.randrange(-RANGE * INTEGRAL, RANGE * INTEGRAL),
            "fraction": random.randrange(INTEGRAL),
            "score": random.choice((0, 1, PENALTY, FULL - 1, FULL, random.randrange(FULL))),
            "missed": random.choice((PATIENCE - 1, random.randrange(PATIENCE))),
            "seen": random.getrandbits(1),
            "locked": random.getrandbits(1),
            "error": random.choice((-1, 1))
            * random.choice((period // 4, 1, random.randrange(half))),
        }
        for name, value in state.items():
            setattr(bench.model, name, value)
            register = getattr(dut, name)
            register.value = value % (1 << len(register))
        for _ in range(6):
            await bench.clk(arrived=int(random.random() < 0.2))
            assert {name: int(getattr(dut, name).value) for name in state} == {
                name: getattr(bench.model, name) % (1 << len(getattr(dut, name))) for name in state
            }


def followed(arrivals, period=PERIOD, lead=LEAD):
    """The model after arrivals in these cycles, and the cycles of its captures."""
    pll, captures, arrivals = LinkPll(), [], set(arrivals)
    for cycle in range(max(arrivals) + 1):
        if pll.step(1, period, lead, cycle in arrivals)[NAMES.index("capture")]:
            captures.append(cycle)
    return pll, captures


@pytest.mark.parametrize("parts", [-200, 200])  # in a million
def test_it_follows_a_clock_that_differs(parts):
    step = PERIOD * (1 + parts * 1e-6)
    pll, captures = followed(round(50 + n * step) for n in range(4000))
    assert pll.locked and abs(pll.error) <= 2
    assert (captures[-1] - captures[-1001]) / 1000 == pytest.approx(step, abs=0.02)


def test_arrivals_at_any_time_unlock_it():
    dice, at = random.Random(seed()), 80 * PERIOD
    arrivals = [*range(PERIOD, at, PERIOD)]
    for _ in range(4 * FULL):
        at += dice.randrange(PERIOD // 2, 3 * PERIOD // 2)
        arrivals.append(at)
    pll, captures = followed(arrivals)
    assert not pll.locked and captures[0] < 70 * PERIOD < captures[-1] < at - 2 * FULL * PERIOD


def test_captures_are_on_an_even_grid_while_arrivals_jitter_by_30_percent():
    dice, most = random.Random(seed()), 3 * PERIOD // 10
    pll, captures = followed(n * PERIOD + dice.randint(-most, most) for n in range(1, 2000))
    places = [at % PERIOD for at in captures[-1000:]]
    assert pll.locked and max(places) - min(places) < 2 * most / 6


def test_link_pll():
    run("link_pll", __file__)
