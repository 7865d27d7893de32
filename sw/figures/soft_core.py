# SPDX-License-Identifier: Apache-2.0
"""The figure of the soft core's memory, and a comparison of soft cores by the firmware's own work.

python -m figures.soft_core             bytes of program, cycles of each section of core_work.c on
                                        the Verilated core
python -m figures.soft_core --area      LUT and MHz of each core on an ECP5
python -m figures.soft_core --options   LUT of PicoRV32 with and without each of its options
python -m figures.soft_core --sizes     writes the tables of images in docs/soft_core.md

VexRiscv is measured if its package pythondata-cpu-vexriscv is installed. docs/soft_core.md has the
results.
"""

import argparse
import itertools
import re
import shutil
import struct
import tempfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from figures.common import Figure, Quick, console
from figures.synthesis import BUILD, ECP5, NEXTPNR_ECP5, lut4s, netlist_of, placed, source_of
from firmware import build as tools
from moire.made.registers import MAP_CRC
from tables import made_files
from twin import build
from twin.build import ROOT

HERE = Path(__file__).resolve().parent
SMALLER_BYTES = 65536
PAGE = ROOT / "docs" / "soft_core.md"
BEGIN, END = "<!-- sizes -->", "<!-- /sizes -->"
BEGIN_FLASH, END_FLASH = "<!-- flash sizes -->", "<!-- /flash sizes -->"
IN_FLASH = (("axis", 1), ("stream", 1), ("steps", 3), ("station", 2))  # images, axes
CLK_HZ = 60_000_000
MOST_CYCLES = 20_000_000
SECTIONS = ("start", "rounds", "requests", "plans", "pieces", "retarget", "waves")
# what the firmware reads of a node with one axis that has sine and cosine, {address: value}
NODE = {0x000: MAP_CRC, 0x004: CLK_HZ, 0x008: 1, 0xCA8: 4}
SEEDS = (1, 2, 3)
IMAGES = {  # the image, its axes: its nodes
    ("axis", 1): "S0: sine and cosine, calibration, segments, drives",
    ("axis", 8): "the same",
    ("stream", 1): "as `axis`, with [streams](stream.md)",
    ("stream", 8): "the same",
    ("steps", 8): "A/B/Z with drives, without sine and cosine",
    ("steps_stream", 3): "as `steps`, with streams, for [LinuxCNC](linuxcnc.md)",
    ("counter", 4): "A/B/Z without drives: positions, index, scope",
    ("station", 2): "S4: table, job, panel, EEPROM",
}


class Core(NamedTuple):
    instructions: str  # that the compiler may use, as zig names them
    source: Path  # of the top module of the simulation
    package: str = ""  # whose Verilog the core needs besides ours
    file: str = ""  # of the package
    in_flash: bool = False  # it executes from a flash what it needs seldom


SOFT_CORE = source_of("soft_core")
VEXRISCV = "pythondata_cpu_vexriscv"
IN_ITS_PLACE = HERE / "vexriscv_core.sv"
CORES = {
    "soft_core, rv32im": Core("generic_rv32+m-a-f-d-c", SOFT_CORE),
    "soft_core, rv32imc": Core("generic_rv32+m-a-f-d+c", SOFT_CORE),
    "soft_core, rv32imc, in part from a flash": Core(
        "generic_rv32+m-a-f-d+c", SOFT_CORE, in_flash=True
    ),
    "VexRiscv_IMAC, rv32imc": Core(
        "generic_rv32+m-a-f-d+c", IN_ITS_PLACE, VEXRISCV, "VexRiscv_IMAC.v"
    ),
    "VexRiscv_Lite, rv32im": Core(
        "generic_rv32+m-a-f-d-c", IN_ITS_PLACE, VEXRISCV, "VexRiscv_Lite.v"
    ),
}
PICORV32 = {  # the options of soft_core.sv, and what is changed of them
    "COMPRESSED_ISA": 1,
    "ENABLE_PCPI": 1,
    "ENABLE_COUNTERS": 0,
    "ENABLE_COUNTERS64": 0,
    "BARREL_SHIFTER": 1,
}
CHANGES: Mapping[str, Mapping[str, int]] = {
    "as it is": {},
    "without compressed instructions": {"COMPRESSED_ISA": 0},
    "with its own divider": {"ENABLE_DIV": 1},
    "with registers that begin at 0": {"REGS_INIT_ZERO": 1},
    "without the barrel shifter": {"BARREL_SHIFTER": 0},
    "with its own multiplier": {"ENABLE_MUL": 1, "ENABLE_FAST_MUL": 1},
    "with products bit by bit": {"ENABLE_MUL": 1},
    "with comparisons in two cycles": {"TWO_CYCLE_COMPARE": 1},
    "with sums in two cycles": {"TWO_CYCLE_COMPARE": 1, "TWO_CYCLE_ALU": 1},
    "without the check of alignment": {"CATCH_MISALIGN": 0},
    "without the check of instructions": {"CATCH_ILLINSN": 0},
    "with one port to read its registers": {"ENABLE_REGS_DUALPORT": 0},
}


