# SPDX-License-Identifier: Apache-2.0
"""The firmware's calibration (sw/firmware/calibration), compiled for this computer."""

import ctypes
from collections.abc import Sequence
from ctypes import c_bool, c_int16, c_int32, c_int64, c_uint8, c_uint16, c_uint32
from functools import cache
from typing import Any

from twin.build import FIRMWARE
from twin.compiled.host_library import host_library

# The constants of calibration_types.h and calibration_values.h.
ORDERS, POINTS, BURST, PHASES_OF_BURST, PASS = 10, 256, 1024, 2048, 39
PERIODS, LINES, WORDS_AT_ONCE = 15, 128, 4
NOTHING, SAMPLES, PHASES, WORDS, WORK, LOADING = range(6)
FROZEN, CALIBRATES, FOLLOWS = range(3)
MODULES = [
    FIRMWARE / "calibration" / f"{name}.c"
    for name in (
        "calibration",
        "calibration_values",
        "ellipse",
        "equations",
        "harmonics",
        "spectrum",
        "waves",
    )
]


class Values(ctypes.Structure):
    """struct calibration_values: offsets in 2^-15 of full scale, gain and quadrature error in
    2^-16, harmonics and shift in 2^-24 period.
    """

    _fields_ = [
        ("sin_offset", c_int16),
        ("cos_offset", c_int16),
        ("gain", c_int32),
        ("quadrature_error", c_int32),
        ("cosine", c_int32 * ORDERS),
        ("sine", c_int32 * ORDERS),
        ("shift", c_int32),
    ]

    def as_dict(self) -> dict[str, Any]:
        """Numbers by the names of the fields; the harmonics as tuples."""
        return dict(
            sin_offset=self.sin_offset,
            cos_offset=self.cos_offset,
            gain=self.gain,
            quadrature_error=self.quadrature_error,
            cosine=tuple(self.cosine),
            sine=tuple(self.sine),
            shift=self.shift,
        )


class Ellipse(ctypes.Structure):
    """struct calibration_ellipse."""

    _fields_ = [
        ("count", c_uint16),
        ("outside", c_uint16),
        ("sector", c_uint16 * 16),
        ("lowest", c_int16 * 2),
        ("highest", c_int16 * 2),
        ("sum", c_int64 * 20),
    ]


class Pass(ctypes.Structure):
    """struct calibration_pass."""

    _fields_ = [
        ("slowest", c_uint32),
        ("fastest", c_uint32),
        ("every", c_uint16),
        ("bursts", c_uint16),
        ("spectra", c_uint8),
        ("line", c_uint8 * LINES),
        ("information", c_int32 * ORDERS),
        ("cosine", c_int64 * ORDERS),
        ("sine", c_int64 * ORDERS),
        ("squares", c_int64),
    ]


class Sums(ctypes.Union):
    """The union of both in struct calibration."""

    _fields_ = [("ellipse", Ellipse), ("pass_", Pass)]


class Calibration(ctypes.Structure):
    """struct calibration."""

    _anonymous_ = ("sums",)
    _fields_ = [
        ("values", Values),
        ("amplitude_low", c_uint16),
        ("amplitude_high", c_uint16),
        ("scatter_limit", c_uint16),
        ("reason", c_uint8),
        ("need", c_uint8),
        ("mode", c_uint8),
        ("harmonics", c_bool),
        ("complete", c_bool),
        ("referenced", c_bool),
        ("beside", c_int32 * 4),
        ("refused", c_uint32),
        ("accepted", c_uint32),
        ("scatter", c_uint32),
        ("sums", Sums),
    ]


@cache
def library() -> ctypes.CDLL:
    """The compiled calibration; its work area is one for all Calibration objects."""
    loaded = host_library("calibration", [*MODULES, FIRMWARE / "core" / "arithmetic.c"])
    loaded.calibration_restore.restype = c_bool
    loaded.calibration_values_fit.restype = c_bool
    loaded.calibration_open.restype = c_bool
    loaded.harmonics_table_entry.restype = c_int32
    return loaded


class CalibrationRun:
    """A calibration whose needs are served: its work is done, its values are loaded."""

    def __init__(self) -> None:
        self.calibration = Calibration()
        self.loads = 0  # how often values were put into force
        self.table: list[int] = []  # of harmonic_correction, 2^-20 period
        self.call("start")

    def call(self, name: str, *arguments: Any) -> Any:
        """Calls calibration_NAME with this calibration and the arguments."""
        function = getattr(library(), f"calibration_{name}")
        return function(ctypes.byref(self.calibration), *arguments)

    @property
    def values(self) -> dict[str, Any]:
        """The values in force, as Values.as_dict."""
        values: Values = self.calibration.values
        return values.as_dict()

    def idle(self) -> int:
        """Do all work and load all values; returns what the calibration needs now."""
        while self.calibration.need in (WORK, LOADING):
            if self.calibration.need == LOADING:
                values = ctypes.byref(self.calibration.values)
                self.table = [
                    library().harmonics_table_entry(values, point) for point in range(POINTS)
                ]
                self.loads += 1
                self.call("loaded")
            else:
                self.call("work")
        return int(self.calibration.need)

    def burst(self, words: Sequence[int], spoiled: bool = False, every: int = 1) -> int:
        """Give the words of a burst as often as they are required, and do all work; returns the
        reason, a bus_calibration_reason. `every` is the decimation of the recorder, and `spoiled`
        says that the amplitude left its window.
        """
        self.call("open", c_uint16(every), spoiled)
        take, calibration = library().calibration_take, ctypes.byref(self.calibration)
        given = (c_uint32 * len(words))(*words)
        phases = self.calibration.harmonics and self.calibration.mode != FOLLOWS
        at_once = WORDS_AT_ONCE if phases else 1
        while self.idle() == WORDS:
            for n in range(0, len(words), at_once):
                take(calibration, ctypes.byref(given, 4 * n))
        return int(self.calibration.reason)

    def phases(self, phases: Sequence[int], spoiled: bool = False, every: int = 1) -> int:
        """The same from single phases, 2^-16 period: calibration_recorder packs two into a word."""
        pairs = zip(phases[::2], phases[1::2], strict=True)
        return self.burst([later << 16 | earlier for earlier, later in pairs], spoiled, every)
