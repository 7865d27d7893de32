# SPDX-License-Identifier: Apache-2.0
"""Figures of the server of a bus: what becomes of an axis whose client ends while it moves it."""

import http.client
import json
import random
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from figures.common import Figure, Quick, bar, console
from moire.bus.gateway import Gateway
from moire.bus.transport import BAUD, Transport, open_bus
from moire.bus.twin_port import open_twin
from moire.client.axis import Axis
from moire.client.bus import Bus
from moire.client.records import Status
from moire.web.client import StreamClient
from moire.web.door import Settings, WebDoor
from tools import obey_signals

SIGNALS = ("SIGTERM", "SIGHUP", "SIGINT", "SIGKILL")
WAYS = (*SIGNALS, "closed pipe", "closed socket", "closed HTTP", "closed WebSocket")
MOVE = "/api/nodes/1/axes/0/move"
CLIENTS = 200
ENDS_MM = (0, 100)  # the target is the one that is farther away
MOVES_MM_S = 1  # from this speed on the axis is in mid-motion
LATE_S = 0.1  # of the time of the machine: the stop has to begin within it
OFF_S = 2.0  # of the same: the drive has to be off
PATIENCE_S = 60  # of the clock: a slow twin is not a dead one
HERE = "37"  # homing method: the zero is where the axis is


@dataclass
class Server:
    """A twin of one node behind a Gateway and a WebDoor, each in a thread of its own."""

    transport: Transport
    gateway: Gateway = field(init=False)
    door: WebDoor = field(init=False)
    port: str = field(init=False)
    ending: bool = False

    def __post_init__(self) -> None:
        self.gateway = Gateway(self.transport)
        self.port = f"socket://127.0.0.1:{self.gateway.open_tcp('127.0.0.1', 0)}"
        self.door = WebDoor(self.gateway, Settings())
        self.door.open()

    def run(self) -> None:
        while not self.ending:
            self.gateway.poll(self.gateway.follow_clock())
        self.gateway.close()
        self.door.close()


@contextmanager
def served() -> Iterator[Server]:
    server = Server(open_twin(BAUD, nodes=(1,)))
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        yield server
    finally:
        server.ending = True
        thread.join()


@contextmanager
def client(server: Server, way: str, target_mm: int) -> Iterator[Callable[[], None]]:
    """A client that moves the axis; what it yields ends the client in this way."""
    if way == "closed socket":
        with open_bus(server.port) as port:
            axis = Bus(port, answer_s=PATIENCE_S).axis()
            axis.enable()
            axis.begin_move(mm=target_mm)
            yield port.close
        return
    body = {"to": f"{target_mm} mm"}
    if way == "closed HTTP":
        connection = http.client.HTTPConnection(urlsplit(server.door.url).netloc)
        connection.request("POST", MOVE, json.dumps(body))
        yield connection.close
        return
    if way == "closed WebSocket":
        with StreamClient(server.door.url, PATIENCE_S, axes="1.0") as stream:
            stream.begin("POST", MOVE, body)
            yield stream.close
        return
    move = ["move", f"{target_mm}mm"]
    if way == "closed pipe":
        move += ["--no-wait", "--", "watch", "--every", "20ms"]
    common = [sys.executable, "-m", "moire", "--port", server.port, "--patience", f"{PATIENCE_S}s"]
    with subprocess.Popen(
        [*common, *move],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        preexec_fn=obey_signals,
    ) as process:
        assert process.stdout is not None
        try:
            if way == "closed pipe":
                yield process.stdout.close
            else:
                number = getattr(signal, way)
                yield lambda: process.send_signal(number)
        finally:
            process.kill()


def until(
    axis: Axis, true: Callable[[Status], bool], now: Callable[[], float], end: float
) -> Status:
    """The first status of which this is true, or the first one after the end."""
    while True:
        status = axis.status()
        if true(status) or now() > end:
            return status


def ended_unsafely(
    server: Server, axis: Axis, way: str, target_mm: int, late_s: float, source: random.Random
) -> tuple[str, float]:
    """(what is wrong, empty if nothing is; time from the end of the client to that of the motion at
    full speed, s)
    """
    now = server.transport.now
    with client(server, way, target_mm) as end:
        until(axis, lambda status: abs(status.velocity_mm_s) > MOVES_MM_S, now, now() + PATIENCE_S)
        until(axis, lambda status: False, now, now() + source.uniform(0, 0.5))
        end()
        gone = now()
        until(axis, lambda status: status.state != "moving", now, gone + OFF_S)
        took = now() - gone
        status = until(axis, lambda status: status.state == "off", now, gone + OFF_S)
    if status.faults:
        return f"fault: {status.fault_words}", took
    if status.state != "off":
        return f"the drive is still on: {status.words}", took
    if status.ended != "stopped":
        return f"the motion ended otherwise: {status.ended_words}", took
    return ("" if took <= late_s else "the stop began late"), took


def clients_killed_unsafe(clients: int = CLIENTS, late_s: float = LATE_S, seed: int = 1) -> int:
    source, failed, longest = random.Random(seed), 0, 0.0
    with served() as server, open_bus(server.port) as port, bar("clients") as progress:
        axis = Bus(port, answer_s=PATIENCE_S).axis()
        with axis:
            axis.enable()
            axis.home(method=HERE)
        for number in progress.track(range(clients)):
            way = WAYS[number % len(WAYS)]
            position_mm = axis.status().position_nm / 1e6
            target_mm = ENDS_MM[position_mm < sum(ENDS_MM) / 2]
            wrong, took = ended_unsafely(server, axis, way, target_mm, late_s, source)
            longest = max(longest, took)
            if wrong:
                failed += 1
                console.print(f"client {number}, {way}: {wrong}, after {1000 * took:.0f} ms")
                axis.reset()
    console.print(
        f"{clients} clients ended by {', '.join(WAYS)}; the stop began after at most "
        f"{1000 * longest:.0f} ms of the machine's time"
    )
    return failed


FIGURES = {
    "clients_killed_unsafe": Figure(
        clients_killed_unsafe,
        "clients",
        f"of {CLIENTS} clients of a served twin, ended in mid-motion by {', '.join(WAYS)}: stop "
        f"under control not begun within {1000 * LATE_S:.0f} ms, drive not off afterwards, or a "
        "fault left",
        "0",
        Quick(
            {"clients": len(WAYS), "late_s": OFF_S},
            f"one client for each way, {OFF_S:g} s to begin the stop",
        ),
        0,
    ),
}
