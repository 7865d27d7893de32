# SPDX-License-Identifier: Apache-2.0
"""The circular grating of S1 with its read head: from true angles (rad) to measured ones and to the
levels of A, B and Z.
"""

import ctypes

import numpy

from twin import build
from twin.machines.machine import HANDLE, declare
from twin.parameters import tables as parameters

ARC_SECOND = numpy.pi / 180 / 3600
FUNCTIONS = {
    "ring_new": (HANDLE, [HANDLE, ctypes.c_uint64]),
    "ring_delete": (None, [HANDLE]),
    "ring_orders": (None, [HANDLE] * 3),
    "ring_measured": (None, [HANDLE, ctypes.c_int64, HANDLE, HANDLE, HANDLE]),
    "ring_levels": (None, [HANDLE, ctypes.c_int64, HANDLE, HANDLE, HANDLE]),
}
ORDERS = 64  # of rotary_ring.h


class RotaryRing:
    """Each seed is another ring. measured and levels take arrays of angles and, for the drift, of
    times.
    """

    def __init__(self, seed=1, **values):
        self.handle = None
        self.library, self.parameters = (
            ctypes.CDLL(str(build.machine_library())),
            parameters.values(values, "rotary_ring"),
        )
        declare(self.library, FUNCTIONS)
        packed = (ctypes.c_double * len(self.parameters))(*self.parameters.values())
        self.handle = self.library.ring_new(ctypes.addressof(packed), seed)
        self.counts_per_turn = round(
            4 * self.parameters["ring_lines"] * self.parameters["ring_subdivision"]
        )

    def __del__(self):
        if self.handle:
            self.library.ring_delete(self.handle)
        self.handle = None

    def orders(self):
        """Amplitude and phase in rad, from order 0: error = sum of amplitude sin(k angle + phase)."""
        amplitude, phase = numpy.zeros(ORDERS + 1), numpy.zeros(ORDERS + 1)
        self.library.ring_orders(self.handle, amplitude.ctypes.data, phase.ctypes.data)
        return amplitude, phase

    def measured(self, angle, time_s=0.0):
        """rad; goes on over full turns."""
        return self._each(self.library.ring_measured, angle, time_s, numpy.float64)

    def levels(self, angle, time_s=0.0):
        """a in bit 0, b in bit 1, z in bit 2: the pins of a read head at these angles."""
        return self._each(self.library.ring_levels, angle, time_s, numpy.uint8)

    def _each(self, function, angle, time_s, dtype):
        angle, time_s = (
            numpy.ascontiguousarray(x, numpy.float64) for x in numpy.broadcast_arrays(angle, time_s)
        )
        out = numpy.empty(angle.shape, dtype=dtype)
        function(self.handle, angle.size, angle.ctypes.data, time_s.ctypes.data, out.ctypes.data)
        return out
