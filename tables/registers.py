# SPDX-License-Identifier: Apache-2.0
"""Everything that is made of tables/registers.rdl: the register blocks, the C header, the Python
table and the page. The text of each is in a template, tables/registers.*.jinja.
"""

import re
import sys
import textwrap
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from systemrdl.compiler import RDLCompiler
from systemrdl.messages import RDLCompileError
from systemrdl.node import AddressableNode, FieldNode, Node, RegNode

from tables import made_files
from tables.made_files import ROOT

SOURCE = ROOT / "tables" / "registers.rdl"
REGISTER_BUS_BASE = 0x8000_0000  # where the soft core sees the map
SLOT = 0x100  # bytes that a block may fill: a word index inside it has 6 bits
EVENTS = ("counter", "sticky")  # kinds whose port is a strobe that the block counts or holds
Property = Callable[[str], Any]  # of a field, by its name in SystemRDL
Port = tuple[str, str, str, str]  # direction, shape, name, text
Fitted = tuple[str, str, str, str, bool]  # and whether the text has lines of its own, above
KINDS: dict[
    str, Callable[[Property, FieldNode], Any]
] = {  # what each kind of a field must be: sw, hw, and a further condition
    "counter": lambda get, field: get("incrsaturate") and on_write(get) == "wclr",
    "sticky": lambda get, field: on_write(get) == "woclr" and field.width == 1,
    "pulse": lambda get, field: field.width == 1 and get("hw").name == "r",
    "constant": lambda get, field: field.parent.inst_name == "map_crc" and field.width == 32,
    "input": lambda get, field: get("sw").name == "r",
    "setting": lambda get, field: get("hw").name == "r" and not on_write(get),
}


class Refused(ValueError):
    def __init__(self, why: str) -> None:
        super().__init__(f"tables/registers.rdl: {why}")


@dataclass(frozen=True)
class Field:
    """kind: constant, input (hardware gives it), setting (software gives it), pulse, counter,
    sticky. A field has the name of its register alone if it is called `value`.
    """

    name: str
    port: str
    low: int
    width: int
    kind: str
    signed: bool
    access: str
    reset: int
    unit: str
    lsb: str
    text: str  # its own words, or none
    meaning: str  # its own words, or those of the register with its name
    on_write: bool  # swmod or passed: a strobe follows a write
    on_read: bool  # swacc: a strobe goes with a read
    passed: bool  # a setting that its block does not hold
    momentary: bool  # its port is 0 in all cycles but that of the strobe of a write
    needs: str  # parameter of the block without which a setting has no bits and reads 0
    signal: str  # its port in the block; a bit of the register's port in a vector
    state: str  # what the block reads: the port itself, or the bits that it holds

    @property
    def measure(self) -> str:
        return " ".join(x for x in ("" if self.lsb == "1" else self.lsb, self.unit) if x)

    @property
    def described(self) -> str:
        return f"{self.meaning} [{self.measure}]" if self.unit else self.meaning

    @property
    def scale(self) -> Fraction:
        """Value of one count, in its unit."""
        base, power, exponent = (self.lsb or "1").partition("^")
        return Fraction(base) ** int(exponent) if power else Fraction(base)

    @property
    def in_memory(self) -> bool:
        """A long counter, which shares the memory of event_counters with the others."""
        return self.kind == "counter" and self.width == 32

    @property
    def shape(self) -> str:
        return ("signed " if self.signed else "") + span(self.width)

    @property
    def bits(self) -> str:
        """What a write of the register puts into the field."""
        one = f"wdata[{self.low}]"
        return one if self.width == 1 else f"wdata{span(min(self.width, 32), self.low)}"


@dataclass(frozen=True)
class Answer:
    """One word of a register on rdata: its value, and the sign that fills so many bits above."""

    name: str
    word: int
    value: str
    fill: int
    sign: str


