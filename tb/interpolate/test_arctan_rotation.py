# SPDX-License-Identifier: Apache-2.0
"""Tests of arctan_rotation_rom: the made angles against math.atan, every entry against its
generator; the made files are fresh, and a changed one is detected.
"""

import math
import shutil
import subprocess
import sys

import cocotb
import pytest
from cocotb.triggers import Timer

from tables import arctan_rotation
from tb.bench import run
from tb.simulator import source_of


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


def test_a_step_adds_only_angles_of_digits_that_are_found():
    for plan in arctan_rotation.PIPELINED.values():
        sums = arctan_rotation.summed(plan)
        ends = [first + count - 1 for first, count in arctan_rotation.groups(plan[1])]
        assert all(end == 0 or end <= step - 2 for step, end in enumerate(sums))
        assert sums == sorted(sums) and sorted(set(sums)) == [0, *ends[:-1]]


def test_the_committed_files_are_fresh():
    subprocess.run([sys.executable, "-m", "tables.arctan_rotation", "--check"], check=True)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A copy of the modules that hold made constants, and no made table yet."""
    for name in ("arctan_pipelined", "arctan_iterative"):
        shutil.copy(source_of(name), tmp_path)
    monkeypatch.setattr(arctan_rotation, "FOLDER", tmp_path)
    monkeypatch.setattr(arctan_rotation, "MADE", tmp_path / "arctan_rotation_rom.sv")
    return tmp_path


@pytest.mark.parametrize(
    "name, old, new",
    [
        ("arctan_rotation_rom", str(arctan_rotation.ANGLE[2]), str(arctan_rotation.ANGLE[2] + 1)),
        ("arctan_pipelined", "0603010000", "0603020000"),
        ("arctan_pipelined", "W == 8 ? 23", "W == 8 ? 22"),
        ("arctan_iterative", "int GUARD = ", "int GUARD = 1 + "),
    ],
)
def test_a_changed_file_is_detected_and_made_again(folder, name, old, new):
    assert arctan_rotation.main(["--check"]) == 1 and arctan_rotation.main([]) == 0
    path = folder / f"{name}.sv"
    text = path.read_text()
    assert old in text and arctan_rotation.main(["--check"]) == 0
    path.write_text(text.replace(old, new))
    assert arctan_rotation.main(["--check"]) == 1 and arctan_rotation.main([]) == 0
    assert path.read_text() == text


def test_a_module_without_the_marks_is_refused(folder, capsys):
    path = folder / "arctan_iterative.sv"
    path.write_text(path.read_text().replace(arctan_rotation.END, ""))
    assert arctan_rotation.main(["--check"]) == 1
    assert "arctan_iterative.sv must have the lines" in capsys.readouterr().err


@pytest.mark.parametrize(
    "turns, first, count, guard", [(6, 1, 4, 9), (6, 13, 5, 9), (10, 5, 4, 16), (7, 23, 1, 14)]
)
def test_arctan_rotation_rom(turns, first, count, guard):
    run("arctan_rotation_rom", __file__, TURNS=turns, FIRST=first, COUNT=count, GUARD=guard)
