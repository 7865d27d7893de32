# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/correction_settings.sv: step() advances one cycle and returns (axis,
Settings) that are loaded after it, or None.
"""

from tb.interpolate.signal_correction import Settings


class CorrectionSettings:
    def __init__(self, axes):
        self.axes = axes
        self.reset()

    def reset(self):
        self.written = [Settings()] * self.axes

    def step(self, axis, written=None, load=0, rst=0):
        """`written` has the values of Settings, by name, that are written for the axis."""
        loaded = (axis, self.written[axis]) if load else None
        self.written[axis] = self.written[axis]._replace(**(written or {}))
        if rst:
            self.reset()
            return None
        return loaded
