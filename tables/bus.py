# SPDX-License-Identifier: Apache-2.0
"""Makes from bus.toml the header of the firmware, the tables of the host and the made parts of the
protocol page.
"""

import re
import sys
import textwrap
import tomllib
import zlib
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from tables import made_files, registers
from tables.made_files import ROOT

SOURCE = ROOT / "tables" / "bus.toml"
HEADER = ROOT / "sw" / "firmware" / "made" / "bus_protocol.h"
HOST = ROOT / "sw" / "host" / "moire" / "made" / "bus_tables.py"
PAGE = ROOT / "docs" / "protocol.md"
COLUMNS = 100  # of the made C and Python

Entry = Mapping[str, Any]  # a table of bus.toml
Entries = Mapping[str, Entry]
Laid = list[tuple[str, str, int]]  # fields of a body: name, type, offset

SIZES = {"u8": 1, "i8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "u64": 8, "i64": 8}
REQUEST_HEAD = ["sequence u8", "operation u8"]
REPLY_HEAD = ["sequence u8", "operation u8", "cause u8"]
AXIS = "axis u8"  # first field of each request to an axis
LISTS = (  # lists of codes or bits with their words
    "cause",
    "fault",
    "encoder_event",
    "state",
    "flag",
    "calibration_reason",
    "signal_fault",
    "calibration_action",
    "scope_trigger",
    "scope_state",
    "tick_signal",
    "tick_trigger",
    "turn_phase",
    "peer_phase",
    "job_state",
    "job_action",
    "save_action",
    "update_action",
    "update_state",
    "job_flag",
)
BITS = ("fault", "encoder_event", "flag", "signal_fault", "job_flag")  # of these lists
CODES = tuple(name for name in LISTS if name not in BITS)
WORDS = ("cause", "fault", "job_state")  # lists whose words the firmware shows on its panel


def fields(head: list[str], declared: list[str]) -> tuple[Laid, int]:
    """[(name, type, offset)] of a body, and its length."""
    laid: Laid = []
    offset = 0
    for declaration in head + declared:
        name, kind = declaration.split()
        if kind not in SIZES:
            raise ValueError(f"bus.toml: '{declaration}' has no known type ({', '.join(SIZES)})")
        laid.append((name, kind, offset))
        offset += SIZES[kind]
    return laid, offset


class Target(NamedTuple):
    """The field of a register that takes the value of a parameter as it is."""

    parameter: str
    block: registers.Block
    register: registers.Register
    field: registers.Field

    @property
    def path(self) -> str:
        return f"{self.block.name}.{self.register.name}.{self.field.name}"

    @property
    def limits(self) -> tuple[int, int]:
        if self.field.signed:
            return -(1 << (self.field.width - 1)), (1 << (self.field.width - 1)) - 1
        return 0, (1 << self.field.width) - 1

    @property
    def row(self) -> str:
        register, field = self.register.name, self.field.port
        return f"    X({self.parameter}, {self.block.name}, {register}, {field})".upper()


@cache
def register_fields() -> dict[str, tuple[registers.Block, registers.Register, registers.Field]]:
    """{block.register.field: (block, register, field)} of registers.rdl."""
    return {
        f"{block.name}.{register.name}.{field.name}": (block, register, field)
        for block in registers.read()
        for register, field in block.fields
    }


def targets_of(parameters: Entries) -> list[Target]:
    """The targets of all parameters that name a register, in the order of the addresses."""
    targets = []
    for name, parameter in parameters.items():
        if "register" not in parameter:
            continue
        path = parameter["register"]
        if path.count(".") == 1:
            path += ".value"
        if path not in register_fields():
            raise ValueError(f"bus.toml: {name} names {path}, which registers.rdl does not have")
        targets.append(Target(name, *register_fields()[path]))
    return sorted(targets, key=lambda t: (t.block.base, t.register.offset, t.field.low))


def read(text: bytes | None = None) -> dict[str, Any]:
    """The tables of bus.toml, or of this text, as they are written."""
    return tomllib.loads((SOURCE.read_bytes() if text is None else text).decode())


class Bus:
    """bus.toml, checked."""

    def __init__(self, text: bytes):
        # lines of a checkout may end in CR LF; the CRC is computed with LF
        text = text.replace(b"\r\n", b"\n")
        table = read(text)
        self.crc = zlib.crc32(text)
        self.version: int = table["version"]
        self.longest_body: int = table["longest_body"]
        self.lists: dict[str, dict[str, tuple[int, str]]] = {
            name: {key: tuple(value) for key, value in table[name].items()} for name in LISTS
        }
        self.constants: dict[str, tuple[int, str]] = {
            name: (value, words) for name, (value, words) in table["constant"].items()
        }
        numbers = {name: value for name, (value, _) in self.constants.items()}
        self.operations: Entries = {
            name: {**operation, "text": with_numbers(operation["text"], numbers)}
            for name, operation in table["operation"].items()
        }
        self.parameters: Entries = table["parameter"]
        self.settings: Entries = table["setting"]
        self.values_crc = zlib.crc32(
            repr(
                [
                    (name, value["id"], value["unit"], value["lsb"], value["default"])
                    for name, value in [*self.parameters.items(), *self.settings.items()]
                ]
            ).encode()
        )
        self.layouts: dict[str, tuple[tuple[Laid, int], tuple[Laid, int]]] = {}
        for name, operation in self.operations.items():
            self.layouts[name] = (
                fields(REQUEST_HEAD, operation["request"]),
                fields(REPLY_HEAD, operation["reply"]),
            )
        self.targets = targets_of(self.parameters)
        self.check()
        self.check_targets()

    def check_targets(self) -> None:
        """A register must take every value of its parameters, and hold nothing else."""
        named = [target.path for target in self.targets]
        once("registers of parameters", named)
        for target in self.targets:
            parameter = self.parameters[target.parameter]
            low, high = target.limits
            if "apply" in parameter:
                raise ValueError(f"bus.toml: {target.parameter} has a register and a function")
            if not target.block.stride or target.register.wide or target.field.kind != "setting":
                raise ValueError(f"bus.toml: {target.path} is no setting of 32 bits of an axis")
            if parameter["min"] < low or parameter["max"] > high:
                raise ValueError(f"bus.toml: {target.parameter} does not fit into {target.path}")
            if target.field.signed and len(target.register.fields) > 1:
                raise ValueError(f"bus.toml: {target.path} is signed and not alone")
            for field in target.register.fields:
                path = f"{target.block.name}.{target.register.name}.{field.name}"
                if field.kind == "setting" and path not in named:
                    raise ValueError(f"bus.toml: {path} has no parameter, {target.path} has")

    def check(self) -> None:
        for name, entries in self.lists.items():
            once(f"{name} codes", [code for code, _ in entries.values()])
        once("operation codes", [operation["code"] for operation in self.operations.values()])
        once("parameter ids", [parameter["id"] for parameter in self.parameters.values()])
        once("setting ids", [setting["id"] for setting in self.settings.values()])
        for name, (request, reply) in self.layouts.items():
            if max(request[1], reply[1]) > self.longest_body:
                raise ValueError(
                    f"bus.toml: operation {name} needs more than {self.longest_body} bytes"
                )
        for name, parameter in {**self.parameters, **self.settings}.items():
            if not parameter["min"] <= parameter["default"] <= parameter["max"]:
                raise ValueError(f"bus.toml: the default of {name} is outside its range")
            feature = parameter.get("needs", "")
            if feature and f"axis.built.{feature.lower()}" not in register_fields():
                raise ValueError(
                    f"bus.toml: {name} needs {feature}, which axis.built does not have"
                )
            Fraction(parameter["lsb"])


def with_numbers(text: str, numbers: Mapping[str, int]) -> str:
    """The text with the values of the constants that it names in braces."""
    try:
        return text.format_map(numbers)
    except (KeyError, ValueError) as error:
        raise ValueError(f"bus.toml: '{text}' names no constant: {error}") from None


def once(what: str, numbers: Sequence[object]) -> None:
    if len(set(numbers)) != len(numbers):
        raise ValueError(f"bus.toml: {what} repeat")


# ------------------------------------------------------------------ firmware


def commented(code: str, text: str) -> list[str]:
    """A line of C with its comment, which goes above it if the line gets too long."""
    line = f"{code}    // {text}"
    if len(line) <= COLUMNS:
        return [line]
    return [*comment(text, len(code) - len(code.lstrip())), code]


def comment(text: str, indent: int = 0) -> list[str]:
    start = " " * indent + "// "
    return textwrap.wrap(
        text, COLUMNS, initial_indent=start, subsequent_indent=start, break_on_hyphens=False
    )


def header(bus: Bus) -> str:
    out = [
        "// SPDX-License-Identifier: Apache-2.0",
        "// Made by tables/bus.py from tables/bus.toml: do not edit.",
        "#ifndef MOIRE_BUS_PROTOCOL_H",
        "#define MOIRE_BUS_PROTOCOL_H",
        "",
        f"#define PROTOCOL_CRC         0x{bus.crc:08X}u    // CRC-32 of bus.toml",
        f"#define BUS_VERSION         {bus.version}u",
        f"#define BUS_LONGEST_BODY    {bus.longest_body}u",
        f"#define BUS_REQUEST_HEAD    {fields(REQUEST_HEAD, [])[1]}u  // sequence, operation",
        f"#define BUS_REPLY_HEAD      {fields(REPLY_HEAD, [])[1]}u  // sequence, operation, cause",
        "",
    ]
    for name, (number, words) in bus.constants.items():
        out += commented(f"#define BUS_{name.upper()} {number}u", words)
    out.append("")
    for name, entries in bus.lists.items():
        out.append(f"enum bus_{name} {{" + ("" if name in CODES else "    // bits"))
        for key, (code, words) in entries.items():
            value = str(code) if name in CODES else f"1 << {code}"
            out += commented(f"    BUS_{name}_{key}".upper() + f" = {value},", words)
        out += ["};", ""]
    for name in WORDS:
        out.append("// X(code, words), up to a colon")
        out += macro(
            f"BUS_{name.upper()}_WORDS",
            [
                f"    X({code}, {quoted(words.partition(':')[0])})"
                for code, words in bus.lists[name].values()
            ],
        )
    out.append("enum bus_operation {")
    for name, operation in bus.operations.items():
        out += commented(
            f"    BUS_OPERATION_{name.upper()} = {operation['code']},", operation["text"]
        )
    out += ["};", ""]
    out.append("// Lengths of whole bodies and offsets of their fields, in bytes, little endian.")
    for name, (request, reply) in bus.layouts.items():
        for way, (laid, length), head in (("REQUEST", request, 2), ("REPLY", reply, 3)):
            out.append(f"#define BUS_{name.upper()}_{way}_LENGTH {length}u")
            for field, kind, offset in laid[head:]:
                out.append(
                    f"#define BUS_{name.upper()}_{way}_{field.upper()} {offset}u    // {kind}"
                )
    out.append("")
    out += comment(
        "X(name, code, length of the request body, length of the reply body if the cause is ok,"
        " 1 if the first field is an axis)"
    )
    rows = [
        f"    X({name}, {operation['code']}, {bus.layouts[name][0][1]}, {bus.layouts[name][1][1]}, "
        f"{int(operation['request'][:1] == [AXIS])})"
        for name, operation in bus.operations.items()
    ]
    out += macro("BUS_OPERATIONS", rows)
    out += values("parameter", bus.parameters) + register_rows(bus) + function_rows(bus)
    out += values("setting", bus.settings)
    out += [
        "// Of all parameters and settings: it changes with the meaning of a saved number.",
        f"#define BUS_VALUES_CRC 0x{bus.values_crc:08X}u",
        "",
    ]
    out += ["#endif", ""]
    return "\n".join(out)


def values(kind: str, parameters: Entries) -> list[str]:
    """Numbers and ranges of the parameters of an axis, or of the settings of a station."""
    out = [f"enum bus_{kind} {{"]
    for name, parameter in parameters.items():
        out += commented(
            f"    BUS_{kind}_{name}".upper() + f" = {parameter['id']},",
            of_one_count(parameter) + parameter["text"],
        )
    out += ["};", f"#define BUS_{kind.upper()}_COUNT {len(parameters)}u", ""]
    out.append("// X(name, id, min, max, default): all int64_t, in counts of the wire")
    rows = [
        f"    X({name}, {parameter['id']}, "
        + ", ".join(f"{parameter[key]}LL" for key in ("min", "max", "default"))
        + ")"
        for name, parameter in parameters.items()
    ]
    out += macro(f"BUS_{kind.upper()}S", rows)
    if needy := [(name, p["needs"]) for name, p in parameters.items() if "needs" in p]:
        out.append(
            f"// X({kind}, field of axis.built without which it accepts only 0 and its default)"
        )
        rows = [f"    X({name}, {feature})".upper() for name, feature in needy]
        out += macro(f"BUS_{kind.upper()}_NEEDS", rows)
    return out


def register_rows(bus: Bus) -> list[str]:
    """The parameters whose value goes into a field of a register as it is."""
    return [
        "// X(parameter, block, register, field), in the order of the addresses",
        *macro("BUS_PARAMETER_REGISTERS", [target.row for target in bus.targets]),
    ]


def function_rows(bus: Bus) -> list[str]:
    """The parameters that a function of the firmware computes registers from."""
    applied = [(name, p["apply"]) for name, p in bus.parameters.items() if "apply" in p]
    functions = list(dict.fromkeys(function for _, function in applied))
    return [
        "// X(number, function), and X(parameter, number of the function that applies it)",
        *macro("BUS_PARAMETER_FUNCTIONS", [f"    X({f.upper()}, {f})" for f in functions]),
        *macro("BUS_PARAMETERS_APPLIED", [f"    X({name}, {f})".upper() for name, f in applied]),
    ]


def of_one_count(parameter: Entry) -> str:
    if not parameter["unit"] and parameter["lsb"] == "1":
        return ""
    return f"[{parameter['lsb']} {parameter['unit']}".rstrip() + "] "


def macro(name: str, rows: list[str]) -> list[str]:
    return [f"#define {name}(X) \\"] + [row + " \\" for row in rows[:-1]] + [rows[-1], ""]


# ------------------------------------------------------------------ host


def host(bus: Bus) -> str:
    out = [
        "# SPDX-License-Identifier: Apache-2.0",
        '"""Made by tables/bus.py from tables/bus.toml: do not edit."""',
        "from fractions import Fraction",
        "from typing import NamedTuple",
        "",
        "",
        "class Operation(NamedTuple):",
        "    name: str",
        "    code: int",
        "    text: str",
        "    request: tuple          # (field, type) after sequence and operation",
        "    reply: tuple            # (field, type) after sequence, operation and cause",
        "",
        "",
        "class Parameter(NamedTuple):",
        "    name: str",
        "    id: int",
        "    unit: str",
        "    lsb: Fraction           # value of one count on the wire, in unit",
        "    min: int                # in counts on the wire, as max and default",
        "    max: int",
        "    default: int",
        "    text: str",
        '    needs: str = ""         # field of axis.built that any value but 0 and default needs',
        "",
        "",
        f"PROTOCOL_CRC = 0x{bus.crc:08X}",
        f"VERSION = {bus.version}",
        f"LONGEST_BODY = {bus.longest_body}",
        "",
        *(f"{name.upper()} = {value}  # {words}" for name, (value, words) in bus.constants.items()),
        "",
    ]
    for name, entries in bus.lists.items():
        out.append(f"# {'code' if name in CODES else 'bit'}: (name, words)")
        out.append(f"{name.upper()}S = {{")
        for key, (code, words) in entries.items():
            out += string(f"    {code}: ({quoted(key)}, ", words, "),")
        out += ["}", ""]
    out.append("OPERATIONS = {operation.name: operation for operation in (")
    for name, operation in bus.operations.items():
        request, reply = (
            tuple(tuple(declaration.split()) for declaration in operation[way])
            for way in ("request", "reply")
        )
        out += string(
            f"    Operation({quoted(name)}, {operation['code']}, ", operation["text"], ","
        )
        out.append(f"              {pairs(request)},")
        out.append(f"              {pairs(reply)}),")
    out += [")}", ""]
    for table, parameters in (("PARAMETERS", bus.parameters), ("SETTINGS", bus.settings)):
        out.append(f"{table} = {{parameter.name: parameter for parameter in (")
        for name, parameter in parameters.items():
            lsb = Fraction(parameter["lsb"])
            value = f"Fraction({lsb.numerator}, {lsb.denominator})"
            unit = quoted(parameter["unit"])
            out.append(f"    Parameter({quoted(name)}, {parameter['id']}, {unit}, {value},")
            out.append(
                f"              {parameter['min']}, {parameter['max']}, {parameter['default']},"
            )
            needs = f", {quoted(parameter['needs'])}" if "needs" in parameter else ""
            out += string(" " * 14, parameter["text"], f"{needs}),")
        out += [")}", ""]
    return "\n".join(out)


def quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def string(before: str, text: str, after: str) -> list[str]:
    """A line of Python with this text, or several of which each holds a part of it."""
    line = before + quoted(text) + after
    if len(line) <= COLUMNS:
        return [line]
    indent = before.index("(") + 1 if "(" in before else len(before)
    lines = [before.rstrip()] if before.strip() else []
    parts = textwrap.wrap(text, COLUMNS - indent - len(after) - 3, break_on_hyphens=False)
    assert " ".join(parts) == text, "blanks in a row"
    lines += [" " * indent + quoted(part + " ") for part in parts[:-1]]
    return [*lines, " " * indent + quoted(parts[-1]) + after]


def pairs(declared: Iterable[tuple[str, ...]]) -> str:
    """A tuple of pairs, three on a line."""
    each = [f"({quoted(name)}, {quoted(kind)})," for name, kind in declared]
    rows = [" ".join(each[at : at + 3]) for at in range(0, len(each), 3)]
    return "(" + ("\n" + 15 * " ").join(rows) + ")"


# ------------------------------------------------------------------ page


def diagram(laid: Laid) -> list[str]:
    """A body as one row of boxes: name above, first byte and type below."""
    boxes = []
    for name, kind, offset in laid:
        below = f"{offset} {kind}"
        width = max(len(name), len(below)) + 2
        boxes.append((name.center(width), below.center(width), width))
    row: list[tuple[str, str, int]] = []
    lines, used = ["```"], 0
    for box in [*boxes, None]:
        if box is None or (row and used + box[2] + 1 > 110):
            edge = "+" + "+".join("-" * width for _, _, width in row) + "+"
            lines += [
                edge,
                "|" + "|".join(name for name, _, _ in row) + "|",
                "|" + "|".join(below for _, below, _ in row) + "|",
                edge,
            ]
            row, used = [], 0
        if box is not None:
            row.append(box)
            used += box[2] + 1
    return lines + ["```"]


def table(head: Sequence[str], rows: Iterable[Iterable[object]]) -> list[str]:
    out = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return out + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def page_parts(bus: Bus) -> dict[str, list[str]]:
    parts: dict[str, list[str]] = {}
    parts["identity"] = [
        f"Version {bus.version}, CRC-32 of `tables/bus.toml` `{bus.crc:08X}`, "
        f"longest body {bus.longest_body} bytes."
    ]
    rows: list[tuple[object, ...]]
    rows = [(f"`{name}`", *entry) for name, entry in bus.constants.items()]
    parts["constants"] = table(("constant", "value", "meaning"), rows)
    overview = [
        (operation["code"], f"[`{name}`](#{name})", operation["text"])
        for name, operation in bus.operations.items()
    ]
    body = table(("code", "operation", "purpose"), overview)
    for name, operation in bus.operations.items():
        (request, request_length), (reply, reply_length) = bus.layouts[name]
        body += [
            "",
            f"### {name}",
            "",
            operation["text"][0].upper() + operation["text"][1:] + ".",
            "",
        ]
        body += (
            [f"Request, {request_length} bytes:", ""]
            + diagram(request)
            + ["", f"Reply, {reply_length} bytes:", ""]
            + diagram(reply)
        )
    parts["operations"] = body
    for name, entries in bus.lists.items():
        rows = [(code, f"`{key}`", words) for key, (code, words) in entries.items()]
        parts[name + "s"] = table(("code" if name in CODES else "bit", "name", "words"), rows)
    for kind, parameters in (("parameter", bus.parameters), ("setting", bus.settings)):
        rows = []
        for name, parameter in parameters.items():
            lsb = Fraction(parameter["lsb"])
            rows.append(
                (
                    parameter["id"],
                    f"`{name}`",
                    parameter["unit"] or "–",
                    parameter["lsb"],
                    *(decimal(parameter[key] * lsb) for key in ("min", "max", "default")),
                    parameter["text"]
                    + (f"; needs HAS_{parameter['needs']}" if "needs" in parameter else ""),
                )
            )
        parts[kind + "s"] = table(
            ("id", kind, "unit", "one count", "min", "max", "default", "purpose"), rows
        )
    parts["example"] = example(bus)
    parts["packets"] = packets(bus)
    return parts


def enable_frames(bus: Bus) -> tuple[bytes, bytes]:
    """Payloads of `enable` of axis 0 at address 1 and of its reply."""
    code, ok = bus.operations["enable"]["code"], bus.lists["cause"]["ok"][0]

    def frame(first: int, *body: int) -> bytes:
        inside = bytes([first, len(body), *body])
        return inside[1:] + zlib.crc32(inside).to_bytes(4, "little")

    return frame(0x21, 7, code, 0, 1), frame(0x51, 7, code, ok)


def example(bus: Bus) -> list[str]:
    """`enable`, byte by byte."""
    request, reply = (payload.hex(" ").upper() for payload in enable_frames(bus))
    return [
        "`enable` of axis 0 of the node with address 1, sequence number 7:",
        "",
        "```",
        "master  21*",
        "node    61",
        f"master  {request}",
        "master  11*",
        f"node    51 {reply}",
        "```",
        "",
        "`*` has the 9th bit set.",
    ]


def packets(bus: Bus) -> list[str]:
    """The same exchange as packets; none of them is long enough for a run of 254."""

    def packet(content: bytes) -> bytes:
        return b"".join(bytes([len(part) + 1]) + part for part in content.split(b"\0")) + b"\0"

    request, reply = enable_frames(bus)
    return [
        "The same `enable` as packets:",
        "",
        "```",
        f"client  00 {packet(bytes([0x21]) + request).hex(' ').upper()}",
        f"node    00 {packet(bytes([0x51]) + reply).hex(' ').upper()}",
        "```",
    ]


def decimal(value: Fraction) -> str:
    """The value in six significant digits at most."""
    return str(value.numerator) if value.denominator == 1 else f"{float(value):.6g}"


def page(bus: Bus, text: str) -> str:
    """The page with its made parts replaced; everything outside the marks is kept."""
    for name, lines in page_parts(bus).items():
        begin, end = f"<!-- made by tables/bus.py: {name} -->", f"<!-- end of {name} -->"
        marked = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
        if len(marked.findall(text)) != 1:
            raise ValueError(f"docs/protocol.md needs the marks '{begin}' and '{end}' exactly once")
        before, after = marked.split(text)
        text = before + "\n".join([begin, "", *lines, "", end]) + after
    return text


# ------------------------------------------------------------------ command line


def made() -> dict[Path, str]:
    bus = Bus(SOURCE.read_bytes())
    return {HEADER: header(bus), HOST: host(bus), PAGE: page(bus, PAGE.read_text(encoding="utf-8"))}


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__, made, arguments)


if __name__ == "__main__":
    sys.exit(main())
