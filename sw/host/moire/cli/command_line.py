# SPDX-License-Identifier: Apache-2.0
"""The command `moire`: find nodes, home and move axes, read and set parameters, from a shell or a
file.
"""

import argparse
import json
import os
import queue
import re
import shlex
import sys
import threading
from dataclasses import asdict
from fractions import Fraction
from functools import cache, partial
from pathlib import Path

from moire import units
from moire.bus.protocol import ADDRESSES
from moire.bus.transport import BAUD, PARITIES, open_bus
from moire.cli import job as command_job
from moire.cli import nonvolatile as command_keep
from moire.cli import relay as command_relay
from moire.cli import replay as command_replay
from moire.cli import scope as command_scope
from moire.cli import segments as command_segments
from moire.cli import turn as command_index
from moire.cli import twin as command_twin
from moire.cli import watch as command_look
from moire.client.bus import Bus
from moire.client.capture import CAPTURE_SOURCES, capture_source
from moire.client.node import register_fields
from moire.client.segments import Segments
from moire.client.values import HOME_METHODS, whole
from moire.errors import BadFile, BusError, MoireError, OutOfRange, PortError, Refused, UnitError
from moire.made.bus_tables import PARAMETERS
from moire.made.registers import FIELDS

EXAMPLES = """\
several commands in one call, with -- between them:
  moire --port twin home -- move 1mm -- status
  moire --port /dev/ttyUSB0 reset -- home -- move 200um -- move -50nm --by

lengths are written with pm nm um mm cm m (1.5mm, 200um, 50nm), speeds as 5mm/s, times as 20ms.

--port twin is the built-in simulated stage, --port twin:s2 another machine (see: moire twin --help). It powers up afresh
in every call, so write all commands in one call, or use 'run FILE' or 'shell'. Options before or in the first command
hold for all that follow; --address and --axis may be given again in each.

a drive stays on only while somebody talks on the line. What a call switched on it switches off at its end.

exit codes: 0 done; 1 the node refused, or a motion ended badly; 2 wrong usage, value or file; 3 nobody answers, or the
line is garbled; 4 the port does not work; 5 node and host were made from different sources; 130 interrupted (Ctrl-C
stops a moving axis under control)
"""
DEFAULTS = dict(port=None, baud=BAUD, parity="auto", record=None, address=1, axis=0, json=False)
OF_THE_PORT = ("port", "baud", "parity", "record")
OF_THE_CALL = (*OF_THE_PORT, "json")
OF_AN_AXIS = ("axis.", "feedback.", "actuator.")  # registers
KEEP_ALIVE_S = 0.1
WITHOUT_SINE = "counts only: built without sine and cosine"
NOT_INSIDE = ("run", "shell", "twin")


class UsageError(MoireError):
    exit_code = 2


class Interrupted(MoireError):
    """Ctrl-C."""

    exit_code = 130


class Parser(argparse.ArgumentParser):
    """Complains in one sentence."""

    def error(self, message):
        raise UsageError(f"{message} (see: {self.prog} --help)")


# ------------------------------------------------------------------ arguments


def checked(parse):
    """A converter for argparse that keeps our sentence."""

    def convert(text):
        try:
            return parse(text)
        except MoireError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return convert


def address_number(text):
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number not in ADDRESSES:
        raise argparse.ArgumentTypeError(
            f"'{text.strip()}' is no address: allowed are {ADDRESSES[0]} to {ADDRESSES[-1]}"
        )
    return number


def positive_number(text):
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"'{text.strip()}' is no whole number above 0")
    return number


def axis_of_a_node(text):
    address, dot, axis = text.rpartition(".")
    return (address_number(address) if dot else None), axis_number(axis)


def axis_number(text):
    try:
        number = int(text)
    except ValueError:
        number = -1
    if not 0 <= number <= 255:
        raise argparse.ArgumentTypeError(f"'{text.strip()}' is no axis: the first is 0")
    return number


def waiting_time(text):
    seconds = units.parse_time(text)
    if seconds < 0:
        raise UnitError(f"'{text.strip()}' is in the past: write a time such as 20ms")
    return seconds


def home_method(text):
    if text not in HOME_METHODS and not re.fullmatch(r"[0-9]+", text):
        raise OutOfRange(
            f"'{text}' is no method: allowed are a number of CiA 402, {', '.join(HOME_METHODS)}"
        )
    return text


def positive(parse):
    def above_zero(text):
        value = parse(text)
        if value <= 0:
            raise UnitError(f"'{text.strip()}' is not above zero")
        return value

    return above_zero


def group(name, text, under, common, example):
    """A command with actions."""
    made = under.add_parser(
        name,
        parents=[common],
        help=text,
        description=text[0].upper() + text[1:] + ".",
        epilog=f"example: {example}",
    )
    return made.add_subparsers(dest="action", metavar="ACTION", required=True, parser_class=Parser)


def common_options() -> argparse.ArgumentParser:
    common = Parser(add_help=False, argument_default=argparse.SUPPRESS)
    group = common.add_argument_group("line")
    group.add_argument(
        "--port",
        help="serial port (/dev/ttyUSB0, COM3, rfc2217://host:port, socket://host:port), or 'twin' for the "
        "simulated stage, 'twin:s2' for another machine; else the variable MOIRE_PORT",
    )
    group.add_argument(
        "--baud", type=positive_number, help=f"baud rate of the line, {BAUD} unless given"
    )
    group.add_argument(
        "--parity",
        choices=PARITIES,
        help="how the 9th bit is made: auto takes mark where the port can do it; odd reaches only the addresses 1 2 4 7 8 11 13 14; "
        "none: COBS packets in 8N1, which auto takes for socket:// and pseudo terminals",
    )
    group.add_argument(
        "--record",
        metavar="FILE",
        help="write all that is said on the line into FILE, for 'moire replay'",
    )
    group.add_argument(
        "--address",
        type=address_number,
        metavar="N",
        help=f"address of the node, {ADDRESSES[0]} to {ADDRESSES[-1]}; 1 unless given",
    )
    group.add_argument(
        "--axis", type=axis_number, metavar="N", help="axis of the node; 0 unless given"
    )
    group.add_argument(
        "--json", action="store_true", help="one JSON object a line for each command, errors too"
    )
    return common


