# SPDX-License-Identifier: Apache-2.0
"""The machine models: a handle for the machine of an axis, and a machine without a node, whose pins
are driven from Python.
"""

import ctypes
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import make_dataclass
from functools import cache, partial
from typing import Any

import numpy
import numpy.typing

from twin import build
from twin.parameters import tables as parameters

HANDLE, REAL, WHOLE, LONG, TEXT = (
    ctypes.c_void_p,
    ctypes.c_double,
    ctypes.c_int,
    ctypes.c_uint64,
    ctypes.c_char_p,
)
Functions = Mapping[str, tuple[Any, list[Any]]]  # {name: (result, [arguments])}
Trace = dict[str, numpy.typing.NDArray[numpy.float64]]

FUNCTIONS: Functions = {
    "machine_parameters": (WHOLE, [TEXT]),
    "machine_state_names": (TEXT, [HANDLE]),
    "machine_faults": (TEXT, [HANDLE]),
    "machine_state": (None, [HANDLE, LONG, HANDLE]),
    "machine_set": (WHOLE, [HANDLE, TEXT, REAL]),
    "machine_get": (WHOLE, [HANDLE, TEXT, HANDLE]),
    "machine_fault": (WHOLE, [HANDLE, TEXT, WHOLE, WHOLE]),
    "machine_set_position": (None, [HANDLE, REAL]),
    "machine_push": (None, [HANDLE, REAL]),
    "machine_trace": (None, [HANDLE, LONG]),
    "machine_trace_size": (WHOLE, [HANDLE]),
    "machine_trace_take": (None, [HANDLE, HANDLE]),
}
BENCH_FUNCTIONS: Functions = {
    "bench_new": (HANDLE, [TEXT, LONG, REAL, HANDLE]),
    "bench_delete": (None, [HANDLE]),
    "bench_machine": (HANDLE, [HANDLE]),
    "bench_now": (LONG, [HANDLE]),
    "bench_levels": (ctypes.c_uint, [HANDLE]),
    "bench_pins": (None, [HANDLE, ctypes.c_uint, ctypes.c_uint]),
    "bench_run": (None, [HANDLE, LONG]),
    "bench_watch": (None, [HANDLE, LONG, HANDLE]),
    "bench_bridge": (None, [HANDLE, LONG, ctypes.c_uint32, ctypes.c_int32, WHOLE]),
    "bench_steps": (
        None,
        [HANDLE, ctypes.c_int64, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32],
    ),
    "bench_card": (None, [HANDLE, LONG, HANDLE]),
    "bench_frame": (None, [HANDLE, ctypes.c_uint32, WHOLE]),
}

# pins, in the order of machine.h
DRIVE = {
    name: 1 << n
    for n, name in enumerate(
        (
            "adc_cs_n",
            "adc_sclk",
            "bridge_a",
            "bridge_b",
            "drive_enable",
            "step",
            "direction",
            "dac_cs_n",
            "dac_sclk",
            "dac_sdi",
        )
    )
}
SENSE = {
    name: 1 << n
    for n, name in enumerate(
        (
            "encoder_a",
            "encoder_b",
            "encoder_z",
            "adc_sin",
            "adc_cos",
            "limit_low_open",
            "limit_high_open",
            "drive_fault",
            "sensor_rx",
        )
    )
}
DAC_ZERO, DAC_BITS = 32768, 16


def declare(library: ctypes.CDLL, functions: Functions) -> None:
    """Tell ctypes the results and the arguments of the functions of a library."""
    for name, (result, arguments) in functions.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments


def pack(
    kind: str, overrides: Mapping[str, float], library: ctypes.CDLL
) -> "ctypes.Array[ctypes.c_double]":
    """The parameters of a machine as its C++ structure."""
    values = list(parameters.values(overrides, kind).values())
    if library.machine_parameters(kind.encode()) != len(values):
        raise KeyError(f"the machine {kind} does not fit an axis")
    return (ctypes.c_double * len(values))(*values)


class State:
    """The true state of a machine: time_s and the values that state_names of machine.h lists."""

    position_m: float

    @property
    def position_nm(self) -> float:
        return self.position_m * 1e9


@cache
def state_class(names: str) -> tuple[type[Any], list[Callable[[float], Any]]]:
    """A data class of the values, and the conversion of each from a double."""
    makers: list[Callable[[float], Any]] = [
        {"?": bool, "#": int}.get(name[-1], float) for name in names.split()
    ]
    fields: list[Any] = [(name.rstrip("?#"), maker) for name, maker in zip(names.split(), makers)]
    return make_dataclass("State", fields, bases=(State,), frozen=True), makers


