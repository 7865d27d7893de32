# SPDX-License-Identifier: Apache-2.0
"""Lets clients onto a line: RFC 2217, TCP and a pseudo terminal in front of any transport, the
twin's above all.

    gateway = Gateway(TwinTransport(Twin()))
    gateway.open_rfc2217("127.0.0.1", 2217)
    gateway.serve()

A client of RFC 2217 with a parity has the 9-bit line itself; one without (8N1), and those of TCP
and of the pseudo terminal, speak COBS
packets, for which the gateway does the exchange. Packets are served one after the other, and wait
while an exchange of a 9-bit client is
under way. A transport whose time stands is kept at the pace of the clock, as far as this computer
can.
"""

import errno
import os
import selectors
import socket
import time
from collections import deque

from moire.bus import rfc2217
from moire.bus.client import Bus
from moire.bus.cobs import PacketReader, address_of, body_of, sealed
from moire.bus.protocol import CRC_LENGTH, FROM_NODE, NINTH, TO_NODE, Exchange, Timing
from moire.bus.transport import BITS, Transport, plain
from moire.errors import PortError

ANSWER_S = 0.05  # patience with a node; the client asks again
HOLD_S = 0.1  # of the clock, that packets wait for a 9-bit client in the middle of an exchange
# of the line's time, that a 9-bit client's words are answered in; it may run ahead of the clock for
# so long
REPLY_S = 0.01
PIECE_S = 0.00025  # of the line's time between two looks at the clients
LARGEST_DEBT_S = 0.01  # of a line that cannot keep up: what it is behind beyond this is forgotten
RECEIVE = 4096


class Gateway:
    def __init__(self, transport: Transport):
        self.transport, self.bus = transport, Bus(transport)
        self.selector, self.clients, self.waiting = selectors.DefaultSelector(), [], deque()
        self.ninth_client, self.reply = (
            None,
            None,
        )  # the 9-bit client that spoke last, and its reply as far as it has come
        self.held_until = self.ahead_until = 0.0
        self.refused = 0  # packets that were none, or no request
        self.origin = time.monotonic() - transport.now()
        self.own_baud = self.baud = round(BITS / transport.character_s)

    # entrances

    def open_rfc2217(self, host: str, port: int) -> int:
        return self.listen(host, port, Rfc2217Client)

    def open_tcp(self, host: str, port: int) -> int:
        return self.listen(host, port, PacketClient)

    def listen(self, host: str, port: int, kind) -> int:
        """Returns the port; 0 takes any that is free."""
        try:
            listener = socket.create_server((host, port))
        except (OSError, OverflowError) as error:
            why = (
                os.strerror(error.errno).lower()
                if getattr(error, "errno", 0) in errno.errorcode
                else plain(error)
            )
            raise PortError(
                f"the TCP port {port} at {host} does not open: {why}; choose another, or 0 for any"
            ) from None
        listener.setblocking(False)
        self.selector.register(listener, selectors.EVENT_READ, lambda: self.admit(listener, kind))
        return listener.getsockname()[1]

    def admit(self, listener, kind):
        try:
            connection, _ = listener.accept()
        except OSError:
            return  # gone before it came in
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setblocking(False)
        self.add(kind(self, SocketStream(connection)))

    def open_pty(self) -> str:
        """Returns the name of the terminal."""
        try:
            import tty
        except ImportError:
            raise PortError("this system has no pseudo terminals: use --tcp or --rfc2217") from None
        near, far = os.openpty()
        tty.setraw(far)
        os.set_blocking(near, False)
        self.add(PacketClient(self, TerminalStream(near, far)))
        return os.ttyname(far)

    def add(self, client):
        self.clients.append(client)
        self.selector.register(client.stream, selectors.EVENT_READ, client.arrive)

    def dismiss(self, client):
        if client in self.clients:
            self.clients.remove(client)
            self.selector.unregister(client.stream)
            client.stream.close()
        if client is self.ninth_client:
            self.ninth_client, self.held_until = None, 0.0

    # service

    def serve(self, seconds: float | None = None):
        end = None if seconds is None else time.monotonic() + seconds
        while end is None or time.monotonic() < end:
            self.poll(self.follow_clock())

    def poll(self, patience_s: float):
        """One look at all clients, then what they want of the line."""
        for key, _ in self.selector.select(patience_s):
            key.data()
        if self.ninth_client is not None:
            self.forward(self.transport.receive(RECEIVE, 0))
        if self.waiting and self.idle:
            client, address, body = self.waiting.popleft()
            client.send(self.answer(address, body))

    @property
    def idle(self) -> bool:
        """No exchange of a 9-bit client is under way."""
        return time.monotonic() >= self.held_until

    def follow_clock(self) -> float:
        """Lets the line live as long as the clock went on; returns how long it may rest then."""
        if not self.transport.time_is_stopped:
            return PIECE_S
        now = self.transport.now()
        behind, ahead = (
            time.monotonic() - self.origin - now,
            now < self.ahead_until and not self.idle,
        )
        if behind > LARGEST_DEBT_S:
            self.origin += behind - LARGEST_DEBT_S
        if behind > 0 or ahead:
            self.transport.wait(PIECE_S)
        return 0 if behind > PIECE_S or ahead or self.waiting and self.idle else PIECE_S

    def close(self):
        for client in list(self.clients):
            self.dismiss(client)
        for key in list(self.selector.get_map().values()):
            key.fileobj.close()
        self.selector.close()
        self.transport.close()

    # what clients want

    def speak_at(self, baud: int):
        if baud != self.baud:
            self.baud = baud
            self.transport.set_baud(baud)

    def hear_words(self, client, words: list, baud: int):
        """Words of a 9-bit client, straight to the line; what comes back is for who spoke last."""
        self.ninth_client = client
        if any(word & NINTH for word in words):
            asks = words[-1] & NINTH and words[-1] >> 4 & 3 == FROM_NODE
            self.reply = [] if asks else None
        self.speak_at(baud)
        self.transport.send(words)
        self.hold()

    def hold(self):
        self.held_until = time.monotonic() + HOLD_S
        self.ahead_until = self.transport.now() + REPLY_S

    def forward(self, words: list):
        """To the 9-bit client; a whole reply ends its exchange."""
        if not words:
            return
        self.ninth_client.send(bytes(word & 0xFF for word in words))
        self.hold()
        if self.reply is not None:
            self.reply += words
            if len(self.reply) > 1 and len(self.reply) >= 2 + self.reply[1] + CRC_LENGTH:
                self.reply, self.held_until = None, 0.0

    def hear_packet(self, client, content: bytes):
        """A client that asks again has given up what it asked before."""
        address, body = address_of(content, TO_NODE), body_of(content)
        if address is None or body is None:
            self.refused += 1
            return
        self.waiting = deque(entry for entry in self.waiting if entry[0] is not client)
        self.waiting.append((client, address, body))

    def answer(self, address: int, body: bytes) -> bytes:
        """The reply as a packet; nothing where the node does not answer."""
        self.speak_at(self.own_baud)
        timing = Timing(
            self.transport.character_s,
            answer=ANSWER_S,
            quiet=max(REPLY_S, 3 * self.transport.character_s),
        )
        exchange = self.bus.run_exchange(Exchange(address, body, tries=1, timing=timing))
        return sealed(bytes(exchange.received)) if exchange.reply else b""


