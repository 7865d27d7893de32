# SPDX-License-Identifier: Apache-2.0
"""step_generator: edges by hand in every mode, timings on the pins, no lost steps, and random lines
against the model in every cycle. The rates of the lines are those of step_lines.
"""

import random
from fractions import Fraction

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.drive.step_generator import StepGenerator
from tb.drive.step_lines import TOO_FAR, rate_of, wrapped
from tools import sigrok
from twin.recordings import CAPTURES, rows

TIME_W, RATE_F, AHEAD_W = 5, 26, 6
ONE = 1 << 16
PERIOD = 20  # cycles of a line, unless a test says otherwise
IDLE = dict(
    high_cycles=1,
    low_cycles=1,
    setup_cycles=2,
    hold_cycles=1,
    mode=0,
    step_low=0,
    direction_low=0,
    enable=0,
    line_idle=1,
)
ONCE = dict.fromkeys(("line_start", "rate_valid", "rate", "rate_restart", "rate_steep"), 0)
RECORDING = CAPTURES / "smoothieware_steps.csv"
SLOWER = 50  # samples of the recording per cycle
RECORDED = 150  # steps of the recording that are played


class Generator:
    """The design with the model beside it in every cycle; `seen` has (step, direction) of every
    cycle.
    """

    def __init__(self, dut):
        self.dut, self.model = dut, StepGenerator(TIME_W, RATE_F, AHEAD_W)
        self.inputs, self.seen = dict(IDLE), []

    async def reset(self, target=0, period=PERIOD, **inputs):
        self.period = period
        self.inputs.update(inputs)
        await start(self.dut, **self.inputs, **ONCE)
        await FallingEdge(self.dut.clk)
        self.model.reset()
        await self.wait(10)
        self.inputs["enable"] = 1
        await self.begin(target)
        self.seen = []
        return self

    async def clk(self, rst=0, **inputs):
        """(step, direction, steps, overrun) after a cycle with these inputs."""
        once = ONCE | {name: inputs.pop(name) for name in ONCE if name in inputs}
        self.inputs.update(inputs)
        levels = self.inputs | once | dict(rst=rst)
        for name, level in levels.items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        dut = self.dut
        got = (
            *(int(port.value) for port in (dut.step, dut.direction, dut.pulse, dut.upward)),
            *(dut.steps.value.to_signed(), int(dut.overrun.value), int(dut.stopped.value)),
        )
        want = self.model.clk(**levels)
        assert got == want, (
            f"{levels}: step, direction, pulse, upward, steps, overrun, stopped are {got}, "
            f"the model has {want}"
        )
        self.seen.append(got[:2])
        return *got[:2], *got[4:6]

    async def wait(self, clks):
        for _ in range(clks):
            got = await self.clk()
        return got

    async def begin(self, target):
        """The line begins at the whole step below target (in 2^-16 step)."""
        self.end, self.rest = target >> 16 << 16, self.period - 1
        await self.clk(rate_valid=1, rate_restart=1)
        await self.clk(line_start=1)

    async def line(self, target, clks=None):
        """Give the rate of a line to target (in steps), and draw it for its period; return what the
        pins showed. The line begins in the second cycle.
        """
        first = len(self.seen)
        target = int(target * ONE)
        distance = wrapped(target - self.end)
        found = rate_of(distance, self.rest, self.period, RATE_F)
        if found is TOO_FAR:
            await self.clk(rate_valid=1, rate_steep=1)
        else:
            rate, self.rest = found
            await self.clk(rate_valid=1, rate=rate)
        self.end = target
        await self.clk(line_start=1, line_idle=0)
        await self.wait(self.period - 1)
        self.inputs["line_idle"] = 1
        if clks:
            await self.wait(clks)
        return self.seen[first:]


def rises(levels, before=0):
    """Cycles, counted from 1, in which a level is high and was low before."""
    return [
        clk
        for clk, level in enumerate(levels, start=1)
        if level and not (levels[clk - 2] if clk > 1 else before)
    ]


