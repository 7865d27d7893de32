#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Build the firmware: build/firmware/firmware.elf, .bin and .hex; another image than `axis` gets
its own name.

An image consists of the parts that its image_NAME.c lists; the linker drops what they do not reach.
The compiler is zig (PyPI ziglang, of the running Python), or GNU with CROSS=riscv64-unknown-elf-
in the environment.
The .hex is for $readmemh: one 32-bit word per line, little endian in memory, filled with zeros up
to the size of the memory.
Nothing is built if nothing has changed. The exit code is 1, with one line of explanation, if a tool
is missing, a source is wrong or the image does not fit.
"""

import argparse
import hashlib
import importlib.util
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import cast

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "build" / "firmware"
LINK = HERE / "core" / "link.ld"
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
IMAGES = sorted(path.stem.removeprefix("image_") for path in (HERE / "images").glob("image_*.c"))
AXES = {"station": 2}  # most axes that an image serves, where it is not the default
SMALL, FAST = "-Os", "-O2"
HOT = ("arithmetic.c",)  # the only file in which speed counts more than size
OUTLINE = [
    "-mllvm",
    "-enable-machine-outliner=always",
]  # for zig: sequences of instructions that repeat become functions
ZIG = [
    "-target",
    "riscv32-freestanding-none",
    "-mcpu=generic_rv32+m-a-f-d-c",
    "-mabi=ilp32",
    "-fno-sanitize=all",
    "-fno-stack-protector",
]
GNU = [
    "-march=rv32im",
    "-misa-spec=2.2",
    "-mabi=ilp32",
    "-nostdlib",
    "-nostartfiles",
    "-fno-tree-loop-distribute-patterns",
]  # else memset would call itself


class BuildError(Exception):
    """One line that says what is wrong."""


def compiler() -> tuple[list[str], list[str]]:
    """The command with its flags, and the libraries that end the link command."""
    cross = os.environ.get("CROSS")
    if cross:
        command = f"{cross}gcc"
        if shutil.which(command) is None:
            raise BuildError(f"{command} was not found (CROSS={cross})")
        return [command, *GNU], ["-lgcc"]
    if importlib.util.find_spec("ziglang") is None:
        raise BuildError("no compiler: install ziglang (pip) or set CROSS=riscv64-unknown-elf-")
    return [sys.executable, "-m", "ziglang", "cc", *ZIG], []


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


def image(segments: list[tuple[int, bytes]], memory: int) -> tuple[bytes, int]:
    """The contents of a memory of so many bytes, and how many of them are used."""
    words = bytearray(memory)
    used = 0
    for address, content in segments:
        if address + len(content) > memory:
            raise BuildError(
                f"the firmware needs {address + len(content)} bytes, the memory has {memory}"
            )
        words[address : address + len(content)] = content
        used = max(used, address + len(content))
    return bytes(words), used


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


def defines_of(name: str) -> list[str]:
    return [f"-DHARDWARE_AXES={AXES[name]}u"] if name in AXES else []


def flags_of(path: Path) -> list[str]:
    if path.name in HOT:
        return [FAST]
    return [SMALL] if os.environ.get("CROSS") else [SMALL, *OUTLINE]


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
            if re.search(r"error|undefined reference|does not fit|would not survive", line)
        ]
        raise BuildError((errors or lines)[0].strip())


def build(memory: int, out: Path, force: bool, name: str = "axis") -> str:
    command, libraries = compiler()
    command += defines_of(name)
    sources = [*sources_of(name), LINK, HERE / "build.py"]
    stem = "firmware" if name == "axis" else name
    elf, binary, text, note = (out / f"{stem}.{end}" for end in ("elf", "bin", "hex", "note"))
    state = fingerprint(sources, command, memory)
    if not force and all(path.exists() for path in (elf, binary, text, note)):
        old_state, _, report = note.read_text().partition("\n")
        if old_state == state:
            return report.strip()
    out.mkdir(parents=True, exist_ok=True)
    note.unlink(missing_ok=True)

    inputs = [path for path in sources if path.suffix in (".c", ".S")]
    script = out / f"{stem}.ld"  # zig's linker takes no --defsym
    script.write_text(f"MEMORY_BYTES = {memory};\n" + LINK.read_text())
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
    content, program = image(segments, memory)
    used, stack = symbols["_zero_end"], symbols["_stack_top"] - symbols["_stack_limit"]
    binary.write_bytes(content[:program])
    text.write_text("".join(f"{word:08x}\n" for (word,) in struct.iter_unpack("<I", content)))
    report = (
        f"{stem}: {program} bytes program + {used - program} data + {stack} stack"
        f" = {used + stack} of {memory}, {memory - used - stack} free"
    )
    note.write_text(f"{state}\n{report}\n")
    return report


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument(
        "--image", choices=IMAGES, default="axis", help="kind of node (default axis)"
    )
    parser.add_argument(
        "--memory", type=int, default=98304, help="bytes of the soft core's memory (default 98304)"
    )
    parser.add_argument(
        "--out", type=Path, default=OUT, help="folder of the results (default build/firmware)"
    )
    parser.add_argument("--force", action="store_true", help="build even if nothing changed")
    options = parser.parse_args()
    try:
        print(build(options.memory, options.out, options.force, options.image))
    except BuildError as error:
        sys.exit(f"firmware: {error}")


if __name__ == "__main__":
    main()
