# SPDX-License-Identifier: Apache-2.0
"""Figure and campaign of the seeds: does every figure that draws random numbers hold for ten seeds?

Each part of the campaign measures one figure in full with one seed, in a process of its own. All of
them take days of a core; `make soak K=seeds` divides them among the workers of a cluster, and what
it has measured of this version is not measured again by the figure.
"""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import cache, partial

from campaigns import runner
from campaigns.campaign import Campaign, Counts, Result
from campaigns.runner import Failure, Job
from campaigns.soak import RESULTS, bad_words, failure_words
from campaigns.store import Store
from figures.common import Figure, Quick, collected, console
from twin.build import ROOT

NAME = "seeds"
SEEDS = 10
WORKERS = 2
STARTS_WORKERS = ("soak_failures", "study_scaling", "seeds_failed")  # of Dask, by themselves
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


def measured_part(
    names: Sequence[str], count: int, quick: bool, part: int, part_seed: int
) -> Counts:
    """The figure and the seed of a part: `count` seeds of the first figure, then of the next."""
    name, number = names[part // count], part % count
    good, words = measured(name, part_seed - part + number, quick)
    counts: dict[str, float | str] = {"measured": 1, "missed": 0 if good else 1}
    if not good:
        counts[name] = words
    return counts


def campaign(names: Sequence[str], count: int, quick: bool) -> Campaign:
    return Campaign(
        f"measurements of each figure that draws random numbers, with {count} seeds; failed: those "
        "that miss the bound of the figure",
        partial(measured_part, names, count, quick),
        parts=len(names) * count,
        tried="measured",
        failed="missed",
    )


class Reported(runner.Watch):
    """Reports each measurement that misses its bound, and each tenth of the work."""

    def __init__(self, parts: int) -> None:
        self.parts, self.ended = parts, 0

    def done(self, job: Job, result: Result) -> None:
        if result.counts["missed"]:
            console.print(bad_words(job, result), markup=False, highlight=False)
        self.one_more()

    def failed(self, job: Job, failure: Failure) -> None:
        console.print(failure_words(failure), failure.details, markup=False)
        self.one_more()

    def one_more(self) -> None:
        self.ended += 1
        if self.ended * 10 // self.parts != (self.ended - 1) * 10 // self.parts:
            console.print(f"{self.ended} of {self.parts} measured", highlight=False)


def missed_of(names: Sequence[str], count: int, quick: bool, seed: int, results: str) -> set[str]:
    """Figures of which a measurement missed its bound or did not end."""
    store, measurements = Store(results), campaign(names, count, quick)
    store.check()
    job = runner.prepared(NAME, measurements, store, seed, measurements.parts)
    if job.waiting:
        with runner.local(WORKERS, processes=False) as client:  # each measurement is a process
            runner.run(client, {NAME: job}, store, Reported(len(job.waiting)))
    return {names[part // count] for part in (*job.bad, *job.failures)}


def seeds_failed(names: Sequence[str] = (), count: int = SEEDS, seed: int = 1) -> int:
    if names:  # their short forms, whose results do not belong to the campaign
        with tempfile.TemporaryDirectory() as folder:
            missed = missed_of(names, count, True, seed, folder)
    else:
        missed = missed_of(seeded(), count, False, seed, str(RESULTS))
    console.print(f"missed by a seed: {', '.join(sorted(missed)) or 'none'}", highlight=False)
    return len(missed)


def __getattr__(name: str) -> dict[str, Campaign]:
    """CAMPAIGNS, made when it is asked for, since it depends on the other figures."""
    if name == "CAMPAIGNS":
        return {NAME: campaign(seeded(), SEEDS, False)}
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


FIGURES = {
    "seeds_failed": Figure(
        seeds_failed,
        "figures",
        "figures that draw random numbers and miss their bound, or do not end, with one of ten "
        "seeds, each measured in full",
        "0",
        Quick(
            {"names": SHORT, "count": 2},
            f"the short forms of {' and '.join(SHORT)} with two seeds",
        ),
        0,
    ),
}
