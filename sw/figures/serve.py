# SPDX-License-Identifier: Apache-2.0
"""Figures of the doors of a served bus: many clients at once, how fast HTTP and WebSocket read,
what becomes of bad input, and how long a command takes beside a server.
"""

import http.client
import json
import random
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from typing import Any
from urllib.parse import urlsplit

import hypothesis
from hypothesis import strategies
from hypothesis.configuration import set_hypothesis_home_dir
from wsproto.events import BytesMessage, TextMessage

from figures.common import Figure, Quick, console
from moire.bus.transport import open_bus
from moire.client.bus import Bus
from moire.errors import MoireError, PortError
from moire.made.bus_tables import PARAMETERS
from moire.web.api import OPERATIONS, find
from moire.web.client import StreamClient
from moire.web.operation import Operation, checked
from twin.build import ROOT

AXIS = "/api/nodes/1/axes/0"
REQUESTS, CLIENTS = 10_000, 50
KINDS = ("HTTP", "WebSocket", "TCP", "RFC 2217")
PATIENCE_S = 120  # of the clock: a slow twin is not a dead one
READ_S = START_S = 3.0
STREAMS = 20
BAD = 100_000
PROCESSES = 4  # of each kind, in so many processes: the answers take longer than the questions
EXAMPLES = 2000  # of one run of Hypothesis, which remembers all of them
LOOK = 200  # bad messages between two looks at the drive
CALLS = 11  # of the command line
HANG_S = 20


class NotMeasured(MoireError):
    """What the figure needs is missing."""


@contextmanager
def served(*more: str) -> Iterator[dict[str, Any]]:
    """The ports of a twin of one node, served by a program of its own."""
    words = "twin --nodes 1 --http 0 --rfc2217 0 --tcp 0 --json".split()
    command = [sys.executable, "-m", "moire", *words, *more]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as twin:
        assert twin.stdout is not None
        answer = twin.stdout.readline()
        if not answer.startswith('{"command": "twin"'):
            raise NotMeasured(f"the twin is not served: {answer.strip()}")
        try:
            yield json.loads(answer)
        finally:
            twin.terminate()


class Http:
    """A connection of HTTP that is kept open."""

    def __init__(self, url: str):
        self.connection = http.client.HTTPConnection(urlsplit(url).netloc, timeout=PATIENCE_S)

    def request(self, method: str, path: str, body: Any = None) -> dict[str, Any]:
        """The answer; raises NotMeasured when it is an error."""
        text = None if body is None else json.dumps(body)
        self.connection.request(method, path, text)
        response = self.connection.getresponse()
        values: dict[str, Any] = json.loads(response.read())
        if response.status != 200:
            raise NotMeasured(f"{method} {path}: {values['error']['text']}")
        return values

    def close(self) -> None:
        """Ends the connection."""
        self.connection.close()


# ------------------------------------------------------------------ many clients at once


@dataclass
class Asker:
    """One client: `read` returns the exact value of a parameter, `look` the position in nm, and
    `surplus` counts what has come beside the answers.
    """

    read: Callable[[str], str]
    look: Callable[[], float]
    surplus: Callable[[], int]
    close: Callable[[], None]
    wrong: int = field(default=0)


def asker(kind: str, ports: dict[str, Any]) -> Asker:
    """A client of a kind."""
    if kind in ("TCP", "RFC 2217"):
        url = ports["tcp" if kind == "TCP" else "rfc2217"]
        port = open_bus(url, parity="none")
        axis = Bus(port, answer_s=PATIENCE_S, tries=1).axis()
        return Asker(
            lambda name: axis.get_parameter(name).written(),
            lambda: axis.status().position_nm,
            lambda: int(port.port.in_waiting),  # type: ignore[attr-defined]
            port.close,
        )
    client: Http | StreamClient = (
        Http(ports["http"]) if kind == "HTTP" else StreamClient(ports["http"], PATIENCE_S)
    )
    return Asker(
        lambda name: str(client.request("GET", f"{AXIS}/parameters/{name}")["written"]),
        lambda: float(client.request("GET", AXIS)["position_nm"]),
        lambda: len(client.arrived) if isinstance(client, StreamClient) else 0,
        client.close,
    )


