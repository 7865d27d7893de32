# SPDX-License-Identifier: Apache-2.0
"""The command replay, for what the option --record has written."""

import click

from moire.bus import recording
from moire.bus.transport import BAUD
from moire.cli.files import read_text
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import FILE


@moire.command(
    "replay",
    help="Send a recorded session again, at the same times, and compare the answers.",
    example="moire --port twin replay session.jsonl",
)
@click.argument(
    "file", type=FILE, metavar="FILE", help="A recording made by 'moire --record FILE ...'."
)
@click.option(
    "--show", is_flag=True, help="Only describe in words what was sent; this needs no port."
)
def replay(call: Call, file: str, show: bool) -> None:
    """Differences are an error."""
    calls = recording.read(read_text(file), file)
    if show:
        rows = recording.listing(calls)
        call.say({"said": rows}, "\n".join(rows))
        return
    left_at = recording.last_baud(calls)
    if left_at is not None:
        call.bus.require_direct_bus()
        call.bus.baud_changed = left_at != BAUD  # the end of this call restores the first rate
    result = recording.replay(calls, call.bus.transport)
    call.say(
        {
            "same": result.same,
            "other_values": result.other_values,
            "different": result.different,
            "first_difference": result.first or None,
        },
        result.words,
    )
    if result.different:
        raise recording.ReplayDiffers(
            f"{result.different} answers differ from the record: {result.first}"
        )
