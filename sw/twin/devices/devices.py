# SPDX-License-Identifier: Apache-2.0
"""Models of the devices around a node: EEPROM, key-pad and displays at its peripherals, a PS/2
keyboard, a wire-EDM machine and its PC, and the serial line to another node. They are connected to
a node of the twin (Twin.devices), or used without one, with their pins driven from Python.

    panel = twin.devices(0)
    panel.press(3)                                           a key of the pad, 0..33
    panel.lines, panel.digits                                what the displays show
    panel.type([0x1C, 0xF0, 0x1C], after_s=0.1)              a person at the keyboard
    panel.cuts                                               [EdmCut(start_s, end_s,
                                                             angle_start_rad, angle_end_rad,
                                                             complete)]
"""

import ctypes
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy
import numpy.typing

from twin import build
from twin.machines.machine import (
    HANDLE,
    LONG,
    REAL,
    TEXT,
    WHOLE,
    Functions,
    declare,
    state_class,
)
from twin.parameters import tables as parameters

KEYS, LINES, COLUMNS, DIGITS, EEPROM_BYTES = 34, 4, 20, 8, 16384
MOST = 4096  # bytes taken at once
GOES_ON = 2**64 - 1

Levels = dict[str, numpy.typing.NDArray[numpy.uint8]]

FUNCTIONS: Functions = {
    "devices_parameters": (WHOLE, []),
    "devices_state_names": (TEXT, []),
    "devices_faults": (TEXT, []),
    "devices_state": (None, [HANDLE, LONG, HANDLE]),
    "devices_set": (WHOLE, [HANDLE, TEXT, REAL]),
    "devices_get": (WHOLE, [HANDLE, TEXT, HANDLE]),
    "devices_fault": (WHOLE, [HANDLE, TEXT, WHOLE]),
    "devices_eeprom": (HANDLE, [HANDLE]),
    "devices_key": (None, [HANDLE, WHOLE, WHOLE]),
    "devices_text": (None, [HANDLE, HANDLE]),
    "devices_segments": (None, [HANDLE, HANDLE]),
    "devices_type": (None, [HANDLE, HANDLE, WHOLE, LONG]),
    "devices_commands": (WHOLE, [HANDLE, HANDLE, WHOLE]),
    "devices_order": (None, [HANDLE, HANDLE, WHOLE]),
    "devices_received": (WHOLE, [HANDLE, HANDLE, HANDLE, WHOLE]),
    "devices_cuts": (WHOLE, [HANDLE]),
    "devices_cut": (None, [HANDLE, WHOLE, HANDLE, HANDLE, HANDLE]),
}
PEER_FUNCTIONS: Functions = {
    "peer_line_put": (None, [HANDLE, HANDLE, WHOLE, LONG]),
    "peer_line_garbage": (None, [HANDLE, REAL, LONG]),
    "peer_line_cut": (None, [HANDLE, WHOLE]),
    "peer_line_received": (WHOLE, [HANDLE, HANDLE, WHOLE]),
    "peer_line_counts": (None, [HANDLE, HANDLE]),
}
BENCH_FUNCTIONS: Functions = {
    "devices_bench_new": (HANDLE, [HANDLE, ctypes.c_uint, LONG, REAL]),
    "devices_bench_delete": (None, [HANDLE]),
    "devices_bench_of": (HANDLE, [HANDLE]),
    "devices_bench_now": (LONG, [HANDLE]),
    "devices_bench_levels": (ctypes.c_uint, [HANDLE]),
    "devices_bench_run": (None, [HANDLE, LONG]),
    "devices_bench_pins": (None, [HANDLE, ctypes.c_uint, ctypes.c_uint]),
    "devices_bench_watch": (None, [HANDLE, LONG, HANDLE]),
    "devices_bench_cable": (None, [HANDLE, LONG, HANDLE]),
    "devices_bench_power_cut": (None, [HANDLE]),
    "devices_bench_power_on": (None, [HANDLE]),
    "peer_line_new": (HANDLE, [LONG, REAL, REAL]),
    "peer_line_delete": (None, [HANDLE]),
    "peer_line_levels": (None, [HANDLE, LONG, LONG, HANDLE, HANDLE]),
}

