# SPDX-License-Identifier: Apache-2.0
"""Records of the scopes of the nodes, for the clients of the doors.

A node has one scope. It belongs to the client that has armed it, from then until its record has
been read, the client gives it up, or has left. The server waits for the record and reads it, so
that a client only has to ask how far it is.
"""

import asyncio
import itertools
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any

from moire.analysis.scope import SAMPLES, Record, Scope
from moire.analysis.spectrum import FEWEST, WINDOW, spectrum
from moire.bus.arbiter import Place, request
from moire.client.axis import Axis
from moire.client.names import code_name
from moire.errors import MoireError
from moire.made.bus_tables import SCOPE_STATES
from moire.web.bridge import Bridge, Client, fields_of
from moire.web.refusals import BadRequest

POLL_S = 0.05  # of the bus, between two looks at the state of a scope
LEFT = "its client has left"
BUSY = ("waiting", "recording")
WORDS = {
    **dict(SCOPE_STATES.values()),
    "reading": "reading the record",
    "full": "the record is complete",
    "ended": "ended without a record",
}


@dataclass
class Recording:
    """The way to one record. `ended` says why there will be none; empty while there may be one."""

    client: Client
    place: Place
    trigger: str
    samples: int  # to read
    number: int = field(default_factory=itertools.count(1).__next__)  # no other one has it
    state: str = "waiting"
    done: int = 0  # samples read
    ended: str = ""
    record: Record | None = None
    task: "asyncio.Task[None] | None" = field(default=None, repr=False)

    @property
    def is_busy(self) -> bool:
        """Whether the scope belongs to the client still."""
        return self.state not in ("full", "ended") and not self.client.left

    def end(self, why: str) -> None:
        """There will be no record."""
        self.state, self.ended = "ended", why


async def arm(bridge: Bridge, client: Client, place: Place, given: Mapping[str, Any]) -> Recording:
    """Arms the scope of a node for a client; raises BadRequest if it belongs to another one."""
    samples, before = given.get("samples", SAMPLES), given.get("before", 0)
    if not FEWEST <= samples <= SAMPLES or before >= samples:
        raise BadRequest(
            "out_of_range",
            f"{before} of {samples} samples before the trigger do not fit",
            f"read {FEWEST} to {SAMPLES} samples, and fewer than these before the trigger",
        )
    if not given.get("take"):
        await require_no_stranger(bridge, place[0])
        require_free(bridge, client, place[0])
    trigger = given.get("trigger", "now")
    made = Recording(client, place, trigger, samples)
    found = bridge.recordings.get(place[0])
    bridge.recordings[place[0]] = made  # the next one who asks sees it at once
    try:
        await bridge.command(
            client,
            place,
            lambda axis: Scope(axis).arm(
                trigger, before, given.get("every", "1ms"), given.get("level", "0nm")
            ),
        )
    except BaseException:
        if bridge.recordings.get(place[0]) is made:
            bridge.recordings.pop(place[0])
            if found is not None:
                bridge.recordings[place[0]] = found
        raise
    if found is not None and found.is_busy and found.task is not None:
        found.end(f"{client} has armed the scope")
        found.task.cancel()
    made.task = asyncio.create_task(follow(bridge, made))
    return made


async def require_no_stranger(bridge: Bridge, node: int) -> None:
    """Raises BadRequest while the scope of a node works for a client of TCP, or the like."""
    owner = bridge.gateway.arbiter.scope_of.get(node)
    if owner is None or isinstance(owner, Client):  # of these there are recordings
        return
    if await state_of(bridge, node) in BUSY:
        raise in_use(node, owner)


def require_free(bridge: Bridge, client: Client, node: int) -> None:
    """Raises BadRequest while the scope of a node belongs to another client of the doors."""
    found = bridge.recordings.get(node)
    if found is not None and found.is_busy and found.client is not client:
        raise in_use(node, found.client)


