# SPDX-License-Identifier: Apache-2.0
"""Writes the C++ function that evaluates a Verilated design at a rising edge, from Verilator's own.

Verilator evaluates first the flip-flops, then all logic between them, and keeps every signal in
memory until the next edge. Here the logic comes first, with the inputs of this cycle, and then the
flip-flops. Most signals are then needed within one call only: they become local variables, and what
only one branch of a condition needs is computed in this branch. The registers, memories and outputs
after each edge are the same, bit for bit; tb/twin/test_rising_edge.py compares them. Reset is left
to Verilator's evaluation: in the function it is low.

While the soft core accesses no register, most of the node rests: its registers stay as they are
until one of its inputs changes. Such an edge evaluates only the other part; and of this part, only
what is left while the soft core waits, while the motion engine waits for the next tick (both, or
one of them), and while the axes stand still. One of these edges has a calm form for cycles at
which none of some events happens; the compiler leaves out of it what only the events need. Which
part works, and what is an event, are lists of names; a wrong list costs time, but the result is the
same.

Everything here works on the text that `verilator --no-decoration` makes; twin/statements.py takes
it apart.
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from twin.statements import (
    ASSIGNMENT,
    DECLARATION,
    NAME,
    NEVER,
    NONE,
    ZERO,
    Effect,
    FormError,
    Names,
    Parser,
    Plain,
    Sinker,
    Statement,
    array,
    effect_of,
)

ROOT = "Vnode___024root"  # Verilator's class of all signals of the node
CALL = re.compile(rf"{ROOT}___(\w+)\(vlSelf\);")
RESET = re.compile(r"\(IData\)\(vlSelfRef\.rst\)|vlSelfRef\.rst\b")
PROLOGUE = ("VL_DEBUG_IF", "Vnode__Syms*", "auto& vlSelfRef")
CORE = "vlSelfRef.node__DOT__g_core__DOT__u_core__DOT__"
ACCESSES = f"{CORE}mem_valid & {CORE}mem_addr >> 31"  # a register; it may wait for it
WAITS = f"vlSelfRef.node__DOT__core_waits & {ACCESSES}"
ENGINE_RESTS = "node__DOT__u_motion__DOT__g_engine__DOT__u_engine__DOT__quiet"
ALWAYS = "1U"
FLASH = ("node__DOT__g_serial_core__DOT__", f"{CORE[10:]}g_code__DOT__")  # such a node rests never
# What may change while the soft core accesses no register: counters in any case; the core itself,
# and with it what receives and sends the bits of a bus, which has nothing to do most of the time;
# the motion engine until there is nothing to do for it; the axes while they move, and for some
# cycles of each sample; the way of a sample from a converter to the position. A register that is
# missing here costs time only; tb/twin/test_rising_edge.py sees it.
COUNTERS = (
    r"u_tick__\w+|u_sample_tick__\w+|u_limit_tick__\w+|u_core_wait__\w+|u_engine__DOT__elapsed|"
    r"u_lines__\w+|u_filter__DOT__(?:skipped|due)|u_(?:watchdog|heartbeat)__DOT__part|since|"
    r"u_bridge__DOT__elapsed"
)
SOFT_CORE = r"u_core__\w+"
LINE = (
    r"u_receiver__\w+|u_transmitter__DOT__(?:part|u_timer__\w+)|u_break__DOT__low|"
    r"u_timeout__DOT__spent|u_link__\w+|u_arbiter__DOT__g_several__DOT__left"
)
SELDOM = re.compile(r"__DOT__master_(?:address|wdata)$")  # they are 0 but for an access of the core
ENGINE = r"u_engine__DOT__(?!u_settings)\w+|result|result_\w+"
AXES = (
    r"u_position__\w+|u_compare__DOT__(?:timer|reach|arrived)|u_filter__\w+|plain_phase|age|due|"
    r"scale_valid|stepped|counted|strobe|step_made_q|passed"
)
# Pins of encoders and steps, and what follows them. They would make each edge slower that has
# them, so they work only where the soft core does, which has much to do while axes move.
PINS = (
    r"u_steps__DOT__(?:ahead|quarter|acted|since|\w+_age)|own_step|u_inputs__DOT__u_pins__DOT__stages|"
    r"u_feedback__DOT__(?:levels|quadrature_step|u_encoder__\w+)|quadrature_count"
)
SINE = r"u_chain__\w+|u_monitor__\w+|u_adc__\w+|u_recorder__\w+|raw_sin|raw_cos"
# Events: bits that are 0 in most cycles and otherwise have much to be done, as the strobes that go
# with a value from stage to stage.
EVENTS = re.compile(
    r"(?:^|__DOT__)(?:tick|sample_tick|limit_tick|result_valid|arrived|converted|sampled|centred|"
    r"compared|u_position__DOT__(?:counted|plain_valid)|u_monitor__DOT__(?:measured|judged)|"
    r"u_chain__DOT__(?:filtered|corrected|straight|tracked)|u_correction__DOT__multiplied|"
    r"u_harmonics__DOT__(?:read|weighed|multiplied))$"
)
HAS_CALM = 3  # number of the edge at which only the engine, or only the way of a sample, works
ADC = re.compile(r"__DOT__u_adc__")  # in a node with a sine axis


def works(*names: str) -> re.Pattern[str]:
    """The registers that change although the soft core accesses none: counters, and those of these
    names.
    """
    return re.compile(rf"^(?:node__DOT__)?now$|(?:^|__DOT__)(?:{'|'.join((COUNTERS, *names))})$")


@dataclass
class Design:
    """Verilator's code of a node, taken apart."""

    types: dict[str, str]  # of the signals that are kept between edges, but of arrays
    outputs: set[str]
    pins: set[str]  # inputs
    locals: dict[str, str]  # types of the variables of the functions
    logic: Names  # signals that depend on others of the same cycle only
    of_inputs: Names  # those that depend on inputs
    program: tuple[Statement, ...]  # what is evaluated at a rising edge

    @classmethod
    def read(cls, folder: Path) -> "Design":
        """From the folder of Verilator's code."""
        code = "\n".join(file.read_text() for file in sorted(folder.glob(f"{ROOT}__*.cpp")))
        header = (folder / f"{ROOT}.h").read_text()
        edge = triggered(code, "eval_nba")
        types = {m[2]: m[1] for line in header.splitlines() if (m := DECLARATION.fullmatch(line))}
        own: dict[str, str] = {}
        for match in filter(None, map(DECLARATION.fullmatch, edge)):
            if own.setdefault(match[2], match[1]) != match[1]:
                raise FormError(f"{match[2]} has two types")
        lines = [RESET.sub(NEVER, line) for line in edge if not DECLARATION.fullmatch(line)]
        used = "\n".join(line for line in lines if not ZERO.fullmatch(line))
        words = {
            name: int(kind[7 : kind.index(">")])
            for name, kind in {**types, **own}.items()
            if kind.startswith("VlWide") and not re.search(rf"\b{name}\b(?!\[\d+U\])", used)
        }
        return cls(
            types,
            set(re.findall(r"VL_OUT\w*\(&?(\w+),", header)),
            set(re.findall(r"VL_IN\w*\(&?(\w+),", header)),
            own,
            changed(triggered(code, "eval_stl"), words),
            changed(triggered(code, "eval_ico"), words),
            Parser(lines, words).block(),
        )