# pins, in the order of devices.h
DRIVE = {
    name: 1 << n
    for n, name in enumerate(
        (
            "i2c_scl_low",
            "i2c_sda_low",
            "keyboard_clock_low",
            "keyboard_data_low",
            "edm_clock_low",
            "edm_data_low",
            "display_cs_n",
            "display_sclk",
            "display_data",
        )
    )
}
SENSE = {
    name: 1 << n
    for n, name in enumerate(
        (
            "i2c_scl",
            "i2c_sda",
            "keyboard_clock",
            "keyboard_data",
            "edm_clock",
            "edm_data",
            "edm_cutting",
            "edm_alarm",
        )
    )
}
OWN_CHARACTERS = {
    0x5C: "¥",
    0x7E: "→",
    0x7F: "←",
    0xDF: "°",
}  # of the HD44780, where it differs from ASCII
SEGMENTS = {
    0x00: " ",
    0x01: "-",
    0x08: "_",
    0x7E: "0",
    0x30: "1",
    0x6D: "2",
    0x79: "3",
    0x33: "4",
    0x5B: "5",
    0x5F: "6",
    0x70: "7",
    0x7F: "8",
    0x7B: "9",
    0x77: "A",
    0x1F: "b",
    0x4E: "C",
    0x0D: "c",
    0x3D: "d",
    0x4F: "E",
    0x47: "F",
    0x37: "H",
    0x0E: "L",
    0x15: "n",
    0x1D: "o",
    0x67: "P",
    0x05: "r",
    0x0F: "t",
    0x3E: "U",
    0x1C: "u",
}


@dataclass(frozen=True)
class Devices:
    """The devices of a node. The PC of the EDM machine always listens; `edm` makes the EDM machine
    obey its keys. `table` is the axis, counted through all nodes, whose true angle is logged for
    each cut. `parameters` override those of devices.toml.
    """

    eeprom: bool = False  # 24AA128
    keypad: bool = False  # TCA8418
    display: bool = False  # HD44780 on a PCF8574
    keyboard: bool = False
    edm: bool = False
    table: int | None = None
    parameters: dict[str, float] = field(default_factory=dict)

    @property
    def fitted(self) -> int:
        """Bit mask of the devices that are there."""
        return sum(
            bool(there) << n
            for n, there in enumerate(
                (self.eeprom, self.keypad, self.display, self.keyboard, self.edm)
            )
        )


@dataclass(frozen=True)
class EdmCut:
    """A cut of the EDM machine: its times and the true angles of the table; end_s and angle_end_rad
    are None while it continues.
    """

    start_s: float
    end_s: float | None
    angle_start_rad: float
    angle_end_rad: float | None
    complete: bool  # no alarm ended it


def pack(overrides: Mapping[str, float], library: ctypes.CDLL) -> "ctypes.Array[ctypes.c_double]":
    """The parameters of the devices as their C++ structure."""
    values = list(parameters.values(overrides, "devices").values())
    assert library.devices_parameters() == len(values)
    return (ctypes.c_double * len(values))(*values)


def taken(take: Callable[[Any, int], int]) -> bytes:
    """All bytes that repeated calls of take(out, most) deliver."""
    out = ctypes.create_string_buffer(MOST)
    data = b""
    while count := take(out, MOST):
        data += out.raw[:count]
    return data


