# SPDX-License-Identifier: Apache-2.0
"""Figures of S4: true angles and outcomes of whole jobs in the twin, two nodes each, judged by the log of the EDM machine."""
import math
import random
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from experiments.figures_common import Figure, bar, console
from experiments.s4_job import CALM, IndexingMachine, random_stations, random_worm, some_trouble

PROCESSES = 2
JOBS = 20
STATIONS = 36
TROUBLED_STATIONS, TROUBLED_PART = 8, 0.06          # of a turn
TROUBLED_STATION_S = 3                              # of one, about; the power goes within the job


def calm_job(seed):                     # in a process of its own: a fork would inherit the progress bar's thread
    source = random.Random(seed)
    with IndexingMachine(seed, worm=random_worm(source)) as machine:
        machine.load(random_stations(STATIONS, source))
        return machine.run(CALM)


def troubled_job(seed):
    source = random.Random(seed)
    with IndexingMachine(seed, worm=random_worm(source)) as machine:
        machine.load(random_stations(TROUBLED_STATIONS, source, TROUBLED_PART))
        return machine.run(some_trouble(TROUBLED_STATION_S * TROUBLED_STATIONS, source))


def jobs(job, count):
    IndexingMachine().twin.close()                  # builds the twin once
    made = []
    with bar("jobs") as progress, ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        for outcome in progress.track(pool.map(job, range(1, count + 1)), total=count):
            made.append(outcome)
            progress.console.print(f"job {len(made)}: {outcome.words}; {len(outcome.answers)} answers")
    cuts, failed = sum(len(outcome.cuts) for outcome in made), sum(outcome.failed for outcome in made)
    console.print(f"{cuts} cuts in {len(made)} jobs, {failed} failed; largest error {max(outcome.worst for outcome in made):.2f} arcsec")
    return made


def s4_index_arcsec_max(count=JOBS):
    """Infinite if a job did not cut each of its stations once."""
    return max(outcome.worst if outcome.whole else math.inf for outcome in jobs(calm_job, count))


def s4_jobs_failed(count=JOBS):
    """Failed: a station uncut, one cut twice, a cut elsewhere or more than the tolerance away, or no end."""
    return sum(outcome.failed for outcome in jobs(troubled_job, count))


FIGURES = {
    "s4_index_arcsec_max": Figure(s4_index_arcsec_max, "arcsec", f"true angle at the cut less wanted, largest of {JOBS} jobs of {STATIONS} "
                                  "stations anywhere in a turn, random worms", "<= 2 (the sensor alone +-1)", lambda v: v <= 2, 2),
    "s4_jobs_failed": Figure(s4_jobs_failed, "jobs", f"jobs with a station uncut or cut twice, of {JOBS} jobs of {TROUBLED_STATIONS} "
                             "stations with 1 % of the sensor's frames damaged, garbage between the nodes, a person who types, and a power "
                             "cut each", "0", lambda v: v == 0, 0),
}