def changed(lines: Sequence[str], words: Mapping[str, int]) -> Names:
    """The signals that these lines change."""
    statements = [line for line in lines if not DECLARATION.fullmatch(line)]
    return effect_of(Parser(statements, words).block()).changes


def body(code: str, name: str, types: dict[str, str] | None = None) -> list[str]:
    """The lines of a function of the class, with those of the functions that it calls. A variable
    whose name has another type in one of them, as in `types`, gets a name of its own.
    """
    types = {} if types is None else types
    pattern = rf"^(?:VL_ATTR_COLD )?void {ROOT}___{name}\({ROOT}\* vlSelf\) {{\n(.*?)^}}\n(?=\n|\Z)"
    match = re.search(pattern, code, re.M | re.S)
    if not match:
        raise FormError(f"there is no function {name}")
    found, text = [], match[1]
    declared = [m for line in text.splitlines() if (m := DECLARATION.fullmatch(line))]
    own = {match[2]: match[1] for match in declared}
    for variable in own:
        if types.get(variable, own[variable]) != own[variable]:
            text = re.sub(rf"\b{variable}\b", f"{variable}_of_{name}", text)
    types |= own
    for line in text.splitlines():
        if call := CALL.fullmatch(line):
            found += body(code, call[1], types)
        elif line and not line.startswith(PROLOGUE):
            found.append(line)
    return found


