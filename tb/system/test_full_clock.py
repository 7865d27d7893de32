# SPDX-License-Identifier: Apache-2.0
"""A node at the clock of the boards: one simulated second, at 60 MHz and at the slow clock."""

import pytest

from experiments.full_clock import FULL_CLK_HZ, one_second
from tb.bench import seed
from twin.nodes.twin import CLK_HZ

BOUND_NM = 50.0  # of the true distance of a move, as in figures/full_clock.py


@pytest.mark.parametrize("clk_hz", (CLK_HZ, FULL_CLK_HZ))
def test_a_second_at_any_clock_has_the_same_moves(clk_hz):
    print(f"SEED={seed()}")
    errors = one_second(clk_hz, seed())
    print(", ".join(f"{error:+.1f} nm" for error in errors))
    assert len(errors) >= 3
    assert all(abs(error) < BOUND_NM for error in errors)