@cache
def make_parser() -> Parser:
    common = common_options()
    parser = Parser(
        prog="moire",
        parents=[common],
        description="Motion controllers on a multi-drop line: find, home, move, look.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(
        dest="command", metavar="COMMAND", required=True, parser_class=Parser
    )

    def command(name, handler, text, example, under=commands, **extra):
        made = under.add_parser(
            name,
            parents=[common],
            help=text,
            description=text[0].upper() + text[1:] + ".",
            epilog=f"example: {example}",
            **extra,
        )
        made.set_defaults(handler=handler)
        return made

    find = command("find", do_find, "who is on the line", "moire --port /dev/ttyUSB0 find")
    find.add_argument(
        "addresses", nargs="*", type=address_number, metavar="ADDRESS", help="all 15 unless given"
    )
    find.add_argument(
        "--any-baud",
        action="store_true",
        help="try the usual baud rates, up to half a minute, and stay at the one at which somebody answers",
    )
    command(
        "status",
        do_status,
        "state, position and faults of an axis",
        "moire --port /dev/ttyUSB0 status --address 2",
    )
    command(
        "enable",
        do_enable,
        "switch the drive on, for the commands that follow in the same call",
        "moire --port twin enable -- wait 1s -- status",
    )
    command("disable", do_disable, "switch the drive off", "moire --port /dev/ttyUSB0 disable")
    home = command(
        "home",
        do_home,
        "find the zero; switches the drive on where needed",
        "moire --port twin home -- status",
    )
    home.add_argument(
        "--method",
        type=checked(home_method),
        metavar="METHOD",
        help="1, 2, 17, 18, 33, 34, 35 or 37 as in CiA 402; s0: switch, way, phase zero; s3: index on either side; "
        "the parameter home_method unless given",
    )
    move = command(
        "move",
        do_move,
        "go to a position, or by a distance; switches the drive on where needed",
        "moire --port twin home -- move 1.5mm -- move -200um --by",
    )
    move.add_argument(
        "target",
        type=checked(units.parse_length),
        metavar="LENGTH",
        help="where to, with a unit: 1.5mm, 200um, 50nm",
    )
    move.add_argument(
        "--by", action="store_true", help="LENGTH is a distance from the present target"
    )
    move.add_argument(
        "--no-wait",
        action="store_true",
        help="only begin it; pause, resume, stop or finish may follow",
    )
    command(
        "finish",
        do_finish,
        "wait until the motion under way has ended",
        "moire --port twin home -- move 1mm --no-wait -- finish",
    )
    prepare = command(
        "prepare",
        do_prepare,
        "plan a move, for a common start; switches the drive on where needed",
        "moire --port /dev/ttyUSB0 prepare 1mm --axis 0 -- prepare 2mm --axis 1 -- start 0 1",
    )
    prepare.add_argument(
        "target", type=checked(units.parse_length), metavar="LENGTH", help="where to, with a unit"
    )
    prepare.add_argument(
        "--by", action="store_true", help="LENGTH is a distance from the present target"
    )
    begin = command(
        "start",
        do_start,
        "begin the prepared moves of several axes in the same instant, and wait for all",
        "moire --port /dev/ttyUSB0 start 0 1",
    )
    begin.add_argument(
        "axes",
        nargs="+",
        type=axis_of_a_node,
        metavar="AXIS",
        help="a number, or as 2.0 that of a node and of its axis: several nodes begin within a microsecond",
    )
    override = command(
        "override",
        do_override,
        "how fast motions go, of full speed: tell or change, in motion too",
        "moire --port /dev/ttyUSB0 override 50%%",
    )
    override.add_argument(
        "share",
        nargs="?",
        type=checked(units.parse_share),
        metavar="SHARE",
        help="0%% to 100%%, or 0 to 1",
    )
    command(
        "pause",
        do_pause,
        "stand still in the middle of a motion",
        "moire --port twin home -- move 1mm --no-wait -- pause -- resume",
    )
    command(
        "resume",
        do_resume,
        "go on as before the pause; at full speed if it was another call that paused",
        "moire --port /dev/ttyUSB0 resume -- finish",
    )
    command(
        "drive",
        do_drive,
        "what drives the axis: command, steps on the wire, fine stage",
        "moire --port /dev/ttyUSB0 drive",
    )
    tune = command(
        "tune",
        do_tune,
        "gains from how the axis answers to commands in open loop: from a record, or on the spot",
        "moire --port /dev/ttyUSB0 tune --bandwidth 40Hz --picture tuning.png",
    )
    tune.add_argument(
        "file",
        nargs="?",
        metavar="FILE",
        help="a row a servo tick: command (full scale 32768), position (2^-16 period) that stood; "
        "without it the axis is switched on and driven to and fro",
    )
    tune.add_argument(
        "--amplitude",
        type=checked(positive(units.parse_share)),
        default="20%",
        metavar="SHARE",
        help="of the open loop; 20%% unless given",
    )
    tune.add_argument(
        "--reach",
        type=checked(positive(units.parse_length)),
        default="1mm",
        metavar="LENGTH",
        help="how far the open loop may go; 1mm unless given",
    )
    tune.add_argument(
        "--every",
        type=checked(positive(units.parse_time)),
        default="2ms",
        metavar="TIME",
        help="from sample to sample on the spot; 2ms unless given",
    )
    tune.add_argument(
        "--bandwidth",
        required=True,
        type=checked(positive(units.FREQUENCY.parse)),
        metavar="FREQUENCY",
        help="such as 40Hz",
    )
    tune.add_argument(
        "--margin",
        type=float,
        default=50.0,
        metavar="DEGREES",
        help="phase margin; 50 unless given",
    )
    tune.add_argument(
        "--tick",
        type=checked(positive(units.parse_time)),
        metavar="TIME",
        help="servo tick; the node is asked unless given",
    )
    tune.add_argument("--picture", metavar="FILE", help="Bode plot and answer to a step, PNG")
    tune.add_argument("--write", action="store_true", help="write gains and filters to the axis")
    command(
        "stop", do_stop, "stop under control; the drive stays on", "moire --port /dev/ttyUSB0 stop"
    )
    wait = command(
        "wait",
        do_wait,
        "let time pass, drives stay on",
        "moire --port twin home -- wait 0.5s -- status",
    )
    wait.add_argument(
        "time", type=checked(waiting_time), metavar="TIME", help="how long, with a unit: 20ms, 1.5s"
    )
    command(
        "reset",
        do_reset,
        "clear latched faults whose cause is gone; the drive stays off",
        "moire --port /dev/ttyUSB0 reset -- status",
    )
    command(
        "counters",
        do_counters,
        "what happened on the line, seen by node and host",
        "moire --port /dev/ttyUSB0 counters --json",
    )
    baud = command(
        "baud",
        do_baud,
        "speak at another baud rate for the rest of this call; name all nodes that anyone speaks to",
        "moire --port /dev/ttyUSB0 baud 1000000 1 2 -- watch",
    )
    baud.add_argument(
        "rate",
        type=positive_number,
        metavar="RATE",
        help="9600 to 3000000, and at most an eighth of the nodes' clock",
    )
    baud.add_argument(
        "addresses", nargs="+", type=address_number, metavar="ADDRESS", help="of all nodes"
    )
    command("encoder", do_encoder, "the sensor as it is now", "moire --port /dev/ttyUSB0 encoder")
    command(
        "signal",
        do_signal,
        "what is wrong with sine and cosine",
        "moire --port /dev/ttyUSB0 signal",
    )
    calibrate = command(
        "calibrate",
        do_calibrate,
        "learn offset, gain, phase and harmonics of sine and cosine afresh, moving to and fro; then keep what was learned",
        "moire --port /dev/ttyUSB0 home -- calibrate -- correction save stage.json",
    )
    calibrate.add_argument(
        "--distance",
        type=checked(positive(units.parse_length)),
        default="1mm",
        metavar="LENGTH",
        help="how far from here, with a unit; 1mm unless given",
    )
    calibrate.add_argument(
        "--timeout",
        type=checked(positive(units.parse_time)),
        default="120s",
        metavar="TIME",
        help="given up after this; 120s unless given",
    )

    commission = command(
        "commission",
        do_commission,
        "home where needed, learn the correction, and save it",
        "moire --port /dev/ttyUSB0 commission stage.json",
    )
    commission.add_argument("file", metavar="FILE", help="JSON, for 'moire correction load'")
    corrections = group(
        "correction",
        "what was learned of sine and cosine: show, save, load, freeze, go on, forget",
        commands,
        common,
        "moire --port /dev/ttyUSB0 correction load stage.json -- correction show",
    )
    command(
        "show",
        do_correction_show,
        "what is in force, and what the learner does",
        "moire --port twin correction show",
        corrections,
    )
    save = command(
        "save",
        do_correction_save,
        "what is in force, into a JSON file",
        "moire --port twin correction save c.json",
        corrections,
    )
    save.add_argument("file", metavar="FILE")
    load = command(
        "load",
        do_correction_load,
        "from a JSON file, all or nothing",
        "moire --port twin correction load c.json",
        corrections,
    )
    load.add_argument("file", metavar="FILE")
    for name, text in (
        ("calibrate", "calibrate in every motion from here on"),
        ("freeze", "learn no more; what was learned stays"),
        ("clear", "correct nothing"),
    ):
        command(
            name,
            do_correction_act,
            text,
            f"moire --port /dev/ttyUSB0 correction {name}",
            corrections,
        )

    capture = group(
        "capture",
        "positions latched at events: from where, now, read",
        commands,
        common,
        "moire --port /dev/ttyUSB0 capture from probe_0_rising -- wait 1s -- capture read",
    )
    sources = command(
        "from",
        do_capture_from,
        "switch sources on, all others off",
        "moire --port twin capture from software",
        capture,
    )
    sources.add_argument(
        "sources",
        nargs="*",
        metavar="SOURCE",
        type=checked(capture_source),
        help=", ".join(CAPTURE_SOURCES),
    )
    command(
        "now",
        do_capture_now,
        "capture now, where the source software is on",
        "moire --port twin capture from software -- capture now",
        capture,
    )
    command(
        "read",
        do_capture_read,
        "take the captures that wait, oldest first",
        "moire --port twin capture read --json",
        capture,
    )

    compare = group(
        "compare",
        "pulses at positions: begin, end, look",
        commands,
        common,
        "moire --port /dev/ttyUSB0 compare from 1mm 10um --count 50 -- move 2mm -- compare show",
    )
    begin = command(
        "from",
        do_compare_from,
        "pulses at START, START + STEP, …",
        "moire --port twin compare from 1mm 10um --pulse 2us",
        compare,
    )
    begin.add_argument(
        "start",
        type=checked(units.parse_length),
        metavar="START",
        help="first position, with a unit",
    )
    begin.add_argument(
        "step",
        type=checked(units.parse_length),
        metavar="STEP",
        help="to the next, with a unit; negative for motion down",
    )
    begin.add_argument(
        "--count",
        type=positive_number,
        default=0,
        metavar="N",
        help="so many pulses; without end unless given",
    )
    begin.add_argument(
        "--pulse",
        type=checked(positive(units.parse_time)),
        default="1us",
        metavar="TIME",
        help="length; 1us unless given",
    )
    begin.add_argument(
        "--gap",
        type=checked(positive(units.parse_time)),
        default="1us",
        metavar="TIME",
        help="shortest gap; 1us unless given",
    )
    command("off", do_compare_off, "no more pulses", "moire --port twin compare off", compare)
    command("show", do_compare_show, "points passed", "moire --port twin compare show", compare)
    command_relay.add_to(
        group(
            "relay",
            "the relay of a ring (S1): status, clear, calibrate",
            commands,
            common,
            "moire --port /dev/ttyUSB0 relay status",
        ),
        command,
    )

    command_scope.add_to(
        group(
            "scope",
            "record position, error and command of an axis: arm, read, show",
            commands,
            common,
            "moire --port twin home -- scope arm --trigger motion -- move 100um -- scope read move.csv",
        ),
        command,
        checked,
        write_bytes,
    )
    command_segments.add_to(
        group(
            "segments",
            "the segment table of an axis (S0): load, use, save, status",
            commands,
            common,
            "moire --port twin home -- segments load scale.csv -- segments status",
        ),
        command,
        write_bytes,
    )
    command_index.add_to(partial(group, under=commands, common=common), command)
    command_job.add_to(partial(group, under=commands, common=common), command)

    register = command(
        "register",
        do_register,
        "read registers of the node, by name or by address",
        "moire --port twin register axis.position 0x400",
    )
    register.add_argument(
        "registers",
        nargs="*",
        metavar="REGISTER",
        help="such as line.frames_good or 0x110; without one: list the names",
    )

    params = commands.add_parser(
        "params",
        help="parameters of an axis: list, get, set, save, load, save-to-node, saved-in-node, restore-defaults",
        description="Parameters of an axis.",
        epilog="example: moire --port /dev/ttyUSB0 params set velocity 5mm/s -- params save stage.json",
        parents=[common],
    )
    actions = params.add_subparsers(
        dest="action", metavar="ACTION", required=True, parser_class=Parser
    )
    command(
        "list", do_params_get, "all, with unit and range", "moire --port twin params list", actions
    ).set_defaults(names=[])
    get = command(
        "get", do_params_get, "one or some", "moire --port twin params get velocity kp", actions
    )
    get.add_argument(
        "names", nargs="+", metavar="NAME", choices=list(PARAMETERS), help="see: params list"
    )
    put = command(
        "set",
        do_params_set,
        "write one, with its unit",
        "moire --port twin params set velocity 5mm/s",
        actions,
    )
    put.add_argument("name", metavar="NAME", choices=list(PARAMETERS), help="see: params list")
    put.add_argument(
        "value", metavar="VALUE", help="with a unit where it has one: 5mm/s, 20ms, 20kHz, 0.5"
    )
    save = command(
        "save",
        do_params_save,
        "all into a JSON file",
        "moire --port twin params save stage.json",
        actions,
    )
    save.add_argument("file", metavar="FILE")
    load = command(
        "load",
        do_params_load,
        "all that are in a JSON file; each is checked before the first is written",
        "moire --port twin params load stage.json",
        actions,
    )
    load.add_argument("file", metavar="FILE")
    command_keep.add_to(actions, command)

    command_look.add_to(command, checked(waiting_time))
    command_replay.add_to(command)
    command_twin.add_to(command, address_number, checked(waiting_time))
    run = command(
        "run",
        do_run,
        "commands from a file, one a line, # begins a remark",
        "moire --port twin run warm_up.txt",
    )
    run.add_argument("file", metavar="FILE", help="- is the standard input")
    command(
        "shell",
        do_shell,
        "commands from the keyboard, until 'quit'; drives stay on between them",
        "moire --port twin shell",
    )
    return parser


