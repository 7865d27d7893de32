# SPDX-License-Identifier: Apache-2.0
"""Figure of the campaigns: do all of them pass at a thousandth of their length while a worker is
killed.
"""

import os
import signal
import tempfile
from collections.abc import Sequence

from distributed import Client

from campaigns import runner
from campaigns.campaign import Campaign, Result, added
from campaigns.runner import Failure, Job
from campaigns.soak import bad_words, failure_words
from campaigns.store import Store
from figures.common import Figure, Quick, collected, console

WORKERS = 2
SCALE = 0.001
QUICK = ("ps2", "relay")
PARTS_IN_SHORT = 2  # of each of these


class Killer(runner.Watch):
    """Kills one of the workers when half of the parts are done."""

    def __init__(self, client: Client, parts: int) -> None:
        # {address of a worker: number of its process}
        self.processes: dict[str, int] = client.run(os.getpid)
        self.left = max(1, parts // 2)
        self.killed = 0

    def done(self, job: Job, result: Result) -> None:
        if result.counts.get(job.campaign.failed, 0):
            console.print(bad_words(job, result), markup=False)
        self.one_less(int(result.host.rpartition("/")[2]))

    def failed(self, job: Job, failure: Failure) -> None:
        console.print(failure_words(failure), failure.details, markup=False)
        self.one_less(0)

    def one_less(self, idle: int) -> None:
        self.left -= 1
        if self.left == 0:  # the worker that has just completed a part is not the one
            self.killed = next(n for n in self.processes.values() if n != idle)
            os.kill(self.killed, signal.SIGKILL)


def soak_failures(names: Sequence[str] = (), seed: int = 1) -> int:
    known: dict[str, Campaign] = collected("CAMPAIGNS")
    with tempfile.TemporaryDirectory() as folder, runner.local(WORKERS) as client:
        store = Store(folder)
        jobs = {
            name: runner.prepared(
                name,
                campaign,
                store,
                seed,
                PARTS_IN_SHORT if names else campaign.parts_of(SCALE),
            )
            for name, campaign in known.items()
            if name in (names or known)
        }
        killer = Killer(client, sum(job.parts for job in jobs.values()))
        runner.run(client, jobs, store, killer)
        failures = 0 if killer.killed else 1
        for name, job in jobs.items():
            again = store.results(name, job.version, seed, range(job.parts))
            lost = job.parts - len(again)
            total = added(job.campaign, again)
            tried, bad = total[job.campaign.tried], total[job.campaign.failed]
            console.print(f"{name}: {job.parts} parts, {lost} not done, {bad:.0f} failures")
            failures += lost + (int(bad) if bad > job.campaign.allowed * tried else 0)
    return failures


FIGURES = {
    "soak_failures": Figure(
        soak_failures,
        "failures",
        "failures of all campaigns at a thousandth of their length, on two local workers of Dask, "
        "one of them killed in the middle; parts that are not done count as failures",
        "0",
        Quick({"names": QUICK}, f"two parts of {' and '.join(QUICK)}"),
        0,
    ),
}
