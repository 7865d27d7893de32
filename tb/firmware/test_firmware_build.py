# SPDX-License-Identifier: Apache-2.0
"""build.py: what it makes, when it makes it, and how it reports that it cannot."""

import os
import struct
import subprocess
import sys

import pytest

from firmware import build as firmware_build
from twin.build import FIRMWARE

MEMORY = 98304


def build(out, *options, **environment):
    return subprocess.run(
        [sys.executable, FIRMWARE / "build.py", "--out", out, *options],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )


def functions(elf):
    return set(firmware_build.read_elf(elf)[1])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("firmware")
    run = build(out)
    assert run.returncode == 0, run.stderr
    return out, run.stdout


def test_the_hex_is_the_program_filled_to_the_size_of_the_memory(made):
    out, _ = made
    lines = (out / "firmware.hex").read_text().split()
    program = (out / "firmware.bin").read_bytes()
    assert len(lines) == MEMORY // 4 and all(len(line) == 8 for line in lines)
    assert b"".join(struct.pack("<I", int(line, 16)) for line in lines) == program + bytes(
        MEMORY - len(program)
    )


def test_the_report_adds_up(made):
    numbers = [int(word) for word in made[1].replace(",", "").split() if word.isdigit()]
    program, data, stack, used, memory, free = numbers
    assert (
        memory == MEMORY
        and program + data + stack == used
        and used + free == memory
        and stack == 4096
    )
    assert program == (made[0] / "firmware.bin").stat().st_size


def test_nothing_is_built_twice(made):
    before = (made[0] / "firmware.elf").stat().st_mtime_ns
    assert build(made[0]).stdout == made[1]
    assert (made[0] / "firmware.elf").stat().st_mtime_ns == before


@pytest.mark.parametrize(
    "options, environment, words",
    [
        (["--memory", "16384"], {}, "does not fit"),
        ([], {"CROSS": "no-such-machine-"}, "no-such-machine-gcc was not found"),
    ],
)
def test_a_failed_build_is_reported_in_one_line(tmp_path, options, environment, words):
    run = build(tmp_path, *options, **environment)
    assert (
        run.returncode == 1
        and words in run.stderr
        and run.stderr.count("\n") == 1
        and run.stdout == ""
    )
    assert not (tmp_path / "firmware.hex").exists()


def test_each_image_is_made_beside_the_others(made, tmp_path):
    run = build(tmp_path, "--image", "station")
    assert run.returncode == 0 and run.stdout.startswith("station: "), run.stderr
    station, axis = functions(tmp_path / "station.elf"), functions(made[0] / "firmware.elf")
    assert (
        "settings_operation" in station
        and not {"calibration_axes_work", "calibration_work"} & station
    )
    assert (
        "settings_operation" not in axis and {"calibration_axes_work", "calibration_work"} <= axis
    )


def test_two_sources_of_the_same_stem_are_refused(tmp_path):
    for name in ("axis/clock.c", "core/clock.c", "core/clock.h"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    with pytest.raises(firmware_build.BuildError, match="same object clock.o: rename one"):
        firmware_build.sources_of("axis", tmp_path)
    (tmp_path / "axis" / "clock.c").unlink()
    assert len(firmware_build.sources_of("axis", tmp_path)) == 2
