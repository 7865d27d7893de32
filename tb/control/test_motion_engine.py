# SPDX-License-Identifier: Apache-2.0
"""motion_engine: every result of every tick and of every request against the model, with one to
eight axes; motions by hand; the schedule.
"""

import os
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tables.microcode.assembler import assembled
from tables.microcode.numbers import CONDITIONS, FILTER_SETTINGS, GIVEN, OPERANDS
from tables.microcode.timing import worst
from tb.bench import needs, rtl_only, run, start
from tb.control.motion_engine import LAST, Axis, moved, wrap

PERIOD = 1 << 40  # of velocity, acceleration and jerk
LSB = 1 << 24  # of target, in the same unit
LONGEST = (1 << 24) - 1  # cycles, of the time since the last tick
STROBES = dict(
    shift="shift",
    set="set_target_to_position",
    push="push",
    start="start",
    arm="arm",
    stop="controlled_stop",
    gains="gains_changed",
)
LEVELS = ("block_up", "block_down", "closed_loop")
IDLE = dict.fromkeys(
    ("tick", "now", "setting_write", "setting_axis", "setting_word", "setting_filter", "setting")
    + ("position", "stepped", "downward", "shift_by", "take_up", *LEVELS, *STROBES.values()),
    0,
)


class Engine:
    """The design with a model of each axis beside it."""

    def __init__(self, dut):
        self.dut = dut
        self.falling = FallingEdge(dut.clk)
        self.result_valid, self.overrun = dut.result_valid, dut.overrun  # looked up once
        self.integral_valid = dut.integral_valid
        self.busy, self.waits = dut.busy, dut.waits
        self.setting_waits = dut.setting_waits
        self.axes = int(dut.AXES.value)
        self.models = [Axis(int(dut.FILTERS.value)) for _ in range(self.axes)]
        self.position = [0] * self.axes
        self.levels = [dict.fromkeys(LEVELS, 0) | dict(closed_loop=1) for _ in self.models]
        self.steps = [None] * self.axes  # the last step since the last tick
        self.lost, self.lost_off = [1] * self.axes, [1] * self.axes
        self.since = 0  # cycles since the last tick
        self.now = 0
        self.got = [[] for _ in self.models]
        self.gains = [0] * self.axes
        self.ticks, self.longest, self.overruns, self.stepping = 0, 0, 0, False

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        await self.drive_levels()
        await self.until(lambda: int(self.dut.ready.value), 1000)
        for n in range(self.axes):
            await self.settings(
                n,
                **self.models[n].settings | dict(override=1 << 32),
                filters=[([0] * 5, 0)] * int(self.dut.FILTERS.value),
            )
        return self

    def shift_by(self, n, by):
        """The amount of the next shift of axis n."""
        self.models[n].shift_by = by
        self.dut.shift_by.value = by & (1 << 48) - 1

    def take_up(self, n, value):
        """What takes up the backlash of axis n."""
        self.models[n].take_up = value
        self.dut.take_up.value = sum(m.take_up << 24 * n for n, m in enumerate(self.models))

    async def drive_levels(self):
        for name in LEVELS:
            getattr(self.dut, name).value = sum(
                levels[name] << n for n, levels in enumerate(self.levels)
            )

    async def clk(self, tick=0, stepped=(), strobes=()):
        """Advance one cycle. stepped: {axis: (distance, down)}; strobes: {request: bits}."""
        dut = self.dut
        stepped = dict(stepped)
        for n, (distance, _) in stepped.items():
            self.position[n] += distance
        if stepped:
            dut.position.value = sum(
                (p & (1 << 48) - 1) << 48 * n for n, p in enumerate(self.position)
            )
            dut.downward.value = sum(down << n for n, (_, down) in stepped.items())
        if stepped or self.stepping:
            dut.stepped.value = sum(1 << n for n in stepped)
        self.stepping = bool(stepped)
        for name, bits in dict(strobes).items():
            getattr(dut, STROBES[name]).value = bits
        if tick:
            dut.tick.value = 1
            dut.now.value = self.now
        await self.falling
        for name in dict(strobes):
            getattr(dut, STROBES[name]).value = 0
        if tick:
            dut.tick.value = 0
            self.period, self.since = min(self.since + 1, LONGEST), 0
            self.seen = (
                list(self.position),
                list(self.steps),
                list(self.lost),
                list(self.lost_off),
            )
            self.steps = [None] * self.axes
            self.lost, self.lost_off = [0] * self.axes, [0] * self.axes
        else:
            self.since += 1
        for n, levels in enumerate(self.levels):
            off = levels["block_up"] and levels["block_down"]
            for seen in [self.seen] if tick else []:
                seen[2][n] |= int(off or not levels["closed_loop"])
                seen[3][n] |= int(off)
            if not tick:
                self.lost[n] |= int(off or not levels["closed_loop"])
                self.lost_off[n] |= int(off)
        for n, (_, down) in stepped.items():
            self.steps[n] = self.since, down
        self.collect()

    def collect(self):
        """What the engine gives in this cycle."""
        dut, is_integral = self.dut, int(self.integral_valid.value)
        if int(self.result_valid.value) or is_integral:
            kind = "integral" if is_integral else GIVEN[int(dut.result_kind.value)]
            value = dut.result.value.to_signed()
            flag = int(dut.result_flag.value)
            if kind == "state":
                value &= ~(1 << CONDITIONS["upward"])
            shown = (kind,) if kind == "underrun" else (kind, value)
            if kind in ("error", "command", "steps"):
                shown = (kind, value, flag)
            self.got[int(dut.result_axis.value)].append(shown)
        self.overruns += int(self.overrun.value)

    async def idle(self, cycles, condition=lambda: False):
        """Advance so many cycles without any event, or fewer, until the condition holds; return how
        many. The levels stay, so what was lost by them is known after the first cycle.
        """
        for cycle in range(cycles):
            if condition():
                return cycle
            if cycle == 0:
                await self.clk()
            else:
                await self.falling
                self.since += 1
                self.collect()
        return cycles

    async def until(self, condition, most):
        """Clock until the condition holds; return the cycles."""
        cycles = await self.idle(most, condition)
        assert cycles < most, f"not within {most} cycles"
        return cycles

    async def settings(self, n, **values):
        """Write settings of axis n; `filters` is a list of (coefficients, in use)."""
        words = []
        for name, value in values.items():
            if name == "filters":
                for m, (coefficients, in_use) in enumerate(value):
                    self.models[n].filters[m].coefficients = coefficients
                    self.models[n].filters[m].in_use = in_use
                    for which, number in zip(FILTER_SETTINGS, (*coefficients, in_use)):
                        words.append((OPERANDS[which], m, number))
            else:
                self.models[n].settings[name] = value
                words.append((OPERANDS[name], 0, value))
        for word, which, value in words:
            await self.setting(n, word, which, value)

    async def setting(self, n, word, which, value, most=100):
        """Write one setting; return how many cycles it waits."""
        self.dut.setting_axis.value = n
        self.dut.setting_word.value = word
        self.dut.setting_filter.value = which
        self.dut.setting.value = value & (1 << 64) - 1
        self.dut.setting_write.value = 1
        await self.clk()
        self.dut.setting_write.value = 0
        return await self.until(lambda: not int(self.setting_waits.value), most)

    def check(self, n, expected):
        expected = [
            (kind,) if kind == "underrun" else (kind, wrap(rest[0], 48), *rest[1:])
            for kind, *rest in expected
        ]
        assert self.got[n] == expected, (
            f"tick {self.ticks}, axis {n}:\n{self.got[n]}, the model has\n{expected}"
        )
        self.got[n] = []

    async def request(self, n, *requests):
        """Requests of one axis, served between two ticks."""
        await self.clk(strobes={name: 1 << n for name in requests})
        assert int(self.dut.waits.value) >> n & 1
        await self.until(lambda: not int(self.waits.value), 300)
        await self.idle(60)
        self.check(n, self.models[n].serve(requests, self.position[n]))

    async def push(self, n, velocity, acceleration, jerk, ticks, last=0):
        await self.settings(
            n,
            segment_velocity=velocity,
            segment_acceleration=acceleration,
            segment_jerk=jerk,
            segment_ticks=ticks + last * LAST,
        )
        await self.request(n, "push")

    async def play(self, n, *segments):
        """Queue the segments, start, and give the first tick, which only prepares."""
        for segment in segments:
            await self.push(n, *segment)
        await self.request(n, "start")
        await self.tick()

    async def tick(self, gap=20, requests=(), **events):
        """A tick and its work; requests: {request: bits} in the cycle before it."""
        requests = dict(requests)
        for name, bits in requests.items():
            if name == "gains":
                self.gains = [self.gains[n] | bits >> n & 1 for n in range(self.axes)]
        await self.idle(gap)
        if requests:
            await self.clk(strobes=requests)
        await self.clk(tick=1, **events)
        cycles = await self.until(lambda: not int(self.busy.value), 5000)
        await self.clk()
        assert cycles <= int(self.dut.cycles.value) and self.overruns == 0
        self.longest = max(self.longest, cycles)
        positions, steps, lost, lost_off = self.seen
        for n, model in enumerate(self.models):
            expected = model.tick(
                position=positions[n],
                period=self.period,
                now=self.now,
                stepped=steps[n],
                **self.levels[n],
                lost=lost[n],
                lost_off=lost_off[n],
                gains_changed=self.gains[n],
                requests=[name for name, bits in requests.items() if bits >> n & 1],
            )
            # the engine may have seen the request just before the tick
            if requests and self.got[n][:1] and self.got[n][0][0] == "state":
                del self.got[n][0]
            self.check(n, expected)
        self.gains = [0] * self.axes
        self.ticks += 1

    async def finish(self, n, most=10_000):
        """The targets of axis n to the end of its profile, one per tick."""
        targets = []
        while self.models[n].moving:
            await self.tick()
            targets.append(self.models[n].target)
            assert len(targets) <= most
        return targets


