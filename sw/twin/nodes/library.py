# SPDX-License-Identifier: Apache-2.0
"""The library of a build of the twin, for its two users: Twin and FrameBench."""

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy
import numpy.typing

from twin import build
from twin.devices.devices import FUNCTIONS as DEVICES_FUNCTIONS
from twin.devices.devices import PEER_FUNCTIONS
from twin.machines.machine import FUNCTIONS as MACHINE_FUNCTIONS
from twin.machines.machine import HANDLE, LONG, REAL, WHOLE, Functions, declare

FUNCTIONS: Functions = {
    "twin_axes": (WHOLE, []),
    "twin_memory_words": (WHOLE, []),
    "twin_new": (HANDLE, [LONG, WHOLE, HANDLE, HANDLE, WHOLE, HANDLE, HANDLE, REAL]),
    "twin_delete": (None, [HANDLE]),
    "twin_now": (LONG, [HANDLE]),
    "twin_run": (None, [HANDLE, LONG]),
    "twin_run_until_words": (WHOLE, [HANDLE, WHOLE, LONG]),
    "twin_send_words": (None, [HANDLE, HANDLE, WHOLE, HANDLE, WHOLE, WHOLE]),
    "twin_send_levels": (None, [HANDLE, HANDLE, WHOLE, REAL]),
    "twin_receive_words": (WHOLE, [HANDLE, HANDLE, WHOLE]),
    "twin_host_bit_time": (None, [HANDLE, REAL]),
    "twin_flip_reply": (None, [HANDLE, HANDLE, WHOLE]),
    "twin_bus_spikes": (None, [HANDLE, REAL, REAL, REAL]),
    "twin_cut": (None, [HANDLE, WHOLE, WHOLE]),
    "twin_bus_state": (None, [HANDLE, HANDLE]),
    "twin_estop": (None, [HANDLE, WHOLE, WHOLE]),
    "twin_fit_probe": (None, [HANDLE, WHOLE, HANDLE, REAL]),
    "twin_machine": (HANDLE, [HANDLE, WHOLE]),
    "twin_attach_devices": (HANDLE, [HANDLE, WHOLE, HANDLE, ctypes.c_uint, LONG, WHOLE]),
    "twin_join_peers": (HANDLE, [HANDLE, WHOLE, WHOLE, LONG, REAL]),
    "twin_join_link": (None, [HANDLE, WHOLE, LONG, REAL, HANDLE]),
    "twin_power": (None, [HANDLE, WHOLE, WHOLE]),
    "twin_register": (ctypes.c_char_p, [WHOLE, HANDLE]),
    "twin_flip_at": (None, [HANDLE, LONG, WHOLE, WHOLE, WHOLE, WHOLE]),
    "twin_flipped": (WHOLE, [HANDLE]),
    "twin_digest": (LONG, [HANDLE, WHOLE]),
    "frame_bench_new": (HANDLE, [WHOLE, HANDLE, WHOLE, REAL]),
    "frame_bench_delete": (None, [HANDLE]),
    "frame_bench_idle": (None, [HANDLE, LONG]),
    "frame_bench_now": (LONG, [HANDLE]),
    "frame_bench_exchange": (WHOLE, [HANDLE, HANDLE, WHOLE, WHOLE, WHOLE, WHOLE, HANDLE, WHOLE]),
}


def library(
    clk_hz: int,
    axes: int,
    words: Sequence[int],
    node: Mapping[str, int | str] | None = None,
    netlist: str | None = None,
) -> ctypes.CDLL:
    """The library of a build, with its functions declared."""
    found = ctypes.CDLL(str(build.twin_library(clk_hz, axes, node, words, netlist)))
    declare(found, {**FUNCTIONS, **MACHINE_FUNCTIONS, **DEVICES_FUNCTIONS, **PEER_FUNCTIONS})
    return found


def array(values: Any, dtype: Any) -> numpy.typing.NDArray[Any]:
    """The values as a contiguous array."""
    return numpy.ascontiguousarray(values, dtype=dtype)


def memory_image(found: ctypes.CDLL, words: Sequence[int]) -> numpy.typing.NDArray[Any]:
    """The words of the firmware as an array; BuildError if they do not fit."""
    image = array(words, numpy.uint32)
    if len(image) > found.twin_memory_words():
        raise build.BuildError(
            f"the firmware has {len(image)} words, the node's memory {found.twin_memory_words()}"
        )
    return image
