# SPDX-License-Identifier: Apache-2.0
"""feedback_channel with its position from the counts of A/B/Z, built with and without sine and
cosine. The position is exact with an edge in every cycle, at the index, after align, and when it
counts the axis' own steps.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from moire.made.registers import FIELDS
from tb.bench import needs, run, seed
from tb.interpolate.feedback_inputs import begin

TURN = [(0, 0), (1, 0), (1, 1), (0, 1)]  # a leads b: up
QUARTER = 1 << 14
LATENCY = 5  # cycles from the pins to position: filter 1, decoder 2, position 2; table 1


def latency(dut):
    return LATENCY + bool(int(dut.SEGMENTS.value))


def register(name):
    """(word, {field: its lowest bit}) of a register of the block feedback."""
    fields = [known for known in FIELDS if known.block == "feedback" and known.register == name]
    return fields[0].address(0) % 256 // 4, {known.field: known.low for known in fields}


class Bench:
    """A scale in front of the design. At reset the scale is at `count`; this is the position 0 of
    the design.
    """

    @classmethod
    async def begin(cls, dut, count=0, mode=0, steps=0):
        bench = cls()
        bench.dut, bench.count, bench.latency = dut, count, latency(dut)
        await begin(dut, **dict(zip("ab", TURN[count % 4])))
        for _ in range(11):  # after reset, filter and decoder only take over the levels
            await FallingEdge(dut.clk)
        await bench.write("decoder_mode", value=mode)
        await bench.write("position_source", counts=1, steps=steps)
        await bench.sample()
        assert bench.position() == 0
        return bench

    def put(self, name, **fields):
        word, low = register(name)
        self.dut.word.value = word
        self.dut.wdata.value = (
            sum(value << low[field] for field, value in fields.items()) & 0xFFFFFFFF
        )
        self.dut.select.value = self.dut.write.value = 1

    async def write(self, name, **fields):
        self.put(name, **fields)
        await FallingEdge(self.dut.clk)
        self.dut.select.value = self.dut.write.value = 0

    async def wide(self, name, value):
        word = register(name)[0]
        for more, half in enumerate((value & 0xFFFFFFFF, value >> 32 & 0xFFFFFFFF)):
            (
                self.dut.word.value,
                self.dut.wdata.value,
                self.dut.select.value,
                self.dut.write.value,
            ) = word + more, half, 1, 1
            await FallingEdge(self.dut.clk)
            self.dut.wdata_low.value = half
        self.dut.select.value = self.dut.write.value = 0

    async def settle_segments(self):
        """Wait until the correction of the segment table for this position is in force."""
        for _ in range(3):
            await self.sample()
            for _ in range(32):
                await FallingEdge(self.dut.clk)
        await self.sample()

    async def read(self, name, more=0):
        self.dut.word.value, self.dut.select.value = register(name)[0] + more, 1
        await FallingEdge(self.dut.clk)
        self.dut.select.value = 0
        return int(self.dut.rdata.value)

    async def sample(self):
        self.dut.sample_tick.value = 1
        await FallingEdge(self.dut.clk)
        self.dut.sample_tick.value = 0
        for _ in range(self.latency):
            await FallingEdge(self.dut.clk)

    def pins(self, z=0):
        self.dut.a.value, self.dut.b.value = TURN[self.count % 4]
        self.dut.z.value = int(z)

    def position(self):
        return self.dut.position.value.to_signed()

    async def go(self, steps, at_index=lambda count: False, clk=1):
        """Each step takes `clk` cycles; then the pipeline empties. Returns the positions after
        each clk.
        """
        positions = []
        for step in steps:
            self.count += step
            self.pins(at_index(self.count))
            for _ in range(clk):
                await FallingEdge(self.dut.clk)
                positions.append(self.position())
        for _ in range(self.latency):
            await FallingEdge(self.dut.clk)
            positions.append(self.position())
        return positions

    async def captured(self):
        """All captures, oldest first."""
        taken = []
        while await self.read("capture_state") & 1:
            low, high = (
                await self.read("captured_position"),
                await self.read("captured_position", 1),
            )
            taken.append((high << 32 | low) - (1 << 64 if high >> 31 else 0))
            await self.write("strobes", capture_next=1)
            await FallingEdge(self.dut.clk)
            await FallingEdge(self.dut.clk)
        return taken


@cocotb.test()
async def latency_is_5_and_position_is_exact_at_an_edge_every_cycle(dut):
    bench, source = await Bench.begin(dut), random.Random(seed())
    steps = [1] * 40 + [-1] * 90 + [source.choice((-1, 0, 1)) for _ in range(4000)] + [1, -1] * 50
    expected, count = [], 0
    for step in steps:
        count += step
        expected.append(count * QUARTER)
    got = await bench.go(steps)
    assert got[bench.latency - 1 : bench.latency - 1 + len(expected)] == expected
    assert (
        bench.position()
        == count * QUARTER
        == bench.dut.quadrature_count.value.to_signed() * QUARTER
    )


@cocotb.test()
async def the_index_is_captured_at_its_count_in_both_directions_at_any_speed(dut):
    for first_count in range(
        4
    ):  # so that the index begins with any edge of A or B, in the same cycle
        for clk in (1, 2, 3, 7):
            bench = await Bench.begin(dut, first_count)
            await bench.write("index", up=1, down=1, each=1)
            await bench.write("capture_sources", value=1)
            for direction in (1, -1, 1):
                await bench.go([direction] * 18, lambda count, at=first_count + 9: count == at, clk)
            assert await bench.captured() == [9 * QUARTER] * 3, (first_count, clk)


@cocotb.test()
async def a_wide_index_is_captured_at_the_same_count_when_gated_by_a_and_b(dut):
    for gated, want in ((0, [8, 10, 8]), (3, [9, 9, 9])):
        bench = await Bench.begin(dut)
        await bench.write(
            "index", up=1, down=1, each=1, gate_mask=gated, gate=0b01
        )  # count 9: a = 1, b = 0
        await bench.write("capture_sources", value=1)
        for direction in (1, -1, 1):
            await bench.go([direction] * 18, lambda count: 8 <= count <= 10, 2)
        assert await bench.captured() == [count * QUARTER for count in want]


@cocotb.test()
async def the_age_of_a_captured_index_is_the_time_since_the_count_whatever_samples_come(dut):
    bench = await Bench.begin(dut)
    await bench.write("index", up=1, down=1, each=1)
    await bench.write("capture_sources", value=1)
    for step, cycles in ((1, 0), (1, 1), (1, 40), (-1, 3), (-1, 90)):
        bench.count += step
        bench.pins(z=cycles == 0)
        for cycle in range(cycles):
            dut.sample_tick.value = int(cycle % 7 == 0)
            await FallingEdge(dut.clk)
        dut.sample_tick.value = 0
        bench.pins(z=1)
        await bench.go([], clk=1)
        bench.pins(z=0)
        await bench.go([])
        assert await bench.read("captured") >> 7 == cycles
        await bench.write("strobes", capture_next=1)


@cocotb.test()
async def an_armed_index_is_captured_once(dut):
    bench = await Bench.begin(dut)
    await bench.write("index", up=1)
    await bench.write("capture_sources", value=1)
    await bench.write("strobes", arm_index=1)
    for direction in (1, -1, 1):
        await bench.go([direction] * 18, lambda count: count == 9)
    assert await bench.captured() == [9 * QUARTER]


@cocotb.test()
async def align_moves_position_by_whole_counts_also_together_with_an_edge(dut):
    for counts in (-2, -1, 1, 2):
        for wait in range(
            latency(dut) + 2
        ):  # the strobe comes in each cycle of an edge's latency, and in none
            bench = await Bench.begin(dut)
            await bench.go([1] * 6)
            bench.count += 1
            bench.pins()
            for _ in range(wait):
                await FallingEdge(dut.clk)
            await bench.write("align", value=counts & 7)
            await bench.go([])
            assert bench.position() == (7 + counts) * QUARTER
            assert dut.quadrature_count.value.to_signed() == 7


@cocotb.test()
async def shift_moves_the_origin_by_whole_periods_also_together_with_an_edge(dut):
    for periods in (-(1 << 31), -3, 1, (1 << 31) - 1):
        for wait in range(latency(dut) + 2):
            bench = await Bench.begin(dut)
            bench.count += 1
            bench.pins()
            for _ in range(wait):
                await FallingEdge(dut.clk)
            dut.shift.value, dut.shift_periods.value = 1, periods
            await FallingEdge(dut.clk)
            dut.shift.value = dut.shift_periods.value = 0
            await bench.go([])
            assert bench.position() == periods * 4 * QUARTER + QUARTER


@cocotb.test()
async def own_steps_are_counted_in_their_direction_whatever_the_edge_filter_is_set_to(dut):
    bench = await Bench.begin(dut, mode=3, steps=1)
    dut.deglitch.value = 63
    count = 0
    for direction in (1, 0, 0, 1):
        dut.own_downward.value = 1 - direction
        await FallingEdge(dut.clk)  # set-up
        for _ in range(5):
            for level in (1, 0):
                dut.own_step.value = level
                await FallingEdge(dut.clk)
            count += 1 if direction else -1
        await bench.go([])
        assert bench.position() == count * QUARTER


PULSE_TOO_SHORT = 5  # of encoder_events


async def pulses(dut, pulse, gap, number=20):
    """Pulses of A with these lengths and gaps in cycles; returns how many events pulse_too_short
    they raise.
    """
    reported = 0
    for level, clk in [(1, pulse), (0, gap)] * number + [(0, 300)]:
        dut.a.value = level
        for _ in range(clk):
            await FallingEdge(dut.clk)
            reported += int(dut.events.value) >> PULSE_TOO_SHORT & 1
    return reported


@cocotb.test()
async def pulses_and_gaps_too_short_for_the_edge_filter_are_each_reported(dut):
    bench = await Bench.begin(dut, mode=3)
    grbl = 244  # cycles of 25 MHz: its pulses are high for 9.76 us
    for skip, needed, pulse, gap, counted, reported in (
        (0, 10, 10, 10, 20, 0),
        (0, 10, 9, 30, 0, 20),
        (0, 10, 30, 9, 1, 19),
        (4, 50, grbl, 756, 0, 20),  # a sample every 5 cycles: 250 cycles
        (4, 25, grbl, 756, 20, 0),
    ):
        await bench.write("edge_filter", skip=skip)
        dut.deglitch.value = needed
        before = bench.position()
        assert await pulses(dut, pulse, gap) == reported
        await bench.sample()
        assert abs(bench.position() - before) == counted * QUARTER and counted + reported == 20


@cocotb.test()
async def glitches_of_a_scale_and_of_pins_that_are_not_counted_raise_no_pulse_too_short(dut):
    for mode, steps in ((0, 0), (1, 0), (2, 0), (3, 1)):
        await Bench.begin(dut, mode=mode, steps=steps)
        dut.deglitch.value = 10
        assert await pulses(dut, 5, 30) == 0


@cocotb.test()
async def reset_in_mid_flow_drops_the_edge(dut):
    bench = await Bench.begin(dut)
    await bench.go([1] * 6)
    bench.count += 1
    bench.pins()
    await FallingEdge(dut.clk)
    dut.rst.value = 1
    await FallingEdge(dut.clk)
    dut.rst.value = 0
    for _ in range(20):
        await FallingEdge(dut.clk)
        assert bench.position() == 0 and not int(dut.position_valid.value)


@cocotb.test()
async def with_a_segment_table_positions_captures_and_compare_points_are_on_the_corrected_scale(
    dut,
):
    needs(int(dut.SEGMENTS.value), "built without a segment table")
    bench, errors = await Bench.begin(dut), [0, 900, -1500, 700]  # of three segments of 8 counts
    for border, error in enumerate(errors):
        await bench.write("segment_point", value=error & 0xFFFFFF, border=border)
        await bench.write("segment_read", border=border)
        await bench.go([])
        assert await bench.read("segment_stored") == error & 0xFFFFFFFF
    await bench.wide("segment_origin", 8 * QUARTER)
    await bench.wide("segment_length", 8 * QUARTER)
    await bench.go([1] * 12)
    moved = []
    await bench.write("segment_use", enable=1, linear=1, segments=3)
    for _ in range(40):
        if int(dut.moved.value):
            moved.append(dut.moved_by.value.to_signed())
        await FallingEdge(dut.clk)
    assert moved == [-450] and bench.position() == 12 * QUARTER - 450
    assert await bench.read("segment_state") == 0b101  # loaded, in force
    for step in (1, -1):  # the sign is right in both directions
        for _ in range(12 if step > 0 else 30):
            await bench.go([step])
            await bench.settle_segments()
            border = (bench.count - 8) / 8
            left = max(0, min(2, int(border)))
            error = errors[left] + (errors[left + 1] - errors[left]) * max(0, min(1, border - left))
            assert abs(bench.position() - bench.count * QUARTER + error) <= 0.5
            assert bool(await bench.read("segment_state") & 0b010) == (not 0 <= border < 3)
    await bench.go([1] * (16 - bench.count))
    await bench.settle_segments()
    await bench.write("capture_sources", value=4)
    await bench.wide("compare_start", 16 * QUARTER - 900)
    await bench.wide("compare_step", 4 * QUARTER)
    await bench.write("compare_count", value=1)
    for pulses, step in (
        (0, -1),
        (1, 1),
    ):  # armed one count below, it fires at the corrected position
        await bench.go([step])
        await bench.settle_segments()
        await bench.write("strobes", capture_now=1, compare_arm=1 - pulses)
        await bench.sample()
        assert await bench.read("compare_passed") == pulses
    assert await bench.captured() == [15 * QUARTER - 788, 16 * QUARTER - 900]


@cocotb.test()
async def a_shift_moves_the_segment_table_with_the_scale(dut):
    needs(int(dut.SEGMENTS.value), "built without a segment table")
    bench = await Bench.begin(dut)
    for border, error in enumerate((0, 800)):
        await bench.write("segment_point", value=error, border=border)
    await bench.wide("segment_length", 40 * QUARTER)
    await bench.write("segment_use", enable=1, linear=1, segments=1)
    await bench.go([1] * 20)
    await bench.settle_segments()
    assert bench.position() == 20 * QUARTER - 400
    dut.shift.value, dut.shift_periods.value = 1, -7
    await FallingEdge(dut.clk)
    dut.shift.value = dut.shift_periods.value = 0
    await bench.go([])
    assert bench.position() == -8 * QUARTER - 400
    await bench.go([1] * 10)
    await bench.settle_segments()
    assert bench.position() == 2 * QUARTER - 600


@cocotb.test()
async def without_sine_and_cosine_the_converter_rests_and_all_that_comes_of_it_is_zero(dut):
    needs(not int(dut.HAS_SINE.value), "built with sine and cosine")
    bench, source = await Bench.begin(dut), random.Random(seed())
    settings = (
        "correction_offset",
        "correction_gain",
        "correction_quadrature_error",
        "recorder",
        "signal_fault_mask",
        "lissajous_limits",
        "jump_limits",
        "channel_limits",
        "drift_limits",
        "quadrature_limits",
        "harmonic_point",
        "harmonic_enable",
    )
    await bench.write("position_source", counts=0)
    for name in settings:
        dut.word.value, dut.wdata.value = register(name)[0], 0xFFFFFFFF
        dut.select.value = dut.write.value = 1
        await FallingEdge(dut.clk)
    dut.select.value = dut.write.value = 0
    await bench.write(
        "strobes", load_correction=1, swap_harmonics=1, record=1, clear_signal_faults=1
    )
    dut.amplitude_low.value, dut.sensing_written.value, dut.limit_written.value = 65535, 1, 1
    count = 0
    for _ in range(2000):
        step = source.choice((-1, 0, 1))
        count += step
        bench.count += step
        bench.pins()
        for pin in (dut.sample_tick, dut.adc_sin, dut.adc_cos):
            pin.value = source.getrandbits(1)
        await FallingEdge(dut.clk)
        assert (int(dut.adc_cs_n.value), int(dut.adc_sclk.value)) == (1, 1)
        for idle in (
            dut.sin,
            dut.cos,
            dut.sample_rejected,
            dut.phase,
            dut.amplitude,
            dut.encoder_fault,
            dut.events,
        ):
            assert int(idle.value) == 0
    await bench.go([])
    assert bench.position() == count * QUARTER, (
        "counts make the position even where phases were chosen"
    )
    for name in (
        *settings,
        "recorder_state",
        "recorder_word",
        "signal_faults",
        "first_signal_faults",
    ):
        assert await bench.read(name) == 0, name


@pytest.mark.parametrize("sine, segments", [(0, 0), (0, 255), (1, 255)])
def test_feedback_counts(sine, segments):
    run("feedback_channel", __file__, HAS_SINE=sine, SEGMENTS=segments)
