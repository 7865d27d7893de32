# SPDX-License-Identifier: Apache-2.0
"""The parts of the driver for LinuxCNC that need no LinuxCNC, compiled for this computer."""

import ctypes
import tomllib
from functools import cache
from pathlib import Path

import pytest

from linuxcnc_config.headless import SOURCES
from moire.bus.link_spi import MOST_HZ as SPI_MOST_HZ
from moire.bus.link_spi import turnround_bytes
from moire.made import link_tables as layout
from tables.linuxcnc import SOURCE, identifier
from twin.compiled.host_library import host_library

ZLIB = Path("/usr/include/zlib.h")
LONGEST = 4 * layout.LONGEST_WORDS
OPTIONS = ["-std=gnu11", "-D_GNU_SOURCE", "-Wl,--no-as-needed", "-lz", "-lm"]
OPTIONS += ["-Wl,--wrap=open", "-Wl,--wrap=ioctl"]
NAMES = ("packet", "carrier", "node", "node_clock", "latch", "probe", "axis")
TABLE = tomllib.loads(SOURCE.read_text(encoding="utf-8"))
TYPES = {  # of hal.h
    "bit": ctypes.c_bool,
    "float": ctypes.c_double,
    "s32": ctypes.c_int32,
    "u32": ctypes.c_uint32,
}
AXIS_PINS = {identifier(name): TYPES[kind] for name, (kind, *_) in TABLE["axis"].items()}
CAUSES = {name: number for name, (number, _) in TABLE["cause"].items()}


class Session(ctypes.Structure):
    """struct link_session"""

    _fields_ = [(name, ctypes.c_uint32) for name in ("session", "writes", "reads", "sequence")]


class Reply(ctypes.Structure):
    """struct link_reply"""

    _fields_ = [
        ("time", ctypes.c_uint32),
        ("refused", ctypes.c_uint8 * len(layout.CAUSES)),
        ("spare", ctypes.c_uint32),
        ("values", ctypes.c_uint32 * layout.MOST_VALUES),
    ]


class Clock(ctypes.Structure):
    """struct node_clock"""

    _fields_ = [
        *((name, ctypes.c_double) for name in ("nominal", "tick", "step", "now", "late", "base")),
        ("base_tick", ctypes.c_uint32),
        ("running", ctypes.c_bool),
    ]


class Motion(ctypes.Structure):
    """struct motion"""

    _fields_ = [(name, ctypes.c_double) for name in ("position", "velocity", "acceleration")]


class Latch(ctypes.Structure):
    """struct latch"""

    _fields_ = [
        ("phase", ctypes.c_int),
        ("sources", ctypes.c_uint32),
        ("position", ctypes.c_int64),
    ]


class Access(ctypes.Structure):
    """struct spare_access"""

    _fields_ = [(name, ctypes.c_uint32) for name in ("spare", "value")]


class Probe(ctypes.Structure):
    """struct probe"""

    _fields_ = [
        ("phase", ctypes.c_int),
        *((name, ctypes.c_bool) for name in ("level", "pin")),
        *((name, ctypes.c_uint) for name in ("steady", "waiting")),
    ]


class Carrier(ctypes.Structure):
    """struct carrier"""

    _fields_ = [
        ("file", ctypes.c_int),
        ("kind", ctypes.c_int),
        ("reply", ctypes.c_size_t),
        ("hz", ctypes.c_uint),
        ("received", ctypes.c_size_t),
        ("stuffed", ctypes.c_uint8 * (LONGEST + 16)),
        ("transferred", ctypes.c_uint8 * (2 * LONGEST + turnround_bytes(2 * LONGEST, SPI_MOST_HZ))),
    ]


class Node(ctypes.Structure):
    """struct node"""

    _fields_ = [
        ("carrier", Carrier),
        ("link", Session),
        *((name, ctypes.c_uint) for name in ("axes", "drives")),
        ("probes", ctypes.c_bool),
        *((name, ctypes.c_double) for name in ("clk_hz", "tick")),
        *((name, ctypes.c_uint32) for name in ("time", "read_time")),
        *((name, ctypes.c_bool) for name in ("locked", "captured")),
        ("phase_error", ctypes.c_double),
        *((name, ctypes.c_int64) for name in ("time_at", "sent_at", "patience")),
        ("why", ctypes.c_char * 160),
    ]


class AxisPins(ctypes.Structure):
    """struct axis_pins"""

    _fields_ = [(name, ctypes.POINTER(kind)) for name, kind in AXIS_PINS.items()]


class Axis(ctypes.Structure):
    """struct axis"""

    _fields_ = [
        ("pins", AxisPins),
        *((name, ctypes.c_uint) for name in ("phase", "periods")),
        ("seen", ctypes.c_bool),
        ("commands", ctypes.c_double * 3),
        *((name, ctypes.c_double) for name in ("offset", "aborted", "target")),
        *((name, ctypes.c_uint32) for name in ("faults", "first_fault", "mode", "ended", "state")),
    ]


class AxisRequest(ctypes.Structure):
    """struct axis_request"""

    _fields_ = [
        ("position", ctypes.c_int64),
        ("velocity", ctypes.c_int32),
        *((name, ctypes.c_bool) for name in ("enable", "home", "stream", "reset", "commit")),
    ]


Transfer = ctypes.CFUNCTYPE(
    ctypes.c_bool, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32
)


@cache
def driver() -> ctypes.CDLL:
    """The library; the test is skipped by name where zlib's header is not installed. Its SPI
    devices are those of spidev.c, where `spidev_set(FILE, Transfer)` puts one. The types of its
    pins are those of hal.h beside this file.
    """
    if not ZLIB.exists():
        pytest.skip("zlib1g-dev is not installed: make linuxcnc")
    folder = Path(__file__).parent
    sources = [*(SOURCES / f"{name}.c" for name in NAMES), folder / "spidev.c"]
    found = host_library("linuxcnc", sources, [*OPTIONS, f"-I{SOURCES}", f"-I{folder}"])
    found.packet_request.restype = ctypes.c_size_t
    found.packet_reply.restype = ctypes.c_bool
    found.packet_reply_length.restype = ctypes.c_size_t
    found.node_clock_tick.restype = ctypes.c_double
    found.node_clock_drift.restype = ctypes.c_double
    found.motion_through.restype = found.motion_after.restype = Motion
    found.node_open.restype = found.latch_asks.restype = found.probe_take.restype = ctypes.c_bool
    found.carrier_open.restype = ctypes.c_char_p
    found.carrier_send.restype = ctypes.c_bool
    found.carrier_receive.restype = ctypes.c_size_t
    found.carrier_now.restype = ctypes.c_int64
    found.axis_give.restype = AxisRequest
    return found