def segments(arguments) -> list:
    """The commands between the --; lengths below zero are kept from looking like options."""
    parts = [[]]
    for argument in arguments:
        if argument == "--":
            parts.append([])
        else:
            parts[-1].append(" " + argument if re.match(r"-[0-9.]", argument) else argument)
    if any(not part for part in parts):
        where = " beside --" if len(parts) > 1 else ""
        raise UsageError(f"a command is missing{where} (see: moire --help)")
    return parts


def parse(arguments, before: dict) -> list:
    """Namespaces of all commands; what the first says about the line holds for all."""
    parser, parsed = make_parser(), []
    for part in segments(arguments):
        said = vars(parser.parse_args(part))
        if not parsed:
            before = {**before, **{name: said[name] for name in DEFAULTS if name in said}}
        parsed.append({**before, **said})
    call = {
        name: command[name]
        for name in OF_THE_CALL
        for command in parsed
        if command[name] != before[name]
    }
    return [argparse.Namespace(**{**command, **call}) for command in parsed]


# ------------------------------------------------------------------ session


class Session:
    """One call: the transport opens at the first command that needs it."""

    def __init__(self, options: argparse.Namespace, open_transport=None, out=None, err=None):
        self.options, self.open_transport = options, open_transport or open_port
        self.out, self.err = out or sys.stdout, err or sys.stderr
        self.opened, self.switched_on = None, {}

    def open(self) -> Bus:
        if self.opened is None:
            transport = self.open_transport(self.options)
            self.opened = Bus(
                command_replay.recorded(transport, self.options.record)
                if self.options.record
                else transport
            )
        return self.opened

    @property
    def bus(self) -> Bus:
        return self.open()

    def axis(self, command):
        return self.bus.axis(command.address, command.axis)

    def switch_on(self, command):
        axis = self.axis(command)
        if not axis.status().enabled:
            axis.enable()
        self.switched_on[command.address, command.axis] = axis
        return axis

    def keep_alive(self):
        """The watchdog of a node counts the silence while we wait for a person."""
        for place, axis in list(self.switched_on.items()):
            if not axis.status().enabled:
                del self.switched_on[place]

    def stop_axes(self):
        """Under control; whatever was switched on is switched off by close()."""
        for axis in self.switched_on.values():
            axis.stop_if_enabled()

    @staticmethod
    def read_text(file: str) -> str:
        return read_text(file)

    def say(self, told: dict, text: str):
        print(
            json.dumps(told, default=plain) if self.options.json else text,
            file=self.out,
            flush=True,
        )

    def complain(self, command: str | None, error: MoireError):
        if self.options.json:
            told = {
                "command": command,
                "error": type(error).__name__,
                "message": str(error),
                "exit_code": error.exit_code,
            }
            if hasattr(error, "cause"):
                told["cause"] = error.cause
            print(json.dumps(told), file=self.out, flush=True)
        else:
            print(f"moire: {error}", file=self.err, flush=True)

    def progress(self):
        """A line that follows the motion, where a person looks at it."""
        if self.options.json or not self.err.isatty():
            return None

        def show(status):
            text = f"\r{status.words:<18} {status.position_nm / 1e6:14.6f} mm  {status.velocity_mm_s:9.4f} mm/s "
            print(text, end="", file=self.err, flush=True)

        return show

    def end_progress(self, show):
        if show is not None:
            print("\r" + " " * 60 + "\r", end="", file=self.err, flush=True)

    def close(self):
        if self.opened is None:
            return
        for axis in self.switched_on.values():
            try:
                axis.disable()
            except MoireError:
                pass  # the watchdog of the node does it
        if self.opened.baud_changed:
            try:
                self.opened.first_baud()
            except MoireError:
                pass  # the nodes do it after a while
        self.opened.transport.close()