# ------------------------------------------------------------------ clients


class PacketClient:
    def __init__(self, gateway: Gateway, stream):
        self.gateway, self.stream, self.packets = gateway, stream, PacketReader()

    def arrive(self):
        data = self.stream.read()
        if data is None:
            self.gateway.dismiss(self)
        elif data:
            self.take(data)

    def take(self, data: bytes):
        for content in self.packets.feed(data):
            self.gateway.hear_packet(self, content)

    def send(self, data: bytes):
        """What came from the line."""
        self.put(data)

    def put(self, data: bytes):
        if data and not self.stream.write(data):
            self.gateway.dismiss(self)


class Rfc2217Client(PacketClient):
    def __init__(self, gateway: Gateway, stream):
        super().__init__(gateway, stream)
        self.server = rfc2217.Server(gateway.own_baud)

    def take(self, data: bytes):
        characters = self.server.feed(data)
        self.put(self.server.take_answers())
        words = [
            character.byte | character.ninth * NINTH
            for character in characters
            if character.parity != "N"
        ]
        if words:
            self.gateway.hear_words(self, words, self.server.baud)
        super().take(bytes(character.byte for character in characters if character.parity == "N"))

    def send(self, data: bytes):
        self.put(rfc2217.escaped(data))


class SocketStream:
    """read() returns None when the other side is gone; write() False when it does not take any
    more.
    """

    def __init__(self, connection):
        self.connection = connection

    def fileno(self):
        return self.connection.fileno()

    def read(self):
        try:
            return self.connection.recv(RECEIVE) or None
        except BlockingIOError:
            return b""
        except OSError:
            return None

    def write(self, data: bytes) -> bool:
        try:
            return self.connection.send(data) == len(data)
        except OSError:
            return False

    def close(self):
        self.connection.close()


class TerminalStream:
    """Holds the far end open too, so that it outlives its clients."""

    def __init__(self, near: int, far: int):
        self.near, self.far = near, far

    def fileno(self):
        return self.near

    def read(self):
        try:
            return os.read(self.near, RECEIVE)
        except OSError:
            return b""

    def write(self, data: bytes) -> bool:
        try:
            os.write(self.near, data)
        except OSError:
            pass  # nobody reads: what does not fit is lost, as on a wire
        return True

    def close(self):
        os.close(self.near)
        os.close(self.far)