def ask_often(client: Asker, count: int, known: dict[str, str], seed: int) -> int:
    """How many of so many requests are answered wrongly or not at all."""
    source, wrong = random.Random(seed), 0
    for _ in range(count):
        name = source.choice(list(known))
        try:
            if source.random() < 0.5:
                wrong += client.read(name) != known[name]
            else:
                wrong += not -1e3 < client.look() < 1.001e6
        except (MoireError, OSError, http.client.HTTPException, ValueError) as error:
            console.print(f"no answer: {type(error).__name__}: {error}")
            wrong += 1
    return wrong + client.surplus()


def to_and_fro(url: str, ending: threading.Event) -> int:
    """Moves the axis until the end; returns the number of moves."""
    client, moves = Http(url), 0
    while not ending.is_set():
        client.request("POST", f"{AXIS}/move", {"to": "1 mm" if moves % 2 == 0 else "0 mm"})
        moves += 1
    client.close()
    return moves


def clients_lost(requests: int = REQUESTS, clients: int = CLIENTS, seed: int = 1) -> int:
    with served() as ports, ExitStack() as stack, ThreadPoolExecutor(clients + 1) as pool:
        first = Http(ports["http"])
        first.request("POST", f"{AXIS}/home", {"method": "37"})
        known = {
            name: str(first.request("GET", f"{AXIS}/parameters/{name}")["written"])
            for name in PARAMETERS
            if name != "home_method"
        }
        first.close()
        askers = [asker(KINDS[number % len(KINDS)], ports) for number in range(clients)]
        for one in askers:
            stack.callback(one.close)
        ending = threading.Event()
        moving = pool.submit(to_and_fro, ports["http"], ending)
        began = time.monotonic()
        shares = [requests // clients + (n < requests % clients) for n in range(clients)]
        asked = [
            pool.submit(ask_often, one, share, known, seed + number)
            for number, (one, share) in enumerate(zip(askers, shares))
        ]
        wrong = sum(one.result() for one in asked)
        took = time.monotonic() - began
        ending.set()
        moves = moving.result()
    console.print(f"{requests} requests in {took:.0f} s, while the axis made {moves} moves")
    return wrong


# ------------------------------------------------------------------ how fast


def serve_reads_per_s(seconds: float = READ_S, start_s: float = START_S) -> float:
    with served() as ports:
        client = Http(ports["http"])
        reads(client, start_s)
        count, fresh = reads(client, seconds)
        speed = client.request("GET", "/api")["speed"]
        client.close()
    console.print(f"{fresh / seconds:.0f} of them new a second; the twin ran at {speed:.2f}")
    return count / seconds


def reads(client: Http, seconds: float) -> tuple[int, int]:
    """(positions read in this time, how many of them are different samples)"""
    count, times, end = 0, set(), time.perf_counter() + seconds
    while time.perf_counter() < end:
        times.add(client.request("GET", f"{AXIS}/position")["time_s"])
        count += 1
    return count, len(times)


def serve_stream_per_s(
    streams: int = STREAMS, seconds: float = READ_S, start_s: float = START_S
) -> float:
    with served() as ports, ExitStack() as stack, ThreadPoolExecutor(streams) as pool:
        clients = [
            stack.enter_context(
                StreamClient(ports["http"], PATIENCE_S, axes="1.0", only="position")
            )
            for _ in range(streams)
        ]
        began = time.perf_counter()
        work = partial(positions, begin=began + start_s, end=began + start_s + seconds)
        counts = list(pool.map(work, clients))
        answer = clients[0].request("GET", "/api")
    console.print(
        f"{min(counts) / seconds:.0f} to {max(counts) / seconds:.0f} a second for each of "
        f"{streams}; the twin ran at {answer['speed']:.2f}"
    )
    return sum(counts) / seconds


def positions(client: StreamClient, begin: float, end: float) -> int:
    """How many positions come between two times of the clock; each must be a new one."""
    count, newest = 0, -1.0
    while (now := time.perf_counter()) < end:
        for row in client.samples()["samples"]:
            if row["time_s"] <= newest:
                raise NotMeasured("a stream has the same sample twice")
            newest = row["time_s"]
            count += now >= begin
    return count


def status_s(calls: int = CALLS) -> float:
    with served() as ports:
        command = [sys.executable, "-m", "moire", "--port", ports["tcp"], "--patience", "60s"]
        took = []
        for _ in range(calls):
            began = time.perf_counter()
            subprocess.run([*command, "status"], check=True, capture_output=True)
            took.append(time.perf_counter() - began)
    console.print(f"{min(took):.2f} to {max(took):.2f} s")
    return statistics.median(took)


# ------------------------------------------------------------------ bad input

NAMES = strategies.sampled_from(
    sorted(
        {one.name for operation in OPERATIONS for one in operation.given}
        | {"id", "method", "path", "body", "stream", "axes", "every", "only"}
    )
)
ANYTHING = strategies.recursive(
    strategies.none()
    | strategies.booleans()
    | strategies.integers()
    | strategies.floats()
    | strategies.text(max_size=20)
    | strategies.sampled_from(("1.5", "1 mm", "-1nm", "1e99 m", "20 ms", "5mm/s", "1.0")),
    lambda inside: (
        strategies.lists(inside, max_size=4)
        | strategies.dictionaries(NAMES | strategies.text(max_size=9), inside, max_size=4)
    ),
    max_leaves=8,
)
PARTS = strategies.sampled_from(
    [
        *(b"GET", b"POST", b"PUT", b"HEAD", b" ", b"  ", b"/", b"/api", AXIS.encode(), b"/stream"),
        *(b" HTTP/1.1", b" HTTP/1.0", b" HTTP/2", b"\r\n", b"\n", b"\r\n\r\n", b"Host: 127.0.0.1"),
        *(b"Content-Length: ", b"Transfer-Encoding: chunked", b"Upgrade: websocket", b"0", b"7"),
        *(b"Connection: upgrade", b"Connection: close", b"Sec-WebSocket-Version: 13", b"ffff"),
        *(b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", b"Expect: 100-continue", b": ", b"?"),
        *(b"{", b"}", b"[", b'"', b"\x00", b"\xff", b"%00", b"%zz", b"..", b"Origin: null"),
    ]
)
RAW = strategies.lists(PARTS | strategies.binary(max_size=8), min_size=1, max_size=16).map(b"".join)
QUERIES = strategies.dictionaries(NAMES | strategies.text(max_size=9), strategies.text(max_size=9))
PARTS_OF_PATHS = ("1", "0", "2", "-1", "x", "99999", "velocity", "%00")
PATHS = strategies.sampled_from(
    sorted(
        {
            operation.path.format(node=node, axis=axis, name=name)
            for operation in OPERATIONS
            for node in PARTS_OF_PATHS
            for axis in PARTS_OF_PATHS
            for name in PARTS_OF_PATHS
        }
    )
)
FRAMES = strategies.binary(min_size=1, max_size=40)


@dataclass
class Target:
    """A served twin that gets bad input. `failed` has what is wrong with each answer."""

    url: str
    failed: list[str] = field(default_factory=list)
    sent: int = 0
    kept: http.client.HTTPConnection | None = None
    stream: StreamClient | None = None

    @property
    def place(self) -> tuple[str, int]:
        """Host and port."""
        parts = urlsplit(self.url)
        return str(parts.hostname), int(parts.port or 80)

    def note(self, what: str, sent: object) -> None:
        """Something is wrong."""
        self.failed.append(what)
        console.print(f"{what}: {sent!r:.300}")

    def count(self) -> None:
        """One more message; looks at the drive from time to time."""
        self.sent += 1
        if self.sent % LOOK == 0:
            self.look()

    def look(self) -> None:
        """The server lives, and nothing has moved or been switched on."""
        try:
            state = Http(self.url).request("GET", f"{AXIS}?max_age=0s")["state"]
            if state != "off":
                self.note(f"the drive is {state}", "")
        except (MoireError, OSError, http.client.HTTPException, ValueError) as error:
            raise NotMeasured(f"the server is dead after {self.sent} messages: {error}") from None

    def judge(self, status: int, body: bytes, sent: object) -> None:
        """An answer is done, or an error with its cause; never a defect of the server."""
        try:
            values = json.loads(body)
            error = values.get("error", {})
            named = all(error.get(name) for name in ("cause", "text", "to_do"))
        except (ValueError, AttributeError):
            values, error, named = {}, {}, False
        if status != 200 and not named:
            self.note(f"{status} without a cause", sent)
        elif error.get("cause") == "internal":
            self.note("a defect", sent)

    def close(self) -> None:
        """Ends the connections that are kept, which other processes cannot take over."""
        if self.kept is not None:
            self.kept.close()
        if self.stream is not None:
            self.stream.close()
        self.kept = self.stream = None

    # four kinds of input

    def raw(self, data: bytes) -> None:
        """Bytes that are hardly HTTP, on a connection of their own, which is then closed."""
        self.count()
        with socket.create_connection(self.place, HANG_S) as connection:
            received = b""
            try:
                connection.sendall(data)
                connection.shutdown(socket.SHUT_WR)
                while more := connection.recv(65536):
                    received += more
            except ConnectionError:
                return
            except TimeoutError:
                self.note("a connection hangs", data)
                return
        head, _, body = received.partition(b"\r\n\r\n")
        words = head.split(maxsplit=2)
        if received and words[1] not in (b"200", b"101", b"100") and not data.startswith(b"HEAD"):
            self.judge(int(words[1]), body, data)

    def asked(self, request: tuple[str, str, dict[str, str], Any]) -> None:
        """HTTP as it should be, with fields that may be anything. A connection that the server has
        closed because it was idle is opened again.
        """
        method, path, query, body = request
        self.count()
        is_new = self.kept is None
        if self.kept is None:
            self.kept = http.client.HTTPConnection(*self.place, timeout=HANG_S)
        target = path + ("?" + "&".join(f"{k}={v}" for k, v in query.items()) if query else "")
        target = "".join(c if "!" <= c <= "~" and c != "#" else "%3f" for c in target)
        try:
            self.kept.request(method, target, json.dumps(body))
            response = self.kept.getresponse()
            self.judge(response.status, response.read(), (method, target, body))
        except TimeoutError:
            self.note("an answer does not come", (method, target, body))
        except (OSError, http.client.HTTPException) as error:
            if is_new:
                self.note(f"the connection ends: {error}", (method, target, body))
                self.look()
        else:
            return
        self.kept.close()
        self.kept = None
        if not is_new:
            self.asked(request)

    def message(self, message: Any) -> None:
        """A message of a WebSocket: any text, bytes or JSON. Each has one answer."""
        self.count()
        if self.stream is None:
            self.stream = StreamClient(self.url, HANG_S)
        data = message if isinstance(message, str | bytes) else json.dumps(message)
        event = BytesMessage(data=data) if isinstance(data, bytes) else TextMessage(data=data)
        try:
            self.stream.put(event)
            answer = self.stream.receive()
            while "samples" in answer:
                answer = self.stream.receive()
            self.judge(answer["status"], json.dumps(answer).encode(), data)
        except PortError as error:
            self.note(f"a WebSocket ends: {error}", data)
            self.stream = None

    def frames(self, data: bytes) -> None:
        """Bytes that are hardly frames, on a WebSocket of their own."""
        self.count()
        with StreamClient(self.url, HANG_S) as client:
            client.socket.sendall(data)
            client.socket.shutdown(socket.SHUT_WR)
            try:
                while client.socket.recv(65536):
                    pass
            except ConnectionError:
                pass
            except TimeoutError:
                self.note("a WebSocket hangs", data)


def is_valid(operation: Operation, values: Any) -> bool:
    """Whether an operation would take these values."""
    try:
        return isinstance(values, dict) and checked(operation.given, values) is not None
    except MoireError:
        return False


def is_wrong(method: str, path: str, query: Any, body: Any) -> bool:
    """Whether a request must be refused: it names what is not there, or its fields are wrong."""
    found, _ = find(method, path)
    if found is None:
        return True
    operation, names = found
    if any(names.get(name, there) != there for name, there in THERE.items()):
        return True
    values = body if operation.changes else query
    return not is_valid(operation, {} if values in ("", None) else values)


def is_wrong_message(message: Any) -> bool:
    """The same for a message of a WebSocket."""
    if not isinstance(message, dict) or "stream" in message:
        return True
    method, path, body = (message.get(name) for name in ("method", "path", "body"))
    if not isinstance(method, str) or not isinstance(path, str):
        return True
    return is_wrong(method, path, body, body)


METHODS = strategies.sampled_from(("GET", "POST", "PUT", "PATCH", "DELETE"))
THERE = {"node": "1", "axis": "0", "name": "velocity"}  # of the twin
TOGETHER = 10  # requests with one query and one body, which take longest to make
REQUEST_GROUPS = strategies.tuples(
    strategies.lists(strategies.tuples(METHODS, PATHS), min_size=TOGETHER, max_size=TOGETHER),
    QUERIES,
    ANYTHING,
).map(lambda made: [(*one, *made[1:]) for one in made[0] if is_wrong(*one, *made[1:])])
MESSAGE = (
    strategies.fixed_dictionaries(
        {"method": METHODS | ANYTHING, "path": PATHS | ANYTHING},
        optional={"id": ANYTHING, "body": ANYTHING, "stream": ANYTHING},
    )
    | ANYTHING
    | strategies.text(max_size=30)
    | strategies.binary(max_size=30)
)


def alone(one: Any) -> list[Any]:
    """A message that goes with no others."""
    return [one]


# share of all, and lists of what it is
INPUT: dict[str, tuple[float, strategies.SearchStrategy[list[Any]]]] = {
    "asked": (0.4, REQUEST_GROUPS),
    "message": (0.4, MESSAGE.filter(is_wrong_message).map(alone)),
    "raw": (0.15, RAW.map(alone)),
    "frames": (0.05, FRAMES.map(alone)),
}


def send_all(
    take: Callable[[Any], None], bad: strategies.SearchStrategy[list[Any]], count: int, seed: int
) -> None:
    """Passes so many inputs of a kind on."""
    set_hypothesis_home_dir(ROOT / "build" / "hypothesis")
    sent = 0

    def send(several: list[Any]) -> None:
        nonlocal sent
        for one in several[: count - sent]:
            take(one)
            sent += 1

    while sent < count:  # an example may have several inputs, or none
        hypothesis.seed(seed + sent)(limited(count - sent)(hypothesis.given(several=bad)(send)))()


def limited(examples: int) -> hypothesis.settings:
    """Makes at most so many examples, and only makes them."""
    return hypothesis.settings(
        max_examples=min(examples, EXAMPLES),
        database=None,
        deadline=None,
        phases=[hypothesis.Phase.generate],
        suppress_health_check=list(hypothesis.HealthCheck),
    )


def of_one_kind(url: str, name: str, count: int, seed: int) -> Target:
    """So many messages of one kind to the server at a URL."""
    target = Target(url)
    send_all(getattr(target, name), INPUT[name][1], count, seed)
    target.look()
    target.close()
    return target


def serve_bad_input(messages: int = BAD, seed: int = 1) -> int:
    parts = [
        (name, round(messages * share / PROCESSES), seed + part)
        for part in range(PROCESSES)
        for name, (share, _) in INPUT.items()
    ]
    with served() as ports, ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        jobs = [pool.submit(of_one_kind, ports["http"], *part) for part in parts]
        done = [job.result() for job in jobs]
    sent, failed = sum(one.sent for one in done), sum(len(one.failed) for one in done)
    console.print(f"{sent} messages; {failed} with a wrong effect")
    return failed


FIGURES = {
    "clients_lost": Figure(
        clients_lost,
        "requests",
        f"of {REQUESTS} requests by {CLIENTS} clients of a served twin at once "
        f"({', '.join(KINDS)}), while its axis moves to and fro: answered wrongly, twice or not at "
        "all",
        "0",
        Quick({"requests": 120, "clients": 8}, "120 requests by 8 clients"),
        0,
    ),
    "serve_reads_per_s": Figure(
        serve_reads_per_s,
        "1/s",
        "positions read per second over HTTP by one client that keeps its connection, from a "
        "served twin of one node with its drive off; each at most 10 ms old, of the time of the "
        "machine",
        ">= 500",
        Quick({"seconds": 0.5, "start_s": 0.2}, "half a second, on a busy computer", ""),
        0,
    ),
    "serve_stream_per_s": Figure(
        serve_stream_per_s,
        "1/s",
        f"positions per second that {STREAMS} clients of WebSockets receive together from a served "
        "twin of one node with its drive off, each a new one for its client; the bus carries about "
        "110 a second",
        ">= 1000",
        Quick({"streams": 4, "seconds": 0.5, "start_s": 0.2}, "4 clients, half a second", ""),
        0,
    ),
    "serve_bad_input": Figure(
        serve_bad_input,
        "messages",
        f"of {BAD} malformed or wrong messages of HTTP, WebSocket and JSON, made by Hypothesis, to "
        "a served twin: crash, hang, defect, drive switched on, or an error without a cause",
        "0",
        Quick({"messages": 100}, "100 messages"),
        0,
    ),
    "status_s": Figure(
        status_s,
        "s",
        f"time of `moire status` from the shell beside a served twin, median of {CALLS} calls",
        "<= 0.3",
        Quick({"calls": 1}, "one call, on a busy computer", ""),
        2,
    ),
}