class DevicesHandle:
    """The devices of a node, by their address in the library."""

    def __init__(
        self, library: ctypes.CDLL, handle: int, clk_hz: int, now: Callable[[], int]
    ) -> None:
        self.library, self.handle, self.clk_hz, self.now = library, handle, clk_hz, now
        self.names, self.faults = (
            library.devices_state_names().decode(),
            library.devices_faults().decode().split(),
        )

    @property
    def state(self) -> Any:
        """time_s and the values that state_names of devices.h lists."""
        kind, makers = state_class(self.names)
        out = (ctypes.c_double * len(makers))()
        self.library.devices_state(self.handle, self.now(), out)
        return kind(*(make(value) for make, value in zip(makers, out)))

    def set(self, **values: float) -> None:
        """Change parameters."""
        for name, value in values.items():
            if not self.library.devices_set(self.handle, name.encode(), value):
                raise KeyError(
                    f"devices have no parameter {name}; see {parameters.source('devices').name}"
                )

    def get(self, name: str) -> float:
        """A parameter, in the unit of devices.toml."""
        out = ctypes.c_double()
        if not self.library.devices_get(self.handle, name.encode(), ctypes.addressof(out)):
            raise KeyError(
                f"devices have no parameter {name}; see {parameters.source('devices').name}"
            )
        return out.value

    # faults: a dead device does nothing, a low line is shorted to ground; the EDM machine has an
    # alarm, never ends a cut, or ignores the start

    def inject(self, fault: str) -> None:
        """Begin a fault."""
        self._fault(fault, True)

    def clear(self, fault: str) -> None:
        """End a fault."""
        self._fault(fault, False)

    @contextmanager
    def fault(self, fault: str) -> "Iterator[DevicesHandle]":
        """A fault as long as the block lasts."""
        self.inject(fault)
        try:
            yield self
        finally:
            self.clear(fault)

    def _fault(self, fault: str, on: bool) -> None:
        if not self.library.devices_fault(self.handle, fault.encode(), on):
            raise KeyError(
                f"there is no fault {fault} of devices: there are {', '.join(self.faults)}"
            )

    # panel

    @property
    def eeprom(self) -> bytes:
        """The contents of the EEPROM."""
        return ctypes.string_at(self.library.devices_eeprom(self.handle), EEPROM_BYTES)

    def write_eeprom(self, address: int, data: Iterable[int]) -> None:
        """Write it as a programming device would, out of its socket."""
        data = bytes(data)
        if address < 0 or address + len(data) > EEPROM_BYTES:
            raise IndexError(f"the EEPROM has {EEPROM_BYTES} bytes")
        ctypes.memmove(self.library.devices_eeprom(self.handle) + address, data, len(data))

    def press(self, key: int) -> None:
        """Press a key of the pad, 0..33, seven a row."""
        self._key(key, True)

    def release(self, key: int) -> None:
        """Release a key of the pad."""
        self._key(key, False)

    def _key(self, key: int, down: bool) -> None:
        if key not in range(KEYS):
            raise IndexError(f"there is no key {key}: there are {KEYS}")
        self.library.devices_key(self.handle, key, down)

    @property
    def lines(self) -> list[str]:
        """The four lines of the character display."""
        out = ctypes.create_string_buffer(LINES * COLUMNS)
        self.library.devices_text(self.handle, out)
        text = "".join(
            OWN_CHARACTERS.get(code, chr(code) if 0x20 <= code < 0x7F else "?")
            for code in out.raw[: LINES * COLUMNS]
        )
        return [text[n : n + COLUMNS] for n in range(0, len(text), COLUMNS)]

    @property
    def digits(self) -> str:
        """The numeric display; ? is a pattern that is not a character."""
        out = ctypes.create_string_buffer(DIGITS)
        self.library.devices_segments(self.handle, out)
        return "".join(
            SEGMENTS.get(code & 0x7F, "?") + ("." if code & 0x80 else "")
            for code in out.raw[:DIGITS]
        )

    # keyboard and machine

    def type(self, codes: Iterable[int], after_s: float = 0.0) -> None:
        """Queue bytes that the keyboard sends, not before after_s have passed."""
        codes = bytes(codes)
        self.library.devices_type(
            self.handle, codes, len(codes), self.now() + round(after_s * self.clk_hz)
        )

    def take_commands(self) -> bytes:
        """The commands that the keyboard received since the previous call, with arguments."""
        return taken(partial(self.library.devices_commands, self.handle))

    def order(self, commands: Iterable[int]) -> None:
        """Bytes that the PC of the EDM machine sends to its keyboard, each after the answer to the
        previous one.
        """
        commands = bytes(commands)
        self.library.devices_order(self.handle, commands, len(commands))

    def take_received(self) -> list[tuple[float, int]]:
        """[(time in s, byte)] that the PC of the EDM machine received since the previous call,
        answers to its commands included.
        """
        data, at = ctypes.create_string_buffer(MOST), (ctypes.c_uint64 * MOST)()
        received = []
        while count := self.library.devices_received(self.handle, data, at, MOST):
            received += [(at[n] / self.clk_hz, data.raw[n]) for n in range(count)]
        return received

    @property
    def cuts(self) -> list[EdmCut]:
        """The log of the EDM machine."""
        found = []
        clk, angle, complete = (ctypes.c_uint64 * 2)(), (ctypes.c_double * 2)(), ctypes.c_int()
        for n in range(self.library.devices_cuts(self.handle)):
            self.library.devices_cut(self.handle, n, clk, angle, ctypes.addressof(complete))
            on = clk[1] == GOES_ON
            found.append(
                EdmCut(
                    clk[0] / self.clk_hz,
                    None if on else clk[1] / self.clk_hz,
                    angle[0],
                    None if on else angle[1],
                    bool(complete.value),
                )
            )
        return found


