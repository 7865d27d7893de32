# SPDX-License-Identifier: Apache-2.0
"""Builds the twin's libraries: Verilator makes C++ of rtl/node.sv, g++ makes one shared library of
it and the machines.

Everything lies under build/twin/<hash of all that goes in>, so nothing is built twice. The firmware
is no part of it: it is written into the nodes' memory when a twin is made. With TWIN_SHORT_RUNS=1
in the environment, as in tests, a library is built in a fifth of the time, unless the usual one is
there already. With CROSSINGS=seed in the environment, each change of an asynchronous input may
arrive one cycle later; with POWER_UP=seed, flip-flops and memories of a node start in a random
state.

    python -m twin.build          builds both libraries and the firmware, and prints their paths
"""

import fcntl
import hashlib
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path

from firmware import build as firmware_build
from firmware.build import MEMORY_BYTES
from twin import crossings, netlist, registers, rising_edge, statements
from twin.parameters import tables as parameters

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
FIRMWARE = ROOT / "sw" / "firmware"
BUILD = ROOT / "build" / "twin"
TWIN, BUS = HERE / "nodes" / "twin.cpp", HERE / "nodes" / "bus.cpp"
TRAINING = "twin.nodes.training"
DRIVER_HEADERS = [  # that drivers of simulations include by their path in sw
    HERE.parent / name for name in ("experiments/relay_pins.h", "figures/common.h")
]
CORES = {"pythondata_cpu_picorv32": "verilog", "pythondata_cpu_serv": "verilog/rtl"}
HIDDEN = "-fvisibility=hidden"
VPI = ("verilated_cov", "verilated_dpi", "verilated_vpi")  # sources that cocotb needs as well
COMPILE = [
    "-std=c++17",
    "-O2",  # of -O3 and -O2, this is faster by a fiftieth
    "-march=native",
    "-fPIC",
    "-fno-strict-aliasing",
    "-fno-semantic-interposition",
    HIDDEN,
    "-fno-tree-vectorize",
    "-fno-tree-slp-vectorize",
    "-fno-tree-pre",  # with it, a cycle takes a fiftieth longer
    "-ffp-contract=off",
    "-w",
    "-pthread",
]
VERILATE = [
    "--cc",
    "-O3",
    "--no-timing",
    "--timescale",
    "1ns/1ps",
    "-Wall",
]
STATES = {  # of flip-flops after power-up: all 0, or random
    False: ["--x-assign", "fast", "--x-initial", "fast"],
    True: ["--x-assign", "unique", "--x-initial", "unique"],
}
# `rising_edge` by Verilator's own evaluation, twice a cycle: with the inputs, and at the edge
BOTH_LEVELS = """struct Rest {  // nothing rests
    void forget() {}
};
#include "nodes/registers.h"
const std::vector<twin::Register> REGISTERS;  // none can be flipped
inline void rising_edge(Vnode___024root& pins, Rest&) {
    for (int level = 0; level < 2; level++) {
        pins.clk = level;
        pins.vlSymsp->__Vm_modelp->eval();
    }
}
"""
# Where `rising_edge` is not Verilator's own evaluation, the latter evaluates the reset alone: it is
# compiled without optimisation, which takes a sixth of the time of g++.
SELDOM = """#include "Vnode__pch.h"
#include "Vnode.h"
#include "Vnode___024root.h"
#pragma GCC push_options
#pragma GCC optimize("O0")
{}#pragma GCC pop_options
"""
BY_PRODUCTS = ("*.o", "*.cpp", "*.h", "*.mk", "*.d", "*.dat", "*.gcda")
VERILATED = ["-DVERILATOR=1", "-DVM_COVERAGE=0", "-DVM_SC=0", "-DVM_TIMING=0", "-DVM_TRACE=0"]
# The twin is compiled twice, for a fifth less time a cycle: the first library counts in a short run
# how often each branch is taken, and the code of the second one is laid out by these counts.
COUNT_BRANCHES = ["-fprofile-generate", "-fprofile-update=single"]
USE_COUNTS = ["-fprofile-use", "-fprofile-partial-training"]
# Tests and the short forms of figures run each library for a minute at most. It is compiled once,
# at -O1, in a fifth of the time. Branches stay branches: they are foreseen better than conditional
# moves, so a cycle takes hardly longer than after training. The results are the same.
SHORT_RUNS = "TWIN_SHORT_RUNS"  # in the environment, not empty: the twin is for short runs
COMPILE_SOON = [
    *("-O1" if flag == "-O2" else flag for flag in COMPILE),
    "-fno-if-conversion",
    "-fno-if-conversion2",
]
OWN = [
    "-std=c++17",
    "-O3",
    "-march=native",
    "-ffp-contract=off",
    "-fPIC",
    "-Wall",
    "-Wextra",
    "-Werror",
]