def triggered(code: str, name: str) -> list[str]:
    """The lines of a function that does all in one condition, without the condition."""
    lines = body(code, name)
    begin = next((n for n, line in enumerate(lines) if line.startswith("if (")), 0)
    if not lines[begin].startswith("if ((1ULL & vlSelfRef.__V") or lines[-1] != "}":
        raise FormError(f"{name} is not one condition")
    return lines[:begin] + lines[begin + 1 : -1]


def logic_first(design: Design) -> tuple[list[Statement], list[Statement]]:
    """The program of an edge in two parts: its logic, which goes to the beginning instead of the
    end, where it sees the inputs of the new cycle; and all that stays. A statement goes if no
    statement that stays behind it has to do with what it computes or changes what it uses.
    Statements of flip-flops never go.
    """
    stays: set[int] = set()
    while True:
        needs: set[str] = set(design.outputs)
        changes: set[str] = set()
        moved: list[int] = []
        for n, statement in reversed(list(enumerate(design.program))):
            effect = statement.effect
            free = all(v in design.logic or array(v) in design.locals for v in effect.changes)
            waits = effect.changes & (needs | changes) or effect.needs & changes
            if free and n not in stays and not waits:
                moved.insert(0, n)
            else:
                needs |= effect.needs
                changes |= effect.changes
        # executed once more before the first edge, it must compute the same again; a variable of
        # the function that a statement behind it computes has no value yet
        computed: set[str] = set()
        later = effect_of(design.program[n] for n in moved).changes
        behind = (s for n, s in enumerate(design.program) if n not in moved)
        unknown = effect_of(behind).changes & set(design.locals)
        count = len(stays)
        for n in moved:
            effect = design.program[n].effect
            read = effect.needs - computed
            if (read - set(design.locals)) & later or read & unknown:
                stays.add(n)
            computed |= effect.sets
        if len(stays) == count:
            first = set(moved)
            stay = [s for n, s in enumerate(design.program) if n not in first]
            return [design.program[n] for n in moved], stay


