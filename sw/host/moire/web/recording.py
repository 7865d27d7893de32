# SPDX-License-Identifier: Apache-2.0
"""Records of the two recorders of a node, for the clients of the doors: SCOPE, which every node
has, and TICKS, the recorder of ticks.

A recorder belongs to the client that has armed it, from then until its record has been read, the
client gives it up, or has left. The server waits for the record and reads it, so that a client only
has to ask how far it is.
"""

import asyncio
import itertools
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any, Protocol

from moire import units
from moire.analysis import tick_scope
from moire.analysis.scope import SAMPLES, Record, Scope
from moire.analysis.spectrum import FEWEST, WINDOW, spectrum
from moire.analysis.tick_scope import TickRecord, TickScope, joined
from moire.bus.arbiter import Place, request
from moire.client.axis import Axis
from moire.client.names import code_name
from moire.errors import MoireError
from moire.made.bus_tables import SCOPE_STATES, TICK_SIGNALS, TICK_TRIGGERS
from moire.web.bridge import Bridge, Client, fields_of
from moire.web.refusals import BadRequest

POLL_S = 0.05  # of the bus, between two looks at the state of a recorder
LEFT = "its client has left"
BUSY = ("waiting", "recording")
WORDS = {
    **dict(SCOPE_STATES.values()),
    "reading": "reading the record",
    "full": "the record is complete",
    "ended": "ended without a record",
}
TICK_DEFAULT = "target,error,command"  # signals of a record of ticks
STREAM_WORDS = 100_000  # of a stream that the server keeps
Values = dict[str, Any]


@dataclass
class Recording:
    """The way to one record. `ended` says why there will be none; empty while there may be one."""

    client: Client
    place: Place
    recorder: "Recorder"
    trigger: str
    samples: int  # to read
    number: int = field(default_factory=itertools.count(1).__next__)  # no other one has it
    state: str = "waiting"
    done: int = 0  # samples read
    ended: str = ""
    record: Record | TickRecord | None = None
    ticks: TickScope | None = None  # of a record of ticks
    stream: Iterator[TickRecord] | None = None  # of a record that is read while it is recorded
    pieces: list[TickRecord] = field(default_factory=list)  # of a stream, read so far
    task: "asyncio.Task[None] | None" = field(default=None, repr=False)

    @property
    def is_busy(self) -> bool:
        """Whether the recorder belongs to the client still."""
        return self.state not in ("full", "ended") and not self.client.left

    def end(self, why: str) -> None:
        """There will be no record."""
        self.state, self.ended = "ended", why


class Recorder(Protocol):
    """One of the two recorders of a node. `operation` is the request that arms it."""

    operation: str
    path: str  # after that of an axis
    name: str

    def begun(self, client: Client, place: Place, given: Mapping[str, Any]) -> Recording:
        """The recording that a client asks for; raises BadRequest if it cannot be."""

    def arm(self, axis: Axis, made: Recording, given: Mapping[str, Any]) -> None:
        """Arms it, in a thread that may wait."""

    async def state(self, bridge: Bridge, node: int) -> str:
        """The name of its state."""

    def read(self, axis: Axis, made: Recording) -> Record | TickRecord:
        """Reads the complete record in a thread that may wait."""


class EveryNode:
    """The recorder that every node has, see moire.analysis.scope."""

    operation, path, name = "arm_scope", "scope", "scope"

    def begun(self, client: Client, place: Place, given: Mapping[str, Any]) -> Recording:
        """With so many samples at most."""
        samples, before = given.get("samples", SAMPLES), given.get("before", 0)
        require_room(samples, before, SAMPLES)
        return Recording(client, place, self, given.get("trigger", "now"), samples)

    def arm(self, axis: Axis, made: Recording, given: Mapping[str, Any]) -> None:
        """The node refuses what does not fit."""
        Scope(axis).arm(
            made.trigger,
            given.get("before", 0),
            given.get("every", "1ms"),
            given.get("level", "0nm"),
        )

    async def state(self, bridge: Bridge, node: int) -> str:
        """By a poll, which other clients may share."""
        sample = await bridge.ask(node, request("scope"))
        return code_name(SCOPE_STATES, fields_of(sample, node)["state"], "state")

    def read(self, axis: Axis, made: Recording) -> Record:
        """So many samples as were asked for."""
        return Scope(axis).read(made.samples, lambda done: setattr(made, "done", done))


