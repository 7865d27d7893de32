# SPDX-License-Identifier: Apache-2.0
"""The spindle of a lathe and its encoder, compared with calculations by hand."""

import math

import numpy
import pytest

from twin import Machine

EVEN = dict(drive_unevenness=0.0)
LINES = 50


def spindle(clk_hz=1_000_000, **values):
    return Machine("spindle", clk_hz=clk_hz, encoder_lines=LINES, **values)


def test_it_runs_up_to_its_speed_with_its_time_constant():
    machine = spindle(**EVEN)
    machine.run(0.1)
    assert machine.state.speed_rev_s == pytest.approx(5 * (1 - math.exp(-1)), rel=2e-3)
    machine.run(2.0)
    start = machine.state.turns
    machine.run(1.0)
    assert machine.state.turns - start == pytest.approx(5.0, abs=1e-6)


def test_the_unevenness_is_that_of_the_table_and_has_its_order():
    machine = spindle(drive_unevenness=0.02, drive_order=2.0)
    machine.run(2.0)
    speeds = []
    for _ in range(400):  # two turns
        start = machine.state.turns
        machine.run(1e-3)
        speeds.append((machine.state.turns - start) / 1e-3)
    assert numpy.ptp(speeds) / 2 == pytest.approx(0.02 * 5, rel=0.02)
    assert int(numpy.argmax(abs(numpy.fft.rfft(speeds - numpy.mean(speeds))))) == 2 * 2


@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_every_count_is_an_edge_and_every_turn_has_one_index(speed):
    machine = spindle(drive_speed=speed, **EVEN)
    machine.run(2.0)
    before = machine.state
    levels = machine.watch(1.0)
    edges = [numpy.flatnonzero(numpy.diff(levels[f"encoder_{name}"])) for name in "abz"]
    after = machine.state
    assert len(edges[0]) + len(edges[1]) == abs(after.counts - before.counts)
    assert abs(after.counts - before.counts) == pytest.approx(5 * 4 * LINES, abs=1)
    assert len(edges[2]) == 2 * 5
    leads = levels["encoder_b"][edges[0] + 1] == levels["encoder_a"][edges[0] + 1]
    assert leads.all() if speed < 0 else not leads.any(), "A leads on the way up"
    assert numpy.diff(edges[2][::2]) == pytest.approx(200_000, abs=2)  # cycles of a turn


def test_an_encoder_that_is_cut_reads_ones():
    machine = spindle()
    with machine.fault("encoder_cut"):
        machine.run(0.5)
        assert all(machine.level(f"encoder_{name}") for name in "abz")
    with pytest.raises(KeyError):
        machine.set(no_such_parameter=1.0)
