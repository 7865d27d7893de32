# SPDX-License-Identifier: Apache-2.0
"""One node without a machine, for damaged frames in great number."""

from collections.abc import Sequence
from typing import Any

import numpy

from twin import build
from twin.nodes.library import array, library, memory_image
from twin.nodes.twin import BAUD, NODE


def cells_of(words: Sequence[int], gap_cells: int = 0) -> list[int]:
    """Levels of 9-bit words on the bus, one a bit cell."""
    levels: list[int] = []
    for n, word in enumerate(words):
        levels += [1] * (gap_cells if n else 0) + [0, *(word >> bit & 1 for bit in range(9)), 1]
    return levels


class FrameBench:
    """One node without a machine, with a slow clock: 16 cycles a bit, at the baud rate of the
    firmware. It is for 10^5 damaged frames. One with another clk_hz (whole kHz) is another build.

    exchange(levels) puts bit cells on the line as they are and returns the words that the node
    answered."""

    def __init__(
        self,
        address: int = 1,
        clk_hz: int = 1_840_000,
        baud: float = BAUD,
        firmware: Sequence[int] | None = None,
    ) -> None:
        self.handle: int | None = None
        words = build.firmware(axes=1) if firmware is None else firmware
        self.library, self.clk_hz = library(clk_hz, 1, words, NODE), clk_hz
        image = memory_image(self.library, words)
        self.handle = self.library.frame_bench_new(
            address, image.ctypes.data, len(image), clk_hz / baud
        )
        self.words = numpy.empty(256, dtype=numpy.uint16)

    def __del__(self) -> None:
        if self.handle:
            self.library.frame_bench_delete(self.handle)
        self.handle = None

    def exchange(
        self, levels: Any, enough: int = 256, quiet_cells: int = 100, most_cells: int = 2000
    ) -> list[int]:
        """Returns when `enough` words are there, or the line was quiet for quiet_cells after the
        last level or the answer; at the latest after most_cells. A node takes up to 60 cells to
        answer a request, at a low clock.
        """
        sent = array(levels, numpy.uint8)
        count = self.library.frame_bench_exchange(
            self.handle,
            sent.ctypes.data,
            len(sent),
            enough,
            quiet_cells,
            most_cells,
            self.words.ctypes.data,
            len(self.words),
        )
        return [int(word) for word in self.words[:count]]

    def idle(self, cells: float, baud: float = BAUD) -> None:
        """Let bit cells pass."""
        self.library.frame_bench_idle(self.handle, round(cells * self.clk_hz / baud))

    def time(self) -> float:
        """Simulated seconds since reset."""
        return float(self.library.frame_bench_now(self.handle) / self.clk_hz)
