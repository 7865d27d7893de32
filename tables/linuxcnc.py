# SPDX-License-Identifier: Apache-2.0
"""Makes the headers of the driver for LinuxCNC and the tables of docs/linuxcnc.md, from
linuxcnc.toml, link.toml, registers.rdl and bus.toml.
"""

import re
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tables import bus, link, made_files, registers
from tables.made_files import ROOT

SOURCE = ROOT / "tables" / "linuxcnc.toml"
FOLDER = ROOT / "sw" / "linuxcnc" / "made"
LISTS = ROOT / "sw" / "linuxcnc_config" / "lists.py"
PAGE = ROOT / "docs" / "linuxcnc.md"
REGISTERS = ROOT / "sw" / "firmware" / "made" / "registers.h"
TYPES = {"bit": "HAL_BIT", "float": "HAL_FLOAT", "s32": "HAL_S32", "u32": "HAL_U32"}
DIRECTIONS = {"in": "HAL_IN", "out": "HAL_OUT", "io": "HAL_IO"}
SCOPES = {  # whose pins are listed, and how their names begin
    "node": ("a node", "moire.N."),
    "axis": ("an axis", "moire.N.axis.M."),
    "encoder": ("an axis without a drive", "moire.N.encoder.M."),
    "digin": ("a digital input", "moire.N.digin.M."),
}

Table = dict[str, Any]


def header(name: str, sources: str, lines: Sequence[str], include: str = "stdint.h") -> str:
    """A made C header; the driver has another licence than what its sources are made for."""
    guard = f"MOIRE_LINUXCNC_{name.upper()}_H"
    return "\n".join(
        [
            "// SPDX-License-Identifier: GPL-2.0-or-later",
            f"// Made by tables/linuxcnc.py from {sources}: do not edit.",
            f"#ifndef {guard}",
            f"#define {guard}",
            "",
            f"#include <{include}>",
            "",
            *lines,
            "",
            "#endif",
            "",
        ]
    )


def packet_header() -> str:
    """The layout of the packets."""
    found = link.constants(link.read(link.SOURCE.read_text(encoding="utf-8")))
    lines = [f"#define PACKET_{name} {number}u" for name, number in found.items()]
    return header("packet_layout", "link.toml", lines)


def registers_header() -> str:
    """The register map: bases, offsets and fields, as the firmware has them."""
    text = registers.files()[REGISTERS]
    names = "MAP_CRC|NODE|AXIS|FEEDBACK|LINK"
    lines = re.findall(rf"^#define (?:{names})\w* (?:\w+)(?=\s|$)", text, re.MULTILINE)
    field = "#define FIELD_GET(word, field) (((uint32_t)(word) & field##_MASK) >> field##_SHIFT)"
    return header("registers", "registers.rdl", [*lines, "", field])


def shape(name: str) -> tuple[int, bool]:
    """Words of a register, and whether each axis has one."""
    block, _, register = name.partition(".")
    found = next(one for one in registers.read() if one.name == block)
    wide = next(r for r in found.registers if r.name == register).wide
    return 2 if wide else 1, found.stride > 0


def lists_header(table: Table) -> str:
    """Where the words of each register are in the lists: after `fixed` words, and `each` words for
    each axis of the node.
    """
    lines = ["struct list_place {", "    unsigned fixed, each, width;", "};", ""]
    for name, names in table["list"].items():
        fixed = each = 0
        for register in names:
            words, of_axes = shape(register)
            place = f"{{.fixed = {fixed}, .each = {each}, .width = {words}}}"
            lines.append(
                f"static const struct list_place {name[:-1].upper()}_"
                f"{register.replace('.', '_').upper()} = {place};"
            )
            if of_axes:
                each += words
            else:
                fixed += words
        lines += [f"enum {{ {name.upper()}_FIXED = {fixed}, {name.upper()}_EACH = {each} }};", ""]
    return header("lists", "linuxcnc.toml", lines[:-1])


def lists_table(table: Table) -> str:
    """The lists for the set-up."""
    lines = [
        "# SPDX-License-Identifier: Apache-2.0",
        '"""Made by tables/linuxcnc.py from linuxcnc.toml: do not edit."""',
        "",
        "# the registers that each packet carries, in their order",
    ]
    for name, names in table["list"].items():
        lines += [f"{name.upper()} = (", *(f'    "{register}",' for register in names), ")"]
    return "\n".join(lines) + "\n"


