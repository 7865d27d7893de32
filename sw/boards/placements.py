# SPDX-License-Identifier: Apache-2.0
"""The record of the builds of the boards, docs/placements.toml: what each machine on each board
that it fits takes of the part, and how fast it is with each placement seed.

    make boards                          all of them, at three placement seeds
    make boards K=icebreaker SEEDS=10    those with this in their names, at ten
    make boards MINUTES=90               begins no placement after this time

A placement takes minutes, all of them many hours. Each result is in the record as soon
as it is there, and is measured again, here or elsewhere, only if nextpnr would see another circuit,
other pins or options: so the hours may be divided among sittings and computers. The figures
`boards_failed` and `board_small_mhz` read the record and measure what it lacks; docs/boards.md has
it as a table.
"""

import argparse
import hashlib
import sys
import threading
import time
import tomllib
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from datetime import date
from functools import cache
from itertools import takewhile
from pathlib import Path

from boards import build
from boards.fit import Design
from boards.packing import PLACED, pack
from boards.toml_file import ROOT, Misfit, shown
from campaigns.campaign import seeds
from figures.synthesis import PLACEMENTS, NotEndedError, SynthesisError

RECORD = ROOT / "docs" / "placements.toml"
HEAD = """\
# SPDX-License-Identifier: Apache-2.0
# What each machine on each board takes of its part, and how fast it is with each placement seed.
# Written by `make boards` and by the figures of the boards alone; the tables of docs/boards.md are
# made from it by `make tables`.
#   sources    hash of what the netlist was made from when it was compared last
#   netlist    hash of the circuit and of what else nextpnr sees; another one is placed again
#   used       of the part, with the first of the seeds
#   placement  SHA-256 of the file `placed`, from which the bitstream is packed
"""
DIGITS = 16  # of a hash

Say = Callable[[str], None]
lock = threading.Lock()  # of the record


@dataclass(frozen=True)
class Placement:
    """A design with one seed: placed, or refused by a tool."""

    date: date
    mhz: float = 0.0
    placement: str = ""
    failed: str = ""  # what the tool said

    @property
    def row(self) -> str:
        if self.failed:
            return f"{{ date = {self.date.isoformat()}, failed = '{self.failed}' }}"
        return (
            f"{{ date = {self.date.isoformat()}, mhz = {self.mhz:.1f}, "
            f'placement = "{self.placement}" }}'
        )


@dataclass(frozen=True)
class Build:
    """What is known of a design; the seeds are empty for a part that no open tool places."""

    sources: str = ""
    netlist: str = ""
    used: str = ""
    seeds: dict[int, Placement] = field(default_factory=dict)

    def rows(self, name: str) -> list[str]:
        head = [f"[{name}]", f'sources = "{self.sources}"', f'netlist = "{self.netlist}"']
        placed = [f"seed.{seed} = {self.seeds[seed].row}" for seed in sorted(self.seeds)]
        return [*head, f'used = "{self.used}"', *placed, ""]


def read() -> dict[str, Build]:
    """The record: {name of a design: what is known of it}."""
    if not RECORD.exists():
        return {}
    found = {}
    for name, entry in tomllib.loads(RECORD.read_text(encoding="utf-8")).items():
        placed = {int(seed): Placement(**row) for seed, row in entry.pop("seed", {}).items()}
        found[name] = Build(**entry, seeds=placed)
    return found


def add(name: str, one: Build) -> None:
    """Writes what is known of a design."""
    with lock:
        known = {**read(), name: one}
        rows = [row for each in sorted(known) for row in known[each].rows(each)]
        RECORD.write_text("\n".join([HEAD, *rows]), encoding="utf-8")


def synthesised(design: Design) -> tuple[Path, Path]:
    """(folder, netlist) of a design."""
    folder = build.write(design)
    build.make_firmware(design, folder)
    return folder, build.synthesise(design, folder)


