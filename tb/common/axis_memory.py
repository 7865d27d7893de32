# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/common/axis_memory.sv: read(axis) is combinational, step() advances one cycle."""


class AxisMemory:
    def __init__(self, axes):
        self.words = [None] * axes  # None: never written

    def read(self, axis):
        return self.words[axis]

    def step(self, write, axis, value):
        if write:
            self.words[axis] = value