class PeerLineHandle:
    """One direction of the serial line between two nodes."""

    def __init__(self, library: ctypes.CDLL, handle: int, now: Callable[[], int]) -> None:
        self.library, self.handle, self.now = library, handle, now

    def put(self, data: Iterable[int]) -> None:
        """Send bytes beside those of the sending node."""
        data = bytes(data)
        self.library.peer_line_put(self.handle, data, len(data), self.now())

    def garbage(self, rate_hz: float) -> None:
        """Send a few random bytes at this mean rate; 0 ends it."""
        self.library.peer_line_garbage(self.handle, rate_hz, self.now())

    def cut(self, cut: bool = True) -> None:
        """Cut the line, or repair it."""
        self.library.peer_line_cut(self.handle, cut)

    def take_received(self) -> bytes:
        """The bytes that a receiver on the line has decoded since the previous call."""
        return taken(partial(self.library.peer_line_received, self.handle))

    @property
    def framing_errors(self) -> int:
        """Bytes without a stop bit."""
        return self._counts()[0]

    @property
    def garbage_bytes(self) -> int:
        """Random bytes that were sent."""
        return self._counts()[1]

    def _counts(self) -> list[int]:
        out = (ctypes.c_uint64 * 2)()
        self.library.peer_line_counts(self.handle, out)
        return list(out)


def machine_library() -> ctypes.CDLL:
    """The library of the models without nodes, with its functions declared."""
    library = ctypes.CDLL(str(build.machine_library()))
    declare(library, {**FUNCTIONS, **PEER_FUNCTIONS, **BENCH_FUNCTIONS})
    return library


class DevicesBench(DevicesHandle):
    """Devices without a node. Time passes in run, watch and cable."""

    def __init__(self, devices: Devices, seed: int = 1, clk_hz: int = 2_000_000) -> None:
        self.bench: int | None = None
        library = machine_library()
        packed = pack(devices.parameters, library)
        self.bench = library.devices_bench_new(
            ctypes.addressof(packed), devices.fitted, seed, clk_hz
        )
        super().__init__(
            library,
            library.devices_bench_of(self.bench),
            clk_hz,
            partial(library.devices_bench_now, self.bench),
        )

    def __del__(self) -> None:
        if self.bench:
            self.library.devices_bench_delete(self.bench)
        self.bench = None

    def pins(self, **levels: bool) -> None:
        """Set pins that the node would drive, from the next cycle on."""
        which = sum(DRIVE[name] for name in levels)
        self.library.devices_bench_pins(
            self.bench, sum(DRIVE[name] for name, level in levels.items() if level), which
        )

    def run(self, seconds: float) -> None:
        """Let time pass."""
        self.run_clk(math.ceil(seconds * self.clk_hz - 1e-6))

    def run_clk(self, clk: int) -> None:
        """Let cycles pass."""
        self.library.devices_bench_run(self.bench, clk)

    def watch(self, seconds: float) -> Levels:
        """Run; {pin: levels after each cycle}."""
        return self._levels(self.library.devices_bench_watch, seconds)

    def cable(self, seconds: float) -> Levels:
        """Run with the keyboard connected to the EDM machine without a node between; {pin: levels
        after each cycle}.
        """
        return self._levels(self.library.devices_bench_cable, seconds)

    def _levels(self, watch: Callable[..., None], seconds: float) -> Levels:
        out = numpy.zeros(round(seconds * self.clk_hz), dtype=numpy.uint16)
        watch(self.bench, len(out), out.ctypes.data)
        return {name: (out & bit > 0).astype(numpy.uint8) for name, bit in SENSE.items()}

    def level(self, pin: str) -> bool:
        """The level of a pin that the devices drive."""
        return bool(self.library.devices_bench_levels(self.bench) & SENSE[pin])

    def power_cut(self) -> None:
        """The panel and the EEPROM lose their power."""
        self.library.devices_bench_power_cut(self.bench)

    def power_on(self) -> None:
        """The power returns."""
        self.library.devices_bench_power_on(self.bench)


class PeerLineBench(PeerLineHandle):
    """One direction without nodes. Time passes in pass_levels."""

    def __init__(self, seed: int = 1, clk_hz: int = 1_000_000, baud: int = 9600) -> None:
        self.bench: int | None = None
        self.clk_hz, self.baud, self.clk = clk_hz, baud, 0
        library = machine_library()
        handle: int = library.peer_line_new(seed, clk_hz, baud)
        self.bench = handle
        super().__init__(library, handle, lambda: self.clk)

    def __del__(self) -> None:
        if self.bench:
            self.library.peer_line_delete(self.bench)
        self.bench = None

    def pass_levels(self, levels: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.uint8]:
        """Pass the levels of the sender, one a cycle; returns the levels at the receiver."""
        sent = numpy.ascontiguousarray(levels, dtype=numpy.uint8)
        out = numpy.empty_like(sent)
        self.library.peer_line_levels(
            self.bench, self.clk + 1, len(sent), sent.ctypes.data, out.ctypes.data
        )
        self.clk += len(sent)
        return out
