# SPDX-License-Identifier: Apache-2.0
"""The commands about the recorders in a node: scope arm, read, show; record, save, stream."""

from __future__ import annotations

from dataclasses import asdict
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING

import click

from moire import units
from moire.analysis.scope import SAMPLES, TRIGGERS, Scope
from moire.cli.files import write_bytes
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import DURATION, FILE, LENGTH, POSITIVE, TEXT, TIME, WHOLE, Name
from moire.errors import OutOfRange
from moire.made.bus_tables import OPERATIONS, SCOPE_STATES, TICK_SIGNALS, TICK_TRIGGERS

if TYPE_CHECKING:
    from moire.analysis.tick_scope import TickRecord

TIMEOUT = partial(click.option, "--timeout", type=TIME, default="10s", metavar="TIME")
EXAMPLE = (
    "moire --port twin home -- scope arm --trigger motion -- move 100um -- scope read move.csv"
)

group = Group(
    "scope",
    help="Record signals of an axis. `arm` and `read` are for every node: 128 samples of position, "
    "error and command around a trigger. `record`, `save` and `stream` need SCOPE_WORDS of "
    "rtl/node.sv: they record up to 8 chosen signals, also of several axes of a node, at each "
    "servo tick, evenly, thousands of samples or without end.",
    example=EXAMPLE,
)
moire.add_command(group)


@group.command(
    "arm",
    help=f"Record {SAMPLES} samples of position, error and drive command of an axis, some of them "
    "from before a trigger.",
    example=f"{EXAMPLE} --picture move.png",
)
@click.option(
    "--trigger",
    type=Name("trigger", TRIGGERS),
    default="now",
    metavar=",".join(TRIGGERS),
    help="What starts the recording. The default is now.",
)
@click.option(
    "--before",
    type=WHOLE,
    default=0,
    metavar="N",
    help="The number of samples from before the trigger. The default is 0.",
)
@click.option(
    "--every",
    type=TIME,
    default="1ms",
    metavar="TIME",
    help="The time from sample to sample. The default is 1ms.",
)
@click.option(
    "--level",
    type=LENGTH,
    default="0nm",
    metavar="LENGTH",
    help="The error that triggers, with '--trigger error'.",
)
def arm(call: Call, trigger: str, before: int, every: Fraction, level: Fraction) -> None:
    """Returns at once."""
    Scope(call.axis).arm(trigger, before, every, level)
    call.say_of_axis({"trigger": trigger}, f"{call.where}: armed, trigger {trigger}")


@group.command(
    "read",
    help="Wait until the recording is complete, then write it as CSV and as a picture.",
    example="moire scope read move.csv",
)
@click.argument(
    "file",
    type=FILE,
    metavar="FILE",
    help="CSV with the columns time_s, position_nm, error_nm and command (a share of full scale).",
)
@click.option(
    "--picture",
    type=FILE,
    metavar="PNG",
    help="Draw position, error and drive command over time.",
)
@TIMEOUT(
    help="The command gives up after this time. The default is 10s.",
)
def read(call: Call, file: str, picture: str | None, timeout: Fraction) -> None:
    """The samples have the times at which the node took them."""
    record = Scope(call.axis).wait(timeout)
    write_bytes(file, record.csv().encode())
    if picture:
        write_bytes(picture, record.picture())
    values = asdict(record)
    values["drive_command"] = values.pop("command")
    first, last = units.format_time(record.time_s[0]), units.format_time(record.time_s[-1])
    call.say_of_axis(
        {"file": file, **values}, f"{len(record.time_s)} samples from {first} to {last} in {file}"
    )


@group.command(
    "show",
    help="Show the state of the recording.",
    example="moire --port /dev/ttyUSB0 scope show",
)
def show(call: Call) -> None:
    """Reads no samples."""
    state = Scope(call.axis).state()
    words = dict(SCOPE_STATES.values()).get(state, state)
    call.say_of_axis({"state": state}, f"node {call.options.address}: {words}")


SIGNALS = [name for name, _ in TICK_SIGNALS.values()]
KINDS = [name for name, _ in TICK_TRIGGERS.values()]
CHANNELS = sum(name.startswith("channel_") for name, _ in OPERATIONS["record_ticks"].request)
SIGNAL = Name("signal", SIGNALS)
WHAT = click.option(
    "--signals",
    default="target,error,command",
    metavar=",".join(SIGNALS),
    help=f"What is recorded, with commas between, {CHANNELS} signals at most. A signal of another "
    "axis of the node has its name or number before it, as in y.error or 1.error. target and error "
    "together also give the position. The default is target,error,command.",
)
EVERY = click.option(
    "--every",
    type=DURATION,
    metavar="TIME",
    help="The time from sample to sample. The default is the servo tick.",
)
PICTURE = click.option("--picture", type=FILE, metavar="PNG", help="Draw the signals over time.")
COLUMNS = (
    "The names of the columns end in their units. A name that ends in .parquet gives Parquet, any "
    "other one CSV."
)


def names(call: Call, signals: str) -> list[str]:
    """The signals in a text with commas between, with numbers for the names of axes; raises
    UnknownName, or OutOfRange for an axis of another node.
    """
    return [numbered(call, name.strip()) for name in signals.split(",") if name.strip()]


