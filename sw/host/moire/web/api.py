# SPDX-License-Identifier: Apache-2.0
"""What the doors can be asked for: one table of operations, with their functions. The routes of the
server and the OpenAPI document are made from it.
"""

import asyncio
import re
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import asdict, dataclass, field, fields
from fractions import Fraction
from http import HTTPStatus
from importlib.metadata import version
from typing import Any, TypeVar

from moire import units
from moire.analysis.scope import SAMPLES, TRIGGERS
from moire.analysis.tick_scope import TRIGGERS as TICK_KINDS
from moire.bus.arbiter import Place
from moire.bus.protocol import ADDRESSES
from moire.client import remedies
from moire.client.access import COUNTS
from moire.client.axis import REACT_S, Axis
from moire.client.groups import group_of
from moire.client.job import ACTIONS, Job
from moire.client.names import CAUSE_CODES, descriptions
from moire.client.nonvolatile import SavedSettings
from moire.client.parameters import TRAVEL
from moire.client.records import Identity, Status
from moire.client.segments import Segments, SegmentTable
from moire.client.values import ParameterValue
from moire.errors import MoireError, NoAnswer, Refused
from moire.made.bus_tables import FAULTS, PARAMETERS
from moire.web import calibrating, lissajous, recording
from moire.web.bridge import Bridge, Client, Moment
from moire.web.jog import HOLD_S
from moire.web.refusals import BadRequest

Result = TypeVar("Result")
Values = dict[str, Any]
AXIS = "/api/nodes/{node}/axes/{axis}"
WHOLE, LARGEST = re.compile(r"-?[0-9]{1,9}"), 10**9
FRESH_S = 0.01  # of the bus: how old the reply to a poll may be, unless a client says otherwise


@dataclass(frozen=True)
class Call:
    """One request: who asks, for which axis, and what."""

    bridge: Bridge
    client: Client
    node: int = 0
    axis: int = 0
    name: str = ""  # of a parameter
    given: Mapping[str, Any] = field(default_factory=dict)  # the fields of the body or the query
    may_change: bool = True  # its token does not only read

    @property
    def place(self) -> Place:
        """The axis."""
        return self.node, self.axis

    async def command(self, work: Callable[[Axis], Any], pool: str = "short") -> Any:
        """Calls the host package's client code for the axis, for this client."""
        return await self.bridge.command(self.client, self.place, work, pool)

    def oldest(self) -> float:
        """The time of the bus before which a reply to a poll is too old."""
        age = self.given.get("max_age")
        return self.bridge.gateway.time - (FRESH_S if age is None else float(age))


@dataclass(frozen=True)
class Given:
    """A field of a request. `kind` is "text", "flag", "whole number", "value" (a text, or a plain
    number), or "length" or "time", which are texts with a unit.
    """

    name: str
    kind: str
    what: str
    example: Any
    required: bool = False


@dataclass(frozen=True)
class Operation:
    """One thing to ask for. `answer` has the fields of the answer: type and meaning."""

    method: str
    path: str
    what: str
    act: Callable[[Call], Awaitable[Values]]
    answer: Mapping[str, tuple[str, str]]
    given: tuple[Given, ...] = ()
    urgent: bool = False  # not counted by the limits

    @property
    def changes(self) -> bool:
        """Whether a token that only reads may not ask for it."""
        return self.method != "GET"

    @property
    def name(self) -> str:
        """A name that no other operation has."""
        return self.act.__name__


def checked(given: tuple[Given, ...], values: Mapping[str, Any]) -> Values:
    """The fields of a request; raises BadRequest, or UnitError."""
    known = {one.name: one for one in given}
    for name in values:
        if name not in known:
            names = ", ".join(known) or "none"
            raise BadRequest(
                "unknown_field", f"there is no field '{name[:40]}'", f"allowed are: {names}"
            )
    for one in given:
        if one.required and values.get(one.name) is None:
            raise BadRequest(
                "missing_field",
                f"the field '{one.name}' is missing: {one.what}",
                f"write it as in {one.example!r}",
            )
    return {name: read(known[name], value) for name, value in values.items() if value is not None}


def read(one: Given, value: Any) -> Any:
    """One field; raises BadRequest, or UnitError."""
    flags = {"true": True, "false": False}
    if one.kind == "flag":
        value = flags.get(value, value) if isinstance(value, str) else value
        if isinstance(value, bool):
            return value
        raise wrong_type(one, "true or false")
    if one.kind == "whole number":
        if isinstance(value, str) and WHOLE.fullmatch(value):
            value = int(value)
        if isinstance(value, int) and not isinstance(value, bool) and abs(value) < LARGEST:
            return value
        raise wrong_type(one, "a whole number")
    if one.kind == "value" and isinstance(value, int | float) and not isinstance(value, bool):
        return repr(value)  # a plain number, which only a parameter without a unit takes
    if not isinstance(value, str):
        raise wrong_type(one, "a text" + (" with a unit" if one.kind != "text" else ""))
    if one.kind == "length":
        units.parse_length(value)  # the text itself goes on, for it is exact
    if one.kind == "time":
        seconds = units.parse_time(value)
        if seconds < 0:
            raise BadRequest("out_of_range", f"{one.name} is below zero", "give a time from 0s on")
        return seconds
    return value


