# SPDX-License-Identifier: Apache-2.0
"""arctan_rotation_rom: its made angles against math.atan, every entry against its maker, the file
fresh, a changed one refused.
"""

import math
import subprocess
import sys

import cocotb
import pytest
from cocotb.triggers import Timer

from tables import arctan_rotation
from tb.bench import run


@cocotb.test()
async def latency_is_0_and_every_entry_equals_its_generator(dut):
    turns, first, count, guard = (
        int(getattr(dut, name).value) for name in ("TURNS", "FIRST", "COUNT", "GUARD")
    )
    for negative in range(1 << count):
        dut.negative.value = negative
        await Timer(1, "ns")
        assert dut.sum.value.to_signed() == arctan_rotation.entry(
            turns, first, negative, count, guard
        )


def test_the_angles_are_those_of_math():
    for digit in range(1, arctan_rotation.LONGEST + 1):
        assert (
            abs(arctan_rotation.angle(digit, 10) - math.atan(2.0**-digit) / math.tau * 2**48) <= 0.6
        )
    assert abs(arctan_rotation.RADIAN - 2**48 / math.tau) <= 0.6
    assert arctan_rotation.angle(8, 7) == pytest.approx(
        2.0**-8 * (1 - 2.0**-16) / math.tau * 2**48, abs=1
    )


def test_every_digit_is_in_one_sum():
    for digits in range(15, 32):
        groups = arctan_rotation.groups(digits)
        assert [first + j for first, count in groups for j in range(count)] == list(
            range(1, digits + 1)
        )
        assert all(1 <= count <= 5 for _, count in groups)


def test_the_committed_file_is_fresh():
    subprocess.run([sys.executable, "-m", "tables.arctan_rotation", "--check"], check=True)


def test_a_changed_file_is_refused(tmp_path, monkeypatch):
    made = tmp_path / "rtl" / "interpolate" / "arctan_rotation_rom.sv"
    monkeypatch.setattr(arctan_rotation, "MADE", made)
    assert arctan_rotation.main(["--check"]) == 1 and not made.exists()
    assert arctan_rotation.main([]) == arctan_rotation.main(["--check"]) == 0
    made.write_text(
        made.read_text().replace(str(arctan_rotation.ANGLE[2]), str(arctan_rotation.ANGLE[2] + 1))
    )
    assert arctan_rotation.main(["--check"]) == 1


@pytest.mark.parametrize(
    "turns, first, count, guard", [(6, 1, 4, 9), (6, 13, 5, 9), (10, 5, 4, 16), (7, 23, 1, 14)]
)
def test_arctan_rotation_rom(turns, first, count, guard):
    run("arctan_rotation_rom", __file__, TURNS=turns, FIRST=first, COUNT=count, GUARD=guard)
