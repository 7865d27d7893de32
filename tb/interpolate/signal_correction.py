# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/signal_correction.sv: corrected(sin, cos, ...) computes one sample,
SignalCorrection.step() advances one cycle.
"""

from typing import NamedTuple

LATENCY = 3


class Settings(NamedTuple):
    sin_offset: int = 0  # full scale 2^15
    cos_offset: int = 0
    gain: int = 1 << 16  # 1.0 = 2^16
    quadrature_error: int = 0


def held(channel):
    return max(-32768, min(32767, channel))


def corrected(sin, cos, settings, w=8):
    """Returns (sin_out, cos_out) of a sample of w bits."""
    sin_channel, cos_channel = (
        (sin << 16 - w) - settings.sin_offset,
        (cos << 16 - w) - settings.cos_offset,
    )
    return held(
        sin_channel * settings.gain + cos_channel * settings.quadrature_error + 65536 >> 17
    ), held(cos_channel + 1 >> 1)


class SignalCorrection:
    """step() returns (done, sin_out, cos_out) after the cycle."""

    def __init__(self, w=8, axes=1):
        self.w, self.axes = w, axes
        self.reset()

    def reset(self):
        self.settings = [Settings()] * self.axes
        self.flow, self.out = [None] * (LATENCY - 1), (0, 0)

    def step(self, valid, sin, cos, load=None, rst=0, axis=0, load_axis=0):
        """`load` is None or the Settings to load."""
        if rst:
            self.reset()
            return 0, 0, 0
        self.flow.append(corrected(sin, cos, self.settings[axis], self.w) if valid else None)
        if load:
            self.settings[load_axis] = load
        ready = self.flow.pop(0)
        self.out = ready or self.out
        return int(ready is not None), *self.out
