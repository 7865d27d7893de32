# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/common/axis_setting.sv: read(axis) is combinational, step() advances one cycle."""


class AxisSetting:
    def __init__(self, axes, initial):
        self.axes, self.initial = axes, initial
        self.settings = [initial] * axes

    def read(self, axis):
        return self.settings[axis]

    def step(self, write, axis, value, rst=0):
        if write:
            self.settings[axis] = value
        if rst:
            self.settings = [self.initial] * self.axes
