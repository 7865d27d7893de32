# SPDX-License-Identifier: Apache-2.0
"""The circular grating of S1 with its read head: from true angles (rad) to measured angles and to
the levels of A, B and Z.
"""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy
import numpy.typing

from twin import build
from twin.machines.machine import HANDLE, Functions, declare
from twin.parameters import tables as parameters

ARC_SECOND = numpy.pi / 180 / 3600
Angles = numpy.typing.ArrayLike
Reals = numpy.typing.NDArray[numpy.float64]

FUNCTIONS: Functions = {
    "ring_new": (HANDLE, [HANDLE, ctypes.c_uint64]),
    "ring_delete": (None, [HANDLE]),
    "ring_orders": (None, [HANDLE] * 3),
    "ring_measured": (None, [HANDLE, ctypes.c_int64, HANDLE, HANDLE, HANDLE]),
    "ring_levels": (None, [HANDLE, ctypes.c_int64, HANDLE, HANDLE, HANDLE]),
}
ORDERS = 64  # of rotary_ring.h


class RotaryRing:
    """A ring with its errors; each seed makes a different one. measured and levels take arrays of
    angles in rad and, for the drift, of times in s.
    """

    def __init__(self, seed: int = 1, **values: float) -> None:
        self.handle: int | None = None
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

    def __del__(self) -> None:
        if self.handle:
            self.library.ring_delete(self.handle)
        self.handle = None

    def orders(self) -> tuple[Reals, Reals]:
        """Amplitudes and phases in rad from order 0: error = Σ amplitude sin(k angle + phase)."""
        amplitude, phase = numpy.zeros(ORDERS + 1), numpy.zeros(ORDERS + 1)
        self.library.ring_orders(self.handle, amplitude.ctypes.data, phase.ctypes.data)
        return amplitude, phase

    def measured(self, angle: Angles, time_s: Angles = 0.0) -> Any:
        """The angle in rad that the ring indicates, over any number of turns."""
        return self._each(self.library.ring_measured, angle, time_s, numpy.float64)

    def levels(self, angle: Angles, time_s: Angles = 0.0) -> Any:
        """The pins of the read head at these angles: A in bit 0, B in bit 1, Z in bit 2."""
        return self._each(self.library.ring_levels, angle, time_s, numpy.uint8)

    def _each(
        self, function: Callable[..., None], angle: Angles, time_s: Angles, dtype: type[Any]
    ) -> Any:
        angles, times = (
            numpy.ascontiguousarray(x, numpy.float64) for x in numpy.broadcast_arrays(angle, time_s)
        )
        out = numpy.empty(angles.shape, dtype=dtype)
        function(self.handle, angles.size, angles.ctypes.data, times.ctypes.data, out.ctypes.data)
        return out
