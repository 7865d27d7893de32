# SPDX-License-Identifier: Apache-2.0
"""The commands about the recorders in a node: scope arm, read, show; scope record, save."""

from dataclasses import asdict
from fractions import Fraction

import click

from moire import units
from moire.analysis.scope import SAMPLES, TRIGGERS, Scope
from moire.cli.files import write_bytes
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import DURATION, FILE, LENGTH, POSITIVE, TIME, WHOLE, Name
from moire.made.bus_tables import SCOPE_STATES, TICK_SIGNALS

EXAMPLE = (
    "moire --port twin home -- scope arm --trigger motion -- move 100um -- scope read move.csv"
)

group = Group(
    "scope",
    help="Record signals of an axis. `arm` and `read` are for every node: 128 samples of position, "
    "error and command around a trigger. `record` and `save` need SCOPE_WORDS of rtl/node.sv: they "
    "record chosen signals at each servo tick, evenly, thousands of samples.",
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
@click.option(
    "--timeout",
    type=TIME,
    default="10s",
    metavar="TIME",
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


SIGNALS = ",".join(name for name, _ in TICK_SIGNALS.values())


@group.command(
    "record",
    help="Record signals of an axis at each servo tick from now on, or at one in some; return at "
    "once.",
    example="moire --port twin home -- scope record -- move 100um -- scope save move.csv",
)
@click.option(
    "--signals",
    default="target,error,command",
    metavar=SIGNALS,
    help="What is recorded, with commas between. target and error together also give the position. "
    "The default is target,error,command.",
)
@click.option(
    "--samples",
    type=POSITIVE,
    metavar="N",
    help="The number of samples. The default is as many as fit.",
)
@click.option(
    "--every",
    type=DURATION,
    metavar="TIME",
    help="The time from sample to sample. The default is the servo tick.",
)
def record(call: Call, signals: str, samples: int | None, every: Fraction | None) -> None:
    """The recording goes on in the node."""
    from moire.analysis.tick_scope import TickScope  # NumPy only where it is needed

    scope = TickScope(call.axis)
    scope.start([name.strip() for name in signals.split(",") if name.strip()], samples, every)
    setting = scope.setting()
    seconds = Fraction(setting.samples * setting.every, call.node.identity.tick_hz)
    call.say_of_axis(
        {"signals": setting.signals, "samples": setting.samples, "every_ticks": setting.every},
        f"{call.where}: {setting.samples} samples of {', '.join(setting.signals)} in "
        f"{units.format_time(seconds)}",
    )


@group.command(
    "save",
    help="Wait until that recording is complete, then write it.",
    example="moire scope save move.csv --picture move.png",
)
@click.argument(
    "file",
    type=FILE,
    metavar="FILE",
    help="The names of the columns end in their units. A name that ends in .parquet gives Parquet, "
    "any other one CSV.",
)
@click.option("--picture", type=FILE, metavar="PNG", help="Draw the signals over time.")
def save(call: Call, file: str, picture: str | None) -> None:
    """The samples are those of equally spaced ticks."""
    from moire.analysis.tick_scope import TickScope

    made = TickScope(call.axis).read()
    write_bytes(file, made.parquet() if file.endswith(".parquet") else made.csv().encode())
    if picture:
        write_bytes(picture, made.picture())
    call.say_of_axis(
        {"file": file, **{name: list(values) for name, values in made.columns().items()}},
        f"{len(made.time_s)} samples of {', '.join(made.values)} in {file}",
    )
