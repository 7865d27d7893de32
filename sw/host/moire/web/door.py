# SPDX-License-Identifier: Apache-2.0
"""The server of HTTP and WebSocket in a thread of its own, beside the thread of the gateway.

A connection of HTTP is a client, so its end is the end of the client. Connections that send
nothing, half a request, or more than they may are closed; none of this reaches the thread of the
bus.
"""

import asyncio
import contextlib
import logging
import re
import socket
import ssl
import sys
import threading
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from moire.bus.gateway import Gateway
from moire.description import Description
from moire.errors import PortError
from moire.web.access import Access, Meter, is_loopback, kept_token
from moire.web.answers import Doors, text_of
from moire.web.app import application
from moire.web.bridge import LEASE_S, NO_NAMES, Bridge, Client
from moire.web.refusals import BadRequest, body_of

REQUEST_S = 5.0  # of the clock, for the head of a request to arrive
LONGEST_HEAD = 16384  # bytes
LONGEST_MESSAGE = 32768  # bytes, of the WebSocket
# of a connection whose other end may be lost, such as that of a computer without power: seconds
# without a word until it is asked, between two questions, and how many stay unanswered
KEEPALIVE = {"TCP_KEEPIDLE": 2, "TCP_KEEPINTVL": 1, "TCP_KEEPCNT": 3}
UNTAKEN_MS = 10_000  # of the clock: what is sent has to be taken within it
MOST_CONNECTIONS, MOST_OF_ONE_HOST = 256, 64
END_S = 1  # of the clock, for connections to close at the end of the server
SWITCH_S = 0.0005  # of the clock: so soon the thread of the bus gets its turn


@dataclass(frozen=True)
class Settings:
    """Where to listen, and who may ask. A token is made where the file has none."""

    host: str = "127.0.0.1"
    port: int = 0
    token: Path | None = None  # on another address than the loopback one it is needed
    read_token: Path | None = None
    certificate: Path | None = None  # of TLS, with its key
    key: Path | None = None
    description: Description = NO_NAMES  # of the machine: names of its axes


@dataclass
class Crowd:
    """The connections that are open, by host."""

    bridge: Bridge
    hosts: Counter[str] = field(default_factory=Counter)

    def is_full_for(self, host: str) -> bool:
        """Whether one more connection would be too many."""
        of_one = MOST_CONNECTIONS if is_loopback(host) else MOST_OF_ONE_HOST
        return self.hosts.total() >= MOST_CONNECTIONS or self.hosts[host] >= of_one


def watch(connection: Any) -> None:
    """Lets the operating system notice that the other end of a connection is lost."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # head and body: two writes
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in {**KEEPALIVE, "TCP_USER_TIMEOUT": UNTAKEN_MS}.items():
        if hasattr(socket, name):  # Linux has all of them
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


class Connection(H11Protocol):
    """A connection of HTTP. `peer` is its client once it has asked for something."""

    crowd: Crowd  # of the server, set by WebDoor

    def __init__(self, *arguments: Any, **named: Any):
        super().__init__(*arguments, **named)
        self.peer: Client | None = None
        self.meter, self.host = Meter(), ""
        self.deadline: asyncio.TimerHandle | None = None
        self.app_state = {**self.app_state, "connection": self}

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        watch(transport.get_extra_info("socket"))
        host = self.client[0] if self.client else ""
        if self.crowd.is_full_for(host):
            transport.abort()
            return
        self.host = host
        self.crowd.hosts[host] += 1
        self.await_request()

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self.forget_deadline()
        self.crowd.hosts -= Counter([self.host] if self.host else [])
        waits = self.cycle is not None and not self.cycle.response_complete
        if self.peer is not None and (self.peer.given is None or waits):
            self.crowd.bridge.leave(self.peer)

    def data_received(self, data: bytes) -> None:
        if self.cycle is not None and not (self.cycle.more_body or self.cycle.response_complete):
            # a second request before the answer to the first: while it waited, the end of the
            # connection would not be seen
            self.transport.abort()
            return
        super().data_received(data)
        if self.transport.get_protocol() is self and not self.answers:
            self.await_request()
        else:
            self.forget_deadline()

    @property
    def answers(self) -> bool:
        """Whether a request is in progress."""
        return self.cycle is not None and not self.cycle.response_complete

    def await_request(self) -> None:
        """A request has to be complete soon, whatever arrives meanwhile."""
        if self.deadline is None:
            self.deadline = self.loop.call_later(REQUEST_S, self.transport.abort)

    def forget_deadline(self) -> None:
        """The request is complete, or the connection has ended."""
        if self.deadline is not None:
            self.deadline.cancel()
            self.deadline = None

    def send_400_response(self, msg: str) -> None:
        """What came is no HTTP."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):  # no answer has begun
            self.refuse("no_http", "this is no HTTP/1.1, or its head is too long")
        else:
            self.transport.close()

    def refuse(self, cause: str, sentence: str) -> None:
        """Answers with an error, and closes the connection."""
        wrong = BadRequest(cause, sentence, "GET /api/help shows what there is")
        body = text_of(body_of(wrong)).encode()
        headers = [("content-type", "application/json"), ("connection", "close")]
        head = h11.Response(
            status_code=wrong.status, headers=[*headers, ("content-length", str(len(body)))]
        )
        for event in (head, h11.Data(data=body), h11.EndOfMessage()):
            self.transport.write(self.conn.send(event) or b"")
        self.transport.close()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self.forget_deadline()
        given = {name: value for name, value in self.headers}
        key = given.get(b"sec-websocket-key", b"")
        if (
            event.method != b"GET"
            or event.http_version != b"1.1"
            or given.get(b"sec-websocket-version") != b"13"
            or not re.fullmatch(rb"[A-Za-z0-9+/]{22}==", key)
            or b"host" not in given
        ):
            self.refuse("no_websocket", "this is no beginning of a WebSocket of version 13")
            return
        if self.peer is not None:
            self.crowd.bridge.leave(self.peer)
        super().handle_websocket_upgrade(event)


