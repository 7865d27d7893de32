# SPDX-License-Identifier: Apache-2.0
"""The commands that move axes: home, move, finish, prepare, start, override, pause, resume."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import click

from moire import units
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import AXIS_OF_A_NODE, HOME_METHOD, LENGTH, SHARE
from moire.client.axis import Axis
from moire.client.records import Status

TARGET = click.argument(
    "target",
    type=LENGTH,
    metavar="LENGTH",
    help="The target with its unit, such as 1.5mm, 200um or 50nm.",
)
BY = click.option(
    "--by", is_flag=True, help="LENGTH is a distance from the present target, not a position."
)

TAKE = click.option(
    "--take",
    is_flag=True,
    help="If another client of the bus moves the axis, stop it and take the axis over.",
)


@moire.command(
    "home",
    help="Find the zero position. The drive is switched on if it is off.",
    example="moire --port twin home -- status",
)
@click.option(
    "--method",
    type=HOME_METHOD,
    metavar="METHOD",
    help="1, 2, 17, 18, 33, 34, 35 or 37 of CiA 402; s0: limit switch, distance, phase zero; s3: "
    "reference mark from either side. The default is the parameter home_method.",
)
@TAKE
def home(call: Call, method: str | None, take: bool) -> None:
    """Returns when the axis is at rest and its zero is known."""
    if take:
        call.axis.take_over()
    run_motion(call, lambda axis, show: axis.home(progress=show, method=method))


@moire.command(
    "move",
    help="Move to a position, or by a distance. The drive is switched on if it is off.",
    example="moire --port twin home -- move 1.5mm -- move -200um --by",
)
@TARGET
@BY
@click.option(
    "--no-wait",
    is_flag=True,
    help="Only start the motion; pause, resume, stop or finish may follow.",
)
@TAKE
def move(call: Call, target: Fraction, by: bool, no_wait: bool, take: bool) -> None:
    """Returns when the axis has settled at its target."""
    if take:
        call.axis.take_over()
    if no_wait:
        seconds = call.switch_on("move").begin_move(nm=target, by=by)
        say_duration(call, "on its way", seconds)
    else:
        run_motion(call, lambda axis, show: axis.move(nm=target, by=by, progress=show), "move")


@moire.command(
    "finish",
    help="Wait until the present motion has ended.",
    example="moire --port twin home -- move 1mm --no-wait -- finish",
)
def finish(call: Call) -> None:
    """The motion was started by 'move --no-wait', 'resume' or another call."""
    run_motion(call, lambda axis, show: axis.motion_end(show))


@moire.command(
    "prepare",
    help="Plan a move for a common start of several axes. The drive is switched on if it is off.",
    example="moire --port /dev/ttyUSB0 prepare 1mm --axis 0 -- prepare 2mm --axis 1 -- start 0 1",
)
@TARGET
@BY
def prepare(call: Call, target: Fraction, by: bool) -> None:
    """The axis does not move yet."""
    seconds = call.switch_on("prepare").prepare(nm=target, by=by)
    say_duration(call, "prepared", seconds)


@moire.command(
    "start",
    help="Start the prepared moves of several axes at the same instant, and wait for all of them.",
    example="moire --port /dev/ttyUSB0 start 0 1",
)
@click.argument(
    "axes",
    nargs=-1,
    required=True,
    type=AXIS_OF_A_NODE,
    metavar="AXIS",
    help="The number of the axis, or address and axis such as 2.0. Several nodes start within a "
    "microsecond.",
)
def start(call: Call, axes: tuple[tuple[int | None, int], ...]) -> None:
    """Axes without an address are axes of the node of --address."""
    bus, show = call.bus, call.progress()
    places = list(dict.fromkeys((address or call.options.address, axis) for address, axis in axes))
    began = call.now()
    try:
        if len({address for address, _ in places}) == 1:
            ended = bus.node(places[0][0]).start(*(axis for _, axis in places), progress=show)
        else:
            ended = bus.start(*(bus.axis(*place) for place in places), progress=show)
    finally:
        call.end_progress()
    seconds = call.now() - began
    reports = [
        {
            "address": address,
            "axis": axis,
            "position_nm": status.position_nm,
            "error_nm": status.target_nm - status.position_nm,
        }
        for (address, axis), status in zip(places, ended)
    ]
    described = call.session.description.at
    rows = [
        f"node {address} axis {axis}: at {described(address, axis).length(report['position_nm'])}, "
        f"error {report['error_nm']:.1f} nm"
        for (address, axis), report in zip(places, reports)
    ]
    call.say({"axes": reports, "time_s": seconds}, "\n".join(rows))


@moire.command(
    "override",
    help="Show or change the feed override of all motions, also during motion.",
    example="moire --port /dev/ttyUSB0 override 50%",
)
@click.argument(
    "share",
    required=False,
    type=SHARE,
    metavar="SHARE",
    help="0% to 100% of full speed, or 0 to 1. Without it the command only shows the override.",
)
def override(call: Call, share: Fraction | None) -> None:
    """The share of full speed at which motions run."""
    say_override(call, call.axis.override(share))


@moire.command(
    "pause",
    help="Pause a motion: the axis stops on its path.",
    example="moire --port twin home -- move 1mm --no-wait -- pause -- resume",
)
def pause(call: Call) -> None:
    """The override becomes 0."""
    call.axis.pause()
    say_override(call, 0)


@moire.command(
    "resume",
    help="Continue a paused motion, at full speed if another call has paused it.",
    example="moire --port /dev/ttyUSB0 resume -- finish",
)
def resume(call: Call) -> None:
    """The override becomes what it was before the pause."""
    say_override(call, call.axis.resume())


def run_motion(
    call: Call, motion: Callable[[Axis, Callable[[Status], None] | None], Status], name: str = ""
) -> None:
    """Carry out a motion of an axis whose drive is on, and say where it ended. It has a name if it
    needs a zero.
    """
    axis, show = call.switch_on(name), call.progress()
    began = call.now()
    try:
        status = motion(axis, show)
    finally:
        call.end_progress()
    seconds = call.now() - began
    error_nm = status.target_nm - status.position_nm
    values = {
        "position_nm": status.position_nm,
        "target_nm": status.target_nm,
        "error_nm": error_nm,
        "time_s": seconds,
    }
    call.say_of_axis(
        values,
        f"{call.where}: at {call.described.length(status.position_nm)}, error {error_nm:.1f} nm, "
        f"after {seconds:.3f} s",
    )


def say_duration(call: Call, state: str, seconds: float) -> None:
    """Print how long a motion will take."""
    call.say_of_axis(
        {"duration_s": seconds}, f"{call.where}: {state}, {seconds:.3f} s at full speed"
    )


def say_override(call: Call, share: Any) -> None:
    """Print the feed override."""
    words = f"{units.decimal(round(100 * share, 3))} % of full speed" if share else "paused"
    call.say_of_axis({"override": share}, f"{call.where}: {words}")
