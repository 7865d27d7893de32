# SPDX-License-Identifier: Apache-2.0
"""From the values of a request to an operation of api.py and its answer: what HTTP and WebSocket
have in common.
"""

import json
import sys
import time
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from moire.errors import MoireError
from moire.web.access import Access, too_many
from moire.web.api import AXIS, find
from moire.web.bridge import Bridge, Client
from moire.web.operation import Call, Operation, checked, whole_number
from moire.web.refusals import BadRequest, body_of, status_of

BY_NAME, LONGEST_NAME = "/api/axes/", 40
MOST_AT_ONCE = 8  # requests of one client in progress

Answer = tuple[dict[str, Any], HTTPStatus]


@dataclass(frozen=True)
class Doors:
    """What all requests need."""

    bridge: Bridge
    access: Access


def text_of(content: Any) -> str:
    """The text of JSON, as short as it can be."""
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def refusal(error: MoireError) -> Answer:
    """The answer to a request that is refused."""
    return body_of(error), status_of(error)


def internal(error: BaseException) -> Answer:
    """The answer to a defect of this program, which is printed on the standard error."""
    traceback.print_exception(error, file=sys.stderr)
    wrong = BadRequest(
        "internal",
        f"the server has a defect: {type(error).__name__}",
        "report it, with the lines that the server has printed",
        HTTPStatus.INTERNAL_SERVER_ERROR,
    )
    return refusal(wrong)


def values_of(body: bytes | str) -> dict[str, Any]:
    """The object in a text of JSON; no text has no values. Raises BadRequest."""
    if not body:
        return {}
    try:
        values = json.loads(body)
    except (ValueError, RecursionError):
        values = None
    if not isinstance(values, dict):
        raise BadRequest("no_json", "this is no object of JSON", 'write it as in {"to": "1.5 mm"}')
    return values


async def perform(
    bridge: Bridge,
    client: Client,
    operation: Operation,
    path: Mapping[str, str],
    values: Mapping[str, Any],
    may_change: bool,
) -> dict[str, Any]:
    """Does an operation for a client; raises MoireError. `may_change` says what its token is for,
    and has been checked.
    """
    if client.busy >= MOST_AT_ONCE and not operation.urgent:
        raise too_many(f"{MOST_AT_ONCE} of this client are in progress")
    node = whole_number(path.get("node", "0"), "a node")
    axis = whole_number(path.get("axis", "0"), "an axis")
    given = checked(operation.given, values)
    call = Call(bridge, client, node, axis, path.get("name", ""), given, may_change)
    client.busy += 1
    try:
        return await operation.act(call)
    finally:
        client.busy -= 1
        client.heard = time.monotonic()


def operation_for(bridge: Bridge, method: str, path: str) -> tuple[Operation, Mapping[str, str]]:
    """The operation of a path, and what the path names; raises BadRequest. An axis may be named by
    its node and number, or by its name in the description of the machine: /api/axes/x.
    """
    if path.startswith(BY_NAME):
        name, slash, more = path.removeprefix(BY_NAME).partition("/")
        node, axis = bridge.description.axis(name[:LONGEST_NAME]).place
        path = AXIS.format(node=node, axis=axis) + slash + more
    found, methods = find(method, path)
    if found is not None:
        return found
    raise BadRequest(
        "wrong_method" if methods else "no_such_path",
        f"{method[:20]} is no method of {path[:80]}" if methods else f"there is no {path[:80]}",
        f"use {' or '.join(methods)}" if methods else "GET /api/help shows what there is",
        HTTPStatus.METHOD_NOT_ALLOWED if methods else HTTPStatus.NOT_FOUND,
    )
