# SPDX-License-Identifier: Apache-2.0
"""Tests of incremental_encoder: latencies, flags, every index fault known from the field, time
stamps, and random pins against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, ValueChange

from tb.bench import clk_now, needs, run, start
from tb.decode.incremental_encoder import IncrementalEncoder, Setup
from tb.decode.index_latch import Settings

TURN = [(0, 0), (1, 0), (1, 1), (0, 1)]  # a leads b: up
EACH = Settings(each=1)
CLEARS = Settings(each=1, clears=1)


class Bench:
    """The design and its model side by side. An encoder whose index is active where
    `at_index(position)` holds is moved over them.
    """

    @classmethod
    async def begin(cls, dut, setup=None, levels=(0, 0, 0), ready=True):
        bench = cls()
        bench.dut, bench.setup, bench.now, bench.position = dut, setup or Setup(), 0, 0
        bench.model = IncrementalEncoder(int(dut.W.value), int(dut.CHECK.value))
        bench.put(levels)
        await start(dut, a=levels[0], b=levels[1], z=levels[2], own_a=0, own_b=0, now=0)
        bench.model.step(bench.setup, *levels, 0, rst=1)
        bench.model.step(bench.setup, *levels, 0, rst=1)
        if ready:
            await bench.play([levels] * 12)
        return bench

    def put(self, levels, rst=0, arm=0, clear_flags=0, own=(0, 0)):
        dut, setup, index = self.dut, self.setup, self.setup.index
        values = {
            "filter_skip": setup.skip,
            "filter_required": setup.required,
            "filter_tolerated": setup.tolerated,
            "mode": setup.mode,
            "index_low": index.active_low,
            "index_gate_mask": index.gate_mask,
            "index_gate": index.gate,
            "index_up": index.take_up,
            "index_down": index.take_down,
            "index_each": index.each,
            "index_clears": index.clears,
            "counts_per_revolution": index.counts_per_revolution,
            "illegal_enable": setup.illegal_enable,
            "arm_index": arm,
            "clear_flags": clear_flags,
            "now": self.now,
            "a": levels[0],
            "b": levels[1],
            "z": levels[2],
            "own": setup.own,
            "own_a": own[0],
            "own_b": own[1],
            "rst": rst,
        }
        for name, value in values.items():
            getattr(dut, name).value = value

    async def play(self, rows, rst=0, arm=0, clear_flags=0, own=None):
        """Apply levels (a, b, z), one row per cycle; the strobes are applied in the first row.
        `own` holds the levels (a, b) made by the node, one per cycle. Returns the outputs of each
        cycle by name.
        """
        out = []
        for cycle, levels in enumerate(rows):
            self.now = (self.now + 1) % (1 << int(self.dut.TIME_W.value))
            strobes = {"arm": arm, "clear_flags": clear_flags} if cycle == 0 else {}
            own_now = own[cycle] if own else (0, 0)
            self.put(levels, rst, **strobes, own=own_now)
            await RisingEdge(self.dut.clk)
            await FallingEdge(self.dut.clk)
            want = self.model.step(
                self.setup,
                *levels,
                self.now,
                rst=rst,
                **strobes,
                own_a=own_now[0],
                own_b=own_now[1],
            )
            got = {name: self.read(name) for name in want if want[name] is not None}
            wrong = {
                name: (value, want[name]) for name, value in got.items() if value != want[name]
            }
            assert not wrong, f"cycle {cycle}, {self.setup}: (design, model) {wrong}"
            out.append(want | {"now": self.now})
        return out

    def read(self, name):
        value = getattr(self.dut, name).value
        return value.to_signed() if name in ("count", "step", "index_count") else int(value)

    async def go(self, positions, at_index=lambda position: 0, cycle=1, **strobes):
        """Visit these positions, `cycle` cycles each, then wait for the pipeline; the outputs of
        each cycle.
        """
        rows = [
            (*TURN[position % 4], int(bool(at_index(position))))
            for position in positions
            for _ in range(cycle)
        ]
        return await self.play(rows + rows[-1:] * 6, **strobes)


def found(out):
    """The index_count at each index found."""
    return [row["index_count"] for row in out if row["index_found"]]


def there_and_back(*turns):
    """The positions from the first turning point to each next one."""
    path = [turns[0]]
    for turn in turns[1:]:
        step = 1 if turn > path[-1] else -1
        path += range(path[-1] + step, turn + step, step)
    return path


@cocotb.test()
async def latency_is_n_samples_and_2_cycles_from_the_pins(dut):
    for required in (0, 1, 3):
        bench = await Bench.begin(dut, Setup(required=required))
        out = await bench.play([(1, 0, 0)] * 12)
        assert [row["count"] for row in out].index(1) + 1 == max(required, 1) + 2


@cocotb.test()
async def the_filter_has_each_bit_of_its_settings(dut):
    for name, width in (("required", "FILTER_W"), ("skip", "SKIP_W")):
        for value in (1 << bit for bit in range(int(getattr(dut, width).value))):
            await Bench.begin(dut, Setup(**({"required": 2} | {name: value})))
            dut.a.value = 1
            began = clk_now()
            await ValueChange(dut.count)
            await FallingEdge(dut.clk)
            longest = 2 * (value + 1) if name == "skip" else value  # the samples that are required
            assert longest / 2 <= clk_now() - began - 2 <= longest


@cocotb.test()
async def index_and_count_arrive_together(dut):
    bench = await Bench.begin(dut, Setup(required=3, index=EACH))
    out = await bench.play([(1, 0, 1)] * 12)
    assert [row["index_found"] for row in out].index(1) + 1 == 3 + 2
    assert [row["count"] for row in out].index(1) + 1 == 3 + 2 and found(out) == [1]


@cocotb.test()
async def an_index_that_coincides_with_a_count_edge_clears_and_latches_exactly(dut):
    for cycle in (1, 2, 5):  # riocore acknowledges the index and does not clear
        bench = await Bench.begin(dut, Setup(index=CLEARS))
        out = await bench.go(there_and_back(0, 9), lambda position: position == 6, cycle)
        assert found(out) == [6] and out[-1]["count"] == 3
        bench = await Bench.begin(dut, Setup(index=EACH))
        out = await bench.go(there_and_back(0, 9, 2), lambda position: position == 6, cycle)
        assert found(out) == [6, 6] and out[-1]["count"] == 2
        bench = await Bench.begin(dut, Setup(index=CLEARS))
        out = await bench.go(there_and_back(0, -9), lambda position: position == -6, cycle)
        assert found(out) == [-6] and out[-1]["count"] == -3


@cocotb.test()
async def a_cleared_count_never_shows_the_old_number_at_the_index(dut):
    bench = await Bench.begin(dut, Setup(index=CLEARS))
    out = await bench.go(there_and_back(0, 9), lambda position: position == 6)
    assert [row["count"] for row in out][:11] == [0, 0, 0, 1, 2, 3, 4, 5, 0, 1, 2]


@cocotb.test()
async def a_wide_index_clears_once(dut):
    bench = await Bench.begin(
        dut, Setup(index=CLEARS)
    )  # PandABlocks clears for as long as the index is present
    out = await bench.go(there_and_back(0, 12, 8), lambda position: 3 <= position <= 11)
    assert (
        found(out) == [3, 8] and out[-1]["count"] == -3
    )  # the far side is another edge: gate the index or take one direction


@cocotb.test()
async def a_gated_index_wider_than_a_period_is_found_once_a_pass(dut):
    bench = await Bench.begin(dut, Setup(index=EACH.but(gate_mask=3, gate=3)))
    out = await bench.go(there_and_back(0, 20), lambda position: 3 <= position <= 15)
    assert found(out) == [6]


@cocotb.test()
async def a_gated_index_lies_at_the_same_count_in_both_directions(dut):
    for gate, position in ((0, 8), (1, 9), (3, 6), (2, 7)):  # {b, a}
        bench = await Bench.begin(dut, Setup(index=EACH.but(gate_mask=3, gate=gate)))
        out = await bench.go(
            there_and_back(0, 14, 0, 14), lambda at, position=position: abs(at - position) <= 1
        )
        assert found(out) == [position] * 3


@cocotb.test()
async def the_index_is_taken_in_the_enabled_direction_only(dut):
    for up, down, want in ((1, 0, [5, 5]), (0, 1, [7]), (1, 1, [5, 7, 5]), (0, 0, [])):
        bench = await Bench.begin(dut, Setup(index=EACH.but(take_up=up, take_down=down)))
        out = await bench.go(there_and_back(0, 12, 0, 12), lambda position: 5 <= position <= 7)
        assert found(out) == want


@cocotb.test()
async def a_low_index_is_found_where_it_falls(dut):
    bench = await Bench.begin(dut, Setup(index=EACH.but(active_low=1)), levels=(0, 0, 1))
    assert found(await bench.go(there_and_back(0, 12), lambda position: position != 7)) == [7]


@cocotb.test()
async def once_takes_one_index_for_each_arm(dut):
    bench = await Bench.begin(dut, Setup(index=Settings()))
    index = lambda position: position % 10 == 5
    assert found(await bench.go(there_and_back(0, 20), index)) == []
    out = await bench.go(there_and_back(21, 50), index, arm=1)
    assert found(out) == [25] and out[0]["index_armed"] and not out[-1]["index_armed"]
    assert found(await bench.go(there_and_back(50, 30), index)) == []


@cocotb.test()
async def arming_inside_an_index_waits_for_the_next(dut):
    bench = await Bench.begin(dut, Setup(index=Settings()))
    index = lambda position: 3 <= position <= 11 or position == 16
    await bench.go(there_and_back(0, 6), index)
    out = await bench.go(there_and_back(6, 20), index, arm=1)
    assert found(out) == [16]


@cocotb.test()
async def an_index_present_at_power_up_and_new_settings_make_no_event(dut):
    bench = await Bench.begin(dut, Setup(index=CLEARS), levels=(1, 0, 1), ready=False)
    assert found(await bench.play([(1, 0, 1)] * 30)) == []
    for index in (
        EACH.but(active_low=1),
        EACH,
        EACH.but(gate_mask=3, gate=3),
        EACH.but(gate_mask=3, gate=1),
        EACH,
    ):
        bench.setup = Setup(index=index)
        assert found(await bench.play([(1, 0, 1)] * 8)) == []


@cocotb.test()
async def counts_per_revolution_are_checked_at_any_number(dut):
    needs(int(dut.CHECK.value), "built without the check of revolutions")
    for per, clears in (
        (10, 0),
        (10, 1),
        (7, 0),
        (16, 1),
    ):  # not a power of two, and not a multiple of the period
        setup = Setup(index=EACH.but(counts_per_revolution=per, clears=clears))
        bench = await Bench.begin(dut, setup)
        out = await bench.go(
            there_and_back(0, 3 * per + 2, -per - 2, per + 2),
            lambda position, per=per: position % per == 3,
        )
        assert len(found(out)) > 7 and not any(row["revolution_wrong"] for row in out)
        out = await bench.go(
            there_and_back(per + 2, 4 * per), lambda position, per=per: position % per == 4
        )  # the scale has slipped
        assert sum(row["revolution_wrong"] for row in out) == 1 and out[-1]["revolution_fault"]
        out = await bench.go([4 * per], clear_flags=1)
        assert not out[-1]["revolution_fault"]


@cocotb.test()
async def the_check_forgets_when_it_is_switched_off(dut):
    bench = await Bench.begin(dut, Setup(index=EACH.but(counts_per_revolution=10)))
    await bench.go(there_and_back(0, 5), lambda position: position == 3)
    bench.setup = Setup(index=EACH)
    await bench.go(there_and_back(5, 9))
    bench.setup = Setup(index=EACH.but(counts_per_revolution=10))
    out = await bench.go(there_and_back(9, 30), lambda position: position in (14, 24))
    assert len(found(out)) == 2 and not any(row["revolution_fault"] for row in out)


@cocotb.test()
async def an_illegal_edge_is_never_counted_and_stays_readable_until_cleared(dut):
    bench = await Bench.begin(dut, Setup(illegal_enable=1))  # OnStepX #103 counts an invalid state
    out = await bench.play([(1, 1, 0)] * 20)
    assert [row["count"] for row in out] == [0] * 20 and sum(row["illegal"] for row in out) == 1
    assert out[-1]["illegal_seen"] and out[-1]["illegal_fault"]
    out = await bench.play([(1, 1, 0)] * 3, clear_flags=1)
    assert not out[0]["illegal_seen"] and not out[0]["illegal_fault"]


@cocotb.test()
async def a_stale_illegal_edge_fires_nothing_when_it_is_enabled(dut):
    bench = await Bench.begin(dut)  # LinuxCNC #2860, #2869
    out = await bench.play([(1, 1, 0)] * 9)
    assert out[-1]["illegal_seen"] and not out[-1]["illegal_fault"]
    bench.setup = Setup(illegal_enable=1)
    assert not any(row["illegal_fault"] for row in await bench.play([(1, 1, 0)] * 9))
    assert (await bench.play([(0, 0, 0)] * 9))[-1]["illegal_fault"]
    bench.setup = Setup()
    assert not (await bench.play([(0, 0, 0)] * 2))[-1]["illegal_fault"]
    bench.setup = Setup(illegal_enable=1)
    assert not (await bench.play([(0, 0, 0)] * 2))[-1]["illegal_fault"]


@cocotb.test()
async def an_illegal_edge_in_the_cycle_of_clear_flags_sets_the_flag_again(dut):
    bench = await Bench.begin(dut)
    await bench.play([(1, 1, 0)] * 3)
    assert (await bench.play([(1, 1, 0)] * 3, clear_flags=1))[-1]["illegal_seen"]


@cocotb.test()
async def edge_time_is_that_of_the_last_counted_edge_and_changes_with_count(dut):
    bench = await Bench.begin(dut)
    out = await bench.go(there_and_back(0, 9, 3), cycle=3)
    for before, row in zip(out, out[1:]):
        assert (row["count"] != before["count"]) == (row["edge_time"] != before["edge_time"])
        if row["step"]:
            assert row["edge_time"] == row["now"]
    assert sum(abs(row["step"]) for row in out) == 15


@cocotb.test()
async def reset_in_mid_flow_makes_the_present_position_zero(dut):
    bench = await Bench.begin(dut, Setup(illegal_enable=1, index=EACH))
    await bench.go(there_and_back(0, 7), lambda position: position == 3)
    await bench.play([(1, 1, 0)] * 4)
    out = await bench.play([(1, 1, 1)], rst=1)
    assert not any(
        out[0][name]
        for name in ("count", "index_count", "index_found", "illegal_seen", "illegal_fault")
    )
    assert (await bench.play([(1, 1, 1)] * 20))[-1]["count"] == 0
    assert (await bench.play([(0, 1, 1)] * 4))[-1]["count"] == 1


@cocotb.test()
async def own_steps_of_one_cycle_are_all_counted_whatever_the_filter_settings_are(dut):
    for required, skip in ((0, 0), (255, 0), (3, 200)):
        bench = await Bench.begin(
            dut, Setup(skip=skip, required=required, tolerated=2, mode=3, own=1)
        )
        for down, steps, count in ((0, 7, 7), (1, 12, -5)):
            own = [(0, down)] * 2 + [(1, down), (0, down)] * steps + [(0, down)] * 4
            out = await bench.play([(0, 0, 0)] * len(own), own=own)
            assert out[-1]["count"] == count and not any(row["rejected"] for row in out)


@cocotb.test()
async def latency_is_3_from_own_a_to_count(dut):
    bench = await Bench.begin(dut, Setup(required=200, own=1))
    out = await bench.play([(0, 0, 0)] * 8, own=[(1, 0)] * 8)
    assert [row["count"] for row in out].index(1) + 1 == 3


@cocotb.test()
async def the_pins_are_filtered_and_not_counted_while_own_steps_are_counted(dut):
    bench = await Bench.begin(dut, Setup(required=3, own=1))
    out = await bench.play([(1, 0, 0)] * 2 + [(0, 0, 0)] * 6 + [(1, 0, 0)] * 8)
    assert (
        sum(row["rejected"] for row in out) == 1
        and out[-1]["filtered"] == 1
        and not any(row["count"] for row in out)
    )


@cocotb.test()
async def any_pins_settings_and_strobes_match_the_model(dut):
    bench = await Bench.begin(dut)
    bits = random.getrandbits
    top = 1 << int(dut.W.value)
    for _ in range(60):
        index = Settings(
            bits(1),
            bits(2) & bits(2),
            bits(2),
            bits(1) | bits(1),
            bits(1) | bits(1),
            bits(1),
            bits(1),
            random.choice([0, 5, 8, 12]) % top,
        )
        skip, required, tolerated = (
            random.choice([0, 0, 1, 3]),
            random.choice([0, 1, 1, 2, 3]),
            random.choice([0, 0, 1, 2]),
        )
        own = random.random() < 0.3
        bench.setup = Setup(skip, required, tolerated, bits(2), bits(1), int(own), index)
        if random.random() < 0.3:
            rows = [(bits(1), bits(1), bits(1)) for _ in range(60)]
        else:
            position, rows, cycle = bits(4), [], random.choice([1, 2, 6])
            direction = random.choice([-1, 1])
            for _ in range(60 // cycle):
                direction = -direction if random.random() < 0.1 else direction
                position += direction
                rows += [(*TURN[position % 4], int(position % 12 in (0, 1)))] * cycle
        for first in range(0, len(rows), 15):
            await bench.play(
                rows[first : first + 15],
                rst=int(random.random() < 0.01),
                arm=bits(1),
                clear_flags=bits(1) & bits(1),
                own=[(bits(1), bits(1)) for _ in range(15)],
            )


@pytest.mark.parametrize("w, time_w, check", [(32, 32, 1), (8, 16, 0)])
def test_incremental_encoder(w, time_w, check):
    run("incremental_encoder", __file__, W=w, TIME_W=time_w, CHECK=check)
