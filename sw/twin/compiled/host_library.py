# SPDX-License-Identifier: Apache-2.0
"""C sources of the firmware as a shared library of this computer.

With FIRMWARE_COVERAGE in the environment the library lies in this folder, and counts there for gcov
which lines and branches are executed. With FIRMWARE_MUTANT=SOURCE=FILE it is made of FILE in place
of this source, and lies beside FILE.
"""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

from twin.build import FIRMWARE, ROOT

OPTIONS = [
    "-std=c11",
    "-O1",
    "-g",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wno-sign-conversion",
    "-Werror",
    "-fsanitize=undefined",
    "-fsanitize-undefined-trap-on-error",  # undefined behaviour ends the test
    "-fPIC",
    f"-I{FIRMWARE}",
]

COVERAGE = "FIRMWARE_COVERAGE"
MUTANT = "FIRMWARE_MUTANT"
COUNT = ["--coverage", "-O0", "-fno-sanitize=all"]  # lines and branches are those of the source


def compiler() -> list[str]:
    """The command of the system's gcc or clang, else of zig."""
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    return [sys.executable, "-m", "ziglang", "cc"]


def host_library(name: str, sources: Sequence[Path], options: Sequence[str] = ()) -> ctypes.CDLL:
    """Load the file of host_library_file()."""
    return ctypes.CDLL(str(host_library_file(name, sources, options)))


def compile_object(source: Path, made: Path, options: Sequence[str]) -> None:
    """Compile one source. Raises CalledProcessError if the compiler refuses it."""
    command = [*compiler(), *OPTIONS, *options, "-c", str(source), "-o", str(made)]
    subprocess.run(command, check=True)


def is_newer(made: Path, sources: Iterable[Path]) -> bool:
    """Whether a made file is newer than these sources and all headers of the firmware."""
    newest = max(path.stat().st_mtime for path in (*sources, *FIRMWARE.rglob("*.h")))
    return made.exists() and made.stat().st_mtime >= newest


def object_of(source: Path, folder: Path, options: Sequence[str]) -> Path:
    """The object of a source in a folder, compiled again if the source or any header is newer."""
    file = folder / f"{source.parent.name}-{source.stem}.o"
    if not is_newer(file, [source]):
        folder.mkdir(parents=True, exist_ok=True)
        # In a directory of its own, so that two runs at once do not disturb each other.
        with tempfile.TemporaryDirectory(dir=folder) as directory:
            made = Path(directory) / file.name
            compile_object(source, made, options)
            os.replace(made, file)
    return file


def mutated() -> tuple[Path, Path] | None:
    """The source that the environment replaces, and the file that replaces it."""
    words = os.environ.get(MUTANT)
    if not words:
        return None
    source, text = map(Path, words.split("="))
    return source, text


def host_library_file(name: str, sources: Sequence[Path], options: Sequence[str] = ()) -> Path:
    """Build build/firmware/host_NAME.so of the objects in build/firmware/host_NAME, as far as a
    source or a header is newer; returns it. Raises CalledProcessError if the compiler refuses a
    source.
    """
    counts, mutant = os.environ.get(COVERAGE), mutated()
    folder = Path(counts) if counts else ROOT / "build" / "firmware"
    if counts:
        options = [*options, *COUNT, "-dumpdir", f"{folder}/{name}-"]
    library, objects = folder / f"host_{name}.so", folder / f"host_{name}"
    if mutant and mutant[0] not in sources:
        mutant = None
    if mutant:
        library = mutant[1].with_name(library.name)
    elif is_newer(library, sources):
        return library
    files = [
        object_of(source, objects, options)
        for source in sources
        if not (mutant and source == mutant[0])
    ]
    with tempfile.TemporaryDirectory(dir=library.parent) as directory:
        if mutant:
            files.append(Path(directory) / "mutant.o")
            compile_object(mutant[1], files[-1], [*options, "-w"])
        made = Path(directory) / library.name
        command = [*compiler(), "-shared", *map(str, files), *options, "-o", str(made)]
        subprocess.run(command, check=True)
        os.replace(made, library)
    return library
