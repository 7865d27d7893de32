# SPDX-License-Identifier: Apache-2.0
"""The commands `moire segments …`: the segment table of an axis. The command line adds them to its
parser.
"""

from dataclasses import asdict

from moire.analysis import report
from moire.client.segments import USES, Segments, read_table, text_of
from moire.units import format_length


def add_to(group, command, write_bytes):
    """group: the sub-parsers of `segments`; command(name, handler, text, example, under): makes one
    of them.
    """
    command(
        "status",
        do_status,
        "whether the table is in force, and why not",
        "moire --port /dev/ttyUSB0 segments status",
        group,
    )
    load = command(
        "load",
        do_load,
        "read a table, write it into the node, read it back and put it in force",
        "moire --port /dev/ttyUSB0 home -- segments load scale.csv --picture scale.png",
        group,
    )
    load.add_argument(
        "file",
        metavar="FILE",
        help="CSV: position, error (what the scale shows there less the true place) at the borders "
        "of equal segments; mm and nm unless cells or heading name other units",
    )
    load.add_argument(
        "--rectangle",
        action="store_true",
        help="a segment has the mean of its borders (S0); else straight lines",
    )
    load.add_argument("--picture", metavar="PNG", help="the error before and after")
    load.add_argument(
        "--dry", action="store_true", help="read and draw only, write nothing to the node"
    )
    use = command(
        "use",
        do_use,
        "the loaded table: off, rectangle (S0) or linear",
        "moire --port /dev/ttyUSB0 segments use off",
        group,
    )
    use.add_argument("use", choices=USES)
    save = command(
        "save",
        do_save,
        "the table that the node holds, as CSV",
        "moire --port /dev/ttyUSB0 segments save scale.csv",
        group,
    )
    save.add_argument("file", metavar="FILE", help="CSV: position / mm, error / nm")
    for made in (load, save):
        made.set_defaults(write_bytes=write_bytes)


def node_and_axis(command) -> dict:
    return {
        "command": command.command,
        "action": command.action,
        "address": command.address,
        "axis": command.axis,
    }


def say(session, command, status, more=""):
    session.say(
        {**node_and_axis(command), **asdict(status)},
        f"node {command.address} axis {command.axis}: {more}{status.words()}",
    )


def do_status(session, command):
    say(session, command, Segments(session.axis(command)).status())


def do_use(session, command):
    say(session, command, Segments(session.axis(command)).use(command.use))


def do_load(session, command):
    table, use = read_table(command.file), "rectangle" if command.rectangle else "linear"
    read = f"{table.segments} segments of {format_length(table.length)} from {format_length(table.first)} on"
    if command.picture:
        command.write_bytes(command.picture, picture(table, use))
    if command.dry:
        session.say(
            {**node_and_axis(command), "segments": table.segments}, f"{read}; nothing written"
        )
    else:
        say(session, command, Segments(session.axis(command)).load(table, use), f"{read}; ")


def do_save(session, command):
    table = Segments(session.axis(command)).read()
    command.write_bytes(command.file, text_of(table).encode())
    session.say(
        {**node_and_axis(command), "file": command.file, "segments": table.segments},
        f"{table.segments} segments saved in {command.file}",
    )


def picture(table, use: str, points: int = 16) -> bytes:
    """The error of the scale before and after, straight lines drawn between the borders."""
    figure, (before, after) = report.drawing(height=6.0, nrows=2, sharex=True)
    fine = [table.first + n * table.length / points for n in range(table.segments * points)]
    mm = [float(place) / 1e6 for place in fine]
    before.plot(
        mm,
        [float(table.at(place)) for place in fine],
        color="#555555",
        linewidth=1,
        label="error of the scale",
    )
    before.plot(
        mm,
        [float(table.at(place, use)) for place in fine],
        color=report.colour(0),
        linewidth=1.2,
        label="taken off",
    )
    after.plot(
        mm,
        [float(table.at(place) - table.at(place, use)) for place in fine],
        color=report.colour(1),
        linewidth=1,
        label="left",
    )
    after.set_xlabel("position / mm")
    for panel in (before, after):
        panel.set_ylabel("error / nm")
    report.legend(figure, before)
    return report.png(figure)