class BuildError(Exception):
    """One line that states what is missing or what failed."""


def package(name: str, why: str) -> Path:
    """Folder of an installed package; BuildError states why it is needed."""
    spec = find_spec(name)
    if not spec or not spec.submodule_search_locations:
        raise BuildError(
            f"the package {name} is missing ({why}): pip install it into the virtual environment"
        )
    return Path(spec.submodule_search_locations[0])


def compiler() -> str:
    """The C++ compiler: CXX of the environment, or g++."""
    found = shutil.which(os.environ.get("CXX", "g++"))
    if not found:
        raise BuildError(
            "g++ is missing, the twin needs it: apt install g++ (or set CXX to another compiler)"
        )
    return found


def for_short_runs() -> bool:
    """Whether the environment asks for builds that are soon ready rather than fast."""
    return bool(os.environ.get(SHORT_RUNS))


def compile_flags() -> list[str]:
    """How Verilated C++ is compiled once."""
    return COMPILE_SOON if for_short_runs() else COMPILE


def verilate_flags() -> list[str]:
    """How Verilator makes C++: after power-up all is 0 or, with POWER_UP in the environment, in a
    random state.
    """
    return [*VERILATE, *STATES[bool(os.environ.get("POWER_UP"))]]


def learns(tool: str) -> bool:
    """Whether the compiler is GCC, whose profiles need no further program."""
    return "Free Software Foundation" in run([tool, "--version"], "the compiler")


def report(text: str) -> None:
    """Report progress on standard error."""
    print(f"twin: {text}", file=sys.stderr, flush=True)


def run(
    command: Sequence[object],
    what: str,
    cwd: Path | None = None,
    environment: Mapping[str, str] | None = None,
) -> str:
    """The output of a command; BuildError has its first error, and a file the whole output."""
    result = subprocess.run(
        [str(c) for c in command], cwd=cwd, env=environment, capture_output=True, text=True
    )
    if result.returncode:
        output = result.stdout + result.stderr
        log = BUILD / f"{what.split()[0].replace('/', '_')}.log"
        log.write_text(output)
        lines = [line.strip() for line in output.splitlines() if line.strip()] or ["no output"]
        first = next(
            (line for line in lines if "%Error" in line or "%Warning" in line or "error:" in line),
            lines[-1],
        )
        raise BuildError(f"{what} failed: {first} (all of it: {log.relative_to(ROOT)})")
    return result.stdout


def digest(files: Iterable[Path], *more: object) -> str:
    """A name for the contents of files and whatever else a build depends on."""
    total = hashlib.sha256(repr(more).encode())
    for file in files:
        total.update(str(file).removeprefix(str(ROOT)).encode() + b"\0" + file.read_bytes())
    return total.hexdigest()[:16]


def own_sources() -> list[Path]:
    """All sources of the twin."""
    return sorted(p for p in HERE.rglob("*") if p.suffix in (".cpp", ".h", ".toml", ".py"))


def made_once(folder: Path, result: str, make: Callable[[Path], None]) -> Path:
    """The file `result` in `folder`. make(folder) makes it in a temporary folder, which then
    replaces this one.
    """
    if (folder / result).exists():
        return folder / result
    BUILD.mkdir(parents=True, exist_ok=True)
    with open(BUILD / f"{folder.name}.lock", "w") as lock:  # parallel tests may want the same build
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / result).exists():
            with tempfile.TemporaryDirectory(dir=BUILD, prefix="making-") as making:
                make(Path(making))
                shutil.rmtree(folder, ignore_errors=True)
                shutil.copytree(
                    making,
                    folder,
                    ignore=shutil.ignore_patterns(*BY_PRODUCTS),
                )
    return folder / result


