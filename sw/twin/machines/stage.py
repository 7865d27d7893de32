# SPDX-License-Identifier: Apache-2.0
"""The stage without a node, with what only a stage has: for tests of the plant against theory, and
for tuning.
"""

import ctypes

import numpy
import numpy.typing

from twin.machines.machine import HANDLE, REAL, WHOLE, Functions, Machine, declare
from twin.parameters import tables as parameters

FUNCTIONS: Functions = {
    "stage_hold": (None, [HANDLE, WHOLE, WHOLE]),
    "stage_analogue": (None, [HANDLE, REAL, REAL, REAL, HANDLE]),
    "stage_convert": (None, [HANDLE, REAL, REAL, REAL, HANDLE]),
    "stage_frame": (None, [HANDLE, REAL, WHOLE, HANDLE]),
    "stage_levels": (None, [HANDLE, ctypes.c_uint64, REAL, REAL, HANDLE]),
    "friction_slide": (REAL, [REAL] * 8 + [WHOLE]),
}


class Stage(Machine):
    """The stage of S0; `plant` overrides parameters of stage.toml."""

    def __init__(self, seed: int = 1, clk_hz: int = 4_000_000, **plant: float) -> None:
        super().__init__("stage", seed, clk_hz, **plant)
        declare(self.library, FUNCTIONS)
        self.plant = parameters.values(plant)

    def hold(self, rotor: bool = False, table: bool = False) -> None:
        """Clamp the rotor or the table."""
        self.library.stage_hold(self.bench, rotor, table)

    def analogue(
        self, position_m: float, velocity_m_s: float = 0.0, seconds: float = 0.0
    ) -> tuple[float, ...]:
        """Sine and cosine as fractions of full scale, without noise, so long after power-up."""
        out = (ctypes.c_double * 2)()
        self.library.stage_analogue(self.bench, position_m, velocity_m_s, seconds, out)
        return tuple(out)

    def convert(
        self, position_m: float, velocity_m_s: float = 0.0, seconds: float = 0.0
    ) -> tuple[int, ...]:
        """One conversion so long after power-up: codes of sine and cosine."""
        out = (ctypes.c_uint32 * 2)()
        self.library.stage_convert(self.bench, position_m, velocity_m_s, seconds, out)
        return tuple(out)

    def frame(self, position_m: float, edges: int) -> list[tuple[int, int]]:
        """The two data lines at each falling edge of sclk: [(sine bit, cosine bit)]."""
        out = (ctypes.c_uint8 * edges)()
        self.library.stage_frame(self.bench, position_m, edges, out)
        return [(bits & 1, bits >> 1) for bits in out]

    def levels(
        self, seconds: float, from_m: float, speed_m_s: float
    ) -> tuple[numpy.typing.NDArray[numpy.uint8], numpy.typing.NDArray[numpy.uint8]]:
        """A and B in each cycle, of a table with constant speed."""
        out = numpy.zeros(self.clk(seconds), dtype=numpy.uint8)
        self.library.stage_levels(self.bench, len(out), from_m, speed_m_s, out.ctypes.data)
        return (out & 1).astype(numpy.uint8), (out >> 1).astype(numpy.uint8)

    def friction(
        self,
        coulomb: float,
        breakaway: float,
        stribeck: float,
        viscous: float,
        presliding: float,
        damping: float,
        speed: float,
        steps: int = 20000,
    ) -> float:
        """Friction force of a body that slides at constant speed."""
        return float(
            self.library.friction_slide(
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
        )
