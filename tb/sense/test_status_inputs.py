# SPDX-License-Identifier: Apache-2.0
"""Tests of status_inputs: bounce, both ends of the filter time, levels present at reset, and random
levels against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb import bench
from tb.sense.status_inputs import StatusInputs

CLK_HZ = 8000
MS = CLK_HZ // 1000


def word(levels):
    return sum(level << n for n, level in enumerate(levels))


class Contacts:
    def __init__(self, dut):
        self.dut, self.w = dut, int(dut.W.value)
        self.model, self.time_ms = StatusInputs(CLK_HZ, self.w), 3
        self.changes = []  # (input, "rose" or "fell")

    async def begin(self, *levels):
        await bench.start(self.dut, time_ms=self.time_ms, inputs=word(levels))
        await self.cycle(*levels, rst=1, n=3)
        await self.cycle(*levels, n=10)
        return self

    async def cycle(self, *levels, n=1, rst=0):
        """Apply these levels for n cycles; returns the numbers of the cycles after which the
        filtered level had changed.
        """
        levels = (*levels, *[0] * (self.w - len(levels)))
        d, there = self.dut, None
        d.inputs.value, d.time_ms.value, d.rst.value = word(levels), self.time_ms, rst
        for cycle in range(n):
            await FallingEdge(d.clk)
            level, rose, fell = self.model.step(self.time_ms, levels, rst)
            got = int(d.level.value), int(d.rose.value), int(d.fell.value)
            assert got == (word(level), word(rose), word(fell)), (
                f"{got} where the model has {level, rose, fell}"
            )
            self.changes += [
                (i, name)
                for name, strobes in (("rose", rose), ("fell", fell))
                for i, s in enumerate(strobes)
                if s
            ]
            there = cycle + 1 if there is None and tuple(level) == levels else there
        return there


@cocotb.test()
async def a_contact_that_bounces_changes_once(dut):
    contacts = await Contacts(dut).begin(0)
    for level in (1, 0):
        for _ in range(6):
            await contacts.cycle(level, n=random.randrange(1, MS))
            await contacts.cycle(1 - level, n=random.randrange(1, MS))
        await contacts.cycle(level, n=5 * MS)
    assert contacts.changes == [(0, "rose"), (0, "fell")]


@cocotb.test()
async def pulses_shorter_than_time_ms_never_pass_and_those_of_1_ms_more_do(dut):
    bench.steady_only("times to the cycle")
    for contacts_time in (0, 1, 2, 10):
        contacts = Contacts(dut)
        contacts.time_ms = contacts_time
        await contacts.begin(0)
        for offset in range(MS if contacts_time else 0):
            await contacts.cycle(1, n=contacts_time * MS)
            await contacts.cycle(0, n=2 * MS + offset + 1)
            assert not contacts.changes
        for offset in range(MS):
            await contacts.cycle(1, n=(contacts_time + 1) * MS)
            await contacts.cycle(0, n=(contacts_time + 2) * MS + offset + 1)
            assert contacts.changes == [(0, "rose"), (0, "fell")] * (offset + 1)


@cocotb.test()
async def latency_is_time_ms_to_1_ms_more_and_2_cycles(dut):
    bench.steady_only("a latency to the cycle")
    contacts = await Contacts(dut).begin(0)
    seen = set()
    for n in range(2 * MS):
        seen.add(await contacts.cycle(1, n=5 * MS))
        await contacts.cycle(0, n=5 * MS + n)
    assert min(seen) == 3 * MS + 3 and max(seen) == 4 * MS + 2


@cocotb.test()
async def the_longest_time_is_filtered_exactly(dut):
    bench.rtl_only("it sets a counter inside, since 65 s are too long")
    contacts = Contacts(dut)
    contacts.time_ms = 0xFFFF
    await contacts.begin(0)
    await contacts.cycle(1, n=2 * MS)
    contacts.model.stable[0] = 0xFFFD
    bench.generated(dut, "g_input", 0, "stable").value = 0xFFFD
    assert await contacts.cycle(1, n=5 * MS) in range(2 * MS, 3 * MS + 1)


@cocotb.test()
async def a_level_present_at_reset_is_no_change(dut):
    contacts = await Contacts(dut).begin(*[1] * int(dut.W.value))
    assert int(dut.level.value) == (1 << contacts.w) - 1 and not contacts.changes
    await contacts.cycle(0, n=2 * MS)
    await contacts.cycle(0, rst=1)
    await contacts.cycle(0, n=5 * MS)
    assert int(dut.level.value) == 0 and not contacts.changes


@cocotb.test()
async def any_levels_match_the_model(dut):
    contacts = await Contacts(dut).begin(0)
    for _ in range(600):
        contacts.time_ms = random.choice([0, 1, 2, 5, contacts.time_ms, contacts.time_ms])
        levels = [random.getrandbits(1) for _ in range(contacts.w)]
        await contacts.cycle(
            *levels, n=random.choice([1, 3, MS, 6 * MS]), rst=int(random.random() < 0.01)
        )
    assert {name for _, name in contacts.changes} == {"rose", "fell"}


@pytest.mark.parametrize("w", [1, 2])
def test_status_inputs(w):
    bench.run("status_inputs", __file__, CLK_HZ=CLK_HZ, W=w)