@cocotb.test()
async def the_edges_of_a_line_are_as_drawn_by_hand(dut):
    generator = await Generator(dut).reset()
    await generator.line(1)  # turns upward, one step at its end
    pins = await generator.line(5) + await generator.line(5)
    assert [clk for clk in rises([step for step, _ in pins]) if clk > 2] == [
        5,
        8,
        13,
        18,
        23,
    ]  # the first had to turn
    assert all(direction for _, direction in pins[4:])
    pins = await generator.line(3) + await generator.line(3)
    assert rises([step for step, _ in pins]) == [
        7,
        14,
    ]  # below 5 after 1 cycle, but it turns first; below 4 after 11
    assert [direction for _, direction in pins].index(0) == 4
    assert (await generator.clk())[2] == 3


@cocotb.test()
async def latency_is_1_from_the_line_passing_a_step_to_the_edge(dut):
    for target, latency in ((Fraction(1), 20), (Fraction(2), 10), (Fraction(4), 5)):
        generator = await Generator(dut).reset(target=0)
        await generator.line(1)  # it turns upward here
        await generator.wait(5)
        await generator.begin(0)
        await generator.wait(5)
        pins = await generator.line(target) + await generator.line(target)
        first = rises([step for step, _ in pins])[0]
        assert first - 3 == latency, (
            "rate and start, then `latency` cycles of the line, then 1 cycle to the pin"
        )


