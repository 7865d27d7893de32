# SPDX-License-Identifier: Apache-2.0
"""What the server can be asked for: one table of operations, with their functions. The routes of
the server and the OpenAPI document are made from it.
"""

import re
from collections.abc import Mapping
from dataclasses import fields

from moire.analysis.scope import SAMPLES, TRIGGERS
from moire.analysis.tick_scope import TRIGGERS as TICK_KINDS
from moire.client.job import ACTIONS
from moire.client.records import Status
from moire.made.bus_tables import PARAMETERS
from moire.web import handlers, lissajous, recording
from moire.web.jog import HOLD_S
from moire.web.operation import FRESH_S, Given, Operation

AXIS = "/api/nodes/{node}/axes/{axis}"
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
        handlers.server,
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
        handlers.bus,
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
    Operation(
        "GET", "/api/nodes", "The nodes that answer.", handlers.nodes, {"nodes": ("list", "nodes")}
    ),
    Operation("GET", "/api/nodes/{node}", "A node.", handlers.node, NODE),
    Operation(
        "GET",
        "/api/nodes/{node}/job",
        "How far the job of a station is (S4).",
        handlers.job,
        JOB,
    ),
    Operation(
        "POST",
        "/api/nodes/{node}/job",
        "Begin, pause, resume or stop the job of a station, or answer it.",
        handlers.do_job,
        JOB,
        given=(Given("action", "text", f"one of {', '.join(ACTIONS)}", "start", required=True),),
    ),
    Operation(
        "GET", AXIS, "State, position and faults of an axis.", handlers.status, STATUS, given=(AGE,)
    ),
    Operation(
        "GET",
        f"{AXIS}/position",
        "The position of an axis, in the shortest answer.",
        handlers.position,
        {"time_s": WORDS["time_s"], "position_nm": ("number", "position")},
        given=(AGE,),
    ),
    Operation(
        "GET",
        f"{AXIS}/faults",
        "The latched faults, with their meaning and what to do.",
        handlers.faults,
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
        handlers.stop,
        STATUS,
        urgent=True,
    ),
    Operation(
        "POST",
        f"{AXIS}/disable",
        "Switch the drive off at once, whoever has switched it on.",
        handlers.disable,
        STATUS,
        urgent=True,
    ),
    Operation("POST", f"{AXIS}/enable", "Switch the drive on.", handlers.enable, STATUS),
    Operation(
        "POST",
        f"{AXIS}/home",
        "Find the zero. The drive is switched on if it is off.",
        handlers.home,
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
        handlers.move,
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
        handlers.jog,
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
        handlers.hold,
        {"time_s": ("number", "time of the bus")},
    ),
    Operation(
        "POST",
        f"{AXIS}/take",
        "Take the axis over from another client: it is stopped under control, and belongs to the "
        "one who asks.",
        handlers.take,
        STATUS,
    ),
    Operation(
        "POST", f"{AXIS}/clear", "Clear the faults whose cause is gone.", handlers.clear, STATUS
    ),
    Operation(
        "POST",
        f"{AXIS}/scope",
        f"Record up to {SAMPLES} samples of position, error and drive command, some of them from "
        "before a trigger. The scope of the node then belongs to the client until the record is "
        "complete. GET says how far it is.",
        handlers.arm_scope,
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
    Operation("GET", f"{AXIS}/scope", "How far the record of the node is.", handlers.scope, SCOPE),
    Operation(
        "DELETE",
        f"{AXIS}/scope",
        "Wait no more for the record of this client. The scope is free then.",
        handlers.give_up_scope,
        SCOPE,
    ),
    Operation(
        "GET",
        f"{AXIS}/scope/record",
        "The last complete record of an axis, its amplitude spectra, and the file that 'moire "
        "scope read' writes.",
        handlers.scope_record,
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
        handlers.record_ticks,
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
    Operation(
        "GET", f"{AXIS}/ticks", "How far the record of ticks of the node is.", handlers.ticks, SCOPE
    ),
    Operation(
        "DELETE",
        f"{AXIS}/ticks",
        "Wait no more for the record of ticks of this client: the recorder is free then. A stream "
        "ends with what there is of it.",
        handlers.give_up_ticks,
        SCOPE,
    ),
    Operation(
        "GET",
        f"{AXIS}/ticks/record",
        "The last complete record of ticks of an axis, its amplitude spectra, and the file that "
        "'moire scope save' writes; of a stream that goes on, what there is of it.",
        handlers.ticks_record,
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
        handlers.tick_recorder,
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
        handlers.signal,
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
        handlers.begin_calibration,
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
        handlers.calibration,
        CALIBRATION,
    ),
    Operation(
        "GET",
        f"{AXIS}/segments",
        "The segment table of an axis: the error of its scale over the position.",
        handlers.segments,
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
        handlers.parameters,
        {"parameters": ("list", "parameters")},
    ),
    Operation(
        "PATCH",
        f"{AXIS}/parameters",
        "Set several parameters by their names; all are checked before the first is set.",
        handlers.set_parameters,
        {"parameters": ("list", "parameters")},
        given=tuple(
            Given(known.name, "value", known.text, known.name) for known in PARAMETERS.values()
        ),
    ),
    Operation(
        "GET",
        f"{AXIS}/saved",
        "What the parameters of an axis will be after the next power-up: what the node has saved.",
        handlers.saved_parameters,
        {"saved": ("map of texts", "exact values by name, written as `written` of a parameter is")},
    ),
    Operation(
        "GET", f"{AXIS}/parameters/{{name}}", "One parameter.", handlers.parameter, PARAMETER
    ),
    Operation(
        "PUT",
        f"{AXIS}/parameters/{{name}}",
        "Set one parameter.",
        handlers.set_parameter,
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