def above(parts: list[str], zeros: int) -> str:
    """A word of these parts, the lowest first, below so many zeros."""
    parts = [*parts, f"{zeros}'d0"] if zeros else parts
    return parts[0] if len(parts) == 1 else "{" + ", ".join(parts[::-1]) + "}"


@dataclass(frozen=True)
class Register:
    name: str
    offset: int
    wide: bool
    vector: bool
    text: str
    engine: str  # word of motion_engine that holds it, or none
    snooped: bool  # taken from what the register memory stores
    fields: tuple[Field, ...]

    @property
    def word(self) -> int:
        return self.offset // 4

    @property
    def on_write(self) -> bool:
        return any(f.on_write for f in self.fields)

    @property
    def on_read(self) -> bool:
        return any(f.on_read for f in self.fields)

    @property
    def access(self) -> str:
        return "".join(c for c in "rw" if any(c in f.access for f in self.fields))

    @property
    def live(self) -> tuple[Field, ...]:
        """What the block itself answers; the register memory answers with the settings."""
        return tuple(f for f in self.fields if "r" in f.access and f.kind != "setting")

    @property
    def stored(self) -> tuple[Field, ...]:
        """The settings that are read back from the register memory."""
        return tuple(f for f in self.fields if "r" in f.access and f.kind == "setting")

    def answers(self, constant: int) -> list[Answer]:
        """What the block itself answers to a read of each word, except for counts in a memory."""
        if not self.live or self.live[0].in_memory:
            return []
        f = self.live[0]
        if self.vector:
            held = f.state.partition("[")[0]
            return [Answer(self.name, self.word, above([held], 32 - len(self.live)), 0, "")]
        if self.wide:
            high, rest = f"{f.port}_high", 64 - f.width
            sign = f"{high}[{f.width - 33}]" if f.signed and rest else ""
            return [
                Answer(self.name, self.word, f"{f.port}[31:0]", 0, ""),
                Answer(f"{self.name}_high", self.word + 1, above([high], rest), rest, sign),
            ]
        parts: list[str] = []
        at = 0
        for f in self.live:
            if f.low > at:
                parts.append(f"{f.low - at}'d0")
            parts.append(f"32'h{constant:08X}" if f.kind == "constant" else f.state)
            at = f.low + f.width
        extended = len(self.fields) == 1 and f.signed and at < 32
        sign = f"{f.state}[{at - 1}]" if extended else ""
        return [Answer(self.name, self.word, above(parts, 32 - at), 32 - at, sign)]


