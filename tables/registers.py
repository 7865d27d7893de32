# SPDX-License-Identifier: Apache-2.0
"""Everything that is made of tables/registers.rdl: the register blocks, the C header, the Python
table and the page.
"""

import sys
import textwrap
import zlib
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from systemrdl import RDLCompileError, RDLCompiler
from systemrdl.node import FieldNode, RegNode

from tables import made_files

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "tables" / "registers.rdl"
REGISTER_BUS_BASE = 0x8000_0000  # where the soft core sees the map
SLOT = 0x100  # bytes a block may fill: a word index inside it has 6 bits
MADE = "made by tables/registers.py from tables/registers.rdl; change those"


@dataclass(frozen=True)
class Field:
    """kind: constant, input (hardware gives it), setting (software gives it), pulse, counter,
    sticky.
    """

    name: str
    low: int
    width: int
    kind: str
    signed: bool
    access: str
    reset: int
    unit: str
    lsb: str
    text: str
    on_write: bool  # swmod: a strobe follows a write
    on_read: bool  # swacc: a strobe goes with a read
    needs: str  # parameter of the block without which a setting has no bits and reads 0


@dataclass(frozen=True)
class Register:
    name: str
    offset: int
    wide: bool
    text: str
    fields: tuple

    def meaning(self, field):
        """Words for a field: its own, or the register's with the field's name."""
        return field.text or (
            self.text if field.name == "value" else f"{self.text}: {field.name.replace('_', ' ')}"
        )

    def meaning_and_unit(self, field):
        unit = " ".join(x for x in ("" if field.lsb == "1" else field.lsb, field.unit) if x)
        return f"{self.meaning(field)} [{unit}]" if field.unit else self.meaning(field)

    def port(self, field):
        return self.name if field.name == "value" else f"{self.name}_{field.name}"

    @property
    def word(self):
        return self.offset // 4

    @property
    def on_write(self):
        return any(f.on_write for f in self.fields)

    @property
    def on_read(self):
        return any(f.on_read for f in self.fields)


@dataclass(frozen=True)
class Block:
    name: str
    text: str
    base: int
    stride: int  # 0: there is one of it
    count: int
    registers: tuple

    @property
    def fields(self):
        return [(r, f) for r in self.registers for f in r.fields]

    @property
    def parameters(self):
        return sorted({f.needs for _, f in self.fields if f.needs})


class Refused(ValueError):
    def __init__(self, why):
        super().__init__(f"tables/registers.rdl: {why}")


def words(text):
    return " ".join((text or "").split())


def field_of(node, register):
    get = node.get_property
    name = f"{register.get_path()}.{node.inst_name}"
    sw, hw = get("sw").name, get("hw").name
    if get("counter"):
        kind = "counter"
        good = (
            get("incrsaturate") and get("onwrite") and get("onwrite").name == "wclr" and sw == "rw"
        )
    elif get("hwset"):
        kind, good = "sticky", get("onwrite") and get("onwrite").name == "woclr" and sw == "rw"
    elif get("singlepulse"):
        kind, good = "pulse", node.width == 1 and hw == "r"
    elif hw == "na":
        kind, good = "constant", sw == "r" and register.inst_name == "map_crc" and node.width == 32
    elif hw == "w":
        kind, good = "input", sw == "r"
    else:
        kind, good = "setting", hw == "r" and "w" in sw and not get("onwrite")
    unknown = [
        p
        for p in ("onread", "hwclr", "we", "wel", "sticky", "stickybit", "decr")
        if node.inst.properties.get(p)
    ]
    if not good or unknown or (get("swacc") and "r" not in sw):
        raise Refused(f"{name}: this mixture of properties is not supported")
    if kind != "setting" and get("swmod"):
        raise Refused(f"{name}: swmod is only for what software sets")
    wide, needs = (
        register.get_property("regwidth") == 64,
        get("needs") or register.get_property("needs") or "",
    )
    if needs and (kind != "setting" or wide):
        raise Refused(f"{name}: only a setting of 32 bits or fewer may need a parameter")
    if (
        not wide
        and node.high > 31
        or wide
        and (node.inst_name != "value" or node.width <= 32 or kind not in ("input", "setting"))
    ):
        raise Refused(
            f"{name}: a field of more than 32 bits must be the `value` of a register of 64"
        )
    return Field(
        node.inst_name,
        node.low,
        node.width,
        kind,
        bool(get("two_complement")),
        sw,
        int(get("reset") or 0),
        get("unit") or "",
        get("lsb") or "",
        words(get("desc")),
        bool(get("swmod")),
        bool(get("swacc")),
        needs,
    )


