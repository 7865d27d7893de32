# SPDX-License-Identifier: Apache-2.0
"""core_watchdog: a trap, a missing heartbeat, no drive on, reset, and random levels against the
model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tb.bench import run, start
from tb.interlock.core_watchdog import CoreWatchdog

CLK_HZ, AXES, SILENCE_MS = 3000, 2, 2
SILENCE = SILENCE_MS * CLK_HZ // 1000  # cycles


class Watchdog:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, CoreWatchdog(CLK_HZ, SILENCE_MS)

    async def reset(self):
        await start(self.dut, trap=0, kick=0, drive_enable=0)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, **inputs):
        inputs = dict(trap=0, kick=0, drive_enable=0, rst=0) | inputs
        for name, level in inputs.items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        got = int(self.dut.armed.value), int(self.dut.stopped.value)
        assert got == self.model.clk(**inputs)
        return got


@cocotb.test()
async def latency_is_0_from_a_trap_and_the_silence_and_1_from_the_last_kick(dut):
    watchdog = await Watchdog(dut).reset()
    await watchdog.clk(drive_enable=2, kick=1)
    for cycle in range(1, SILENCE + 4):
        assert await watchdog.clk(drive_enable=2) == (1, int(cycle >= SILENCE + 1))
    assert await watchdog.clk(drive_enable=2, kick=1) == (1, 0)
    dut.trap.value = 1
    await Timer(1, "ns")
    assert dut.stopped.value == 1


@cocotb.test()
async def without_a_drive_no_heartbeat_is_required_but_a_trap_still_counts(dut):
    watchdog = await Watchdog(dut).reset()
    for _ in range(2 * SILENCE):
        assert await watchdog.clk() == (0, 0)
    assert await watchdog.clk(trap=1) == (0, 1)


@cocotb.test()
async def random_levels_match_the_model(dut):
    watchdog = await Watchdog(dut).reset()
    enabled = 0
    for _ in range(2000):
        enabled = random.randrange(1 << AXES) if random.random() < 0.05 else enabled
        await watchdog.clk(
            trap=int(random.random() < 0.05),
            kick=int(random.random() < 0.12),
            drive_enable=enabled,
            rst=int(random.random() < 0.01),
        )


def test_core_watchdog():
    run("core_watchdog", __file__, CLK_HZ=CLK_HZ, AXES=AXES, SILENCE_MS=SILENCE_MS)
