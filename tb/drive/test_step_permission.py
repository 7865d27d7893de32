# SPDX-License-Identifier: Apache-2.0
"""step_permission: all levels against the model."""

import itertools

import cocotb
from cocotb.triggers import Timer

from tb.bench import run
from tb.drive.step_permission import permission

LEVELS = ("enable", "by_steps", "block_up", "block_down")


async def answer(dut, levels, velocity):
    for name, level in zip(LEVELS, levels, strict=True):
        getattr(dut, name).value = level
    dut.target_up.value, dut.target_down.value = int(velocity > 0), int(velocity < 0)
    await Timer(1, "ns")
    return int(dut.allowed.value)


@cocotb.test()
async def nothing_moves_into_a_blocked_side_and_everything_may_move_away_from_it(dut):
    assert await answer(dut, (1, 1, 1, 0), 1) == 0
    assert await answer(dut, (1, 1, 1, 0), -1) == 1
    assert await answer(dut, (1, 1, 0, 1), -1) == 0
    assert await answer(dut, (1, 1, 0, 1), 1) == 1
    assert await answer(dut, (1, 1, 1, 1), 0) == 1


@cocotb.test()
async def with_the_drive_off_or_of_another_kind_nothing_is_followed(dut):
    for levels in ((0, 1, 0, 0), (1, 0, 0, 0), (0, 0, 0, 0)):
        for velocity in (-1, 0, 1):
            assert await answer(dut, levels, velocity) == 0


@cocotb.test()
async def latency_is_0(dut):
    """The answer follows its inputs within 1 ns, without a clock."""
    assert not hasattr(dut, "clk")
    assert await answer(dut, (1, 1, 0, 0), 1) == 1
    assert await answer(dut, (1, 1, 1, 0), 1) == 0
    assert await answer(dut, (0, 1, 0, 0), 1) == 0


@cocotb.test()
async def all_levels_match_the_model(dut):
    for levels in itertools.product((0, 1), repeat=len(LEVELS)):
        for velocity in (-1, 0, 1):
            expected = permission(*levels, velocity > 0, velocity < 0)
            assert await answer(dut, levels, velocity) == expected


def test_step_permission():
    run("step_permission", __file__)