def plain(value):
    return float(value) if isinstance(value, Fraction) else str(value)


def open_port(options):
    port = options.port or os.environ.get("MOIRE_PORT")
    if not port:
        raise PortError(
            "no port: write --port /dev/ttyUSB0, or --port twin for the simulated stage"
        )
    return open_bus(port, options.baud, options.parity)


# ------------------------------------------------------------------ commands


def node_and_axis(command) -> dict:
    return {"command": command.command, "address": command.address, "axis": command.axis}


def status_report(session, command, status, **built):
    told = {
        **node_and_axis(command),
        **asdict(status),
        **built,
        "words": status.words,
        "fault_words": status.fault_words,
        "ended_words": status.ended_words,
    }
    possible = (
        (status.limit_low, "low end pressed"),
        (status.limit_high, "high end pressed"),
        (status.estop, "emergency stop pressed"),
    )
    switches = [text for pressed, text in possible if pressed]
    rows = [
        ("position", f"{status.position_nm / 1e6:.6f} mm   {status.counts} counts"),
        (
            "target",
            f"{status.target_nm / 1e6:.6f} mm   error {status.target_nm - status.position_nm:.1f} nm",
        ),
        ("velocity", f"{status.velocity_mm_s:.4f} mm/s"),
        (
            "command",
            f"{100 * status.drive_command:.1f} %" + (", at its limit" if status.saturated else ""),
        ),
        ("switches", ", ".join(switches) or "free"),
        ("faults", status.fault_words or "none"),
    ]
    if status.encoder_events:
        rows.append(("encoder", ", ".join(status.encoder_events)))
    if not built.get("sine", True):
        rows.append(("sensor", WITHOUT_SINE))
    head = f"node {command.address} axis {command.axis}: {status.words}, {'zero known' if status.homed else 'not homed'}"
    session.say(told, head + "".join(f"\n  {name:<9} {text}" for name, text in rows))


