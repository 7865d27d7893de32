# SPDX-License-Identifier: Apache-2.0
"""Connects clients to a bus: RFC 2217, TCP and a pseudo terminal in front of any transport, such as
that of a simulated machine.

    gateway = Gateway(TwinTransport(Twin()))
    gateway.open_rfc2217("127.0.0.1", 2217)
    gateway.serve()

A client of RFC 2217 with a parity uses the 9-bit bus itself. One without (8N1), and the clients of
TCP and of the pseudo terminal, send COBS packets, for which the gateway does the exchange. Packets
are served one after the other, and wait while an exchange of a 9-bit client is under way. What one
client may do while another one moves an axis, and what becomes of the axes of a client that has
gone, is decided by moire.bus.arbiter. A 9-bit client is on the bus itself, so none of this holds
for it. A transport whose time is stopped runs at the speed of the clock, as far as this computer
can. Clients of another kind, such as those of moire.web, run in threads of their own: they enter
by call_soon() and ask by enqueue().

The loop uses selectors and not asyncio: a transport blocks while it sends, and a simulated machine
has to run a little between two polls of the clients, so that coroutines would have nothing to wait
for together.
"""

import errno
import os
import random
import selectors
import socket
import time
from collections import Counter, deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from moire.bus import rfc2217
from moire.bus.arbiter import POLLS, Arbiter, Place, is_urgent, operation_of, places_of
from moire.bus.cobs import PacketReader, address_of, body_of, nobody, packet, speed_reply
from moire.bus.exchanges import Exchanges
from moire.bus.protocol import (
    CRC_LENGTH,
    FROM_NODE,
    NINTH,
    TO_NODE,
    Exchange,
    Timing,
    ready_byte,
)
from moire.bus.recent import Recent
from moire.bus.transport import BITS, Transport, plain
from moire.errors import PortError

ANSWER_S = 0.05  # patience with a node in one attempt
# attempts with a node that has answered before: a new target during a motion takes the firmware
# 0.125 s, and a repetition is recognised only if no other request came in between
TRIES = 4
HOLD_S = 0.1  # of the clock: how long packets wait for a 9-bit client in the middle of an exchange
# of the time of the bus: within it the words of a 9-bit client are answered, and so long a stopped
# time may run ahead of the clock
REPLY_S = 0.01
PIECE_S = 0.00025  # of the time of the bus, between two polls of the clients
LARGEST_LAG_S = 0.01  # of a bus that is too slow: a larger lag behind the clock is forgotten
RECEIVE = 4096
SPEED_S = 0.5  # of the clock: over this time the speed of a stopped time is measured


class Stream(Protocol):
    """The connection to a client; `place` says in words where the client is."""

    @property
    def place(self) -> str:
        """Such as 127.0.0.1:40122."""

    def fileno(self) -> int:
        """The file descriptor to poll."""

    def read(self) -> bytes | None:
        """The bytes that arrived, None when the client has gone."""

    def write(self, data: bytes) -> bool:
        """Sends bytes; False when the client does not take them."""

    def close(self) -> None:
        """Ends the connection."""


@dataclass(frozen=True)
class Waiting:
    """A request that waits for the bus. `answer` takes the body of the reply, and None if the node
    does not answer or the server ends.
    """

    client: Hashable  # as the arbiter knows it
    address: int
    body: bytes
    answer: Callable[[bytes | None], None]


