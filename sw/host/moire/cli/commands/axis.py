# SPDX-License-Identifier: Apache-2.0
"""The commands about the state of an axis: status, enable, disable, stop, wait, reset."""

from fractions import Fraction
from typing import Any

import click

from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import WAITING_TIME
from moire.client.records import Status

POLL_S = 0.1  # while an axis stops
WITHOUT_SINE = "counts only: built without sine and cosine"


@moire.command(
    "status",
    help="Show the state, the position and the faults of an axis.",
    example="moire --port /dev/ttyUSB0 status --address 2",
)
def status(call: Call) -> None:
    """One read-back of the axis."""
    axis = call.axis
    found, sine = axis.status(), axis.has_sine()
    say_status(call, found, sine=sine, speed=call.bus.transport.speed())


@moire.command(
    "enable",
    help="Switch the drive on for the commands that follow in the same call.",
    example="moire --port twin enable -- wait 1s -- status",
)
def enable(call: Call) -> None:
    """If it was off, the drive stays on until the end of the call; else it stays on."""
    call.switch_on()
    call.say_of_axis({"enabled": True}, f"{call.where}: drive on")


@moire.command(
    "disable",
    help="Switch the drive off.",
    example="moire --port /dev/ttyUSB0 disable",
)
def disable(call: Call) -> None:
    """At once, whoever has switched it on."""
    call.axis.disable()
    call.session.forget((call.options.address, call.options.axis))
    call.say_of_axis({"enabled": False}, f"{call.where}: drive off")


@moire.command(
    "stop",
    help="Stop a motion under control. The drive stays on.",
    example="moire --port /dev/ttyUSB0 stop",
)
def stop(call: Call) -> None:
    """Returns when the axis is at rest."""
    axis = call.axis
    axis.stop()
    while axis.status().in_motion:
        call.bus.transport.wait(POLL_S)
    say_status(call, axis.status())


@moire.command(
    "wait",
    help="Wait for some time. Drives stay on.",
    example="moire --port twin home -- wait 0.5s -- status",
)
@click.argument(
    "time", type=WAITING_TIME, metavar="TIME", help="The time with its unit, such as 20ms or 1.5s."
)
def wait(call: Call, time: Fraction) -> None:
    """Talks to the axis meanwhile, so that its watchdog does not switch it off."""
    axis, show = call.axis, call.progress()
    try:
        ended = axis.dwell(float(time), show)
    finally:
        call.end_progress()
    say_status(call, ended)


@moire.command(
    "reset",
    help="Clear the latched faults whose cause is gone. The drive stays off.",
    example="moire --port /dev/ttyUSB0 reset -- status",
)
def reset(call: Call) -> None:
    """The node refuses while a cause is still present."""
    call.axis.reset()
    call.say_of_axis({"faults": []}, f"{call.where}: no fault is latched")


def say_status(call: Call, status: Status, **built: Any) -> None:
    """Print a status with the words for its state, switches and faults."""
    values = {**status.values(), **built}
    possible = (
        (status.limit_low, "low end pressed"),
        (status.limit_high, "high end pressed"),
        (status.estop, "emergency stop pressed"),
    )
    switches = [text for pressed, text in possible if pressed]
    error_nm, length = status.target_nm - status.position_nm, call.described.length
    limited = ", at its limit" if status.saturated else ""
    rows = [
        ("position", f"{length(status.position_nm)}   {status.counts} counts"),
        ("target", f"{length(status.target_nm)}   error {error_nm:.1f} nm"),
        ("velocity", f"{status.velocity_mm_s:.4f} mm/s"),
        ("command", f"{100 * status.drive_command:.1f} %{limited}"),
        ("switches", ", ".join(switches) or "free"),
        ("faults", status.fault_words or "none"),
    ]
    if status.encoder_events:
        rows.append(("encoder", ", ".join(status.encoder_events)))
    if not built.get("sine", True):
        rows.append(("sensor", WITHOUT_SINE))
    if (speed := built.get("speed")) is not None:
        rows.append(("twin", f"{speed:.2f} simulated seconds per second"))
    homed = "zero known" if status.homed else "not homed"
    call.say_of_axis(values, table(f"{call.where}: {status.words}, {homed}", rows, 9))


def table(head: str, rows: list[tuple[str, str]], width: int) -> str:
    """A line with the axis, and a line for each value."""
    return "\n".join([head, *(f"  {name:<{width}} {text}" for name, text in rows)])
