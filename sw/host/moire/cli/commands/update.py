# SPDX-License-Identifier: Apache-2.0
"""The command that writes new firmware into a node: update."""

from dataclasses import asdict

import click

from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import FILE
from moire.client.update import read_firmware, update, update_state


@moire.command(
    "update",
    help="Write new firmware into a node whose firmware comes out of a flash, start it, and keep "
    "it once it answers. A power cut at any moment leaves the firmware before.",
    example="moire --port /dev/ttyUSB0 --address 3 update counter_serial_update.update",
)
@click.argument(
    "file",
    type=FILE,
    metavar="FILE",
    required=False,
    help="Made by the firmware build with --update, with the end .update. Without it the command "
    "says what the node runs.",
)
def update_firmware(call: Call, file: str | None) -> None:
    """All drives of the node must be off."""
    address = call.options.address
    if file is None:
        state = update_state(call.bus, address)
        call.say({"address": address, **asdict(state)}, f"node {address} runs {state.words}")
        return
    firmware = read_firmware(file)

    def show(words: str, share: float) -> None:
        call.overwrite(f"{words}, {share:.0%} of {len(firmware.program)} bytes")

    began = call.now()
    try:
        state = update(call.bus, address, firmware, show if call.watched else None)
    finally:
        call.end_progress()
    seconds = call.now() - began
    call.say(
        {"address": address, **asdict(state), "time_s": seconds},
        f"node {address} runs {state.words}, confirmed; {len(firmware.program)} bytes written in "
        f"{seconds:.1f} s",
    )