def machine_sources() -> list[Path]:
    """C++ of the machines: all but the nodes and their bus."""
    return [file for file in sorted(HERE.rglob("*.cpp")) if file.parent.name != "nodes"]


def machine_library() -> Path:
    """libmachine.so: the machines without a node. No Verilator needed, a few seconds."""
    tool = compiler()

    def make(folder: Path) -> None:
        (folder / "parameters.h").write_text(parameters.header())
        run(
            [
                tool,
                *OWN,
                "-shared",
                f"-I{folder}",
                f"-I{HERE}",
                *machine_sources(),
                "-o",
                folder / "libmachine.so",
            ],
            "g++ of the machines",
        )

    return made_once(BUILD / f"machine-{digest(own_sources(), tool)}", "libmachine.so", make)


def common_objects() -> Path:
    """libcommon.a: the machines and the bus, the same for every twin."""
    tool, sources = compiler(), [*machine_sources(), BUS]
    flags = [*OWN, "-fvisibility=hidden"]

    def make(folder: Path) -> None:
        (folder / "parameters.h").write_text(parameters.header())
        objects = [folder / f"{file.stem}.o" for file in sources]
        for file, result in zip(sources, objects):
            command = [tool, *flags, f"-I{folder}", f"-I{HERE}", "-c", file, "-o", result]
            run(command, f"g++ of {file.name}")
        run(["ar", "rcs", folder / "libcommon.a", *objects], "ar")

    return made_once(BUILD / f"common-{digest(own_sources(), tool, flags)}", "libcommon.a", make)


def rtl_path() -> list[Path]:
    """Every folder in which a module is found by its name: the model of the crossings first."""
    directories = sorted({p.parent for p in (ROOT / "rtl").rglob("*.sv")})
    cores = [package(name, "a soft core") / place for name, place in CORES.items()]
    return crossings.folders() + directories + cores


def rtl_sources() -> list[Path]:
    """All files of the RTL, and those that are found before them."""
    return sorted(p for d in (ROOT / "rtl", *crossings.folders()) for p in d.rglob("*.sv"))


def runtime(tool: str, verilator: Path, vpi: bool = False) -> Path:
    """Verilator's own run-time part, the same for every design; with the interface for cocotb and
    the counters of coverage if `vpi`, where cocotb takes most of the time.
    """
    names = ("verilated", "verilated_threads", *(VPI if vpi else ()))
    files = [verilator / "include" / f"{name}.cpp" for name in names]
    flags = [flag for flag in COMPILE_SOON if flag != HIDDEN] if vpi else COMPILE

    def make(folder: Path) -> None:
        objects = []
        for file in files:
            objects.append(folder / f"{file.stem}.o")
            run(
                [
                    tool,
                    *flags,
                    "-DVERILATOR=1",
                    f"-I{verilator / 'include'}",
                    f"-I{verilator / 'include' / 'vltstd'}",
                    "-c",
                    file,
                    "-o",
                    objects[-1],
                ],
                "g++ of the run-time part",
            )
        run(["ar", "rcs", folder / "libverilated.a", *objects], "ar")

    return made_once(BUILD / f"runtime-{digest(files, tool, flags)}", "libverilated.a", make)


def verilate(
    folder: Path,
    verilator: Path,
    source: Path,
    prefix: str,
    values: Mapping[str, object],
    *more: object,
) -> None:
    """C++ of the module in a source file, as a class named by the prefix; the modules below it are
    found by name.
    """
    find = [word for path in rtl_path() for word in ("-y", path)]
    run(
        [
            verilator / "bin" / "verilator_bin",
            *verilate_flags(),
            "--prefix",
            prefix,
            "--top-module",
            source.stem,
            *(f"-G{name}={value}" for name, value in values.items()),
            *find,
            "+libext+.sv+.v",
            *more,
            source,
            "--Mdir",
            folder,
        ],
        f"verilator of {source.stem}",
        environment={**os.environ, "VERILATOR_ROOT": str(verilator)},
    )