class MachineHandle:
    """The machine of an axis, by its address in the library."""

    def __init__(
        self,
        library: ctypes.CDLL,
        handle: int,
        kind: str,
        clk_hz: int,
        now: Callable[[], int],
    ) -> None:
        self.library, self.handle, self.kind, self.clk_hz, self.now = (
            library,
            handle,
            kind,
            clk_hz,
            now,
        )
        self.names = library.machine_state_names(handle).decode()
        self.faults = library.machine_faults(handle).decode().split()

    @property
    def state(self) -> Any:
        """The true state now, see State."""
        kind, makers = state_class(self.names)
        out = (ctypes.c_double * len(makers))()
        self.library.machine_state(self.handle, self.now(), out)
        return kind(*(make(value) for make, value in zip(makers, out)))

    def _unknown(self, name: str) -> KeyError:
        return KeyError(
            f"the machine {self.kind} has no parameter {name} to change while it runs; "
            f"see {parameters.source(self.kind).name}"
        )

    def set(self, **values: float) -> None:
        """Change parameters of the running machine; its time step is fixed."""
        for name, value in values.items():
            if not self.library.machine_set(self.handle, name.encode(), value):
                raise self._unknown(name)

    def get(self, name: str) -> float:
        """A parameter of the running machine, in the unit of its table."""
        out = ctypes.c_double()
        if not self.library.machine_get(self.handle, name.encode(), ctypes.addressof(out)):
            raise self._unknown(name)
        return out.value

    def set_position(self, position: float) -> None:
        """Move it there by hand, in m or rad: at standstill, without tension."""
        self.library.machine_set_position(self.handle, position)

    def push(self, force: float) -> None:
        """An outside force, N or Nm, from now on."""
        self.library.machine_push(self.handle, force)

    def inject(self, fault: str, level: bool = False) -> None:
        """Begin a fault; `level` is the level of a stuck pin."""
        self._fault(fault, True, level)

    def clear(self, fault: str) -> None:
        """End a fault."""
        self._fault(fault, False, False)

    @contextmanager
    def fault(self, fault: str, level: bool = False) -> "Iterator[MachineHandle]":
        """A fault as long as the block lasts."""
        self.inject(fault, level)
        try:
            yield self
        finally:
            self.clear(fault)

    def _fault(self, fault: str, on: bool, level: bool) -> None:
        if not self.library.machine_fault(self.handle, fault.encode(), on, level):
            raise KeyError(
                f"a machine {self.kind} has no fault {fault}: there are {', '.join(self.faults)}"
            )

    def trace(self, rate_hz: float = 10_000) -> None:
        """Record states from now on, at a rate rounded to whole time steps of the machine; 0 ends
        the recording.
        """
        self.library.machine_trace(
            self.handle, max(1, round(self.clk_hz / rate_hz)) if rate_hz else 0
        )

    def take_trace(self) -> Trace:
        """{name: array} of what was recorded since the previous call."""
        values = numpy.empty(self.library.machine_trace_size(self.handle))
        self.library.machine_trace_take(self.handle, values.ctypes.data)
        names = [name.rstrip("?#") for name in self.names.split()]
        return dict(zip(names, values.reshape(-1, len(names)).T.copy()))


class StepCard(ctypes.Structure):
    """The step generator and the counter of a plain card at the pins of a machine, step_card.h."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("accumulator", "emitted", "count", "latched")),
        *((name, ctypes.c_uint64) for name in ("changed_at", "ready_at", "errors")),
        ("rate", ctypes.c_int32),
        *((name, ctypes.c_uint32) for name in ("high", "armed", "enabled")),
    ]
    accumulator: int
    emitted: int
    count: int
    latched: int
    changed_at: int
    ready_at: int
    errors: int
    rate: int
    high: int
    armed: int
    enabled: int


class Machine(MachineHandle):
    """A machine without a node. Time passes in run, watch, bridge, steps, with_card and dac."""

    PERIOD = 200  # of the PWM in cycles: 20 kHz

    def __init__(self, kind: str, seed: int = 1, clk_hz: int = 4_000_000, **values: float) -> None:
        self.bench: int | None = None
        library = ctypes.CDLL(str(build.machine_library()))
        declare(library, {**FUNCTIONS, **BENCH_FUNCTIONS})
        packed = pack(kind, values, library)
        self.bench = library.bench_new(kind.encode(), seed, clk_hz, ctypes.addressof(packed))
        super().__init__(
            library,
            library.bench_machine(self.bench),
            kind,
            clk_hz,
            partial(library.bench_now, self.bench),
        )

    def __del__(self) -> None:
        if self.bench:
            self.library.bench_delete(self.bench)
        self.bench = None

    def clk(self, seconds: float) -> int:
        """A time in cycles."""
        return round(seconds * self.clk_hz)

    def pins(self, **levels: bool) -> None:
        """Set pins that the node would drive, from the next cycle on."""
        which = sum(DRIVE[name] for name in levels)
        self.library.bench_pins(
            self.bench, sum(DRIVE[name] for name, level in levels.items() if level), which
        )

    def run(self, seconds: float) -> None:
        """Let time pass."""
        self.library.bench_run(self.bench, self.clk(seconds))

    def watch(self, seconds: float) -> dict[str, numpy.typing.NDArray[numpy.int8]]:
        """Run; {pin: levels after each cycle}."""
        out = numpy.zeros(self.clk(seconds), dtype=numpy.uint16)
        self.library.bench_watch(self.bench, len(out), out.ctypes.data)
        return {name: (out & bit > 0).astype(numpy.int8) for name, bit in SENSE.items()}

    def level(self, pin: str) -> bool:
        """The level of a pin that the machine drives."""
        return bool(self.library.bench_levels(self.bench) & SENSE[pin])

    def bridge(self, seconds: float, duty: float = 0.0, brakes: bool = True) -> None:
        """Run with the drive enabled; duty -1..1 of the supply, braking or coasting in the
        remainder of each PWM period.
        """
        self.library.bench_bridge(
            self.bench, self.clk(seconds), self.PERIOD, round(duty * self.PERIOD), brakes
        )

    def steps(
        self, count: int, rate_hz: float, high_s: float = 2e-6, setup_s: float = 2e-6
    ) -> None:
        """Send `count` pulses of step; a negative count moves down."""
        self.library.bench_steps(
            self.bench, count, self.clk(1 / rate_hz), self.clk(high_s), self.clk(setup_s)
        )

    def with_card(self, seconds: float, card: StepCard) -> None:
        """Run with a card at the pins of step, direction and enable, and at the encoder."""
        self.library.bench_card(self.bench, self.clk(seconds), ctypes.addressof(card))

    def dac(self, code: int, bits: int = DAC_BITS) -> None:
        """Send one frame to the DAC."""
        self.library.bench_frame(self.bench, code, bits)
