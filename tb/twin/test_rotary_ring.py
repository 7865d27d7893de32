# SPDX-License-Identifier: Apache-2.0
"""The ring of S1: its errors, its drift, its edges."""

import numpy
import pytest

from twin import RotaryRing
from twin.machines.ring import ARC_SECOND

TURN = 2 * numpy.pi
ANGLES = numpy.arange(36_000) / 36_000 * TURN


def error(ring):
    """The error over a turn in arcsec, without the drift."""
    return (
        ring.measured(ANGLES) - ring.measured(ANGLES[0]) + ring.measured(0.0) - ANGLES
    ) / ARC_SECOND


def test_the_peak_is_that_of_the_paper_for_every_ring():
    for seed in range(10):
        ring = RotaryRing(seed, ring_drift=0, ring_line_error=0)
        assert abs(error(ring)).max() == pytest.approx(134.59, rel=1e-4)


def test_the_error_is_the_sum_of_its_orders():
    ring = RotaryRing(3, ring_drift=0, ring_line_error=0)
    amplitude, phase = ring.orders()
    expected = (
        sum(amplitude[k] * numpy.sin(k * ANGLES + phase[k]) for k in range(1, 17)) / ARC_SECOND
    )
    assert abs(error(ring) - expected).max() < 1e-6
    assert (
        amplitude[0] == 0
        and not amplitude[17:].any()
        and amplitude[1] > amplitude[2] > amplitude[3] > amplitude[4]
    )


def test_three_orders_leave_what_the_paper_found():
    left = []
    for seed in range(40):
        spectrum = numpy.fft.rfft(error(RotaryRing(seed, ring_drift=0)))
        spectrum[:4] = 0
        left.append(abs(numpy.fft.irfft(spectrum, len(ANGLES))).max())
    assert numpy.median(left) == pytest.approx(5.79, abs=0.7)


def test_the_drift_stays_within_two_arcseconds_and_is_slow():
    time = numpy.arange(0, 3600, 0.2)
    for seed in range(5):
        drift = (
            RotaryRing(seed).measured(0.0, time) - RotaryRing(seed, ring_drift=0).measured(0.0)
        ) / ARC_SECOND
        assert 1.5 < abs(drift).max() <= 2.0 and abs(numpy.diff(drift)).max() < 0.05


@pytest.mark.parametrize("subdivision", (1, 4))
def test_a_turn_has_an_edge_a_count_and_one_index(subdivision):
    ring = RotaryRing(1, ring_subdivision=subdivision, ring_drift=0)
    counts = 4 * 8192 * subdivision
    assert ring.counts_per_turn == counts
    angles = numpy.linspace(0.1, 0.1 + TURN, 16 * counts)
    levels = ring.levels(angles)
    for direction in (1, -1):
        a, b, z = (levels[::direction] >> n & 1 for n in range(3))
        steps = (numpy.diff((b << 1 | (a ^ b)).astype(int)) + 1) % 4 - 1
        assert abs(steps).max() == 1 and steps.sum() == pytest.approx(direction * counts, abs=1)
        assert (numpy.diff(z.astype(int)) == 1).sum() == 1


def test_the_index_lies_on_the_measured_scale():
    ring = RotaryRing(2, ring_index_count=1000)
    inside = numpy.linspace(0, TURN / 8, 1_000_000)
    inside = inside[(ring.levels(inside, 17.0) & 4) > 0]
    counts = ring.measured(inside, 17.0) / TURN * ring.counts_per_turn
    assert 1000 <= counts.min() < 1000.1 and 1000.9 < counts.max() <= 1001


def test_a_ring_depends_on_its_seed_only():
    assert (RotaryRing(1).measured(ANGLES) == RotaryRing(1).measured(ANGLES)).all()
    assert (RotaryRing(1).measured(ANGLES) != RotaryRing(2).measured(ANGLES)).any()
