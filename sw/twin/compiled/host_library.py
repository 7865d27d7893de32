# SPDX-License-Identifier: Apache-2.0
"""C sources of the firmware as a shared library of this computer. With FIRMWARE_COVERAGE in the
environment it lies in this folder, and counts there for gcov which lines and branches are executed.
"""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
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
    "-shared",
    "-fPIC",
    f"-I{FIRMWARE}",
]

COVERAGE = "FIRMWARE_COVERAGE"
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


def host_library_file(name: str, sources: Sequence[Path], options: Sequence[str] = ()) -> Path:
    """Build build/firmware/host_NAME.so, compiled again if a source or any header of the firmware
    is newer; returns it. Raises CalledProcessError if the compiler refuses a source.
    """
    counts = os.environ.get(COVERAGE)
    folder = Path(counts) if counts else ROOT / "build" / "firmware"
    if counts:
        options = [*options, *COUNT, "-dumpdir", f"{folder}/{name}-"]
    library = folder / f"host_{name}.so"
    newest = max(path.stat().st_mtime for path in (*sources, *FIRMWARE.rglob("*.h")))
    if not library.exists() or library.stat().st_mtime < newest:
        library.parent.mkdir(parents=True, exist_ok=True)
        # In a directory of its own, so that two runs at once do not disturb each other.
        with tempfile.TemporaryDirectory(dir=library.parent) as directory:
            made = Path(directory) / library.name
            files = [str(path) for path in sources]
            subprocess.run([*compiler(), *OPTIONS, *options, *files, "-o", str(made)], check=True)
            os.replace(made, library)
    return library
