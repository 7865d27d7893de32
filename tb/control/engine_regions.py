# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_regions.sv: region_of(line)."""

from tables.microcode.assembler import assembled
from tables.microcode.timing import REGIONS, regions

FOUND = [REGIONS.index(name) for name in regions(assembled())]


def region_of(line):
    """The number of the region; lines after the last one are idle."""
    return FOUND[line] if line < len(FOUND) else 0
