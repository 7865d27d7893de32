#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Build the firmware: build/firmware/firmware.elf, .bin and .hex; another image than `axis` under
its own name.

An image is what its image_NAME.c lists; the linker drops whatever that does not reach.
The compiler is zig (PyPI ziglang, from the running Python), or GNU with CROSS=riscv64-unknown-elf-
in the environment.
The .hex is for $readmemh: one 32-bit word a line, little endian in memory, filled with zeros to the
size of the memory.
Nothing is done if nothing changed. Ends with 1 and one line if a tool is missing, the source is
wrong or it does not fit.
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
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

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
AXES = {"station": 2}  # most that an image serves, where it is not the default
SMALL, FAST = "-Os", "-O2"
HOT = ("arithmetic.c",)  # the others wait more than they work
OUTLINE = [
    "-mllvm",
    "-enable-machine-outliner=always",
]  # of them with zig: instructions that repeat stand once
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


def compiler():
    """The command with the flags of its kind, and the libraries for the end."""
    cross = os.environ.get("CROSS")
    if cross:
        command = f"{cross}gcc"
        if shutil.which(command) is None:
            raise BuildError(f"{command} was not found (CROSS={cross})")
        return [command, *GNU], ["-lgcc"]
    if importlib.util.find_spec("ziglang") is None:
        raise BuildError("no compiler: install ziglang (pip) or set CROSS=riscv64-unknown-elf-")
    return [sys.executable, "-m", "ziglang", "cc", *ZIG], []


def load_segments(elf):
    """(address, bytes) of what is to be loaded, and symbols by name, from a 32-bit little-endian
    ELF.
    """
    if elf[:6] != b"\x7fELF\x01\x01":
        raise BuildError("the linker did not make a 32-bit little-endian ELF")
    program_at, section_at = struct.unpack_from("<II", elf, 28)
    program_size, programs, section_size, sections = struct.unpack_from("<HHHH", elf, 42)
    segments = []
    for n in range(programs):
        kind, offset, _, physical, size = struct.unpack_from(
            "<IIIII", elf, program_at + n * program_size
        )
        if kind == 1 and size:
            segments.append((physical, elf[offset : offset + size]))
    headers = [
        struct.unpack_from("<10I", elf, section_at + n * section_size) for n in range(sections)
    ]
    symbols = {}
    for header in headers:
        if header[1] != 2:
            continue
        names = headers[header[6]][4]
        for at in range(header[4], header[4] + header[5], 16):
            name, value = struct.unpack_from("<II", elf, at)
            end = elf.index(b"\0", names + name)
            symbols[elf[names + name : end].decode()] = value
    return segments, symbols


def image(segments, memory):
    words = bytearray(memory)
    used = 0
    for address, content in segments:
        if address + len(content) > memory:
            raise BuildError(
                f"the program needs {address + len(content)} bytes, the memory has {memory}"
            )
        words[address : address + len(content)] = content
        used = max(used, address + len(content))
    return bytes(words), used


def sources_of(name: str, folder: Path = HERE) -> list[Path]:
    """All of the folder but the lists of the other images."""
    others = {
        path for path in (folder / "images").glob("image_*.c") if path.name != f"image_{name}.c"
    }
    return sorted(set(folder.rglob("*.[chS]")) - others)


def defines_of(name: str) -> list[str]:
    return [f"-DHARDWARE_AXES={AXES[name]}u"] if name in AXES else []


def flags_of(path):
    if path.name in HOT:
        return [FAST]
    return [SMALL] if os.environ.get("CROSS") else [SMALL, *OUTLINE]


def fingerprint(sources, command, memory):
    state = hashlib.sha256(repr((command, memory)).encode())
    for source in sources:
        state.update(source.relative_to(HERE).as_posix().encode() + source.read_bytes())
    return state.hexdigest()


def run(command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = done.stderr.splitlines() or ["the compiler failed without a word"]
        telling = [
            line
            for line in said
            if re.search(r"error|undefined reference|does not fit|would not survive", line)
        ]
        raise BuildError((telling or said)[0].strip())


def build(memory, out, force, name="axis"):
    command, libraries = compiler()
    command += defines_of(name)
    sources = [*sources_of(name), LINK, HERE / "build.py"]
    stem = "firmware" if name == "axis" else name
    elf, binary, text, note = (out / f"{stem}.{end}" for end in ("elf", "bin", "hex", "note"))
    mark = fingerprint(sources, command, memory)
    if not force and all(path.exists() for path in (elf, binary, text, note)):
        old_mark, _, report = note.read_text().partition("\n")
        if old_mark == mark:
            return report.strip()
    out.mkdir(parents=True, exist_ok=True)
    note.unlink(missing_ok=True)

    inputs = [path for path in sources if path.suffix in (".c", ".S")]
    script = out / f"{stem}.ld"  # zig's linker takes no --defsym
    script.write_text(f"MEMORY_BYTES = {memory};\n" + (LINK).read_text())
    with tempfile.TemporaryDirectory(dir=out) as folder:
        objects = [Path(folder) / f"{path.name}.o" for path in inputs]
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

    segments, symbols = load_segments(elf.read_bytes())
    content, program = image(segments, memory)
    used, stack = symbols["_zero_end"], symbols["_stack_top"] - symbols["_stack_limit"]
    binary.write_bytes(content[:program])
    text.write_text("".join(f"{word:08x}\n" for (word,) in struct.iter_unpack("<I", content)))
    report = (
        f"{stem}: {program} bytes program + {used - program} data + {stack} stack = {used + stack} of {memory}, "
        f"{memory - used - stack} free"
    )
    note.write_text(f"{mark}\n{report}\n")
    return report


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument(
        "--image", choices=IMAGES, default="axis", help="what the node is for (default axis)"
    )
    parser.add_argument(
        "--memory", type=int, default=98304, help="bytes of the soft core's memory (default 98304)"
    )
    parser.add_argument(
        "--out", type=Path, default=OUT, help="folder for what is made (default build/firmware)"
    )
    parser.add_argument("--force", action="store_true", help="build even if nothing changed")
    options = parser.parse_args()
    try:
        print(build(options.memory, options.out, options.force, options.image))
    except BuildError as error:
        sys.exit(f"firmware: {error}")


if __name__ == "__main__":
    main()
