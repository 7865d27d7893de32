# SPDX-License-Identifier: Apache-2.0
"""A small unattended job of S4, run by experiments.s4_job, and its evaluation of jobs. The short
form of the figure s4_jobs_failed has a job with disturbances and a power cut of both nodes.
"""

import io
import math
import random
from dataclasses import replace

import pytest
from rich.console import Console

from experiments.s4_job import (
    CALM,
    SUB,
    Cut,
    IndexingMachine,
    Outcome,
    apart,
    random_stations,
    shown_by,
)
from moire.client.job import JobState
from tb.bench import seed

SEED = seed()


def test_a_list_entered_on_the_panel_is_cut_by_the_bytes_as_printed_after_a_sub_node_power_cut():
    with IndexingMachine(SEED, "legacy") as machine:
        machine.enter(["0.25", "1"])
        machine.power_cut((SUB,))  # it starts again with its settings and the station list
        outcome = machine.run(replace(CALM, power_cut_s=math.inf))  # the job ends before
        peer = machine.table.peer()
    assert outcome.failed and outcome.spared
    outcome.spared = False  # all else was well
    assert not outcome.failed and not outcome.answers and outcome.stations == [900, 3600]
    assert peer.heard == 2 and min(outcome.tries.values()) > 2
    assert outcome.displays["finished"][0].split() == ["all", "cut", "002/002"]


# ------------------------------------------------------------------ the evaluation


def outcome_of(*cuts, stations=(0.0, 3600.0), state="finished"):
    made = [
        Cut(station, stations[station] if station is not None else 0.0, 0.0, error, 0.0, complete)
        for station, error, complete in cuts
    ]
    return Outcome(
        list(stations), made, JobState(state, "ok", len(stations), len(stations), (), ()), 1.0
    )


@pytest.mark.parametrize(
    "outcome, uncut, twice, outside",
    [
        (outcome_of((0, 0.1, True), (1, -0.4, True)), [], [], 0),
        (outcome_of((0, 0.1, True)), [1], [], 0),
        (outcome_of((0, 0.1, True), (1, 0.1, False)), [1], [], 0),
        (outcome_of((0, 0.1, True), (0, 0.1, True), (1, 0.1, True)), [], [0], 0),
        (outcome_of((0, 0.1, False), (0, 0.1, True), (1, 0.1, True)), [], [0], 0),
        (outcome_of((0, 0.1, True), (1, 0.1, True), (None, 900.0, True)), [], [], 1),
    ],
)
def test_a_job_is_complete_when_each_station_was_cut_once(outcome, uncut, twice, outside):
    assert (outcome.uncut, outcome.twice, len(outcome.outside_tolerance)) == (uncut, twice, outside)
    assert outcome.complete == (not uncut and not twice and not outside)


def test_a_job_fails_beyond_the_tolerance_or_without_an_end():
    assert not outcome_of((0, 2.0, True), (1, -2.0, True)).failed
    assert outcome_of((0, 0.0, True), (1, -2.01, True)).failed
    assert outcome_of((0, 0.0, True), (1, 0.0, True), state="unsure").failed
    assert outcome_of().worst == math.inf


def test_a_job_that_ends_before_its_power_failure_fails():
    outcome = outcome_of((0, 0.0, True), (1, 0.0, True))
    outcome.spared = True
    assert outcome.failed and "power failure" in outcome.words


def test_the_difference_of_two_angles_is_the_shorter_one():
    assert apart(1, 1296000 - 1) == 2 and apart(1296000 - 1, 1) == -2 and apart(3600, 3599.5) == 0.5


@pytest.mark.parametrize("terminal", [True, False])
def test_a_job_shows_its_progress_also_where_there_is_no_terminal(terminal):
    out = io.StringIO()
    console = Console(file=out, force_terminal=terminal)
    status = console.status("building the twin")
    shown_by(console, status)("station 2 of 36")
    assert (out.getvalue() == "station 2 of 36\n") is not terminal
    assert ("station 2" in str(status.status)) is terminal


def test_random_stations_ascend_within_a_turn():
    stations = random_stations(36, random.Random(SEED))
    assert (
        len(stations) == 36
        and stations == sorted(stations)
        and 0 <= stations[0]
        and stations[-1] < 1296000
    )
