# SPDX-License-Identifier: Apache-2.0
"""The application of Starlette: requests of HTTP, and the beginning of a WebSocket."""

import asyncio
from collections.abc import Callable
from http import HTTPStatus
from typing import Any, Protocol

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, HTTPConnection, Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from moire.errors import MoireError
from moire.web import openapi, page, stream
from moire.web.access import Meter
from moire.web.answers import Doors, internal, operation_for, perform, refusal, text_of, values_of
from moire.web.bridge import Bridge, Client
from moire.web.refusals import BadRequest

LARGEST_BODY = 32768  # bytes
BODY_S = 5.0  # of the clock, for a body to arrive
LONGEST_NAME = 40  # of a client
NAME_HEADER = "moire-client"
METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")


class Connection(Protocol):
    """What the server keeps for each connection of HTTP."""

    peer: Client | None
    meter: Meter


class Json(Response):
    """An answer in JSON."""

    media_type = "application/json"

    def render(self, content: Any) -> bytes:
        """The bytes of the answer."""
        return text_of(content).encode()


def application(doors: Doors) -> Starlette:
    """The application in front of a bridge."""
    document, help_page = Json(openapi.document()), HTMLResponse(openapi.page())
    return Starlette(
        routes=[
            *(Route(path, always(file)) for path, file in page.responses().items()),
            Route("/api/openapi.json", always(document)),
            Route("/api/help", always(help_page)),
            WebSocketRoute("/api/stream", websocket(doors)),
            Route("/{path:path}", of_the_table(doors), methods=METHODS),
        ],
        exception_handlers={HTTPException: not_found, Exception: failed},
    )


def always(response: Response) -> Callable[[Request], Any]:
    """The function of Starlette for what is the same for everybody."""

    async def give(request: Request) -> Response:
        return response

    return give


async def not_found(request: Request, error: Exception) -> Response:
    """A method that does not exist."""
    assert isinstance(error, HTTPException)
    wrong = BadRequest(
        "wrong_method",
        f"{request.method[:20]} is no method of {request.url.path[:80]}",
        "GET /api/help shows what there is",
        HTTPStatus(error.status_code),
    )
    return Json(*refusal(wrong))


async def failed(request: Request, error: Exception) -> Response:
    """A defect of this program."""
    return Json(*internal(error))


# ------------------------------------------------------------------ HTTP


def of_the_table(doors: Doors) -> Callable[[Request], Any]:
    """The function of Starlette for all operations of api.py."""

    async def answer(request: Request) -> Response:
        try:
            return Json(await of_http(doors, request))
        except MoireError as error:
            return Json(*refusal(error))

    return answer


async def of_http(doors: Doors, request: Request) -> dict[str, Any]:
    """The answer to a request; raises MoireError."""
    connection: Connection = request.state.connection
    method = "GET" if request.method == "HEAD" else request.method
    operation, path = operation_for(doors.bridge, method, request.url.path)
    may_change = doors.access.check(request.headers, None, operation.changes)
    if not operation.urgent:
        connection.meter.count()
    client = client_of(doors.bridge, connection, request)
    if operation.changes:
        values = values_of(await read_body(request))
    else:
        values = dict(request.query_params.items())
    return await perform(doors.bridge, client, operation, path, values, may_change)


def client_of(bridge: Bridge, connection: Connection, request: Request) -> Client:
    """The client of a request: that of its name, or else that of its connection."""
    name = request.headers.get(NAME_HEADER)
    if name is not None and not (name.isprintable() and 0 < len(name) <= LONGEST_NAME):
        raise BadRequest(
            "wrong_name",
            f"the name in the header {NAME_HEADER} is empty, too long or not printable",
            f"use 1 to {LONGEST_NAME} letters",
        )
    known = connection.peer
    if known is None or known.left or known.given != name:
        if known is not None and known.given is None:
            bridge.leave(known)
        known = connection.peer = bridge.client(name, place_of(request, "HTTP"))
    return known


def place_of(connection: HTTPConnection, kind: str) -> str:
    """Where a client is, in words."""
    peer = connection.client
    return f"{kind} client at {peer.host}:{peer.port}" if peer else f"{kind} client"


async def read_body(request: Request) -> bytes:
    """The body of a request; raises BadRequest if it is too large or too slow."""
    body = bytearray()
    try:
        async with asyncio.timeout(BODY_S):
            async for part in request.stream():
                body += part
                if len(body) > LARGEST_BODY:
                    raise BadRequest(
                        "too_large",
                        f"the body has more than {LARGEST_BODY} bytes",
                        "send less at once",
                        HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
                    )
    except TimeoutError:
        raise BadRequest(
            "too_slow",
            f"the body did not arrive within {BODY_S:g} s",
            "send it faster",
            HTTPStatus.REQUEST_TIMEOUT,
        ) from None
    except ClientDisconnect:
        raise BadRequest("gone", "the client has gone", "connect again") from None
    return bytes(body)


# ------------------------------------------------------------------ WebSocket


def websocket(doors: Doors) -> Callable[[WebSocket], Any]:
    """The function of Starlette for /api/stream."""

    async def serve(socket: WebSocket) -> None:
        token = socket.query_params.get("token")
        try:
            doors.access.check(socket.headers, token, False)
            wish = stream.wish_of(dict(socket.query_params.items()))
        except MoireError as error:
            await socket.send_denial_response(Json(*refusal(error)))
            return
        await socket.accept()
        client = doors.bridge.client(None, place_of(socket, "WebSocket"))
        await stream.Session(socket, doors, client, wish, token).serve()

    return serve
