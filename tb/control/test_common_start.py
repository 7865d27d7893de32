# SPDX-License-Identifier: Apache-2.0
"""common_start: each request for each axis, and random requests against the model."""

import random

import cocotb
import pytest
from cocotb.triggers import Timer

from tb.bench import run
from tb.control.common_start import started


async def outputs(dut, request=0, request_axes=0, sync=0, sync_axes=0):
    """(start, restart_tick), without a clock."""
    dut.request.value, dut.request_axes.value = request, request_axes
    dut.sync.value, dut.sync_axes.value = sync, sync_axes
    await Timer(1, "ns")
    got = int(dut.start.value), int(dut.restart_tick.value)
    assert got == started(int(dut.AXES.value), request, request_axes, sync, sync_axes)
    return got


@cocotb.test()
async def latency_is_0_and_each_request_starts_its_axes(dut):
    for n in range(int(dut.AXES.value)):
        assert await outputs(dut, request=1, request_axes=1 << n) == (1 << n, 0)
        assert await outputs(dut, sync=1, sync_axes=1 << n) == (1 << n, 1)
    assert await outputs(dut, request_axes=255, sync_axes=255) == (0, 0)


@cocotb.test()
async def a_sync_pulse_without_an_axis_leaves_the_tick_alone(dut):
    assert (await outputs(dut, sync=1))[1] == 0
    assert (await outputs(dut, sync=1, request=1, request_axes=255))[1] == 0


@cocotb.test()
async def random_requests_match_the_model(dut):
    for _ in range(1000):
        await outputs(
            dut,
            random.getrandbits(1),
            random.getrandbits(8),
            random.getrandbits(1),
            random.getrandbits(8) * random.getrandbits(1),
        )


@pytest.mark.parametrize("axes", [1, 3, 8])
def test_common_start(axes):
    run("common_start", __file__, AXES=axes)