def read(axes=1, source=SOURCE):
    """The blocks of a node with so many axes, in the order of their addresses."""
    compiler = RDLCompiler()
    compiler.compile_file(str(source))
    top = compiler.elaborate(parameters={"AXES": axes}).top
    blocks = []
    for node in top.children():
        registers = []
        for register in node.children():
            if not isinstance(register, RegNode):
                raise Refused(f"{register.get_path()}: a block holds registers only")
            width = register.get_property("regwidth")
            if width not in (32, 64) or register.get_property("accesswidth") != 32:
                raise Refused(f"{register.get_path()}: 32 bits, or 64 with accesswidth 32")
            fields = tuple(
                field_of(f, register) for f in register.children() if isinstance(f, FieldNode)
            )
            registers.append(
                Register(
                    register.inst_name,
                    register.raw_address_offset,
                    width == 64,
                    words(register.get_property("desc")),
                    fields,
                )
            )
        if (
            node.size > SLOT
            or node.raw_address_offset % SLOT
            or (node.is_array and node.array_stride % SLOT)
        ):
            raise Refused(
                f"{node.get_path()}: a block starts at a multiple of {SLOT:#x} and is not longer"
            )
        blocks.append(
            Block(
                node.inst_name,
                words(node.get_property("name")),
                node.raw_address_offset,
                node.array_stride if node.is_array else 0,
                node.array_dimensions[0] if node.is_array else 1,
                tuple(registers),
            )
        )
    return blocks


def crc(source=SOURCE):
    return zlib.crc32(source.read_bytes().replace(b"\r\n", b"\n"))


# ---- SystemVerilog
# -----------------------------------------------------------------------------------------------


def span(width):
    return f"[{width - 1}:0]" if width > 1 else ""


def literal(width, value):
    return (
        f"{width}'h{value & (1 << width) - 1:0{(width + 3) // 4}X}" if width > 1 else f"1'b{value}"
    )


def state_of(register, field):
    """Name of what is read: the port itself, or what stands behind it."""
    port = register.port(field)
    return {"counter": f"{port}_count", "sticky": f"{port}_held"}.get(field.kind, port)


def ports(block):
    lines = []
    for r in block.registers:
        for f in r.fields:
            name, sign = r.port(f), "signed " if f.signed else ""
            shape = f"{sign}{span(f.width)}"
            if f.kind == "input":
                lines.append(("input  wire ", shape, name, r.meaning_and_unit(f)))
            elif f.kind in ("counter", "sticky"):
                lines.append(
                    (
                        "input  wire ",
                        "",
                        name,
                        f"strobe, {'counted' if f.kind == 'counter' else 'held'}: {r.meaning_and_unit(f)}",
                    )
                )
            elif f.kind == "setting":
                lines.append(("output logic", shape, name, r.meaning_and_unit(f)))
            elif f.kind == "pulse":
                lines.append(("output logic", "", name, f"strobe: {r.meaning_and_unit(f)}"))
        if r.on_write:
            lines.append(
                (
                    "output logic",
                    "",
                    f"{r.name}_written",
                    f"strobe: {r.name} has just been written, its new value stands",
                )
            )
        if r.on_read:
            lines.append(
                (
                    "output logic",
                    "",
                    f"{r.name}_read",
                    f"strobe: {r.name} is being read in this clk",
                )
            )
    return lines