def texts(name: str, rows: dict[int, str]) -> list[str]:
    """A C array of texts by number."""
    made = [f"static const char* const {name}[] = {{"]
    for number, words in rows.items():
        made.append(f'    [{number}] = "{words}",')
    return [*made, "};", f"#define {name}_END {max(rows) + 1}u"]


def by_number(entries: Table) -> dict[int, tuple[str, str]]:
    """{number: (name, words)} of a list of bus.toml."""
    return {number: (name, words) for name, (number, words) in entries.items()}


def causes(table: Table, faults: dict[int, tuple[str, str]]) -> dict[int, tuple[str, str]]:
    """{number: (name, words)} of the causes of a fault."""
    found = {bit + 1: row for bit, row in faults.items()}
    for name, (number, words) in table["cause"].items():
        if number in found:
            raise ValueError(f"linuxcnc.toml: the number of the cause {name} is that of a fault")
        found[number] = (name, words)
    return found


def identifier(pin: str) -> str:
    """The name of a pin in C."""
    return re.sub(r"\W", "_", pin)


def pins_header(
    table: Table, found: dict[int, tuple[str, str]], states: dict[int, tuple[str, str]]
) -> str:
    """Structures of the pins, the tables by which they are exported, causes and states."""
    lines: list[str] = []
    for scope in SCOPES:
        rows = table[scope]
        lines += [f"struct {scope}_pins {{"]
        lines += [f"    hal_{kind}_t* {identifier(pin)};" for pin, (kind, *_) in rows.items()]
        lines += ["};", "", f"static const struct moire_pin {scope.upper()}_PINS[] = {{"]
        for pin, (kind, direction, _, _) in rows.items():
            place = f"offsetof(struct {scope}_pins, {identifier(pin)})"
            row = f'    {{"{pin}", {TYPES[kind]}, {DIRECTIONS[direction]}, {place}}},'
            lines.append(row)
        lines += ["};", ""]
    lines += [f"#define CAUSE_{name.upper()} {n}u" for n, (name, _) in found.items()]
    lines += ["", *texts("CAUSE_TEXTS", {n: words for n, (_, words) in found.items()}), ""]
    lines += [f"#define STATE_{name.upper()} {n}u" for n, (name, _) in states.items()]
    start = [
        "#include <stddef.h>",
        "",
        "#include <hal.h>",
        "",
        "struct moire_pin {",
        "    const char* name;",
        "    hal_type_t type;",
        "    hal_pin_dir_t direction;",
        "    size_t place;  // of the pointer in its structure",
        "};",
        "",
    ]
    return header("pins", "linuxcnc.toml and bus.toml", [*start, *lines])


def page(table: Table, found: dict[int, tuple[str, str]]) -> str:
    """docs/linuxcnc.md with its tables."""
    lines = [""]
    for scope, (what, start) in SCOPES.items():
        lines += [
            f"Pins of {what}, `{start}NAME`:",
            "",
            "| name | type | direction | unit | meaning |",
            "| --- | --- | --- | --- | --- |",
            *(
                f"| `{pin}` | {kind} | {direction} | {unit} | {words} |"
                for pin, (kind, direction, unit, words) in table[scope].items()
            ),
            "",
        ]
    lines += [
        "Causes, the numbers of `fault-cause`; 0 is no fault:",
        "",
        "| number | cause | meaning |",
        "| --- | --- | --- |",
        *(f"| {number} | `{name}` | {words} |" for number, (name, words) in found.items()),
        "",
    ]
    marks = "<!-- made by tables/linuxcnc.py: pins -->", "<!-- end of pins -->"
    return made_files.filled(PAGE, *marks, lines)


def made() -> dict[Path, str]:
    """{file: its text}."""
    table = tomllib.loads(SOURCE.read_text(encoding="utf-8"))
    words = bus.read()
    found = causes(table, by_number(words["fault"]))
    return {
        FOLDER / "packet_layout.h": packet_header(),
        FOLDER / "registers.h": registers_header(),
        FOLDER / "lists.h": lists_header(table),
        LISTS: lists_table(table),
        FOLDER / "pins.h": pins_header(table, found, by_number(words["state"])),
        PAGE: page(table, found),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    return made_files.main(__doc__ or "", made, arguments)


if __name__ == "__main__":
    sys.exit(main())