def do_find(session, command):
    wanted = command.addresses or ADDRESSES
    found, baud = (
        session.bus.find_baud(wanted) if command.any_baud else (session.bus.find(wanted), None)
    )
    if not found:
        check = (
            "check power and wiring; no usual baud rate is left"
            if command.any_baud
            else "check power, wiring and baud rate, or try all with 'find --any-baud'"
        )
        raise BusError(0, f"nobody answers at the addresses {', '.join(map(str, wanted))}: {check}")
    told = {
        "command": "find",
        "nodes": [{**asdict(node), "matches": node.matches} for node in found],
        "baud": baud,
    }
    session.say(
        told,
        "\n".join(
            [*map(identity_words, found), *([f"at {baud} baud: --baud {baud}"] if baud else [])]
        ),
    )


def identity_words(node) -> str:
    axes = "1 axis" if node.axes == 1 else f"{node.axes} axes"
    build = (
        "made from the same sources"
        if node.matches
        else "MADE FROM OTHER SOURCES than this host package"
    )
    return (
        f"node {node.address}: {axes}, clock {node.clk_hz / 1e6:g} MHz, servo {node.tick_hz / 1e3:g} kHz, "
        f"samples {node.sample_hz / 1e3:g} kHz, {build}"
    )


def do_status(session, command):
    axis = session.axis(command)
    status_report(session, command, axis.status(), sine=axis.has_sine())


def do_enable(session, command):
    axis = session.axis(command)
    axis.enable()
    session.switched_on[command.address, command.axis] = axis
    session.say(
        {**node_and_axis(command), "enabled": True},
        f"node {command.address} axis {command.axis}: drive on",
    )


def do_disable(session, command):
    session.axis(command).disable()
    session.switched_on.pop((command.address, command.axis), None)
    session.say(
        {**node_and_axis(command), "enabled": False},
        f"node {command.address} axis {command.axis}: drive off",
    )


def do_motion(session, command, motion):
    axis, show = session.switch_on(command), session.progress()
    began = session.bus.transport.now()
    try:
        status = motion(axis, show)
    finally:
        session.end_progress(show)
    seconds = session.bus.transport.now() - began
    error = status.target_nm - status.position_nm
    session.say(
        {
            **node_and_axis(command),
            "position_nm": status.position_nm,
            "target_nm": status.target_nm,
            "error_nm": error,
            "time_s": seconds,
        },
        f"node {command.address} axis {command.axis}: at {status.position_nm / 1e6:.6f} mm, error {error:.1f} nm, after {seconds:.3f} s",
    )


def do_home(session, command):
    do_motion(session, command, lambda axis, show: axis.home(progress=show, method=command.method))


def do_move(session, command):
    if not command.no_wait:
        do_motion(
            session,
            command,
            lambda axis, show: axis.move(nm=command.target, by=command.by, progress=show),
        )
        return
    seconds = session.switch_on(command).begin_move(nm=command.target, by=command.by)
    session.say(
        {**node_and_axis(command), "duration_s": seconds},
        f"{where(command)}: on its way, {seconds:.3f} s at full speed",
    )


def do_finish(session, command):
    do_motion(session, command, lambda axis, show: axis.motion_end(show))


def do_prepare(session, command):
    seconds = session.switch_on(command).prepare(nm=command.target, by=command.by)
    session.say(
        {**node_and_axis(command), "duration_s": seconds},
        f"{where(command)}: prepared, {seconds:.3f} s at full speed",
    )


def do_start(session, command):
    bus, show = session.bus, session.progress()
    places = list(
        dict.fromkeys((address or command.address, axis) for address, axis in command.axes)
    )
    began = bus.transport.now()
    try:
        if len({address for address, _ in places}) == 1:
            ended = bus.node(places[0][0]).start(*(axis for _, axis in places), progress=show)
        else:
            ended = bus.start(*(bus.axis(*place) for place in places), progress=show)
    finally:
        session.end_progress(show)
    seconds = bus.transport.now() - began
    rows = [
        {
            "address": address,
            "axis": axis,
            "position_nm": status.position_nm,
            "error_nm": status.target_nm - status.position_nm,
        }
        for (address, axis), status in zip(places, ended)
    ]
    session.say(
        {"command": "start", "axes": rows, "time_s": seconds},
        "\n".join(
            f"node {row['address']} axis {row['axis']}: at {row['position_nm'] / 1e6:.6f} mm, error {row['error_nm']:.1f} nm"
            for row in rows
        ),
    )


def override_report(session, command, share):
    session.say(
        {**node_and_axis(command), "override": share},
        f"{where(command)}: "
        + (f"{units.decimal(round(100 * share, 3))} % of full speed" if share else "paused"),
    )


def do_override(session, command):
    override_report(session, command, session.axis(command).override(command.share))


def do_pause(session, command):
    session.axis(command).pause()
    override_report(session, command, 0)


def do_resume(session, command):
    override_report(session, command, session.axis(command).resume())


