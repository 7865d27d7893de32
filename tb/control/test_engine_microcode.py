# SPDX-License-Identifier: Apache-2.0
"""engine_microcode: every line against its generator, the stated cycles, that the files are not
stale, and what the assembler refuses. What the lines do is tested with motion_engine.
"""

import cocotb
import pytest
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from tables import engine_microcode
from tables.microcode.assembler import LINES, assembled, codes, missing, parsed
from tables.microcode.numbers import ADDRESS
from tables.microcode.timing import worst
from tb.bench import run


@cocotb.test()
async def latency_is_1_and_every_line_is_that_of_the_generator(dut):
    lines = [code for _, code in codes()]
    lines += [0] * (LINES - len(lines))
    Clock(dut.clk, 10, "ns", impl="gpi").start()
    await FallingEdge(dut.clk)
    for number, code in enumerate(lines):
        dut.next.value, dut.target.value = number, LINES - 1 - number
        await FallingEdge(dut.clk)
        assert int(dut.next_code.value) == code, f"line {number}"
        assert int(dut.target_code.value) == lines[LINES - 1 - number], f"target {number}"


@cocotb.test()
async def the_stated_cycles_are_those_of_the_longest_path(dut):
    axes, filters = int(dut.AXES.value), int(dut.FILTERS.value)
    between, axis = worst(assembled(), filters)
    assert int(dut.cycles.value) == between + axes * axis


@pytest.mark.parametrize("axes, filters", [(1, 0), (8, 2)])
def test_engine_microcode(axes, filters):
    run("engine_microcode", __file__, AXES=axes, FILTERS=filters)


def test_the_made_files_are_fresh():
    assert engine_microcode.main(["--check"]) == 0


def test_eight_axes_need_at_most_3000_cycles():
    between, axis = worst(assembled(), 0)
    assert between + 8 * axis <= 3000


def test_a_word_is_not_read_too_soon():
    lines = [parsed(text) for text in ("0 -> part", "acc", "part")]
    assert missing(lines) == (2, 1)
    assert missing([*lines[:2], parsed("acc"), parsed("part")]) is None


def test_a_jump_does_not_depend_on_a_sign_that_is_not_known_yet():
    lines = [parsed("part ; test"), parsed("; if negative end"), parsed("end: acc")]
    assert missing(lines) == (1, 1)


@pytest.mark.parametrize(
    "text",
    ["part + base", "0 -> nothing", "part ; jump end", "0 -> kp", "part ; test, x", "acc ; x >> 8"],
)
def test_a_wrong_line_is_refused(text):
    with pytest.raises(ValueError):
        parsed(text)


def test_a_setting_is_written_between_two_ticks_and_before_each_axis():
    writes = [line.label for line in assembled() if line.word == "setting"]
    assert writes == ["idle", "axis"]


def test_where_nothing_is_read_the_memory_has_a_word_that_is_0():
    assert 0x7F not in ADDRESS.values()
