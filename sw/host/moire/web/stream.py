# SPDX-License-Identifier: Apache-2.0
"""One WebSocket: samples of axes at an asked rate, and any request of api.py.

The client sends objects of JSON:
    {"stream": {"axes": "1.0,2.0", "every": "20ms"}}     samples from now on; no axes: none
    {"id": 7, "method": "POST", "path": "/api/nodes/1/axes/0/move", "body": {"to": "1.5 mm"}}
The query of the address may have the fields of `stream`, too. The server sends:
    {"samples": [{"address": 1, "axis": 0, "time_s": …, "position_nm": …, …}], "lost": 0}
    {"id": 7, "status": 200, "answer": {…}}

A client that takes its samples too slowly loses some; `lost` counts them. Nobody else waits for it.
"""

import asyncio
import contextlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from moire.bus.arbiter import Place
from moire.errors import MoireError, PortError
from moire.web.access import Meter, too_many
from moire.web.answers import (
    Answer,
    Doors,
    internal,
    operation_for,
    perform,
    refusal,
    text_of,
    values_of,
)
from moire.web.bridge import Client
from moire.web.handlers import status_values
from moire.web.operation import Given, checked, whole_number
from moire.web.refusals import BadRequest

NORMAL_ENDS = (asyncio.CancelledError, WebSocketDisconnect, PortError)
WAITING_SAMPLES = 32  # that may wait until a client takes them
MOST_ANSWERS = 256  # that may wait; a client that takes none is sent away
MOST_AXES = 32
WISHES = (
    Given("axes", "text", "the axes as node.axis, with commas between them", "1.0,2.0"),
    Given("every", "time", "time from sample to sample, of the bus; as often as it can be", "20ms"),
    Given("only", "text", "'position' for the shortest samples", "position"),
)
TOKEN = Given("token", "text", "the token, where the server needs one", "")


@dataclass(frozen=True)
class Wish:
    """What a client wants to see."""

    places: tuple[Place, ...] = ()
    every_s: float = 0.0  # time of the bus
    position_only: bool = False


def wish_of(values: Mapping[str, Any]) -> Wish:
    """The wish in a query or a message; raises BadRequest or UnitError."""
    given = checked((*WISHES, TOKEN), values)
    axes = [text for text in given.get("axes", "").split(",") if text.strip()]
    if len(axes) > MOST_AXES:
        raise too_many(f"a stream has at most {MOST_AXES} axes")
    if given.get("only", "position") != "position":
        raise BadRequest(
            "wrong_type", f"'{given['only'][:20]}' cannot be streamed", "write only=position"
        )
    return Wish(
        tuple(dict.fromkeys(place_in(text.strip()) for text in axes)),
        float(given.get("every", 0.0)),
        "only" in given,
    )


def place_in(text: str) -> Place:
    """Node and axis from "1.0"."""
    node, dot, axis = text.partition(".")
    if not dot:
        raise BadRequest("wrong_type", f"'{text[:20]}' is no axis", "write node.axis, such as 1.0")
    return whole_number(node, "a node"), whole_number(axis, "an axis")


