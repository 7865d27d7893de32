# SPDX-License-Identifier: Apache-2.0
"""Run the long campaigns on this machine or on a Dask cluster, and write their pages.

    python -m campaigns.soak [NAME …]        (make soak K="NAME …", all without K)

What is done already is not run again: the same command continues a campaign that was interrupted.
Variables of make soak: K, SCHEDULER, RESULTS, WORKERS, SEED, SCALE, MINUTES, PART, LIST.
The exit code is 0 if no campaign has failures, 1 if one has, and 2 if none could be run.
"""

import argparse
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from campaigns import runner, version
from campaigns.campaign import Campaign, Result, Task, added
from campaigns.pages import is_bad, page, sentence, whole
from campaigns.runner import Failure, Job
from campaigns.store import Store
from figures.common import collected, console
from moire.errors import MoireError
from twin.build import ROOT

RESULTS = ROOT / "build" / "soak"


class Shown(runner.Watch):
    """Shows the progress of all campaigns; a part that goes wrong is reported at once."""

    def __init__(self, progress: Progress, jobs: Mapping[str, Job]) -> None:
        self.progress = progress
        self.tasks: dict[str, TaskID] = {}
        for name, job in jobs.items():
            self.tasks[name] = progress.add_task(name, total=job.parts, counts="")
            self.update(job)

    def update(self, job: Job) -> None:
        total, campaign = added(job.campaign, job.results), job.campaign
        counts = (
            f"{whole(total[campaign.tried])} {campaign.tried}, "
            f"{whole(total[campaign.failed])} {campaign.failed}"
        )
        done = len(job.results) + len(job.failures)
        self.progress.update(self.tasks[job.name], completed=done, counts=counts)

    def done(self, job: Job, result: Result) -> None:
        self.update(job)
        if result.counts.get(job.campaign.failed, 0):
            self.say(bad_words(job, result))

    def failed(self, job: Job, failure: Failure) -> None:
        self.update(job)
        self.say(failure_words(failure))

    def say(self, sentence: str) -> None:
        self.progress.console.print(sentence, markup=False, highlight=False, soft_wrap=True)


def of_part(task: Task) -> str:
    return f"{task.campaign}: part {task.part} (seed {task.part_seed})"


def bad_words(job: Job, result: Result) -> str:
    count = whole(float(result.counts[job.campaign.failed]))
    found = [f"\n    {name}: {v}" for name, v in result.counts.items() if isinstance(v, str)]
    return (
        f"{of_part(result.task)} has {count} {job.campaign.failed}; the same again: "
        f"{result.task.command}{''.join(found)}"
    )


def failure_words(failure: Failure) -> str:
    return (
        f"{of_part(failure.task)} is not done: {failure.reason}; the same again: "
        f"{failure.task.command}"
    )


def progress_bar() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TextColumn("{task.fields[counts]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
    )


def one_part(name: str, campaign: Campaign, seed: int, part: int) -> int:
    """Runs a part in this process and prints its counts; nothing is stored."""
    task = Task(name, version.version(), seed, part)
    result = runner.carry_out(campaign, task)
    for count, value in result.counts.items():
        print(f"{count}: {value if isinstance(value, str) else whole(float(value))}")
    bad = bool(result.counts[campaign.failed])
    print(f"{of_part(task)}: {'BAD' if bad else 'good'} after {result.seconds:.1f} s")
    return int(bad)


def conclude(jobs: Mapping[str, Job], store: Store) -> int:
    """Writes the pages and prints what was found."""
    failed = False
    for job in jobs.values():
        path = store.write_page(job.name, job.version, job.seed, page(job))
        bad, left = is_bad(job), len(job.waiting)
        verdict = "BAD" if bad else f"{left} of {job.parts} parts left" if left else "good"
        failed = failed or bad
        repeated = f", {job.repeated} parts from before" if job.repeated else ""
        print(f"{job.name}: {verdict}: {sentence(job)}{repeated}; page: {path}", flush=True)
    return int(failed)


def soak(
    names: Mapping[str, Campaign],
    store: Store,
    seed: int = 1,
    scale: float = 1.0,
    scheduler: str = "",
    workers: int = 2,
    goes_on: Callable[[], bool] = lambda: True,
) -> int:
    """Runs these campaigns; returns the exit code."""
    store.check()
    jobs = {
        name: runner.prepared(name, campaign, store, seed, campaign.parts_of(scale))
        for name, campaign in names.items()
    }
    if any(job.waiting for job in jobs.values()):
        cluster = runner.remote(scheduler) if scheduler else runner.local(workers, dashboard=True)
        with cluster as client, progress_bar() as progress:
            if link := client.dashboard_link:
                progress.console.print(f"dashboard: {link}", soft_wrap=True)
            try:
                runner.run(client, jobs, store, Shown(progress, jobs), goes_on)
            except KeyboardInterrupt:
                progress.console.print("interrupted: the same command goes on from here")
    return conclude(jobs, store)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m campaigns.soak", description=(__doc__ or "").partition("\n\n")[0]
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="of campaigns (default: all)")
    parser.add_argument("--list", action="store_true", help="print which campaigns there are")
    parser.add_argument("--scheduler", default="", metavar="tcp://HOST:8786", help="of a cluster")
    parser.add_argument(
        "--results", default=str(RESULTS), metavar="URL", help="folder or object store"
    )
    parser.add_argument(
        "--workers", type=int, default=os.cpu_count() or 1, help="on this machine (default: cores)"
    )
    parser.add_argument("--seed", type=int, default=1, help="1 and up (default 1)")
    parser.add_argument("--scale", type=float, default=1.0, help="share of each campaign's length")
    parser.add_argument(
        "--minutes", type=float, help="stop after about this time; parts that run end"
    )
    parser.add_argument("--part", type=int, help="run this part alone, here, and print its counts")
    options = parser.parse_args(arguments)
    known: dict[str, Campaign] = collected("CAMPAIGNS")
    if options.list:
        for name, campaign in known.items():
            print(f"{name:24} {campaign.parts:6} parts of {campaign.what}")
        return 0
    if unknown := [name for name in options.names if name not in known]:
        parser.error(f"there is no campaign {unknown[0]}: there are {', '.join(known)}")
    if options.seed < 1:
        parser.error("--seed takes 1 and up")
    if options.workers < 1:
        parser.error("--workers takes 1 and up")
    if not 0 < options.scale <= 1:
        parser.error("--scale takes a share above 0, up to 1")
    names = {name: known[name] for name in options.names or known}
    if options.part is not None:
        if len(names) != 1:
            parser.error("--part is of one campaign: name it")
        ((name, campaign),) = names.items()
        if not 0 <= options.part < campaign.parts:
            parser.error(f"{name} has the parts 0 to {campaign.parts - 1}")
        return one_part(name, campaign, options.seed, options.part)
    end = time.monotonic() + 60 * options.minutes if options.minutes is not None else None
    try:
        return soak(
            names,
            Store(options.results),
            options.seed,
            options.scale,
            options.scheduler,
            options.workers,
            lambda: end is None or time.monotonic() < end,
        )
    except MoireError as error:
        print(f"soak: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
