# SPDX-License-Identifier: Apache-2.0
"""Carries out `moire study` (sw/host/moire/cli/commands/study.py) in a checkout: the host package
finds this module by the entry point `study` of the group moire.commands.

What is done already is not run again: the same command continues a study that was interrupted, and
with more runs or another specification it takes over the runs that are there.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from rich.progress import Progress

from campaigns import runner
from campaigns.campaign import Result
from campaigns.runner import Failure, Job
from campaigns.soak import progress_bar
from campaigns.store import Store
from moire import units
from moire.errors import MoireError, TwinNotBuilt
from study import page, study_file
from study.analysis import findings
from study.machines import MACHINES
from study.runs import FAULTED, SIMULATED, campaign_of, outcome_of
from study.study_file import Study
from twin import BuildError
from twin.build import ROOT

RESULTS = ROOT / "build" / "study"


class NotComplete(MoireError):
    """Runs of the study are missing."""


class Stopped(MoireError):
    """Ctrl-C ended the study early."""

    exit_code = 130


@dataclass(frozen=True)
class Answer:
    """What the command prints: values for JSON, and text."""

    values: Mapping[str, Any]
    text: str


class Shown(runner.Watch):
    """Shows the progress; a run that does not complete is reported at once."""

    def __init__(self, progress: Progress, job: Job) -> None:
        self.progress = progress
        self.task = progress.add_task("runs", total=job.parts, counts="")
        self.update(job)

    def update(self, job: Job) -> None:
        faulted = sum(bool(result.counts[FAULTED]) for result in job.results.values())
        done = len(job.results) + len(job.failures)
        self.progress.update(self.task, completed=done, counts=f"{faulted} faulted")

    def done(self, job: Job, result: Result) -> None:
        self.update(job)

    def failed(self, job: Job, failure: Failure) -> None:
        self.update(job)
        self.say(f"run {failure.task.part} is not done: {failure.reason}")

    def say(self, sentence: str) -> None:
        self.progress.console.print(sentence, markup=False, highlight=False, soft_wrap=True)


def example() -> str:
    """The text of a study with all effects."""
    return study_file.example()


def read(text: str, file: str, runs: int | None) -> Study:
    """The study in a file; raises BadFile."""
    study = study_file.read(text, file)
    return study if runs is None else replace(study, runs=runs)


def prepared(study: Study, store: Store, seed: int) -> Job:
    """The runs of a study, with those that are done."""
    return runner.prepared(study.name, campaign_of(study), store, seed, study.parts)


def run(study: Study, job: Job, store: Store, workers: int, scheduler: str = "") -> bool:
    """Runs what is not done yet; False if Ctrl-C ended it early."""
    if not job.waiting:
        return True
    if not scheduler:  # before the workers start, so that they do not wait for each other
        try:
            MACHINES[study.machine].prepare()
        except BuildError as error:
            raise TwinNotBuilt(f"the simulated machine cannot be built: {error}") from None
    cluster = runner.remote(scheduler) if scheduler else runner.local(workers)
    with cluster as client, progress_bar() as progress:
        try:
            runner.run(client, {job.name: job}, store, Shown(progress, job))
        except KeyboardInterrupt:
            return False
    return True


def plan(study: Study, job: Job, workers: int) -> Answer:
    """What the study would do, and for how long."""
    times = [result.seconds for result in job.results.values()]
    each = sum(times) / len(times) if times else MACHINES[study.machine].expected_s(study.measure)
    source = "as those that are done" if times else "estimated, with a twin that is built"
    left = len(job.waiting)
    minutes = left * each / workers / 60
    rows = [
        f"{study.parts} runs of the machine {study.machine}: {study.repeats} times each of "
        f"{len(study.effects)} effects alone and none, {study.runs} with all effects drawn",
        f"each run: {page.measure_words(study)}",
        f"specification: {study.spec.words}",
        f"{len(job.results)} runs are done, {left} are left: about {minutes:.0f} minutes on "
        f"{workers} workers, {each:.1f} s a run ({source})",
    ]
    values = {
        "runs": study.parts,
        "done": len(job.results),
        "left": left,
        "seconds_each": each,
        "workers": workers,
        "effects": [effect.name for effect in study.effects],
    }
    return Answer(values, "\n".join(rows))


def conclude(study: Study, job: Job, store: Store, again: str) -> Answer:
    """Writes the page and the data, and says what was found."""
    outcomes = [outcome_of(study, job.results[part]) for part in sorted(job.results)]
    found = findings(study, outcomes)
    simulated = sum(float(result.counts.get(SIMULATED, 0)) for result in job.results.values())
    taken = sum(result.seconds for result in job.results.values())
    facts = {
        "runs": f"{len(job.results)} of {job.parts}: {study.singles} with one effect alone or "
        f"none; {study.runs} with all effects drawn",
        "parameters that all runs have": ", ".join(f"{n} {v:g}" for n, v in study.fixed.items())
        or "those of sw/twin/parameters",
        "simulated time, time of cores": f"{units.format_time(round(simulated, 1))}, "
        f"{taken / 3600:.2f} h",
        "version": f"{job.version} (commit, content)",
        "seed": str(job.seed),
        "again": again,
    }
    folder = store.folder(job.name, job.version, job.seed)
    for name, data in page.raw_data(study, outcomes).items():
        store.put(f"{folder}/{name}", data)
    path = store.write_page(job.name, job.version, job.seed, page.page(found, facts))
    repeated = f"; {job.repeated} of {job.parts} runs are from before" if job.repeated else ""
    text = f"{page.terminal(found)}\n\npage: {path}\ndata: {folder}/runs.csv, .parquet{repeated}"
    return Answer({**page.values_of(found), "page": path, "repeated": job.repeated}, text)


def carry_out(
    text: str,
    file: str,
    runs: int | None = None,
    seed: int = 1,
    workers: int | None = None,
    scheduler: str = "",
    results: str | None = None,
    dry_run: bool = False,
) -> Answer:
    """The study in the text of a file. Raises MoireError, NotComplete if runs are missing."""
    study = read(text, file, runs)
    if not study.parts:
        raise MoireError(f"{file} asks for no run: neither repeats nor runs")
    workers = workers or os.cpu_count() or 1
    store = Store(results or str(RESULTS))
    job = prepared(study, store, seed)
    if dry_run:
        return plan(study, job, workers)
    store.check()
    again = " ".join(
        ["moire study", file, f"--runs {study.runs}", f"--seed {seed}"]
        + [f"--results {results}"] * bool(results)
    )
    if not run(study, job, store, workers, scheduler):
        raise Stopped("interrupted; what is done is kept: the same command goes on from here")
    if not job.results:
        raise NotComplete(f"no run is done; the first: {next(iter(job.failures.values())).reason}")
    answer = conclude(study, job, store, again)
    if job.failures:
        first = next(iter(job.failures.values()))
        raise NotComplete(
            f"{len(job.failures)} runs are not done; run {first.task.part}: {first.reason}; page "
            f"of the others: {answer.values['page']}"
        )
    return answer
