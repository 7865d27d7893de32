# SPDX-License-Identifier: Apache-2.0
"""The commands that measure the correction of sine and cosine: calibrate, commission."""

from dataclasses import asdict
from fractions import Fraction
from typing import Any

import click

from moire.cli.files import write_json
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import DISTANCE, DURATION, FILE
from moire.client.axis import Axis
from moire.client.records import CalibrationState


@moire.command(
    "calibrate",
    help="Calibrate offset, gain, phase and harmonics of sine and cosine from scratch while the "
    "axis moves back and forth, then freeze the correction.",
    example="moire --port /dev/ttyUSB0 home -- calibrate -- correction save stage.json",
)
@click.option(
    "--distance",
    type=DISTANCE,
    default="1mm",
    metavar="LENGTH",
    help="How far the axis moves from its present position. The default is 1mm.",
)
@click.option(
    "--timeout",
    type=DURATION,
    default="120s",
    metavar="TIME",
    help="The command gives up after this time. The default is 120s.",
)
def calibrate(call: Call, distance: Fraction, timeout: Fraction) -> None:
    """Returns when the correction no longer changes."""
    run_calibration(call, distance, timeout)


@moire.command(
    "commission",
    help="Home the axis if its zero is unknown, calibrate it, and save the correction in a file.",
    example="moire --port /dev/ttyUSB0 commission stage.json",
)
@click.argument("file", metavar="FILE", type=FILE, help="JSON, for 'moire correction load'.")
def commission(call: Call, file: str) -> None:
    """All that a new sensor needs."""
    axis = call.switch_on()
    if not axis.status().homed:
        try:
            axis.home(call.progress())
        finally:
            call.end_progress()
    run_calibration(call)
    save_correction(axis, file)


def run_calibration(call: Call, *how: Fraction) -> None:
    """Calibrate by motion, and say how well the correction is known."""
    axis = call.switch_on()

    def show(state: CalibrationState) -> None:
        call.overwrite(calibration_words(state))

    began = call.now()
    try:
        state = axis.calibrate(show if call.watched else None, *how)
    finally:
        call.end_progress()
    seconds = call.now() - began
    call.say_of_axis(
        {**calibration_values(state), "time_s": seconds},
        f"{call.where}: calibrated in {seconds:.1f} s; "
        f"correction known to {state.scatter_nm:.3f} nm, frozen",
    )


def save_correction(axis: Axis, file: str) -> None:
    """Write the correction in force to a JSON file."""
    write_json(file, {"correction": axis.correction()})


def calibration_values(state: CalibrationState) -> dict[str, Any]:
    """The state of the calibration for JSON."""
    return {**asdict(state), "words": state.words}


def calibration_words(state: CalibrationState) -> str:
    """The state of the calibration in one line."""
    known = f"settled, known to {state.scatter_nm:.3f} nm" if state.settled else "not settled"
    return f"{state.words}; {known} ({state.accepted} accepted, {state.refused} refused)"
