# SPDX-License-Identifier: Apache-2.0
"""A client of the WebSocket of a server, for programs that wait.

with StreamClient("http://127.0.0.1:2280", axes="1.0", every="20ms") as client:
    print(client.request("POST", "/api/nodes/1/axes/0/move", {"to": "1.5 mm"}))
    print(client.samples())
"""

import json
import socket
import ssl
from collections import deque
from typing import Any
from urllib.parse import urlencode, urlsplit

from wsproto import ConnectionType, WSConnection
from wsproto.events import (
    AcceptConnection,
    CloseConnection,
    Event,
    Message,
    Ping,
    RejectConnection,
    RejectData,
    Request,
)

from moire.closing import Closing
from moire.errors import MoireError, PortError

RECEIVE = 65536


class ServerRefused(MoireError):
    """The server refused; `cause` is the name of the reason, `status` that of HTTP."""

    def __init__(self, status: int, error: dict[str, Any]):
        super().__init__(f"{error.get('text')}: {error.get('to_do')}")
        self.status, self.cause, self.error = status, error.get("cause"), error


class StreamClient(Closing):
    """One WebSocket. `fields` are those of a stream: axes, every, only; and token."""

    def __init__(self, url: str, timeout_s: float | None = None, **fields: str):
        parts = urlsplit(url)
        host, port = parts.hostname or "127.0.0.1", parts.port or 80
        self.numbers = 0
        self.held: deque[dict[str, Any]] = deque()  # samples that came before an answer
        self.answers: dict[Any, dict[str, Any]] = {}  # that came before they were asked for
        self.arrived: deque[dict[str, Any]] = deque()
        self.text = ""  # of a message that is not complete
        try:
            self.socket = socket.create_connection((host, port), timeout_s)
        except OSError as error:
            raise PortError(f"nobody listens at {url}: {error.strerror}") from None
        if parts.scheme == "https":
            self.socket = ssl.create_default_context().wrap_socket(
                self.socket, server_hostname=host
            )
        self.connection = WSConnection(ConnectionType.CLIENT)
        target = f"/api/stream?{urlencode(fields)}"
        self.refusal: tuple[int, bytes] | None = None
        self.accepted = False
        self.put(Request(host=f"{host}:{port}", target=target))
        while not self.accepted:
            self.take()

    def put(self, event: Event) -> None:
        """Sends an event."""
        try:
            self.socket.sendall(self.connection.send(event))
        except OSError as error:
            raise PortError(f"the server has gone: {error.strerror}") from None

    def take(self) -> None:
        """Receives what has come; raises PortError when the server has gone."""
        try:
            data = self.socket.recv(RECEIVE)
        except OSError as error:
            raise PortError(f"nothing came from the server: {error.strerror or error}") from None
        if not data:
            raise PortError("the server has ended the connection")
        self.connection.receive_data(data)
        for event in self.connection.events():
            if isinstance(event, AcceptConnection):
                self.accepted = True
            elif isinstance(event, RejectConnection):
                self.refusal = event.status_code, b""
            elif isinstance(event, RejectData) and self.refusal is not None:
                status, body = self.refusal[0], self.refusal[1] + bytes(event.data)
                self.refusal = status, body
                if event.body_finished:
                    raise ServerRefused(status, json.loads(body)["error"])
            elif isinstance(event, Message):
                self.text += str(event.data)
                if event.message_finished:
                    self.arrived.append(json.loads(self.text))
                    self.text = ""
            elif isinstance(event, Ping):
                self.put(event.response())
            elif isinstance(event, CloseConnection):
                raise PortError(f"the server has ended the connection: {event.reason or 'closed'}")

    def send(self, message: dict[str, Any]) -> None:
        """Sends a message."""
        self.put(Message(data=json.dumps(message)))

    def receive(self) -> dict[str, Any]:
        """The next message."""
        while not self.arrived:
            self.take()
        return self.arrived.popleft()

    def begin(self, method: str, path: str, body: dict[str, Any] | None = None) -> int:
        """Sends a request, and returns its number."""
        self.numbers += 1
        self.send({"id": self.numbers, "method": method, "path": path, "body": body})
        return self.numbers

    def answer_to(self, number: int) -> dict[str, Any]:
        """The answer to a request; raises ServerRefused. What comes before it is kept: samples, and
        answers to other requests.
        """
        while number not in self.answers:
            message = self.receive()
            if "samples" in message:
                self.held.append(message)
            else:
                self.answers[message["id"]] = message
        message = self.answers.pop(number)
        if "error" in message:
            raise ServerRefused(message["status"], message["error"])
        answer: dict[str, Any] = message["answer"]
        return answer

    def request(self, method: str, path: str, body: dict[str, Any] | None = None) -> dict[str, Any]:
        """The answer to a request; raises ServerRefused."""
        return self.answer_to(self.begin(method, path, body))

    def samples(self) -> dict[str, Any]:
        """The next samples of the stream, with the number of those that were lost."""
        while True:
            message = self.held.popleft() if self.held else self.receive()
            if "samples" in message:
                return message

    def close(self) -> None:
        """Ends the connection."""
        self.socket.close()
