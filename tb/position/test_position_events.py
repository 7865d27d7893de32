# SPDX-License-Identifier: Apache-2.0
"""position_events: what reaches the queue of captures and the compare pulses, with and without each
of them, and every cycle against the models of its blocks.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.ports import Ports
from tb.position.position_capture import INDEX, SOFTWARE, TICK, rising
from tb.position.position_compare import wrapped
from tb.position.position_events import CAPTURED, COMPARED, PositionEvents

QUIET = dict(
    by_counts=0,
    index_found=0,
    capture_now=0,
    sync=0,
    tick=0,
    probe=0,
    now=0,
    position_valid=0,
    step_made=0,
    position=0,
    shifted=0,
    shifted_periods=0,
    capture_sources=127,
    capture_next=0,
    capture_clear=0,
    compare_start=0,
    compare_step=0,
    compare_count=0,
    pulse_length=1,
    gap_length=1,
    compare_arm=0,
    compare_disarm=0,
)


class Bench:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut = dut
        self.delay, self.zeros = int(dut.CAPTURE_DELAY.value), int(dut.ZEROS.value)
        self.has_capture = bool(int(dut.HAS_CAPTURE.value))
        self.has_compare = bool(int(dut.HAS_COMPARE.value))
        self.model = PositionEvents(self.delay, self.has_capture, self.has_compare)
        self.ports, self.settings, self.now = Ports(dut), {}, 0

    def output(self, name):
        """The level of an output."""
        return self.ports.signed(name) if name == "captured_position" else self.ports[name]

    async def clk(self, rst=0, **inputs):
        """{output: level} after a cycle with these inputs; a position is in steps of 2^ZEROS."""
        self.now = (self.now + 1) % 2**32
        values = QUIET | dict(now=self.now) | self.settings | inputs
        values["position"] = wrapped(values["position"] << self.zeros)
        self.ports.drive(values | dict(rst=rst))
        await FallingEdge(self.dut.clk)
        want = self.model.step(values, rst)
        bits = {"captured_position": want["captured_position"] % 2**48} if want["present"] else {}
        self.ports.check(want | bits, self.now)
        return want

    async def idle(self, cycles, **inputs):
        """The outputs after each of some cycles."""
        return [await self.clk(**inputs) for _ in range(cycles)]

    async def captured(self):
        """(sources, position in steps of 2^ZEROS) of all captures, the oldest first."""
        found = []
        while (seen := await self.clk(capture_sources=0))["present"]:
            found.append((seen["captured_sources"], seen["captured_position"] >> self.zeros))
            await self.clk(capture_sources=0, capture_next=1)
        return found


async def begin(dut):
    await start(dut, **QUIET)
    await FallingEdge(dut.clk)
    bench = Bench(dut)
    await bench.clk(rst=1)
    return bench


@cocotb.test()
async def an_index_captures_the_position_of_its_phase_or_of_its_count(dut):
    bench = await begin(dut)
    await bench.clk(index_found=1, position=7)
    assert await bench.captured() == [(INDEX, 7)]
    for cycle in range(bench.delay + 2):
        await bench.clk(by_counts=1, index_found=int(cycle == 0), position=100 + cycle)
    assert await bench.captured() == [(INDEX, 100 + bench.delay)]
    await bench.clk(index_found=1, position=9, capture_sources=127 - INDEX)
    assert await bench.captured() == []


@cocotb.test()
async def each_other_source_captures_if_the_queue_is_built(dut):
    bench = await begin(dut)
    events = [
        (TICK, dict(tick=1)),
        (SOFTWARE, dict(capture_now=1)),
        (SOFTWARE, dict(sync=1)),
        *((rising(n), dict(probe=1 << n)) for n in range(2)),
    ]
    for source, inputs in events:
        await bench.clk()
        await bench.clk(position=-5, **inputs)
        assert await bench.captured() == ([(source, -5)] if bench.has_capture else [])


@cocotb.test()
async def the_age_is_that_of_the_sample_or_of_the_count(dut):
    bench = await begin(dut)
    for by_counts in (0, 1):
        await bench.clk(by_counts=by_counts, position_valid=1)
        await bench.idle(3, by_counts=by_counts)
        await bench.clk(by_counts=by_counts, step_made=1)
        await bench.idle(5, by_counts=by_counts)
        # with counts, the index captures CAPTURE_DELAY cycles later
        await bench.clk(by_counts=by_counts, index_found=1)
        await bench.idle(bench.delay + 1, by_counts=by_counts)
        if bench.has_capture:
            age = bench.output("captured_age")
            assert age == (5 + bench.delay if by_counts else 10)
        await bench.clk(capture_clear=1)


@cocotb.test()
async def a_queue_holds_16_captures_and_an_index_alone_1(dut):
    bench = await begin(dut)
    places = 16 if bench.has_capture else 1
    assert bench.output("capture_free") == places
    for n in range(places):
        assert not (await bench.clk(index_found=1, position=n))["overrun"]
        assert bench.output("capture_free") == places - 1 - n
    assert (await bench.clk(index_found=1))["overrun"]
    assert await bench.captured() == [(INDEX, n) for n in range(places)]
    await bench.clk(index_found=1)
    await bench.clk(capture_clear=1)
    assert await bench.captured() == []


@cocotb.test()
async def compare_sends_its_pulses_if_it_is_built(dut):
    bench = await begin(dut)
    bench.settings = dict(
        compare_start=10 << bench.zeros,
        compare_step=5 << bench.zeros,
        compare_count=3,
        pulse_length=2,
        gap_length=2,
    )
    await bench.clk(compare_arm=1)
    assert bench.output("armed") == int(bench.has_compare)
    pulses = 0
    for position in range(40):
        seen = await bench.clk(position_valid=1, position=position)
        pulses += seen["compare_pulse"]
        pulses += sum(one["compare_pulse"] for one in await bench.idle(6, position=position))
    if bench.has_compare:
        assert (pulses, bench.output("passed"), bench.output("armed")) == (6, 3, 0)
    else:
        assert pulses == 0 and [bench.output(name) for name in COMPARED] == [0] * len(COMPARED)


@cocotb.test()
async def without_the_queue_only_the_position_is_reported(dut):
    bench = await begin(dut)
    await bench.idle(3)
    await bench.clk(index_found=1, position=3)
    await bench.idle(2)
    got = [bench.output(name) for name in CAPTURED]
    if bench.has_capture:
        assert got[0] == INDEX and got[2] > 0
    else:
        assert got == [1, 0, 0, 3 << bench.zeros]


@cocotb.test()
async def every_bit_of_the_lengths_reaches_compare(dut):
    bench = await begin(dut)
    for bit in range(3, 24) if bench.has_compare else ():
        for long, short in (("pulse_length", "gap_length"), ("gap_length", "pulse_length")):
            bench.settings = {long: 2 + (1 << bit), short: 1, "compare_start": 1 << bench.zeros}
            bench.settings["compare_step"] = 1 << bench.zeros
            await bench.clk(compare_arm=1)
            await bench.clk(position_valid=1, position=0)
            await bench.clk(position_valid=1, position=100)
            seen = [one["compare_pulse"] for one in await bench.idle(10)]
            assert seen[1:] == [1, *[int(long == "pulse_length")] * 8]
            await bench.clk(rst=1)


@cocotb.test()
async def any_input_matches_the_models_in_every_cycle(dut):
    bench, position, probe, by_counts, start_at = await begin(dut), 0, 0, 0, 0
    period = 1 << 16 - bench.zeros  # in steps of 2^ZEROS, as position is
    for cycle in range(4000):
        if cycle % 200 == 0:
            by_counts = random.getrandbits(1)
            position = random.getrandbits(48 - bench.zeros)
            start_at = position + random.randrange(-100, 100)
            bench.settings = dict(
                compare_step=random.randrange(-50, 50) << bench.zeros,
                compare_count=random.choice((0, 0, 1, 3, 20)),
                pulse_length=random.choice((0, 1, 4)),
                gap_length=random.choice((0, 1, 3)),
                capture_sources=random.choice((127, random.getrandbits(7))),
            )
        position += random.randrange(-20, 22)
        probe ^= random.getrandbits(2) if random.random() < 0.05 else 0
        rst = int(random.random() < 0.002)
        often = {name: int(random.random() < 0.3) for name in ("position_valid", "step_made")}
        at_times = ("index_found", "capture_now", "sync", "tick")
        seldom = {name: int(random.random() < 0.04) for name in at_times}
        rarely = {
            name: int(not rst and random.random() < share)
            for name, share in {
                "capture_clear": 0.005,
                "compare_arm": 0.02,
                "compare_disarm": 0.002,
                "shifted": 0.02,
            }.items()
        }
        periods = random.choice((1, -3, random.randrange(-(2**31), 2**31)))
        await bench.clk(
            rst,
            by_counts=by_counts,
            probe=probe,
            position=position,
            compare_start=wrapped(start_at << bench.zeros),
            shifted_periods=periods,
            capture_next=int(random.random() < 0.1),
            **often,
            **seldom,
            **rarely,
        )
        if rarely["shifted"]:  # the position jumps, and the points are set anew as far from it
            position, start_at = (place + periods * period for place in (position, start_at))


@pytest.mark.parametrize(
    "delay, zeros, has_capture, has_compare",
    [(2, 0, 1, 1), (3, 14, 1, 0), (2, 0, 0, 1), (2, 0, 0, 0)],
)
def test_position_events(delay, zeros, has_capture, has_compare):
    run(
        "position_events",
        __file__,
        CAPTURE_DELAY=delay,
        ZEROS=zeros,
        HAS_CAPTURE=has_capture,
        HAS_COMPARE=has_compare,
    )