def folder_of(package: str) -> Path:
    spec = find_spec(package)
    if not spec or not spec.submodule_search_locations:
        raise build.BuildError(f"not measured, pip install {package.replace('_', '-')}")
    return Path(spec.submodule_search_locations[0]) / "verilog"


class Program(NamedTuple):
    words: Path  # of the memory
    code: Path  # words of the flash
    size: int  # bytes of both


def program(core: Core, folder: Path) -> Program:
    """core_work.c with the whole firmware."""
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
    script, elf, words, code = (folder / f"work.{end}" for end in ("ld", "elf", "hex", "code"))
    script.write_text(
        tools.link_script(tools.MEMORY_BYTES, tools.seldom(sources) if core.in_flash else [])
    )
    link = ["-Wl,--gc-sections", f"-Wl,-T,{script}", "-o", str(elf), *libraries]
    tools.run([*command, *tools.FLAGS, *map(str, objects), *link])
    segments, size = tools.read_elf(elf)[0], 0
    for file, place in (
        (words, (tools.MEMORY_BYTES, 0)),
        (code, (tools.CODE_BYTES, tools.CODE_AT)),
    ):
        contents, used = tools.contents(segments, *place)
        file.write_text("".join(f"{word:08x}\n" for (word,) in struct.iter_unpack("<I", contents)))
        size += used
    return Program(words, code, size)


def simulated(core: Core, made_of: Program, folder: Path) -> Path:
    """The Verilated core with core_run.cpp."""
    more = []
    if core.package:
        waiver = folder / "foreign.vlt"
        waiver.write_text('`verilator_config\nlint_off -file "*/VexRiscv.v"\n')
        more = [waiver, named_by_its_module(folder_of(core.package) / core.file, "VexRiscv")]
    tool, verilator = build.compiler(), build.package("verilator", "it makes C++ of the RTL")
    values: dict[str, int | str] = {
        "MEMORY_BYTES": tools.MEMORY_BYTES,
        "FIRMWARE": f'"{made_of.words}"',
        **({"CODE_BYTES": tools.CODE_BYTES} if core.in_flash else {}),
    }
    waivers = ROOT / "rtl" / "cpu" / "cores.vlt"
    build.verilate(folder, verilator, core.source, "Vtop", values, waivers, *more)
    headers = verilator / "include"
    include = [f"-I{path}" for path in (folder, HERE.parent, headers, headers / "vltstd")]
    sources = [HERE / "core_run.cpp", *sorted(folder.glob("Vtop*.cpp"))]
    support, made = build.runtime(tool, verilator), folder / "run"
    flags = [*build.compile_flags(), *build.VERILATED, "-DMOIRE_REGISTER_ACCESS", *include]
    if core.in_flash:
        flags.append(f'-DCODE="{made_of.code}"')
    build.run([tool, *flags, *sources, support, "-o", made], "g++ of core_run.cpp")
    return made


def cycles_of(run: Path) -> dict[str, int]:
    """{section of core_work.c: cycles}."""
    words = [f"{address}={value}" for address, value in NODE.items()]
    lines = build.run([run, MOST_CYCLES, *words], "core_run").splitlines()
    times = [int(line.split()[1]) for line in lines]
    spent = [after - before for before, after in itertools.pairwise(times)]
    return dict(zip(SECTIONS, spent, strict=True))


def work_of(core: Core) -> tuple[int, dict[str, int]]:
    """Bytes of the program, {section of core_work.c: cycles}."""
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as made:
        folder = Path(made)
        made_of = program(core, folder)
        return made_of.size, cycles_of(simulated(core, made_of, folder))


def work_line(core: Core) -> str:
    size, cycles = work_of(core)
    return f"{size} bytes of program; cycles: " + ", ".join(f"{n} {c}" for n, c in cycles.items())


def named_by_its_module(source: Path, module: str) -> Path:
    """A copy of a source file of a package, for Yosys."""
    BUILD.mkdir(parents=True, exist_ok=True)
    copy = BUILD / f"{module}.v"
    shutil.copyfile(source, copy)
    return copy


