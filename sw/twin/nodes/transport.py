# SPDX-License-Identifier: Apache-2.0
"""The transport of the host package over a twin."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Self

from twin.nodes.twin import CELLS, Twin

if TYPE_CHECKING:
    from moire.bus.transport import Transport
else:
    Transport = object  # the twin runs without the host package

BREAK_S = 0.003  # the line low; nodes want 2 ms
# the host hears a word half a cell before its end; the node's driver lets go half a cell after it
TURNAROUND_CELLS = 2


class TwinTransport(Transport):
    """The transport of the host package over a twin; time passes only as far as needed."""

    time_is_stopped = handshake = True

    def __init__(self, twin: Twin) -> None:
        self.twin, self.character_s, self.addresses = twin, CELLS / twin.baud, twin.addresses

    def send(self, words: Sequence[int]) -> None:
        """Send words of nine bits."""
        self.twin.run(TURNAROUND_CELLS / self.twin.baud)
        self.twin.send_words(list(words))
        self.twin.run(len(words) * self.character_s)

    def receive(self, count: int, timeout_s: float) -> list[int]:
        """At most `count` words; fewer when timeout_s of simulated time has passed."""
        self.twin.run_until_words(count, timeout_s)
        return self.twin.receive_words(count) if count else []

    def now(self) -> float:
        """Simulated time in s."""
        return self.twin.time()

    def wait(self, seconds: float) -> None:
        """Let simulated time pass."""
        self.twin.run(seconds)

    def reaches(self, address: int) -> bool:
        """Whether this address can be called: all can."""
        return True

    def speed(self) -> float | None:
        """None: there is no server that could say how fast the twin runs."""
        return None

    def set_baud(self, baud: float) -> None:
        """Change the baud rate of the host."""
        self.twin.set_host_baud(baud)
        self.character_s = CELLS / baud

    def send_break(self) -> None:
        """Hold the bus low for BREAK_S."""
        self.twin.send_levels([0], BREAK_S)
        self.twin.run(BREAK_S + 2 * self.character_s)

    def close(self) -> None:
        """Free the twin."""
        self.twin.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
