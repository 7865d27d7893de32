# SPDX-License-Identifier: Apache-2.0
"""What sigrok-cli reads from recorded lines: its decoders, written by others, judge our waveforms.

`make sigrok` installs it; whoever calls this asks `installed()` first.
"""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

PROGRAM = "sigrok-cli"
LONGEST_S = 600


class SigrokError(Exception):
    """One line that states why sigrok-cli did not decode the lines."""


def installed() -> bool:
    return shutil.which(PROGRAM) is not None


def decoded(samples: bytes, lines: int, rate_hz: int, decoders: str, words: str) -> str:
    """Text that `decoders` print as `words`, both as sigrok-cli's options -P and -A take them. Each
    byte of `samples` is one sample of all lines: bit n is line n.
    """
    with tempfile.TemporaryDirectory(prefix="moire-sigrok-") as folder:
        file = Path(folder) / "lines.bin"
        file.write_bytes(samples)
        form = f"binary:numchannels={lines}:samplerate={rate_hz}"
        result = subprocess.run(
            [PROGRAM, "-i", file, "-I", form, "-P", decoders, "-A", words],
            capture_output=True,
            text=True,
            timeout=LONGEST_S,
        )
    if result.returncode:
        raise SigrokError(f"{PROGRAM} of {decoders} failed: {result.stderr.strip()}")
    return result.stdout


def ps2(samples: bytes, rate_hz: int) -> tuple[bytes, int]:
    """Bytes on a PS/2 cable (line 0 clock, line 1 data), and how many had a wrong parity."""
    text = decoded(samples, 2, rate_hz, "ps2:clk=0:data=1", "ps2=word:parity-err")
    read = bytes(int(word, 16) for word in re.findall(r"Data: (\w\w)", text))
    return read, text.count("Parity error")


def uart(samples: bytes, rate_hz: int, options: str) -> list[str]:
    """Characters of a UART line in hexadecimal, and what is wrong between them in words."""
    words = "uart=rx-data:rx-parity-err:rx-warnings"
    text = decoded(samples, 1, rate_hz, f"uart:rx=0:{options}", words)
    return re.findall(r"^uart-1: (.*)$", text, re.MULTILINE)
