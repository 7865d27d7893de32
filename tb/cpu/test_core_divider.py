# SPDX-License-Identifier: Apache-2.0
"""core_divider: the results of RISC-V for known and for random operands, both ends of their range,
other instructions, reset in the middle, and every cycle against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.cpu.core_divider import DIV, DIVU, REM, REMU, CoreDivider
from tb.cpu.soft_core import divide, signed

PRODUCT, ADDITION = DIV & ~(1 << 14), 0b0110011


class Bench:
    def __init__(self, dut):
        self.dut, self.w = dut, len(dut.a)
        self.model = CoreDivider(self.w)
        self.defined = False  # the registers are, a few cycles after power-up

    async def clk(self, valid, instruction=0, a=0, b=0, rst=0):
        """Advance one cycle; ready and result must be those of the model. Returns both."""
        dut = self.dut
        dut.valid.value, dut.instruction.value, dut.a.value, dut.b.value, dut.rst.value = (
            valid,
            instruction,
            a,
            b,
            rst,
        )
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        ready, result = self.model.step(valid, instruction, a, b, rst)
        assert int(dut.ready.value) == ready
        if self.defined:
            assert int(dut.result.value) == result
        return ready, result

    async def divided(self, instruction, a, b):
        """The result, and the cycles that it took."""
        for cycles in range(1, 2 * self.w + 9):
            ready, _ = await self.clk(1, instruction, a, b)
            assert int(self.dut.working.value)
            if ready:
                result = int(self.dut.result.value)
                await self.clk(1, instruction, a, b)  # the core sees ready and goes on
                return result, cycles
        raise AssertionError("there is no result")


def expected(instruction, a, b, w):
    operands = (signed(a, w), signed(b, w)) if instruction in (DIV, REM) else (a, b)
    return divide(*operands)[instruction in (REM, REMU)] & (1 << w) - 1


async def begin(dut):
    await start(dut, valid=0, instruction=0, a=0, b=0)
    bench = Bench(dut)
    for _ in range(3):
        await bench.clk(0, rst=1)
    bench.defined = True
    return bench


@cocotb.test()
async def known_divisions_have_the_results_of_the_specification(dut):
    bench = await begin(dut)
    top, ones = 1 << bench.w - 1, (1 << bench.w) - 1
    for instruction, a, b, want in [
        (DIV, 7, 2, 3),
        (REM, 7, 2, 1),
        (DIV, ones - 6, 2, ones - 2),  # -7 / 2 = -3
        (REM, ones - 6, 2, ones),  # and the remainder is -1
        (DIV, 5, 0, ones),
        (DIV, ones - 4, 0, ones),
        (DIVU, 5, 0, ones),
        (REM, ones - 4, 0, ones - 4),
        (REMU, 5, 0, 5),
        (DIV, top, ones, top),  # overflow
        (REM, top, ones, 0),
        (DIVU, ones, 1, ones),
        (REMU, ones, top, top - 1),
    ]:
        assert (await bench.divided(instruction, a, b))[0] == want


@cocotb.test()
async def random_operands_and_both_ends_of_the_range_divide_as_the_specification_says(dut):
    bench = await begin(dut)
    w = bench.w
    ends = [0, 1, 2, (1 << w - 1) - 1, 1 << w - 1, (1 << w) - 2, (1 << w) - 1]
    pairs = [(a, b) for a in ends for b in ends]
    pairs += [(random.getrandbits(w), random.getrandbits(random.randint(1, w))) for _ in range(50)]
    for a, b in pairs:
        for instruction in (DIV, DIVU, REM, REMU):
            result, _ = await bench.divided(instruction, a, b)
            assert result == expected(instruction, a, b, w), (hex(instruction), hex(a), hex(b))


@cocotb.test()
async def latency_is_w_plus_2(dut):
    bench = await begin(dut)
    for instruction in (DIV, REMU):
        _, cycles = await bench.divided(instruction, 100 % (1 << bench.w), 7)
        assert cycles == bench.w + 2


@cocotb.test()
async def other_instructions_are_ignored(dut):
    bench = await begin(dut)
    one_bit_apart = [DIV ^ 1 << bit for bit in (*range(7), 14, *range(25, 32))]
    for instruction in (PRODUCT, ADDITION, *one_bit_apart, DIV):
        for _ in range(bench.w + 6):
            ready, _ = await bench.clk(int(instruction != DIV), instruction, 9, 2)
            assert not ready and not int(dut.working.value)


@cocotb.test()
async def a_reset_ends_a_division_and_gaps_change_nothing(dut):
    bench = await begin(dut)
    for _ in range(20):
        a, b = random.getrandbits(bench.w), random.getrandbits(bench.w)
        for _ in range(random.randrange(bench.w + 4)):
            if (await bench.clk(1, DIVU, a, b))[0]:
                break
        assert not (await bench.clk(1, DIVU, a, b, rst=1))[0]
        for _ in range(random.randrange(3)):
            await bench.clk(0)
        assert (await bench.divided(REM, a, b))[0] == expected(REM, a, b, bench.w)


@pytest.mark.parametrize("w", [4, 32])
def test_core_divider(w):
    run("core_divider", __file__, W=w)
