# SPDX-License-Identifier: Apache-2.0
"""The packets of the real-time link over UDP: a gateway to the serial line of a node.

In lockstep with a simulated node, one datagram in lets the machine run for one cycle, and the reply
goes out after it. So a driver runs in simulated time, on any machine:

    gateway = LinkGateway(twin.link(), cycle_s=0.001)
    gateway.serve()
"""

import socket
from types import TracebackType
from typing import Protocol, Self

from moire.bus.cobs import PacketReader, sealed
from moire.made import link_tables as layout

LONGEST_PACKET = 4 * layout.LONGEST_WORDS  # bytes
LONGEST_STUFFED = LONGEST_PACKET + LONGEST_PACKET // 254 + 1
LOCALHOST = "127.0.0.1"
POLL_S = 0.1  # how often `serve` looks whether it has been stopped


class Line(Protocol):
    """A serial line: twin.link() of a simulated node, or that of a port."""

    def exchange(self, data: bytes, seconds: float) -> bytes:
        """Sends bytes, waits for so many seconds, and returns what came meanwhile."""


class LinkGateway:
    """A UDP server for one line. Each datagram is a packet without framing; the reply goes to the
    sender of the request. `port` 0 takes any free port; `address` is where it listens.
    """

    def __init__(
        self, line: Line, cycle_s: float = 0.001, host: str = LOCALHOST, port: int = 0
    ) -> None:
        self.line, self.cycle_s = line, cycle_s
        self.reader, self.stopped = PacketReader(LONGEST_STUFFED), False
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((host, port))
        self.address: tuple[str, int] = self.socket.getsockname()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.socket.close()

    def serve_one(self, timeout_s: float | None = None) -> bool:
        """Waits for a request and answers it; False if none has come in time."""
        self.socket.settimeout(timeout_s)
        try:
            request, sender = self.socket.recvfrom(2 * LONGEST_PACKET)
        except TimeoutError:
            return False
        for reply in self.reader.feed(self.line.exchange(sealed(request), self.cycle_s)):
            self.socket.sendto(reply, sender)
        return True

    def serve(self) -> None:
        """Answers requests until `stop` is called from another thread."""
        while not self.stopped:
            self.serve_one(POLL_S)

    def stop(self) -> None:
        """Ends `serve`."""
        self.stopped = True
