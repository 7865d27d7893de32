# SPDX-License-Identifier: Apache-2.0
"""Runs the parts of campaigns on the workers of a Dask cluster.

A worker writes the result of each part itself (store.py), so nothing is lost with the worker, the
scheduler or the client: a part is done when its file is there. Dask gives the parts of a worker
that died to others; a part that ends workers again and again is reported. When the scheduler dies,
the runner waits for it to come back and hands in what is not done yet.
"""

import logging
import os
import socket
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime

import dask
from distributed import Client, LocalCluster, as_completed
from distributed.scheduler import KilledWorker

from campaigns import version
from campaigns.campaign import Campaign, Result, Task
from campaigns.store import Store
from moire.errors import MoireError

CONNECT_S = 10.0
RETURN_S = 60.0  # for which a scheduler that died may be away
ENDED_WORKERS = 3  # workers that may die with a part before it counts as not done
DASHBOARD = 8787
SETTINGS = {
    "distributed.scheduler.allowed-failures": ENDED_WORKERS,
    "distributed.worker.daemon": True,  # workers end with their client
    "distributed.admin.tick.limit": "1h",  # a part may hold Python's lock for long
    "distributed.comm.timeouts.connect": f"{CONNECT_S:.0f}s",
    "distributed.comm.retry.count": 0,
}


class NoScheduler(MoireError):
    """There is no scheduler, or it is gone."""


class OtherVersion(MoireError):
    """A worker has another content of the repository than the campaign."""


@dataclass(frozen=True)
class Failure:
    """A part that did not complete: its function failed, or ended its worker."""

    task: Task
    reason: str  # one line
    details: str = ""


@dataclass
class Job:
    """A campaign, the number of its parts that are to be run, and what has come of it."""

    name: str
    campaign: Campaign
    version: str
    seed: int
    parts: int
    results: dict[int, Result] = field(default_factory=dict)
    failures: dict[int, Failure] = field(default_factory=dict)
    repeated: int = 0  # parts that were done before and not run again

    def task(self, part: int) -> Task:
        return Task(self.name, self.version, self.seed, part)

    @property
    def waiting(self) -> list[Task]:
        """What is neither done nor failed."""
        gone = self.results.keys() | self.failures.keys()
        return [self.task(part) for part in range(self.parts) if part not in gone]

    @property
    def bad(self) -> dict[int, Result]:
        """The parts in which a trial failed."""
        name = self.campaign.failed
        return {n: r for n, r in self.results.items() if r.counts.get(name, 0)}


class Watch:
    """What is called while a campaign runs; does nothing by itself."""

    def done(self, job: Job, result: Result) -> None:
        pass

    def failed(self, job: Job, failure: Failure) -> None:
        pass

    def say(self, sentence: str) -> None:
        pass


def carry_out(campaign: Campaign, task: Task) -> Result:
    """Runs a part in this process."""
    began, clock = datetime.now(UTC), time.perf_counter()
    counts = dict(campaign.run(task.part, task.part_seed))
    for name in (campaign.tried, campaign.failed):
        if name not in counts:
            raise ValueError(f"the part has no count {name}")
    seconds = time.perf_counter() - clock
    host = f"{socket.gethostname()}/{os.getpid()}"
    return Result(task, counts, host, began.isoformat(timespec="seconds"), seconds)


def work(campaign: Campaign, task: Task, url: str) -> None:
    """What a worker does: nothing if the part is done already."""
    here = version.content()
    if not task.version.endswith(f"-{here}"):
        raise OtherVersion(
            f"the worker on {socket.gethostname()} has the content {here}, the campaign is of "
            f"{task.version}: give it the same checkout"
        )
    store = Store(url)
    if store.read(task) is None:
        store.write(carry_out(campaign, task))


def last_line(error: BaseException) -> str:
    text = str(error).strip()
    return f"{type(error).__name__}: {text.splitlines()[0]}" if text else type(error).__name__


def failure_of(task: Task, error: BaseException) -> Failure:
    if isinstance(error, KilledWorker):
        return Failure(task, f"its worker died {ENDED_WORKERS + 1} times while it ran")
    details = "".join(traceback.format_exception(error))
    return Failure(task, last_line(error), details)


# ------------------------------------------------------------------ clusters


@contextmanager
def settings() -> Iterator[None]:
    """Dask's settings for campaigns; its warnings about workers that die are not shown, since the
    runner reports what matters.
    """
    loggers = [logging.getLogger(name) for name in ("distributed", "tornado", "asyncio")]
    before = [logger.level for logger in loggers]
    with dask.config.set(SETTINGS):
        try:
            for logger in loggers:
                logger.setLevel(logging.CRITICAL)
            yield
        finally:
            for logger, level in zip(loggers, before, strict=True):
                logger.setLevel(level)


