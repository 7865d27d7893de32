# SPDX-License-Identifier: Apache-2.0
"""The commands that only look: watch, fault, selftest. The command line adds them to its parser."""

from dataclasses import asdict
from math import inf

from moire import units
from moire.analysis import selftest
from moire.client.records import Signal

EVERY_S = 0.2  # of watch


def add_to(command, waiting_time):
    watch = command(
        "watch",
        do_watch,
        "state and position of an axis, again and again",
        "moire --port /dev/ttyUSB0 watch --every 0.5s",
    )
    watch.add_argument(
        "--every", type=waiting_time, metavar="TIME", help=f"with a unit; {EVERY_S} s unless given"
    )
    watch.add_argument(
        "--for",
        dest="time",
        type=waiting_time,
        metavar="TIME",
        help="with a unit; until Ctrl-C unless given",
    )
    command(
        "fault",
        do_fault,
        "what is latched, what came first and where, and what to do",
        "moire --port /dev/ttyUSB0 fault -- reset",
    )
    command(
        "selftest",
        do_selftest,
        "look for what is wrong with a node, without moving anything",
        "moire --port /dev/ttyUSB0 selftest",
    )


def node_and_axis(command) -> dict:
    return {"command": command.command, "address": command.address, "axis": command.axis}


def do_watch(session, command):
    axis, every = session.axis(command), float(command.every or EVERY_S)
    transport = session.bus.transport
    began = transport.now()
    end = inf if command.time is None else began + float(command.time)
    shown = began
    while True:
        status = axis.status()
        if transport.now() >= shown:
            seconds = transport.now() - began
            session.say(
                {**node_and_axis(command), "time_s": seconds, **asdict(status)},
                f"{seconds:9.3f} s  {status.position_nm / 1e6:14.6f} mm  error {status.target_nm - status.position_nm:10.1f} nm  "
                f"{status.velocity_mm_s:9.4f} mm/s  {status.words}"
                + (f": {status.fault_words}" if status.faults else ""),
            )
            shown = max(shown + every, transport.now())
        if transport.now() >= end:
            return
        transport.wait(min(session.bus.poll_s, max(0.0, min(shown, end) - transport.now())))


def do_fault(session, command):
    axis = session.axis(command)
    status, encoder, signal = (
        axis.status(),
        axis.encoder(),
        axis.signal() if axis.has_sine() else Signal((), ()),
    )
    told = {
        **node_and_axis(command),
        "faults": status.faults,
        "first_fault": status.first_fault,
        "words": status.fault_words,
        "fault_position_nm": encoder.fault_position_nm if status.faults else None,
        "encoder_events": status.encoder_events,
        "signal_faults": signal.faults,
        "first_signal_faults": signal.first,
    }
    if not status.faults:
        session.say(told, f"node {command.address} axis {command.axis}: no fault is latched")
        return
    rows = [
        f"node {command.address} axis {command.axis}: {status.fault_words}",
        f"  first     {status.first_fault_words}, at {units.format_length(encoder.fault_position_nm)}",
    ]
    if status.encoder_events:
        rows.append(f"  encoder   {status.encoder_event_words}")
    if signal.first:
        rows.append(f"  signal    {signal.first_words}")
    rows.append(
        "  to do     remove the cause, then 'moire reset'"
        + ("" if status.homed else ", then 'moire home'")
    )
    session.say(told, "\n".join(rows))


def do_selftest(session, command):
    found = []
    for check in selftest.checks(session.bus.node(command.address)):
        found.append(check)
        if not session.options.json:
            session.say(
                {}, f"{'passed' if check.passed else 'FAILED':<8} {check.name:<18} {check.words}"
            )
    failed = [check.name for check in found if not check.passed]
    if session.options.json:
        session.say(
            {
                "command": "selftest",
                "address": command.address,
                "passed": not failed,
                "checks": [check._asdict() for check in found],
            },
            "",
        )
    if failed:
        raise selftest.SelfTestFailed(
            f"node {command.address} failed {len(failed)} of {len(found)} checks: {', '.join(failed)}"
        )
