# SPDX-License-Identifier: Apache-2.0
"""tables/bus.py: no made file is stale, the made files agree with bus.toml, and a wrong table is
refused.
"""

import re
import shutil
import struct
import subprocess
import zlib
from fractions import Fraction
from pathlib import Path

import pytest

from moire.made import bus_tables
from tables import bus as generator

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "tables" / "bus.toml"
TABLE = generator.read()
HEADER = (ROOT / "sw" / "firmware" / "made" / "bus_protocol.h").read_text(encoding="utf-8")


def test_the_made_files_are_fresh():
    assert generator.main(["--check"]) == 0


def test_a_stale_file_is_found_named_and_made_again(tmp_path, monkeypatch, capsys):
    copy = tmp_path / "sw" / "firmware" / "made" / "bus_protocol.h"
    copy.parent.mkdir(parents=True)
    shutil.copy(generator.HEADER, copy)
    with open(copy, "a") as file:
        file.write("// edited\n")
    host, page = (
        generator.HOST.read_text(encoding="utf-8"),
        generator.PAGE.read_text(encoding="utf-8"),
    )
    for name, text in (("HOST", host), ("PAGE", page)):
        (tmp_path / name).write_text(text, encoding="utf-8")
        monkeypatch.setattr(generator, name, tmp_path / name)
    monkeypatch.setattr(generator, "HEADER", copy)
    assert generator.main(["--check"]) == 1 and "bus_protocol.h is stale" in capsys.readouterr().err
    assert generator.main([]) == 0 and "made" in capsys.readouterr().out
    assert generator.main(["--check"]) == 0


def test_the_crc_does_not_depend_on_the_line_ends_of_the_source():
    text = SOURCE.read_bytes()
    assert (
        zlib.crc32(text)
        == bus_tables.PROTOCOL_CRC
        == generator.Bus(text.replace(b"\n", b"\r\n")).crc
    )
    assert f"#define PROTOCOL_CRC         0x{bus_tables.PROTOCOL_CRC:08X}u" in HEADER
    assert generator.Bus(text + b"# one remark more\n").crc != bus_tables.PROTOCOL_CRC


def test_the_host_has_every_entry_of_the_source():
    for name, made in (
        ("cause", bus_tables.CAUSES),
        ("fault", bus_tables.FAULTS),
        ("encoder_event", bus_tables.ENCODER_EVENTS),
        ("state", bus_tables.STATES),
        ("flag", bus_tables.FLAGS),
        ("calibration_reason", bus_tables.CALIBRATION_REASONS),
        ("signal_fault", bus_tables.SIGNAL_FAULTS),
        ("calibration_action", bus_tables.CALIBRATION_ACTIONS),
        ("scope_trigger", bus_tables.SCOPE_TRIGGERS),
        ("scope_state", bus_tables.SCOPE_STATES),
    ):
        assert made == {code: (key, words) for key, (code, words) in TABLE[name].items()}
    assert list(bus_tables.OPERATIONS) == list(TABLE["operation"]) and list(
        bus_tables.PARAMETERS
    ) == list(TABLE["parameter"])
    for name, source in TABLE["operation"].items():
        made = bus_tables.OPERATIONS[name]
        assert (
            made.code,
            [" ".join(field) for field in made.request],
            [" ".join(field) for field in made.reply],
        ) == (source["code"], source["request"], source["reply"])
    assert list(bus_tables.SETTINGS) == list(TABLE["setting"])
    for name, source in {**TABLE["parameter"], **TABLE["setting"]}.items():
        made = {**bus_tables.PARAMETERS, **bus_tables.SETTINGS}[name]
        assert (made.id, made.unit, made.lsb, made.min, made.max, made.default) == (
            source["id"],
            source["unit"],
            Fraction(source["lsb"]),
            source["min"],
            source["max"],
            source["default"],
        )


def test_each_constant_has_its_value_in_the_header_the_host_and_the_words():
    constants = {name: value for name, (value, _) in TABLE["constant"].items()}
    for name, value in constants.items():
        assert re.search(rf"^#define BUS_{name.upper()} {value}u\b", HEADER, re.MULTILINE)
        assert getattr(bus_tables, name.upper()) == value
    assert " 2 to 256 after the one before" in bus_tables.OPERATIONS["set_point"].text
    assert "{" not in "".join(operation.text for operation in bus_tables.OPERATIONS.values())