@contextmanager
def local(workers: int, processes: bool = True, dashboard: bool = False) -> Iterator[Client]:
    """Workers of this machine, one part at a time each; as threads for tests."""
    with settings(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Port .* is already in use", UserWarning)
        cluster = LocalCluster(
            n_workers=workers if processes else 1,
            threads_per_worker=1 if processes else workers,
            processes=processes,
            host="127.0.0.1" if processes else None,
            memory_limit=None,
            scheduler_kwargs={
                "dashboard": dashboard,
                "dashboard_address": f"127.0.0.1:{DASHBOARD if dashboard else 0}",
            },
            silence_logs=logging.CRITICAL,
        )
        client = Client(cluster)
        try:
            yield client
        finally:
            close(client)
            with suppress(TimeoutError):  # a worker that is slow to end: the results are written
                cluster.close()


def connect(address: str, patience_s: float | None = None) -> Client:
    """A client of the scheduler at this address; NoScheduler if none answers in time."""
    end = time.monotonic() + (CONNECT_S if patience_s is None else patience_s)
    while True:
        left = max(0.1, end - time.monotonic())
        try:
            return Client(address, timeout=min(left, CONNECT_S))
        except (OSError, ValueError, TimeoutError) as error:
            if isinstance(error, ValueError) or time.monotonic() >= end:
                raise NoScheduler(
                    f"no Dask scheduler answers at {address}: is it running? Without an address "
                    "this machine's own processors are used"
                ) from None


@contextmanager
def remote(address: str) -> Iterator[Client]:
    with settings():
        client = connect(address)
        try:
            yield client
        finally:
            close(client)


def close(client: Client) -> None:
    """Also of a client whose scheduler is gone."""
    with suppress(Exception):
        client.close(timeout=1)


# ------------------------------------------------------------------ the run


def prepared(name: str, campaign: Campaign, store: Store, seed: int, parts: int) -> Job:
    """A job with what was done before."""
    job = Job(name, campaign, version.version(), seed, parts)
    job.results = store.results(name, job.version, seed, range(parts))
    job.repeated = len(job.results)
    return job


def in_turn(jobs: Mapping[str, Job]) -> Iterator[tuple[Job, Task]]:
    """What is to be done, a part of each campaign in turn."""
    rows = [(job, job.waiting) for job in jobs.values()]
    for n in range(max((len(tasks) for _, tasks in rows), default=0)):
        for job, tasks in rows:
            if n < len(tasks):
                yield job, tasks[n]


def collect(
    client: Client,
    jobs: Mapping[str, Job],
    store: Store,
    watch: Watch,
    goes_on: Callable[[], bool],
) -> bool:
    """Runs what is to be done as long as goes_on() holds; False if the scheduler went away."""
    todo, waiting = in_turn(jobs), dict[object, tuple[Job, Task]]()
    running = as_completed(raise_errors=False)

    def hand_in() -> None:
        """As many parts as the cluster runs at once: only a part that ran is blamed for the death
        of its worker, and a run that is to stop has none waiting.
        """
        room = max(1, sum(client.nthreads().values()))
        while len(waiting) < room and goes_on() and (following := next(todo, None)):
            job, task = following
            future = client.submit(work, job.campaign, task, store.url, key=task.name, pure=False)
            waiting[future.key] = following
            running.add(future)

    hand_in()
    for future in running:
        job, task = waiting.pop(future.key)
        if future.status == "cancelled" or client.status != "running":
            return False
        if future.status == "error":
            failure = failure_of(task, future.exception())
            job.failures[task.part] = failure
            watch.failed(job, failure)
        else:
            result = store.read(task)
            if result is None:
                raise MoireError(
                    f"part {task.part} of {task.campaign} was done, but its result is not in "
                    f"{store.url}: the workers need a folder that this machine sees, or an object "
                    "store"
                )
            job.results[task.part] = result
            watch.done(job, result)
        future.release()
        try:
            hand_in()
        except OSError:  # a connection that is closed
            return False
    return True


def run(
    client: Client,
    jobs: Mapping[str, Job],
    store: Store,
    watch: Watch,
    goes_on: Callable[[], bool] = lambda: True,
    return_s: float = RETURN_S,
) -> None:
    """Runs all parts that are not done yet; a scheduler that goes away is awaited."""
    address = str(client.scheduler_info()["address"])
    own: list[Client] = []
    try:
        while not collect(client, jobs, store, watch, goes_on):
            watch.say(f"the scheduler at {address} is gone; waiting {return_s:.0f} s for it")
            for job in jobs.values():  # what workers completed meanwhile
                done = store.results(
                    job.name, job.version, job.seed, (task.part for task in job.waiting)
                )
                job.results |= done
            close(client)
            try:
                client = connect(address, return_s)
            except NoScheduler:
                left = sum(len(job.waiting) for job in jobs.values())
                raise NoScheduler(
                    f"the scheduler at {address} is gone; {left} parts are left. Nothing that was "
                    "done is lost: the same command goes on from there"
                ) from None
            own.append(client)
    finally:
        for one in own:
            close(one)
