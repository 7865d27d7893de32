# SPDX-License-Identifier: Apache-2.0
"""The command that plays a path from a file: stream."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import click

from moire.analysis import report
from moire.cli.commands.motion import TAKE, run_motion
from moire.cli.files import write_bytes
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import FILE, TIME
from moire.client.stream import Cubic, Point, read_points
from moire.units import format_length, format_time

POINTS = 16  # of a picture, per row


@moire.command(
    "stream",
    help="Play a path of points (time, position, velocity) from a file, with a cubic between two "
    "points. The axis moves to the first point first; the drive is switched on if it is off.",
    example="moire --port /dev/ttyUSB0 home -- stream path.csv --picture path.png",
)
@click.argument(
    "file",
    type=FILE,
    metavar="FILE",
    help="CSV: time, position and velocity, in ms, mm and mm/s unless the cells or the heading "
    "name other units; the velocity is 0 in the first and in the last row.",
)
@click.option(
    "--late-limit",
    type=TIME,
    default="10ms",
    metavar="TIME",
    help="How long the node continues at constant velocity when a point has not come in time, "
    "before it stops under control; 0 to 100ms. The default is 10ms.",
)
@click.option("--picture", type=FILE, metavar="PNG", help="Draw position and velocity.")
@click.option("--dry", is_flag=True, help="Only read and draw; send nothing to the node.")
@TAKE
def stream(
    call: Call, file: str, late_limit: Fraction, picture: str | None, dry: bool, take: bool
) -> None:
    """Returns when the axis has settled at the last point."""
    points = read_points(file)
    if picture:
        write_bytes(picture, draw(points))
    if dry:
        seconds = points[-1].time_s - points[0].time_s
        call.say_of_axis(
            {"points": len(points), "duration_s": float(seconds)},
            f"{len(points)} points, {format_time(seconds)} from "
            f"{format_length(points[0].position_nm)} to {format_length(points[-1].position_nm)}; "
            "nothing sent",
        )
        return
    if take:
        call.axis.take_over()
    call.axis.require_streams()
    run_motion(call, lambda axis, show: axis.stream(points, late_limit, show), "begin_stream")


def draw(points: Sequence[Point]) -> bytes:
    """Position and velocity of the path."""
    figure, (position, velocity) = report.drawing(height=6.0, nrows=2, sharex=True)
    cubics = [Cubic(before, point) for before, point in pairwise(points)]
    fine = [(cubic, cubic.time * n / POINTS) for cubic in cubics for n in range(POINTS + 1)]
    begin = points[0].time_s
    times = [float(cubic.begin.time_s - begin + s) for cubic, s in fine]
    rows = [float(point.time_s - begin) for point in points]
    position.plot(
        times, [float(cubic.position_nm(s)) / 1e6 for cubic, s in fine], color=report.colour(0)
    )
    position.plot(rows, [float(point.position_nm) / 1e6 for point in points], ".", color="#555555")
    velocity.plot(
        times, [float(cubic.velocity_mm_s(s)) for cubic, s in fine], color=report.colour(1)
    )
    velocity.plot(rows, [float(point.velocity_mm_s) for point in points], ".", color="#555555")
    velocity.set_xlabel("time / s")
    position.set_ylabel("position / mm")
    velocity.set_ylabel("velocity / (mm/s)")
    image: bytes = report.png(figure)
    return image