@dataclass
class Rest:
    """The part of a program that does nothing for a while; `active` are the names of the signals
    that change nevertheless. Its inputs are what the other part computes and it needs. An edge at
    which no input changes, after one that has left the inputs and all of its registers as they
    were, leaves them as they are again.
    """

    design: Design
    program: Sequence[Statement]
    logic: int  # statements at the beginning that are logic
    active: re.Pattern[str]
    state: set[str] = field(init=False)  # what lasts
    works: set[int] = field(init=False)  # statements of the other part

    def __post_init__(self) -> None:
        self.state = {array(name) for name in effect_of(self.program).needs}
        self.works = set()
        effects = [statement.effect for statement in self.program]
        active = {
            array(name)
            for effect in effects
            for name in effect.needs | effect.changes
            if self.active.search(name)
        }
        units = list(self.units())
        count = -1
        while count != len(self.works):
            count = len(self.works)
            late = self.late()
            # a variable of the function that is written word by word, and has no value before
            written = self.needs(True) & set(self.design.locals) & self.state
            for unit in units:
                effect = effect_of(self.program[n] for n in unit)
                changes = {array(name) for name in effect.changes}
                names = {array(name) for name in effect.needs} | changes
                if unit[0] not in self.works and (
                    names & active or changes & written or late & set(unit)
                ):
                    self.works |= set(unit)
                    changes -= self.state
                    active |= {name for name in changes if not self.is_quiet(name)}

    def is_quiet(self, name: str) -> bool:
        """Whether a signal seldom changes although others do: a single bit, and the register bus of
        the soft core.
        """
        types = {**self.design.types, **self.design.locals}
        return types.get(name, "") == "CData/*0:0*/" or bool(SELDOM.search(name))

    def units(self) -> Iterator[list[int]]:
        """The statements by what they change: two that change the same are in the same unit."""
        first: dict[str, int] = {}
        unit = list(range(len(self.program)))

        def root(n: int) -> int:
            while unit[n] != n:
                n = unit[n]
            return n

        for n, statement in enumerate(self.program):
            for name in statement.effect.changes:
                unit[root(n)] = root(first.setdefault(array(name), n))
        members: dict[int, list[int]] = defaultdict(list)
        for n in range(len(self.program)):
            members[root(n)].append(n)
        yield from members.values()

    def changes(self, works: bool) -> dict[str, list[int]]:
        """{signal: the statements of one part that change it}"""
        found: dict[str, list[int]] = defaultdict(list)
        for n, statement in enumerate(self.program):
            if (n in self.works) == works:
                for name in statement.effect.changes:
                    found[array(name)].append(n)
        return found

    def late(self) -> set[int]:
        """Statements of the resting part that do not see their inputs as they are at the beginning
        of an edge or after the logic.
        """
        changes = self.changes(True)
        return {
            n
            for n, statement in enumerate(self.program)
            if n not in self.works
            for name in {array(name) for name in statement.effect.needs}
            for writer in changes.get(name, [])
            if (writer < n if name in self.state else writer > n or writer >= self.logic)
        }

    def needs(self, works: bool) -> set[str]:
        """What the statements of one part need."""
        part = effect_of(s for n, s in enumerate(self.program) if (n in self.works) == works)
        return {array(name) for name in part.needs}

    @cached_property
    def inputs(self) -> set[str]:
        """What the resting part needs and does not change itself."""
        return self.needs(False) - set(self.changes(False))

    @cached_property
    def results(self) -> set[str]:
        """What only the logic of the resting part changes and the other part needs."""
        return self.needs(True) & set(self.changes(False)) - self.state

    @cached_property
    def logic_inputs(self) -> set[str]:
        """The inputs that are logic."""
        return self.inputs & set(self.changes(True)) - self.state

    @cached_property
    def registers(self) -> set[str]:
        """What must be as before: the inputs that last, and the registers of the resting part."""
        lasting = self.inputs - self.logic_inputs | set(self.changes(False)) & self.state
        return lasting & (set(self.design.types) | self.design.outputs)


def text_of(design: Design, program: Sequence[Statement], kept: set[str], stored: set[str]) -> str:
    """The C++ of a program. Signals are local variables unless they are kept; those that are stored
    are in `rest`.
    """
    passing = {array(name) for name in effect_of(program).changes} - kept
    here = {
        **{name: kind for name, kind in design.locals.items() if name not in stored},
        **{name: design.types[name] for name in sorted(passing & set(design.types) - stored)},
    }
    statements = Sinker(frozenset(here) & passing).sunk(program)
    text = "\n".join(line for statement in statements for line in statement.lines())
    text = re.sub(r"\bvlSelfRef\.(\w+)", lambda m: m[1] if m[1] in here else m[0], text)
    text = re.sub(
        r"\b(?:vlSelfRef\.)?([A-Za-z_]\w*)",
        lambda m: f"rest.{m[1]}" if m[1] in stored else m[0],
        text,
    )
    used = set(NAME.findall(text))
    variables = "".join(f"{kind} {name};\n" for name, kind in here.items() if name in used)
    return variables + text


def flagged(text: str, arrays: set[str], flag: str) -> str:
    """The text with a statement after each assignment to a word of these arrays."""
    lines = []
    for line in text.splitlines():
        lines.append(line)
        match = ASSIGNMENT.fullmatch(line)
        changed = {match[1]} if match else set(NAME.findall(line)) if line[:3] == "VL_" else set()
        if changed & arrays:
            lines.append(flag)
    return "\n".join(lines)


def differs(kind: str, a: str, b: str) -> str:
    """An expression that is not 0 if two signals of a type differ."""
    if kind.startswith("VlWide"):
        words = range(int(kind[7 : kind.index(">")]))
        return f"!!({' | '.join(f'({a}[{n}] ^ {b}[{n}])' for n in words)})"
    return f"({a} != {b})"


