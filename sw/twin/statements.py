# SPDX-License-Identifier: Apache-2.0
"""Statements of the C++ that `verilator --no-decoration` makes, one a line, with braces at the ends
of lines: what each needs and changes, and where it can be moved to. For twin/rising_edge.py.
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

VALUE = r"(?:CData|SData|IData|QData|VlWide<\d+>)(?:/\*[\d:]+\*/)?"
DECLARATION = re.compile(rf"({VALUE}) (\w+);")
ASSIGNMENT = re.compile(r"(?:vlSelfRef\.)?([A-Za-z_]\w*)((?:\[.*?\])*?) = (.*);")
ZERO = re.compile(r"VL_ZERO_W\(\d+, (?:vlSelfRef\.)?(\w+)\);")
NAME = re.compile(
    r"\b(?!(?:vlSelfRef|[CSIQ]Data|if|else|for|while|do)\b|VL_)([A-Za-z_]\w*)",
)
NEVER = "0U"  # a condition that never holds
OFTEN = 12  # times that an expression reads its only signal, from which on 0 is a case of its own

Names = frozenset[str]
NONE: Names = frozenset()


class FormError(Exception):
    """Verilator's code has another form than this module expects."""


@dataclass(frozen=True)
class Effect:
    """What a statement does to signals. `needs`: it uses the value from before; `sets`: it assigns
    them in any case; `changes`: it may assign them.
    """

    needs: Names = NONE
    sets: Names = NONE
    changes: Names = NONE


def effect_of(statements: Iterable["Statement"]) -> Effect:
    """The effect of statements, one after the other."""
    needs: set[str] = set()
    sets: set[str] = set()
    changes: set[str] = set()
    for statement in statements:
        needs |= statement.effect.needs - sets
        sets |= statement.effect.sets
        changes |= statement.effect.changes
    return Effect(frozenset(needs), frozenset(sets), frozenset(changes))


@dataclass(frozen=True, eq=False)
class Plain:
    """Statements of which nothing is known but their effect."""

    text: tuple[str, ...]
    effect: Effect

    def lines(self) -> Iterator[str]:
        """The text of it."""
        yield from self.text


@dataclass(frozen=True, eq=False)
class Group:
    """Statements that stay together."""

    statements: tuple["Statement", ...]

    @cached_property
    def effect(self) -> Effect:
        """Of all."""
        return effect_of(self.statements)

    def lines(self) -> Iterator[str]:
        """The text of it."""
        for statement in self.statements:
            yield from statement.lines()


@dataclass(frozen=True, eq=False)
class Choice:
    """if (condition) {yes} else {no}"""

    condition: str
    asks: Names
    yes: tuple["Statement", ...]
    no: tuple["Statement", ...]

    @cached_property
    def branches(self) -> tuple[Effect, Effect]:
        """The effects of both."""
        return effect_of(self.yes), effect_of(self.no)

    @cached_property
    def effect(self) -> Effect:
        """What only one branch assigns keeps its value in the other."""
        yes, no = self.branches
        sets, changes = yes.sets & no.sets, yes.changes | no.changes
        return Effect(self.asks | yes.needs | no.needs | (changes - sets), sets, changes)

    def lines(self) -> Iterator[str]:
        """The text of it."""
        yield f"if ({self.condition}) {{"
        for statement in self.yes:
            yield from statement.lines()
        if self.no:
            yield "} else {"
            for statement in self.no:
                yield from statement.lines()
        yield "}"


Statement = Plain | Group | Choice


@dataclass
class Parser:
    """Statements of lines. words: {array of words that are only used one by one: how many}, whose
    words are signals of their own, named as `signal[0]`.
    """

    lines: Sequence[str]
    words: Mapping[str, int]
    at: int = 0

    def names(self, text: str) -> Names:
        """The signals in an expression."""
        found = set()
        for match in NAME.finditer(text):
            name = match.group(1)
            count = self.words.get(name)
            if count is None:
                found.add(name)
            elif index := re.match(r"\[(\d+)U\]", text[match.end() :]):
                found.add(f"{name}[{index.group(1)}]")
            else:
                found |= {f"{name}[{n}]" for n in range(count)}
        return frozenset(found)

    def block(self) -> tuple[Statement, ...]:
        """The statements to the end, or to the brace that closes the block."""
        found = []
        while self.at < len(self.lines) and not self.lines[self.at].startswith("}"):
            found.append(self.statement())
        return tuple(found)

    def statement(self) -> Statement:
        """The next one."""
        line = self.lines[self.at]
        if line.startswith("if (") and line.endswith(") {"):
            return self.choice(line[4:-3])
        if line.endswith("{"):
            return self.unknown()
        self.at += 1
        if match := ZERO.fullmatch(line):
            return Plain((line,), Effect(NONE, *[self.names(match.group(1))] * 2))
        match = ASSIGNMENT.fullmatch(line)
        if not match and line.startswith("VL_"):
            names = self.names(line)
            return Plain((line,), Effect(names, NONE, names))
        if not match:
            raise FormError(f"it has {line!r}")
        name, index, value = match.groups()
        needs = self.names(value)
        if not index or (name in self.words and re.fullmatch(r"\[\d+U\]", index)):
            target = self.names(name + index)
            return of_zero(Plain((line,), Effect(needs, target, target)))
        target = self.names(name)
        return Plain((line,), Effect(needs | self.names(index) | target, NONE, target))

    def choice(self, condition: str) -> Statement:
        """An if, whose line is the next."""
        self.at += 1
        yes = self.block()
        no: tuple[Statement, ...] = ()
        line = self.end()
        if line.startswith("} else if (") and line.endswith(") {"):
            no = (self.choice(line[11:-3]),)
            return self.chosen(condition, yes, no)
        self.at += 1
        if line == "} else {":
            no = self.block()
            line = self.end()
            self.at += 1
        if line != "}":
            raise FormError(f"a block ends with {line!r}")
        return self.chosen(condition, yes, no)

    def chosen(
        self, condition: str, yes: tuple[Statement, ...], no: tuple[Statement, ...]
    ) -> Statement:
        """A choice, without what is only for reset."""
        if condition == NEVER:
            return Group(no)
        return Choice(condition, self.names(condition), yes, no)

    def end(self) -> str:
        """The line that ends a block."""
        if self.at == len(self.lines):
            raise FormError("a block does not end")
        return self.lines[self.at]

    def unknown(self) -> Plain:
        """A loop or the like: it may read and change whatever it names."""
        begin, depth = self.at, 0
        while self.at == begin or depth:
            depth += self.lines[self.at].count("{") - self.lines[self.at].count("}")
            self.at += 1
        text = tuple(self.lines[begin : self.at])
        names = self.names("\n".join(text))
        return Plain(text, Effect(names, NONE, names))


