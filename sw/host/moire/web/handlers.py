# SPDX-License-Identifier: Apache-2.0
"""What the server does for each operation of the table in api.py: one function each."""

import asyncio
from collections.abc import Callable
from dataclasses import asdict
from fractions import Fraction
from http import HTTPStatus
from importlib.metadata import version
from typing import TypeVar

from moire import units
from moire.bus.arbiter import Place
from moire.bus.protocol import ADDRESSES
from moire.client import remedies
from moire.client.access import COUNTS
from moire.client.axis import REACT_S, Axis
from moire.client.groups import group_of
from moire.client.job import ACTIONS, Job
from moire.client.names import descriptions
from moire.client.nonvolatile import SavedSettings
from moire.client.parameters import TRAVEL
from moire.client.records import Identity
from moire.client.segments import Segments, SegmentTable
from moire.client.values import ParameterValue
from moire.errors import MoireError, NoAnswer, Refused
from moire.made.bus_tables import FAULTS
from moire.web import calibrating, lissajous, recording
from moire.web.bridge import Bridge, Moment, was_stopped
from moire.web.operation import Call, Values
from moire.web.refusals import BadRequest

Result = TypeVar("Result")

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
