# SPDX-License-Identifier: Apache-2.0
"""motion_engine: every result of every tick and of every request against the model, with one to
eight axes; motions by hand; the schedule.
"""

import os
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tables.engine_microcode import ADDRESS, FILTER_SETTINGS, FLAGS, GIVEN
from tb.bench import run, start
from tb.control.motion_engine import LAST, Axis
from tb.control.profile_player import moved, wrap

PERIOD = 1 << 40  # of velocity, acceleration and jerk
LSB = 1 << 24  # of target, in the same unit
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
    ("tick", "now", "setting_write", "setting_axis", "setting_word", "setting", "position")
    + ("stepped", "downward", *LEVELS, *STROBES.values()),
    0,
)


class Engine:
    """The design with a model of each axis beside it."""

    def __init__(self, dut):
        self.dut = dut
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
        self.ticks, self.longest = 0, 0

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        await self.drive_levels()
        while not int(self.dut.ready.value):
            await self.clk()
        for n in range(self.axes):
            await self.settings(n, override=1 << 32)
        return self

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
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        for name in dict(strobes):
            getattr(dut, STROBES[name]).value = 0
        if tick:
            dut.tick.value = 0
            self.period, self.since = self.since + 1, 0
            self.seen = (
                list(self.position), list(self.steps), list(self.lost), list(self.lost_off)
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
        if int(dut.result_valid.value):
            kind = GIVEN[int(dut.result_kind.value)]
            value = dut.result.value.to_signed()
            flag = int(dut.result_flag.value)
            shown = (kind,) if kind == "underrun" else (kind, value)
            if kind in ("error", "command", "steps"):
                shown = (kind, value, flag)
            self.got[int(dut.result_axis.value)].append(shown)
        assert not int(dut.overrun.value)

    stepping = False

    async def settings(self, n, **values):
        """Write settings of axis n; `filters` is a list of (coefficients, in use)."""
        words = []
        for name, value in values.items():
            if name == "filters":
                for m, (coefficients, in_use) in enumerate(value):
                    self.models[n].filters[m].coefficients = coefficients
                    self.models[n].filters[m].in_use = in_use
                    for which, number in zip(FILTER_SETTINGS, (*coefficients, in_use)):
                        words.append((ADDRESS[which] + 16 * m, number))
            else:
                self.models[n].settings[name] = value
                words.append((ADDRESS[name], value))
        for word, value in words:
            self.dut.setting_axis.value = n
            self.dut.setting_word.value = word
            self.dut.setting.value = value & (1 << 64) - 1
            self.dut.setting_write.value = 1
            await self.clk()
            self.dut.setting_write.value = 0
            while int(self.dut.setting_waits.value):
                await self.clk()

    def check(self, n, wanted):
        wanted = [
            (kind,) if kind == "underrun" else (kind, wrap(rest[0], 48), *rest[1:])
            for kind, *rest in wanted
        ]
        assert self.got[n] == wanted, (
            f"tick {self.ticks}, axis {n}:\n{self.got[n]}, the model has\n{wanted}"
        )
        self.got[n] = []

    async def request(self, n, *requests):
        """Requests of one axis, served between two ticks."""
        await self.clk(strobes={name: 1 << n for name in requests})
        assert int(self.dut.waits.value) >> n & 1
        while int(self.dut.waits.value):
            await self.clk()
        for _ in range(60):
            await self.clk()
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
        for _ in range(gap):
            await self.clk()
        if requests:
            await self.clk(strobes=requests)
        await self.clk(tick=1, **events)
        cycles = 0
        while int(self.dut.busy.value):
            await self.clk()
            cycles += 1
        await self.clk()
        self.longest = max(self.longest, cycles)
        positions, steps, lost, lost_off = self.seen
        for n, model in enumerate(self.models):
            wanted = model.tick(
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
            self.check(n, wanted)
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


def test_motion_engine_by_hand():
    run("motion_engine", __file__, AXES=1, FILTERS=0)
