# SPDX-License-Identifier: Apache-2.0
"""The commands about positions that are captured at events: capture from, now, read."""

from dataclasses import asdict

import click

from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import Name
from moire.client.capture import CAPTURE_SOURCES

group = Group(
    "capture",
    help="Capture positions at events, and read them.",
    example="moire --port /dev/ttyUSB0 capture from probe_0_rising -- wait 1s -- capture read",
)
moire.add_command(group)


@group.command(
    "from",
    help="Switch on the sources that capture positions, and switch off all others.",
    example="moire --port twin capture from software",
)
@click.argument(
    "sources",
    nargs=-1,
    metavar="SOURCE",
    type=Name("source", CAPTURE_SOURCES),
    help=f"Any of {', '.join(CAPTURE_SOURCES)}.",
)
def capture_from(call: Call, sources: tuple[str, ...]) -> None:
    """Without a source nothing captures."""
    call.axis.capture_from(*sources)
    call.say_of_axis(
        {"sources": sources}, f"{call.where}: captures from {', '.join(sources) or 'nothing'}"
    )


@group.command(
    "now",
    help="Capture the position now. The source software must be on.",
    example="moire --port twin capture from software -- capture now",
)
def capture_now(call: Call) -> None:
    """One capture by software."""
    call.axis.capture_now()
    call.say_of_axis({}, f"{call.where}: captured")


@group.command(
    "read",
    help="Read the stored captures, oldest first, and remove them from the node.",
    example="moire --port twin capture read --json",
)
def capture_read(call: Call) -> None:
    """Each with its sources, its time and the age of its sample."""
    captures, lost = call.axis.captures()
    rows = [f"{call.where}: {len(captures)} captures"]
    if lost:
        rows[0] += ", MORE WERE LOST: read more often"
    for capture in captures:
        rows.append(
            f"  {capture.position_nm / 1e6:.6f} mm at cycle {capture.time_clk}, "
            f"its sample {capture.age_s * 1e6:.2f} us before: {', '.join(capture.sources)}"
        )
    call.say_of_axis(
        {"captures": [asdict(capture) for capture in captures], "lost": lost}, "\n".join(rows)
    )