@cocotb.test()
async def the_steps_made_are_the_floor_of_the_line_after_every_line(dut):
    generator = await Generator(dut).reset(target=-5 * ONE // 3, period=37)
    place, origin = Fraction(-5, 3), -2
    for _ in range(60):
        place = Fraction(int((place + Fraction(random.randrange(-9000, 9000), 1000)) * ONE), ONE)
        await generator.line(place)
        await generator.wait(12)  # a line's last steps may have to turn first
        got = await generator.clk()
        assert got[2] == place // 1 - origin and not got[3]


@cocotb.test()
async def at_most_a_step_every_2_cycles_is_made_and_the_others_follow_later(dut):
    generator = await Generator(dut).reset(target=0, period=100, setup_cycles=0, hold_cycles=0)
    await generator.line(49)
    pins = await generator.line(99)
    steps = rises([step for step, _ in pins], before=pins[0][0])
    assert {b - a for a, b in zip(steps, steps[1:])} == {2}
    await generator.line(157)  # 58 steps in 100 cycles: 8 are still to be made
    assert (await generator.wait(30))[2:] == (157, 0)


@cocotb.test()
async def the_timings_are_kept_at_both_ends_of_their_ranges(dut):
    for high, low, setup, hold in (
        (0, 0, 0, 0),
        (1, 1, 1, 1),
        (31, 1, 1, 1),
        (1, 31, 1, 1),
        (1, 1, 31, 1),
        (1, 1, 1, 31),
        (3, 4, 9, 7),
    ):
        generator = await Generator(dut).reset(
            target=0,
            period=120,
            high_cycles=high,
            low_cycles=low,
            setup_cycles=setup,
            hold_cycles=hold,
        )
        for target in (3, 1, 4, 4, 0, 0):
            await generator.line(target)
        assert (await generator.wait(300))[2:] == (0, 0)
        since_edge = since_turn = since_gap = 1000
        shortest = dict(high=1000, low=1000, setup=1000, hold=1000)
        for (step, direction), (step_now, direction_now) in zip(generator.seen, generator.seen[1:]):
            since_edge, since_turn, since_gap = since_edge + 1, since_turn + 1, since_gap + 1
            if direction != direction_now:
                assert not step and not step_now
                shortest["hold"], since_turn = min(shortest["hold"], since_gap), 0
            if step != step_now:
                name = "high" if step else "low"
                shortest[name] = min(shortest[name], since_edge)
                if step:
                    since_gap = 0
                else:
                    shortest["setup"] = min(shortest["setup"], since_turn)
                since_edge = 0
        assert shortest["high"] == max(high, 1)  # neither shorter nor longer
        assert shortest["low"] >= max(low, 1) and shortest["hold"] >= max(hold, 1)
        assert shortest["setup"] == max(setup, 2)


@cocotb.test()
async def quadrature_has_one_edge_per_step_and_a_leads_going_up(dut):
    generator = await Generator(dut).reset(target=0, mode=1, high_cycles=2, low_cycles=2, period=40)
    gray = [(0, 0), (1, 0), (1, 1), (0, 1)]
    for target in (9, 4, -7, -7):
        await generator.line(target, 40)
    place = 0
    since = 100
    for before, after in zip(generator.seen, generator.seen[1:]):
        since += 1
        if before != after:
            way = (gray.index(after) - gray.index(before)) % 4
            assert way in (1, 3) and since >= 4
            place, since = place + (1 if way == 1 else -1), 0
    assert place == -7 == (await generator.clk())[2]


@cocotb.test()
async def pulses_going_up_are_on_step_and_those_going_down_on_direction(dut):
    generator = await Generator(dut).reset(target=0, mode=2, period=40)
    for target in (5, 5, 2, 2):
        await generator.line(target)
    assert (
        len(rises([step for step, _ in generator.seen])) == 5
        and len(rises([down for _, down in generator.seen])) == 3
    )


@cocotb.test()
async def polarity_inverts_the_pins(dut):
    for mode in (0, 1, 2):
        seen = []
        for low in (0, 1):
            generator = await Generator(dut).reset(
                target=0, mode=mode, step_low=low, direction_low=low, period=30
            )
            for target in (3, 1, 1):
                await generator.line(target)
            seen.append(generator.seen)
        assert seen[0] == [(1 - step, 1 - direction) for step, direction in seen[1]]


@cocotb.test()
async def enable_low_finishes_the_pulse_and_enable_high_again_does_not_jump(dut):
    generator = await Generator(dut).reset(target=0, period=40, high_cycles=6)
    await generator.line(4)
    while not generator.seen[-1][0]:
        await generator.clk()
    pins = [await generator.clk(enable=0) for _ in range(60)]
    assert [pin[0] for pin in pins] == [1] * 5 + [0] * 55  # the pulse was 6 cycles long
    made = pins[-1][2]
    await generator.clk(enable=1)
    await generator.line(880)  # its rate is ignored
    await generator.begin(900 * ONE)
    for target in (900, 900, 903, 903):
        await generator.line(target)
    assert (await generator.clk())[2] == made + 3


@cocotb.test()
async def no_step_begins_from_the_cycle_on_in_which_enable_falls(dut):
    for cycles in range(16, 24):
        generator = await Generator(dut).reset()
        await generator.clk(rate_valid=1, rate=1 << RATE_F - 3)  # a step per 8 cycles
        await generator.clk(line_start=1, line_idle=0)
        made = (await generator.wait(cycles))[2]
        for enable in (0, 1):
            assert (await generator.clk(enable=enable))[2] == made > 0
            assert (await generator.wait(20))[2] == made


@cocotb.test()
async def a_restart_makes_no_step(dut):
    generator = await Generator(dut).reset(target=0, period=40)
    for target in (3, 3):
        await generator.line(target)
    for target in (-(2**31), 2**31 - 1, 7):
        await generator.begin(target * ONE)
        await generator.line(target)
        assert (await generator.line(target))[-1][0] == 0 and generator.model.steps == 3
    await generator.line(9)
    assert (await generator.wait(10))[2] == 5


@cocotb.test()
async def it_takes_the_shortest_distance_across_the_wrap_of_target(dut):
    generator = await Generator(dut).reset(target=(2**31 - 2) * ONE, period=40)
    await generator.line(2**31 - 1)
    await generator.line(-(2**31))
    await generator.line(-(2**31) + 1)
    assert (await generator.wait(10))[2:] == (3, 0)


@cocotb.test()
async def overrun_rises_when_target_runs_away_and_only_restart_reset_or_enable_low_ends_it(dut):
    for jump in (40, -41, 30000, 2**31 - 1):  # 40: a step per cycle
        generator = await Generator(dut).reset(period=40)
        await generator.line(jump)
        got = await generator.line(jump)
        assert (await generator.clk())[3] and len({step for step, _ in got[4:]}) == 1
        await generator.begin(jump * ONE)
        assert not (await generator.clk())[3]
        await generator.line(jump - 90)
        assert (await generator.clk())[3] and not (await generator.clk(rst=1))[3]
    generator = await Generator(dut).reset(period=200, high_cycles=30)
    await generator.line(10)  # 2^(AHEAD_W - 2): 16 steps may be still to be made
    assert not (await generator.wait(200))[3]
    await generator.line(40)
    assert (await generator.wait(50))[3]
    assert not (await generator.clk(enable=0))[3]


@cocotb.test()
async def a_line_ends_with_line_idle_and_another_may_follow_at_once(dut):
    generator = await Generator(dut).reset()
    await generator.line(1)
    rate = ONCE | dict(rate_valid=1, rate=1 << RATE_F - 2)
    await generator.clk(**rate)
    await generator.clk(line_start=1, line_idle=0)
    await generator.clk(**rate)
    await generator.wait(18)
    await generator.clk(line_start=1)  # 20 cycles of a quarter step
    await generator.wait(19)
    await generator.clk(line_idle=1)
    assert (await generator.wait(40))[2] == 1 + 5 + 5


@cocotb.test()
async def reset_in_a_line_clears_pins_and_steps(dut):
    generator = await Generator(dut).reset(target=0, period=20, high_cycles=3)
    for wait in range(20):
        await generator.line(generator.end // ONE + 4)
        await generator.line(generator.end // ONE + 4)
        for _ in range(wait):
            await generator.clk()
        assert await generator.clk(rst=1) == (0, 0, 0, 0)
        assert (await generator.wait(30))[2] == 0
        await generator.begin(0)


@cocotb.test()
async def any_lines_match_the_model(dut):
    generator = await Generator(dut).reset()
    fastest = 1 << RATE_F
    for _ in range(25_000):
        inputs = {}
        if random.randrange(20) == 0:
            rate = random.choice(
                (0, 1, -1, -fastest, fastest - 1, random.randrange(-fastest, fastest) >> 1)
            )
            inputs.update(
                rate_valid=1,
                rate=rate >> random.choice((0, 0, 1, 4)),
                rate_restart=int(random.randrange(4) == 0),
                rate_steep=int(random.randrange(40) == 0),
            )
        if random.randrange(30) == 0:
            inputs.update(line_start=1)
        inputs.update(line_idle=int(random.randrange(30) == 0))
        for name in ("high_cycles", "low_cycles", "setup_cycles", "hold_cycles"):
            if random.randrange(300) == 0:
                inputs[name] = random.choice((0, 1, 2, 31, random.randrange(8)))
        if random.randrange(100) == 0:
            inputs.update(
                mode=random.randrange(4),
                step_low=random.getrandbits(1),
                direction_low=random.getrandbits(1),
            )
        if random.randrange(200) == 0:
            inputs.update(enable=int(random.randrange(3) > 0))
        await generator.clk(rst=int(random.randrange(3000) == 0), **inputs)


@cocotb.test(skip=not sigrok.installed())
async def sigrok_counts_the_same_steps(dut):
    """23 up and 9 down: sigrok's stepper_motor reports a position when the next step comes, so not
    the last one.
    """
    generator = await Generator(dut).reset(
        target=0, period=50, high_cycles=2, low_cycles=3, setup_cycles=4, hold_cycles=3
    )
    for target in (8, 16, 23, 23, 20, 14, 14):
        await generator.line(target)
    samples = bytes(step | direction << 1 for step, direction in generator.seen)
    text = sigrok.decoded(
        samples, 2, 1_000_000, "stepper_motor:step=0:dir=1:unit=steps", "stepper_motor=position"
    )
    places = [int(line.split()[1]) for line in text.splitlines()]
    assert places == [*range(1, 24), *range(22, 14, -1)]


def recorded():
    """Positions of a real machine's axis, once per period, as its controller stepped it: the first
    steps of the recording, and back again.
    """
    changes = [row[:2] for row in rows(RECORDING)]
    edges = [sample for (_, before), (sample, step) in zip(changes, changes[1:]) if step > before][
        :RECORDED
    ]
    period = SLOWER * PERIOD
    times = range(edges[0] - period, edges[-1] + period, period)
    places = [sum(edge <= time for edge in edges) for time in times]
    return places + places[::-1]


@cocotb.test(skip=not RECORDING.exists())
async def follows_a_recorded_machine_there_and_back(dut):
    places = recorded()
    assert places[0] == places[-1] == 0 and max(places) == RECORDED
    generator = await Generator(dut).reset(
        target=0, high_cycles=2, low_cycles=2, setup_cycles=2, hold_cycles=2
    )
    for before, place in zip(places, places[1:]):
        await generator.line(place)
        assert min(before, place) - 1 <= generator.model.steps <= max(before, place)
    assert (await generator.wait(30))[2:] == (0, 0)


def test_step_generator():
    run("step_generator", __file__, TIME_W=TIME_W, RATE_F=RATE_F, AHEAD_W=AHEAD_W)