def read_value(r, constant, high=False):
    """What stands on rdata for this register, most significant bit first."""
    readable = [f for f in r.fields if "r" in f.access]
    if r.wide:
        f = r.fields[0]
        name = state_of(r, f)
        if not high:
            return f"{name}[31:0]"
        top = f"{name}_high" if f.kind == "input" else f"{name}[{f.width - 1}:32]"
        pad = 64 - f.width
        sign = f"{name}_high[{f.width - 33}]" if f.kind == "input" else f"{name}[{f.width - 1}]"
        return (
            top
            if not pad
            else f"{{{{{pad}{{{sign if f.signed else chr(49) + chr(39) + 'b0'}}}}}, {top}}}"
        )
    parts, at = [], 0
    for f in readable:
        if f.low > at:
            parts.append(f"{f.low - at}'d0")
        parts.append(literal(f.width, constant) if f.kind == "constant" else state_of(r, f))
        at = f.low + f.width
    if at < 32:
        alone = len(r.fields) == 1 and r.fields[0].signed
        parts.append(
            f"{{{32 - at}{{{parts[-1]}[{r.fields[0].width - 1}]}}}}" if alone else f"{32 - at}'d0"
        )
    return parts[0] if len(parts) == 1 else "{" + ", ".join(reversed(parts)) + "}"


