# SPDX-License-Identifier: Apache-2.0
"""The commands `moire scope …`. The command line adds them to its parser."""

from dataclasses import asdict

from moire import units
from moire.analysis.scope import SAMPLES, TRIGGERS, Scope
from moire.made.bus_tables import SCOPE_STATES


def add_to(group, command, checked, write_bytes):
    """group: the sub-parsers of `scope`; command(name, handler, text, example, under): makes one of
    them.
    """
    arm = command(
        "arm",
        do_arm,
        f"record {SAMPLES} samples of position, error and command of an axis, some from before a trigger",
        "moire --port twin home -- scope arm --trigger motion -- move 100um -- scope read move.csv --picture move.png",
        group,
    )
    arm.add_argument("--trigger", choices=TRIGGERS, default="now", help="now unless given")
    arm.add_argument(
        "--before",
        type=int,
        default=0,
        metavar="N",
        help="samples kept from before the trigger; 0 unless given",
    )
    arm.add_argument(
        "--every",
        type=checked(units.parse_time),
        default="1ms",
        metavar="TIME",
        help="from sample to sample; 1ms unless given",
    )
    arm.add_argument(
        "--level",
        type=checked(units.parse_length),
        default="0nm",
        metavar="LENGTH",
        help="of the error, for the trigger error",
    )
    read = command(
        "read",
        do_read,
        "wait for the record, then write it as CSV, and as a picture",
        "moire scope read move.csv",
        group,
    )
    read.add_argument(
        "file", metavar="FILE", help="CSV: time_s, position_nm, error_nm, command of full scale"
    )
    read.add_argument("--picture", metavar="PNG", help="position, error and command over time")
    read.add_argument(
        "--timeout",
        type=checked(units.parse_time),
        default="10s",
        metavar="TIME",
        help="given up after this; 10s unless given",
    )
    read.set_defaults(write_bytes=write_bytes)
    command("show", do_show, "how far the record is", "moire --port /dev/ttyUSB0 scope show", group)


def node_and_axis(command) -> dict:
    return {
        "command": command.command,
        "action": command.action,
        "address": command.address,
        "axis": command.axis,
    }


def do_arm(session, command):
    Scope(session.axis(command)).arm(command.trigger, command.before, command.every, command.level)
    session.say(
        {**node_and_axis(command), "trigger": command.trigger},
        f"node {command.address} axis {command.axis}: armed, trigger {command.trigger}",
    )


def do_read(session, command):
    record = Scope(session.axis(command)).wait(command.timeout)
    command.write_bytes(command.file, record.csv().encode())
    if command.picture:
        command.write_bytes(command.picture, record.picture())
    session.say(
        {**node_and_axis(command), "file": command.file, **asdict(record)},
        f"{len(record.time_s)} samples from {units.format_time(record.time_s[0])} to {units.format_time(record.time_s[-1])} "
        f"in {command.file}",
    )


def do_show(session, command):
    state = Scope(session.axis(command)).state()
    session.say(
        {**node_and_axis(command), "state": state},
        f"node {command.address}: {dict(SCOPE_STATES.values()).get(state, state)}",
    )