def wrong_type(one: Given, needed: str) -> BadRequest:
    """The field has another type."""
    return BadRequest(
        "wrong_type", f"the field '{one.name}' is no {one.kind}", f"write {needed}: {one.example!r}"
    )


# ------------------------------------------------------------------ the server and its nodes


async def server(call: Call) -> Values:
    bridge, gateway = call.bridge, call.bridge.gateway
    moved = {place: str(owner) for place, owner in gateway.arbiter.moved_by.copy().items()}
    return {
        "version": version("moire"),
        "time_s": gateway.time,
        "speed": gateway.speed,
        "clients": sorted(map(str, bridge.present)),
        "packet_clients": len(gateway.clients),
        "moved_by": {f"{node}.{axis}": owner for (node, axis), owner in moved.items()},
        "may_change": call.may_change,
        "machine": bridge.description.text,
        "names": {f"{one.node}.{one.axis}": one.name for one in bridge.description.axes.values()},
    }


async def bus(call: Call) -> Values:
    gateway = call.bridge.gateway
    return {
        "time_s": gateway.time,
        **asdict(gateway.exchanges.statistics),
        "no_request": gateway.refused,
        "waiting": len(gateway.waiting),
        "clients": sorted(map(str, [*call.bridge.present, *gateway.clients])),
    }


async def nodes(call: Call) -> Values:
    found = []
    for address in getattr(call.bridge.gateway.transport, "addresses", ADDRESSES):
        try:
            found.append(node_values(await call.bridge.identity(address)))
        except NoAnswer:
            pass
        except MoireError as error:  # another build, or two nodes with one address
            found.append({"address": address, "error": str(error)})
    return {"nodes": found}


async def node(call: Call) -> Values:
    return node_values(await call.bridge.identity(call.node))


def node_values(identity: Identity) -> Values:
    return {
        "address": identity.address,
        "axes": [f"{identity.address}.{axis}" for axis in range(identity.axes)],
        "version": identity.version,
        "clk_hz": identity.clk_hz,
        "tick_hz": identity.tick_hz,
    }


JOB_FIELDS = ("state", "words", "cause_words", "station", "stations", "answers")


async def job(call: Call) -> Values:
    try:
        state = await call.bridge.command_of_node(
            call.client, call.node, lambda node: Job(node).state()
        )
    except Refused as refused:
        if refused.cause not in ("not_built", "unknown_operation"):
            raise
        return {"built": False, **dict.fromkeys(JOB_FIELDS)}
    return {"built": True, **{name: getattr(state, name) for name in JOB_FIELDS}}


async def do_job(call: Call) -> Values:
    action = call.given["action"]
    if action not in ACTIONS:
        raise BadRequest(
            "out_of_range",
            f"a job has no action '{action[:20]}'",
            f"allowed are: {', '.join(ACTIONS)}",
        )
    await call.bridge.command_of_node(call.client, call.node, lambda node: Job(node).do(action))
    return await job(call)


# ------------------------------------------------------------------ an axis


async def status(call: Call) -> Values:
    return status_of(call, await call.bridge.status(call.place, call.oldest()))


def status_of(call: Call, moment: Moment) -> Values:
    """The status of the axis of a request."""
    return status_values(call.bridge, call.place, moment)


def status_values(bridge: Bridge, place: Place, moment: Moment) -> Values:
    """The status of an axis as an answer and as a sample of the stream."""
    found = moment.status
    owner = bridge.owner(place) if found.in_motion else None
    return {
        "address": place[0],
        "axis": place[1],
        "time_s": moment.time,
        "speed": bridge.gateway.speed,
        "moved_by": None if owner is None else str(owner),
        **found.values(),
        "to_do": remedies.of_faults(found.first_fault if found.faults else ()),
    }


async def position(call: Call) -> Values:
    time, position_nm = await call.bridge.position(call.place, call.oldest())
    return {"time_s": time, "position_nm": position_nm}


async def faults(call: Call) -> Values:
    moment = await call.bridge.status(call.place)
    found, encoder = moment.status, await call.command(lambda axis: axis.encoder())
    return {
        "faults": [
            {
                "name": name,
                "words": descriptions(FAULTS, [name]),
                "first": name in found.first_fault,
                "to_do": remedies.of_faults([name]),
            }
            for name in found.faults
        ],
        "position_nm": encoder.fault_position_nm if found.faults else None,
        "encoder_events": found.encoder_events,
        "home_again": bool(found.faults) and not found.homed,
    }