def verilog(block, constant):
    name = f"{block.name}_registers"
    head = [
        f"// {name} -- the register block of {block.text}.",
        "//",
        "// latency  1 clk from select to rdata, and from a write to the new value        rate  one access per clk",
        "// source   tables/registers.rdl",
        "// model    tb/registers/register_block.py, equal in every bit of every cycle; test tb/registers/test_registers.py",
        f"// made     by tables/registers.py, never by hand{'; map_crc is the CRC-32 of the source' if block.name == 'node' else ''}",
    ]
    fixed = [
        ("input  wire ", "", "clk", ""),
        (
            "input  wire ",
            "",
            "rst",
            "every setting takes its first value, what was counted or held is cleared",
        ),
        ("input  wire ", "", "select", "an access to this block"),
        ("input  wire ", "", "write", "with select: wdata goes into the word"),
        (
            "input  wire ",
            "[5:0]",
            "word",
            "index of the 32-bit word; a word without a register reads 0",
        ),
        ("input  wire ", "[31:0]", "wdata", ""),
        ("output logic", "[31:0]", "rdata", "what was read, for one clk; 0 in every other"),
    ]
    table = fixed + ports(block)
    shape_width = max(len(s) for _, s, _, _ in table)
    name_width = max(len(n) for _, _, n, _ in table) + 1
    chosen = [
        f"    parameter int {p} = 1{' ' * 16}// 0: the settings that need it have no bits and read 0"
        for p in block.parameters
    ]
    opened = (
        [f"module {name} #(", *(f"{p}," for p in chosen[:-1]), chosen[-1], ") ("]
        if chosen
        else [f"module {name} ("]
    )
    lines = ["// SPDX-License-Identifier: Apache-2.0", *head, "`default_nettype none", "", *opened]
    for i, (kind, shape, port, text) in enumerate(table):
        declared = f"{port}{',' if i + 1 < len(table) else ''}"
        lines.append(
            f"    {kind} {shape:<{shape_width}} {declared:<{name_width}}{'  // ' + text if text else ''}".rstrip()
        )
    lines.append(");")

    inner = []
    for r in block.registers:
        for f in r.fields:
            if f.kind == "counter":
                inner.append(f"    logic {span(f.width):<6} {r.port(f)}_count;")
            elif f.kind == "sticky":
                inner.append(f"    logic {span(f.width):<6} {r.port(f)}_held;")
            elif r.wide and f.kind == "input":
                inner.append(f"    logic {span(f.width - 32):<6} {r.port(f)}_high;")
            elif r.wide:
                inner.append(f"    logic [31:0] {r.port(f)}_low;")
    lines += inner + ([""] if inner else [])

    writes = any(f.kind != "input" and f.kind != "constant" for _, f in block.fields)
    lines.append("    wire get = select && !write;")
    if writes:
        lines.append("    wire put = select && write;")
    used = set()
    for r, f in block.fields:
        if f.kind == "sticky" or f.kind == "pulse" or f.kind == "setting":
            used |= set(range(32)) if r.wide else set(range(f.low, f.low + f.width))
    spare = sorted(set(range(32)) - used)
    if spare:
        if spare != list(range(spare[0], 32)):
            raise Refused(f"{name}: unused bits of wdata in the middle")
        lines.append(
            f"    wire unused = &{{1'b0, wdata[31:{spare[0]}]}};         // no register of this block has these bits"
            if spare[0] < 31
            else "    wire unused = &{1'b0, wdata[31]};"
        )
    lines += [
        f"    assign {r.name}_read = get && word == 6'h{r.word:02X};"
        for r in block.registers
        if r.on_read
    ]
    lines += [
        "",
        "    always_ff @(posedge clk) begin",
        "        rdata <= '0;",
        "        if (get) case (word)",
    ]
    for r in block.registers:
        if any("r" in f.access for f in r.fields):
            lines += textwrap.wrap(
                f"6'h{r.word:02X}: rdata <= {read_value(r, constant)};",
                132,
                initial_indent=12 * " ",
                subsequent_indent=28 * " ",
                break_long_words=False,
            )
            if r.wide:
                lines.append(
                    f"            6'h{r.word + 1:02X}: rdata <= {read_value(r, constant, high=True)};"
                )
    lines += ["            default: rdata <= '0;", "        endcase"]
    for r in block.registers:
        if r.wide and r.fields[0].kind == "input":
            f = r.fields[0]
            lines.append(
                f"        if (get && word == 6'h{r.word:02X}) {r.port(f)}_high <= {r.port(f)}[{f.width - 1}:32];"
            )
    lines.append("")

    reset = ["            rdata <= '0;"]
    for r in block.registers:
        if r.on_write:
            lines.append(f"        {r.name}_written <= put && word == 6'h{r.word + r.wide:02X};")
            reset.append(f"            {r.name}_written <= 1'b0;")
        for f in r.fields:
            port, state, hit = r.port(f), state_of(r, f), f"put && word == 6'h{r.word:02X}"
            bits = f"wdata[{f.low + f.width - 1}:{f.low}]" if f.width > 1 else f"wdata[{f.low}]"
            bits = "wdata" if bits == "wdata[31:0]" else bits
            if f.kind == "pulse":
                lines.append(f"        {port} <= {hit} && {bits};")
                reset.append(f"            {port} <= 1'b0;")
            elif f.kind == "sticky":
                lines.append(f"        {state} <= {port} || ({state} && !({hit} && {bits}));")
                reset.append(f"            {state} <= 1'b0;")
            elif f.kind == "counter":
                one = f"{{{f.width - 1}'d0, {port}}}"
                lines.append(f"        if ({hit}) {state} <= {one};")
                lines.append(f"        else if (!(&{state})) {state} <= {state} + {one};")
                reset.append(f"            {state} <= '0;")
            elif f.kind == "setting" and r.wide:
                lines.append(f"        if (put && word == 6'h{r.word:02X}) {port}_low <= wdata;")
                top = "wdata" if f.width == 64 else f"wdata[{f.width - 33}:0]"
                lines.append(
                    f"        if (put && word == 6'h{r.word + 1:02X}) {port} <= {{{top}, {port}_low}};"
                )
                reset += [
                    f"            {port}_low <= '0;",
                    f"            {port} <= {literal(f.width, f.reset)};",
                ]
            elif f.kind == "setting":
                there, first = f"{f.needs} != 0", literal(f.width, f.reset)
                lines.append(
                    f"        if ({f'{there} && ' if f.needs else ''}{hit}) {port} <= {bits};"
                )
                reset.append(
                    f"            {port} <= {f'{there} ? {first} : {chr(39)}0' if f.needs and f.reset else first};"
                )
            elif f.kind == "input" and r.wide:
                reset.append(f"            {port}_high <= '0;")
    if lines[-1] == "":
        lines.pop()
    lines += [
        "        if (rst) begin",
        *reset,
        "        end",
        "    end",
        "endmodule",
        "",
        "`default_nettype wire",
        "",
    ]
    return "\n".join(lines)


