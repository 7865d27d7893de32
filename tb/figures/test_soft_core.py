# SPDX-License-Identifier: Apache-2.0
"""The comparison of soft cores: the firmware's work comes to its end on the core of the nodes."""

from figures.soft_core import CORES, SECTIONS, work_of
from firmware.build import MEMORY_BYTES


def test_each_section_of_the_work_comes_to_its_end():
    size, cycles = work_of(CORES["soft_core, rv32imc"])
    assert 0 < size < MEMORY_BYTES
    assert tuple(cycles) == SECTIONS and min(cycles.values()) > 0