def any_of(conditions: Iterable[str]) -> str:
    """An expression without branches that is not 0 if one of these is not."""
    return " |\n".join(conditions) or "0"


@dataclass
class Edges:
    """The functions of a rising edge. Number 0 evaluates the whole program; each further one leaves
    out more, a Rest of the program of its parent, and refuses if an input of what it leaves out has
    changed.
    """

    design: Design
    program: Sequence[Statement]
    logic: int  # statements at the beginning that are logic
    active: Sequence[tuple[int, re.Pattern[str]]]  # parent of each edge from 1 on, what changes
    has_calm: int | None = None  # the edge that has a calm form
    programs: list[list[Statement]] = field(init=False)
    rests: list[Rest] = field(init=False)  # Rest n is what edge n + 1 leaves out of its parent
    logics: list[int] = field(init=False)  # as `logic`, of each program

    def __post_init__(self) -> None:
        self.programs, self.rests, self.logics = [list(self.program)], [], [self.logic]
        for parent, active in self.active:
            rest = Rest(self.design, self.programs[parent], self.logics[parent], active)
            self.rests.append(rest)
            self.programs.append([rest.program[n] for n in sorted(rest.works)])
            self.logics.append(sum(n < rest.logic for n in rest.works))
        changes = effect_of(self.program).changes
        self.types = {**self.design.locals, **self.design.types}
        self.arrays = {array(name) for name in changes} - set(self.types) - self.design.outputs
        # logic that one edge leaves as it was and uses
        self.results = {name for rest in self.rests for name in rest.results}
        self.stored = self.results & set(self.design.locals)

    def left_out(self, number: int) -> list[int]:
        """The numbers of the Rests that an edge leaves out."""
        return [*self.left_out(self.active[number - 1][0]), number - 1] if number else []

    def rests_of(self, number: int) -> list[int]:
        """The numbers of the Rests of which an edge is the parent."""
        return [n for n, (parent, _) in enumerate(self.active) if parent == number]

    def before(self, n: int) -> list[str]:
        """Registers and pins of which Rest n has a copy from before the last edge."""
        rest = self.rests[n]
        return sorted(rest.registers | rest.inputs & self.design.pins)

    def now(self, name: str) -> str:
        """A signal as Verilator's code names it."""
        return name if name in self.design.locals else f"vlSelfRef.{name}"

    def changed(self, names: Iterable[str], copy: str) -> str:
        """An expression that is not 0 if one of the signals differs from its copy, in whose name @
        stands for that of the signal.
        """
        return any_of(
            differs(self.types.get(name, ""), self.now(name), f"rest.{copy.replace('@', name)}")
            for name in names
        )

    def members(self) -> Iterator[str]:
        """What is remembered from one edge to the next."""
        for name in sorted(self.stored):
            yield f"{self.types[name]} {name};"
        for n, rest in enumerate(self.rests):
            yield f"bool known_{n} = false;"  # nothing but the inputs can change what rests
            yield f"bool held_{n} = false;"  # it was known, and all below is as it was
            yield f"bool written_{n} = false;"  # a memory that it has or reads was written
            yield from (f"decltype({ROOT}::{name}) before_{n}_{name};" for name in self.before(n))
            inputs = sorted(rest.logic_inputs)
            yield from (f"{self.types[name]} input_{n}_{name};" for name in inputs)
        # for a caller that has changed a register by itself
        forgets = " ".join(f"known_{n} = false;" for n in range(len(self.rests)))
        yield f"void forget() {{ {forgets} }}"

    def after_logic(self, number: int) -> Plain:
        """Refuses, or stores the logic inputs of what may rest from the next edge on."""
        computed = {array(name) for name in effect_of(self.programs[number]).changes}
        names: set[str] = set()
        lines = []
        for n in self.left_out(number):
            if inputs := self.rests[n].logic_inputs & computed:
                names |= inputs
                differ = self.changed(sorted(inputs), f"input_{n}_@")
                lines.append(f"if ({differ}) return false;")
        for n in self.rests_of(number):
            inputs = self.rests[n].logic_inputs
            names |= inputs
            stores = [f"rest.input_{n}_{name} = {self.now(name)};" for name in sorted(inputs)]
            lines += [f"if (!rest.held_{n}) {{", *stores, "}"] if stores else []
        words = {name for s in self.programs[number] for name in s.effect.changes}
        needs = frozenset(name for name in words if array(name) in names)
        return Plain(tuple(lines), Effect(needs, changes=frozenset(["return"])))

    def functions(self, number: int) -> dict[str, Names]:
        """{function of an edge: events at which it refuses}, in the order in which to try them."""
        whole = {f"edge_{number}": NONE}
        if number != self.has_calm:
            return whole
        effect = effect_of(self.programs[number])
        signals = (effect.needs | effect.changes) & set(self.design.types)
        events = frozenset(filter(EVENTS.search, signals))
        return {f"calm_{number}": events, **whole} if events else whole

    def refusal(self, events: Names) -> Plain:
        """Refuses if one of the events happens."""
        line = f"if ({any_of(map(self.now, sorted(events)))}) return false;"
        return Plain((line,) if events else (), Effect(events, changes=frozenset(["return"])))

    def text(self, number: int) -> Iterator[str]:
        """The functions of an edge, each of which returns false, before it has changed anything, if
        it refuses.
        """
        for name, events in self.functions(number).items():
            yield from self.function_text(number, name, events)

    def function_text(self, number: int, name: str, events: Names) -> Iterator[str]:
        """One function of an edge."""
        program, logic = self.programs[number], self.logics[number]
        computed = {array(name) for name in effect_of(program).changes}
        late = events & effect_of(program[:logic]).changes
        # inlined where they are called, GCC makes code of them that takes 1.5 times as long
        yield "__attribute__((noinline))"
        yield f"static bool {name}({ROOT}& vlSelfRef, Rest& rest) {{"
        yield from self.refusal(events - late).lines()
        for n in self.left_out(number):
            names = self.rests[n].inputs & set(self.before(n)) & (computed | self.design.pins)
            differ = self.changed(sorted(names), f"before_{n}_@")
            yield f"if ({differ}) return false;"
        state = {array(name) for name in effect_of(self.program).needs}
        kept = state | self.design.outputs | self.results
        checks = [self.refusal(late), self.after_logic(number)]
        program = [*program[:logic], *checks, *program[logic:]]
        text = text_of(self.design, program, kept, self.stored)
        for n in self.left_out(number):
            text = flagged(text, self.arrays & self.rests[n].inputs, f"rest.known_{n} = false;")
        for n in self.rests_of(number):
            writes = self.arrays & (set(self.rests[n].changes(False)) | self.rests[n].inputs)
            text = flagged(text, writes, f"rest.written_{n} = true;")
        yield from (text, "return true;", "}")

    def known(self, number: int) -> str:
        """Whether this edge may be evaluated."""
        return " & ".join(f"rest.known_{n}" for n in self.left_out(number))

    def observed(self, n: int) -> Iterator[str]:
        """Statements that evaluate the parent of Rest n and find out whether it may rest from the
        next edge on. If only an input has changed, and this has changed nothing of what rests, it
        may rest again as soon as the input is as before.
        """
        number = self.active[n][0]
        before = self.before(n)
        rests = self.rests[n].changes(False)
        own = [name for name in before if name in rests]
        others = [name for name in before if name not in rests]
        yield f"rest.written_{n} = false;"
        yield f"if (!rest.held_{n}) {{"
        yield from (f"rest.before_{n}_{name} = vlSelfRef.{name};" for name in before)
        yield "}"
        yield f"if (edge_{number}(vlSelfRef, rest)) {{"
        yield f"const bool as_before = !(rest.written_{n} | {self.changed(own, f'before_{n}_@')});"
        inputs = self.changed(others, f"before_{n}_@")
        yield f"rest.known_{n} = as_before && (rest.held_{n} || !({inputs}));"
        yield "return;"
        yield "}"

    def chosen(self, may_rest: Mapping[int, str]) -> Iterator[str]:
        """Statements that evaluate an edge, and observe it only where one of its Rests may rest:
        the first whose condition is met.
        """
        number = self.active[min(may_rest)][0]
        for n, condition in may_rest.items():
            yield from (f"if ({condition}) {{", *self.observed(n), "} else")
        yield from ("{", *self.evaluated(number), "}")

    def evaluated(self, number: int) -> Iterator[str]:
        """Statements that evaluate an edge by the first of its functions that does not refuse."""
        for name in self.functions(number):
            yield f"if ({name}(vlSelfRef, rest)) return;"


