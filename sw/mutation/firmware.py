# SPDX-License-Identifier: Apache-2.0
"""Which faults inside a source of the firmware no test of the source sees.

    python -m mutation.firmware [SOURCE …]      mutants of these sources, or of all; see --help

mutation.firmware_texts makes the mutants with libclang (`make mutators`): one operator, number,
condition or statement of the C source is another one, or is gone. mutation.forked_tests compiles
the text into the firmware of this computer and runs the tests of firmware.toml on it. What no test
sees is a survivor. It is equivalent if the compiler makes the same code of it; otherwise it needs a
better test, or a reason in firmware.toml.
"""

import sys
import tempfile
from pathlib import Path

from firmware import build as firmware_build
from mutation.block import BUILD
from mutation.sources import Language, SourceMutant
from twin.build import FIRMWARE
from twin.compiled import host_library

DEFINES = ["-DMOIRE_REGISTER_ACCESS", *firmware_build.defines_of("axis", update=True)]


def path_of(source: str) -> Path:
    """A source by its path in sw/firmware."""
    return FIRMWARE / source


def code(text: str, path: Path) -> bytes:
    """The optimised object that the compiler makes of a text of a source."""
    options = ["-O2", "-g0", "-w", "-fno-sanitize=all", *DEFINES]
    with tempfile.TemporaryDirectory(dir=BUILD, prefix="code-") as folder:
        source, made = Path(folder) / path.name, Path(folder) / "made.o"
        source.write_text(f'#line 1 "{path}"\n{text}')
        host_library.compile_object(source, made, options)
        return made.read_bytes()


def same_code(mutant: SourceMutant) -> bool:
    """Whether the compiler makes the same code of a mutant as of its source."""
    return code(mutant.text, mutant.path) == code(mutant.path.read_text(), mutant.path)


C = Language(
    "firmware",
    Path(__file__).with_name("firmware.toml"),
    "clang",
    "mutation.firmware_texts",
    path_of,
    same_code,
)


if __name__ == "__main__":
    sys.exit(C.main())