@cocotb.test()
async def the_targets_of_a_short_profile_are_as_worked_out_by_hand(dut):
    engine = await Engine(dut).reset()
    await engine.play(0, (PERIOD, 0, 0, 2), (PERIOD, -PERIOD // 2, 0, 2, 1))
    assert engine.models[0].target == 0
    assert [target / 65536 for target in await engine.finish(0)] == [1.5, 2.5, 3.25, 3.5]


@cocotb.test()
async def the_time_since_the_last_tick_stops_at_its_end(dut):
    """After so long a time without a step the velocity is 0; after a short one it would not be."""
    rtl_only("it sets the time inside, since it is too long to be waited for")
    engine = await Engine(dut).reset()
    await engine.settings(0, quantum=1 << 16)
    for _ in range(4):
        await engine.clk(stepped={0: (1 << 16, 0)})
        await engine.tick()
    assert engine.models[0].speed > 0
    engine.since = LONGEST - 8
    dut.elapsed.value = engine.since + 1
    await engine.clk()
    await engine.tick()
    assert engine.period == LONGEST and engine.models[0].speed == 0


@cocotb.test()
async def a_setting_that_comes_during_a_tick_is_written_before_the_next_axis_is_served(dut):
    rtl_only("it reads the memory inside")
    engine = await Engine(dut).reset()
    _, most = worst(assembled(), int(dut.FILTERS.value))
    waited = []
    for cycles in range(10, most, 61):
        await engine.clk(tick=1)
        await engine.idle(cycles)
        for n in range(engine.axes):
            waited.append(await engine.setting(n, OPERANDS["segment_ticks"], 0, cycles, most + 10))
        await engine.until(lambda: not int(dut.busy.value), 5000)
        await engine.idle(20)
        engine.got = [[] for _ in engine.models]
        for n in range(engine.axes):
            assert memory_word(dut, n, OPERANDS["segment_ticks"]) == cycles, f"axis {n}"
    assert 20 < max(waited) <= most


def memory_word(dut, n, number):
    """A word of axis n in the engine's memory."""
    width = 7 if int(dut.FILTERS.value) == 0 else 8
    return int(dut.u_memory.words[(n << width) + number].value)


@pytest.mark.parametrize("axes, filters", [(1, 0), (1, 2), (3, 4), (8, 0)])
def test_motion_engine(axes, filters):
    run("motion_engine", __file__, AXES=axes, FILTERS=filters)


@cocotb.test()
async def latency_is_at_most_the_cycles_that_the_engine_states(dut):
    """Every axis takes the longest way: a shift, a start, a start at a time, a bounded velocity,
    new gains, and the first tick of a controlled stop.
    """
    engine = await Engine(dut).reset()
    settings = dict(
        kp=1 << 20,
        ki=1 << 20,
        kd=1 << 16,
        kv=1 << 16,
        ka=1 << 16,
        output_limit=1 << 30,
        integral_limit=1 << 38,
        step_ratio=1 << 33,
        trim_scale=1,
        quantum=100,
        stop_deceleration=1 << 40,
        stop_jerk=1 << 20,
        following_limit=5,
        start_at=0,
    )
    shift_by = -(5 << 16)
    for n in range(engine.axes):
        await engine.settings(n, **settings)
        if engine.models[n].filters:
            filters = [([1 << 30, 1, 1, 1, 1], 1)] * len(engine.models[n].filters)
            await engine.settings(n, filters=filters)
        await engine.push(n, 0, -(1 << 36), 0, 9, 1)
        await engine.push(n, 0, 0, 0, 9, 1)
        await engine.request(n, "start")
        for distance in (90, 90, 1000):  # steps, so that the velocity is known
            await engine.clk(stepped={n: (distance, 0)})
    for _ in range(4):
        await engine.tick(gap=100)
    for n in range(engine.axes):
        await engine.request(n, "stop")
        await engine.request(n, "arm")
        engine.position[n] += shift_by
        engine.shift_by(n, shift_by)
    engine.dut.position.value = sum(
        (p & (1 << 48) - 1) << 48 * n for n, p in enumerate(engine.position)
    )
    every = (1 << engine.axes) - 1
    await engine.tick(gap=40, requests=dict(gains=every, shift=every, start=every))
    stated = int(dut.cycles.value)
    dut._log.info(f"{engine.axes} axes: {engine.longest} cycles of {stated}")
    between, axis = worst(assembled(), int(dut.FILTERS.value))
    assert stated == between + engine.axes * axis
    assert 0.85 * engine.axes * axis < engine.longest <= stated


@cocotb.test()
async def a_tick_that_comes_too_soon_is_an_overrun(dut):
    engine = await Engine(dut).reset()
    await engine.clk(tick=1)
    for _ in range(20):
        await engine.clk()
    assert engine.overruns == 0
    await engine.clk(tick=1)
    await engine.clk()
    assert engine.overruns == 1
    await engine.until(lambda: not int(engine.busy.value), 5000)
    assert engine.overruns == 1
    await engine.clk(tick=1)
    assert engine.overruns == 1


@cocotb.test()
async def several_axes_start_at_the_same_tick(dut):
    engine = await Engine(dut).reset()
    for n in range(engine.axes):
        await engine.push(n, (n + 1) * PERIOD, 0, 0, 4, 1)
    await engine.tick(requests=dict(start=(1 << engine.axes) - 1))
    for _ in range(2):
        await engine.tick()
    assert [model.target for model in engine.models] == [
        5 * 32768 * (n + 1) for n in range(engine.axes)
    ]


@cocotb.test()
async def n_ticks_move_by_the_closed_form(dut):
    needs(int(dut.AXES.value) == 1, "one axis is enough")
    engine = await Engine(dut).reset()
    exact = 0
    for _ in range(4):
        segments = [
            (
                random.randrange(-1 << 44, 1 << 44),
                random.randrange(-1 << 36, 1 << 36),
                random.randrange(-1 << 31, 1 << 31),
                random.randrange(1, 9),
            )
            for _ in range(random.randrange(1, 4))
        ]
        await engine.play(0, *segments[:-1], (*segments[-1], 1))
        assert len(await engine.finish(0)) == sum(s[3] for s in segments)
        exact += sum(moved(*s) for s in segments)
        exact = (exact + LSB // 2) // LSB * LSB  # a half is rounded up
        assert engine.models[0].target == exact // LSB


@cocotb.test()
async def at_a_lower_rate_the_distance_is_the_same(dut):
    needs(int(dut.AXES.value) == 1, "one axis is enough")
    engine = await Engine(dut).reset()
    jerk = (1 << 30) + 12345
    segments = ((0, 0, jerk, 5), (10 * jerk, 5 * jerk, -jerk, 5), (25 * jerk, 0, 0, 3, 1))
    exact = sum(moved(*s[:4]) for s in segments)
    for fraction in (21845, 65535, 8192):
        await engine.request(0, "set")
        await engine.settings(0, override=fraction << 16)
        await engine.play(0, *segments)
        targets = await engine.finish(0)
        assert targets[-1] - engine.position[0] == (exact + LSB // 2) // LSB
        assert len(targets) == -(-13 * 65536 // fraction)


@cocotb.test()
async def a_controlled_stop_ends_at_standstill_within_its_limits(dut):
    needs(int(dut.AXES.value) == 1, "one axis is enough")
    engine = await Engine(dut).reset()
    model = engine.models[0]
    for _ in range(8):
        jerk = int(2 ** random.uniform(24, 31.9))
        limit = max(jerk, int(jerk * 2 ** random.uniform(0, 5)) >> 8 << 8)
        increment = min(jerk, limit)
        velocity = random.choice((1, -1)) * int(increment * 2 ** random.uniform(-2, 8))
        acceleration = random.choice((1, -1, 0)) * int(limit * random.uniform(0, 2))
        await engine.settings(0, stop_deceleration=limit, stop_jerk=jerk)
        await engine.request(0, "set")
        await engine.play(0, (velocity, acceleration, 0, 100))
        for _ in range(3):
            await engine.tick()
        changes, steps = [model.change], [model.step]
        await engine.request(0, "stop")
        assert model.moving and not model.queue
        while model.moving:
            await engine.tick()
            if model.moving:
                changes.append(model.change)
                steps.append(model.step)
            assert len(steps) < 2000
        assert steps[-1] == 0 and model.target_velocity == 0
        for old, new in zip(changes, [*changes[1:], 0]):
            assert abs(new - old) <= increment, "jerk"
            assert abs(new) <= max(limit, abs(old)), "acceleration"


@cocotb.test()
async def a_shift_of_the_origin_never_disturbs_the_error(dut):
    engine = await Engine(dut).reset()
    by = -(3 << 16)
    engine.shift_by(0, by)
    await engine.settings(0, kp=1 << 16, output_limit=1 << 30)
    await engine.play(0, (PERIOD, 0, 0, 9, 1))
    for wait in range(4):
        await engine.clk(strobes=dict(shift=1))
        engine.position[0] += by
        dut.position.value = sum(
            (p & (1 << 48) - 1) << 48 * n for n, p in enumerate(engine.position)
        )
        for _ in range(wait):
            await engine.clk()
        before = engine.models[0].target - (engine.position[0] - by)
        model = engine.models[0]
        # the request is served before the tick or at it: the results are the same but for `state`
        await engine.clk(tick=1)
        await engine.until(lambda: not int(engine.busy.value), 5000)
        await engine.clk()
        positions, steps, lost, lost_off = engine.seen
        expected = model.tick(
            positions[0],
            engine.period,
            stepped=steps[0],
            requests=("shift",),
            lost=lost[0],
            lost_off=lost_off[0],
        )
        found = [kind for kind in expected if kind[0] in ("error", "velocity")]
        got = [kind for kind in engine.got[0] if kind[0] in ("error", "velocity")]
        assert got == [(kind, *rest) for kind, *rest in found]
        assert before + 65536 * 2 > found[1][1] >= before
        engine.got = [[] for _ in engine.models]
        for other in engine.models[1:]:
            other.tick(0, engine.period, lost=lost[1], lost_off=lost_off[1])


@cocotb.test()
async def an_armed_axis_starts_at_the_first_tick_after_its_time(dut):
    engine = await Engine(dut).reset()
    for start_at in (5000, 0xFFFF_FFFF, 3):
        await engine.settings(0, start_at=start_at)
        await engine.push(0, PERIOD, 0, 0, 1, 1)
        await engine.request(0, "arm")
        engine.now = (start_at - 1) % (1 << 32)
        await engine.tick()
        assert not engine.models[0].moving and engine.models[0].armed
        engine.now = start_at
        await engine.tick()
        assert engine.models[0].moving and not engine.models[0].armed
        await engine.finish(0)


@cocotb.test()
async def a_full_queue_takes_no_more_segments(dut):
    engine = await Engine(dut).reset()
    for n in range(18):
        await engine.push(0, PERIOD, 0, 0, 1, int(n >= 15))
    assert len(engine.models[0].queue) == 16
    await engine.play(0)
    assert len(await engine.finish(0)) == 16
    await engine.push(0, PERIOD, 0, 0, 0)  # 0 ticks: left out
    assert not engine.models[0].queue


@cocotb.test()
async def a_missing_segment_is_reported_and_ends_in_a_controlled_stop(dut):
    engine = await Engine(dut).reset()
    await engine.settings(0, stop_deceleration=1 << 38)
    await engine.play(0, (PERIOD, 0, 0, 4))
    targets = [target / 65536 for target in await engine.finish(0)]
    steps = [b - a for a, b in zip([0, *targets], targets)]
    assert steps[:7] == [1.5, 1, 1, 1, 0.75, 0.5, 0.25] and not any(steps[7:])


def magnitude(bits):
    """A random number of up to so many bits, mostly small or near the ends."""
    top = (1 << bits) - 1
    return random.choice(
        (
            0,
            1,
            top,
            top // 2,
            random.randrange(1 << bits),
            random.getrandbits(random.randint(0, bits)),
        )
    )


def signed(bits):
    return random.choice((1, -1)) * magnitude(bits - 1)


def nasty_settings():
    fraction = random.choice((0, 1, 65535, 65536, 65536, random.randrange(65536)))
    slope = random.choice((0, 0, magnitude(32)))
    return dict(
        override=fraction << 16,
        override_slope=slope,
        override_curve=random.choice((0, magnitude(32), slope >> random.randint(0, 9))),
        stop_deceleration=random.choice((0, magnitude(32) << 8)),
        stop_jerk=random.choice((0, magnitude(32))),
        kp=magnitude(24),
        ki=random.choice((0, magnitude(24))),
        kd=magnitude(24),
        kv=magnitude(24),
        ka=magnitude(24) << 8,
        output_limit=magnitude(15) << 16,
        integral_limit=magnitude(15) << 24,
        dead_band=magnitude(16),
        open_command=signed(16),
        following_limit=random.choice((0, magnitude(32))),
        step_ratio=signed(48),
        trim_scale=1 << random.randrange(16),
        quantum=magnitude(16),
    )


async def random_ticks(engine, ticks, realistic):
    """Random settings, requests and motions of all axes."""
    filters = int(engine.dut.FILTERS.value)
    for _ in range(ticks):
        for n, model in enumerate(engine.models):
            if random.random() < 0.1:
                values = nasty_settings()
                names = random.sample(sorted(values), random.randint(1, len(values)))
                await engine.settings(n, **{name: values[name] for name in names})
            if filters and random.random() < 0.1:
                sets = [
                    (
                        [signed(32) << 2 if not realistic else signed(31) for _ in range(5)],
                        random.getrandbits(1),
                    )
                    for _ in range(filters)
                ]
                await engine.settings(n, filters=sets)
            if random.random() < 0.3:
                bits = 40 if realistic else random.choice((36, 44, 60))
                segment = (
                    signed(bits),
                    signed(bits - 4),
                    signed(32),
                    random.choice((0, 1, 2, 3, 7)),
                    random.getrandbits(1),
                )
                await engine.push(n, *segment)
            if random.random() < 0.15:
                await engine.request(n, random.choice(("start", "start", "stop", "set")))
            if random.random() < 0.05:
                engine.shift_by(n, signed(40))
                engine.position[n] += model.shift_by
                engine.dut.position.value = sum(
                    (p & (1 << 48) - 1) << 48 * m for m, p in enumerate(engine.position)
                )
                await engine.request(n, "shift")
            if random.random() < 0.1:
                engine.levels[n] = dict(
                    block_up=random.getrandbits(1),
                    block_down=random.getrandbits(1),
                    closed_loop=int(random.random() < 0.8),
                )
            elif random.random() < 0.3:
                engine.levels[n] = dict(block_up=0, block_down=0, closed_loop=1)
            if random.random() < 0.2:
                engine.take_up(n, random.choice((0, (1 << 24) - 1, random.getrandbits(24))))
            for _ in range(random.choice((0, 0, 1, 2))):
                step = signed(random.choice((16, 16, 20, 34)))
                await engine.clk(stepped={n: (step, int(step < 0))})
        await engine.drive_levels()
        requests = {}
        if random.random() < 0.2:
            requests["gains"] = random.getrandbits(engine.axes)
        if random.random() < 0.2:
            requests["start"] = random.getrandbits(engine.axes)
        await engine.tick(random.randrange(1, 40), requests)


def ticks_of(engine):
    """As many as the environment says, else fewer for more axes: each takes its own time."""
    return int(os.environ.get("TICKS", min(80, 100 // engine.axes)))


@cocotb.test()
async def what_takes_up_the_backlash_moves_the_steps_alone(dut):
    engine = await Engine(dut).reset()
    for n in range(engine.axes):
        await engine.settings(n, step_ratio=3 << 32)
        await engine.request(n, "set")
    await engine.tick()
    found = []
    for take_up in (0, 5, (1 << 24) - 1):
        engine.take_up(engine.axes - 1, take_up)
        await engine.tick()
        found.append(engine.models[-1].steps(0, 0, 0)[0][1])
    assert found == [0, 15, 3 * ((1 << 24) - 1)]


@cocotb.test()
async def random_motions_match_the_model(dut):
    engine = await Engine(dut).reset()
    await random_ticks(engine, ticks_of(engine), realistic=True)


@cocotb.test()
async def nasty_motions_match_the_model(dut):
    engine = await Engine(dut).reset()
    await random_ticks(engine, ticks_of(engine), realistic=False)
