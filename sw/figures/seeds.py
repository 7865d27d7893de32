# SPDX-License-Identifier: Apache-2.0
"""Figure and campaign of the seeds: does every figure that draws random numbers hold for ten seeds?

Each measurement is one figure in full with one seed, in a process of its own. All of them take days
of a core: `make soak K=seeds` divides them among the workers of a cluster. The figure keeps what it
has measured in docs/seeds.toml; a figure is measured again if its bound changes or was missed.

python -m figures.seeds [NAME …]      measures these figures, or all that are due, and records them
python -m figures.seeds --summary     prints what the record has
"""

import argparse
import math
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from itertools import chain
from typing import Any

from campaigns import record
from campaigns.campaign import Campaign, Counts
from figures.common import Figure, Quick, bar, collected, console, seeds
from twin.build import ROOT

NAME = "seeds"
SEEDS = 10
AT_ONCE = 2
STARTS_WORKERS = ("soak_failures", "study_scaling", "seeds_failed")  # processes of their own
SHORT = ("acquire_nm_p95_64", "s1_k3_arcsec")


@cache
def seeded() -> tuple[str, ...]:
    """Names of the figures that take a seed."""
    found: dict[str, Figure] = collected("FIGURES")
    return tuple(sorted(n for n, one in found.items() if one.seeded and n not in STARTS_WORKERS))


def measured(name: str, seed: int, quick: bool) -> tuple[bool, str]:
    """Whether a figure is within its bound with this seed, and what was measured in words."""
    command = [sys.executable, "-m", "figures.figure", name, "--seed", str(seed), "--unrecorded"]
    done = subprocess.run(
        [*command, "--quick"] if quick else command,
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    last = (done.stdout.strip() or done.stderr.strip() or "no word was printed").splitlines()[-1]
    return done.returncode == 0, f"{last}, seed {seed}"


def measured_part(names: Sequence[str], count: int, part: int, part_seed: int) -> Counts:
    """The figure and the seed of a part: `count` seeds of the first figure, then of the next."""
    name, number = names[part // count], part % count
    good, words = measured(name, part_seed - part + number, False)
    counts: dict[str, float | str] = {"measured": 1, "missed": 0 if good else 1}
    if not good:
        counts[name] = words
    return counts


def campaign(names: Sequence[str], count: int) -> Campaign:
    return Campaign(
        f"measurements of each figure that draws random numbers, with {count} seeds; failed: those "
        "that miss the bound of the figure",
        partial(measured_part, names, count),
        parts=len(names) * count,
        tried="measured",
        failed="missed",
    )


# ------------------------------------------------------------------ the record


def entries() -> dict[str, dict[str, Any]]:
    """The entries of the record whose figures have the same bound still."""
    figures: dict[str, Figure] = collected("FIGURES")
    found = record.read(record.SEEDS)
    return {n: found[n] for n in seeded() if n in found and found[n]["bound"] == figures[n].bound}


def due(count: int = SEEDS) -> list[str]:
    """The figures that are to be measured: those of which the record has no entry, or fewer seeds
    than these, or a measurement that missed the bound.
    """
    known = entries()
    return [
        n for n in seeded() if n not in known or known[n]["seeds"] < count or known[n]["missed"]
    ]


def entry_of(name: str, found: Sequence[tuple[bool, str]]) -> record.Entry:
    """The entry of a figure: its value with each seed that gave one, and the misses in words."""
    figure: Figure = collected("FIGURES")[name]
    values = [re.match(rf"{name} (\S+) ", words) for _, words in found]
    return {
        "bound": figure.bound,
        "seeds": len(found),
        "values": [float(value[1]) for value in values if value],
        "missed": missed_in(found),
    }


def recorded(
    names: Sequence[str], count: int = SEEDS, at_once: int = AT_ONCE
) -> Iterator[tuple[str, list[str]]]:
    """(figure, its misses in words) of these figures, each measured in full with so many seeds and
    written into docs/seeds.toml as soon as it is complete, so that an interrupted run can go on.
    """
    for name in names:
        found = with_seeds(name, range(1, count + 1), False, at_once)
        record.add(name, entry_of(name, found), record.SEEDS)
        yield name, missed_in(found)


def missed_in(found: Iterable[tuple[bool, str]]) -> list[str]:
    """The words of the measurements that missed the bound or did not end."""
    return [words for good, words in found if not good]


def with_seeds(
    name: str, numbers: Iterable[int], quick: bool, at_once: int = AT_ONCE
) -> list[tuple[bool, str]]:
    """What `measured` says of a figure with each of these seeds, so many at once."""
    with ThreadPoolExecutor(at_once) as pool:  # each measurement is a process
        return list(pool.map(lambda seed: measured(name, seed, quick), numbers))


def summary() -> str:
    """What the record has, as a table."""
    known = entries()
    lines = [f"{'figure':30}  {'bound':>9}  seeds  {'from':>9}  {'to':>9}  missed"]
    for name, entry in known.items():
        values = entry["values"] or [math.nan]
        lines.append(
            f"{name:30}  {entry['bound']:>9}  {entry['seeds']:5}  {min(values):9.6g}  "
            f"{max(values):9.6g}  {len(entry['missed']):6}"
        )
    left = [name for name in seeded() if name not in known]
    return "\n".join([*lines, f"not measured: {', '.join(left) or 'none'}"])


def seeds_failed(names: Sequence[str] = (), count: int = SEEDS, seed: int = 1) -> int:
    """Figures of which a measurement missed its bound or did not end: those of the record, or of
    these names in their short forms.
    """
    if names:
        missed = {n: missed_in(with_seeds(n, seeds(seed, count), True)) for n in names}
    else:
        missed = {}
        with bar("figures") as progress:
            task = progress.add_task("", total=len(due(count)))
            for name, of_figure in recorded(due(count), count):
                missed[name] = of_figure
                progress.advance(task)
        console.print(summary(), markup=False, highlight=False)
    for words in chain(*missed.values()):
        console.print(words, markup=False, highlight=False)
    return sum(bool(words) for words in missed.values())


def __getattr__(name: str) -> dict[str, Campaign]:
    """CAMPAIGNS, made when it is asked for, since it depends on the other figures."""
    if name == "CAMPAIGNS":
        return {NAME: campaign(seeded(), SEEDS)}
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


FIGURES = {
    "seeds_failed": Figure(
        seeds_failed,
        "figures",
        "figures that draw random numbers and miss their bound, or do not end, with one of ten "
        "seeds, each measured in full; a figure that has held its bound with all of them is not "
        "measured again until the bound changes",
        "0",
        Quick(
            {"names": SHORT, "count": 2},
            f"the short forms of {' and '.join(SHORT)} with two seeds",
        ),
        0,
    ),
}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m figures.seeds")
    parser.add_argument("names", nargs="*", help="figures; default: all that are due")
    parser.add_argument("--summary", action="store_true", help="print the record, measure nothing")
    parser.add_argument("-j", type=int, default=AT_ONCE, metavar="JOBS", help="seeds at once")
    options = parser.parse_args(arguments)
    if unknown := set(options.names) - set(seeded()):
        parser.error(f"{sorted(unknown)[0]} draws no random numbers, or is no figure")
    if options.summary:
        print(summary())
        return 0
    wrong = 0
    for name, missed in recorded(options.names or due(), at_once=options.j):
        print(f"{name}: {len(missed)} missed", *missed, sep="\n  ", flush=True)
        wrong += len(missed)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