def numbered(call: Call, name: str) -> str:
    """A signal with the number of its axis before it, where it has the name of an axis."""
    axis, dot, signal = name.rpartition(".")
    if not dot or axis.isdecimal():
        return name
    node, number = call.session.description.axis(axis).place
    if node != call.options.address:
        raise OutOfRange(
            f"axis {axis} is of node {node}: the signals of a recording are of one node, here of "
            f"node {call.options.address}"
        )
    return f"{number}.{signal}"


def write(call: Call, file: str, made: TickRecord, picture: str | None, more: str = "") -> None:
    """Writes a recording, and says so."""
    write_bytes(file, made.parquet() if file.endswith(".parquet") else made.csv().encode())
    if picture:
        write_bytes(picture, made.picture())
    call.say_of_axis(
        {"file": file, **{name: list(values) for name, values in made.columns().items()}},
        f"{len(made.time_s)} samples of {', '.join(made.values)} in {file}{more}",
    )


@group.command(
    "record",
    check=lambda given: (
        "--before and --delay do not go together: the first sample is before the trigger or after"
        if given["before"] and given["delay"] is not None
        else None
    ),
    help="Record signals at each servo tick, or at one in some, from now on or from a "
    "trigger on; return at once.",
    example="moire --port twin home -- scope record --trigger beyond --of target_velocity "
    "--level 4mm/s --before 100 -- move 100um -- scope save move.csv",
)
@WHAT
@click.option(
    "--samples",
    type=POSITIVE,
    metavar="N",
    help="The number of samples. The default is as many as fit.",
)
@EVERY
@click.option(
    "--trigger",
    type=Name("trigger", KINDS),
    default="now",
    metavar=",".join(KINDS),
    help="What starts the recording: the signal of --of rises to the level, falls below it, is "
    "beyond it in either direction, or has one of its bits. The default is now.",
)
@click.option(
    "--of",
    type=SIGNAL,
    default="error",
    metavar="SIGNAL",
    help="The signal of the trigger. It need not be recorded. The default is error.",
)
@click.option(
    "--level",
    type=TEXT,
    metavar="VALUE",
    help="The level of the trigger with a unit of its signal: a length, a speed, a share of full "
    "scale such as 20%, or a number. The default is 0, and for bits any bit.",
)
@click.option(
    "--before",
    type=WHOLE,
    default=0,
    metavar="N",
    help="The number of samples from before the trigger, which counts once there are so many. The "
    "default is 0.",
)
@click.option(
    "--delay",
    type=DURATION,
    metavar="TIME",
    help="The time from the trigger to the first sample, instead of --before.",
)
def record(
    call: Call,
    signals: str,
    samples: int | None,
    every: Fraction | None,
    trigger: str,
    of: str,
    level: str | None,
    before: int,
    delay: Fraction | None,
) -> None:
    """The recording goes on in the node."""
    from moire.analysis.tick_scope import TickScope, Trigger  # NumPy only where it is needed

    scope = TickScope(call.axis)
    late = round((delay or 0) * call.node.identity.tick_hz)
    scope.start(names(call, signals), samples, every, Trigger(trigger, of, level, before, late))
    setting = scope.setting()
    seconds = Fraction(setting.samples * setting.every, call.node.identity.tick_hz)
    call.say_of_axis(
        {"signals": setting.signals, "samples": setting.samples, "every_ticks": setting.every},
        f"{call.where}: {setting.samples} samples of {', '.join(setting.signals)} in "
        f"{units.format_time(seconds)}"
        + ("" if trigger == "now" else f", {before} of them before the trigger")
        + ("" if delay is None else f", {units.format_time(delay)} after the trigger"),
    )


@group.command(
    "save",
    help="Wait until that recording is complete, then write it.",
    example="moire scope save move.csv --picture move.png",
)
@click.argument("file", type=FILE, metavar="FILE", help=f"Time 0 is the trigger. {COLUMNS}")
@PICTURE
@TIMEOUT(
    help="The longest wait for the trigger, in the time of the node. The default is 10s.",
)
def save(call: Call, file: str, picture: str | None, timeout: Fraction) -> None:
    """The samples are those of equally spaced ticks."""
    from moire.analysis.tick_scope import TickScope

    write(call, file, TickScope(call.axis).read(timeout=timeout), picture)


@group.command(
    "stream",
    help="Record signals of an axis without a gap for some time, longer than fits into the memory "
    "of the node: it is read meanwhile. The bus limits the rate: if the memory becomes full, this "
    "is an error.",
    example="moire scope stream hour.parquet --signals error --every 10ms --time 1h",
)
@click.argument("file", type=FILE, metavar="FILE", help=COLUMNS)
@WHAT
@EVERY
@click.option(
    "--time",
    "duration",
    type=DURATION,
    default="10s",
    metavar="TIME",
    help="How long. The default is 10s.",
)
@PICTURE
def stream(
    call: Call,
    file: str,
    signals: str,
    every: Fraction | None,
    duration: Fraction,
    picture: str | None,
) -> None:
    """The drive stays as it is."""
    from moire.analysis.tick_scope import TickScope, joined

    scope, chosen = TickScope(call.axis), names(call, signals)
    made = joined(list(scope.stream(chosen, every, duration)))
    rate = len(scope.chosen(chosen)) / (made.every * made.tick_s)
    write(call, file, made, picture, f", {rate:.4g} words/s without a gap")
