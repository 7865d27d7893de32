# SPDX-License-Identifier: Apache-2.0
"""The port of pyserial for `socket://HOST:PORT`, which closes at once: that of pyserial waits 0.3 s
after it was closed, longer than a short command of `moire` takes otherwise.
"""

import socket

from serial.urlhandler import protocol_socket


class TcpPort(protocol_socket.Serial):
    """A connection by TCP as a port of pyserial."""

    _socket: socket.socket | None = None

    def close(self) -> None:
        """Ends the connection; whoever closed it already is not told again."""
        connection, self._socket, self.is_open = self._socket, None, False
        if connection is None:
            return
        try:
            connection.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass  # the other side has ended it
        connection.close()