class WebDoor:
    """The doors of HTTP and WebSocket of a gateway. `made` names the files with new tokens, which
    are to be shown once.
    """

    def __init__(self, gateway: Gateway, settings: Settings):
        self.bridge, self.settings = Bridge(gateway, settings.description), settings
        self.made: dict[Path, str] = {}
        token = settings.token
        if token is None and not is_loopback(settings.host):
            token = Path.home() / ".config" / "moire" / "token"
        if settings.read_token is not None and token is None:
            raise PortError("a token that only reads needs the other one too: give --token FILE")
        self.access = Access(self.kept(token), self.kept(settings.read_token))
        if (settings.certificate is None) != (settings.key is None):
            raise PortError("TLS needs two files: give --certificate FILE and --key FILE")
        kind = type("Connection", (Connection,), {"crowd": Crowd(self.bridge)})
        config = uvicorn.Config(
            application(Doors(self.bridge, self.access)),
            loop="asyncio",
            http=kind,
            ws="wsproto",
            ws_max_size=LONGEST_MESSAGE,
            ws_ping_interval=None,
            ws_ping_timeout=None,
            ws_per_message_deflate=False,
            lifespan="off",
            interface="asgi3",
            log_config=None,
            access_log=False,
            proxy_headers=False,
            server_header=False,
            date_header=False,
            timeout_keep_alive=round(LEASE_S),
            timeout_graceful_shutdown=END_S,
            h11_max_incomplete_event_size=LONGEST_HEAD,
            ssl_certfile=settings.certificate,
            ssl_keyfile=settings.key,
        )
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)
        try:
            config.load()
        except (OSError, ssl.SSLError) as error:
            raise PortError(
                f"TLS does not begin with {settings.certificate} and {settings.key}: "
                f"{error.strerror or error}"
            ) from None
        self.server = uvicorn.Server(config)
        self.listener = self.listen()
        self.thread = threading.Thread(target=self.run, name="moire-web", daemon=True)

    def kept(self, path: Path | None) -> str | None:
        """The token in a file, which is made if there is none."""
        if path is None:
            return None
        token, is_new = kept_token(path)
        if is_new:
            self.made[path] = token
        return token

    def listen(self) -> socket.socket:
        """The socket at which clients connect; raises PortError."""
        host, port = self.settings.host, self.settings.port
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            return socket.create_server((host, port), family=family)
        except (OSError, OverflowError) as error:
            raise PortError(
                f"the HTTP port {port} at {host} does not open: "
                f"{(getattr(error, 'strerror', None) or str(error)).lower()}; choose another, or "
                "0 for any"
            ) from None

    @property
    def url(self) -> str:
        """Where the door is."""
        host, port = self.listener.getsockname()[:2]
        scheme = "https" if self.settings.certificate else "http"
        return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}"

    def open(self) -> None:
        """Serves from now on."""
        sys.setswitchinterval(SWITCH_S)
        self.thread.start()

    def run(self) -> None:
        """Serves until close(), in a thread."""
        asyncio.run(self.serve())

    async def serve(self) -> None:
        """Serves until close()."""
        self.bridge.loop = asyncio.get_running_loop()
        tidying = asyncio.create_task(self.bridge.tidy())
        try:
            await self.server.serve(sockets=[self.listener])
        finally:
            tidying.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await tidying

    def close(self) -> None:
        """Ends all connections. The gateway has ended already, or ends soon."""
        self.bridge.close()
        self.server.should_exit = True
        if self.thread.is_alive():
            self.thread.join()
        self.listener.close()
