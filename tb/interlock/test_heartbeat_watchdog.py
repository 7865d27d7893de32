# SPDX-License-Identifier: Apache-2.0
"""heartbeat_watchdog: the exact cycle, both ends of the time, what clears it, and random events
against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tb.bench import needs, run, start
from tb.interlock.heartbeat_watchdog import HeartbeatWatchdog

CLK_NS = 10  # a cycle of the clock that start() makes


class Watchdog:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.clk_ms = (
            dut,
            HeartbeatWatchdog(int(dut.CLK_HZ.value)),
            int(dut.CLK_HZ.value) // 1000,
        )
        self.inputs = dict(time_ms=0, kick=0, armed=0)

    async def reset(self, **inputs):
        await start(self.dut, **self.inputs)
        await FallingEdge(self.dut.clk)
        self.inputs.update(inputs)
        return self

    async def clk(self, rst=0, kick=0, **inputs):
        self.inputs.update(inputs)
        now = dict(self.inputs, rst=rst, kick=kick)
        for name, level in now.items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        got, want = int(self.dut.expired.value), self.model.clk(**now)
        assert got == want, f"{now}: expired is {got}, the model has {want}"
        return got


@cocotb.test()
async def latency_is_time_ms_in_cycles_plus_1_from_the_last_kick_to_expired(dut):
    watchdog = await Watchdog(dut).reset(time_ms=3, armed=1)
    for _ in range(5):
        await watchdog.clk()
    for _ in range(2):
        assert not await watchdog.clk(kick=1)
        clk = 1
        while not await watchdog.clk():
            clk += 1
        assert clk == 3 * watchdog.clk_ms + 1
        assert [await watchdog.clk() for _ in range(20)] == [1] * 20


@cocotb.test()
async def kicks_in_time_keep_it_from_expiring(dut):
    watchdog = await Watchdog(dut).reset(time_ms=3, armed=1)
    for _ in range(5):
        await watchdog.clk(kick=1)
        assert sum([await watchdog.clk() for _ in range(3 * watchdog.clk_ms)]) == 0


@cocotb.test()
async def it_never_expires_with_all_drives_off_and_starts_from_zero_when_one_comes_on(dut):
    watchdog = await Watchdog(dut).reset(time_ms=1)
    assert sum([await watchdog.clk() for _ in range(10 * watchdog.clk_ms)]) == 0
    for _ in range(2):
        clk = 0
        while not await watchdog.clk(armed=1):
            clk += 1
        assert clk == watchdog.clk_ms
        assert not await watchdog.clk(armed=0)


@cocotb.test()
async def a_new_time_counts_at_once_and_latency_is_1_from_a_kick_to_not_expired(dut):
    watchdog = await Watchdog(dut).reset(time_ms=1000, armed=1)
    for _ in range(10 * watchdog.clk_ms):
        assert not await watchdog.clk()
    assert await watchdog.clk(time_ms=5)
    assert await watchdog.clk(time_ms=1000)  # stays until a kick comes
    assert not await watchdog.clk(kick=1)


@cocotb.test()
async def time_0_never_expires_and_65535_ms_is_the_longest(dut):
    watchdog = await Watchdog(dut).reset()
    needs(
        watchdog.clk_ms == 1,
        "65535 ms take long, and the build with one cycle per ms shows as much",
    )
    dut.time_ms.value, dut.armed.value, dut.kick.value, dut.rst.value = 65535, 1, 1, 0
    for ends in (1, 0):
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        dut.kick.value = 0
        await Timer(65535 * CLK_NS, "ns")
        assert not dut.expired.value
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        assert int(dut.expired.value) == ends
        dut.time_ms.value, dut.kick.value = 0, 1
    dut.kick.value = 0
    await Timer(5 * CLK_NS, "ns")
    await FallingEdge(dut.clk)
    assert not dut.expired.value
    dut.time_ms.value = 65535  # a time that has passed already
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert dut.expired.value


@cocotb.test()
async def reset_starts_the_time_again(dut):
    watchdog = await Watchdog(dut).reset(time_ms=2, armed=1)
    for wait in range(3 * watchdog.clk_ms):
        for _ in range(wait):
            await watchdog.clk()
        assert not await watchdog.clk(rst=1)
        assert sum([await watchdog.clk() for _ in range(2 * watchdog.clk_ms)]) == 0


@cocotb.test()
async def any_events_match_the_model(dut):
    watchdog = await Watchdog(dut).reset()
    for _ in range(6000):
        await watchdog.clk(
            rst=random.randrange(500) == 0,
            kick=int(random.randrange(40) == 0),
            armed=int(random.randrange(60) > 0),
            time_ms=random.choice((0, 1, 2, 3, 8)),
        )


@pytest.mark.parametrize("clk_hz", [1000, 3000])
def test_heartbeat_watchdog(clk_hz):
    run("heartbeat_watchdog", __file__, CLK_HZ=clk_hz)