async def stop(call: Call) -> Values:
    try:
        await call.bridge.ask_at_once(call.client, call.place, "stop")
    except Refused as refused:
        if refused.cause != "not_enabled":  # a drive that is off has nothing to stop
            raise
    return status_of(call, await call.bridge.status(call.place))


async def disable(call: Call) -> Values:
    await call.bridge.ask_at_once(call.client, call.place, "enable", on=0)
    return status_of(call, await call.bridge.status(call.place))


async def enable(call: Call) -> Values:
    await call.command(lambda axis: axis.enable())
    return status_of(call, await call.bridge.status(call.place))


async def clear(call: Call) -> Values:
    await call.command(lambda axis: axis.reset())
    return status_of(call, await call.bridge.status(call.place))


async def take(call: Call) -> Values:
    bridge = call.bridge
    await bridge.status(call.place)  # there is such an axis
    bridge.claim(call.client, call.place)
    await stop(call)
    await bridge.end_of_motion(call.place, lambda found: found.in_motion)
    await asyncio.sleep(REACT_S)  # a program that has lost the axis switches off what it must
    bridge.claim(call.client, call.place)
    return status_of(call, await bridge.status(call.place))


async def begun(
    call: Call, begin: Callable[[Axis], Result], switch_on: Callable[[Axis], None]
) -> tuple[Result, Axis]:
    """Switches the drive on if it is off, and begins a motion. Whoever else moves the axis is
    stopped if asked. A stop that anybody sends meanwhile is ahead of the motion in the queue, so
    that it holds for this motion, too.
    """
    bridge, place = call.bridge, call.place
    if call.given.get("take") and bridge.owner(place) not in (None, call.client):
        await take(call)
    stops = bridge.gateway.stops[place]
    if not (await bridge.status(place)).status.enabled:
        await call.command(switch_on)
        if bridge.gateway.stops[place] != stops:
            await bridge.ask_at_once(call.client, place, "enable", on=0)
            raise was_stopped()
    result: tuple[Result, Axis] = await call.command(lambda axis: (begin(axis), axis))
    if bridge.gateway.stops[place] != stops:
        await stop(call)
        raise was_stopped()
    return result


def was_stopped() -> Refused:
    """A stop has come while a motion was being begun."""
    return Refused(
        "stopped", CAUSE_CODES["stopped"], "the motion was stopped while it was being begun"
    )


def enable_for_move(axis: Axis) -> None:
    """Switches the drive on for a motion that needs a zero."""
    axis.enable_for("move")


async def motion(
    call: Call, begin: Callable[[Axis], float | None], switch_on: Callable[[Axis], None]
) -> Values:
    """Begins a motion and, unless told otherwise, waits for its end."""
    seconds, axis = await begun(call, begin, switch_on)
    call.bridge.end_jogs(call.place)
    if not call.given.get("wait", True):
        return begun_values(call, await call.bridge.status(call.place), seconds)
    end = await call.bridge.end_of_motion(call.place, lambda found: found.ended == "running")
    axis.reached(end.status)
    error_nm = end.status.target_nm - end.status.position_nm
    return {**status_of(call, end), "duration_s": seconds, "error_nm": error_nm}


def begun_values(call: Call, found: Moment, seconds: float | None) -> Values:
    """The answer for a motion whose end is not waited for."""
    return {**status_of(call, found), "duration_s": seconds, "error_nm": None}


async def move(call: Call) -> Values:
    to, by = call.given.get("to"), call.given.get("by")
    if (to is None) == (by is None):
        raise BadRequest(
            "missing_field",
            "a motion needs 'to' or 'by', one of them",
            'write {"to": "1.5 mm"}, or {"by": "-50 um"}',
        )
    return await motion(
        call, lambda axis: axis.begin_move(to or by, by=by is not None), enable_for_move
    )


async def jog(call: Call) -> Values:
    if call.bridge.jog(call.client, call.place) is not None:
        raise BadRequest(
            "jogs_already",
            "this client jogs the axis already",
            "stop it first",
            HTTPStatus.CONFLICT,
        )
    made = call.bridge.begin_jog(call.client, call.place)
    by_nm = units.parse_length(call.given["by"])

    def begin(axis: Axis) -> float:
        low, high = (axis.get_parameter(name).counts * axis.period_nm / COUNTS for name in TRAVEL)
        target = Fraction(axis.status().target_nm) + by_nm
        return axis.begin_move(nm=min(max(target, low), high))

    try:
        seconds, _ = await begun(call, begin, enable_for_move)
    except BaseException:
        made.end()
        raise
    call.bridge.end_jogs(call.place, made)
    await made.begin()
    return begun_values(call, await call.bridge.status(call.place), seconds)