def simulation(driver: Path, source: Path, firmware: str | None = None, **parameters: int) -> Path:
    """The program made of a C++ driver and the Verilated module of a source file, which the driver
    includes as Vtop.h; with the
    firmware of an image when it is named, whose register accesses the driver serves."""
    tool, verilator = compiler(), package("verilator", "it makes C++ of the RTL")
    flags = compile_flags()
    support, files = (
        runtime(tool, verilator),
        [driver, source, *rtl_sources(), *DRIVER_HEADERS],
    )
    own, include = [], [f"-I{FIRMWARE}", f"-I{HERE.parent}"]
    if firmware:
        sources = firmware_build.sources_of(firmware)
        own = [path for path in sources if path.suffix == ".c"]
        files, include = (
            [*files, *sources],
            [*include, "-DMOIRE_REGISTER_ACCESS", *firmware_build.defines_of(firmware)],
        )

    def make(folder: Path) -> None:
        verilate(folder, verilator, source, "Vtop", parameters)
        whole = folder / "whole.cpp"  # Verilator's headers are read once
        parts = sorted(folder.glob("Vtop*.cpp"))
        whole.write_text("".join(f'#include "{part.name}"\n' for part in parts))
        objects = []
        for file in own:
            objects.append(folder / f"{file.stem}.o")
            run(
                [
                    tool,
                    "-x",
                    "c",
                    "-std=c11",
                    "-O2",
                    "-Dmain=firmware_main",
                    *include,
                    "-c",
                    file,
                    "-o",
                    objects[-1],
                ],
                f"g++ of {file.name}",
            )
        run(
            [
                tool,
                *flags,
                *VERILATED,
                *include,
                f"-I{folder}",
                f"-I{verilator / 'include'}",
                driver,
                whole,
                *objects,
                support,
                "-o",
                folder / "run",
            ],
            f"g++ of {driver.name}",
        )

    name = digest(
        files,
        tool,
        flags,
        verilate_flags(),
        parameters,
        (verilator / "bin" / "verilator_bin").stat().st_size,
    )
    return made_once(ROOT / "build" / "simulation" / f"{driver.stem}-{name}", "run", make)


def node_values(
    clk_hz: int, axes: int, file: str, node: Mapping[str, int | str]
) -> dict[str, int | str]:
    """The parameters of rtl/node.sv, the usual ones unless `node` has others."""
    usual: dict[str, int | str] = {
        "CLK_HZ": clk_hz,
        "AXES": axes,
        "MEMORY_BYTES": MEMORY_BYTES,
        "FIRMWARE": file,
    }
    return usual | dict(node)


def verilate_node(
    folder: Path, verilator: Path, clk_hz: int, axes: int, node: Mapping[str, int | str]
) -> None:
    """C++ of a node, and the header that names its memory. Random crossings read a pin more than
    once, which sw/twin/rising_edge.py does not handle: Verilator evaluates such a node itself.
    """
    values = node_values(clk_hz, axes, '""', node)
    verilate(
        folder,
        verilator,
        ROOT / "rtl" / "node.sv",
        "Vnode",
        values,
        "--no-decoration",
        ROOT / "rtl" / "cpu" / "cores.vlt",
    )
    code = (folder / "Vnode___024root.h").read_text()
    words = [
        line.split()[-1].rstrip(";")
        for line in code.splitlines()
        if line.rstrip().endswith("u_memory__DOT__memory;")
    ]
    if len(words) != 1:
        raise BuildError(
            "the memory of the soft core was not found in Verilator's output: "
            "has node_memory been renamed?"
        )
    try:
        if crossings.seed():
            evaluation = BOTH_LEVELS
        else:
            design = rising_edge.Design.read(folder)
            evaluation = rising_edge.function(design) + registers.header(folder, design)
    except statements.FormError as error:
        raise BuildError(
            f"Verilator's code is not as sw/twin/rising_edge.py expects: {error}"
        ) from error
    (folder / "verilated_node.h").write_text(
        f"{head_of_node(folder, values, seldom=evaluation != BOTH_LEVELS)}#include <cstring>\n"
        f"#define NODE_MEMORY {words[0]}\n{evaluation}"
    )


