#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Build the firmware: build/firmware/firmware.elf, .bin and .hex; another image than `axis`,
another number of axes, and an image with updates over the bus have names of their own.

An image is the firmware of one kind of node. It consists of the parts that its image_NAME.c lists;
the linker drops what they do not reach. Its arrays have as many elements as the node has axes.
The compiler is zig (PyPI ziglang, of the running Python), or GNU with CROSS=riscv64-unknown-elf-
in the environment.
The .hex is for $readmemh: one 32-bit word per line, little endian in memory, filled with zeros up
to the size of the memory.
With --update there is a .update for `moire update`: one line of JSON that says for which nodes it
is, then the .bin.
With --core flash the soft core executes the parts that it needs seldom from a serial flash: they
are in .flash, the others in .bin and .hex, which have the CRC of the .flash.
The .parts lists how many bytes each source takes. Nothing is built if nothing has changed. The exit
code is 1, with one line of explanation, if a tool is missing, a source is wrong or the image does
not fit: then the line says by how many bytes, and which parts are the largest.
"""

import argparse
import hashlib
import importlib.util
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple, cast

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "build" / "firmware"
LINK = HERE / "core" / "link.ld"
MEMORY_BYTES = 98304  # of the soft core, as node.sv has it
CODE_AT = 0x20000000  # address of what a soft core executes from its flash
FLAGS = [
    "-std=c11",
    "-g",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-ffreestanding",
    "-ffunction-sections",
    "-fdata-sections",
    "-fomit-frame-pointer",
    "-static",
    "-Wframe-larger-than=1536",
]  # the stack has 4096


class Image(NamedTuple):
    """What is known of an image besides its parts."""

    usual_axes: int  # of a node, if the caller names no other number
    most_axes: int  # that the image can serve
    drives: bool = True  # False: its nodes measure and have no drives


IMAGES = {
    "axis": Image(usual_axes=1, most_axes=8),
    "stream": Image(usual_axes=1, most_axes=8),
    "counter": Image(usual_axes=4, most_axes=8, drives=False),
    "steps": Image(usual_axes=8, most_axes=8),
    "steps_stream": Image(usual_axes=3, most_axes=8),
    "station": Image(usual_axes=2, most_axes=2),
}
LARGEST_PARTS = 4  # that the message about a firmware that does not fit names
SMALL, FAST = "-Os", "-O2"
HOT = (  # files in which speed counts more than size: planning, and answers to the host
    "arithmetic.c",
    "bus.c",
    "plan.c",
    "planner.c",
    "retarget.c",
)
SOFT = ("generic_rv32+m-a-f-d+c", "rv32imc")
CORES = {  # what the compilers may use of a soft core, as zig and as GNU name it
    "soft": SOFT,
    "serial": ("generic_rv32-m-a-f-d-c", "rv32i"),
    "flash": SOFT,  # with CODE_BYTES of a node
}
IN_FLASH = (  # folders and files that the core `flash` executes from there: not in each round
    "axis/homing.c",
    "axis/parameters.c",
    "bus/scope.c",
    "bus/segments.c",
    "calibration",
    "planner/planner.c",
    "planner/retarget.c",
    "station",
)
CODE_BYTES = 65536  # of the flash that the core can execute
ZIG = [
    "-target",
    "riscv32-freestanding-none",
    "-mabi=ilp32",
    "-fno-sanitize=all",
    "-fno-stack-protector",
]
GNU = [
    "-misa-spec=2.2",
    "-mabi=ilp32",
    "-nostdlib",
    "-nostartfiles",
    "-fno-tree-loop-distribute-patterns",
]  # else memset would call itself


class BuildError(Exception):
    """One line that says what is wrong."""


def compiler(core: str = "soft") -> tuple[list[str], list[str]]:
    """The command with its flags for a soft core, and the libraries that end the link command."""
    zig, gnu = CORES[core]
    cross = os.environ.get("CROSS")
    if cross:
        command = f"{cross}gcc"
        if shutil.which(command) is None:
            raise BuildError(f"{command} was not found (CROSS={cross})")
        return [command, f"-march={gnu}", *GNU], ["-lgcc"]
    if importlib.util.find_spec("ziglang") is None:
        raise BuildError("no compiler: install ziglang (pip) or set CROSS=riscv64-unknown-elf-")
    return [sys.executable, "-m", "ziglang", "cc", *ZIG, f"-mcpu={zig}"], []


def read_elf(path: Path) -> tuple[list[tuple[int, bytes]], dict[str, int]]:
    """What is to be loaded, as (address, bytes), and the value of each symbol, of an ELF file."""
    with open(path, "rb") as file:
        elf = ELFFile(file)
        segments = [
            (segment["p_paddr"], segment.data())
            for segment in elf.iter_segments("PT_LOAD")
            if segment["p_filesz"]
        ]
        table = cast(SymbolTableSection, elf.get_section_by_name(".symtab"))
        symbols = {symbol.name: symbol["st_value"] for symbol in table.iter_symbols()}
    return segments, symbols


def contents(segments: list[tuple[int, bytes]], memory: int, begin: int = 0) -> tuple[bytes, int]:
    """The contents of a memory of so many bytes which begins at an address, the flash being another
    one than the RAM; and how many of them are used.
    """
    words, used = bytearray(memory), 0
    for address, content in segments:
        if (address >= CODE_AT) != (begin >= CODE_AT):
            continue
        first, end = address - begin, address - begin + len(content)
        if end > memory:
            where = "flash" if begin else "memory"
            raise BuildError(f"the firmware needs {end} bytes, the {where} has {memory}")
        words[first:end] = content
        used = max(used, end)
    return bytes(words), used


def sized_symbols(path: Path) -> Iterable[tuple[str, str, bool, int]]:
    """(file, name, whether only that file sees it, bytes) of each function and variable."""
    with open(path, "rb") as file:
        table = cast(SymbolTableSection, ELFFile(file).get_section_by_name(".symtab"))
        source, seen = "", set()
        for symbol in table.iter_symbols():
            kind, local = symbol["st_info"]["type"], symbol["st_info"]["bind"] == "STB_LOCAL"
            if kind == "STT_FILE":
                source = symbol.name
            place = symbol["st_value"], symbol["st_size"], symbol["st_shndx"]
            known = kind in ("STT_FUNC", "STT_OBJECT") and symbol["st_shndx"] != "SHN_UNDEF"
            if not known or local and symbol.name.startswith(".L") or place in seen:
                continue
            seen.add(place)  # a function may have two names
            yield source, symbol.name, local, symbol["st_size"]


def sizes_of(elf: Path, objects: dict[str, Path], total: int) -> dict[str, int]:
    """{source: bytes of its functions and variables} of a linked firmware, the largest first;
    `objects` are those of the sources. The difference to the total are constants without a name
    and the compiler's own functions.
    """
    of_file = {Path(source).name: source for source in objects}
    of_name = {
        name: source
        for source, made in objects.items()
        for _, name, local, _ in sized_symbols(made)
        if not local
    }
    sizes = dict.fromkeys(objects, 0)
    for file, name, local, size in sized_symbols(elf):
        source = of_file.get(file) if local else of_name.get(name)
        if source:
            sizes[source] += size
    sizes["compiler, constants without a name"] = total - sum(sizes.values())
    return dict(sorted(sizes.items(), key=lambda item: -item[1]))


def largest_parts(sizes: dict[str, int]) -> str:
    """The largest parts of the firmware; a part is a directory of sw/firmware."""
    parts: dict[str, int] = {}
    for source, size in sizes.items():
        part = source.rpartition("/")[0]
        if part:
            parts[part] = parts.get(part, 0) + size
    first = sorted(parts.items(), key=lambda item: -item[1])[:LARGEST_PARTS]
    return ", ".join(f"{part} {size}" for part, size in first)


def sources_of(name: str, folder: Path = HERE) -> list[Path]:
    """All sources in the folder except the lists of the other images. Each makes an object that is
    named by its stem.
    """
    others = {
        path for path in (folder / "images").glob("image_*.c") if path.name != f"image_{name}.c"
    }
    sources = sorted(set(folder.rglob("*.[chS]")) - others)
    stems = [path.stem for path in sources if path.suffix != ".h"]
    for stem in stems:
        if stems.count(stem) > 1:
            raise BuildError(f"two sources would make the same object {stem}.o: rename one")
    return sources


def seldom(sources: Iterable[Path]) -> list[str]:
    """The objects of these sources that the core `flash` executes from there."""
    return [
        f"{path.stem}.o"
        for path in sources
        if path.is_relative_to(HERE) and path.relative_to(HERE).as_posix().startswith(IN_FLASH)
    ]


def link_script(memory: int, in_flash: Iterable[str] = ()) -> str:
    """The linker script for a memory of so many bytes; what is in these objects is in the flash."""
    objects = " ".join(
        f"*/{name}(.text .text.* .rodata .rodata.* .srodata .srodata.*)" for name in in_flash
    )
    code = f".code {CODE_AT:#x} : {{ {objects} . = ALIGN(4); }} :code" if objects else ""
    return f"MEMORY_BYTES = {memory};\n" + LINK.read_text().replace("/* .code */", code)


def defines_of(
    name: str, axes: int | None = None, update: bool = False, core: str = "soft"
) -> list[str]:
    """Macros of an image: it serves as many axes as it can, if no number is named. With `update` it
    can write new firmware into the flash of a serial core.
    """
    image = IMAGES[name]
    return [
        f"-DHARDWARE_AXES={axes or image.most_axes}u",
        f"-DHARDWARE_DRIVES={int(image.drives)}",
        f"-DHARDWARE_UPDATE={int(update)}",
        f"-DHARDWARE_CODE={int(core == 'flash')}",
    ]


def stem_of(name: str, axes: int, core: str = "soft", update: bool = False) -> str:
    """The name of the files of an image for nodes of so many axes with this soft core, with or
    without updates over the bus.
    """
    stem = "firmware" if name == "axis" else name
    stem += "" if axes == IMAGES[name].usual_axes else f"_{axes}_axes"
    return stem + ("" if core == "soft" else f"_{core}") + ("_update" if update else "")


def flags_of(path: Path) -> list[str]:
    return [FAST if path.name in HOT else SMALL]


def update_file(program: bytes, name: str, axes: int, core: str, memory: int) -> bytes:
    """The content of a file for `moire update`: a line of JSON, then the program."""
    crcs = {}
    for key, header in (("MAP_CRC", "registers.h"), ("PROTOCOL_CRC", "bus_protocol.h")):
        found = re.search(rf"#define {key}\s+(0x\w+)u", (HERE / "made" / header).read_text())
        assert found, f"{header} has no {key}"
        crcs[key.lower()] = int(found[1], 16)
    about = {
        "moire_firmware": 1,
        "image": name,
        "axes": axes,
        "core": core,
        "memory": memory,
        **crcs,
        "bytes": len(program),
        "crc": zlib.crc32(program),
    }
    return json.dumps(about).encode() + b"\n" + program


def with_check(content: bytes, at: int, code: bytes) -> bytes:
    """The contents of the memory with the number of bytes in the flash and their CRC-32 at an
    address (core/code.c).
    """
    check = struct.pack("<II", len(code), zlib.crc32(code))
    return content[:at] + check + content[at + len(check) :]


def fingerprint(sources: Iterable[Path], command: list[str], memory: int) -> str:
    state = hashlib.sha256(repr((command, memory)).encode())
    for source in sources:
        state.update(source.relative_to(HERE).as_posix().encode() + source.read_bytes())
    return state.hexdigest()


def run(command: Sequence[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = done.stderr.splitlines() or ["the compiler failed without a message"]
        errors = [
            line
            for line in lines
            if re.search(r"error|undefined reference|would not survive", line)
        ]
        raise BuildError((errors or lines)[0].strip())


def build(
    memory: int,
    out: Path,
    force: bool,
    name: str = "axis",
    axes: int | None = None,
    core: str = "soft",
    update: bool = False,
) -> str:
    """Build an image for nodes of so many axes, or of as many as is usual, with or without updates
    over the bus, and report its size.
    """
    image = IMAGES[name]
    axes = image.usual_axes if axes is None else axes
    if not 1 <= axes <= image.most_axes:
        raise BuildError(f"the image {name} serves 1 to {image.most_axes} axes, not {axes}")
    if update and core == "flash":
        raise BuildError("updates over the bus need --core serial")
    command, libraries = compiler(core)
    command += defines_of(name, axes, update, core)
    sources = [*sources_of(name), LINK, HERE / "build.py"]
    stem = stem_of(name, axes, core, update)
    elf, binary, text, parts, note = (
        out / f"{stem}.{end}" for end in ("elf", "bin", "hex", "parts", "note")
    )
    results = [elf, binary, text, parts, note]
    if update or core == "flash":
        results.append(out / f"{stem}.{'update' if update else 'flash'}")
    state = fingerprint(sources, command, memory)
    if not force and all(path.exists() for path in results):
        old_state, _, report = note.read_text().partition("\n")
        if old_state == state:
            return report.strip()
    out.mkdir(parents=True, exist_ok=True)
    note.unlink(missing_ok=True)

    inputs = [path for path in sources if path.suffix in (".c", ".S")]
    script = out / f"{stem}.ld"  # zig's linker takes no --defsym
    names = [path.relative_to(HERE).as_posix() for path in inputs]
    script.write_text(link_script(memory, seldom(inputs) if core == "flash" else []))
    with tempfile.TemporaryDirectory(dir=out) as folder:
        objects = [Path(folder) / f"{path.stem}.o" for path in inputs]
        compiled = [
            [*command, *FLAGS, *flags_of(path), f"-I{HERE}", "-c", str(path), "-o", str(made)]
            for path, made in zip(inputs, objects, strict=True)
        ]
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(run, compiled))
        run(
            [
                *command,
                *FLAGS,
                *map(str, objects),
                "-Wl,--gc-sections",
                f"-Wl,-T,{script}",
                "-o",
                str(elf),
                *libraries,
            ]
        )

        segments, symbols = read_elf(elf)
        code, in_flash = contents(segments, CODE_BYTES, CODE_AT)
        made = dict(zip(names, objects, strict=True))
        sizes = sizes_of(elf, made, symbols["_zero_end"] + in_flash)

    used, stack = symbols["_zero_end"], symbols["_stack_top"] - symbols["_stack_limit"]
    free = memory - used - stack
    if free < 0:
        raise BuildError(
            f"the image {name} for {axes} {'axis' if axes == 1 else 'axes'} is {-free} bytes too "
            f"large for a memory of {memory} bytes; its largest parts: {largest_parts(sizes)}"
        )
    content, program = contents(segments, memory)
    if core == "flash":
        content = with_check(content, symbols["code_check"], code[:in_flash])
        results[-1].write_bytes(code[:in_flash])
    binary.write_bytes(content[:program])
    if update:
        results[-1].write_bytes(update_file(content[:program], name, axes, core, memory))
    text.write_text("".join(f"{word:08x}\n" for (word,) in struct.iter_unpack("<I", content)))
    parts.write_text("".join(f"{size:7} {source}\n" for source, size in sizes.items() if size))
    report = (
        f"{stem}: {program} bytes program + {used - program} data + {stack} stack"
        f" = {used + stack} of {memory}, {free} free"
        + (f"; {in_flash} in the flash" if in_flash else "")
    )
    note.write_text(f"{state}\n{report}\n")
    return report


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument(
        "--image", choices=sorted(IMAGES), default="axis", help="kind of node (default axis)"
    )
    parser.add_argument(
        "--axes",
        type=int,
        help="axes of the node (default "
        + ", ".join(f"{name} {image.usual_axes}" for name, image in IMAGES.items())
        + ")",
    )
    parser.add_argument(
        "--core",
        choices=sorted(CORES),
        default="soft",
        help="soft core (default soft; flash: the soft core with a part of its program in a flash)",
    )
    parser.add_argument(
        "--memory",
        type=int,
        default=MEMORY_BYTES,
        help=f"bytes of the soft core's memory (default {MEMORY_BYTES})",
    )
    parser.add_argument(
        "--out", type=Path, default=OUT, help="folder of the results (default build/firmware)"
    )
    parser.add_argument(
        "--update", action="store_true", help="with updates over the bus, for HAS_UPDATE of a node"
    )
    parser.add_argument("--force", action="store_true", help="build even if nothing changed")
    options = parser.parse_args()
    try:
        chosen = options.image, options.axes, options.core, options.update
        print(build(options.memory, options.out, options.force, *chosen))
    except BuildError as error:
        sys.exit(f"firmware: {error}")


if __name__ == "__main__":
    main()