@dataclass(frozen=True)
class Block:
    name: str
    text: str
    base: int
    stride: int  # 0: there is one of it
    count: int
    registers: tuple[Register, ...]

    @property
    def fields(self) -> list[tuple[Register, Field]]:
        return [(r, f) for r in self.registers for f in r.fields]

    @property
    def own(self) -> list[Register]:
        """The registers of which the block itself has something."""
        return [r for r in self.registers if not r.engine and not r.snooped]

    @property
    def own_fields(self) -> list[tuple[Register, Field]]:
        return [(r, f) for r in self.own for f in r.fields]

    def answers(self, constant: int) -> list[Answer]:
        return [a for r in self.registers for a in r.answers(constant)]

    def rdata(self, constant: int) -> str:
        """The answers together, of which one is not 0 after a read, and the signs above them."""
        answers = self.answers(constant)
        texts = [f"({{32{{get_{a.name}}}}} & {a.value})" for a in answers]
        for fill in sorted({a.fill for a in answers if a.sign}):
            signs = [f"(get_{a.name} && {a.sign})" for a in answers if a.sign and a.fill == fill]
            texts.append(f"{{{{{fill}{{{' || '.join(signs)}}}}}, {32 - fill}'d0}}")
        if self.counted:
            texts.append("({32{get_count}} & count)")
        return " | ".join(texts)

    @property
    def counted(self) -> list[tuple[int, Field]]:
        """The counters in the memory of event_counters, each with its word."""
        return [(r.word, f) for r, f in self.own_fields if f.in_memory]

    @property
    def counters(self) -> int:
        """The places of that memory: a power of two."""
        return 1 << max(word for word, _ in self.counted).bit_length()

    @property
    def counted_word(self) -> str:
        """The condition that a word is one of those counters."""
        return " || ".join(f"word == {literal(6, word)}" for word, _ in self.counted)

    @property
    def counted_events(self) -> str:
        """The strobes of those counters, each at the place of its word; place 0 has none."""
        ports = {word: f.port for word, f in self.counted}
        places = range(self.counters - 1, 0, -1)
        return "{" + ", ".join(ports.get(place, "1'b0") for place in places) + "}"

    @property
    def parameters(self) -> list[str]:
        """Those that decide which settings the block itself holds."""
        return sorted({f.needs for _, f in self.own_fields if f.needs and not f.passed})

    @property
    def wide_settings(self) -> list[Register]:
        return [r for r in self.own if r.wide and r.fields[0].kind == "setting"]

    @property
    def unused(self) -> int:
        """The lowest bit of wdata that no register of this block has; all above are unused too."""
        taken = ("setting", "pulse", "sticky")
        fields = [(r, f) for r, f in self.own_fields if f.kind in taken and not f.passed]
        return max((f.low + f.width - 32 * r.wide for r, f in fields), default=0)

    @property
    def ports(self) -> list[Fitted]:
        """(direction, shape, name, text) of each port behind the register bus."""
        return fitted([port for r in self.own for port in ports(r)])


Texts = dict[str, list[str]]  # an expression: the words {kind, word} that it is for


@dataclass(frozen=True)
class Layout:
    """The words of all blocks with settings that are read back, as the register memory holds them:
    the blocks of the node first, then those of each axis.
    """

    alone: tuple[Block, ...]
    of_axes: tuple[Block, ...]

    @property
    def blocks(self) -> list[tuple[int, Block]]:
        """Each block with its kind."""
        return list(enumerate((*self.alone, *self.of_axes)))

    @property
    def parameters(self) -> list[str]:
        return sorted({f.needs for _, b in self.blocks for _, f in b.fields if f.needs})

    @property
    def registers(self) -> list[tuple[int, Register]]:
        """Each register with {kind, word} of its low word."""
        return [(kind << 6 | r.word, r) for kind, b in self.blocks for r in b.registers]

    @property
    def low(self) -> list[str]:
        """Low words of settings of 64 bits: they wait for the high word."""
        wide = [(at, r) for at, r in self.registers if r.wide and r.fields[0].kind == "setting"]
        return [literal(9, at) for at, _ in wide]

    @property
    def wide(self) -> list[str]:
        """Low words of all registers of 64 bits."""
        return [literal(9, at) for at, r in self.registers if r.wide]

    @property
    def high(self) -> Texts:
        """High words whose write stores both words, if the setting is built."""
        wide = [(at, r) for at, r in self.registers if r.wide and r.stored]
        return grouped((at + 1, built(r.fields[0]) or "1'b1") for at, r in wide)

    @property
    def mask(self) -> Texts:
        """The bits that a write stores; none without an entry."""
        ones = [(at, r, [(f, (1 << f.width) - 1) for f in r.stored]) for at, r in self.registers]
        return grouped((at + r.wide, in_word(fields, r.wide)) for at, r, fields in ones)

    @property
    def sign(self) -> Texts:
        """The bit that fills the bits above a signed setting; 0 without an entry."""
        found = []
        for at, r in self.registers:
            f = r.fields[0]
            top = f.width - 32 * r.wide - 1
            if r.stored and len(r.fields) == 1 and f.signed and top < 31:
                bit = f"wdata[{top}]"
                found.append((at + r.wide, f"{built(f)} && {bit}" if f.needs else bit))
        return grouped(found)

    @property
    def first(self) -> Texts:
        """First values that are not 0."""
        values = [(at, r, [(f, f.reset) for f in r.stored]) for at, r in self.registers]
        return grouped(
            (at + high, in_word(fields, high))
            for at, r, fields in values
            for high in range(1 + r.wide)
        )


