# SPDX-License-Identifier: Apache-2.0
"""S1 without its whole relay: the ring is the paper's, readings show its error, and the Verilated
correction of the relay takes off what was fitted.
"""

import numpy as np
import pytest

from experiments import s1_ring
from tb.bench import seed
from tb.compensate import harmonic_map

ANGLES = np.arange(0, 360, 0.5) + 0.17


def test_a_ring_has_both_numbers_of_the_paper():
    for number in (1, 2, 3):
        ring = s1_ring.paper_ring(number)
        assert np.abs(s1_ring.error_of(ring, ANGLES)).max() == pytest.approx(
            s1_ring.PAPER_PEAK, rel=0.002
        )
        assert np.abs(s1_ring.error_of(ring, ANGLES, s1_ring.HIGH_ORDERS)).max() == pytest.approx(
            s1_ring.PAPER_RESIDUAL, rel=0.01
        )


def test_readings_are_the_error_at_the_angle_that_the_encoder_shows():
    ring = s1_ring.paper_ring(1, ring_drift=0.0, ring_line_error=0.0)
    readings = s1_ring.measure(
        ring, s1_ring.TEN_DEGREES, np.random.default_rng(seed()), scatter=0.0
    )
    true = s1_ring.true_angle(ring, s1_ring.TEN_DEGREES)
    assert np.allclose(readings.error, s1_ring.error_of(ring, true), atol=0.11)  # half a count


def test_what_the_relay_takes_off_is_what_was_fitted():
    ring = s1_ring.paper_ring(1, ring_drift=0.0)
    found = s1_ring.ours(s1_ring.measure(ring, s1_ring.TEN_DEGREES, np.random.default_rng(seed())))
    turn = ring.counts_per_turn
    counts = np.arange(0, turn, turn // 97)
    taken = s1_ring.corrections_of(s1_ring.set_of(found, turn), counts) * 1_296_000 / turn
    assert np.allclose(taken, found.at(counts * 360 / turn), atol=0.002)


def test_the_verilated_correction_is_the_models():
    ring = s1_ring.paper_ring(2, ring_drift=0.0)
    found = s1_ring.ours(s1_ring.measure(ring, s1_ring.TEN_DEGREES, np.random.default_rng(seed())))
    whole = s1_ring.set_of(found, ring.counts_per_turn)
    words = [int(word) for word in np.frombuffer(whole, "<u4")]
    terms = [(harmonic_map.signed(words[n], 32), words[n + 1]) for n in range(6, len(words) - 1, 2)]
    step = words[2] | (words[3] & 0xFFFF) << 32
    counts = [0, 1, 5000, ring.counts_per_turn // 2, ring.counts_per_turn - 1]
    right = []
    for count in counts:
        angle = (count * step >> 16) % 2**32
        total, _ = harmonic_map.summed(terms, angle, words[4], harmonic_map.STEPS)
        right.append((total + 128 >> 8) / 65536)
    assert list(s1_ring.corrections_of(whole, counts)) == right


def test_our_fit_leaves_less_than_the_papers():
    ring, source = s1_ring.paper_ring(1, ring_drift=0.0), np.random.default_rng(seed())
    readings = s1_ring.measure(ring, s1_ring.TEN_DEGREES, source)
    places = s1_ring.off_grid(source, 90)
    plain, better = (
        s1_ring.left_by_map(ring, way(readings), places)
        for way in (s1_ring.as_in_the_paper, s1_ring.ours)
    )
    assert better < plain < s1_ring.PAPER_AFTER


@pytest.mark.parametrize("places", [8, 40])
def test_the_harmonics_of_few_angles_are_drawn_too(places):
    angles = s1_ring.off_grid(np.random.default_rng(1), places)
    before = 100 * np.sin(np.radians(angles))
    assert s1_ring.bars(angles, before, []).startswith(b"\x89PNG")
