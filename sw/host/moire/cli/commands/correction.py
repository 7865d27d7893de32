# SPDX-License-Identifier: Apache-2.0
"""The commands about the correction of sine and cosine: show, save, load, calibrate, freeze,
clear.
"""

import click

from moire.cli.commands.calibrate import calibration_values, calibration_words, save_correction
from moire.cli.files import read_json
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.tables import add_action_commands
from moire.cli.values import FILE
from moire.errors import BadFile
from moire.made.bus_tables import CALIBRATION_ACTIONS

group = Group(
    "correction",
    help="Show, save, load, change, freeze or clear the correction of sine and cosine.",
    example="moire --port /dev/ttyUSB0 correction load stage.json -- correction show",
)
moire.add_command(group)


@group.command(
    "show",
    help="Show the correction in force and the state of the calibration.",
    example="moire --port twin correction show",
)
def show(call: Call) -> None:
    """Offsets, gain, quadrature error and harmonics."""
    axis = call.axis
    state, values = axis.calibration(), axis.correction()
    sin_offset, cos_offset = values["sin_offset"] / 327.68, values["cos_offset"] / 327.68
    period_nm = float(axis.period_nm)
    harmonics = [
        f"{order}: {period_nm * (cosine**2 + sine**2) ** 0.5 / 2**24:.3f}"
        for order, (cosine, sine) in enumerate(zip(values["cosine"], values["sine"]), 1)
    ]
    rows = [
        f"{call.where}: {calibration_words(state)}",
        f"  offset            sine {sin_offset:.3f} %, cosine {cos_offset:.3f} % of full scale",
        f"  gain              {values['gain'] / 65536:.5f} of the sine",
        f"  quadrature error  {values['quadrature_error'] / 65536:.5f} of the cosine, "
        "added to the sine",
        f"  harmonics of the phase, nm: {', '.join(harmonics)}",
    ]
    call.say_of_axis(
        {"calibration": calibration_values(state), "correction": values}, "\n".join(rows)
    )


@group.command(
    "save",
    help="Save the correction in force in a JSON file.",
    example="moire --port twin correction save c.json",
)
@click.argument("file", metavar="FILE", type=FILE, help="The file to write.")
def save(call: Call, file: str) -> None:
    """For 'correction load'."""
    save_correction(call.axis, file)
    call.say_of_axis({"file": file}, f"correction saved in {file}")


@group.command(
    "load",
    help="Load the correction from a JSON file. All values are checked before the first is "
    "written.",
    example="moire --port twin correction load c.json",
)
@click.argument("file", metavar="FILE", type=FILE, help="The file of 'correction save'.")
def load(call: Call, file: str) -> None:
    """Puts it in force."""
    content = read_json(file)
    values = content.get("correction") if isinstance(content, dict) else None
    if not isinstance(values, dict):
        raise BadFile(f"the file {file} holds no correction: make one with 'moire correction save'")
    call.axis.set_correction(values)
    call.say_of_axis({"file": file}, f"correction loaded from {file}")


def act(call: Call, action: str) -> None:
    """An action of the calibration of the node."""
    state = call.axis.calibration(action)
    call.say_of_axis(
        {"calibration": calibration_values(state)}, f"{call.where}: {calibration_words(state)}"
    )


add_action_commands(group, CALIBRATION_ACTIONS, ("calibrate", "freeze", "clear"), act)
