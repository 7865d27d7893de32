# SPDX-License-Identifier: Apache-2.0
"""One stage without a node: for tests of the plant against theory, and for tuning."""
import ctypes
from dataclasses import dataclass

import numpy

from . import build, parameters

FAULTS = {"none": 0, "cable_cut": 1, "a_stuck": 2, "b_stuck": 3, "converter_stuck": 4}


@dataclass(frozen=True)
class StageState:
    time_s: float
    position_m: float
    velocity_m_s: float
    nut_m: float                 # where the nut is, from the motor's angle
    motor_rad_s: float
    current_a: float
    voltage_v: float             # mean of the last plant step
    screw_n: float               # on the table
    limit_low: bool              # pressed
    limit_high: bool
    a: bool
    b: bool


def pack(overrides):
    """The plant's parameters as the C++ structure."""
    values = list(parameters.values(overrides).values())
    return (ctypes.c_double * len(values))(*values)


def declare(library, functions):
    """functions: {name: (result, [arguments])}"""
    for name, (result, arguments) in functions.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments


class Stage:
    PERIOD = 200                 # clk of the PWM: 20 kHz

    def __init__(self, seed=1, clk_hz=4_000_000, **plant):
        void, real, whole, handle = None, ctypes.c_double, ctypes.c_int, ctypes.c_void_p
        self.library, self.clk_hz = ctypes.CDLL(str(build.stage_library())), clk_hz
        declare(self.library, {
            "stage_new": (handle, [ctypes.c_uint64, real, handle]), "stage_delete": (void, [handle]),
            "stage_set": (whole, [handle, ctypes.c_char_p, real]), "stage_place": (void, [handle, real]),
            "stage_push": (void, [handle, real]), "stage_hold": (void, [handle, whole, whole]),
            "stage_drive": (void, [handle, ctypes.c_uint64, ctypes.c_uint32, ctypes.c_int32, whole]),
            "stage_state": (void, [handle, handle]), "stage_analogue": (void, [handle, real, handle]),
            "stage_convert": (void, [handle, real, handle]), "stage_frame": (void, [handle, real, whole, handle]),
            "stage_fault": (void, [handle, whole, whole]), "stage_levels": (void, [handle, ctypes.c_uint64, real, real, handle]),
            "friction_slide": (real, [real] * 8 + [whole]), "parameter_count": (whole, [])})
        self.plant = parameters.values(plant)
        self.handle = self.library.stage_new(seed, clk_hz, ctypes.addressof(packed := pack(plant)))
        assert self.library.parameter_count() == len(packed)

    def __del__(self):
        if getattr(self, "handle", None):
            self.library.stage_delete(self.handle)
            self.handle = None

    def set(self, **plant):
        for name, value in plant.items():
            if not self.library.stage_set(self.handle, name.encode(), value):
                raise KeyError(f"the plant has no parameter {name}")
            self.plant[name] = value

    def place(self, position_m):
        """At rest here, nothing wound up."""
        self.library.stage_place(self.handle, position_m)

    def push(self, newton):
        """An outside force on the table, from now on."""
        self.library.stage_push(self.handle, newton)

    def hold(self, rotor=False, table=False):
        self.library.stage_hold(self.handle, rotor, table)

    def drive(self, seconds, duty=0.0, brakes=True):
        """Run; duty -1..1 of the supply, the rest of the PWM period braking or coasting."""
        self.library.stage_drive(self.handle, round(seconds * self.clk_hz), self.PERIOD, round(duty * self.PERIOD), brakes)

    @property
    def state(self):
        out = (ctypes.c_double * 12)()
        self.library.stage_state(self.handle, out)
        return StageState(*out[:8], *(bool(x) for x in out[8:]))

    def analogue(self, position_m):
        """Sine and cosine of full scale, without noise."""
        out = (ctypes.c_double * 2)()
        self.library.stage_analogue(self.handle, position_m, out)
        return tuple(out)

    def convert(self, position_m):
        """One conversion: codes of sine and cosine."""
        out = (ctypes.c_uint32 * 2)()
        self.library.stage_convert(self.handle, position_m, out)
        return tuple(out)

    def frame(self, position_m, edges):
        """What the two data lines show at each falling edge of sclk: [(sine bit, cosine bit)]."""
        out = (ctypes.c_uint8 * edges)()
        self.library.stage_frame(self.handle, position_m, edges, out)
        return [(bits & 1, bits >> 1) for bits in out]

    def fault(self, name, level=False):
        self.library.stage_fault(self.handle, FAULTS[name], level)

    def levels(self, seconds, from_m, speed_m_s):
        """A and B at each clk, of a table that moves evenly."""
        out = numpy.zeros(round(seconds * self.clk_hz), dtype=numpy.uint8)
        self.library.stage_levels(self.handle, len(out), from_m, speed_m_s, out.ctypes.data)
        return out & 1, out >> 1

    def friction(self, coulomb, breakaway, stribeck, viscous, presliding, damping, speed, steps=20000):
        """Friction force of a body that slides evenly."""
        return self.library.friction_slide(coulomb, breakaway, stribeck, viscous, presliding, damping, speed,
                                           self.plant["time_step"], steps)
