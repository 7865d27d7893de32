# SPDX-License-Identifier: Apache-2.0
"""The command `moire replay`, and the option --record that makes what it takes."""

from moire.bus import recording
from moire.bus.transport import BAUD
from moire.errors import BadFile


def add_to(command):
    replay = command(
        "replay",
        do_replay,
        "send a recorded session again, at the same times, and compare the answers",
        "moire --port twin replay session.jsonl",
    )
    replay.add_argument("file", metavar="FILE", help="made by 'moire --record FILE …'")
    replay.add_argument(
        "--show", action="store_true", help="only tell in words what was said; needs no port"
    )


def recorded(transport, file: str):
    """The transport, everything on it written to a file."""
    try:
        opened = open(
            file, "w", encoding="utf-8", buffering=1
        )  # a line at a time: whole up to where it broke off
    except OSError as error:
        transport.close()
        raise BadFile(f"the file {file} cannot be written: {error.strerror}") from None
    return recording.Recorder(transport, opened)


def do_replay(session, command):
    calls = recording.read(session.read_text(command.file), command.file)
    if command.show:
        rows = recording.listing(calls)
        session.say({"command": "replay", "said": rows}, "\n".join(rows))
        return
    left_at = recording.last_baud(calls)
    if left_at is not None:
        session.bus.require_direct_bus()
        session.bus.baud_changed = (
            left_at != BAUD
        )  # then the end of this call brings the first rate back
    result = recording.replay(calls, session.bus.transport)
    session.say(
        {
            "command": "replay",
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