def head_of_node(folder: Path, values: Mapping[str, int | str], seldom: bool = False) -> str:
    """The first lines of the header of a Verilated node: its sources, whose evaluation is used
    seldom or not, and its parameters that the twin must know.
    """
    includes = "".join(f'#include "{p.name}"\n' for p in sorted(folder.glob("Vnode*.cpp")))
    numbers = {
        "CLK_HZ": int(values["CLK_HZ"]),
        "AXES": int(values["AXES"]),
        "MEMORY_WORDS": int(values["MEMORY_BYTES"]) // 4,
        "CODE_WORDS": int(values.get("CODE_BYTES", 0)) // 4,
    }
    constants = ", ".join(f"{name} = {number}" for name, number in numbers.items())
    serial = "true" if values.get("HAS_SERIAL_CORE") else "false"
    if seldom:
        includes = SELDOM.format(includes)
    return (
        "// SPDX-License-Identifier: Apache-2.0\n// Made by sw/twin/build.py.\n#pragma once\n"
        f"{includes}"
        f"constexpr int {constants};\nconstexpr bool SERIAL_CORE = {serial};\n"
    )


def netlist_of_node(
    chosen: str, clk_hz: int, axes: int, node: Mapping[str, int | str], words: Sequence[int]
) -> list[Path]:
    """Sources of the netlist of a node, whose memory has these words since synthesis; a serial core
    reads them from its flash.
    """
    image = BUILD / f"{digest([], list(words))}.hex"
    BUILD.mkdir(parents=True, exist_ok=True)
    file = "" if node.get("HAS_SERIAL_CORE") else str(image.relative_to(ROOT))
    values = node_values(clk_hz, axes, file, node)
    in_memory = words[: int(values["MEMORY_BYTES"]) // 4]  # others are in the flash
    image.write_text("".join(f"{word:08x}\n" for word in in_memory))
    return netlist.sources(chosen, ROOT / "rtl" / "node.sv", values, rtl_path())


def verilate_netlist(
    folder: Path,
    verilator: Path,
    sources: Sequence[Path],
    clk_hz: int,
    axes: int,
    node: Mapping[str, int | str],
) -> None:
    """C++ of the netlist of a node."""
    run(
        [
            *[verilator / "bin" / "verilator_bin", *verilate_flags(), "-Wno-lint", "-Wno-style"],
            *["-Wno-fatal", "--prefix", "Vnode", "--top-module", "node", *sources],
            *["--Mdir", folder],
        ],
        "verilator of the netlist of the node",
        environment={**os.environ, "VERILATOR_ROOT": str(verilator)},
    )
    head = head_of_node(folder, node_values(clk_hz, axes, "", node))
    (folder / "verilated_node.h").write_text(f"{head}{BOTH_LEVELS}")


def twin_library(
    clk_hz: int = 2_400_000,
    axes: int = 1,
    node: Mapping[str, int | str] | None = None,
    words: Sequence[int] = (),
    family: str | None = None,
) -> Path:
    """libtwin.so: Verilated nodes, machines and line. node: more parameters of rtl/node.sv, {name:
    value}. With a family (ecp5, ice40, gowin), which may be followed by options of its synthesis,
    or NETLIST=family in the environment, the nodes are netlists with the firmware `words` in their
    memory.
    """
    tool = compiler()
    family = family or os.environ.get("NETLIST")
    cells = netlist_of_node(family, clk_hz, axes, node or {}, words) if family else []
    verilator = package("verilator", "it makes C++ of the RTL")
    sources = [
        *own_sources(),
        *rtl_sources(),
        *sorted((ROOT / "rtl").rglob("*.vlt")),
        *cells,
        package("pythondata_cpu_picorv32", "the soft core") / "verilog" / "picorv32.v",
    ]
    verilator_bytes = (verilator / "bin" / "verilator_bin").stat().st_size

    def folder_of(*flags: Sequence[str]) -> Path:
        design = (clk_hz, axes, sorted((node or {}).items()), tool, verilator_bytes)
        return BUILD / f"twin-{digest(sources, *design, verilate_flags(), *flags)}"

    folder, soon = folder_of(COMPILE, COUNT_BRANCHES, USE_COUNTS), bool(cells) or for_short_runs()
    if (folder / "libtwin.so").exists():
        return folder / "libtwin.so"
    if soon:
        folder = folder_of(COMPILE_SOON)
        if (folder / "libtwin.so").exists():
            return folder / "libtwin.so"
    start = time.monotonic()
    report(
        f"building {folder.relative_to(ROOT)} "
        f"(clk {clk_hz} Hz, {axes} {'axis' if axes == 1 else 'axes'} a node)"
    )

    def make(folder: Path) -> None:
        (folder / "parameters.h").write_text(parameters.header())
        if cells:
            verilate_netlist(folder, verilator, cells, clk_hz, axes, node or {})
        else:
            verilate_node(folder, verilator, clk_hz, axes, node or {})
        report(f"verilated after {time.monotonic() - start:.0f} s")
        include = [f"-I{folder}", f"-I{HERE}", f"-I{verilator / 'include'}"]
        verilated = folder / f"{TWIN.stem}.o"

        def make_library(name: str, compile: Sequence[str], profile: Sequence[str] = ()) -> None:
            command = [tool, *compile, *VERILATED, *profile, *include, "-c", TWIN, "-o", verilated]
            run(command, f"g++ of {TWIN.name}")
            whole = ["-Wl,--whole-archive", common.result(), "-Wl,--no-whole-archive"]
            command = [tool, "-shared", "-pthread", *profile, verilated, *whole, support.result()]
            run([*command, "-o", folder / name], "linking the twin")

        with ThreadPoolExecutor(1) as pool:
            common = pool.submit(common_objects)
            support = pool.submit(runtime, tool, verilator)
            if soon:
                make_library("libtwin.so", COMPILE_SOON)
            elif not learns(tool):
                make_library("libtwin.so", COMPILE)
            else:
                make_library("training.so", COMPILE, COUNT_BRANCHES)
                run(
                    [sys.executable, "-m", TRAINING, folder / "training.so", axes, clk_hz],
                    "training of the twin",
                    environment={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
                )
                (folder / "training.so").unlink()
                report(f"trained after {time.monotonic() - start:.0f} s")
                make_library("libtwin.so", COMPILE, USE_COUNTS)

    library = made_once(folder, "libtwin.so", make)
    report(f"built after {time.monotonic() - start:.0f} s")
    return library


def firmware(
    image: str = "axis",
    axes: int | None = None,
    core: str = "soft",
    update: bool = False,
    memory: int = MEMORY_BYTES,
) -> list[int]:
    """The words of an image of the firmware for nodes of so many axes, or of as many as is usual,
    with this soft core and memory, with or without updates over the bus; built first when it is not
    fresh. With the core `flash`, the words of the flash follow those of the whole memory.
    """
    axes = firmware_build.IMAGES[image].usual_axes if axes is None else axes
    BUILD.mkdir(parents=True, exist_ok=True)
    with open(BUILD / "firmware.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        run(
            [
                *[sys.executable, "-m", "firmware.build", "--image", image, "--axes", axes],
                *["--memory", memory, "--core", core, *(["--update"] if update else [])],
            ],
            "the firmware's build",
        )
        stem = firmware_build.stem_of(image, axes, core, update)
        made = ROOT / "build" / "firmware" / f"{stem}.hex"
        words = words_of(made)
        if core == "flash":
            code = made.with_suffix(".flash").read_bytes()
            words += [0] * (memory // 4 - len(words))
            words += [word for (word,) in struct.iter_unpack("<I", code)]
        return words


def words_of(file: Path) -> list[int]:
    """Words of a $readmemh file, the zeros at its end left out."""
    words, address = {}, 0
    for token in Path(file).read_text().split():
        if token.startswith("@"):
            address = int(token[1:], 16)
        elif not token.startswith("//"):
            words[address] = int(token, 16)
            address += 1
    used = max((n for n, word in words.items() if word), default=-1) + 1
    return [words.get(n, 0) for n in range(used)]


if __name__ == "__main__":
    try:
        print(machine_library().relative_to(ROOT))
        print(twin_library().relative_to(ROOT))
        firmware()
    except BuildError as error:
        sys.exit(f"twin: {error}")
