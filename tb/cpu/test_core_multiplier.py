# SPDX-License-Identifier: Apache-2.0
"""core_multiplier: the results of RISC-V for known and for random operands, both ends of their
range, other instructions, reset in the middle, and every cycle against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.cpu.core_divider import DIV
from tb.cpu.core_multiplier import MUL, MULH, MULHSU, MULHU, CoreMultiplier
from tb.cpu.soft_core import signed

ADDITION = 0b0110011


class Bench:
    def __init__(self, dut):
        self.dut, self.w = dut, len(dut.a)
        self.model = CoreMultiplier(self.w)
        self.known = False  # there was a result

    async def clk(self, valid, instruction=0, a=0, b=0, rst=0):
        """Advance one cycle; ready and result must be those of the model. Returns ready."""
        inputs = dict(valid=valid, instruction=instruction, a=a, b=b, rst=rst)
        for name, level in inputs.items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        ready, result = self.model.step(**inputs)
        self.known |= bool(ready)
        assert int(self.dut.ready.value) == ready
        assert not self.known or int(self.dut.result.value) == result
        return ready

    async def multiplied(self, instruction, a, b):
        """The result, and the cycles that it took."""
        for cycles in range(1, 6):
            if await self.clk(1, instruction, a, b):
                result = int(self.dut.result.value)
                await self.clk(1, instruction, a, b)  # the core sees ready and goes on
                return result, cycles
        raise AssertionError("there is no result")


def expected(instruction, a, b, w):
    sa, sb = signed(a, w), signed(b, w)
    whole = {MUL: a * b, MULH: sa * sb, MULHSU: sa * b, MULHU: a * b}[instruction]
    return (whole if instruction == MUL else whole >> w) & (1 << w) - 1


async def begin(dut):
    await start(dut, valid=0, instruction=0, a=0, b=0)
    bench = Bench(dut)
    for _ in range(2):
        await bench.clk(0, rst=1)
    return bench


@cocotb.test()
async def known_products_have_the_results_of_the_specification(dut):
    bench = await begin(dut)
    ones = (1 << bench.w) - 1
    for instruction, a, b, want in [
        (MUL, 3, 2, 6),
        (MUL, ones, 2, ones - 1),  # -1 * 2 = -2
        (MULH, ones, 2, ones),  # of which the high half is -1
        (MULHSU, ones, ones, ones),  # -1 * (2^W - 1)
        (MULHU, ones, 2, 1),
        (MULHU, ones, ones, ones - 1),
    ]:
        assert (await bench.multiplied(instruction, a, b))[0] == want


@cocotb.test()
async def random_operands_and_both_ends_of_the_range_multiply_as_the_specification_says(dut):
    bench = await begin(dut)
    w = bench.w
    ends = [0, 1, 2, (1 << w // 2) - 1, (1 << w - 1) - 1, 1 << w - 1, (1 << w) - 1]
    pairs = [(a, b) for a in ends for b in ends]
    pairs += [(random.getrandbits(w), random.getrandbits(random.randint(1, w))) for _ in range(200)]
    for a, b in pairs:
        for instruction in (MUL, MULH, MULHSU, MULHU):
            result, _ = await bench.multiplied(instruction, a, b)
            assert result == expected(instruction, a, b, w), (hex(instruction), hex(a), hex(b))


@cocotb.test()
async def latency_is_2(dut):
    bench = await begin(dut)
    for instruction in (MUL, MULHSU):
        assert (await bench.multiplied(instruction, 5, 7))[1] == 2


@cocotb.test()
async def other_instructions_are_ignored(dut):
    bench = await begin(dut)
    one_bit_apart = [MUL ^ 1 << bit for bit in (*range(7), 14, *range(25, 32))]
    for instruction in (DIV, ADDITION, *one_bit_apart, MUL):
        for _ in range(6):
            assert not await bench.clk(int(instruction != MUL), instruction, 3, 2)


@cocotb.test()
async def a_reset_ends_a_multiplication_and_gaps_change_nothing(dut):
    bench = await begin(dut)
    for _ in range(50):
        a, b = random.getrandbits(bench.w), random.getrandbits(bench.w)
        for _ in range(random.randrange(3)):
            if await bench.clk(1, MULHU, a, b):
                break
        assert not await bench.clk(1, MULHU, a, b, rst=1)
        for _ in range(random.randrange(3)):
            await bench.clk(0)
        assert (await bench.multiplied(MULH, a, b))[0] == expected(MULH, a, b, bench.w)


@pytest.mark.parametrize("w", [4, 32])
def test_core_multiplier(w):
    run("core_multiplier", __file__, W=w)
