# SPDX-License-Identifier: Apache-2.0
"""The fuzzers find planted faults, and none in a short run of the real parsers; the figure
host_parser_crashes runs them for longer, for all images of the firmware.
"""

import shutil

import pytest

from figures.gateway import FIRMWARE, fuzz_firmware
from fuzz import parser_fuzz
from moire.errors import BadFile


def test_the_parsers_of_the_host_survive_a_short_run():
    targets = parser_fuzz.fuzz(5)
    assert not any(target.crashes for target in targets), [target.crashes for target in targets]
    assert all(target.runs > 20 and target.seen for target in targets)
    grown = [t for t in targets if len(t.corpus) > len(parser_fuzz.SEEDS[t.parse])]
    assert len(grown) > 5, "nothing new was found"


def planted(data):
    """A crash behind three right bytes: without coverage that is one input in 2^24."""
    if data[:1] != b"M":
        raise BadFile("no")
    if data[1:2] != b"o":
        raise BadFile("no")
    if data[2:3] == b"i":
        raise ZeroDivisionError


def test_a_fault_behind_several_right_bytes_is_found_by_coverage(monkeypatch):
    monkeypatch.setattr(parser_fuzz, "PACKAGE", __file__)
    (target,) = parser_fuzz.fuzz(120, parsers=(planted,), first=True)
    assert any(where.startswith("ZeroDivisionError") for where in target.crashes), (
        f"not in {target.runs} runs"
    )


def test_an_input_without_end_is_a_crash(monkeypatch):
    monkeypatch.setattr(parser_fuzz, "HANG_S", 0.2)

    def endless(data):
        while True:
            pass

    (target,) = parser_fuzz.fuzz(0, parsers=(endless,))
    assert any(where.startswith("Hang") for where in target.crashes)


needs_gcc = pytest.mark.skipif(
    shutil.which("gcc") is None, reason="the firmware is fuzzed with the sanitizers of gcc"
)


@needs_gcc
def test_the_firmware_survives_a_short_run():
    outcome = fuzz_firmware(2, "axis")
    assert outcome.crash is None and outcome.runs > 500


@needs_gcc
def test_a_missing_bound_in_the_firmware_is_found(tmp_path):
    copy = tmp_path / "firmware"
    shutil.copytree(FIRMWARE, copy)
    right = (copy / "bus" / "bus.c").read_text()
    wrong = right.replace(
        "if (!receiving || received == sizeof request) return;", "if (!receiving) return;"
    )
    assert wrong != right
    (copy / "bus" / "bus.c").write_text(wrong)
    crash = fuzz_firmware(60, "axis", firmware=copy).crash
    assert crash is not None, "not found"
    assert "index 69 out of bounds" in crash and "input:" in crash, crash