def do_drive(session, command):
    drive = session.axis(command).drive()
    rows = [
        ("drive", f"{drive.kind}; built: {', '.join(drive.built)}"),
        ("command", f"{100 * drive.command:.1f} %"),
        ("override", f"{units.decimal(round(100 * drive.override, 3))} %"),
        ("steps", f"{drive.steps} on the wire since reset"),
    ]
    if "fine" in drive.built:
        rows.append(("fine", f"{100 * drive.fine_command:.1f} %"))
    session.say(
        {**node_and_axis(command), **asdict(drive)},
        f"{where(command)}:" + "".join(f"\n  {name:<9} {text}" for name, text in rows),
    )


def do_tune(session, command):
    from moire.analysis import scope, tune

    tick_s = float(command.tick or Fraction(1, session.bus.node(command.address).identity.tick_hz))
    if command.file is None:
        record = scope.excite(
            session.switch_on(command), command.amplitude, command.every, command.reach
        )
        plant = tune.identify_samples(*scope.lsb(record), tick_s)
    else:
        plant = tune.identify(tune.Record(*read_record(command.file), tick_s))
    tuning = tune.propose(plant, float(command.bandwidth), command.margin)
    if command.picture:
        write_bytes(command.picture, tune.picture(plant, tuning))
    if command.write:
        session.axis(command).set_tuning(tuning)
    gains = {name: tuning.real(name) for name in tune.SCALES}
    rows = [
        f"plant: {plant.gain:.4g} LSB a tick per command, time constant {1e3 * plant.time_constant_s:.3g} ms, delay {plant.delay} ticks"
        + (f", resonance at {plant.resonance_hz:.0f} Hz" if plant.resonance_hz else "")
        + f", {100 * plant.unexplained:.0f} % unexplained",
        f"loop: {tuning.bandwidth_hz:.1f} Hz, phase margin {tuning.phase_margin_degree:.0f} degrees, gain margin {tuning.gain_margin:.2f}",
        *(f"  {name:<3} {value:.8g}" for name, value in gains.items()),
        f"filters: {len(tuning.filters)}; "
        + (f"written to {where(command)}" if command.write else "not written: add --write"),
    ]
    session.say(
        {
            **node_and_axis(command),
            "plant": asdict(plant),
            "gains": gains,
            "filters": tuning.filters,
            "bandwidth_hz": tuning.bandwidth_hz,
            "phase_margin_degree": tuning.phase_margin_degree,
            "gain_margin": tuning.gain_margin,
            "written": command.write,
        },
        "\n".join(rows),
    )


def read_record(file: str) -> tuple:
    """Commands and positions, from rows of two numbers; a row of words at the head is passed over."""
    rows = [
        row.split(",")
        for row in read_text(file).splitlines()
        if row.strip() and not row.startswith("#")
    ]
    try:
        rows = rows[1:] if rows and not re.match(r"\s*[+-]?[0-9.]", rows[0][0]) else rows
        command, position = zip(*((float(left), float(right)) for left, right in rows))
    except ValueError:
        raise BadFile(
            f"the file {file} is no record: each row has two numbers, command and position, with a comma between"
        ) from None
    return command, position


def do_stop(session, command):
    axis = session.axis(command)
    axis.stop()
    while axis.status().in_motion:
        session.bus.transport.wait(KEEP_ALIVE_S)
    status_report(session, command, axis.status())


def do_wait(session, command):
    axis, show = session.axis(command), session.progress()
    try:
        status = axis.dwell(float(command.time), show)
    finally:
        session.end_progress(show)
    status_report(session, command, status)


def do_reset(session, command):
    session.axis(command).reset()
    session.say(
        {**node_and_axis(command), "faults": []},
        f"node {command.address} axis {command.axis}: no fault is latched",
    )


def do_counters(session, command):
    node = session.bus.node(command.address).counters()
    host = asdict(session.bus.statistics)
    rows = [
        f"node {command.address}:",
        *(f"  {name:<15} {value}" for name, value in node.items()),
        "seen by this host in this call:",
        *(f"  {name:<15} {value}" for name, value in host.items()),
    ]
    session.say(
        {"command": "counters", "address": command.address, "node": node, "host": host},
        "\n".join(rows),
    )


def do_baud(session, command):
    session.bus.set_baud(command.rate, command.addresses)
    session.say(
        {"command": "baud", "baud": command.rate, "addresses": command.addresses},
        f"{command.rate} baud until the end of this call",
    )


def do_encoder(session, command):
    axis = session.axis(command)
    encoder, sine = axis.encoder(), axis.has_sine()
    rows = (
        [
            ("sine, cosine", f"{encoder.sin} {encoder.cos} converter counts"),
            ("phase", f"{360 * encoder.phase:.3f} degrees"),
            ("amplitude", f"{encoder.amplitude} converter counts"),
        ]
        if sine
        else [("sensor", WITHOUT_SINE)]
    )
    rows += [
        ("quadrature", f"{encoder.quadrature_count} quarter periods"),
        ("rejected", f"{encoder.rejected_pulses} pulses, {encoder.rejected_samples} samples"),
        (
            "home phase",
            f"{encoder.home_phase_nm:.1f} nm from the phase zero taken, margin {100 * encoder.home_margin:.0f} %",
        ),
        ("first fault", f"at {encoder.fault_position_nm / 1e6:.6f} mm"),
    ]
    head = f"node {command.address} axis {command.axis}:"
    session.say(
        {**node_and_axis(command), **asdict(encoder), "sine": sine},
        head + "".join(f"\n  {name:<12} {text}" for name, text in rows),
    )


def where(command) -> str:
    return f"node {command.address} axis {command.axis}"


def do_signal(session, command):
    signal = session.axis(command).signal()
    told = {
        **node_and_axis(command),
        **asdict(signal),
        "fault_words": signal.fault_words,
        "first_words": signal.first_words,
    }
    session.say(
        told,
        f"{where(command)}: {signal.fault_words or 'nothing is wrong with the signal'}\n"
        f"  first since reset: {signal.first_words or 'none'}",
    )


def calibration_report(calibration) -> dict:
    return {**asdict(calibration), "words": calibration.words}


def calibration_words(calibration) -> str:
    known = (
        f"settled, known to {calibration.scatter_nm:.3f} nm"
        if calibration.settled
        else "not settled"
    )
    return f"{calibration.words}; {known} ({calibration.accepted} accepted, {calibration.refused} refused)"


