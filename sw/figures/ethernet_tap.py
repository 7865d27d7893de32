# SPDX-License-Identifier: Apache-2.0
"""The simulated node of figures.ethernet behind a TAP device of Linux, in a network namespace of
its own: the kernel's ARP and ping and any program that uses UDP reach it like a board.

    python -m figures.ethernet_tap COMMAND …      e.g. ping -c 3 192.168.1.50

runs a command in this namespace, whose interface has the address 192.168.1.1. It needs LiteX
(`make litex`), and root. The node is slower than a board: an answer takes some milliseconds.
"""

import os
import select
import subprocess
import sys
import threading
from collections.abc import Sequence
from types import TracebackType
from typing import Self

from figures.ethernet import EthernetNode
from twin.devices.tap import open_tap

DEVICE = "moire0"
NETWORK = "192.168.1.1/24"  # address of the host
LONGEST = 2048  # bytes of a frame, rounded up
CYCLES = 200  # of the PHY in one step
POLL_S = 0.001  # how long an idle node waits for a frame


class NodeBehindTap:
    """Serves a node from a thread, from its start to its end as a context. OSError: the machine
    does not allow a TAP device.
    """

    def __init__(self, node: EthernetNode) -> None:
        self.node, self.stopped = node, threading.Event()
        self.frames = open_tap(DEVICE)
        for words in (("address", "add", NETWORK), ("link", "set", "up")):
            subprocess.run(["ip", *words, "dev", DEVICE], check=True)
        self.thread = threading.Thread(target=self.serve)

    def __enter__(self) -> Self:
        self.thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stopped.set()
        self.thread.join()
        os.close(self.frames)

    def serve(self) -> None:
        """Exchanges frames until the context ends."""
        while not self.stopped.is_set():
            if select.select([self.frames], [], [], POLL_S)[0]:
                self.node.send(os.read(self.frames, LONGEST))
            for frame in self.node.frames(CYCLES):
                os.write(self.frames, frame)


def main(command: Sequence[str] | None = None) -> int:
    words = sys.argv[1:] if command is None else list(command)
    if not words:
        print(__doc__, file=sys.stderr)
        return 2
    if os.environ.get(DEVICE) is None:  # not in the namespace yet
        again = ["unshare", "--net", sys.executable, "-m", "figures.ethernet_tap", *words]
        return subprocess.run(again, env={**os.environ, DEVICE: "here"}).returncode
    with NodeBehindTap(EthernetNode()):
        return subprocess.run(words).returncode


if __name__ == "__main__":
    sys.exit(main())
