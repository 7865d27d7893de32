# SPDX-License-Identifier: Apache-2.0
"""Tests of arctan_quotient_rom: every word against its generator, and the generator against
math.atan.
"""

import math

import cocotb
import pytest
from cocotb.triggers import Timer

from tables import arctan_quotient
from tb.bench import run


@cocotb.test()
async def latency_is_0_and_every_word_equals_its_generator(dut):
    for index, want in enumerate(arctan_quotient.PARABOLAS):
        dut.index.value = index
        await Timer(1, "ns")
        got = dut.base.value, dut.slope.value, dut.bend.value
        assert tuple(map(int, got)) == want, f"index {index}"


def test_a_parabola_is_an_arctangent():
    for index, (base, slope, bend) in enumerate(arctan_quotient.PARABOLAS):
        middle = (2 * index + 1) / 64
        assert base / 64 - 0.5 == pytest.approx(math.atan(middle) * 65536 / math.tau, abs=0.02)
        for t in (-1 / 64, 1 / 128, 1 / 64):
            change = (math.atan(middle + t) - math.atan(middle)) * 65536 / math.tau
            assert slope / 4 * t - bend * 16 * t * t == pytest.approx(change, abs=0.02)


def test_the_committed_table_is_fresh():
    assert arctan_quotient.main(["--check"]) == 0


def test_arctan_quotient_rom():
    run("arctan_quotient_rom", __file__)