class EveryTick:
    """The recorder of ticks, see moire.analysis.tick_scope. With a duration it is a stream."""

    operation, path, name = "record_ticks", "ticks", "recorder of ticks"

    def begun(self, client: Client, place: Place, given: Mapping[str, Any]) -> Recording:
        """How many samples fit is known when it is armed."""
        before, delay = given.get("before", 0), given.get("delay")
        if "samples" in given:
            require_room(given["samples"], before, given["samples"])
        if before and delay is not None:
            raise BadRequest(
                "out_of_range",
                "samples before the trigger and a delay after it do not go together",
                "give one of both",
            )
        trigger = "now" if "duration" in given else given.get("trigger", "now")
        return Recording(client, place, self, trigger, 0)

    def arm(self, axis: Axis, made: Recording, given: Mapping[str, Any]) -> None:
        """A stream has its first samples then."""
        made.ticks = ticks = TickScope(axis)
        named = given.get("signals", TICK_DEFAULT).split(",")
        signals = [name.strip() for name in named if name.strip()]
        if "duration" in given:
            every, duration = given.get("every"), units.parse_time(given["duration"])
            made.samples = round(duration / ticks.ticks(every) * ticks.tick_hz)
            words = made.samples * len(ticks.chosen(signals))
            if not 0 < words <= STREAM_WORDS:
                raise BadRequest(
                    "out_of_range",
                    f"a stream of {words} words: from 1 to {STREAM_WORDS} are kept here",
                    "make it shorter or sparser, or use 'moire scope stream'",
                )
            made.stream = ticks.stream(signals, every, duration)
            made.state = "recording"
            self.take(made)
            return
        trigger = tick_scope.Trigger(
            made.trigger,
            given.get("of", "error"),
            given.get("level"),
            given.get("before", 0),
            round(units.parse_time(given.get("delay", 0)) * ticks.tick_hz),
        )
        ticks.start(signals, given.get("samples"), given.get("every"), trigger)
        made.samples = ticks.setting().samples

    def take(self, made: Recording) -> bool:
        """Takes the next part of a stream; false after the last one."""
        assert made.stream is not None
        piece = next(made.stream, None)
        if piece is None:
            return False
        made.pieces.append(piece)
        made.done += len(piece.time_s)
        return True

    async def state(self, bridge: Bridge, node: int) -> str:
        """From the registers, since reading words would lose them."""
        return await bridge.command(bridge, (node, 0), lambda axis: TickScope(axis).state())

    def read(self, axis: Axis, made: Recording) -> TickRecord:
        """A stream until its end, or until its client has given it up."""
        if made.stream is not None:
            while made.is_busy and self.take(made):
                pass
            return joined(made.pieces)
        assert made.ticks is not None
        signals = len(made.ticks.setting().channels)
        return made.ticks.read(lambda words: setattr(made, "done", words // signals))


SCOPE, TICKS = EveryNode(), EveryTick()


def require_room(samples: int, before: int, most: int) -> None:
    """Raises BadRequest unless so many samples, some from before the trigger, can be recorded."""
    if not FEWEST <= samples <= most or before >= samples:
        raise BadRequest(
            "out_of_range",
            f"{before} of {samples} samples before the trigger do not fit",
            f"read {FEWEST} to {most} samples, and fewer than these before the trigger",
        )


async def arm(
    bridge: Bridge, client: Client, place: Place, given: Mapping[str, Any], recorder: Recorder
) -> Recording:
    """Arms a recorder for a client; raises BadRequest if it belongs to another one."""
    made = recorder.begun(client, place, given)
    key = place[0], recorder.operation
    if not given.get("take"):
        await require_no_stranger(bridge, place[0], recorder)
        require_free(bridge, client, place[0], recorder)
    found = bridge.recordings.get(key)
    bridge.recordings[key] = made  # the next one who asks sees it at once
    try:
        await bridge.command(client, place, lambda axis: recorder.arm(axis, made, given))
    except BaseException:
        if bridge.recordings.get(key) is made:
            bridge.recordings.pop(key)
            if found is not None:
                bridge.recordings[key] = found
        raise
    if found is not None and found.is_busy and found.task is not None:
        found.end(f"{client} has armed the {recorder.name}")
        found.task.cancel()
    made.task = asyncio.create_task(follow(bridge, made))
    return made


async def require_no_stranger(bridge: Bridge, node: int, recorder: Recorder) -> None:
    """Raises BadRequest while a recorder of a node works for a client of TCP, or the like."""
    owner = bridge.gateway.arbiter.recorder_of.get((node, recorder.operation))
    if owner is None or isinstance(owner, Client):  # of these there are recordings
        return
    if await recorder.state(bridge, node) in BUSY:
        raise in_use(node, owner, recorder)


def require_free(bridge: Bridge, client: Client, node: int, recorder: Recorder) -> None:
    """Raises BadRequest while a recorder of a node belongs to another client of the doors."""
    found = bridge.recordings.get((node, recorder.operation))
    if found is not None and found.is_busy and found.client is not client:
        raise in_use(node, found.client, recorder)


def in_use(node: int, owner: Hashable, recorder: Recorder) -> BadRequest:
    """The recorder belongs to another client."""
    error = BadRequest(
        "scope_in_use",
        f"the {recorder.name} of node {node} waits for a record of another client: {owner}",
        f"wait until it is complete, or take the {recorder.name} over",
        HTTPStatus.CONFLICT,
    )
    error.__dict__["owner"] = str(owner)
    return error


async def follow(bridge: Bridge, made: Recording) -> None:
    """Waits for a record and reads it, until its client has it or has left."""
    node = made.place[0]
    try:
        while made.stream is None and (state := await made.recorder.state(bridge, node)) != "full":
            if state == "empty":
                made.end("the node has lost it, since it was switched off")
                return
            if not is_of(bridge, made):
                return
            made.state = state
            await bridge.until(bridge.gateway.time + POLL_S)
        if made.stream is None:
            made.state = "reading"
        record = await bridge.command(
            made.client,
            made.place,
            lambda axis: made.recorder.read(axis, made),
            "short" if made.stream is None else "stream",
        )
        if is_of(bridge, made):
            made.state, made.record = "full", record
    except MoireError as error:
        made.end(str(error))


def is_of(bridge: Bridge, made: Recording) -> bool:
    """Whether the recorder of the node still works for this record; ends it if not."""
    owner = bridge.gateway.arbiter.recorder_of.get((made.place[0], made.recorder.operation))
    if made.client.left:
        made.end(LEFT)
    elif owner is not made.client and made.state != "ended":
        made.end(f"{owner or 'a client that has left'} has armed the {made.recorder.name}")
    return made.state != "ended"


def give_up(bridge: Bridge, client: Client, place: Place, recorder: Recorder) -> None:
    """The client does not wait for its record any more; raises BadRequest."""
    found = bridge.recordings.get((place[0], recorder.operation))
    if found is None or not found.is_busy or found.client is not client:
        raise BadRequest(
            "no_recording",
            f"this client waits for no record of node {place[0]}",
            f"begin with POST …/{recorder.path}",
            HTTPStatus.CONFLICT,
        )
    if found.pieces:  # a stream ends with what there is of it
        found.record, found.state, found.samples = joined([*found.pieces]), "full", found.done
    else:
        found.end("given up")
    if found.task is not None:
        found.task.cancel()


# ------------------------------------------------------------------ answers


def progress_values(bridge: Bridge, place: Place, recorder: Recorder) -> Values:
    """How far the record of a node is."""
    found = bridge.recordings.get((place[0], recorder.operation))
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


def record_values(bridge: Bridge, place: Place) -> Values:
    """The record of an axis, with its spectra and as CSV; raises BadRequest without one."""
    found = bridge.recordings.get((place[0], SCOPE.operation))
    if found is None or found.place != place or not isinstance(found.record, Record):
        raise no_record(place, SCOPE)
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


def no_record(place: Place, recorder: Recorder) -> BadRequest:
    """There is nothing to show."""
    return BadRequest(
        "no_record",
        f"there is no record of axis {place[0]}.{place[1]}",
        f"begin with POST …/{recorder.path}, and wait until its state is full",
        HTTPStatus.CONFLICT,
    )


def tick_values(bridge: Bridge, place: Place, first: int) -> Values:
    """The record of ticks that an axis has, or what there is of its stream, from sample `first` on;
    raises BadRequest without one.
    """
    found = bridge.recordings.get((place[0], TICKS.operation))
    made = found and (found.record or (joined(found.pieces) if found.pieces else None))
    if found is None or found.place != place or not isinstance(made, TickRecord):
        raise no_record(place, TICKS)
    columns = {name: values.tolist() for name, values in made.columns().items()}
    time_s = columns.pop("time_s")
    is_whole = found.record is not None
    lines = {}
    if is_whole and len(time_s) >= FEWEST:
        lines = {name: spectrum(time_s, values) for name, values in columns.items()}
    return {
        "number": found.number,
        "trigger": found.trigger,
        "before": max(0, -made.first),
        "first": first,
        "time_s": time_s[first:],
        "columns": {name: values[first:] for name, values in columns.items()},
        "window": WINDOW,
        "frequency_hz": next(iter(lines.values())).frequency_hz if lines else [],
        "spectrum": {name: one.amplitude for name, one in lines.items()},
        "csv": made.csv() if is_whole else "",
    }


async def recorder_values(bridge: Bridge, place: Place) -> Values:
    """What the recorder of ticks of a node can record."""
    words, tick_s, axes = await bridge.command(
        bridge,
        place,
        lambda axis: (TickScope(axis).words(), TickScope(axis).tick_s, axis.node.identity.axes),
    )
    return {
        "words": words,
        "tick_s": tick_s,
        "axes": axes,
        "channels": tick_scope.CHANNELS,
        "signals": dict(TICK_SIGNALS.values()),
        "triggers": dict(TICK_TRIGGERS.values()),
        "stream_words": STREAM_WORDS,
    }
