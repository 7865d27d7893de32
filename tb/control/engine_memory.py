# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_memory.sv: clk(...) advances one cycle and returns what was read."""

from tables.microcode.numbers import ADDRESS, CONSTANTS


class EngineMemory:
    def __init__(self, axes, word_w):
        self.words = [0] * (axes << word_w)
        for n in range(axes):
            for name, value in CONSTANTS.items():
                self.words[(n << word_w) + ADDRESS[name]] = value

    def clk(self, read_at=0, write=0, write_at=0, word=0):
        stored = self.words[read_at]
        if write:
            self.words[write_at] = word
        return stored