def in_use(node: int, owner: Hashable) -> BadRequest:
    """The scope belongs to another client."""
    error = BadRequest(
        "scope_in_use",
        f"the scope of node {node} waits for a record of another client: {owner}",
        "wait until it is complete, or take the scope over",
        HTTPStatus.CONFLICT,
    )
    error.__dict__["owner"] = str(owner)
    return error


async def state_of(bridge: Bridge, node: int) -> str:
    """The name of the state of the scope of a node."""
    sample = await bridge.ask(node, request("scope"))
    return code_name(SCOPE_STATES, fields_of(sample, node)["state"], "state")


async def follow(bridge: Bridge, made: Recording) -> None:
    """Waits for a record and reads it, until its client has it or has left."""
    node = made.place[0]
    try:
        while (state := await state_of(bridge, node)) != "full":
            if state == "empty":
                made.end("the node has lost it, since it was switched off")
                return
            if not is_of(bridge, made):
                return
            made.state = state
            await bridge.until(bridge.gateway.time + POLL_S)
        made.state = "reading"
        record = await bridge.command(made.client, made.place, lambda axis: read(axis, made))
        if is_of(bridge, made):
            made.state, made.record = "full", record
    except MoireError as error:
        made.end(str(error))


def is_of(bridge: Bridge, made: Recording) -> bool:
    """Whether the scope of the node still works for this record; ends it if not."""
    owner = bridge.gateway.arbiter.scope_of.get(made.place[0])
    if made.client.left:
        made.end(LEFT)
    elif owner is not made.client:
        made.end(f"{owner or 'a client that has left'} has armed the scope")
    return made.state != "ended"


def read(axis: Axis, made: Recording) -> Record:
    """Reads the record in a thread that may wait."""
    return Scope(axis).read(made.samples, lambda done: setattr(made, "done", done))


def give_up(bridge: Bridge, client: Client, place: Place) -> None:
    """The client does not wait for its record any more; raises BadRequest."""
    found = bridge.recordings.get(place[0])
    if found is None or not found.is_busy or found.client is not client:
        raise BadRequest(
            "no_recording",
            f"this client waits for no record of node {place[0]}",
            "begin with POST …/scope",
            HTTPStatus.CONFLICT,
        )
    found.end("given up")
    if found.task is not None:
        found.task.cancel()


# ------------------------------------------------------------------ answers


def progress_values(bridge: Bridge, place: Place) -> dict[str, Any]:
    """How far the record of a node is."""
    found = bridge.recordings.get(place[0])
    if found is None:
        return {
            "number": 0,
            "state": "empty",
            "words": WORDS["empty"],
            "axis": None,
            "trigger": None,
            "owner": None,
            "done": 0,
            "samples": 0,
        }
    state = "ended" if found.client.left and found.state != "full" else found.state
    why = found.ended or LEFT
    return {
        "number": found.number,
        "state": state,
        "words": f"{WORDS[state]}: {why}" if state == "ended" else WORDS[state],
        "axis": f"{found.place[0]}.{found.place[1]}",
        "trigger": found.trigger,
        "owner": str(found.client) if found.is_busy else None,
        "done": found.samples if state == "full" else found.done,
        "samples": found.samples,
    }


def record_values(bridge: Bridge, place: Place) -> dict[str, Any]:
    """The record of an axis, with its spectra and as CSV; raises BadRequest without one."""
    found = bridge.recordings.get(place[0])
    if found is None or found.record is None or found.place != place:
        raise BadRequest(
            "no_record",
            f"there is no record of axis {place[0]}.{place[1]}",
            "begin with POST …/scope, and wait until its state is full",
            HTTPStatus.CONFLICT,
        )
    record = found.record
    signals = {
        "position_nm": record.position_nm,
        "error_nm": record.error_nm,
        "drive_command": record.command,
    }
    spectra = {name: spectrum(record.time_s, values) for name, values in signals.items()}
    return {
        "number": found.number,
        "trigger": found.trigger,
        "before": record.before,
        "time_s": record.time_s,
        **signals,
        "window": WINDOW,
        "frequency_hz": spectra["error_nm"].frequency_hz,
        "spectrum": {name: one.amplitude for name, one in spectra.items()},
        "csv": record.csv(),
    }