def built(field: Field) -> str:
    """The wire of the layout that is high if the axis has what the setting needs, or nothing."""
    return field.needs.lower()


def grouped(entries: Iterable[tuple[int, str]]) -> Texts:
    found: Texts = {}
    for at, text in entries:
        if text:
            found.setdefault(text, []).append(literal(9, at))
    return found


def in_word(values: Sequence[tuple[Field, int]], high: int) -> str:
    """The values of fields together in their low or high word; empty if they are 0."""
    words: dict[str, int] = {}
    for f, value in values:
        words[built(f)] = words.get(built(f), 0) | (value << f.low >> 32 * high & 0xFFFF_FFFF)
    texts = [
        f"({there} ? {literal(32, word)} : 32'd0)" if there else literal(32, word)
        for there, word in words.items()
        if word
    ]
    return " | ".join(texts)


def layout(blocks: Sequence[Block]) -> Layout:
    if [b.stride > 0 for b in blocks] != sorted(b.stride > 0 for b in blocks):
        raise Refused("the blocks of the axes come after those of the node")
    if any(b.stride not in (0, SLOT) for b in blocks):
        raise Refused(f"the blocks of one kind are {SLOT:#x} apart")
    if len(blocks) > 7:
        raise Refused("there are at most 7 kinds of blocks")
    stored = [b for b in blocks if any(r.stored for r in b.registers)]
    alone = tuple(b for b in stored if not b.stride)
    return Layout(alone, tuple(b for b in stored if b.stride))


def span(width: int, low: int = 0) -> str:
    return f"[{low + width - 1}:{low}]" if width > 1 else ""


def literal(width: int, value: int) -> str:
    digits = f"{value & (1 << width) - 1:0{(width + 3) // 4}X}"
    return f"{width}'h{digits}" if width > 1 else f"1'b{value}"


def on_write(get: Property) -> str | None:
    kind = get("onwrite")
    return str(kind.name) if kind else None


def kind_of(get: Property, name: str) -> str:
    """The kind of a field, from the properties that no other kind has."""
    found = next((k for k, p in (("counter", "counter"), ("sticky", "hwset")) if get(p)), None)
    found = found or ("pulse" if get("singlepulse") else None)
    return found or {"na": "constant", "w": "input"}.get(get("hw").name, "setting")


