# SPDX-License-Identifier: Apache-2.0
"""Faults of every cause, injected into an axis with its motion engine in random cycles: the drive
goes off in time, and cause and position are reported. A servo overrun is a tick that comes before
the engine has served the last one; a sample overrun is a sample that waits in the shared
interpolation chain when the next one of its axis comes.
"""

from figures import interlock
from moire.made.bus_tables import FAULTS
from tb.bench import seed


def test_every_cause_switches_the_drive_off_and_is_reported():
    totals = interlock.axis_faults(120, seed())
    assert totals["failures"] == 0, totals
    assert totals["faults"] == 120
    assert all(totals[name] > 0 for name, _ in FAULTS.values()), totals
