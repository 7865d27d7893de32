# SPDX-License-Identifier: Apache-2.0
"""One simulated second of a node at the slow clock of the twin. The same second at the clock of the
boards is the short form of the figure full_clock_um, which `make check` measures.
"""

from experiments.full_clock import one_second
from figures.full_clock import LEAST_MOVES
from tb.bench import seed
from twin.nodes.twin import CLK_HZ

BOUND_NM = 50.0  # of the true distance of a move, as in figures/full_clock.py


def test_a_second_at_the_slow_clock_has_the_moves_of_the_full_clock():
    print(f"SEED={seed()}")
    errors = one_second(CLK_HZ, seed())
    print(", ".join(f"{error:+.1f} nm" for error in errors))
    assert len(errors) >= LEAST_MOVES
    assert all(abs(error) < BOUND_NM for error in errors)
