# SPDX-License-Identifier: Apache-2.0
"""What stands around a node besides its axes: EEPROM, key-pad and displays on its links, a PS/2
keyboard, a wire-EDM machine and its
PC, and the serial line to another node. With a twin's node (Twin.devices), or without one, pins
driven from here.

    panel = twin.devices(0)
    panel.press(3), panel.release(3)                         a key of the pad, 0..33
    panel.lines, panel.digits                                what the displays show
    panel.type([0x1C, 0xF0, 0x1C], after_s=0.1)              a person at the keyboard
    panel.cuts                                               [EdmCut(start_s, end_s,
                                                             angle_start_rad, angle_end_rad, whole)]
"""

import ctypes
import math
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial

import numpy

from twin import build
from twin.machines.machine import HANDLE, LONG, REAL, TEXT, WHOLE, declare, state_class
from twin.parameters import tables as parameters

KEYS, LINES, COLUMNS, DIGITS, EEPROM_BYTES = 34, 4, 20, 8, 16384
MOST = 4096  # bytes taken at once
GOES_ON = 2**64 - 1

FUNCTIONS = {
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
    "devices_heard": (WHOLE, [HANDLE, HANDLE, HANDLE, WHOLE]),
    "devices_cuts": (WHOLE, [HANDLE]),
    "devices_cut": (None, [HANDLE, WHOLE, HANDLE, HANDLE, HANDLE]),
}
PEER_FUNCTIONS = {
    "peer_line_put": (None, [HANDLE, HANDLE, WHOLE, LONG]),
    "peer_line_garbage": (None, [HANDLE, REAL, LONG]),
    "peer_line_cut": (None, [HANDLE, WHOLE]),
    "peer_line_heard": (WHOLE, [HANDLE, HANDLE, WHOLE]),
    "peer_line_counts": (None, [HANDLE, HANDLE]),
}
BENCH_FUNCTIONS = {
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
            "machine_cutting",
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
    """What is there. The PC of the machine listens always; `edm` makes the machine do what its keys
    say. `table` is the axis,
    counted through all nodes, whose true angle is kept for each cut. `parameters` differ from
    devices.toml."""

    eeprom: bool = False  # 24AA128
    keypad: bool = False  # TCA8418
    display: bool = False  # HD44780 on a PCF8574
    keyboard: bool = False
    edm: bool = False
    table: int | None = None
    parameters: dict = field(default_factory=dict)

    @property
    def fitted(self):
        return sum(
            bool(there) << n
            for n, there in enumerate(
                (self.eeprom, self.keypad, self.display, self.keyboard, self.edm)
            )
        )


@dataclass(frozen=True)
class EdmCut:
    """A cut that the machine made: when, and the true angle of the table; end_s and angle_end_rad
    are None while it goes on.
    """

    start_s: float
    end_s: float | None
    angle_start_rad: float
    angle_end_rad: float | None
    whole: bool  # no alarm ended it


def pack(overrides, library):
    values = list(parameters.values(overrides, "devices").values())
    assert library.devices_parameters() == len(values)
    return (ctypes.c_double * len(values))(*values)


def taken(take):
    """All bytes that take(out, most) has to give."""
    out = ctypes.create_string_buffer(MOST)
    data = b""
    while count := take(out, MOST):
        data += out.raw[:count]
    return data


class DevicesHandle:
    """The devices of a node, by their address in the library."""

    def __init__(self, library, handle, clk_hz, now):
        self.library, self.handle, self.clk_hz, self.now = library, handle, clk_hz, now
        self.names, self.faults = (
            library.devices_state_names().decode(),
            library.devices_faults().decode().split(),
        )

    @property
    def state(self):
        """time_s and the values that devices.h's state_names lists."""
        kind, makers = state_class(self.names)
        out = (ctypes.c_double * len(makers))()
        self.library.devices_state(self.handle, self.now(), out)
        return kind(*(make(value) for make, value in zip(makers, out)))

    def set(self, **values):
        """Change parameters."""
        for name, value in values.items():
            if not self.library.devices_set(self.handle, name.encode(), value):
                raise KeyError(
                    f"devices have no parameter {name}; see {parameters.source('devices').name}"
                )

    def get(self, name):
        out = ctypes.c_double()
        if not self.library.devices_get(self.handle, name.encode(), ctypes.addressof(out)):
            raise KeyError(
                f"devices have no parameter {name}; see {parameters.source('devices').name}"
            )
        return out.value

    # faults: a dead device does nothing, a low line is shorted; the machine is in alarm, never ends
    # a cut, hears no start

    def inject(self, fault):
        self._fault(fault, True)

    def clear(self, fault):
        self._fault(fault, False)

    @contextmanager
    def fault(self, fault):
        self.inject(fault)
        try:
            yield self
        finally:
            self.clear(fault)

    def _fault(self, fault, on):
        if not self.library.devices_fault(self.handle, fault.encode(), on):
            raise KeyError(
                f"there is no fault {fault} of devices: there are {', '.join(self.faults)}"
            )

    # panel

    @property
    def eeprom(self):
        return ctypes.string_at(self.library.devices_eeprom(self.handle), EEPROM_BYTES)

    def write_eeprom(self, address, data):
        """As a programmer would, with the device out of its socket."""
        if address < 0 or address + len(data) > EEPROM_BYTES:
            raise IndexError(f"the EEPROM has {EEPROM_BYTES} bytes")
        ctypes.memmove(self.library.devices_eeprom(self.handle) + address, bytes(data), len(data))

    def press(self, key):
        """A key of the pad, 0..33: 7 a row."""
        self._key(key, True)

    def release(self, key):
        self._key(key, False)

    def _key(self, key, down):
        if key not in range(KEYS):
            raise IndexError(f"there is no key {key}: there are {KEYS}")
        self.library.devices_key(self.handle, key, down)

    @property
    def lines(self):
        """The four lines of the character display."""
        out = ctypes.create_string_buffer(LINES * COLUMNS)
        self.library.devices_text(self.handle, out)
        text = "".join(
            OWN_CHARACTERS.get(code, chr(code) if 0x20 <= code < 0x7F else "?")
            for code in out.raw[: LINES * COLUMNS]
        )
        return [text[n : n + COLUMNS] for n in range(0, len(text), COLUMNS)]

    @property
    def digits(self):
        """The numeric display; ? is a pattern that is no character."""
        out = ctypes.create_string_buffer(DIGITS)
        self.library.devices_segments(self.handle, out)
        return "".join(
            SEGMENTS.get(code & 0x7F, "?") + ("." if code & 0x80 else "")
            for code in out.raw[:DIGITS]
        )

    # keyboard and machine

    def type(self, codes, after_s=0.0):
        """Bytes that the keyboard sends, behind those that wait, not before after_s have passed."""
        codes = bytes(codes)
        self.library.devices_type(
            self.handle, codes, len(codes), self.now() + round(after_s * self.clk_hz)
        )

    def take_commands(self):
        """What the keyboard was told since the last take, arguments too."""
        return taken(partial(self.library.devices_commands, self.handle))

    def order(self, commands):
        """Bytes that the machine's PC sends to its keyboard, each after the answer to the one
        before.
        """
        commands = bytes(commands)
        self.library.devices_order(self.handle, commands, len(commands))

    def take_heard(self):
        """[(time in s, byte)] that the machine's PC received since the last take, answers to its
        orders too.
        """
        data, at = ctypes.create_string_buffer(MOST), (ctypes.c_uint64 * MOST)()
        heard = []
        while count := self.library.devices_heard(self.handle, data, at, MOST):
            heard += [(at[n] / self.clk_hz, data.raw[n]) for n in range(count)]
        return heard

    @property
    def cuts(self):
        found = []
        clk, angle, whole = (ctypes.c_uint64 * 2)(), (ctypes.c_double * 2)(), ctypes.c_int()
        for n in range(self.library.devices_cuts(self.handle)):
            self.library.devices_cut(self.handle, n, clk, angle, ctypes.addressof(whole))
            on = clk[1] == GOES_ON
            found.append(
                EdmCut(
                    clk[0] / self.clk_hz,
                    None if on else clk[1] / self.clk_hz,
                    angle[0],
                    None if on else angle[1],
                    bool(whole.value),
                )
            )
        return found


class PeerLineHandle:
    """One direction of the serial line between two nodes."""

    def __init__(self, library, handle, now):
        self.library, self.handle, self.now = library, handle, now

    def put(self, data):
        """Bytes onto the line beside those of the node that sends."""
        data = bytes(data)
        self.library.peer_line_put(self.handle, data, len(data), self.now())

    def garbage(self, rate_hz):
        """So often a few random bytes; 0 ends it."""
        self.library.peer_line_garbage(self.handle, rate_hz, self.now())

    def cut(self, cut=True):
        self.library.peer_line_cut(self.handle, cut)

    def take_heard(self):
        """The bytes that a receiver made of it since the last take."""
        return taken(partial(self.library.peer_line_heard, self.handle))

    @property
    def framing_errors(self):
        return self._counts()[0]

    @property
    def garbage_bytes(self):
        return self._counts()[1]

    def _counts(self):
        out = (ctypes.c_uint64 * 2)()
        self.library.peer_line_counts(self.handle, out)
        return list(out)


def machine_library():
    library = ctypes.CDLL(str(build.machine_library()))
    declare(library, {**FUNCTIONS, **PEER_FUNCTIONS, **BENCH_FUNCTIONS})
    return library


class DevicesBench(DevicesHandle):
    """Devices without a node. Time passes in run, watch and cable."""

    def __init__(self, around, seed=1, clk_hz=2_000_000):
        self.bench = None
        library = machine_library()
        packed = pack(around.parameters, library)
        self.bench = library.devices_bench_new(
            ctypes.addressof(packed), around.fitted, seed, clk_hz
        )
        super().__init__(
            library,
            library.devices_bench_of(self.bench),
            clk_hz,
            partial(library.devices_bench_now, self.bench),
        )

    def __del__(self):
        if self.bench:
            self.library.devices_bench_delete(self.bench)
        self.bench = None

    def pins(self, **levels):
        """Set pins that the node would drive; they hold from the next clk on."""
        which = sum(DRIVE[name] for name in levels)
        self.library.devices_bench_pins(
            self.bench, sum(DRIVE[name] for name, level in levels.items() if level), which
        )

    def run(self, seconds):
        self.run_clk(math.ceil(seconds * self.clk_hz - 1e-6))

    def run_clk(self, clk):
        self.library.devices_bench_run(self.bench, clk)

    def watch(self, seconds):
        """Run; {pin: levels after each clk}."""
        return self._levels(self.library.devices_bench_watch, seconds)

    def cable(self, seconds):
        """Run with the keyboard straight at the machine's port, no node between; {pin: levels after
        each clk}.
        """
        return self._levels(self.library.devices_bench_cable, seconds)

    def _levels(self, watch, seconds):
        out = numpy.zeros(round(seconds * self.clk_hz), dtype=numpy.uint16)
        watch(self.bench, len(out), out.ctypes.data)
        return {name: (out & bit > 0).astype(numpy.uint8) for name, bit in SENSE.items()}

    def level(self, pin):
        return bool(self.library.devices_bench_levels(self.bench) & SENSE[pin])

    def power_cut(self):
        self.library.devices_bench_power_cut(self.bench)

    def power_on(self):
        self.library.devices_bench_power_on(self.bench)


class PeerLineBench(PeerLineHandle):
    """One direction without nodes. Time passes in pass_levels."""

    def __init__(self, seed=1, clk_hz=1_000_000, baud=9600):
        self.bench, self.clk_hz, self.baud, self.clk = None, clk_hz, baud, 0
        library = machine_library()
        self.bench = library.peer_line_new(seed, clk_hz, baud)
        super().__init__(library, self.bench, lambda: self.clk)

    def __del__(self):
        if self.bench:
            self.library.peer_line_delete(self.bench)
        self.bench = None

    def pass_levels(self, levels):
        """Levels of the sender, one a clk; returns those of the receiver."""
        levels = numpy.ascontiguousarray(levels, dtype=numpy.uint8)
        out = numpy.empty_like(levels)
        self.library.peer_line_levels(
            self.bench, self.clk + 1, len(levels), levels.ctypes.data, out.ctypes.data
        )
        self.clk += len(levels)
        return out
