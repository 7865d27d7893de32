# SPDX-License-Identifier: Apache-2.0
"""The firmware as a shared library of this computer, its registers served by Python."""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

from firmware import build as firmware_build

ROOT = Path(__file__).resolve().parents[3]
SOURCE = ROOT / "sw" / "firmware"
BRIDGE = Path(__file__).with_name("register_bridge.c")
EVENTS, SECTIONS = 60, 9


class Limits(ctypes.Structure):
    _fields_ = [
        ("velocity", ctypes.c_uint64),
        ("acceleration", ctypes.c_uint64),
        ("jerk", ctypes.c_uint32),
    ]


class Segment(ctypes.Structure):
    _fields_ = [
        ("velocity", ctypes.c_int64),
        ("acceleration", ctypes.c_int64),
        ("jerk", ctypes.c_int32),
        ("ticks", ctypes.c_uint32),
    ]


class State(ctypes.Structure):
    _fields_ = [
        ("moved", ctypes.c_uint64),
        ("velocity", ctypes.c_int64),
        ("acceleration", ctypes.c_int64),
    ]


class Event(ctypes.Structure):
    _fields_ = [
        ("jerk", ctypes.c_int64),
        ("tick", ctypes.c_uint32),
        ("velocity", ctypes.c_int8),
        ("acceleration", ctypes.c_int8),
        ("slot", ctypes.c_uint8),
    ]


class Progress(ctypes.Structure):
    _fields_ = [
        ("state", State),
        ("jerk", ctypes.c_int64),
        ("landing", ctypes.c_int64),
        ("tick", ctypes.c_uint32),
    ]


class Steps(ctypes.Union):
    _fields_ = [("event", Event * EVENTS), ("section", Segment * SECTIONS)]


class Plan(ctypes.Structure):
    _fields_ = [
        ("ticks", ctypes.c_uint32),
        ("count", ctypes.c_uint8),
        ("next", ctypes.c_uint8),
        ("cause", ctypes.c_uint8),
        ("stepped", ctypes.c_bool),
        ("at", Progress),
        ("steps", Steps),
    ]


class SteppedProfile(ctypes.Structure):
    _fields_ = [
        ("first", ctypes.c_uint64),
        ("top", ctypes.c_uint64),
        ("rise", ctypes.c_uint64 * 3),
        ("border", ctypes.c_uint64 * 2),
        ("ticks", ctypes.c_uint32),
    ]


READ = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_uint32)
WRITE = ctypes.CFUNCTYPE(None, ctypes.c_uint32, ctypes.c_uint32)


@cache
def library(image="axis"):
    """Compile if a source is newer; gcc or clang of the system, else zig."""
    sources = [*(path for path in firmware_build.sources_of(image) if path.suffix != ".S"), BRIDGE]
    result = ROOT / "build" / "firmware" / f"host_firmware_{image}.so"
    if not result.exists() or result.stat().st_mtime < max(
        path.stat().st_mtime for path in sources
    ):
        command = next(
            ([name] for name in ("cc", "gcc", "clang", "g++") if shutil.which(name)),
            [sys.executable, "-m", "ziglang", "cc"],
        )
        result.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(
            dir=result.parent
        ) as folder:  # two runs at once must not meet
            made = Path(folder) / result.name
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
                    "-fsanitize-undefined-trap-on-error",  # undefined behaviour ends the test
                    "-shared",
                    "-fPIC",
                    "-DMOIRE_REGISTER_ACCESS",
                    f"-I{SOURCE}",
                    *firmware_build.defines_of(image),
                    *(str(path) for path in sources if path.suffix == ".c"),
                    "-o",
                    str(made),
                ],
                check=True,
            )
            os.replace(made, result)
    loaded = ctypes.CDLL(str(result))
    loaded.planner_limits.restype = Limits
    loaded.planner_move.argtypes = [ctypes.POINTER(Plan), ctypes.POINTER(Limits), ctypes.c_int64]
    loaded.planner_retarget.argtypes = [
        ctypes.POINTER(Plan),
        ctypes.POINTER(Plan),
        ctypes.c_uint32,
        ctypes.POINTER(Limits),
        ctypes.c_int64,
        ctypes.c_void_p,
    ]
    loaded.planner_move.restype = loaded.planner_retarget.restype = ctypes.c_bool
    loaded.planner_stepped_move.argtypes = [
        ctypes.POINTER(Plan),
        ctypes.POINTER(SteppedProfile),
        ctypes.c_int64,
    ]
    loaded.planner_stepped_move.restype = ctypes.c_bool
    loaded.planner_stepped_borders.argtypes, loaded.planner_stepped_borders.restype = (
        [ctypes.POINTER(SteppedProfile), ctypes.c_uint32, ctypes.c_uint32],
        None,
    )
    loaded.planner_feed_override.argtypes = [
        ctypes.POINTER(Limits),
        ctypes.POINTER(ctypes.c_uint32),
        ctypes.POINTER(ctypes.c_uint32),
    ]
    loaded.planner_feed_override.restype = None
    loaded.planner_take_up_to.argtypes = [
        ctypes.POINTER(Plan),
        ctypes.POINTER(Segment),
        ctypes.POINTER(ctypes.c_bool),
        ctypes.c_uint32,
    ]
    loaded.planner_take_up_to.restype = ctypes.c_bool
    return loaded