async def hold(call: Call) -> Values:
    found = call.bridge.jog(call.client, call.place)
    if found is None:
        raise BadRequest(
            "no_jog",
            "this client does not jog the axis, or its jog has ended",
            "begin with POST …/jog",
            HTTPStatus.CONFLICT,
        )
    found.hold()
    return {"time_s": call.bridge.gateway.time}


async def home(call: Call) -> Values:
    def begin(axis: Axis) -> None:
        if "method" in call.given:
            axis.set_parameter("home_method", call.given["method"])
        axis.request("home")

    return await motion(call, begin, Axis.enable)


# ------------------------------------------------------------------ scope and signal


async def arm_scope(call: Call) -> Values:
    await recording.arm(call.bridge, call.client, call.place, call.given, recording.SCOPE)
    return await scope(call)


async def scope(call: Call) -> Values:
    return recording.progress_values(call.bridge, call.place, recording.SCOPE)


async def give_up_scope(call: Call) -> Values:
    recording.give_up(call.bridge, call.client, call.place, recording.SCOPE)
    return await scope(call)


async def scope_record(call: Call) -> Values:
    return recording.record_values(call.bridge, call.place)


async def record_ticks(call: Call) -> Values:
    await recording.arm(call.bridge, call.client, call.place, call.given, recording.TICKS)
    return await ticks(call)


async def ticks(call: Call) -> Values:
    return recording.progress_values(call.bridge, call.place, recording.TICKS)


async def give_up_ticks(call: Call) -> Values:
    recording.give_up(call.bridge, call.client, call.place, recording.TICKS)
    return await ticks(call)


async def ticks_record(call: Call) -> Values:
    return recording.tick_values(call.bridge, call.place, max(0, call.given.get("first", 0)))


async def tick_recorder(call: Call) -> Values:
    return await recording.recorder_values(call.bridge, call.place)


async def signal(call: Call) -> Values:
    count, fresh = call.given.get("samples", lissajous.AT_FIRST), call.given.get("fresh", False)
    return await lissajous.measured(call.bridge, call.client, call.place, count, fresh)


async def begin_calibration(call: Call) -> Values:
    await calibrating.begin(call.bridge, call.client, call.place, call.given)
    return await calibration(call)


async def calibration(call: Call) -> Values:
    return await calibrating.values_of(call.bridge, call.client, call.place)


async def segments(call: Call) -> Values:
    def read(axis: Axis) -> tuple[str, SegmentTable | None]:
        status = Segments(axis).status()
        return status.words(), Segments(axis).read() if status.loaded > 1 else None

    words, table = await call.command(read, "long")
    errors = table.errors if table else ()
    return {
        "words": words,
        "border_nm": [float(table.first + n * table.length) for n in range(len(errors))]
        if table
        else [],
        "error_nm": [float(error) for error in errors],
    }


# ------------------------------------------------------------------ parameters


async def parameters(call: Call) -> Values:
    return await of_parameters(call, lambda axis: [*axis.parameters().values()])


async def set_parameters(call: Call) -> Values:
    return await of_parameters(call, lambda axis: [*axis.load_parameters(call.given).values()])


async def of_parameters(call: Call, work: Callable[[Axis], list[ParameterValue]]) -> Values:
    return {
        "parameters": await call.command(
            lambda axis: [parameter_values(call, axis, value) for value in work(axis)], "long"
        )
    }


async def parameter(call: Call) -> Values:
    values: Values = await call.command(
        lambda axis: parameter_values(call, axis, axis.get_parameter(call.name))
    )
    return values


async def saved_parameters(call: Call) -> Values:
    return {"saved": await call.command(saved_texts, "long")}


def saved_texts(axis: Axis) -> dict[str, str]:
    """The parameters after the next power-up as they are written, by name."""
    counts = SavedSettings(axis.node).parameters(axis.number)
    period_nm = Fraction(counts["period"], 1000)
    return {
        name: axis.parameter_value(name, count, period_nm).written()
        for name, count in counts.items()
    }


async def set_parameter(call: Call) -> Values:
    values: Values = await call.command(
        lambda axis: parameter_values(
            call, axis, axis.set_parameter(call.name, call.given["value"])
        )
    )
    return values


def parameter_values(call: Call, axis: Axis, value: ParameterValue) -> Values:
    """A parameter, with its limits and its default as they are written, and whether it is as the
    machine file describes it.
    """
    described = call.bridge.description.at(*call.place).parameters.get(value.name)
    agrees = None
    if described is not None:
        agrees = axis.parameter_counts(value.name, described) == value.counts
    return {
        **value.values(),
        "group": group_of(value.name),
        "allowed": value.range_words,
        "default_written": value.default_written,
        "described": described,
        "as_described": agrees,
    }