def area_of(core: Core) -> str:
    if core.package:
        source = named_by_its_module(folder_of(core.package) / core.file, "VexRiscv")
        netlist = netlist_of(source, {}, "ecp5", 1)
    else:
        source = SOFT_CORE
        netlist = netlist_of(source, {"MEMORY_BYTES": tools.MEMORY_BYTES}, "ecp5", 1)
    clocks: list[str] = []
    used: dict[str, dict[str, int]] = {}
    for seed in SEEDS:
        alone = ["--lpf-allow-unconstrained", "--out-of-context"]
        mhz, used = placed(netlist, NEXTPNR_ECP5, ECP5, 70, seed, *alone)
        clocks.append(f"{mhz:.1f}")
    rams = used.get("DP16KD", {"used": 0})["used"]
    return f"{lut4s(netlist, source.stem)} LUT, {rams} block RAM, {', '.join(clocks)} MHz"


def options() -> None:
    source = folder_of("pythondata_cpu_picorv32") / "picorv32.v"
    copy = named_by_its_module(source, "picorv32")
    for words, change in CHANGES.items():
        netlist = netlist_of(copy, {**PICORV32, **change}, "ecp5", 1)
        print(f"PicoRV32 {words}: {lut4s(netlist, 'picorv32')} LUT", flush=True)


def spaced(number: int) -> str:
    """12 345"""
    return f"{number:,}".replace(",", " ")


def size_row(image: str, axes: int, report: str) -> str:
    """The row of an image in docs/soft_core.md, from the report of its build."""
    found = re.search(r"(\d+) bytes program \+ (\d+) data \+ (\d+) stack", report)
    assert found
    program, data, stack = map(int, found.groups())
    used = program + data + stack
    less = spaced(SMALLER_BYTES - used) if used <= SMALLER_BYTES else "–"
    cells = (f"`{image}`", IMAGES[image, axes], str(axes), *map(spaced, (program, data, stack)))
    free = 100 * (1 - used / tools.MEMORY_BYTES)
    return "| " + " | ".join((*cells, f"{free:.1f} %", less)) + " |"


def head_of(*cells: str) -> list[str]:
    """The first lines of a table."""
    return ["", "| " + " | ".join(cells) + " |", "|" + " --- |" * len(cells)]


def sizes() -> None:
    """Builds all images and writes their sizes into the page."""
    rows = head_of(
        "image", "node", "axes", "program", "data", "stack", "free of 96 KiB", "of 64 KiB"
    )
    for image, axes in IMAGES:
        report = tools.build(tools.MEMORY_BYTES, tools.OUT, False, image, axes)
        rows.append(size_row(image, axes, report))
    PAGE.write_text(made_files.filled(PAGE, BEGIN, END, [*rows, ""]), encoding="utf-8")
    rows = head_of("image", "axes", "needs of memory", "with a flash", "in the flash")
    for image, axes in IN_FLASH:
        reports = [
            tools.build(tools.MEMORY_BYTES, tools.OUT, False, image, axes, core)
            for core in ("soft", "flash")
        ]
        rows.append(flash_row(image, axes, *reports))
    text = made_files.filled(PAGE, BEGIN_FLASH, END_FLASH, [*rows, ""])
    PAGE.write_text(text, encoding="utf-8")


def flash_row(image: str, axes: int, whole: str, parted: str) -> str:
    """The row of an image in docs/soft_core.md, from the reports of its build for the memory alone,
    and of the one that is in part in the flash.
    """
    needed = [re.search(r"= (\d+) of", report) for report in (whole, parted)]
    in_flash = re.search(r"(\d+) in the flash", parted)
    numbers = [int(found[1]) for found in (*needed, in_flash) if found]
    assert len(numbers) == 3
    return "| " + " | ".join((f"`{image}`", str(axes), *map(spaced, numbers))) + " |"


def firmware_free_pct() -> float:
    """Of the memory of the S0 node: what program, data and stack leave."""
    report = tools.build(tools.MEMORY_BYTES, tools.OUT, False, "axis", 1)
    console.print(report, (tools.OUT / "firmware.parts").read_text())
    free = re.search(r"(\d+) free", report)
    assert free
    return 100 * int(free[1]) / tools.MEMORY_BYTES


FIGURES = {
    "firmware_free_pct": Figure(
        firmware_free_pct,
        "%",
        "free in the memory of the S0 node (96 KiB) beside program, data and stack of the firmware",
        ">= 25",
        Quick(),
        1,
    ),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--area", action="store_true", help="LUT and MHz instead of cycles")
    what.add_argument("--options", action="store_true", help="LUT of the options of PicoRV32")
    what.add_argument("--sizes", action="store_true", help="write the tables of images")
    chosen = parser.parse_args()
    if chosen.sizes:
        sizes()
        return
    if chosen.options:
        options()
        return
    for name, core in CORES.items():
        if chosen.area and core.source == SOFT_CORE and core.instructions.endswith("-c"):
            continue  # the same hardware
        try:
            print(f"{name}: {(area_of if chosen.area else work_line)(core)}", flush=True)
        except build.BuildError as why:
            print(f"{name}: {why}", flush=True)


if __name__ == "__main__":
    main()