# ---- C
# -----------------------------------------------------------------------------------------------------------

C_BEGIN = """\
// SPDX-License-Identifier: Apache-2.0
// The register map as the firmware sees it; {made}.
//
// NODE_x, BUS_x, AXIS_x are byte offsets inside a block. Fields: FIELD_GET(word, AXIS_STATE_QUEUE_FREE),
// FIELD_GET_SIGNED, FIELD_PUT(AXIS_CONTROL_ENABLE, 1). A value alone in its register has the register's name.
#ifndef MOIRE_REGISTERS_H
#define MOIRE_REGISTERS_H

#include <stdint.h>

#define REGISTERS_BASE {base:#010x}u
#define MAP_CRC {constant:#010x}u            // CRC-32 of tables/registers.rdl

{places}

#define FIELD_GET(word, field) (((uint32_t)(word) & field##_MASK) >> field##_SHIFT)
#define FIELD_GET_SIGNED(word, field) \\
    ((int32_t)((uint32_t)(word) << (32 - field##_SHIFT - field##_WIDTH)) >> (32 - field##_WIDTH))
#define FIELD_PUT(field, value) (((uint32_t)(value) << field##_SHIFT) & field##_MASK)

#ifndef MOIRE_REGISTER_ACCESS                // a host test may bring its own two functions
static inline uint32_t register_read(uint32_t offset)
{{ return *(volatile uint32_t *)(uintptr_t)(REGISTERS_BASE + offset); }}
static inline void register_write(uint32_t offset, uint32_t value)
{{ *(volatile uint32_t *)(uintptr_t)(REGISTERS_BASE + offset) = value; }}
#else
uint32_t register_read(uint32_t offset);
void register_write(uint32_t offset, uint32_t value);
#endif

// 64 bits: reading the low word latches the high one, writing the high word commits both.
static inline uint64_t register_read_wide(uint32_t offset)
{{ uint32_t low = register_read(offset); return (uint64_t)register_read(offset + 4) << 32 | low; }}
static inline void register_write_wide(uint32_t offset, uint64_t value)
{{ register_write(offset, (uint32_t)value); register_write(offset + 4, (uint32_t)(value >> 32)); }}
"""


