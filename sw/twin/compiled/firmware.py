# SPDX-License-Identifier: Apache-2.0
"""The firmware as a shared library of this computer, its registers served by Python."""

import _ctypes
import ctypes
import shutil
import tempfile
import weakref
from functools import cache
from pathlib import Path

from firmware import build as firmware_build
from twin.compiled.host_library import host_library_file

BRIDGE = Path(__file__).with_name("register_bridge.c")
EVENTS, SECTIONS = 60, 9


class Limits(ctypes.Structure):
    """struct planner_limits: 2^-40 period per tick, tick^2 and tick^3."""

    _fields_ = [
        ("velocity", ctypes.c_uint64),
        ("acceleration", ctypes.c_uint64),
        ("jerk", ctypes.c_uint32),
    ]


class Segment(ctypes.Structure):
    """struct planner_segment."""

    _fields_ = [
        ("velocity", ctypes.c_int64),
        ("acceleration", ctypes.c_int64),
        ("jerk", ctypes.c_int32),
        ("ticks", ctypes.c_uint32),
    ]


class State(ctypes.Structure):
    """struct planner_state."""

    _fields_ = [
        ("moved", ctypes.c_uint64),
        ("velocity", ctypes.c_int64),
        ("acceleration", ctypes.c_int64),
    ]


class Event(ctypes.Structure):
    """struct planner_event."""

    _fields_ = [
        ("jerk", ctypes.c_int64),
        ("tick", ctypes.c_uint32),
        ("velocity", ctypes.c_int8),
        ("acceleration", ctypes.c_int8),
        ("slot", ctypes.c_uint8),
    ]


class Progress(ctypes.Structure):
    """struct planner_progress."""

    _fields_ = [
        ("state", State),
        ("jerk", ctypes.c_int64),
        ("landing", ctypes.c_int64),
        ("tick", ctypes.c_uint32),
    ]


class Steps(ctypes.Union):
    """The union of events and sections in struct plan."""

    _fields_ = [("event", Event * EVENTS), ("section", Segment * SECTIONS)]


class Plan(ctypes.Structure):
    """struct plan."""

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
    """struct planner_stepped_profile."""

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
def build(image: str, update: bool = False) -> Path:
    """Build the firmware of an image, with or without updates over the bus, as a shared library;
    returns its file.
    """
    sources = [path for path in firmware_build.sources_of(image) if path.suffix == ".c"]
    options = ["-DMOIRE_REGISTER_ACCESS", *firmware_build.defines_of(image, update=update)]
    name = f"firmware_{image}" + ("_update" if update else "")
    return host_library_file(name, [*sources, BRIDGE], options)


@cache
def library(image: str = "axis") -> ctypes.CDLL:
    """The functions of an image that have no state, such as those of the planner."""
    return load(build(image))


def power_up(image: str, node: object, update: bool = False) -> ctypes.CDLL:
    """A firmware with a memory of its own, as after power-up, until the node has gone. The loader
    loads a file only once, so that each firmware is a copy of the file.
    """
    file = build(image, update)
    with tempfile.TemporaryDirectory(dir=file.parent) as directory:
        loaded = load(Path(shutil.copy(file, directory)))
    weakref.finalize(node, _ctypes.dlclose, loaded._handle)
    return loaded


def load(file: Path) -> ctypes.CDLL:
    """Load a file that build() has made."""
    loaded = ctypes.CDLL(str(file))
    loaded.parameters_get.restype = ctypes.c_int64
    loaded.parameters_set.argtypes = [ctypes.c_uint, ctypes.c_uint8, ctypes.c_int64]
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
