# SPDX-License-Identifier: Apache-2.0
"""The readout: the position of axis 0 in mm on eight digits."""

from fractions import Fraction

import pytest

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.peripherals import NumericDisplay, PeripheralParts
from twin.compiled.tables import PARAMETER, PERIOD, TABLE

SETTING = TABLE["setting"]


class Station(CompiledNode):
    def __init__(self, position=0):
        self.display = NumericDisplay()
        super().__init__(Axis(position), image="station", peripherals=PeripheralParts(self.display))

    def shown(self, decimals):
        self.ask("set_setting", setting=SETTING["readout_decimals"]["id"], value=decimals)
        self.run(110)
        return self.display.text()


@pytest.mark.parametrize(
    ("periods", "decimals", "text"),
    [
        (0, 5, "0.00000"),
        (0, 0, "0"),
        (1, 6, "0.000800"),
        (1, 5, "0.00080"),
        (-1, 5, "-0.00080"),
        (-1, 3, "-0.001"),
        (-1, 2, "0.00"),
        (156_250, 5, "125.00000"),
        (-156_250, 4, "-125.0000"),
        (-12_500, 6, "--------"),
        (-12_499, 6, "-9.999200"),
        (15_432, 5, "12.34560"),
        (15_432, 0, "12"),
        (124_999_999, 2, "100000.00"),
        (124_999_999, 3, "99999.999"),
        (124_999_999, 4, "--------"),
        (-12_500_000, 3, "--------"),
        (-12_499_999, 3, "-9999.999"),
    ],
)
def test_the_position_is_shown_in_mm_with_the_decimals_that_are_set(periods, decimals, text):
    millimetres = Fraction(periods * 800, 10**6)  # of the default period
    if "--" not in text:
        assert abs(Fraction(text) - millimetres) <= Fraction(1, 2 * 10**decimals)
    assert Station(periods * PERIOD).shown(decimals) == text


def test_parts_of_a_period_are_shown():
    station = Station(PERIOD // 4)
    assert station.shown(6) == "0.000200"
    station.set(period=4_000_000)
    assert station.shown(6) == "0.001000"


def test_the_display_is_refreshed_ten_times_a_second_with_its_set_up():
    station = Station()
    station.run(1000)
    assert station.display.written == 10 * 13
    station.display.registers.clear()  # it lost its power
    assert station.shown(2) == "0.00"


def test_the_largest_position_and_period_do_not_overflow():
    station = Station((2**31 - 1) * PERIOD)
    station.set(period=PARAMETER["period"]["max"])
    assert station.shown(0) == "--------"