def do_calibrate(session, command):
    run_calibration(session, command, command.distance, command.timeout)


def run_calibration(session, command, *how):
    axis, watched = session.switch_on(command), not session.options.json and session.err.isatty()

    def show(calibration):
        print(f"\r{calibration_words(calibration):<100}", end="", file=session.err, flush=True)

    began = session.bus.transport.now()
    try:
        calibration = axis.calibrate(show if watched else None, *how)
    finally:
        if watched:
            print("\r" + " " * 100 + "\r", end="", file=session.err, flush=True)
    seconds = session.bus.transport.now() - began
    session.say(
        {**node_and_axis(command), **calibration_report(calibration), "time_s": seconds},
        f"{where(command)}: correction learned in {seconds:.1f} s, known to {calibration.scatter_nm:.3f} nm, frozen",
    )


def do_commission(session, command):
    axis = session.switch_on(command)
    if not axis.status().homed:
        axis.home(session.progress())
    run_calibration(session, command)
    save_correction(axis, command.file)


def save_correction(axis, file: str):
    write_text(file, json.dumps({"correction": axis.correction()}, indent=4) + "\n")


def correction_report(command, calibration, values) -> dict:
    return {
        **node_and_axis(command),
        "action": command.action,
        "calibration": calibration_report(calibration),
        "correction": values,
    }


def do_correction_show(session, command):
    axis = session.axis(command)
    calibration, values = axis.calibration(), axis.correction()
    rows = [
        f"{where(command)}: {calibration_words(calibration)}",
        f"  offset    sine {values['sin_offset'] / 327.68:.3f} %, cosine {values['cos_offset'] / 327.68:.3f} % of full scale",
        f"  gain      {values['gain'] / 65536:.5f} of the sine",
        f"  quadrature_error     {values['quadrature_error'] / 65536:.5f} of the cosine, added to the sine",
        "  harmonics of the phase, nm: "
        + ", ".join(
            f"{order}: {float(axis.period_nm) * (cosine**2 + sine**2) ** 0.5 / 2**24:.3f}"
            for order, (cosine, sine) in enumerate(zip(values["cosine"], values["sine"]), 1)
        ),
    ]
    session.say(correction_report(command, calibration, values), "\n".join(rows))


def do_correction_save(session, command):
    save_correction(session.axis(command), command.file)
    session.say(
        {**node_and_axis(command), "action": "save", "file": command.file},
        f"correction saved in {command.file}",
    )


def do_correction_load(session, command):
    told = read_json(command.file)
    values = told.get("correction") if isinstance(told, dict) else None
    if not isinstance(values, dict):
        raise BadFile(
            f"the file {command.file} holds no correction: make one with 'moire correction save'"
        )
    session.axis(command).set_correction(values)
    session.say(
        {**node_and_axis(command), "action": "load", "file": command.file},
        f"correction loaded from {command.file}",
    )


def do_correction_act(session, command):
    calibration = session.axis(command).calibration(command.action)
    session.say(
        {
            **node_and_axis(command),
            "action": command.action,
            "calibration": calibration_report(calibration),
        },
        f"{where(command)}: {calibration_words(calibration)}",
    )


def do_capture_from(session, command):
    session.axis(command).capture_from(*command.sources)
    session.say(
        {**node_and_axis(command), "action": command.action, "sources": command.sources},
        f"{where(command)}: captures from {', '.join(command.sources) or 'nothing'}",
    )


def do_capture_now(session, command):
    session.axis(command).capture_now()
    session.say({**node_and_axis(command), "action": command.action}, f"{where(command)}: captured")


def do_capture_read(session, command):
    captures, lost = session.axis(command).captures()
    rows = [
        f"  {capture.position_nm / 1e6:.6f} mm at clk {capture.time_clk}, its sample {capture.age_s * 1e6:.2f} us before: "
        + ", ".join(capture.sources)
        for capture in captures
    ]
    head = f"{where(command)}: {len(captures)} captures" + (
        ", MORE WERE LOST: read more often" if lost else ""
    )
    session.say(
        {
            **node_and_axis(command),
            "action": command.action,
            "captures": [asdict(capture) for capture in captures],
            "lost": lost,
        },
        "\n".join([head, *rows]),
    )


def do_compare_from(session, command):
    axis = session.axis(command)
    axis.compare_from(command.start, command.step, command.count, command.pulse, command.gap)
    number = str(command.count) if command.count else "no end"
    session.say(
        {
            **node_and_axis(command),
            "action": command.action,
            "start_nm": command.start,
            "step_nm": command.step,
            "count": command.count,
        },
        f"{where(command)}: pulses from {units.format_length(command.start)} every {units.format_length(command.step)}, "
        f"count: {number}",
    )


def do_compare_off(session, command):
    session.axis(command).compare_off()
    session.say(
        {**node_and_axis(command), "action": command.action}, f"{where(command)}: no more pulses"
    )


def do_compare_show(session, command):
    compare = session.axis(command).compare()
    session.say(
        {**node_and_axis(command), "action": command.action, **asdict(compare)},
        f"{where(command)}: {'under way' if compare.armed else 'off'}, {compare.passed} points passed"
        + (", some pulses came late: the gap is too long for the speed" if compare.late else ""),
    )


def do_register(session, command):
    names = list(
        dict.fromkeys(f"{field.block}.{field.register}" for field in FIELDS if "r" in field.access)
    )
    if not command.registers:
        session.say({"command": "register", "names": names}, "\n".join(names))
        return
    for name in command.registers:  # before the first is read
        if not re.match(r"0[xX]|[0-9]", name):
            register_fields(name)
    told, rows, node = {}, [], session.bus.node(command.address)
    for name in command.registers:
        if re.match(r"0[xX]|[0-9]", name):
            value = node.read_register(register_address(name))
            told[name] = value
            rows.append(f"{name} = 0x{value:08X} {value}")
        else:
            told[name] = node.read_named(
                name, session.axis(command).number if name.startswith(OF_AN_AXIS) else 0
            )
            rows.append(
                f"{name}: " + ", ".join(f"{field} = {value}" for field, value in told[name].items())
            )
    session.say({**node_and_axis(command), "registers": told}, "\n".join(rows))


def register_address(text: str) -> int:
    try:
        return int(text, 0)
    except ValueError:
        raise OutOfRange(
            f"'{text}' is no register address: write it like 0x400, or a name like axis.position"
        ) from None