def field_of(node: FieldNode, register: RegNode) -> Field:
    get: Property = node.get_property
    name, parent = node.inst_name, register.inst_name
    kind, sw = kind_of(get, name), get("sw").name
    wide, vector = register.get_property("regwidth") == 64, bool(register.get_property("vector"))
    needs = get("needs") or register.get_property("needs") or ""
    passed = bool(get("passed") or register.get_property("passed"))
    unknown = {"onread", "hwclr", "we", "wel", "sticky", "stickybit", "decr"}
    text, words = described(node), described(register)
    port = parent if name == "value" else f"{parent}_{name}"
    signal = f"{parent}[{node.low}]" if vector else port
    held = {"counter": "_count", "sticky": "_held"}.get(kind, "")
    for bad, why in (
        (not KINDS[kind](get, node), "this mixture of properties is not supported"),
        (unknown & node.inst.properties.keys(), "one of its properties is not supported"),
        (kind in EVENTS and sw != "rw", "software must read and write what is counted or held"),
        (kind == "setting" and "w" not in sw, "software must write a setting"),
        (get("swacc") and "r" not in sw, "swacc is only for what software reads"),
        (get("swmod") and kind != "setting", "swmod is only for what software sets"),
        (needs and kind != "setting", "only a setting may need a parameter"),
        (passed and (kind != "setting" or wide), "only a setting of 32 bits may be passed"),
        (
            get("momentary") and (wide or needs or passed or not get("swmod")),
            "momentary is for swmod alone",
        ),
        (
            kind == "counter" and node.width == 32 and register.raw_address_offset > 4 * 31,
            "a long counter is one of the first 32 words",
        ),
        (not wide and node.high > 31, "a field of more than 32 bits needs a register of 64"),
        (wide and (name != "value" or node.width <= 32), "64 bits are for one long `value`"),
        (wide and kind not in ("input", "setting"), "64 bits are an input or a setting"),
        (wide and register.raw_address_offset % 8, "64 bits start at a multiple of 8 bytes"),
        (vector and (node.width > 1 or kind not in ("input", "sticky")), "not for a vector"),
    ):
        if bad:
            raise Refused(f"{register.get_path()}.{name}: {why}")
    return Field(
        name=name,
        port=port,
        low=node.low,
        width=node.width,
        kind=kind,
        signed=bool(get("two_complement")),
        access=sw,
        reset=int(get("reset") or 0),
        unit=get("unit") or "",
        lsb=get("lsb") or "",
        text=text,
        meaning=text or (words if name == "value" else f"{words}: {name.replace('_', ' ')}"),
        on_write=bool(get("swmod")) or passed,
        on_read=bool(get("swacc")),
        passed=passed,
        momentary=bool(get("momentary")),
        needs=needs,
        signal=signal,
        state=signal.replace(parent, parent + held, 1) if vector else port + held,
    )


def described(node: Node) -> str:
    """The description of a node on one line, or nothing."""
    return " ".join((node.get_property("desc") or "").split())


def register_of(node: Node) -> Register:
    if not isinstance(node, RegNode):
        raise Refused(f"{node.get_path()}: a block holds registers only")
    width, vector = node.get_property("regwidth"), bool(node.get_property("vector"))
    if width not in (32, 64) or node.get_property("accesswidth") != 32:
        raise Refused(f"{node.get_path()}: 32 bits, or 64 with accesswidth 32")
    fields = tuple(field_of(f, node) for f in node.children() if isinstance(f, FieldNode))
    whole = [f.low for f in fields] == list(range(len(fields)))
    engine, snooped = str(node.get_property("engine") or ""), bool(node.get_property("snooped"))
    if (engine or snooped) and any(f.kind != "setting" or f.on_write for f in fields):
        raise Refused(f"{node.get_path()}: a register without ports holds settings only")
    if snooped and any("r" not in f.access for f in fields):
        raise Refused(f"{node.get_path()}: the register memory stores only what can be read")
    if width == 64 and any(f.kind == "setting" and f.reset for f in fields):
        raise Refused(f"{node.get_path()}: a setting of 64 bits begins at 0")
    if vector and not (whole and len({f.kind for f in fields}) == 1):
        raise Refused(f"{node.get_path()}: a vector has one kind of bits, from bit 0 on")
    offset = node.raw_address_offset
    text = described(node)
    return Register(node.inst_name, offset, width == 64, vector, text, engine, snooped, fields)


def read(axes: int = 1, source: Path = SOURCE) -> list[Block]:
    """The blocks of a node with so many axes, in the order of their addresses."""
    return list(compiled(axes, source, source.read_bytes()))


@cache
def compiled(axes: int, source: Path, content: bytes) -> tuple[Block, ...]:
    """The blocks of a source with this content, which is compiled once."""
    compiler = RDLCompiler()
    compiler.compile_file(str(source))
    blocks = []
    for node in compiler.elaborate(parameters={"AXES": axes}).top.children():
        if not isinstance(node, AddressableNode):
            raise Refused(f"{node.get_path()}: the map holds blocks only")
        base, stride = node.raw_address_offset, (node.array_stride or 0) if node.is_array else 0
        if node.size > SLOT or base % SLOT or stride % SLOT:
            raise Refused(f"{node.get_path()}: a block starts at a multiple of {SLOT:#x}, one each")
        count = (node.array_dimensions or [1])[0] if node.is_array else 1
        registers = tuple(register_of(r) for r in node.children())
        text = " ".join(str(node.get_property("name")).split())
        blocks.append(Block(node.inst_name, text, base, stride, count, registers))
    return tuple(blocks)


