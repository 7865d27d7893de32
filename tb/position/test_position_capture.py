# SPDX-License-Identifier: Apache-2.0
"""Tests of position_capture: every source, order, age, both ends of the queue, and every cycle
against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.position.position_capture import (
    INDEX,
    NEVER,
    SOFTWARE,
    TICK,
    PositionCapture,
    falling,
    rising,
)

INPUTS = dict(
    enabled=0, index=0, tick=0, software=0, probe=0, now=0, valid=0, position=0, pop=0, clear=0
)


class Capture:
    def __init__(self, dut):
        self.dut, self.probes, self.depth = dut, int(dut.PROBES.value), int(dut.DEPTH.value)
        self.all = (1 << 2 * self.probes + 3) - 1
        self.zeros = int(dut.ZEROS.value)
        self.top = (1 << 48 - self.zeros) - 1  # the bits of a position that are stored
        self.model, self.time = PositionCapture(self.probes, self.depth), 0

    async def cycle(self, rst=0, **inputs):
        """Advance design and model by one cycle; returns (present, entry, free, overrun). The
        design gets positions with ZEROS zeros at their end, the model without them.
        """
        dut, self.time = self.dut, (self.time + 1) % (1 << len(self.dut.now))
        values = INPUTS | dict(enabled=self.all, now=self.time) | inputs
        dut.rst.value = rst
        for name, value in values.items():
            getattr(dut, name).value = (
                (value & self.top) << self.zeros if name == "position" else value
            )
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        present = int(dut.present.value)
        entry = (
            (
                int(dut.captured_sources.value),
                int(dut.captured_age.value),
                int(dut.captured_time.value),
                dut.captured_position.value.to_signed(),
            )
            if present
            else None
        )
        got = present, entry, int(dut.free.value), int(dut.overrun.value)
        want = self.model.step(rst=rst, **values)
        meant = want[1] and (*want[1][:3], self.placed(want[1][3]))
        assert got == (want[0], meant, *want[2:]), f"{got}, the model has {want}"
        return want

    def placed(self, position):
        """The 48 bits of a position with its zeros, as a signed number."""
        bits = (position & self.top) << self.zeros
        return bits - (bits >> 47 << 48)

    async def read(self):
        """Read all entries in order; nothing captures meanwhile."""
        entries = []
        while (await self.cycle(enabled=0))[0]:
            entries.append(self.model.entries[0])
            await self.cycle(enabled=0, pop=1)
        return entries


async def begin(dut, probe=0):
    await start(dut, **INPUTS | dict(probe=probe))
    capture = Capture(dut)
    await capture.cycle(rst=1, probe=probe)
    return capture


@cocotb.test()
async def latency_is_2_from_event_to_present(dut):
    capture = await begin(dut)
    assert (await capture.cycle(index=1, valid=1, position=5))[0] == 0
    assert (await capture.cycle())[1] == (INDEX, 0, 2, 5)


@cocotb.test()
async def each_source_makes_an_entry_with_its_own_bit(dut):
    capture = await begin(dut)
    await capture.cycle(valid=1, position=-70_000)
    events = [(INDEX, dict(index=1)), (TICK, dict(tick=1)), (SOFTWARE, dict(software=1))]
    for n in range(capture.probes):
        events += [
            (rising(n, capture.probes), dict(probe=1 << n)),
            (falling(n, capture.probes), dict(probe=0)),
        ]
    for age, (_, inputs) in enumerate(events, 1):
        assert (await capture.cycle(position=-70_000 - age, **inputs))[3] == int(
            age > capture.depth
        )
    assert (
        await capture.read()
        == [(bit, age, age + 2, -70_000 - age) for age, (bit, _) in enumerate(events, 1)][
            : capture.depth
        ]
    )


@cocotb.test()
async def events_of_one_cycle_make_one_entry(dut):
    capture = await begin(dut)
    await capture.cycle()
    await capture.cycle(probe=1, index=1, tick=1, software=1, valid=1, position=9)
    ((sources, age, _, position),) = await capture.read()
    assert (
        sources & 7 == INDEX | TICK | SOFTWARE and sources & rising(0) and (age, position) == (0, 9)
    )


@cocotb.test()
async def only_enabled_sources_capture(dut):
    capture = await begin(dut)
    for bit in range(2 * capture.probes + 3):
        for probe in (capture.all, 0):
            await capture.cycle(
                enabled=1 << bit, index=1, tick=1, software=1, probe=probe % (1 << capture.probes)
            )
        found = await capture.read()
        assert {entry[0] for entry in found} == {1 << bit} and len(found) == (2 if bit < 3 else 1)
    await capture.cycle(enabled=0, index=1, tick=1, software=1, probe=1)
    assert await capture.read() == []


@cocotb.test()
async def a_probe_that_is_high_at_reset_or_when_it_is_enabled_is_no_edge(dut):
    capture = await begin(dut, probe=1)
    for enabled in (capture.all, capture.all, 0, capture.all, capture.all):
        assert (await capture.cycle(enabled=enabled, probe=1))[2] == capture.depth
    await capture.cycle(probe=0)
    assert [entry[0] for entry in await capture.read()] == [falling(0, capture.probes)]


@cocotb.test()
async def the_age_counts_the_cycles_since_the_position_came_and_saturates(dut):
    capture = await begin(dut)
    await capture.cycle(software=1)
    await capture.cycle(valid=1)
    for _ in range(6):
        await capture.cycle()
    await capture.cycle(software=1)
    assert [entry[1] for entry in await capture.read()] == [NEVER, 7]


@cocotb.test()
async def a_full_queue_reports_what_it_drops_and_keeps_its_entries(dut):
    capture = await begin(dut)
    for n in range(capture.depth):
        assert (await capture.cycle(index=1, position=n))[2:] == (capture.depth - 1 - n, 0)
    for _ in range(3):
        assert (await capture.cycle(tick=1, position=-1))[3] == 1
    assert (await capture.cycle(index=1, position=-1, pop=1))[3] == 1  # full when it came
    assert (await capture.cycle(index=1, position=77))[3] == 0
    assert [entry[3] for entry in await capture.read()] == [*range(1, capture.depth), 77]


@cocotb.test()
async def the_head_is_constant_until_it_is_popped(dut):
    capture = await begin(dut)
    await capture.cycle(index=1, position=-1 << 47)
    await capture.cycle()
    for n in range(40):
        assert (await capture.cycle(index=1, valid=1, position=n))[1] == (INDEX, NEVER, 2, -1 << 47)


@cocotb.test()
async def clear_and_reset_empty_the_queue(dut):
    capture = await begin(dut)
    for last in (dict(clear=1), dict(rst=1)):
        for n in range(5):
            await capture.cycle(index=1, position=n)
        assert (await capture.cycle(software=1, **last))[:3] == (0, None, capture.depth)
        assert await capture.read() == []


@cocotb.test()
async def a_pop_of_an_empty_queue_does_nothing(dut):
    capture = await begin(dut)
    for _ in range(3):
        assert await capture.cycle(pop=1) == (0, None, capture.depth, 0)
    await capture.cycle(index=1, pop=1)
    assert len(await capture.read()) == 1


@cocotb.test()
async def any_events_match_the_model_in_every_cycle(dut):
    capture, probe = await begin(dut), 0
    for cycle in range(8000):
        busy = (0.05, 0.5, 0.9)[cycle // 500 % 3]
        probe ^= random.getrandbits(capture.probes) if random.random() < busy else 0
        await capture.cycle(
            enabled=random.getrandbits(2 * capture.probes + 3),
            probe=probe,
            position=random.randrange(-1 << 47, 1 << 47),
            now=random.getrandbits(len(dut.now)),
            valid=int(random.random() < 0.1),
            pop=int(random.random() < 0.4),
            clear=int(random.random() < 0.004),
            rst=int(random.random() < 0.002),
            **{source: int(random.random() < busy / 2) for source in ("index", "tick", "software")},
        )


@pytest.mark.parametrize(
    "probes, time_w, depth, zeros", [(2, 32, 16, 0), (1, 64, 4, 0), (2, 32, 16, 14)]
)
def test_position_capture(probes, time_w, depth, zeros):
    run("position_capture", __file__, PROBES=probes, TIME_W=time_w, DEPTH=depth, ZEROS=zeros)