class Session:
    """One WebSocket that is open."""

    def __init__(
        self, socket: WebSocket, doors: Doors, client: Client, wish: Wish, token: str | None
    ):
        self.socket, self.doors, self.client, self.token = socket, doors, client, token
        self.wish, self.changed = wish, asyncio.Event()
        self.answers: asyncio.Queue[str] = asyncio.Queue()
        self.samples: asyncio.Queue[tuple[list[dict[str, Any]], int]] = asyncio.Queue()
        self.ready = asyncio.Event()  # there is something to send
        self.lost, self.meter = 0, Meter()
        self.tasks: set[asyncio.Task[None]] = set()  # requests in progress

    async def serve(self) -> None:
        """Serves the client until it has gone."""
        tasks = {asyncio.create_task(work()) for work in (self.read, self.sample, self.write)}
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self.doors.bridge.leave(self.client)
            tasks |= self.tasks
            for task in tasks:
                task.cancel()
            for ended in await asyncio.gather(*tasks, return_exceptions=True):
                if not isinstance(ended, BaseException) or isinstance(ended, NORMAL_ENDS):
                    continue
                internal(ended)
            with contextlib.suppress(RuntimeError):  # it is closed already
                await self.socket.close()

    # from the client

    async def read(self) -> None:
        """Takes the messages of the client until it has gone. No message waits for the work of
        another one, so that the end of the connection is seen at once.
        """
        while self.answers.qsize() < MOST_ANSWERS:
            message = await self.socket.receive()
            if message["type"] == "websocket.disconnect":
                break
            self.take(message.get("text") or message.get("bytes") or "")

    def take(self, text: str | bytes) -> None:
        """One message."""
        number: Any = None
        try:
            values = values_of(text)
            number = values.get("id")
            if "stream" in values:
                wish = values["stream"]
                if not isinstance(wish, dict):
                    raise BadRequest("wrong_type", "'stream' is no object", "write its fields")
                self.wish = wish_of(wish)
                self.changed.set()
                self.answer(number, ({"stream": len(self.wish.places)}, HTTPStatus.OK))
                return
            method, path, body = (values.get(name) for name in ("method", "path", "body"))
            if not isinstance(method, str) or not isinstance(path, str):
                raise BadRequest(
                    "missing_field",
                    "a message has 'stream', or 'method' and 'path'",
                    '{"id": 1, "method": "POST", "path": "/api/nodes/1/axes/0/stop"}',
                )
            if body is not None and not isinstance(body, dict):
                raise BadRequest("wrong_type", "'body' is no object", "write its fields")
            operation, names = operation_for(self.doors.bridge, method, path)
            may_change = self.doors.access.check(self.socket.headers, self.token, operation.changes)
            if not operation.urgent:
                self.meter.count()
        except MoireError as error:
            self.answer(number, refusal(error))
            return

        async def work() -> None:
            try:
                done = await perform(
                    self.doors.bridge, self.client, operation, names, body or {}, may_change
                )
                self.answer(number, (done, HTTPStatus.OK))
            except MoireError as error:
                self.answer(number, refusal(error))
            except Exception as error:
                self.answer(number, internal(error))

        task = asyncio.create_task(work())
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)

    def answer(self, number: Any, answer: Answer) -> None:
        """Sends an answer as soon as the client takes it."""
        content, status = answer
        known = number if isinstance(number, int | str | None) else None
        key = "error" if "error" in content else "answer"
        values = content["error"] if key == "error" else content
        self.answers.put_nowait(text_of({"id": known, "status": int(status), key: values}))
        self.ready.set()

    # to the client

    async def write(self) -> None:
        """Sends answers, and between them the samples that wait."""
        while True:
            await self.ready.wait()
            self.ready.clear()
            while not (self.answers.empty() and self.samples.empty()):
                if not self.answers.empty():
                    await self.socket.send_text(self.answers.get_nowait())
                else:
                    samples, lost = self.samples.get_nowait()
                    await self.socket.send_text(text_of({"samples": samples, "lost": lost}))

    async def sample(self) -> None:
        """Gets the samples, whether the client takes them or not."""
        gateway, due = self.doors.bridge.gateway, 0.0
        newest: dict[Place, float] = {}
        while True:
            wish = self.wish
            if not wish.places:
                self.changed.clear()
                await self.changed.wait()
                continue
            due = max(due + wish.every_s, gateway.time)
            rows = [await self.row(place, wish, newest) for place in wish.places]
            if self.samples.qsize() < WAITING_SAMPLES:
                self.samples.put_nowait((rows, self.lost))
                self.ready.set()
            else:
                self.lost += 1
            await asyncio.sleep(0)
            await self.doors.bridge.until(due + wish.every_s)

    async def row(self, place: Place, wish: Wish, newest: dict[Place, float]) -> dict[str, Any]:
        """One sample of an axis, which this client has not had before."""
        bridge, row = self.doors.bridge, {"address": place[0], "axis": place[1]}
        oldest = math.nextafter(
            max(newest.get(place, 0.0), bridge.gateway.time - wish.every_s), math.inf
        )
        try:
            if wish.position_only:
                time_s, position_nm = await bridge.position(place, oldest)
                newest[place] = time_s
                return {**row, "time_s": time_s, "position_nm": position_nm}
            moment = await bridge.status(place, oldest)
            newest[place] = moment.time
            return status_values(bridge, place, moment)
        except PortError:
            raise
        except MoireError as error:
            await bridge.until(bridge.gateway.time + max(wish.every_s, 0.1))
            return {**row, **refusal(error)[0]}