class Gateway:
    """All clients of one transport. `refused` counts packets that were no request. `recent` has the
    last replies to polls, `time` the time of the bus at the last poll of the clients, and `speed`
    how fast a stopped time runs, in seconds per second of the clock; None for the time of the
    clock itself, and until it is measured.
    """

    def __init__(self, transport: Transport):
        self.transport, self.exchanges = transport, Exchanges(transport)
        self.recent, self.time = Recent(), transport.now()
        self.speed: float | None = None
        self.speed_since = time.monotonic(), self.time
        self.calls: deque[Callable[[], None]] = deque()  # from other threads
        self.selector = selectors.DefaultSelector()
        self.listeners: list[socket.socket] = []
        self.clients: list[PacketClient] = []
        self.waiting: deque[Waiting] = deque()
        self.stops: Counter[Place] = Counter()  # requests that stop an axis or switch it off
        self.ninth_client: PacketClient | None = None  # the 9-bit client that sent last
        self.reply: list[int] | None = None  # its reply, as far as it has arrived
        self.held_until = self.ahead_until = 0.0
        self.arbiter = Arbiter(self.ask, transport.now)
        self.refused = 0
        self.present: set[int] = set()  # addresses that answered their last request
        # the last number of a request to each node: those of the clients may be alike
        self.sequences = [random.randrange(256) for _ in range(16)]
        self.origin = time.monotonic() - transport.now()
        self.own_baud = self.baud = round(BITS / transport.character_s)

    # entrances

    def open_rfc2217(self, host: str, port: int) -> int:
        """Listens for clients of RFC 2217; returns the TCP port, which is any free one for 0."""
        return self.listen(host, port, Rfc2217Client)

    def open_tcp(self, host: str, port: int) -> int:
        """Listens for clients with COBS packets; returns the TCP port, any free one for 0."""
        return self.listen(host, port, PacketClient)

    def listen(self, host: str, port: int, kind: "type[PacketClient]") -> int:
        """Listens on a TCP port; raises PortError."""
        try:
            listener = socket.create_server((host, port))
        except (OSError, OverflowError) as error:
            number = getattr(error, "errno", 0)
            reason = os.strerror(number).lower() if number in errno.errorcode else plain(error)
            raise PortError(
                f"the TCP port {port} at {host} does not open: {reason}; choose another, or 0 for "
                "any"
            ) from None
        listener.setblocking(False)
        self.listeners.append(listener)
        self.selector.register(listener, selectors.EVENT_READ, lambda: self.admit(listener, kind))
        return int(listener.getsockname()[1])

    def admit(self, listener: socket.socket, kind: "type[PacketClient]") -> None:
        """Accepts a client."""
        try:
            connection, _ = listener.accept()
        except OSError:
            return  # it has gone already
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setblocking(False)
        self.add(kind(self, SocketStream(connection)))

    def open_pty(self) -> str:
        """Opens a pseudo terminal for COBS packets; returns its name. Raises PortError."""
        try:
            import tty
        except ImportError:
            raise PortError("this system has no pseudo terminals: use --tcp or --rfc2217") from None
        near, far = os.openpty()
        tty.setraw(far)
        os.set_blocking(near, False)
        self.add(PacketClient(self, TerminalStream(near, far)))
        return os.ttyname(far)

    def add(self, client: "PacketClient") -> None:
        """Polls a client from now on."""
        self.clients.append(client)
        self.selector.register(client.stream, selectors.EVENT_READ, client.arrive)

    def dismiss(self, client: "PacketClient") -> None:
        """Forgets a client that has gone."""
        if client in self.clients:
            self.clients.remove(client)
            self.selector.unregister(client.stream)
            client.stream.close()
            self.depart(client)
        if client is self.ninth_client:
            self.ninth_client, self.held_until = None, 0.0

    # service

    def serve(self, seconds: float | None = None) -> None:
        """Serves the clients, for ever or so long."""
        end = None if seconds is None else time.monotonic() + seconds
        while end is None or time.monotonic() < end:
            self.poll(self.follow_clock())

    def poll(self, patience_s: float) -> None:
        """Polls all clients once, waiting at most so long, then does what they ask for."""
        self.time = self.transport.now()
        self.measure_speed()
        while self.calls:
            self.calls.popleft()()
        for key, _ in self.selector.select(patience_s):
            handle: Callable[[], None] = key.data
            handle()
        if self.ninth_client is not None:
            self.forward(self.ninth_client, self.transport.receive(RECEIVE, 0))
        if self.idle:
            self.arbiter.see_off()
            if self.waiting:
                self.serve_next()

    def call_soon(self, work: Callable[[], None]) -> None:
        """Does this work in the thread that polls, at the next poll; for other threads."""
        self.calls.append(work)

    def measure_speed(self) -> None:
        """How fast a stopped time has run lately."""
        since, began = self.speed_since
        took = time.monotonic() - since
        if took >= SPEED_S:
            if self.transport.time_is_stopped:
                self.speed = (self.time - began) / took
            self.speed_since = since + took, self.time

    @property
    def idle(self) -> bool:
        """No exchange of a 9-bit client is under way."""
        return time.monotonic() >= self.held_until

    def follow_clock(self) -> float:
        """Lets a stopped time follow the clock; returns how long the gateway may then wait."""
        if not self.transport.time_is_stopped:
            return PIECE_S
        now = self.transport.now()
        behind = time.monotonic() - self.origin - now
        ahead = now < self.ahead_until and not self.idle
        if behind > LARGEST_LAG_S:
            self.origin += behind - LARGEST_LAG_S
        if behind > 0 or ahead:
            self.transport.wait(PIECE_S)
        return 0 if behind > PIECE_S or ahead or self.waiting and self.idle else PIECE_S

    def close(self) -> None:
        """Closes all connections and the transport."""
        for client in list(self.clients):
            self.dismiss(client)
        for listener in self.listeners:
            listener.close()
        for one in self.waiting:
            one.answer(None)
        self.selector.close()
        self.transport.close()

    # requests of clients

    def use_baud(self, baud: int) -> None:
        """Changes the rate of the bus if it must change."""
        if baud != self.baud:
            self.baud = baud
            self.transport.set_baud(baud)

    def send_words(self, client: "PacketClient", words: list[int], baud: int) -> None:
        """Sends the words of a 9-bit client; what comes back is for the client that sent last."""
        self.ninth_client = client
        if any(word & NINTH for word in words):
            asks = words[-1] & NINTH and words[-1] >> 4 & 3 == FROM_NODE
            self.reply = [] if asks else None
        self.use_baud(baud)
        self.recent.clear()
        self.transport.send(words)
        self.hold()

    def hold(self) -> None:
        """An exchange of a 9-bit client is under way: packets wait."""
        self.held_until = time.monotonic() + HOLD_S
        self.ahead_until = self.transport.now() + REPLY_S

    def forward(self, client: "PacketClient", words: list[int]) -> None:
        """Passes received words to the 9-bit client; a complete reply ends its exchange."""
        if not words:
            return
        client.send(bytes(word & 0xFF for word in words))
        self.hold()
        if self.reply is not None:
            self.reply += words
            if len(self.reply) > 1 and len(self.reply) >= 2 + self.reply[1] + CRC_LENGTH:
                self.reply, self.held_until = None, 0.0

    def take_packet(self, client: "PacketClient", content: bytes) -> None:
        """Queues a request. A client that asks again has given up its earlier request. A request to
        the server itself is answered at once.
        """
        if (own := speed_reply(content, self.speed)) is not None:
            client.knows_server = True
            client.send(own)
            return
        address, body = address_of(content, TO_NODE), body_of(content)
        if address is None or body is None:
            self.refused += 1
            return
        self.forget_requests(client)
        self.enqueue(Waiting(client, address, body, partial(client.answer, address, body)))

    def enqueue(self, one: Waiting) -> None:
        """Queues a request; one that stops an axis goes ahead of the others."""
        if is_urgent(one.body):
            self.stops.update(places_of(one.address, operation_of(one.body), one.body))
            self.waiting.appendleft(one)
        else:
            self.waiting.append(one)

    def forget_requests(self, client: Hashable) -> None:
        """What this client has asked for, and has not been asked of a node yet, is not done."""
        self.waiting = deque(one for one in self.waiting if one.client is not client)

    def depart(self, client: Hashable) -> None:
        """A client has left: nothing more is done for it, and what it moves is stopped."""
        for one in [one for one in self.waiting if one.client is client]:
            one.answer(None)
        self.forget_requests(client)
        self.arbiter.depart(client)

    def serve_next(self) -> None:
        """Answers the request that has waited longest, and with the same reply those of other
        clients who poll the same.
        """
        first = self.waiting.popleft()
        reply = self.arbiter.answer(first.client, first.address, first.body)
        asked = [first]
        if operation_of(first.body) in POLLS:
            asked += [
                one
                for one in self.waiting
                if one.address == first.address and one.body[1:] == first.body[1:]
            ]
            for one in asked[1:]:
                self.waiting.remove(one)
        for one in asked:
            one.answer(None if reply is None else one.body[:1] + reply[1:])

    def ask(self, address: int, body: bytes) -> bytes | None:
        """The reply of a node, both bodies without their sequence numbers; None without a reply."""
        self.use_baud(self.own_baud)
        timing = Timing(
            self.transport.character_s,
            answer=ANSWER_S,
            quiet=max(REPLY_S, 3 * self.transport.character_s),
        )
        sequence = self.sequences[address] = (self.sequences[address] + 1) % 256
        tries = TRIES if address in self.present else 1  # the client asks again
        exchange = self.exchanges.run(
            Exchange(address, bytes([sequence]) + body, tries, timing, self.transport.handshake)
        )
        received = None if exchange.reply is None else bytes(exchange.received[3:-CRC_LENGTH])
        self.time = self.transport.now()
        self.recent.note(address, body, received, self.time)
        if received is None:
            self.present.discard(address)
        else:
            self.present.add(address)
        return received


