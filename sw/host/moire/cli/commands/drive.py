# SPDX-License-Identifier: Apache-2.0
"""The command drive."""

from dataclasses import asdict

from moire import units
from moire.cli.commands.axis import table
from moire.cli.parser import moire
from moire.cli.session import Call


@moire.command(
    "drive",
    help="Show what drives the axis: its drive command, the steps sent and the fine stage.",
    example="moire --port /dev/ttyUSB0 drive",
)
def show_drive(call: Call) -> None:
    """One read-back of the actuator."""
    drive = call.axis.drive()
    values = asdict(drive)
    values["drive_command"] = values.pop("command")
    rows = [
        ("drive", f"{drive.kind}; built: {', '.join(drive.built) or 'none'}"),
        ("command", f"{100 * drive.command:.1f} %"),
        ("override", f"{units.decimal(round(100 * drive.override, 3))} %"),
        ("steps", f"{drive.steps} on the wire since reset"),
    ]
    if "fine" in drive.built:
        rows.append(("fine", f"{100 * drive.fine_command:.1f} %"))
    call.say_of_axis(values, table(f"{call.where}:", rows, 9))
