# SPDX-License-Identifier: Apache-2.0
"""What figures and `make board` take from the reports of nextpnr."""

import pytest

from figures.synthesis import SynthesisError, fmax_of

NODE = {"achieved": 60.1, "constraint": 50.0}
SLOW = {"achieved": 58.0, "constraint": 50.2}  # a PLL makes it a little faster
PHY = "$glbnet$eth_rx_clk$TRELLIS_IO_IN"


def test_the_slowest_clock_counts():
    assert fmax_of({"$glbnet$clk": NODE, "other": SLOW}, 50) == 58.0


def test_no_clock_no_frequency():
    assert fmax_of({}, 50) == 0.0


def test_a_clock_with_its_own_constraint_that_reaches_it_does_not_count():
    assert fmax_of({"clk": NODE, PHY: {"achieved": 26.0, "constraint": 25.0}}, 50) == 60.1
    assert fmax_of({PHY: {"achieved": 126.0, "constraint": 125.0}}, 50) == 126.0


def test_a_clock_with_its_own_constraint_must_reach_it():
    words = "^the clock eth_rx_clk reaches 106.7 MHz and needs 125: another SEED"
    with pytest.raises(SynthesisError, match=words):
        fmax_of({"clk": NODE, PHY: {"achieved": 106.68, "constraint": 125.0}}, 50)
