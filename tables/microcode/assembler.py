# SPDX-License-Identifier: Apache-2.0
"""From the program of motion_engine (program.txt) to the codes of its lines.

A line is  [LABEL:] [TERMS] [>> 8] [-> WORD] [; EFFECT or JOB, …]. TERMS are `acc`, the sum of the
line before, and one operand with + or -, or with `along` (+ if upward, else -) or `against` (the
opposite); without terms the line passes acc on. The sum goes to acc, divided by 256 with >> 8, and
undivided to a word. Effects and jobs are those of numbers.py.

The engine works on three lines at once: it fetches one while it reads the operand of the line
before and adds up the line before that. So what a line changes is known DISTANCE lines later, and
one line sooner to a condition, which is tested one cycle after its line is fetched. Where the
program needs it sooner, the assembler inserts lines that only pass acc on.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tables.microcode.numbers import (
    ACTIONS,
    BANK,
    CONDITIONS,
    EFFECTS,
    FILTER,
    FLAGS,
    NOWHERE,
    OPERANDS,
    OUTSIDE,
    PASSING,
    RAMP,
    STATE,
    STOP,
    WORDS,
)

PROGRAM = Path(__file__).with_name("program.txt")
DISTANCE = 3  # lines from a change to the first line that can read it
TEST_DISTANCE = 2  # from a change to the first line whose condition depends on it
SEEN_DISTANCE = 1  # more, from a change of the axis to what is seen of it
LINES = 1024


@dataclass
class Line:
    """A line of the program, and what of the engine it changes, reads and tests."""

    text: str
    label: str = ""
    acc: bool = True
    sign: int = 0
    operand: str = "0"
    effect: str = "none"
    word: str = ""
    condition: str = "never"
    unless: bool = False
    target: str = ""
    action: str = ""
    changes: set[str] = field(default_factory=set)
    reads: set[str] = field(default_factory=set)
    tests: set[str] = field(default_factory=set)

    def loads(self) -> bool:
        return self.effect[0] in "xy" or self.effect == "divide"


def parsed(text: str) -> Line:
    """The line of this text. A ValueError says what is wrong with it."""
    found = re.fullmatch(
        r"(?:(\w+):)?\s*(?:(acc)\b ?)?(?:(\+|-|along|against)? ?(\w+))?(?: >> (8))?"
        r"(?: -> (\w+))?(?: ?; (.*))?",
        text,
    )
    if not found:
        raise ValueError(f"engine_microcode: not a line: {text}")
    label, acc, sign, operand, divided, word, jobs = found.groups()
    line = Line(text, label or "", acc=bool(acc) or operand is None)
    if operand:
        line.operand = operand.replace("earlier_", "")
    line.sign = int(sign in ("-", "against"))
    effects = [f"shift_{divided}"] * bool(divided) + ["along"] * (sign in ("along", "against"))
    line.word = word or ""
    for job in (jobs or "").split(", ") if jobs else ():
        if job in EFFECTS:
            effects.append(job)
        elif found := re.fullmatch(r"(if|unless) (\w+) (\w+)", job):
            line.unless, line.condition, line.target = found[1] == "unless", found[2], found[3]
        elif found := re.fullmatch(r"goto (\w+)", job):
            line.unless, line.condition, line.target = True, "never", found[1]
        elif job in ACTIONS:
            line.action = job
        else:
            raise ValueError(f"engine_microcode: {job} in {text}")
    if len(effects) > 1 or (line.action and line.target):
        raise ValueError(f"engine_microcode: too much in one line: {text}")
    line.effect = effects[0] if effects else "none"
    if line.operand not in OPERANDS or (line.word and line.word not in WORDS):
        raise ValueError(f"engine_microcode: no such word: {text}")
    dependences(line)
    return line


QUEUE = {"empty", "full"}


def dependences(line: Line) -> None:
    """Fill in what a line changes at its end, reads when it is fetched, and tests."""
    word, operand = line.word, line.operand
    if word:
        line.changes.add(word)
        for n, name in enumerate(BANK):
            if word in (RAMP[n], STOP[n]):
                line.changes.add(name)
            if word == name:
                line.changes |= {RAMP[n], STOP[n]}
    line.reads.add(operand)
    if operand not in OUTSIDE:
        line.reads.add("axis")
    if operand in BANK:
        line.reads.add("halting")
    if operand.startswith("head_"):
        line.reads.add("queue")
    if operand in FILTER:
        line.reads.add("filters")
    if operand == "flags":
        line.reads |= {*FLAGS, "queue"}
    if operand in ("position", "elapsed"):
        line.reads.add("seen")
    condition = line.condition
    line.tests.add("queue" if condition in QUEUE else condition)
    if condition.endswith("_seen") or CONDITIONS[condition] >= CONDITIONS["stepped"]:
        line.tests.add("seen")
    if condition == "asked":
        line.tests.add("seen")
    if condition == "wrapped":
        line.tests.add("axis")
    action = line.action
    if line.effect in ("test", "upward"):
        line.changes.add("negative" if line.effect == "test" else "upward")
    if action.split(" ")[0] in ("set", "clear"):
        line.changes.add(action.split(" ")[1])
    if action == "load_context":
        line.changes |= {*FLAGS, *PASSING, "queue"} - {"ticking"}
    if action == "stand":
        line.changes |= {*FLAGS}
    if action in ("first_axis", "next_axis"):
        line.changes |= {"axis", "seen"}
    if action in ("pop", "push", "empty"):
        line.changes.add("queue")
    if action == "sample" or action.startswith("done"):
        line.changes.add("seen")
    if action.startswith("count"):
        line.changes.add("loop")
    if action in ("first_filter", "next_filter"):
        line.changes.add("filters")
    if action == "finished":
        line.changes |= {"due", "ticking"}


def source() -> list[Line]:
    """The lines of the program as written, after those that clear the words of an axis."""
    cleared = [*RAMP, *STOP, *STATE]
    texts = [f"{'boot: ' if not n else ''}0 -> {name}" for n, name in enumerate(cleared)]
    for text in PROGRAM.read_text().splitlines():
        text = " ".join(text.split("#")[0].split())
        if text:
            texts.append(text)
    lines = [parsed(text) for text in texts]
    labels = {line.label for line in lines}
    for line in lines:
        if line.target and line.target not in labels:
            raise ValueError(f"engine_microcode: no label {line.target}")
    return lines


def successors(lines: list[Line]) -> list[list[int]]:
    """The lines that may follow each line."""
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    found = []
    for n, line in enumerate(lines):
        follow = [] if line.target and line.condition == "never" and line.unless else [n + 1]
        found.append(follow + ([labels[line.target]] if line.target else []))
    return found


def distance_of(line: Line, later: Line) -> int:
    """How many lines after a line a later one may come at the earliest, if that depends on it."""
    read, tested = line.changes & later.reads, line.changes & later.tests
    needed = [DISTANCE + SEEN_DISTANCE * ("seen" in read)] * bool(read)
    needed += [TEST_DISTANCE + SEEN_DISTANCE * ("seen" in tested)] * bool(tested)
    if "product" in later.operand and "earlier_" not in later.text and line.loads():
        needed.append(DISTANCE)
    if later.effect == "along" and "upward" in line.changes:
        needed.append(2)
    return max(needed, default=0)


def missing(lines: list[Line]) -> tuple[int, int] | None:
    """(number of a line, lines that are missing before it), of the first that comes too soon."""
    before: list[list[int]] = [[] for _ in lines]
    for n, follow in enumerate(successors(lines)):
        for m in follow:
            if m < len(lines):
                before[m].append(n)
    for n, line in enumerate(lines):
        reached = {n}
        for distance in range(1, DISTANCE + SEEN_DISTANCE):
            reached = {b for r in reached for b in before[r]}
            needed = max((distance_of(lines[b], line) for b in reached), default=0)
            if needed > distance:
                return n, needed - distance
    return None


def assembled() -> list[Line]:
    """All lines, with those that only wait."""
    lines = source()
    while wait := missing(lines):
        n, count = wait
        if lines[n].operand == "halve" or "earlier_" in lines[n].text:
            raise ValueError(f"engine_microcode: no line may come before {lines[n].text}")
        fillers = [parsed("acc") for _ in range(count)]
        if lines[n].label:
            fillers[0].label, lines[n].label = lines[n].label, ""
        lines[n:n] = fillers
    return lines


def code_of(line: Line, labels: Mapping[str, int]) -> int:
    """The code of a line: target or action 10 bits, unless 1, condition 6, word 6, operand 7, acc
    1, sign 1, effect 4."""
    code = labels[line.target] if line.target else ACTIONS[line.action] if line.action else 0
    for value, width in (
        (line.unless, 1),
        (CONDITIONS[line.condition], 6),
        (WORDS[line.word] if line.word else NOWHERE, 6),
        (OPERANDS[line.operand], 7),
        (line.acc, 1),
        (line.sign, 1),
        (EFFECTS.index(line.effect), 4),
    ):
        code = code << width | int(value)
    return code


def codes() -> list[tuple[str, int]]:
    """(text, code) of each line."""
    lines = assembled()
    if len(lines) > LINES:
        raise ValueError(f"engine_microcode: {len(lines)} lines, {LINES} fit")
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    shown = [line.text.split(": ", 1)[-1] if ":" in line.text else line.text for line in lines]
    return [
        (f"{line.label}: {text}" if line.label else text, code_of(line, labels))
        for line, text in zip(lines, shown)
    ]