def parameter_report(value) -> dict:
    return {
        "name": value.name,
        "value": value.value,
        "unit": value.unit,
        "written": value.written(),
        "minimum": value.minimum,
        "maximum": value.maximum,
        "default": value.default,
        "text": value.text,
    }


def say_parameters(session, command, values):
    rows = [
        f"{value.name:<19} {value.written(6):<14} {value.range_words:<32} {value.text}"
        for value in values
    ]
    session.say(
        {
            **node_and_axis(command),
            "action": command.action,
            "parameters": [parameter_report(value) for value in values],
        },
        "\n".join(rows),
    )


def do_params_get(session, command):
    axis = session.axis(command)
    say_parameters(
        session, command, [axis.get_parameter(name) for name in command.names or PARAMETERS]
    )


def do_params_set(session, command):
    say_parameters(
        session, command, [session.axis(command).set_parameter(command.name, command.value)]
    )


def do_params_save(session, command):
    axis = session.axis(command)
    saved, points = axis.save_parameters(), segment_points(axis)
    write_text(
        command.file,
        json.dumps(
            {"parameters": saved, **({"segment_points": points} if points else {})}, indent=4
        )
        + "\n",
    )
    session.say(
        {**node_and_axis(command), "action": "save", "file": command.file, "count": len(saved)},
        f"{len(saved)} parameters{' and a segment table' if points else ''} saved in {command.file}",
    )


def segment_points(axis) -> list:
    """Those of its segment table; none where the node has no table."""
    try:
        return Segments(axis).read_points()
    except Refused as refused:
        if refused.cause != "not_built":
            raise
        return []


def do_params_load(session, command):
    texts, points = read_parameters(command.file)
    axis = session.axis(command)
    if points:
        axis.check_parameters(texts)
        Segments(axis).write_points(points)
    loaded = axis.load_parameters(texts)
    session.say(
        {**node_and_axis(command), "action": "load", "file": command.file, "count": len(loaded)},
        f"{len(loaded)} parameters{' and a segment table' if points else ''} loaded from {command.file}",
    )


def read_parameters(file: str) -> tuple:
    """The texts by name, and the points of the segment table in counts of the wire."""
    told = read_json(file)
    texts = told.get("parameters") if isinstance(told, dict) else None
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise BadFile(
            f'the file {file} holds no parameters: it must look like {{"parameters": {{"velocity": "5mm/s"}}}}'
        )
    points = told.get("segment_points", [])
    if not isinstance(points, list) or not all(map(whole, points)):
        raise BadFile(f"the segment_points in the file {file} are no list of whole numbers")
    return texts, points


def read_json(file: str):
    try:
        return json.loads(read_text(file))
    except ValueError as error:
        raise BadFile(f"the file {file} is no JSON: {error}") from None


def write_text(file: str, text: str):
    write_bytes(file, text.encode())


def write_bytes(file: str, content: bytes):
    try:
        Path(file).write_bytes(content)
    except OSError as error:
        raise BadFile(f"the file {file} cannot be written: {error.strerror}") from None


def read_text(file: str) -> str:
    try:
        return sys.stdin.read() if file == "-" else Path(file).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadFile(
            f"the file {file} cannot be read: {getattr(error, 'strerror', None) or 'it is no text'}"
        ) from None


# ------------------------------------------------------------------ several commands


def parse_line(text: str, options) -> list:
    """The commands of one line of a file or of the shell."""
    try:
        arguments = shlex.split(text, comments=True)
    except ValueError as error:
        raise UsageError(f"'{text.strip()}' cannot be read: {error}") from None
    if not arguments:
        return []
    commands = parse(arguments, {name: getattr(options, name) for name in DEFAULTS})
    for command in commands:
        if command.command in NOT_INSIDE:
            raise UsageError(f"'{command.command}' cannot stand inside a file or a shell")
        for name in OF_THE_PORT:
            if getattr(command, name) != getattr(options, name):
                raise UsageError(f"--{name} holds for the whole call: give it to 'moire' itself")
    return commands


def do_run(session, command):
    """All lines are read before the first command is carried out."""
    commands = []
    for number, text in enumerate(read_text(command.file).splitlines(), 1):
        try:
            commands += parse_line(text, command)
        except MoireError as error:
            raise UsageError(f"line {number} of {command.file}: {error}") from None
    for inner in commands:
        carry_out(session, inner)


def do_shell(session, command):
    lines, here = queue.Queue(), sys.stdin.isatty()

    def read():
        for text in sys.stdin:
            lines.put(text)
        lines.put(None)

    session.open()  # a port that does not open is told now
    threading.Thread(target=read, daemon=True).start()
    while True:
        if here:
            print("moire> ", end="", file=session.err, flush=True)
        text = next_line(session, lines)
        if text is None or text.strip() in ("quit", "exit"):
            return
        try:
            for inner in parse_line(text, command):
                carry_out(session, inner)
        except MoireError as error:
            if not here:
                raise
            session.complain(None, error)
        except KeyboardInterrupt:
            if not here:
                raise
            print("\nstopped", file=session.err)
        except SystemExit:
            pass  # --help


def next_line(session, lines):
    while True:
        try:
            return lines.get(
                timeout=None if session.bus.transport.time_is_stopped else KEEP_ALIVE_S
            )
        except queue.Empty:
            session.keep_alive()


def carry_out(session, command):
    session.options = command
    try:
        command.handler(session, command)
    except MoireError as error:
        error.command = getattr(error, "command", command.command)
        raise


def main(arguments=None, open_transport=None, out=None, err=None) -> int:
    """Returns the exit code."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    session = Session(
        argparse.Namespace(**{**DEFAULTS, "json": "--json" in arguments}), open_transport, out, err
    )
    try:
        commands = parse(arguments, DEFAULTS)
        if len(commands) > 1:
            for command in commands:
                if command.command in NOT_INSIDE:
                    raise UsageError(f"'{command.command}' stands alone in its call")
        for command in commands:
            carry_out(session, command)
        return 0
    except MoireError as error:
        session.complain(getattr(error, "command", None), error)
        return error.exit_code
    except BrokenPipeError:  # 'moire watch | head': nobody reads any more
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        session.stop_axes()
        session.complain(None, Interrupted("interrupted; what moved was stopped under control"))
        return Interrupted.exit_code
    finally:
        session.close()


if __name__ == "__main__":
    sys.exit(main())