def placed(design: Design, folder: Path, netlist: Path, seed: int) -> tuple[Placement, str]:
    """A placement with its bitstream, and what it takes of the part; NotEndedError if the tool took
    too long, which is no result.
    """
    try:
        mhz, utilization = build.place(design, folder, netlist, seed)
        pack(design, folder).unlink()  # it is proved; `make board` makes the one that is loaded
    except NotEndedError:
        raise
    except SynthesisError as why:
        return Placement(date.today(), failed=str(why).replace("'", "`")), ""
    content = (folder / PLACED).read_bytes()
    digest = hashlib.sha256(content).hexdigest()[:DIGITS]
    return Placement(date.today(), mhz, digest), build.used(design, utilization)


def measured(design: Design, wanted: Iterable[int], say: Say = lambda _: None) -> Build:
    """What is known of a design after the wanted seeds are placed. It is synthesised only if its
    sources have changed or a seed is missing, and placed only if the circuit is another one.
    """
    build.check_tools(design)
    netlist = cache(lambda: synthesised(design))
    known, sources = read().get(design.name, Build()), build.state(design)[:DIGITS]
    if known.sources != sources:
        say(f"{design.name}: synthesis")
        seen = build.netlist_state(design, netlist()[1])[:DIGITS]
        known = replace(known if known.netlist == seen else Build(netlist=seen), sources=sources)
        if design.board.part.family.placer is None:
            known = replace(known, used=build.cells(netlist()[1]))
        add(design.name, known)
    if design.board.part.family.placer is None:
        return known
    for seed in wanted:
        if seed not in known.seeds:
            say(f"{design.name}: place and route with seed {seed}")
            found, used = placed(design, *netlist(), seed)
            say(f"{design.name}, seed {seed}: {found.failed or f'{found.mhz:.1f} MHz'}")
            known = replace(known, used=known.used or used, seeds={**known.seeds, seed: found})
            add(design.name, known)
    return known


def worst_mhz(known: Build, wanted: Iterable[int]) -> float:
    """The slowest of these placements; a SynthesisError says which failed."""
    if missing := [seed for seed in wanted if seed not in known.seeds]:
        raise SynthesisError(f"not placed yet with seed {', '.join(map(str, missing))}")
    chosen = [known.seeds[seed] for seed in wanted]
    for one in chosen:
        if one.failed:
            raise SynthesisError(one.failed)
    return min(one.mhz for one in chosen)


def too_slow(design: Design, known: Build, wanted: Iterable[int]) -> str:
    """Why a design has no bitstream or misses its clock at one of these seeds; empty if it is good.
    A part that no open tool places has a netlist.
    """
    if design.board.part.family.placer is None:
        return ""
    needed = design.board.node_hz / 1e6
    try:
        reached = worst_mhz(known, wanted)
    except SynthesisError as why:
        return str(why)
    return f"{reached:.1f} MHz, {needed:g} are needed" if reached < needed else ""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("names", nargs="*", help="parts of the names of builds; all without")
    parser.add_argument("--seeds", type=int, default=PLACEMENTS, help="placement seeds, from 1 on")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin none after them")
    parser.add_argument("--jobs", type=int, default=1, help="designs at once")
    options = parser.parse_args()
    words: list[str] = options.names
    designs = [
        design
        for design in build.fitting()[0]
        if not words or any(word in design.name for word in words)
    ]
    if not designs:
        sys.exit(f"boards: no build has {' or '.join(words)} in its name")
    wanted, begin = seeds(1, options.seeds), time.monotonic()
    minutes: Callable[[], float] = lambda: (time.monotonic() - begin) / 60
    say: Say = lambda text: print(f"{minutes():6.1f} min  {text}", flush=True)

    def one(design: Design) -> str:
        """Why a design is not good."""
        if minutes() >= options.minutes:
            return "not begun in time"
        in_time = takewhile(lambda _: minutes() < options.minutes, wanted)
        try:
            return too_slow(design, measured(design, in_time, say), wanted)
        except (Misfit, SynthesisError) as why:
            return str(why)

    with ThreadPoolExecutor(options.jobs) as pool:
        verdicts = dict(zip([design.name for design in designs], pool.map(one, designs)))
    bad = {name: why for name, why in verdicts.items() if why}
    print("\n".join(f"{name}: {why}" for name, why in bad.items()))
    print(f"{len(designs) - len(bad)} of {len(designs)} builds are good; {shown(RECORD)} has all")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
