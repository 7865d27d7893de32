# SPDX-License-Identifier: Apache-2.0
"""Outcomes of flips: each class is recognised, in runs made by hand and in the node of S3."""

import os
import signal
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from figures import flips
from figures.common import seeds
from tb.bench import rtl_only

MACHINE = flips.Machine(lambda seed: None, 1000.0, 100.0, 10.0)


def test_the_parts_of_a_campaign_share_an_order_of_the_bits_which_changes_with_its_seed():
    orders = [
        {flips.common_seed(part, one) for part, one in enumerate(seeds(seed, 8))}
        for seed in (1, 2, 9)
    ]
    assert [len(order) for order in orders] == [1, 1, 1] and len(set().union(*orders)) == 3


def run_of(there=0.0, end=0.0, **changes):
    """A run whose path is off by `there` nm in the middle of the first move, by `end` at rest."""
    out = np.linspace(0, 1000, 2000)
    out[500] += there
    out[-200:] = 1000 + end
    back = np.linspace(1000, 0, 2000)
    return replace(flips.Run(flipped=True, paths=[out, back]), **changes)


@pytest.mark.parametrize(
    "run, kind",
    [
        (run_of(), "harmless"),
        (run_of(there=9), "harmless"),
        (run_of(there=11), "recovered"),
        (run_of(end=2), "recovered"),
        (run_of(repeats=1), "recovered"),
        (run_of(there=101), "wrong motion"),
        (run_of(end=11), "wrong motion"),
        (run_of(there=101, error="fault following_error"), "fault"),
        (run_of(on=False), "wrong motion"),
        (run_of(error="no answer", on=False), "fault"),
        (run_of(error="no answer", unanswered=True), "on without an answer"),
        (run_of(there=101, flipped=False), flips.NO_FLIP_FLOP),
        (run_of(same=True), "harmless"),
        (None, "lost"),
    ],
)
def test_classes(run, kind):
    assert flips.outcome_of(run, run_of(), MACHINE)[0] == kind


def test_the_way_back_may_begin_late_but_leads_to_no_other_place():
    reference = run_of()
    late = run_of()
    late.paths[1] = np.concatenate([np.full(40, 1000.0), late.paths[1]])[:2000]
    late.paths[1][-200:] = 0.0
    reference.paths[1][-200:] = 0.0
    assert flips.outcome_of(late, reference, MACHINE)[0] == "harmless"
    late.paths[1][700] = -101.0
    assert flips.outcome_of(late, reference, MACHINE)[0] == "wrong motion"


def test_each_job_sees_the_same_state_and_a_copy_that_dies_is_reported():
    state = [0]

    def work(job):
        state[0] += job
        if job == 3:
            os.kill(os.getpid(), signal.SIGKILL)
        return state[0]

    assert dict(flips.forked([1, 2, 3, 4], work, 2)) == {1: 1, 2: 2, 3: None, 4: 4}
    assert state == [0]


@pytest.fixture(scope="module")
def s3():
    rtl_only("the cells of a netlist have no names")
    session = flips.MACHINES["s3"].power_up(1)
    yield session
    session.twin.close()


def flip_of(session, name, bit, after_s=0.02):
    (register,) = (one for one in session.registers if one.name == name)
    return flips.Flip(register, 0, bit, after_s)


def test_flips_in_a_real_motion(s3):
    machine = flips.MACHINES["s3"]
    ((_, reference),) = flips.forked([None], partial(flips.observed, s3, machine))
    position = "g_axis[0].u_axis.u_feedback.u_position.u_position.periods"
    tried = {
        flip_of(s3, position, 17): ("fault", "fault following_error"),
        flip_of(s3, position, 3): ("wrong motion", None),  # 32 um: only homing again finds it
        flip_of(s3, "rdata", 31): ("harmless", None),
    }
    work = partial(flips.observed, s3, machine, reference=reference)
    for flip, run in flips.forked(tried, work, 2):
        kind, cause = flips.outcome_of(run, reference, machine)
        assert kind == tried[flip][0] and tried[flip][1] in (None, cause), str(flip)


def test_a_drive_that_stays_on_is_found(s3, monkeypatch):
    """A flip of the bus watchdog's time is repaired. A drive that nothing stops is on, and a look
    that takes this for a failure finds it.
    """
    machine = flips.MACHINES["s3"]
    watchdog = flip_of(s3, "u_rs485.watchdog_time", 15)
    monkeypatch.setitem(flips.STOPS, "nothing", flips.Cause(flips.silence, lambda session: 0.001))
    jobs = [(watchdog, "bus"), (watchdog, "estop"), (watchdog, "nothing")]
    work = partial(flips.unstopped, s3, machine)
    found = {cause: wrong for (_, cause), wrong in flips.forked(jobs, work, 2)}
    assert found["bus"] == found["estop"] == ""
    assert found["nothing"] == "on after nothing, 0 ms late"


def test_what_stops_the_drives_is_found_by_name(s3):
    names = {one.name for one, _, _ in flips.protection_bits(s3.registers)}
    assert names >= {
        "drive_enable",
        "watchdog_expired",
        "u_estop.stages",
        "u_rs485.watchdog_time",
        "u_core_watchdog.u_heartbeat.silent",
        "axis_faults",
        "g_axis[0].u_axis.control_enable",
        "g_axis[0].u_axis.g_drive.u_interlock.too_far",
    }
