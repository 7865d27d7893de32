# SPDX-License-Identifier: Apache-2.0
"""The stage without a node, with what only it has: for tests of the plant against theory, and for
tuning.
"""

import ctypes

import numpy

from twin.machines.machine import HANDLE, REAL, WHOLE, Machine, declare
from twin.parameters import tables as parameters

FUNCTIONS = {
    "stage_hold": (None, [HANDLE, WHOLE, WHOLE]),
    "stage_analogue": (None, [HANDLE, REAL, HANDLE]),
    "stage_convert": (None, [HANDLE, REAL, HANDLE]),
    "stage_frame": (None, [HANDLE, REAL, WHOLE, HANDLE]),
    "stage_levels": (None, [HANDLE, ctypes.c_uint64, REAL, REAL, HANDLE]),
    "friction_slide": (REAL, [REAL] * 8 + [WHOLE]),
}


class Stage(Machine):
    def __init__(self, seed=1, clk_hz=4_000_000, **plant):
        super().__init__("stage", seed, clk_hz, **plant)
        declare(self.library, FUNCTIONS)
        self.plant = parameters.values(plant)

    def hold(self, rotor=False, table=False):
        self.library.stage_hold(self.bench, rotor, table)

    def analogue(self, position_m):
        """Sine and cosine of full scale, without noise."""
        out = (ctypes.c_double * 2)()
        self.library.stage_analogue(self.bench, position_m, out)
        return tuple(out)

    def convert(self, position_m):
        """One conversion: codes of sine and cosine."""
        out = (ctypes.c_uint32 * 2)()
        self.library.stage_convert(self.bench, position_m, out)
        return tuple(out)

    def frame(self, position_m, edges):
        """What the two data lines show at each falling edge of sclk: [(sine bit, cosine bit)]."""
        out = (ctypes.c_uint8 * edges)()
        self.library.stage_frame(self.bench, position_m, edges, out)
        return [(bits & 1, bits >> 1) for bits in out]

    def levels(self, seconds, from_m, speed_m_s):
        """A and B at each clk, of a table that moves evenly."""
        out = numpy.zeros(self.clk(seconds), dtype=numpy.uint8)
        self.library.stage_levels(self.bench, len(out), from_m, speed_m_s, out.ctypes.data)
        return out & 1, out >> 1

    def friction(
        self, coulomb, breakaway, stribeck, viscous, presliding, damping, speed, steps=20000
    ):
        """Friction force of a body that slides evenly."""
        return self.library.friction_slide(
            coulomb,
            breakaway,
            stribeck,
            viscous,
            presliding,
            damping,
            speed,
            self.plant["time_step"],
            steps,
        )
