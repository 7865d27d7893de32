# SPDX-License-Identifier: Apache-2.0
"""The port of the numeric display in a bench of its own, with a clock that is divided."""

from mutation.library import Bench, library

TOP = "display_port"
CLK_HZ = 8_000_000
PARAMETERS = {"CLK_HZ": CLK_HZ}


class DisplayPort(Bench):
    """The port after its reset."""

    def __init__(self, path=None, mutant=(0, 0, 0)):
        super().__init__(path or library(TOP, PARAMETERS), mutant)
        self.set(rst=1)
        self.run(4)
        self.set(rst=0)
        self.run(10)

    def push(self, word):
        """Queue a word."""
        self.set(push=1, word=word)
        self.run(1)
        self.set(push=0, word=0)