def of_zero(assignment: Plain) -> Statement:
    """An assignment of one line; or a choice, if it reads one signal and nothing else, but that
    often, as the encoder of a priority does. The compiler makes a constant of the branch in which
    the signal is 0.
    """
    (line,) = assignment.text
    reads = re.findall(r"\(IData\)\(((?:vlSelfRef\.)?\w+)\)", line)
    if len(reads) < OFTEN or len(set(reads)) > 1 or len(NAME.findall(line)) != 1 + len(reads):
        return assignment
    effect = assignment.effect
    zero = line.replace(f"(IData)({reads[0]})", "(IData)(0U)")
    constant = Plain((zero,), Effect(NONE, effect.sets, effect.changes))
    return Choice(f"0U != {reads[0]}", effect.needs, (assignment,), (constant,))


def array(name: str) -> str:
    """The name of a signal without the number of a word."""
    return name.partition("[")[0]


@dataclass
class Sinker:
    """Moves statements to where their results are needed. passing: the names of all signals that
    only the statements of this list use.
    """

    passing: Names
    block: list[Statement | None] = field(default_factory=list)
    users: dict[str, set[int]] = field(default_factory=lambda: defaultdict(set))
    writers: dict[str, set[int]] = field(default_factory=lambda: defaultdict(set))

    def sunk(self, statements: Iterable[Statement]) -> tuple[Statement, ...]:
        """The statements in their new places."""
        self.block = list(statements)
        for n in reversed(range(len(self.block))):
            self.place(n)
        return tuple(s for s in self.block if s)

    def note(self, n: int, statement: Statement) -> None:
        """Enter what a statement uses and changes."""
        for name in statement.effect.needs:
            self.users[name].add(n)
        for name in statement.effect.changes:
            self.writers[name].add(n)

    def forget(self, n: int, statement: Statement) -> None:
        """Undo note()."""
        for name in statement.effect.needs:
            self.users[name].discard(n)
        for name in statement.effect.changes:
            self.writers[name].discard(n)

    def place(self, n: int) -> None:
        """Move one statement; those behind it are in their places."""
        statement = self.block[n]
        assert statement
        effect = statement.effect
        users = {u for name in effect.changes for u in self.users[name]}
        writers = {w for name in effect.changes for w in self.writers[name]}
        if not all(array(name) in self.passing for name in effect.changes):
            self.note(n, statement)
            return
        first = min(users | writers, default=n)
        if not users or (first not in users and len(effect.changes) == 1):
            self.block[n] = None  # it is not used, or computed again before any use
            return
        others = [self.block[u] for u in users]
        if writers and users | writers != {first}:
            self.join(n, first)
        elif not self.between(effect.needs, n, max(users)) and all(
            isinstance(other, Choice) and not other.asks & effect.changes for other in others
        ):
            for u in users:
                self.sink(statement, u)
            self.block[n] = None
        else:
            self.note(n, statement)

    def join(self, n: int, m: int) -> None:
        """Make one group of a value and its exception, which is m, and move that."""
        value, exception = self.block[n], self.block[m]
        assert value and exception
        changes = exception.effect.changes
        if (
            value.effect.changes & exception.effect.needs & changes
            and all(array(name) in self.passing for name in changes)
            and not self.between(value.effect.needs, n, m)
        ):
            self.forget(m, exception)
            self.block[m], self.block[n] = Group((value, exception)), None
            self.place(m)
        else:
            self.note(n, value)

    def sink(self, statement: Statement, n: int) -> None:
        """Put a statement into those branches of a choice that need it."""
        choice, changes = self.block[n], statement.effect.changes
        assert isinstance(choice, Choice)
        self.forget(n, choice)
        results = frozenset(array(name) for name in changes)
        yes, no = (
            Sinker(results).sunk((statement, *branch)) if effect.needs & changes else branch
            for branch, effect in zip((choice.yes, choice.no), choice.branches)
        )
        sunk = Choice(choice.condition, choice.asks, yes, no)
        self.block[n] = sunk
        self.note(n, sunk)

    def between(self, names: Names, begin: int, end: int) -> bool:
        """Whether a statement between two changes one of these signals."""
        return any(begin < w < end for name in names for w in self.writers[name])
