# SPDX-License-Identifier: Apache-2.0
"""set_point_player with the model of the motion engine behind it: streams by hand, lateness, loss,
refusals and every end, and random hosts against the model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, Timer

from tables.microcode.numbers import GIVEN
from tb.bench import needs, run, start
from tb.control import motion_engine, set_point_axis
from tb.control.set_point_axis import MARGIN
from tb.control.set_point_piece import piece_of, played
from tb.control.set_point_player import EXTENSION, SetPointPlayer
from tb.control.set_point_queue import address_of
from tb.ports import Ports

ONE = 1 << 16  # a period in a position
TICK_CYCLES = 600  # for each two axes
MOVING, BRAKING, QUEUED = 1, 2, 20  # in a state of the engine
FULL = 1 << 32  # rate of a profile
WORDS = ("segment_velocity", "segment_acceleration", "segment_jerk", "segment_ticks")
VELOCITY, ACCELERATION, TRAVEL = 20 << 24, 1 << 30, 100 * ONE  # limits: 20 and 1/4 period a tick
PINS = ("result_valid", "result_axis", "result_kind", "result", "piece_taken", "settled", "tick")


class Engine:
    """The motion engine of an axis, and what it reports."""

    def __init__(self, at=0):
        self.axis = motion_engine.Axis()
        self.axis.settings |= dict(override=FULL, stop_deceleration=1 << 34, stop_jerk=1 << 32)
        self.axis.anchor = self.axis.target = at
        self.targets = []  # at each tick

    def results(self, found):
        kept = [(kind, value[0]) for kind, *value in found if kind in ("state", "target")]
        return [(GIVEN.index(kind), value) for kind, value in kept]

    def serve(self, request):
        return self.results(self.axis.serve({request}, 0))

    def tick(self):
        found = self.axis.tick(self.axis.target, TICK_CYCLES)
        self.targets.append(self.axis.target)
        self.fault = any(kind == "underrun" for kind, *_ in found)
        return self.results(found)


class Player:
    """The design with the model beside it in every cycle, and with an engine."""

    def __init__(self, dut):
        self.dut, self.ports, self.axes = dut, Ports(dut), int(dut.AXES.value)
        self.model = SetPointPlayer(self.axes, int(dut.MASK.value))
        self.engines = [Engine(at=1000 * n) for n in range(self.axes)]
        self.tick_cycles = TICK_CYCLES * max(1, self.axes // 2)
        self.results, self.wait, self.cycle = [], 0, 0
        self.word_wait = 2  # cycles that the engine takes for a word
        self.enabled = (1 << self.axes) - 1

    async def reset(self):
        quiet = ("stores", "stored_at", "stored_value", "wdata_low", "stops", *PINS)
        await start(self.dut, **dict.fromkeys(quiet, 0), enabled=self.enabled)
        await FallingEdge(self.dut.clk)
        for n, engine in enumerate(self.engines):
            self.give(n, [(GIVEN.index("target"), engine.axis.target), *engine.serve("stop")])
        await self.run(2 * self.axes + 1)
        for n in range(self.axes):
            await self.setting("stream_velocity_limit", VELOCITY, n)
            await self.setting("stream_acceleration_limit", ACCELERATION, n)
            await self.position("stream_travel_low", -TRAVEL, n)
            await self.position("stream_travel_high", TRAVEL, n)
        return self

    def give(self, axis, results):
        self.results += [(axis, *one) for one in results]

    async def clk(self, rst=0, stops=0, take=1, **stored):
        """Advance one cycle. With `take`, the engine takes an offered word when it is idle."""
        ports, model = self.ports, self.model
        stored = dict(stores=0, at=0, value=0, low=0) | stored
        tick = int(self.cycle % self.tick_cycles == self.tick_cycles - 1)
        self.cycle += 1
        if tick:
            for n, engine in enumerate(self.engines):
                self.give(n, engine.tick())
        shown = self.results.pop(0) if self.results else None
        settled = int(not shown and not self.wait)
        self.wait = max(0, self.wait - 1)
        offered = model.offer()
        taken = int(bool(offered) and settled and take)
        inputs = {"rst": rst, "tick": tick, "stops": stops, "enabled": self.enabled}
        inputs |= {"settled": settled, "piece_taken": taken, "result_valid": int(bool(shown))}
        inputs |= zip(("stores", "stored_at", "stored_value", "wdata_low"), stored.values())
        states, target = {}, None
        if shown:
            axis, kind, value = shown
            inputs |= {"result_axis": axis, "result_kind": kind, "result": value}
            if kind == 0:
                states[axis] = value >> MOVING & 1, value >> BRAKING & 1, value >> QUEUED & 31
            elif kind == 1:
                target = axis, value
        ports.drive(inputs)
        await Timer(1, "ns")
        assert ports["piece_valid"] == int(offered is not None)
        if offered:
            found = ports["piece_axis"], ports["piece_part"], ports.signed("piece_word")
            assert found == offered
        await FallingEdge(self.dut.clk)
        model.clk(
            rst=rst,
            tick=tick,
            enabled=self.enabled,
            stops=stops,
            states=states,
            target=target,
            taken=taken,
            settled=settled,
            **stored,
        )
        assert ports["tick_count"] == model.tick_count
        assert (ports["start"], ports["stop"]) == (model.start, model.stop)
        of_axes = ports["states"], ports["counts"]
        for n, a in enumerate(model.axes):
            if model.built(n):
                state = a.state(len(model.queue.commits))
                got = tuple(packed >> 32 * n & 0xFFFF_FFFF for packed in of_axes)
                assert got == (state, a.counts)
        if rst:
            return
        if taken:
            self.take(*offered)
        for n, engine in enumerate(self.engines):
            for request, mask in (("start", model.start), ("stop", model.stop | stops)):
                if mask >> n & 1:
                    self.give(n, engine.serve(request))
                    self.wait = 3

    def take(self, axis, part, word):
        engine = self.engines[axis]
        engine.axis.settings[WORDS[part]] = word
        self.wait = self.word_wait
        if part == 3:
            assert len(engine.axis.queue) < motion_engine.DEPTH
            self.give(axis, engine.serve("push"))

    async def run(self, cycles):
        for _ in range(cycles):
            await self.clk()

    async def run_ticks(self, count):
        """Until so many ticks have passed, and what is due in the last one is done."""
        await self.run(count * self.tick_cycles)

    async def until(self, met, ticks=60):
        """Until it is so, and for the rest of that tick and one more."""
        for _ in range(ticks):
            if met():
                return await self.run_ticks(1)
            await self.run_ticks(1)
        raise AssertionError("it did not happen")

    async def setting(self, register, value, axis=None):
        block = "node" if axis is None else "axis"
        at = address_of(block, register, axis or 0)
        await self.clk(stores=1, at=at, value=value & 0xFFFF_FFFF)
        await self.clk()

    async def position(self, register, value, axis):
        at = address_of("axis", register, axis)
        low, high = value & 0xFFFF_FFFF, value >> 32 & 0xFFFF_FFFF
        await self.clk(stores=1, at=at, value=high, low=low)
        await self.clk()

    async def set_point(self, tick, points):
        """Commit {axis: (position in 2^-16 period, velocity in 2^-24 period per tick)}."""
        for n, (position, velocity) in points.items():
            await self.position("set_point_position", position, n)
            await self.setting("set_point_velocity", velocity, n)
        await self.setting("set_point_tick", tick)
        await self.setting("set_point_commit", sum(1 << n for n in points))

    async def begin(self, axes=None, late_limit=0):
        await self.setting("late_limit", late_limit)
        await self.setting("stream_axes", self.enabled if axes is None else axes)
        await self.run_ticks(3)

    def mode(self, n=0):
        return self.model.axes[n].mode

    def ended(self, n=0):
        return self.model.axes[n].ended


def cubic(engine, begin, points):
    """The targets of each tick from the set-points alone: pieces from one to the next."""
    state, tick, found = (begin[1] << 24, 0), begin[0], []
    for at, (position, velocity) in points:
        limits = (VELOCITY << 16, ACCELERATION << 8)
        _, piece = piece_of(state, (position, velocity << 16), at - tick, limits)
        for place, fast, _ in played(state, *piece[:2], at - tick):
            found.append(place + (fast >> 1) >> 24)
        state, tick = piece[2:], at
    return found


def rising(n, origin=0, step=400):
    """A path from rest: position and velocity of the set-point n, four ticks apart."""
    ticks = 4 * n
    return origin + step * ticks * ticks // 16, step * ticks * 2 * 256 // 16


@cocotb.test()
async def latency_is_336_and_two_for_each_tick_and_16_for_a_piece_of_one(dut):
    player = await Player(dut).reset()
    await player.begin(axes=1)
    await player.run_ticks(1)
    player.word_wait = 0
    player.tick_cycles = 10_000  # no tick comes between
    for ticks in (20, 33, 1):
        at = player.model.tick_count + player.model.axes[0].ahead + ticks
        await player.set_point(at, {0: (100, 0)})  # the last one stays there
        count, cycles = player.model.axes[0].accepted, 1  # of the two since the commit is stored
        while player.model.axes[0].accepted == count:
            await player.clk()
            cycles += 1
        assert cycles == (336 + 2 * ticks if ticks > 1 else 16)
        await player.run(100)  # it looks at the other axes


@cocotb.test()
async def the_targets_lie_on_the_cubic_in_every_tick(dut):
    player = await Player(dut).reset()
    await player.begin()
    origins = [engine.axis.target for engine in player.engines]
    a = player.model.axes[0]
    begin, points = player.model.tick_count + a.ahead, []
    first = player.model.tick_count + 14
    while player.model.tick_count + player.model.axes[0].ahead + 4 < first:
        await player.clk()
    begin = player.model.tick_count + a.ahead
    for n in range(1, 9):
        at = first + 4 * (n - 1)
        points.append(at)
        await player.set_point(at, {m: rising(n - 1, o) for m, o in enumerate(origins)})
        if n > 2:
            await player.run_ticks(4)
    await player.run(20)
    for m, engine in enumerate(player.engines):
        built = player.model.built(m)
        path = [(at, rising(n, origins[m])) for n, at in enumerate(points)]
        expected = cubic(engine, (begin, origins[m]), path)
        got = engine.targets[begin : player.model.tick_count]
        assert got == (expected[: len(got)] if built else [origins[m]] * len(got))
        assert len(got) > 16
        assert player.model.axes[m].accepted == (8 if built else 0)


@cocotb.test()
async def a_set_point_in_each_tick_is_reached_in_that_tick(dut):
    needs(int(dut.AXES.value) < 8, "one axis is enough")
    player = await Player(dut).reset()
    await player.begin(axes=1)
    a, engine = player.model.axes[0], player.engines[0]
    first, step = player.model.tick_count + a.ahead + 2, 5 * ONE // 4
    path = [(round(step * n * n / 40), round(step * n * 2 / 40 * 256)) for n in range(20)]
    for n, (position, velocity) in enumerate(path):
        await player.set_point(first + n, {0: (position, velocity)})
        await player.run(400 if n == 0 else 60 if n < 8 else player.tick_cycles - 10)
    await player.until(lambda: player.model.tick_count > first + len(path))
    assert a.accepted == len(path) and a.late == a.refused == 0
    for n, (position, _) in enumerate(path[:-1]):
        assert abs(engine.targets[first + n - 1] - position) <= 1


@cocotb.test()
async def a_late_stream_continues_at_its_velocity_and_then_stops_under_control(dut):
    needs(int(dut.AXES.value) < 8, "one axis is enough")
    player = await Player(dut).reset()
    await player.begin(axes=1, late_limit=6)
    first = player.model.tick_count + 10
    for n in range(3):
        await player.set_point(first + 4 * n, {0: rising(n, 0)})
        await player.run(500)
    while player.mode() != set_point_axis.ENDED:
        await player.run(100)
    a, engine = player.model.axes[0], player.engines[0]
    assert (a.ended, a.extrapolated) == (set_point_axis.ENDED_LATE, 6)
    await player.until(lambda: not engine.axis.moving)
    assert not engine.axis.moving and not engine.axis.queue and not a.streamed
    steps = [b - a for a, b in zip(engine.targets, engine.targets[1:])]
    assert max(abs(b - a) for a, b in zip(steps, steps[1:])) < ACCELERATION >> 16
    # a set-point for the stream that has ended is refused
    await player.set_point(player.model.tick_count + 10, {0: (0, 0)})
    await player.run(100)
    assert a.refusal == set_point_axis.NOT_STREAMED


@cocotb.test()
async def a_set_point_that_comes_late_is_reached_from_there(dut):
    needs(int(dut.AXES.value) < 8, "one axis is enough")
    player = await Player(dut).reset()
    await player.begin(axes=1, late_limit=100)
    first, a = player.model.tick_count + 10, player.model.axes[0]
    await player.set_point(first, {0: rising(1)})
    while a.extrapolated < 2 * EXTENSION:
        await player.clk()
    await player.set_point(first, {0: rising(1)})  # twice
    await player.set_point(first + 12, {0: rising(4)})
    await player.until(lambda: player.model.tick_count > first + 12)
    assert (a.accepted, a.late) == (2, 1) and a.extrapolated > EXTENSION
    assert min(abs(rising(4)[0] - at) for at in player.engines[0].targets) <= 1


@cocotb.test()
async def what_breaks_a_rule_is_refused_counted_and_changes_nothing(dut):
    needs(int(dut.AXES.value) < 8, "one axis is enough")
    player = await Player(dut).reset()
    await player.begin(axes=1)
    model, a = player.model, player.model.axes[0]
    for point, ahead, cause in (
        ((TRAVEL + 1, 0), 20, set_point_axis.OUT_OF_TRAVEL),
        ((-TRAVEL - 1, 0), 20, set_point_axis.OUT_OF_TRAVEL),
        ((TRAVEL, 0), 10, set_point_axis.LIMITS),
        ((0, 0), 256, set_point_axis.TOO_FAR_AHEAD),
        ((0, 0), 0, set_point_axis.LATE),
        ((0, 0), -5, set_point_axis.LATE),
    ):
        count = a.late + a.refused
        await player.set_point(model.tick_count + a.ahead + ahead, {0: point})
        await player.run(900)
        assert a.refusal == cause and a.late + a.refused == count + 1
    await player.setting("set_point_commit", 1)
    await player.run(100)
    assert a.refusal == set_point_axis.INCOMPLETE and a.accepted == 0
    assert not any(player.engines[0].targets) and a.mode == set_point_axis.PREPARED
    # more than the engine queues
    await player.set_point(model.tick_count + 40, {0: (0, 0)})
    for n in range(20):
        await player.set_point(model.tick_count + 44 + 2 * n, {0: (0, 0)})
        await player.run(420)
    assert a.refusal == set_point_axis.QUEUE_FULL and a.accepted >= 15


@cocotb.test()
async def a_full_queue_is_played_before_the_stream_is_released(dut):
    needs(int(dut.AXES.value) == 1, "one axis is enough")
    player = await Player(dut).reset()
    a, engine = player.model.axes[0], player.engines[0]
    await player.begin(axes=1)
    end = player.model.tick_count + a.ahead
    while not a.full:  # it goes a little and rests there
        end += 30
        await player.set_point(end, {0: (50, 0)})
        await player.run(900)
    await player.setting("stream_axes", 0)
    await player.until(lambda: a.ended == set_point_axis.RELEASED)
    assert player.model.tick_count < end and engine.axis.moving
    await player.until(lambda: not engine.axis.moving, ticks=600)
    assert engine.axis.target == 50 and player.model.tick_count >= end
    assert not engine.axis.queue and a.mode == set_point_axis.OFF


@cocotb.test()
async def every_end_of_a_stream_leaves_an_empty_queue(dut):
    needs(int(dut.AXES.value) == 1, "one axis is enough")
    player = await Player(dut).reset()
    a, engine = player.model.axes[0], player.engines[0]
    for why in ("release", "withdrawn", "stops", "drive", "underrun"):
        player.enabled = (1 << player.axes) - 1
        engine.axis.settings["override"] = FULL
        await player.begin(axes=1, late_limit=50)
        first, origin = player.model.tick_count + 10, engine.axis.target
        for n in range(3 if why != "release" else 1):
            await player.set_point(first + 4 * n, {0: rising(n, origin)})
            await player.run(600)
        await player.until(lambda: a.started)
        assert a.mode in (set_point_axis.STREAMING, set_point_axis.EXTRAPOLATING)
        if why in ("release", "withdrawn"):
            await player.setting("stream_axes", 0)
        elif why == "stops":
            await player.clk(stops=1)
        elif why == "drive":
            player.enabled = 0
        else:
            engine.axis.queue, engine.axis.left = [], 1
        await player.run_ticks(40)
        assert (
            a.ended
            == dict(
                release=set_point_axis.RELEASED,
                withdrawn=set_point_axis.STOPPED,
                stops=set_point_axis.STOPPED,
                drive=set_point_axis.FAULT,
                underrun=set_point_axis.FAULT,
            )[why]
        ), why
        assert not engine.axis.moving and not engine.axis.queue and not a.streamed
        await player.setting("stream_axes", 0)
        await player.run_ticks(1)
        assert a.mode == set_point_axis.OFF


@cocotb.test()
async def a_stream_without_a_drive_does_not_begin(dut):
    player = await Player(dut).reset()
    player.enabled = 0
    await player.begin(axes=1)
    assert (player.mode(), player.ended()) == (set_point_axis.ENDED, set_point_axis.FAULT)
    assert not player.engines[0].axis.queue


@cocotb.test()
async def random_hosts_match_the_model(dut):
    """Jitter, loss, duplicates and nonsense of a host; no target jumps."""
    player = await Player(dut).reset()
    await player.begin(late_limit=20)
    model = player.model
    origins = [engine.axis.target for engine in player.engines]
    first, sent = model.tick_count + 12, 0
    for _ in range(14 if player.axes < 8 else 5):
        n = sent + random.choice((1, 1, 1, 1, 2, 0))
        sent = n
        points = {m: rising(n % 40, o, 200) for m, o in enumerate(origins) if random.random() < 0.9}
        if points:
            await player.set_point(first + 4 * n, points)
        for _ in range(round(player.tick_cycles * random.uniform(3, 5))):
            stops = int(random.random() < 1e-5)
            await player.clk(stops=stops, take=int(random.random() < 0.9))
        if random.random() < 0.15:
            await player.setting("stream_axes", random.getrandbits(player.axes))
            await player.setting("stream_axes", player.enabled)
    for engine in player.engines:
        steps = [b - a for a, b in zip(engine.targets, engine.targets[1:])]
        assert max(abs(b - a) for a, b in zip(steps, steps[1:])) <= ACCELERATION >> 16
    await player.clk(rst=1)
    assert not int(dut.piece_valid.value) and not int(dut.streamed.value)


@pytest.mark.parametrize("axes, mask", [(1, 255), (2, 1), (8, 255)])
def test_set_point_player(axes, mask):
    run("set_point_player", __file__, AXES=axes, MASK=mask, MARGIN=MARGIN)
