# SPDX-License-Identifier: Apache-2.0
"""sw/firmware/calibration/calibration.c on this computer, and the machine around it: recorder,
correction and arctan as integers.
"""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from ctypes import c_bool, c_int16, c_int32, c_int64, c_uint8, c_uint16, c_uint32
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
SOURCE = ROOT / "sw" / "firmware" / "calibration" / "calibration.c"
LIBRARY = ROOT / "build" / "firmware" / "host_calibration.so"
ORDERS, POINTS, BURST, PHASES_OF_BURST, PASS, PERIODS, LINES, WORDS_AT_ONCE = (
    10,
    256,
    1024,
    2048,
    39,
    15,
    128,
    4,
)
NOTHING, SAMPLES, PHASES, WORDS, WORK, LOADING = range(6)


class Values(ctypes.Structure):
    _fields_ = [
        ("sin_offset", c_int16),
        ("cos_offset", c_int16),
        ("gain", c_int32),
        ("quadrature_error", c_int32),
        ("cosine", c_int32 * ORDERS),
        ("sine", c_int32 * ORDERS),
    ]

    def as_dict(self):
        return dict(
            sin_offset=self.sin_offset,
            cos_offset=self.cos_offset,
            gain=self.gain,
            quadrature_error=self.quadrature_error,
            cosine=tuple(self.cosine),
            sine=tuple(self.sine),
        )


class Ellipse(ctypes.Structure):
    _fields_ = [
        ("count", c_uint16),
        ("outside", c_uint16),
        ("sector", c_uint16 * 16),
        ("lowest", c_int16 * 2),
        ("highest", c_int16 * 2),
        ("sum", c_int64 * 20),
    ]


class Pass(ctypes.Structure):
    _fields_ = [
        ("slowest", c_uint32),
        ("fastest", c_uint32),
        ("every", c_uint16),
        ("bursts", c_uint8),
        ("spectra", c_uint8),
        ("line", c_uint8 * LINES),
        ("information", c_int32 * ORDERS),
        ("cosine", c_int32 * ORDERS),
        ("sine", c_int32 * ORDERS),
        ("squares", c_int64),
    ]


class Sums(ctypes.Union):
    _fields_ = [("ellipse", Ellipse), ("pass_", Pass)]


class Calibration(ctypes.Structure):
    _anonymous_ = ("sums",)
    _fields_ = [
        ("values", Values),
        ("amplitude_low", c_uint16),
        ("amplitude_high", c_uint16),
        ("scatter_limit", c_uint16),
        ("reason", c_uint8),
        ("need", c_uint8),
        ("frozen", c_bool),
        ("harmonics", c_bool),
        ("complete", c_bool),
        ("refused", c_uint32),
        ("accepted", c_uint32),
        ("scatter", c_uint32),
        ("sums", Sums),
    ]


@cache
def library():
    """Compile if the source is newer; gcc or clang of the system, else zig."""
    sources = [SOURCE, SOURCE.with_suffix(".h")]
    if not LIBRARY.exists() or LIBRARY.stat().st_mtime < max(
        path.stat().st_mtime for path in sources
    ):
        command = next(
            ([name] for name in ("cc", "gcc", "clang") if shutil.which(name)),
            [sys.executable, "-m", "ziglang", "cc"],
        )
        LIBRARY.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(
            dir=LIBRARY.parent
        ) as folder:  # two runs at once must not meet
            made = Path(folder) / LIBRARY.name
            subprocess.run(
                [
                    *command,
                    "-std=c11",
                    "-O1",
                    "-g",
                    "-Wall",
                    "-Wextra",
                    "-Wconversion",
                    "-Wno-sign-conversion",
                    "-Werror",
                    "-fsanitize=undefined",
                    "-fsanitize-undefined-trap-on-error",
                    "-shared",
                    "-fPIC",
                    f"-I{ROOT / 'sw' / 'firmware'}",
                    str(SOURCE),
                    "-o",
                    str(made),
                ],
                check=True,
            )
            os.replace(made, LIBRARY)
    loaded = ctypes.CDLL(str(LIBRARY))
    loaded.calibration_restore.restype = loaded.calibration_values_fit.restype = (
        loaded.calibration_open.restype
    ) = c_bool
    loaded.calibration_table_entry.restype = c_int32
    return loaded


class CalibrationRun:
    """The firmware's calibration; its need is served by the test."""

    def __init__(self):
        self.calibration, self.loads = Calibration(), 0
        self.call("start")

    def call(self, name, *arguments):
        return getattr(library(), f"calibration_{name}")(ctypes.byref(self.calibration), *arguments)

    @property
    def values(self):
        return self.calibration.values.as_dict()

    def idle(self):
        """All work done and values loaded; returns what the calibration needs now."""
        while self.calibration.need in (WORK, LOADING):
            if self.calibration.need == LOADING:
                self.table = [
                    library().calibration_table_entry(ctypes.byref(self.calibration.values), point)
                    for point in range(POINTS)
                ]
                self.loads += 1
                self.call("loaded")
            else:
                self.call("work")
        return self.calibration.need

    def burst(self, words, spoiled=False, every=1):
        """A burst of words, given as often as it is wanted, then all work; returns the reason."""
        self.call("open", c_uint16(every), spoiled)
        take, calibration, given = (
            library().calibration_take,
            ctypes.byref(self.calibration),
            (c_uint32 * len(words))(*words),
        )
        at_once = WORDS_AT_ONCE if self.calibration.harmonics else 1
        while self.idle() == WORDS:
            for n in range(0, len(words), at_once):
                take(calibration, ctypes.byref(given, 4 * n))
        return self.calibration.reason

    def phases(self, phases, spoiled=False, every=1):
        """The same from single phases: calibration_recorder packs two into a word."""
        return self.burst(
            [later << 16 | earlier for earlier, later in zip(phases[::2], phases[1::2])],
            spoiled,
            every,
        )
