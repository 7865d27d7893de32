# SPDX-License-Identifier: Apache-2.0
"""Make the picture of the job's states in docs/job.md from the table of transitions in
sw/firmware/station/job/job.c, and check the rules that the table must keep.
"""

import re
import sys

from tables import bus, made_files
from tables.made_files import ROOT

SOURCE = ROOT / "sw" / "firmware" / "station" / "job" / "job.c"
PAGE = ROOT / "docs" / "job.md"
BEGIN, END = "<!-- made by tables/job_states.py -->", "<!-- end of job_states -->"
UNDER_WAY = "UNDER_WAY"  # in the table: from any state in which a job is under way
FIRST = "LOADING"
TABLE = bus.read()
ACTIONS = {name.upper() for name in TABLE["job_action"]}


def transitions(text: str) -> list[tuple[str, ...]]:
    """The rows (from, event, to) of the table in the text of job.c, in their order. Raises
    ValueError if there is no table, or a row has another form.
    """
    table = re.search(r"transitions\[\] = \{\n(.*?)\n\};", text, re.DOTALL)
    if not table:
        raise ValueError("job.c has no table of transitions")
    found = []
    for line in table[1].splitlines():
        row = re.fullmatch(r"\s*\{(\w+),\s*(\w+),\s*(\w+),\s*\w+\},", line)
        if not row:
            raise ValueError(f"job.c: '{line.strip()}' is no transition")
        found.append(row.groups())
    return found


def check(rows: list[tuple[str, ...]], states: set[str]) -> None:
    """Raise ValueError unless the states are those of bus.toml, each can be reached and left, its
    rows are neighbours, and a state that waits for a person is left by actions of a person only.
    """
    used = {row[0] for row in rows if row[0] != UNDER_WAY} | {row[2] for row in rows}
    if used != states:
        raise ValueError(
            f"job.c and the job_state of bus.toml differ: {', '.join(sorted(used ^ states))}"
        )
    reached = {FIRST}
    while more := {to for start, _, to in rows if start in reached | {UNDER_WAY}} - reached:
        reached |= more
    if states - reached:
        raise ValueError(f"job.c: {', '.join(sorted(states - reached))} cannot be reached")
    in_order = [start for n, (start, _, _) in enumerate(rows) if n == 0 or rows[n - 1][0] != start]
    if len(set(in_order)) != len(in_order):
        raise ValueError("job.c: the transitions of a state do not follow each other")
    for state in states:
        events = {event for start, event, _ in rows if start == state}
        if not events:
            raise ValueError(f"job.c: {state} has no way out")
        if state in ("PAUSED", "UNSURE", "IDLE", "FINISHED") and not events <= ACTIONS:
            raise ValueError(f"job.c: {state} ends without a person")


def picture(rows: list[tuple[str, ...]]) -> list[str]:
    """The lines of a Mermaid diagram, with the actions of a person in capitals."""
    out = ["```mermaid", "stateDiagram-v2", "    direction TB", f"    [*] --> {FIRST.lower()}"]
    joined: dict[tuple[str, str], list[str]] = {}
    for start, event, to in rows:
        if start != UNDER_WAY:
            joined.setdefault((start, to), []).append(event)
    for (start, to), events in joined.items():
        out.append(
            f"    {start.lower()} --> {to.lower()} : {', '.join(label(event) for event in events)}"
        )
    return [*out, "```"]


def label(event: str) -> str:
    """An event as the picture shows it."""
    return event if event in ACTIONS else event.lower().replace("_", " ")


def from_anywhere(rows: list[tuple[str, ...]]) -> list[str]:
    """A sentence for each row that holds in every state in which a job is under way."""
    return [
        f"From every state in which a job is under way {event} leads to {to.lower()}."
        for start, event, to in rows
        if start == UNDER_WAY
    ]


def made() -> str:
    """The text of docs/job.md with a new picture. Raises ValueError if it has no place for one."""
    rows = transitions(SOURCE.read_text(encoding="utf-8"))
    check(rows, {name.upper() for name in TABLE["job_state"]})
    text = PAGE.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise ValueError(f"docs/job.md needs the lines '{BEGIN}' and '{END}' exactly once")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    return (
        before + "\n".join([BEGIN, "", *picture(rows), "", *from_anywhere(rows), "", END]) + after
    )


def main(arguments: list[str] | None = None) -> int:
    """Write docs/job.md, or with --check compare it; returns the exit code."""
    return made_files.main(__doc__, lambda: {PAGE: made()}, arguments)


if __name__ == "__main__":
    sys.exit(main())
