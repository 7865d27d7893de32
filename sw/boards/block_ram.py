# SPDX-License-Identifier: Apache-2.0
"""New contents of block RAMs in a placed design, so that new firmware needs no new placement.

A design is synthesised with random words as its firmware. Yosys cuts the memory into pieces, one
for each block RAM: some bits of each word of a range of addresses. Each random piece is found in
the file that nextpnr wrote, and the same piece of the firmware takes its place. Project Trellis'
`ecpbram` does this for an ECP5, but it does not find its database in its wheel; for Gowin parts
there is no such program.
"""

import json
import random
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

BITS = 16384  # of a block RAM of an ECP5 or Gowin part, without those for parity
WORD = 32  # bits of a word of the firmware
WIDTHS = (1, 2, 4, 8)  # of a piece: node_memory is written byte by byte, so none is wider
GOWIN_ROWS = [f"INIT_RAM_{n:02X}" for n in range(64)]
ECP5_RAM = re.compile(r"^(\.bram_init \d+\n)((?:[0-9a-f ]+\n)+)", re.MULTILINE)

Rams = Mapping[str, str]  # {name: its bits from the first one on, as 0 and 1}


class ContentsError(Exception):
    """One line that says why the contents cannot be replaced."""


def placeholder(words: int) -> list[int]:
    """The random words, always the same, that a design of so many words is placed with."""
    source = random.Random(words)
    return [source.getrandbits(WORD) for _ in range(words)]


def pieces(words: Sequence[int]) -> Iterator[tuple[str, int]]:
    """(contents of a block RAM, how many of its bits are bits of the words) for each way of cutting
    the words, in an order that depends on their number only.
    """
    for width in WIDTHS:
        depth = BITS // width
        for first in range(0, len(words), depth):
            part = words[first : first + depth]
            for low in range(0, WORD, width):
                mask = (1 << width) - 1
                bits = "".join(format(word >> low & mask, f"0{width}b")[::-1] for word in part)
                yield bits.ljust(BITS, "0"), len(bits)


def replaced(rams: Rams, old: Sequence[int], new: Sequence[int]) -> dict[str, str]:
    """The contents of the block RAMs that hold `old`, with `new` in its place; both lists have one
    length. ContentsError if not every bit of `old` is found exactly once.
    """
    known = {
        before: (after, bits)
        for (before, bits), (after, _) in zip(pieces(old), pieces(new), strict=True)
    }
    found = {name: known[bits] for name, bits in rams.items() if bits in known}
    held = sum(bits for _, bits in found.values())
    if held != WORD * len(old):
        raise ContentsError(f"{held} of {WORD * len(old)} bits of the memory are in block RAMs")
    return {name: after for name, (after, _) in found.items()}


def read_ecp5(text: str) -> dict[str, str]:
    """The block RAMs of a configuration of an ECP5: 2048 words of 9 bits, the ninth for parity."""
    return {
        head: "".join(format(int(word, 16) & 0xFF, "08b")[::-1] for word in rows.split())
        for head, rows in ECP5_RAM.findall(text)
    }


def write_ecp5(text: str, rams: Rams) -> str:
    """The configuration with these block RAMs; the bits for parity stay."""

    def block(found: re.Match[str]) -> str:
        head, rows = found.groups()
        if head not in rams:
            return found[0]
        old, bits = [int(word, 16) for word in rows.split()], rams[head]
        new = [word & 0x100 | int(bits[8 * n : 8 * n + 8][::-1], 2) for n, word in enumerate(old)]
        lines = [new[n : n + 8] for n in range(0, len(new), 8)]
        return head + "".join(" ".join(f"{word:03x}" for word in line) + "\n" for line in lines)

    return ECP5_RAM.sub(block, text)


def gowin_rams(design: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """{cell: its parameters} of the block RAMs in a netlist of Yosys or nextpnr."""
    return {
        f"{module} {name}": cell["parameters"]
        for module, content in design["modules"].items()
        for name, cell in content["cells"].items()
        if set(GOWIN_ROWS) <= set(cell.get("parameters", {}))
    }


def groups(row: str) -> list[str]:
    """The 32 groups of bits of a row, the first bit first: eight bits, or nine with parity."""
    size = len(row) // 32
    return [row[::-1][size * n : size * (n + 1)] for n in range(32)]


def read_gowin(text: str) -> dict[str, str]:
    """The block RAMs of a placed design of a Gowin part: 64 rows of 256 bits, and perhaps of 32
    more for parity.
    """
    return {
        name: "".join(group[:8] for row in GOWIN_ROWS for group in groups(values[row]))
        for name, values in gowin_rams(json.loads(text)).items()
    }


def write_gowin(text: str, rams: Rams) -> str:
    """The placed design with these block RAMs; the bits for parity stay."""
    design = json.loads(text)
    for name, values in gowin_rams(design).items():
        for n, row in enumerate(GOWIN_ROWS if name in rams else []):
            new = [rams[name][256 * n + 8 * m : 256 * n + 8 * m + 8] for m in range(32)]
            old = groups(values[row])
            values[row] = "".join(bits + was[8:] for bits, was in zip(new, old, strict=True))[::-1]
    return json.dumps(design)


@dataclass(frozen=True)
class Format:
    """How the file of a placed design holds its block RAMs."""

    read: Callable[[str], dict[str, str]]
    write: Callable[[str, Rams], str]

    def filled(self, text: str, old: Sequence[int], new: Sequence[int]) -> str:
        """The file with the words `new` in place of `old`."""
        return self.write(text, replaced(self.read(text), old, new))


ECP5, GOWIN = Format(read_ecp5, write_ecp5), Format(read_gowin, write_gowin)
