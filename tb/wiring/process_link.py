# SPDX-License-Identifier: Apache-2.0
"""The real-time link in a bench."""

from mutation.library import Bench, library
from tb.link import test_process_link

TOP = "process_link"
PARAMETERS = {"CLK_HZ": test_process_link.CLK_HZ, "PLL": 1}


class ProcessLink(Bench):
    """The link, before its reset."""

    parameters = PARAMETERS

    def __init__(self, path=None, mutant=(0, 0, 0)):
        super().__init__(path or library(TOP, PARAMETERS), mutant)
