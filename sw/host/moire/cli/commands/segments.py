# SPDX-License-Identifier: Apache-2.0
"""The commands about the segment table of an axis: segments status, load, use, save."""

from dataclasses import asdict
from typing import Any

import click

from moire.analysis import report
from moire.cli.files import write_bytes
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import FILE, Name
from moire.client.segments import USES, Segments, read_table, text_of
from moire.units import format_length

POINTS = 16  # of a picture, per segment

group = Group(
    "segments",
    help="Show, load, use and save the table that corrects the errors of a scale (S0).",
    example="moire --port twin home -- segments load scale.csv -- segments status",
)
moire.add_command(group)


@group.command(
    "status",
    help="Show whether the table is in force, and why not.",
    example="moire --port /dev/ttyUSB0 segments status",
)
def status(call: Call) -> None:
    """One read-back."""
    say_status(call, Segments(call.axis).status())


@group.command(
    "load",
    help="Read a table from a file, write it to the node, read it back and put it in force.",
    example="moire --port /dev/ttyUSB0 home -- segments load scale.csv --picture scale.png",
)
@click.argument(
    "file",
    type=FILE,
    metavar="FILE",
    help="CSV: position and error (the reading of the scale minus the true position) at the "
    "borders of equal segments, in mm and nm unless the cells or the heading name other units.",
)
@click.option(
    "--rectangle",
    is_flag=True,
    help="Each segment has the mean error of its borders (S0). Without it straight lines connect "
    "the borders.",
)
@click.option("--picture", type=FILE, metavar="PNG", help="Draw the error before and after.")
@click.option("--dry", is_flag=True, help="Only read and draw; write nothing to the node.")
def load(call: Call, file: str, rectangle: bool, picture: str | None, dry: bool) -> None:
    """A table that does not fit leaves the present one in force."""
    table, use = read_table(file), "rectangle" if rectangle else "linear"
    length, first = format_length(table.length), format_length(table.first)
    read = f"{table.segments} segments of {length} from {first} on"
    if picture:
        write_bytes(picture, draw(table, use))
    if dry:
        call.say_of_axis({"segments": table.segments}, f"{read}; nothing written")
    else:
        say_status(call, Segments(call.axis).load(table, use), f"{read}; ")


@group.command(
    "use",
    help="Switch the loaded table off, or use it as rectangles (S0) or as straight lines.",
    example="moire --port /dev/ttyUSB0 segments use off",
)
@click.argument(
    "use", type=Name("use", USES), metavar=",".join(USES), help="How the table is used."
)
def choose_use(call: Call, use: str) -> None:
    """The table stays in the node."""
    say_status(call, Segments(call.axis).use(use))


@group.command(
    "save",
    help="Save the table of the node in a CSV file.",
    example="moire --port /dev/ttyUSB0 segments save scale.csv",
)
@click.argument(
    "file", type=FILE, metavar="FILE", help="CSV with the columns position / mm and error / nm."
)
def save(call: Call, file: str) -> None:
    """For 'segments load'."""
    table = Segments(call.axis).read()
    write_bytes(file, text_of(table).encode())
    call.say_of_axis(
        {"file": file, "segments": table.segments}, f"{table.segments} segments saved in {file}"
    )


def say_status(call: Call, state: Any, before: str = "") -> None:
    """Print whether the table is in force."""
    call.say_of_axis(asdict(state), f"{call.where}: {before}{state.words()}")


def draw(table: Any, use: str) -> bytes:
    """The error of the scale before and after the correction."""
    figure, (before, after) = report.drawing(height=6.0, nrows=2, sharex=True)
    fine = [table.first + n * table.length / POINTS for n in range(table.segments * POINTS)]
    mm = [float(position) / 1e6 for position in fine]
    errors = [float(table.at(position)) for position in fine]
    corrections = [float(table.at(position, use)) for position in fine]
    left = [error - correction for error, correction in zip(errors, corrections)]
    before.plot(mm, errors, color="#555555", linewidth=1, label="error of the scale")
    before.plot(mm, corrections, color=report.colour(0), linewidth=1.2, label="correction")
    after.plot(mm, left, color=report.colour(1), linewidth=1, label="remaining error")
    after.set_xlabel("position / mm")
    for panel in (before, after):
        panel.set_ylabel("error / nm")
    report.legend(figure, before)
    image: bytes = report.png(figure)
    return image