# ------------------------------------------------------------------ the table

TYPES = {str: "text", bool: "flag", int: "whole number", float: "number"}
WORDS = {  # of what a status has beside the fields of its own class
    "address": ("whole number", "address of the node"),
    "axis": ("whole number", "number of the axis"),
    "time_s": ("number", "time of the bus at which the status was read"),
    "speed": ("number or null", "simulated seconds per second; null where time is no simulation"),
    "moved_by": ("text or null", "the client to which the axis belongs while it moves"),
    "words": ("text", "the state in words"),
    "fault_words": ("text", "the faults in words"),
    "ended_words": ("text", "how the last motion ended"),
    "to_do": ("text", "what to do about the first fault; then clear it. Empty without a fault"),
}
STATUS = WORDS | {
    one.name: (TYPES.get(one.type, "list of texts"), one.name.replace("_", " "))  # type: ignore[arg-type]
    for one in fields(Status)
}
MOTION = STATUS | {
    "duration_s": ("number or null", "time of the motion at full speed, where it is known before"),
    "error_nm": ("number or null", "target minus position at the end; null if not waited for"),
}
NODE = {
    "address": ("whole number", "address of the node"),
    "axes": ("list of texts", "its axes, as node.axis"),
    "version": ("whole number", "version of its firmware"),
    "clk_hz": ("number", "its clock"),
    "tick_hz": ("number", "its servo tick"),
}
PARAMETER = {
    "name": ("text", "name of the parameter"),
    "value": ("number", "value in `unit`"),
    "unit": ("text", "unit; empty for a plain number"),
    "written": ("text", "exact value as it is set, with its unit or as the name of a choice"),
    "minimum": ("number", "smallest value in `unit`"),
    "maximum": ("number", "largest value in `unit`"),
    "default": ("number", "value after power-up, unless the node has saved another one"),
    "text": ("text", "purpose"),
    "group": ("text", "what it belongs to, such as servo"),
    "allowed": ("text", "the limits with their unit, or the names of the choices"),
    "default_written": ("text", "the default, written as `written` is"),
    "described": ("text or null", "its value in the machine file of the server"),
    "as_described": ("flag or null", "whether it has that value"),
}
JOB = {
    "built": ("flag", "whether the node is one of a station"),
    "state": ("text or null", "state of the job"),
    "words": ("text or null", "the state in words, with the number of the station"),
    "cause_words": ("text or null", "why it waits, or did not continue"),
    "station": ("whole number or null", "the station, from 0 on"),
    "stations": ("whole number or null", "how many there are"),
    "answers": ("list of texts or null", "the actions that it accepts now"),
}
CALIBRATION = {
    "state": ("text", "none, running, done or ended"),
    "words": ("text", "what it does, or why it has ended"),
    "strokes": ("whole number", "strokes made"),
    "accepted": ("whole number", "measurements that were used"),
    "refused": ("whole number", "measurements that were not good enough"),
    "scatter_nm": ("number or null", "standard error of the last measurement"),
    "orders": ("list of numbers", "orders of the harmonics"),
    "before_nm": ("list of numbers", "their amplitudes that were corrected before"),
    "now_nm": ("list of numbers", "their amplitudes that are corrected now"),
}
NUMBER = ("whole number", "number of the record; no other one of this server has it")
SCOPE = {
    "number": NUMBER,
    "state": (
        "text",
        "empty, waiting (for the trigger), recording, reading, full, or ended without a record",
    ),
    "words": ("text", "the state in words, and why a record has ended"),
    "axis": ("text or null", "the axis whose record it is, as node.axis"),
    "trigger": ("text or null", "its trigger"),
    "owner": ("text or null", "the client to which the recorder belongs until then"),
    "done": ("whole number", "samples that the server has read"),
    "samples": ("whole number", "samples that it will read"),
}
AGE = Given(
    "max_age",
    "time",
    f"how old the answer may be, in time of the bus; {1000 * FRESH_S:g} ms if not given, 0s for an "
    "exchange of its own",
    "0s",
)
WAIT = Given("wait", "flag", "whether to answer at the end of the motion; true if not given", False)
TAKE = Given("take", "flag", "whether to stop another client's motion of this axis first", True)
LENGTH = "a length with its unit"