# ------------------------------------------------------------------ clients


class PacketClient:
    """A client that sends COBS packets."""

    kind = "COBS client"

    def __init__(self, gateway: Gateway, stream: Stream):
        self.gateway, self.stream, self.packets = gateway, stream, PacketReader()
        self.knows_server = False  # it has asked the server itself something

    def __str__(self) -> str:
        return f"the {self.kind} at {self.stream.place}"

    def arrive(self) -> None:
        """Reads what the client sent; forgets a client that has gone."""
        data = self.stream.read()
        if data is None:
            self.gateway.dismiss(self)
        elif data:
            self.take(data)

    def take(self, data: bytes) -> None:
        """Passes the packets in the data to the gateway."""
        for content in self.packets.feed(data):
            self.gateway.take_packet(self, content)

    def answer(self, address: int, body: bytes, reply: bytes | None) -> None:
        """Sends the reply to a request. Without one a client that looks for nodes, and has asked
        the server itself before, learns that nobody is there; for others a node may only be busy.
        """
        if reply is not None:
            self.send(packet(ready_byte(address, FROM_NODE), reply))
        elif self.knows_server and operation_of(body) == "identify":
            self.send(nobody(body[0], address))

    def send(self, data: bytes) -> None:
        """Sends what came from the bus."""
        self.put(data)

    def put(self, data: bytes) -> None:
        """Sends bytes; forgets a client that does not take them."""
        if data and not self.stream.write(data):
            self.gateway.dismiss(self)


