# SPDX-License-Identifier: Apache-2.0
"""Figures of S4 in the twin: true angles of the table, and outcomes of whole jobs of two nodes,
judged by the log of the EDM.

The campaign of 20 whole jobs of 36 stations is `make soak K=s4_jobs`.
"""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from campaigns.campaign import Campaign, Counts
from experiments import s4_job
from figures.common import Figure, Quick, console, in_processes, seeds
from moire.client.bus import Bus
from moire.client.indexing_table import IndexingTable
from twin import Axis, Node, Twin, TwinTransport, build

JOBS = 20
STATIONS = 36
SUB_NODE = {**s4_job.NODE, "HAS_ANGLE_SENSOR": 1}  # no other peripheral
TROUBLED_STATIONS, TROUBLED_PART = 8, 0.06  # of a turn
TROUBLED_STATION_S = 3  # that one takes, about; the power cut comes within the job
SHORT_POWER_CUT_S = 4.5  # the latest of a job of one station

Job = Callable[[int], s4_job.Outcome]  # of its seed


# Tables and jobs run in processes of their own: a fork would inherit the thread of the bar.


def indexed(seed: int, stations: int = STATIONS, share: float = 1.0) -> float:
    """arcsec: the largest true error of a table that turns to the stations of a job, in this share
    of a turn, from its standstill until a cut would have ended.
    """
    source = random.Random(seed)
    with Twin(
        [Node(1, [Axis("worm_table", s4_job.random_worm(source))])],
        seed=seed,
        clk_hz=s4_job.CLK_HZ,
        firmware=build.firmware("station"),
        node_parameters=SUB_NODE,
    ) as twin:
        node = Bus(
            TwinTransport(twin), random_source=random.Random(seed), poll_s=s4_job.POLL_S
        ).node(1)
        twin.set_position(0, math.radians(source.uniform(0, s4_job.ABOUT)))
        twin.run_until_ready()
        s4_job.set_up_table(node)
        errors = []
        for station in s4_job.random_stations(stations, source, share):
            IndexingTable(node).turn(station)
            for _ in range(2):
                errors.append(
                    s4_job.apart(math.degrees(twin.truth(0).position_rad) * 3600, station)
                )
                twin.run(s4_job.CUT_S)
        return max(map(abs, errors))


def calm_job(seed: int) -> s4_job.Outcome:
    source = random.Random(seed)
    with s4_job.IndexingMachine(seed, worm=s4_job.random_worm(source)) as machine:
        machine.load(s4_job.random_stations(STATIONS, source))
        return machine.run(s4_job.CALM)


def troubled_job(seed: int) -> s4_job.Outcome:
    source = random.Random(seed)
    with s4_job.IndexingMachine(seed, worm=s4_job.random_worm(source)) as machine:
        machine.load(s4_job.random_stations(TROUBLED_STATIONS, source, TROUBLED_PART))
        return machine.run(s4_job.some_trouble(TROUBLED_STATION_S * TROUBLED_STATIONS, source))


def short_job(seed: int) -> s4_job.Outcome:
    """One station, with all the trouble, and a power cut of both nodes."""
    source = random.Random(seed)
    with s4_job.IndexingMachine(seed, worm=s4_job.random_worm(source)) as machine:
        machine.load(s4_job.random_stations(1, source, TROUBLED_PART))
        trouble = s4_job.some_trouble(SHORT_POWER_CUT_S, source)
        return machine.run(replace(trouble, dark=(s4_job.MAIN, s4_job.SUB)))


def jobs(job: Job, count: int, seed: int = 1) -> list[s4_job.Outcome]:
    s4_job.IndexingMachine().twin.close()  # builds the twin once
    made = []
    for outcome in in_processes("jobs", job, [1] * count, seeds(seed, count)):
        made.append(outcome)
        console.print(f"job {len(made)}: {outcome.words}; {len(outcome.answers)} answers")
    cuts = sum(len(outcome.cuts) for outcome in made)
    failed = sum(outcome.failed for outcome in made)
    worst = max(outcome.worst for outcome in made)
    console.print(
        f"{cuts} cuts in {len(made)} jobs, {failed} failed; largest error {worst:.2f} arcsec"
    )
    return made


def s4_index_arcsec_max(
    count: int = JOBS, stations: int = STATIONS, share: float = 1.0, seed: int = 1
) -> float:
    """The host sends the stations to the table's node, as the main node does in a job."""
    build.twin_library(s4_job.CLK_HZ, 1, SUB_NODE)
    worst = []
    run = partial(indexed, stations=stations, share=share)
    for error in in_processes("tables", run, [1] * count, seeds(seed, count)):
        worst.append(error)
        console.print(f"table {len(worst)}: at most {error:.2f} arcsec at {stations} stations")
    return max(worst)


def s4_jobs_failed(count: int = JOBS, job: Job = troubled_job, seed: int = 1) -> int:
    """A job fails if a station is not cut or cut twice, if a cut is elsewhere or beyond the
    tolerance, if the job does not end, or if it ends before its power cut.
    """
    return sum(outcome.failed for outcome in jobs(job, count, seed))


FIGURES = {
    "s4_index_arcsec_max": Figure(
        s4_index_arcsec_max,
        "arcsec",
        f"largest difference of the true angle from the station's at {STATIONS} stations of each "
        f"of {JOBS} tables, anywhere in a turn, random worms",
        "<= 2",
        Quick(
            {"count": 1, "stations": 1, "share": TROUBLED_PART},
            "one station of one table, near by",
        ),
        2,
        "the sensor alone +-1",
    ),
    "s4_jobs_failed": Figure(
        s4_jobs_failed,
        "jobs",
        f"jobs with a station not cut or cut twice, of {JOBS} jobs of {TROUBLED_STATIONS} stations "
        "with 1 % of the sensor's frames damaged, garbage between the nodes, a person who types, "
        "and a power cut in each; a cut in which the table loses power is judged by its beginning",
        "0",
        Quick({"count": 1, "job": short_job}, "one job of one station, power cut of both nodes"),
        0,
    ),
}


def whole_job(part: int, seed: int) -> Counts:
    outcome = calm_job(seed)
    counts = {"jobs": 1, "failed": bool(outcome.failed), "cuts": len(outcome.cuts)}
    return {**counts, "arcsec": outcome.worst, "outcome": outcome.words}


CAMPAIGNS = {
    "s4_jobs": Campaign(
        "whole jobs of 36 stations on a random worm; failed: jobs with a station not cut, cut "
        "twice or beyond the tolerance",
        whole_job,
        parts=JOBS,
        tried="jobs",
        failed="failed",
        largest=("arcsec",),
    )
}
