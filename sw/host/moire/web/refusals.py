# SPDX-License-Identifier: Apache-2.0
"""Errors as answers: the HTTP status, and JSON with cause, text and what to do."""

from http import HTTPStatus
from typing import Any

from moire.client import remedies
from moire.errors import (
    BusGarbled,
    MoireError,
    MotionFailed,
    NoAnswer,
    OutOfRange,
    PortError,
    Refused,
    UnitError,
    UnknownName,
    WrongBuild,
)

CHECK_BUS = (
    "check the power of the node, the wiring and the address; GET /api/nodes shows who is there"
)
# by class, the first one that fits: status, cause if the error has none of its own, what to do
KINDS: tuple[tuple[type[MoireError], HTTPStatus, str, str], ...] = (
    (UnitError, HTTPStatus.BAD_REQUEST, "no_unit", "write the value as text with its unit"),
    (OutOfRange, HTTPStatus.BAD_REQUEST, "out_of_range", "give a value in the range"),
    (UnknownName, HTTPStatus.NOT_FOUND, "unknown_name", "GET …/parameters lists the names"),
    (NoAnswer, HTTPStatus.GATEWAY_TIMEOUT, "no_answer", CHECK_BUS),
    (BusGarbled, HTTPStatus.BAD_GATEWAY, "bus_garbled", CHECK_BUS),
    (WrongBuild, HTTPStatus.BAD_GATEWAY, "wrong_build", "build node and host from one source"),
    (Refused, HTTPStatus.CONFLICT, "refused", "read the text"),
    (MotionFailed, HTTPStatus.CONFLICT, "motion_failed", "read the text"),
    (PortError, HTTPStatus.SERVICE_UNAVAILABLE, "port_failed", "start the server again"),
    (MoireError, HTTPStatus.CONFLICT, "failed", "read the text"),
)


class BadRequest(MoireError):
    """A request that the door itself refuses."""

    exit_code = 2

    def __init__(
        self, cause: str, sentence: str, to_do: str, status: HTTPStatus = HTTPStatus.BAD_REQUEST
    ):
        super().__init__(sentence)
        self.cause, self.to_do, self.status = cause, to_do, status


def status_of(error: MoireError) -> HTTPStatus:
    """The HTTP status of an error."""
    if isinstance(error, BadRequest):
        return error.status
    if isinstance(error, Refused) and error.cause == "no_such_axis":
        return HTTPStatus.NOT_FOUND
    return next(status for kind, status, _, _ in KINDS if isinstance(error, kind))


def body_of(error: MoireError) -> dict[str, Any]:
    """The JSON of an error. `owner` is the client that moves the axis, where that is the cause."""
    _, cause, to_do = next(row[1:] for row in KINDS if isinstance(error, row[0]))
    cause = getattr(error, "cause", cause)
    to_do = getattr(error, "to_do", remedies.CAUSES.get(cause, to_do))
    owner = getattr(error, "owner", None)
    values = {"cause": cause, "text": str(error), "to_do": to_do}
    return {"error": values | ({"owner": owner} if owner else {})}
