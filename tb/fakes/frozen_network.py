# SPDX-License-Identifier: Apache-2.0
"""A connection to a server that can fall silent, as a network does that is gone: both ends stay
open, and nothing arrives any more.
"""

import contextlib
import socket
import threading


class FrozenNetwork:
    """Forwards connections to (host, port) until `frozen` is set. `port` is its own."""

    def __init__(self, place):
        self.place, self.frozen = place, threading.Event()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.open = []
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        with contextlib.suppress(OSError):  # it has been closed
            while True:
                near, _ = self.listener.accept()
                far = socket.create_connection(self.place)
                self.open += [near, far]
                for source, sink in ((near, far), (far, near)):
                    threading.Thread(target=self.forward, args=(source, sink), daemon=True).start()

    def forward(self, source, sink):
        with contextlib.suppress(OSError):
            while (data := source.recv(65536)) and not self.frozen.is_set():
                sink.sendall(data)
            if not self.frozen.is_set():
                sink.shutdown(socket.SHUT_WR)

    def close(self):
        for one in (self.listener, *self.open):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