OPERATIONS = (
    Operation(
        "GET",
        "/api",
        "The server, the speed of a simulated machine, and who is there.",
        server,
        {
            "version": ("text", "version of the server"),
            "time_s": ("number", "time of the bus"),
            "speed": WORDS["speed"],
            "clients": ("list of texts", "clients of HTTP and WebSocket"),
            "packet_clients": ("whole number", "clients of TCP, RFC 2217 and the pseudo terminal"),
            "moved_by": ("map of texts", "by node.axis: the client that moved it last"),
            "may_change": ("flag", "false if the token of the request only reads"),
            "machine": ("text", "the machine in words, from its description"),
            "names": ("map of texts", "by node.axis: the name of the axis in the description"),
        },
    ),
    Operation(
        "GET",
        "/api/bus",
        "What this server has met on the bus since its start, and who asks it.",
        bus,
        {
            "time_s": ("number", "time of the bus"),
            "exchanges": ("whole number", "requests to nodes"),
            "repeats": ("whole number", "requests that were sent once more"),
            "no_answer": ("whole number", "attempts without an answer, also of absent nodes"),
            "garbled": ("whole number", "answers that were damaged"),
            "old_reply": ("whole number", "answers to the request before"),
            "no_request": ("whole number", "packets of clients that were no request"),
            "waiting": ("whole number", "requests that wait for the bus now"),
            "clients": ("list of texts", "all clients that are connected"),
        },
    ),
    Operation("GET", "/api/nodes", "The nodes that answer.", nodes, {"nodes": ("list", "nodes")}),
    Operation("GET", "/api/nodes/{node}", "A node.", node, NODE),
    Operation(
        "GET",
        "/api/nodes/{node}/job",
        "How far the job of a station is (S4).",
        job,
        JOB,
    ),
    Operation(
        "POST",
        "/api/nodes/{node}/job",
        "Begin, pause, resume or stop the job of a station, or answer it.",
        do_job,
        JOB,
        given=(Given("action", "text", f"one of {', '.join(ACTIONS)}", "start", required=True),),
    ),
    Operation("GET", AXIS, "State, position and faults of an axis.", status, STATUS, given=(AGE,)),
    Operation(
        "GET",
        f"{AXIS}/position",
        "The position of an axis, in the shortest answer.",
        position,
        {"time_s": WORDS["time_s"], "position_nm": ("number", "position")},
        given=(AGE,),
    ),
    Operation(
        "GET",
        f"{AXIS}/faults",
        "The latched faults, with their meaning and what to do.",
        faults,
        {
            "faults": ("list", "name, words, whether it came first, and what to do"),
            "position_nm": ("number or null", "where the axis was when the first fault came"),
            "encoder_events": ("list of texts", "what the encoder has reported"),
            "home_again": ("flag", "whether the axis has lost its zero"),
        },
    ),
    Operation(
        "POST",
        f"{AXIS}/stop",
        "Stop under control, ahead of all other requests, whoever moves the axis. The drive stays "
        "on.",
        stop,
        STATUS,
        urgent=True,
    ),
    Operation(
        "POST",
        f"{AXIS}/disable",
        "Switch the drive off at once, whoever has switched it on.",
        disable,
        STATUS,
        urgent=True,
    ),
    Operation("POST", f"{AXIS}/enable", "Switch the drive on.", enable, STATUS),
    Operation(
        "POST",
        f"{AXIS}/home",
        "Find the zero. The drive is switched on if it is off.",
        home,
        MOTION,
        given=(
            Given("method", "value", "a number of CiA 402, s0 or s3; stored in home_method", "35"),
            WAIT,
            TAKE,
        ),
    ),
    Operation(
        "POST",
        f"{AXIS}/move",
        "Move to a position, or by a distance. The drive is switched on if it is off.",
        move,
        MOTION,
        given=(
            Given("to", "length", f"the target, {LENGTH}", "1.5 mm"),
            Given("by", "length", f"the distance from the present target, {LENGTH}", "-50 um"),
            WAIT,
            TAKE,
        ),
    ),
    Operation(
        "POST",
        f"{AXIS}/jog",
        f"Move by a distance or to the end of the travel, as long as the same client asks for "
        f".../hold: {1000 * HOLD_S:g} ms after the last of these requests, of the clock, the axis "
        "is stopped under control. The drive is switched on if it is off.",
        jog,
        MOTION,
        given=(
            Given("by", "length", f"the largest distance, {LENGTH}", "-100 mm", required=True),
            TAKE,
        ),
    ),
    Operation(
        "POST",
        f"{AXIS}/hold",
        "Go on with the jog of this client. Refused when the jog has ended, for whatever reason: "
        "this request never begins a motion.",
        hold,
        {"time_s": ("number", "time of the bus")},
    ),
    Operation(
        "POST",
        f"{AXIS}/take",
        "Take the axis over from another client: it is stopped under control, and belongs to the "
        "one who asks.",
        take,
        STATUS,
    ),
    Operation("POST", f"{AXIS}/clear", "Clear the faults whose cause is gone.", clear, STATUS),
    Operation(
        "POST",
        f"{AXIS}/scope",
        f"Record up to {SAMPLES} samples of position, error and drive command, some of them from "
        "before a trigger. The scope of the node then belongs to the client until the record is "
        "complete. GET says how far it is.",
        arm_scope,
        SCOPE,
        given=(
            Given("trigger", "text", f"{', '.join(TRIGGERS)}; now if not given", "motion"),
            Given("before", "whole number", "samples before the trigger; 0 if not given", 20),
            Given("samples", "whole number", f"samples to read; {SAMPLES} if not given", SAMPLES),
            Given("every", "time", "time from sample to sample; 1ms if not given", "1ms"),
            Given("level", "length", "error that triggers, with the trigger error", "1 um"),
            Given("take", "flag", "whether to take the scope over from another client", True),
        ),
    ),
    Operation("GET", f"{AXIS}/scope", "How far the record of the node is.", scope, SCOPE),
    Operation(
        "DELETE",
        f"{AXIS}/scope",
        "Wait no more for the record of this client. The scope is free then.",
        give_up_scope,
        SCOPE,
    ),
    Operation(
        "GET",
        f"{AXIS}/scope/record",
        "The last complete record of an axis, its amplitude spectra, and the file that 'moire "
        "scope read' writes.",
        scope_record,
        {
            "number": NUMBER,
            "trigger": ("text", "its trigger"),
            "before": ("whole number", "samples before the trigger"),
            "time_s": ("list of numbers", "times of the samples; 0 is the trigger"),
            "position_nm": ("list of numbers", "positions"),
            "error_nm": ("list of numbers", "target minus position"),
            "drive_command": ("list of numbers", "commands, of full scale"),
            "window": ("text", "window of the spectra"),
            "frequency_hz": ("list of numbers", "frequencies of the spectra"),
            "spectrum": ("map of lists", "amplitudes (peak) by the names of the signals above"),
            "csv": ("text", "the record as CSV"),
        },
    ),
    Operation(
        "POST",
        f"{AXIS}/ticks",
        "Record signals of this axis, and of others of its node, at each servo tick with the "
        "recorder of ticks; with a duration it is a stream without a gap, which begins at once. It "
        "then belongs to the client until the record is complete. GET says how far it is.",
        record_ticks,
        SCOPE,
        given=(
            Given(
                "signals",
                "text",
                f"signals with commas between, as 1.error of axis 1; {recording.TICK_DEFAULT} if "
                "not given",
                "error,command",
            ),
            Given("samples", "whole number", "samples; as many as fit if not given", 1000),
            Given("every", "time", "time from sample to sample; a servo tick if not given", "1ms"),
            Given("trigger", "text", f"{', '.join(TICK_KINDS)}; now if not given", "rises"),
            Given("of", "text", "signal of the trigger; error if not given", "error"),
            Given("level", "text", "level of the trigger with the unit of its signal", "1 um"),
            Given("before", "whole number", "samples before the trigger; 0 if not given", 20),
            Given("delay", "time", "time from the trigger to the first sample", "5ms"),
            Given("duration", "time", "duration of a stream", "10s"),
            Given("take", "flag", "whether to take it over from another client", True),
        ),
    ),
    Operation("GET", f"{AXIS}/ticks", "How far the record of ticks of the node is.", ticks, SCOPE),
    Operation(
        "DELETE",
        f"{AXIS}/ticks",
        "Wait no more for the record of ticks of this client: the recorder is free then. A stream "
        "ends with what there is of it.",
        give_up_ticks,
        SCOPE,
    ),
    Operation(
        "GET",
        f"{AXIS}/ticks/record",
        "The last complete record of ticks of an axis, its amplitude spectra, and the file that "
        "'moire scope save' writes; of a stream that goes on, what there is of it.",
        ticks_record,
        {
            "number": NUMBER,
            "trigger": ("text", "its trigger"),
            "before": ("whole number", "samples before the trigger"),
            "first": ("whole number", "number of the first sample in this answer"),
            "time_s": ("list of numbers", "times of the samples; 0 is the trigger"),
            "columns": ("map of lists", "values of the signals; the names end in their units"),
            "window": ("text", "window of the spectra"),
            "frequency_hz": ("list of numbers", "frequencies of the spectra of a complete record"),
            "spectrum": ("map of lists", "amplitudes (peak) by the names of the columns"),
            "csv": ("text", "the complete record as CSV"),
        },
        given=(Given("first", "whole number", "number of the first sample; 0 if not given", 100),),
    ),
    Operation(
        "GET",
        f"{AXIS}/ticks/recorder",
        "What the recorder of ticks of the node of an axis can record.",
        tick_recorder,
        {
            "words": ("whole number", "its memory: samples times signals; 0 if there is none"),
            "tick_s": ("number", "time from servo tick to servo tick"),
            "axes": ("whole number", "axes of the node"),
            "channels": ("whole number", "signals that a record has at most"),
            "signals": ("map of texts", "names of the signals, and what they are"),
            "triggers": ("map of texts", "names of the triggers, and what they are"),
            "stream_words": ("whole number", "words of a stream at most: samples times signals"),
        },
    ),
    Operation(
        "GET",
        f"{AXIS}/signal",
        "Sine and cosine of an axis: takes samples, adds them to those that this client has taken "
        f"before (at most {lissajous.KEPT} are kept), and fits an ellipse to all. The axis has to "
        "move by some signal periods meanwhile; equal samples in a row count once.",
        signal,
        {
            "cos": ("list of numbers", "samples of the cosine, ADC counts"),
            "sin": ("list of numbers", "samples of the sine, ADC counts"),
            "amplitude": ("list of numbers", "amplitude at each sample, ADC counts"),
            "position_nm": ("list of numbers", "position soon after each sample"),
            "limits": ("list of numbers", "smallest and largest good amplitude, if they are set"),
            "ellipse": (
                "map of numbers or null",
                "offsets, amplitudes and deviation (rms) in ADC counts, quadrature_error_deg; null "
                "where the samples determine none",
            ),
            "curve": ("map of lists", "points of the ellipse: cos, sin"),
            "verdict": ("text", "good, weak, large, saturated or unknown"),
            "words": ("text", "the amplitude in words"),
            "to_do": ("text", "what to do about it; empty if nothing is to be done"),
        },
        given=(
            Given("samples", "whole number", f"how many to take, 1 to {lissajous.MOST}", 32),
            Given("fresh", "flag", "whether to forget the earlier samples first", True),
        ),
    ),
    Operation(
        "POST",
        f"{AXIS}/calibration",
        "Calibrate sine and cosine from scratch, as 'moire calibrate' does: the axis moves to and "
        "fro until the correction is complete. GET says how far it is; a stop of the axis ends it.",
        begin_calibration,
        CALIBRATION,
        given=(
            Given("distance", "length", f"how far it moves, {LENGTH}; 1mm if not given", "1 mm"),
            Given("timeout", "time", "after which it gives up; 120s if not given", "120s"),
        ),
    ),
    Operation(
        "GET",
        f"{AXIS}/calibration",
        "How far the calibration is, and the harmonics that are corrected.",
        calibration,
        CALIBRATION,
    ),
    Operation(
        "GET",
        f"{AXIS}/segments",
        "The segment table of an axis: the error of its scale over the position.",
        segments,
        {
            "words": ("text", "whether the table is in force, and why not"),
            "border_nm": ("list of numbers", "positions of the borders; empty without a table"),
            "error_nm": ("list of numbers", "errors of the scale there"),
        },
    ),
    Operation(
        "GET",
        f"{AXIS}/parameters",
        "All parameters of an axis.",
        parameters,
        {"parameters": ("list", "parameters")},
    ),
    Operation(
        "PATCH",
        f"{AXIS}/parameters",
        "Set several parameters by their names; all are checked before the first is set.",
        set_parameters,
        {"parameters": ("list", "parameters")},
        given=tuple(
            Given(known.name, "value", known.text, known.name) for known in PARAMETERS.values()
        ),
    ),
    Operation(
        "GET",
        f"{AXIS}/saved",
        "What the parameters of an axis will be after the next power-up: what the node has saved.",
        saved_parameters,
        {"saved": ("map of texts", "exact values by name, written as `written` of a parameter is")},
    ),
    Operation("GET", f"{AXIS}/parameters/{{name}}", "One parameter.", parameter, PARAMETER),
    Operation(
        "PUT",
        f"{AXIS}/parameters/{{name}}",
        "Set one parameter.",
        set_parameter,
        PARAMETER,
        given=(Given("value", "value", "the value with its unit, if it has one", "5 mm/s", True),),
    ),
)


PATTERNS = tuple(
    (re.compile(re.sub(r"{(\w+)}", r"(?P<\1>[^/]+)", operation.path)), operation)
    for operation in OPERATIONS
)


def find(
    method: str, path: str
) -> tuple[tuple[Operation, Mapping[str, str]] | None, tuple[str, ...]]:
    """(operation and what the path names, None if there is none; the methods of the path)"""
    matches = [
        (operation, found)
        for pattern, operation in PATTERNS
        if (found := pattern.fullmatch(path)) is not None
    ]
    methods = tuple(operation.method for operation, _ in matches)
    for operation, found in matches:
        if operation.method == method:
            return (operation, found.groupdict()), methods
    return None, methods


def whole_number(text: str, what: str) -> int:
    """A part of a path; raises BadRequest."""
    if not text.isascii() or not text.isdigit() or len(text) > 3:
        raise BadRequest(
            "no_such_path",
            f"'{text[:20]}' is no number of {what}",
            "write a path such as /api/nodes/1/axes/0",
            HTTPStatus.NOT_FOUND,
        )
    return int(text)