@pytest.mark.parametrize("word", ["{stream_widest}", "{stream_shortest"])
def test_a_word_in_braces_that_is_no_constant_is_refused(word):
    text = SOURCE.read_text(encoding="utf-8").replace("{stream_shortest}", word)
    with pytest.raises(ValueError, match=r"bus\.toml: 'append a set-point.*' names no constant"):
        generator.Bus(text.encode())


def test_offsets_and_lengths_in_the_header_match_a_packed_struct():
    formats = {
        "u8": "B",
        "u16": "H",
        "u32": "I",
        "u64": "Q",
        "i8": "b",
        "i16": "h",
        "i32": "i",
        "i64": "q",
    }
    for name, source in TABLE["operation"].items():
        for direction, head in (("request", "BB"), ("reply", "BBB")):
            laid = "<" + head
            for declared in source[direction]:
                field, kind = declared.split()
                assert (
                    f"#define BUS_{name}_{direction}_{field} {struct.calcsize(laid)}u ".upper()
                    in HEADER.upper()
                )
                laid += formats[kind]
            assert re.search(
                f"#define BUS_{name}_{direction}_LENGTH {struct.calcsize(laid)}u$".upper(),
                HEADER.upper(),
                re.MULTILINE,
            )


def test_a_compiler_reads_the_header_and_gets_the_same_numbers(tmp_path):
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    source = tmp_path / "print.c"
    source.write_text(
        '#include <stdio.h>\n#include <stdint.h>\n#include "made/bus_protocol.h"\n'
        '#define P(name, id, min, max, default) printf("%s %d %lld %lld %lld\\n", #name, id, '
        "(long long)min, (long long)max, (long long)default);\n"
        "#define O(name, code, request, reply, of_axis) "
        'printf("%s %d %d %d %d\\n", #name, code, (int)request, (int)reply, of_axis);\n'
        "int main(void) { BUS_PARAMETERS(P) BUS_SETTINGS(P) BUS_OPERATIONS(O) "
        "return BUS_CAUSE_NO_MOTION_YET - 20 + BUS_FAULT_PROFILE_UNDERRUN - 256; }\n"
    )
    subprocess.run(
        [
            compiler,
            "-Wall",
            "-Wextra",
            "-Werror",
            "-I",
            ROOT / "sw" / "firmware",
            "-o",
            tmp_path / "print",
            source,
        ],
        check=True,
    )
    reported = subprocess.run(
        [tmp_path / "print"], check=True, capture_output=True, text=True
    ).stdout.splitlines()
    expected = [
        f"{p.name} {p.id} {p.min} {p.max} {p.default}"
        for table in (bus_tables.PARAMETERS, bus_tables.SETTINGS)
        for p in table.values()
    ]
    size = {"8": 1, "16": 2, "32": 4, "64": 8}
    expected += [
        f"{o.name} {o.code} {2 + sum(size[kind[1:]] for _, kind in o.request)} "
        f"{3 + sum(size[kind[1:]] for _, kind in o.reply)} "
        f"{int(('axis', 'u8') in o.request)}"
        for o in bus_tables.OPERATIONS.values()
    ]
    assert reported == expected


@pytest.mark.parametrize(
    "change, message",
    [
        (("code = 2\n", "code = 1\n"), "operation codes repeat"),
        (("id = 2, ", "id = 1, "), "parameter ids repeat"),
        (('"axis u8"', '"axis u9"'), "no known type"),
        (("default = 160,", "default = 0,  "), "default of counts_per_period"),
        (("longest_body = 64", "longest_body = 40"), "needs more than 40 bytes"),
        (('[1,  "the node', '[2,  "the node'), "cause codes repeat"),
    ],
)
def test_a_wrong_table_is_refused_by_name_in_one_line(
    change, message, tmp_path, monkeypatch, capsys
):
    text = SOURCE.read_text(encoding="utf-8")
    assert change[0] in text
    monkeypatch.setattr(generator, "SOURCE", tmp_path / "bus.toml")
    generator.SOURCE.write_text(text.replace(*change, 1), encoding="utf-8")
    assert generator.main([]) == 1
    reported = capsys.readouterr()
    assert message in reported.err and reported.err.count("\n") == 1 and not reported.out


def test_a_page_without_its_markers_is_refused():
    with pytest.raises(ValueError, match="needs the marks"):
        generator.page(generator.Bus(SOURCE.read_bytes()), "# nothing")