class Rfc2217Client(PacketClient):
    """A client of RFC 2217: 9-bit words where its port has a parity, COBS packets where not."""

    kind = "RFC 2217 client"

    def __init__(self, gateway: Gateway, stream: Stream):
        super().__init__(gateway, stream)
        self.server = rfc2217.Server(gateway.own_baud)

    def take(self, data: bytes) -> None:
        characters = self.server.feed(data)
        self.put(self.server.take_answers())
        words = [
            character.byte | character.ninth * NINTH
            for character in characters
            if character.parity != "N"
        ]
        if words:
            self.gateway.send_words(self, words, self.server.baud)
        super().take(bytes(character.byte for character in characters if character.parity == "N"))

    def send(self, data: bytes) -> None:
        self.put(rfc2217.escaped(data))


class SocketStream:
    """A TCP connection."""

    def __init__(self, connection: socket.socket):
        self.connection = connection
        try:
            self.place = "{}:{}".format(*connection.getpeername()[:2])
        except OSError:  # it has gone already
            self.place = "an address that has gone"

    def fileno(self) -> int:
        """The file descriptor to poll."""
        return self.connection.fileno()

    def read(self) -> bytes | None:
        """The bytes that arrived, None when the client has gone."""
        try:
            return self.connection.recv(RECEIVE) or None
        except BlockingIOError:
            return b""
        except OSError:
            return None

    def write(self, data: bytes) -> bool:
        """Sends bytes; False when the client does not take them."""
        try:
            return self.connection.send(data) == len(data)
        except OSError:
            return False

    def close(self) -> None:
        """Ends the connection."""
        self.connection.close()


class TerminalStream:
    """A pseudo terminal. It holds the far end open too, so that it outlives its clients."""

    place = "the pseudo terminal"

    def __init__(self, near: int, far: int):
        self.near, self.far = near, far

    def fileno(self) -> int:
        """The file descriptor to poll."""
        return self.near

    def read(self) -> bytes | None:
        """The bytes that arrived."""
        try:
            return os.read(self.near, RECEIVE)
        except OSError:
            return b""

    def write(self, data: bytes) -> bool:
        """Sends bytes. What does not fit is lost, as on a wire that no client reads."""
        try:
            os.write(self.near, data)
        except OSError:
            pass
        return True

    def close(self) -> None:
        """Closes both ends."""
        os.close(self.near)
        os.close(self.far)
