# SPDX-License-Identifier: Apache-2.0
"""docs/wiring.toml: the instances of the block diagrams whose faults have been run. An instance
runs again if its connections change, and its survivors without a reason run again.

python -m mutation.wiring_record [FILE …]      runs the instances of these diagrams, or of all, that
                                               are due, and writes them into the record
python -m mutation.wiring_record --summary     prints what the record has
"""

import argparse
import hashlib
import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from campaigns import record
from mutation import wiring
from mutation.connections import RTL, diagrams, of_diagram
from mutation.mutants import Mutant


def name_of(place: wiring.Place) -> str:
    """The name of an instance in the record: as the names of its mutants begin."""
    file, instance = place
    return f"{file.relative_to(RTL)}: {instance}"


@cache
def instances() -> dict[wiring.Place, str]:
    """The instances of all diagrams, each with a hash of its connections."""
    found: dict[wiring.Place, list[tuple[str, ...]]] = defaultdict(list)
    for connection in (c for file in diagrams() for c in of_diagram(file)):
        found[wiring.place_of(connection)].append((*wiring.key(connection), connection.width))
    return {
        place: hashlib.sha256(json.dumps(connections).encode()).hexdigest()[:12]
        for place, connections in found.items()
    }


def known() -> dict[wiring.Place, dict[str, Any]]:
    """The entries of the record whose instances have these connections still."""
    entries = record.read(record.WIRING)
    return {
        place: entries[name_of(place)]
        for place, connections in instances().items()
        if entries.get(name_of(place), {}).get("connections") == connections
    }


def survivors() -> dict[wiring.Place, list[str]]:
    """The survivors of the record that have no reason by now, if there are any."""
    found = {
        place: [name for name in entry["survivors"] if not wiring.pattern_of(name)]
        for place, entry in known().items()
    }
    return {place: names for place, names in found.items() if names}


def due() -> set[wiring.Place]:
    """The instances to run: those that are not in the record, and those with survivors."""
    return set(instances()) - set(known()) | set(survivors())


def recorded(
    files: Iterable[Path],
    part: str = "",
    jobs: int = 2,
    report: wiring.Report = wiring.silent,
) -> Iterator[tuple[wiring.Place, wiring.Verdicts]]:
    """Run the instances of diagrams that are due and have this part in their names, and write each
    into docs/wiring.toml as soon as it is complete, so an interrupted run can go on. Of an instance
    that has run already only the survivors without a reason run again.
    """
    entries, unseen = known(), survivors()
    chosen = {place for place in due() if part in name_of(place)}
    files = [file for file in files if any(place[0] == file for place in chosen)]

    def runs(mutant: Mutant) -> bool:
        place = wiring.place_of(mutant.connection)
        return place not in unseen or mutant.name in unseen[place]

    running = wiring.of_instances(
        files, lambda c: wiring.place_of(c) in chosen, jobs=jobs, report=report, due=runs
    )
    for place, verdicts in running:
        found, explained = len(verdicts.killed), len(verdicts.explained)
        if place in unseen:
            before = entries[place]
            found += before["found"]
            explained += before["explained"] + len(before["survivors"]) - len(unseen[place])
        entry: record.Entry = {
            "connections": instances()[place],
            "found": found,
            "explained": explained,
            "survivors": [mutant.name for mutant in verdicts.survivors],
        }
        if not verdicts.stale:
            record.add(name_of(place), entry, record.WIRING)
        yield place, verdicts


def summary() -> str:
    """What the record has of each diagram, as a table."""
    entries, unseen = known(), survivors()
    lines = [f"{'diagram':20}  instances  not run  found  explained  survivors"]
    for file in diagrams():
        places = [place for place in instances() if place[0] == file]
        ran = [entries[place] for place in places if place in entries]
        left = sum(len(unseen.get(place, ())) for place in places)
        explained = sum(entry["explained"] + len(entry["survivors"]) for entry in ran) - left
        lines.append(
            f"{file.stem:20}  {len(places):9}  {len(places) - len(ran):7}  "
            f"{sum(entry['found'] for entry in ran):5}  {explained:9}  {left:9}"
        )
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m mutation.wiring_record")
    parser.add_argument("files", nargs="*", help="diagrams below rtl/; default: all")
    parser.add_argument("--summary", action="store_true", help="print the record, run nothing")
    parser.add_argument("-j", type=int, default=2, metavar="JOBS")
    parser.add_argument("-k", default="", metavar="PART", help="instances with this in the name")
    options = parser.parse_args(arguments)
    if not options.summary:
        verdicts = wiring.Verdicts()
        files = wiring.files_of(parser, options.files)
        for _, of_instance in recorded(files, options.k, options.j, wiring.told):
            verdicts.add(of_instance)
        print(*verdicts.stale, verdicts.words, sep="\n")
        return int(verdicts.failures > 0)
    print(summary())
    return 0


if __name__ == "__main__":
    sys.exit(main())