def has_engine(design: Design) -> bool:
    """Whether the node has a motion engine."""
    return ENGINE_RESTS in design.types


def tree_of(design: Design) -> list[tuple[int, re.Pattern[str]]]:
    """The edges from number 1 on: the parent of each, and what works there. They are a chain, of
    which each leaves out more, and in a node with a motion engine one more edge, the last, at which
    the engine rests although the soft core works.
    """
    sine = any(ADC.search(name) for name in design.types)
    moves = (AXES, SINE) if sine else (AXES,)
    chain = [works(SOFT_CORE, LINE, ENGINE, *moves, PINS), works(ENGINE, *moves)]
    chain += [works(*moves)] if sine else [works(ENGINE), works()]
    if not has_engine(design):
        return list(enumerate(chain[:-1]))
    return [*enumerate(chain), (1, works(SOFT_CORE, LINE, *moves))]


def choice(edges: Edges, waits: str, accesses: str) -> Iterator[str]:
    """Statements that evaluate one of the edges: the last of the chain whose Rests are known, or
    the whole program. `waits` and `accesses` are conditions of the soft core.
    """
    engine = has_engine(edges.design)
    rests = f"vlSelfRef.{ENGINE_RESTS}"
    last = apart = len(edges.rests) - engine  # edge; the Rest that the edge after it leaves out
    if engine:
        yield from (f"const bool apart = rest.known_{apart};", f"rest.known_{apart} = false;")
    yield from (f"if ({edges.known(last)}) {{", *edges.evaluated(last), "}")
    for number in reversed(range(2, last)):
        yield f"rest.held_{number} = rest.known_{number};"
        yield from (f"rest.known_{number} = false;", f"if ({edges.known(number)}) {{")
        quiet = number == last - 1 and engine
        yield from edges.chosen({number: rests}) if quiet else edges.observed(number)
        yield from ("}", f"rest.held_{number} = false;")
    yield "rest.known_1 = false;"
    # an access wakes what rests
    yield from (f"if (({accesses}) & !({waits})) {{", "rest.known_0 = false;")
    yield from ("edge_0(vlSelfRef, rest);", "return;", "}")
    if engine:
        yield from (f"if (rest.known_0 & apart & !({waits})) {{", f"rest.known_{apart} = true;")
        yield f"if (edge_{apart + 1}(vlSelfRef, rest)) return;"
        yield from (f"rest.known_{apart} = false;", "}")
    yield f"if ({edges.known(1)}) {{"
    yield from edges.chosen({1: waits, apart: rests} if engine else {1: waits})
    yield "}"
    yield from ("rest.known_0 = false;", *edges.observed(0))


def function(design: Design) -> str:
    """The C++ of `rising_edge`, which evaluates a design whose inputs are set and whose reset is
    low, and of the struct `Rest`, in which it remembers from one edge to the next what rests.
    """
    logic, flip_flops = logic_first(design)
    program = [*logic, *flip_flops]
    if late := effect_of(program).needs & design.of_inputs:
        raise FormError(f"logic of inputs stays behind: {', '.join(sorted(late))}")
    has_flash = any(name.startswith(FLASH) for name in design.types)
    waits, accesses = (NEVER, ALWAYS) if has_flash else (WAITS, ACCESSES)
    if missing := set(re.findall(r"node__\w+", waits)) - set(design.types):
        raise FormError(f"there is no {', '.join(sorted(missing))}")
    edges = Edges(design, program, len(logic), tree_of(design), HAS_CALM)
    lines = ["struct Rest {", *edges.members(), "};"]
    for number in range(len(edges.programs)):
        lines += edges.text(number)
    lines.append(f"static void rising_edge({ROOT}& vlSelfRef, Rest& rest) {{")
    lines += [*choice(edges, waits, accesses), "}"]
    return "\n".join(lines) + "\n"