def crc(source: Path = SOURCE) -> int:
    return zlib.crc32(source.read_bytes().replace(b"\r\n", b"\n"))


def ports(r: Register) -> list[Port]:
    """Each port of a register."""
    fields = r.fields
    found: list[Port] = []
    if r.vector:
        what = "levels: " if fields[0].kind == "input" else "strobes: "
        found.append(("input  wire ", span(len(fields)), r.name, f"{what}{r.text}"))
        fields = ()
    for f in fields:
        strobe = f.kind == "pulse" or f.kind in EVENTS
        text = f"strobe: {f.described}" if strobe else f.described
        out = f.kind in ("setting", "pulse")
        if f.kind != "constant" and not f.passed:
            shape = "" if strobe else f.shape
            found.append(("output logic" if out else "input  wire ", shape, f.port, text))
    strobes = (("written", r.on_write, "new value"), ("read", r.on_read, "read in this cycle"))
    for event, there, text in strobes:
        if there:
            found.append(("output logic", "", f"{r.name}_{event}", f"strobe: {text}"))
    return found


def fitted(found: Sequence[Port]) -> list[Fitted]:
    """The same ports; a text that does not fit the line of its port after the formatter's work
    has lines of its own above it.
    """
    widest = max((len(shape.partition("[")[2]) + 1 for _, shape, _, _ in found), default=0)
    signed = 7 if any(shape.startswith("signed") for _, shape, _, _ in found) else 0
    longest = max((len(name) for _, _, name, _ in found), default=0)
    taken = len("    output logic  ,  // ") + max(widest, 6) + signed + longest
    room = made_files.COLUMNS - taken
    return [(*port, len(port[3]) > room) for port in found]


def sentence(text: str) -> str:
    """A text as a sentence of the page."""
    return f"{text[0].upper()}{text[1:].rstrip('.')}. " if text else ""


def comment(text: str, indent: str = "// ") -> str:
    return textwrap.fill(text, made_files.COLUMNS, initial_indent=indent, subsequent_indent=indent)


def files() -> dict[Path, str]:
    constant, blocks = crc(), read()
    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader(ROOT / "tables"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    templates.filters |= {"comment": comment, "sentence": sentence, "span": span}
    templates.globals |= dict(literal=literal, constant=constant, base=REGISTER_BUS_BASE)

    def filled(template: str, **values: object) -> str:
        return templates.get_template(f"registers.{template}.jinja").render(**values)

    made = {
        ROOT / "rtl" / "registers" / f"{b.name}_registers.sv": made_files.systemverilog(
            filled("sv", block=b)
        )
        for b in blocks
    }
    for name, template in (("register_layout", "layout.sv"), ("register_width", "width.sv")):
        made[ROOT / "rtl" / "registers" / f"{name}.sv"] = made_files.systemverilog(
            filled(template, layout=layout(blocks))
        )
    made[ROOT / "sw" / "firmware" / "made" / "registers.h"] = filled("h", blocks=blocks)
    made[ROOT / "sw" / "host" / "moire" / "made" / "registers.py"] = filled("py", blocks=blocks)
    made[ROOT / "docs" / "registers.md"] = filled("md", blocks=blocks)
    names = re.findall(r"^#define (\w+)", filled("h", blocks=blocks), re.MULTILINE)
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise Refused(f"the C name {twice[0]} means two things: rename a register or field")
    return made


def main(arguments: Sequence[str] | None = None) -> int:
    try:
        return made_files.main(__doc__, files, arguments)
    except RDLCompileError:  # the compiler has said where and why
        print("tables/registers.rdl is not right: nothing was made", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