def header(blocks, constant):
    places = []
    for b in blocks:
        places.append(f"#define {b.name.upper()}_BASE {b.base:#05x}u")
        if b.stride:
            places.append(f"#define {b.name.upper()}_STRIDE {b.stride:#05x}u")
    out = [
        C_BEGIN.format(
            made=MADE, base=REGISTER_BUS_BASE, constant=constant, places="\n".join(places)
        )
    ]
    for b in blocks:
        up, argument = b.name.upper(), "unsigned axis, " if b.stride else ""
        place = f"{up}_BASE + axis * {up}_STRIDE" if b.stride else f"{up}_BASE"
        kinds = [("uint32_t", "read", ""), ("void", "write", ", uint32_t value")]
        if any(r.wide and "r" in r.fields[0].access for r in b.registers):
            kinds.append(("uint64_t", "read_wide", ""))
        if any(r.wide and "w" in r.fields[0].access for r in b.registers):
            kinds.append(("void", "write_wide", ", uint64_t value"))
        for kind, name, more in kinds:
            out += [
                f"static inline {kind} {b.name}_{name}({argument}uint32_t offset{more})",
                f"{{ {'' if kind == 'void' else 'return '}register_{name}({place} + offset{', value' if more else ''}); }}",
            ]
    out.append("")
    seen = set()

    def define(name, value, text=""):
        if name in seen:
            raise Refused(f"the C name {name} means two things: rename a register or field")
        seen.add(name)
        out.append(f"#define {name:<46} {value}{'  // ' + text if text else ''}")

    for b in blocks:
        out.append(f"// {b.text}")
        for r in b.registers:
            name = f"{b.name}_{r.name}".upper()
            access = "".join(c for c in "rw" if any(c in f.access for f in r.fields))
            alone = len(r.fields) == 1
            define(
                name,
                f"{r.offset:#05x}u",
                f"{access}: {r.meaning_and_unit(r.fields[0]) if alone else r.text}",
            )
            if r.wide:
                define(f"{name}_LOW", f"{r.offset:#05x}u")
                define(f"{name}_HIGH", f"{r.offset + 4:#05x}u")
                define(f"{name}_WIDTH", r.fields[0].width)
                continue
            for f in r.fields:
                field = f"{b.name}_{r.port(f)}".upper()
                define(
                    f"{field}_MASK",
                    f"{((1 << f.width) - 1) << f.low:#010x}u",
                    "" if alone or not f.text else r.meaning_and_unit(f),
                )
                define(f"{field}_SHIFT", f.low)
                define(f"{field}_WIDTH", f.width)
        out.append("")
    return "\n".join([*out, "#endif", ""])


# ---- Python
# ------------------------------------------------------------------------------------------------------


def fraction(text):
    base, power, exponent = (text or "1").partition("^")
    return Fraction(base) ** int(exponent) if power else Fraction(base)


PYTHON_BEGIN = '''\
# SPDX-License-Identifier: Apache-2.0
"""The register map as the host sees it; {made}."""
from dataclasses import dataclass
from fractions import Fraction

MAP_CRC = 0x{constant:08X}          # CRC-32 of tables/registers.rdl
BLOCKS = {{{places}}}          # base, distance to the next one


@dataclass(frozen=True)
class Field:
    """A field of a register; a value alone in its register is the field `value`. Value in `unit` = count * lsb."""

    block: str
    register: str
    field: str
    offset: int          # byte offset of the register inside its block
    low: int             # lowest bit
    width: int           # above 32: the low word comes first
    signed: bool
    access: str          # r, w or rw
    unit: str
    lsb: Fraction
    text: str

    def address(self, axis=0):
        """Byte address of the (low) word in the map."""
        base, stride = BLOCKS[self.block]
        return base + axis * stride + self.offset

    def value(self, word):
        """The count in a register's word (of both words together when wider than 32 bits)."""
        count = (word >> self.low) & ((1 << self.width) - 1)
        return count - (1 << self.width) if self.signed and count >> (self.width - 1) else count


FIELDS = ('''


def python(blocks, constant):
    places = ", ".join(f'"{b.name}": (0x{b.base:03X}, 0x{b.stride:03X})' for b in blocks)
    out = [PYTHON_BEGIN.format(made=MADE, constant=constant, places=places)]
    for b in blocks:
        for r, f in b.fields:
            scale = fraction(f.lsb)
            number = (
                f"Fraction({scale.numerator}, {scale.denominator})" if scale != 1 else "Fraction(1)"
            )
            values = [b.name, r.name, f.name]
            out.append(
                "    Field("
                + ", ".join(f'"{v}"' for v in values)
                + f", 0x{r.offset:02X}, {f.low}, {f.width}, {f.signed}, "
                f'"{f.access}", "{f.unit}", {number},\n          "{r.meaning(f)}"),'
            )
    out += [")", "BY_NAME = {(f.block, f.register, f.field): f for f in FIELDS}", ""]
    return "\n".join(out)


