# SPDX-License-Identifier: Apache-2.0
"""build.py: what it makes, when it makes it, and how it reports that it cannot."""

import os
import re
import struct
import subprocess
import sys
import zlib

import pytest

from figures import soft_core
from firmware import build as firmware_build
from twin.build import FIRMWARE, ROOT

MEMORY = firmware_build.MEMORY_BYTES
PAGE = soft_core.PAGE.read_text(encoding="utf-8")


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


def test_the_memory_is_that_of_a_node_by_default():
    node = (ROOT / "rtl" / "node.sv").read_text(encoding="utf-8")
    assert re.findall(r"parameter int MEMORY_BYTES = (\d+),", node) == [str(MEMORY)]


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


def test_the_page_has_the_size_of_the_image(made):
    assert soft_core.size_row("axis", 1, made[1]) in PAGE


def test_a_firmware_that_does_not_fit_names_the_missing_bytes_and_the_largest_parts(made, tmp_path):
    used = MEMORY - int(re.search(r"(\d+) free", made[1])[1])
    error = build(tmp_path, "--memory", str(used - 40)).stderr
    assert "the image axis for 1 axis is 40 bytes too large" in error
    parts = re.findall(r"(\w+) (\d+)(?:,|$)", error.strip().partition("largest parts: ")[2])
    assert {name for name, _ in parts[:3]} == {"calibration", "axis", "planner"}
    sizes = [int(size) for _, size in parts]
    assert sizes == sorted(sizes, reverse=True) and sum(sizes) > used // 2
    assert build(tmp_path, "--memory", str(used)).returncode == 0


def test_the_list_of_parts_accounts_for_every_byte(made):
    lines = (made[0] / "firmware.parts").read_text().splitlines()
    sizes = {name: int(size) for size, name in (line.split(maxsplit=1) for line in lines)}
    _, symbols = firmware_build.read_elf(made[0] / "firmware.elf")
    assert sum(sizes.values()) == symbols["_zero_end"]
    assert sizes["compiler, constants without a name"] < 0.1 * symbols["_zero_end"]
    assert sizes["planner/retarget.c"] > 4000 and list(sizes.values())[0] == max(sizes.values())


def test_each_axis_more_takes_more_data(made, tmp_path):
    run = build(tmp_path, "--axes", "3")
    assert run.returncode == 0 and run.stdout.startswith("firmware_3_axes: ")
    one, three = (int(re.search(r"(\d+) data", text)[1]) for text in (made[1], run.stdout))
    assert 2000 < (three - one) / 2 < 3000


def test_each_image_has_a_list_of_its_parts():
    files = {path.stem for path in (firmware_build.HERE / "images").glob("image_*.c")}
    assert files == {f"image_{name}" for name in firmware_build.IMAGES}


def test_a_counter_has_no_planner_and_needs_a_quarter_of_the_memory(made, tmp_path):
    run = build(tmp_path, "--image", "counter", "--axes", "1")
    assert run.returncode == 0, run.stderr
    names = functions(tmp_path / "counter_1_axes.elf")
    assert "bus_execute" in names and not {"planner_move", "motion_feed", "homing_poll"} & names
    program, whole = (int(re.search(r"(\d+) bytes", t)[1]) for t in (run.stdout, made[1]))
    assert program < whole / 4


def test_steps_for_eight_axes_fit_64_kib_and_know_no_sine(tmp_path):
    run = build(tmp_path, "--image", "steps", "--memory", "65536")
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("steps: ") and " of 65536, " in run.stdout
    assert soft_core.size_row("steps", 8, run.stdout) in PAGE
    names = functions(tmp_path / "steps.elf")
    assert {"planner_move", "homing_poll", "scope_operation"} <= names
    assert not {"calibration_open", "harmonics_table_entry", "ellipse_take"} & names


def test_nothing_is_built_twice(made):
    before = (made[0] / "firmware.elf").stat().st_mtime_ns
    assert build(made[0]).stdout == made[1]
    assert (made[0] / "firmware.elf").stat().st_mtime_ns == before


@pytest.mark.parametrize(
    "options, environment, words",
    [
        (["--memory", "16384"], {}, "too large for a memory of 16384 bytes; its largest parts: "),
        (["--axes", "9"], {}, "the image axis serves 1 to 8 axes, not 9"),
        (["--image", "station", "--axes", "3"], {}, "serves 1 to 2 axes, not 3"),
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
    assert soft_core.size_row("station", 2, run.stdout) in PAGE
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


def test_the_core_flash_has_what_is_needed_seldom_in_a_file_of_its_own(made, tmp_path):
    memory = 32768
    run = build(tmp_path, "--core", "flash", "--memory", str(memory))
    assert run.returncode == 0, run.stderr
    code = (tmp_path / "firmware_flash.flash").read_bytes()
    assert f"{len(code)} in the flash" in run.stdout
    assert soft_core.flash_row("axis", 1, made[1], run.stdout) in PAGE
    _, symbols = firmware_build.read_elf(tmp_path / "firmware_flash.elf")
    in_flash = {name for name, value in symbols.items() if value >= firmware_build.CODE_AT}
    assert in_flash > {"homing_begin", "planner_move", "planner_retarget", "parameters_set"}
    assert not {"main", "bus_poll", "axis_poll", "code_intact"} & in_flash
    words = [int(line, 16) for line in (tmp_path / "firmware_flash.hex").read_text().split()]
    at = symbols["code_check"] // 4
    assert len(words) == memory // 4
    assert words[at : at + 2] == [len(code), zlib.crc32(code)]


def test_an_update_over_the_bus_is_not_built_for_the_core_flash(tmp_path):
    error = build(tmp_path, "--core", "flash", "--update").stderr
    assert error == "firmware: updates over the bus need --core serial\n"


def test_firmware_beyond_what_the_core_executes_of_the_flash_is_refused():
    segments = [(0, bytes(8)), (firmware_build.CODE_AT, bytes(firmware_build.CODE_BYTES + 4))]
    with pytest.raises(firmware_build.BuildError) as why:
        firmware_build.contents(segments, firmware_build.CODE_BYTES, firmware_build.CODE_AT)
    assert str(why.value) == "the firmware needs 65540 bytes, the flash has 65536"
    assert firmware_build.contents(segments, 16) == (bytes(16), 8)


def test_a_node_executes_as_much_of_the_flash_as_the_firmware_may_have():
    core = (ROOT / "rtl" / "cpu" / "soft_core.sv").read_text(encoding="utf-8")
    assert f"mem_addr[31:28] == 4'h{firmware_build.CODE_AT >> 28:x}" in core
    code = (FIRMWARE / "core" / "code.c").read_text(encoding="utf-8")
    assert f"{firmware_build.CODE_AT:#x}u" in code
