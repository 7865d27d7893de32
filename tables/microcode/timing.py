# SPDX-License-Identifier: Apache-2.0
"""The longest paths through the microcode of motion_engine, and the part that each line is of."""

import sys
from collections.abc import Iterable

from tables.microcode.assembler import Line, successors
from tables.microcode.numbers import PASSING

FINISH = 12  # cycles between two axes, the scan and the tick, at most

# What stays as it is while an axis is served, unless the program itself changes it.
STEADY = (*PASSING, "lost", "lost_off", "powerless", "off", "closed", "stepped", "unfiltered") + (
    "moving",
    "ready",
    "braking",
    "stopping",
    "powered",
    "final",
)


def tested_later(lines: list[Line], follow: list[list[int]]) -> list[frozenset[str]]:
    """For each line, the steady conditions of which a value known before it matters: those that it
    or a later line tests before they change.
    """
    tested: list[frozenset[str]] = [frozenset()] * (len(lines) + 1)
    settled = False
    while not settled:
        settled = True
        for n in reversed(range(len(lines))):
            line = lines[n]
            later = frozenset().union(*(tested[m] for m in follow[n])) - line.changes
            found = later | ({line.condition} & {*STEADY})
            if found != tested[n]:
                tested[n], settled = found, False
    return tested


def longest(lines: list[Line], begin: str, end: int, filters: int, ticking: bool) -> list[int]:
    """The longest path from a label to the line `end`, both included, as the numbers of its lines.
    A jump back is taken once, to the next filter `filters` times; a repeated line counts as often
    as it is executed; and a condition that nothing changed is met again as it was.
    """
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    follow = successors(lines)
    bits = {name: 1 << n for n, name in enumerate(STEADY)}

    def mask(names: Iterable[str]) -> int:
        return sum(bits[name] for name in names if name in bits)

    tested = [mask(names) for names in tested_later(lines, follow)]
    changed = [mask(line.changes) for line in lines]
    given = [(0, 0)] * len(lines)  # (which conditions are known after a line, which of them hold)
    for n, line in enumerate(lines):
        verb, _, flag = line.action.partition(" ")
        if line.action == "load_context":
            given[n] = mask(name for name in PASSING if name != "ticking"), 0
        elif flag in STEADY and verb in ("set", "clear"):
            given[n] = bits[flag], bits[flag] * (verb == "set")

    def repeated(n: int) -> int:
        if lines[n].condition != "loop":
            return 1
        counts = [line.action for line in lines[:n] if line.action.startswith("count")]
        return int(counts[-1].split(" ")[1])

    def passes_on(n: int) -> bool:
        """Whether the next line follows, in whatever state."""
        return n != end and follow[n] == [n + 1] and not changed[n] and given[n] == (0, 0)

    fork = [*range(len(lines))]  # the next line from here that does more
    for n in reversed(range(len(lines) - 1)):
        if passes_on(n):
            fork[n] = fork[n + 1]
    memory: dict[tuple[int, tuple[int, ...], int, int], tuple[int, ...]] = {}

    def walk(begin: int, taken: tuple[int, ...], known: int, true: int) -> tuple[int, ...]:
        """The lines from here to the end, none if it is not reached."""
        n = fork[begin]
        known &= tested[n]
        true &= known
        key = n, taken, known, true
        if key not in memory:
            memory[key] = (n,) if n == end else branch(n, taken, known, true)
        return (*range(begin, n), *memory[key]) if memory[key] else ()

    def branch(n: int, taken: tuple[int, ...], known: int, true: int) -> tuple[int, ...]:
        line, count = lines[n], repeated(n)
        more, hold = given[n]
        stays = known & ~changed[n] & ~more
        facts = stays | more, true & stays | hold
        best: tuple[int, ...] = ()
        for m in follow[n]:
            if m == n:
                continue
            jumps = bool(line.target) and m == labels[line.target]
            after, now = facts, taken
            if bit := bits.get(line.condition, 0):
                value = jumps != line.unless
                if known & bit and bool(true & bit) != value:
                    continue
                if not facts[0] & bit:
                    after = facts[0] | bit, facts[1] | bit * value
            if line.condition == "filters" and filters == 0 and not jumps:
                continue
            if m <= n:
                most = filters if lines[m].label == "section" else 1
                if taken.count(m) >= most:
                    continue
                now = tuple(sorted((*taken, m)))
            rest = walk(m, now, *after)
            if rest and len(rest) + count > len(best):
                best = (n,) * count + rest
        return best

    first = {"ticking": ticking, "unfiltered": filters == 0} | dict.fromkeys(PASSING[1:], False)
    true = mask(name for name, value in first.items() if value)
    return list(walk(labels[begin], (), mask(first), true))


def worst(lines: list[Line], filters: int) -> tuple[int, int]:
    """Cycles at most (between a tick and the first axis, for each axis)."""
    sys.setrecursionlimit(10_000)
    wrapped = [n for n, line in enumerate(lines) if line.condition == "wrapped"]
    scan = next(n for n, line in enumerate(lines) if line.text.endswith("; goto scan"))
    # a tick may find the engine at the beginning of a request; the scan goes on to the next axis
    request = len(longest(lines, "requests", scan, filters, ticking=False)) + FINISH
    return request, len(longest(lines, "axis", wrapped[-1], filters, ticking=True))


def reached(lines: list[Line], begin: int, ticking: bool, ends: set[int]) -> set[int]:
    """The lines that can be reached from one line, up to the lines that end it."""
    follow, found, left = successors(lines), set[int](), [begin]
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    while left:
        n = left.pop()
        if n in found:
            continue
        found.add(n)
        line = lines[n]
        after = follow[n]
        if line.condition == "ticking":
            jumps = ticking != line.unless
            after = [m for m in follow[n] if (m == labels[line.target]) == jumps]
        if n not in ends:
            left += after
    return found


REGIONS = ("idle", "shared", "serve", "leave", "enter")


def regions(lines: list[Line]) -> list[str]:
    """Where each line belongs: to the time between two ticks, to the service of an axis at a tick,
    to both, or to the steps from one axis to the next."""
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    last = max(n for n, line in enumerate(lines) if line.action == "next_axis")
    finished = next(n for n, line in enumerate(lines) if line.action == "finished")
    first = next(n for n, line in enumerate(lines) if line.action == "first_axis")
    leave, enter = set(range(last + 1, finished + 1)), set(range(labels["tick"] + 1, first + 1))
    serve = reached(lines, labels["axis"], True, {last})
    idle = reached(lines, 0, False, {labels["tick"]})
    found = []
    for n in range(len(lines)):
        if n in leave or n in enter:
            found.append("leave" if n in leave else "enter")
        elif n in serve:
            found.append("shared" if n in idle else "serve")
        else:
            found.append("idle")
    return found