# ---- page
# --------------------------------------------------------------------------------------------------------

HOW = {
    "constant": "",
    "input": "",
    "setting": "",
    "pulse": "Writing 1 gives a strobe of one clk. ",
    "counter": "Counts up to its largest value; an event in the clk of the write is counted. ",
    "sticky": "An event in the clk of the write is held. ",
}


PAGE_BEGIN = """\
<!-- SPDX-License-Identifier: Apache-2.0 -->
# Registers of a node

<!-- {made} -->

Map CRC-32 `0x{constant:08X}`. The soft core sees the map at `0x{base:08X}`; the line reads it by the byte addresses below
(`read_register`). Words are 32 bits, little endian, written whole. A word without a register reads 0.

Of a register of 64 bits the low word comes first: reading the low word latches the high one, writing the high word commits
both. A signed value alone in its register reads sign-extended to the register's full width. The value in the unit is the
count times the LSB.

What needs `SINE` reads 0 in a node that was built without (`SINE = 0` in `rtl/node.sv`), whatever is written to it; `position_source.sine`
of a grating tells.
"""
COLUMNS = ["offset", "register", "bits", "field", "access", "first value", "unit", "LSB", "meaning"]


def page(blocks, constant):
    out = [PAGE_BEGIN.format(made=MADE, constant=constant, base=REGISTER_BUS_BASE)]
    for b in blocks:
        place = f"`0x{b.base:03X}`" + (f" + `0x{b.stride:03X}` · axis" if b.stride else "")
        title = b.text[0].upper() + b.text[1:]
        out += [
            f"## {title}",
            "",
            f"From {place}; `rtl/registers/{b.name}_registers.sv`.",
            "",
            f"| {' | '.join(COLUMNS)} |",
            "|" + " --- |" * len(COLUMNS),
        ]
        for r in b.registers:
            for i, f in enumerate(r.fields):
                bits = f"{f.low + f.width - 1}:{f.low}" if f.width > 1 else f"{f.low}"
                first = f"{f.reset}" if f.kind in ("setting", "counter", "sticky") else ""
                name = "" if f.name == "value" else f"`{f.name}`"
                head = (f"`0x{r.offset:02X}`", f"`{r.name}`") if i == 0 else ("", "")
                own = f.text or (r.text if len(r.fields) == 1 else "")
                text = (
                    (own[0].upper() + own[1:] + ". " if own else "")
                    + HOW[f.kind]
                    + (f"Needs `{f.needs}`." if f.needs else "")
                )
                if i == 0 and len(r.fields) > 1:
                    text = f"**{r.text[0].upper() + r.text[1:]}.** {text}"
                out.append(
                    "| "
                    + " | ".join(
                        [
                            *head,
                            bits + (", signed" if f.signed else ""),
                            name,
                            f.access,
                            first,
                            f.unit,
                            f.lsb if f.unit else "",
                            text.strip().replace("|", "\\|"),
                        ]
                    )
                    + " |"
                )
        out.append("")
    return "\n".join(out)


def files():
    constant, blocks = crc(), read()
    made = {
        ROOT / "rtl" / "registers" / f"{b.name}_registers.sv": verilog(b, constant) for b in blocks
    }
    made[ROOT / "sw" / "firmware" / "made" / "registers.h"] = header(blocks, constant)
    made[ROOT / "sw" / "host" / "moire" / "made" / "registers.py"] = python(blocks, constant)
    made[ROOT / "docs" / "registers.md"] = page(blocks, constant)
    return made


def main(arguments=None) -> int:
    try:
        return made_files.main(__doc__, files, arguments)
    except RDLCompileError:  # the compiler has said where and why
        print("tables/registers.rdl is not right: nothing was made", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
