# SPDX-License-Identifier: Apache-2.0
"""The command tune."""

import re
from dataclasses import asdict
from fractions import Fraction

import click

from moire.cli.files import read_text, write_bytes
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import DISTANCE, DURATION, FILE, FREQUENCY, NUMBER, SHARE_ABOVE_ZERO
from moire.errors import BadFile


@moire.command(
    "tune",
    help="Compute the gains of the servo from the open-loop response of the axis, which is "
    "recorded now or read from a file.",
    example="moire --port /dev/ttyUSB0 tune --bandwidth 40Hz --picture tuning.png",
)
@click.argument(
    "file",
    required=False,
    type=FILE,
    metavar="FILE",
    help="A recorded response: each row has the command (full scale 32768) and the position (2^-16 "
    "periods) of one servo tick. Without it the axis is switched on and driven back and forth.",
)
@click.option(
    "--amplitude",
    type=SHARE_ABOVE_ZERO,
    default="20%",
    metavar="SHARE",
    help="The drive command of the open loop. The default is 20%.",
)
@click.option(
    "--reach",
    type=DISTANCE,
    default="1mm",
    metavar="LENGTH",
    help="How far the axis may move in open loop. The default is 1mm.",
)
@click.option(
    "--every",
    type=DURATION,
    default="2ms",
    metavar="TIME",
    help="The time from sample to sample of the recording. The default is 2ms.",
)
@click.option(
    "--bandwidth",
    required=True,
    type=FREQUENCY,
    metavar="FREQUENCY",
    help="The bandwidth of the closed loop, such as 40Hz.",
)
@click.option(
    "--margin",
    type=NUMBER,
    default=50.0,
    metavar="DEGREES",
    help="The phase margin. The default is 50 degrees.",
)
@click.option(
    "--tick",
    type=DURATION,
    metavar="TIME",
    help="The servo tick of the recording. The default is the servo tick of the node.",
)
@click.option(
    "--picture", type=FILE, metavar="FILE", help="Draw Bode plot and step response, as PNG."
)
@click.option("--write", is_flag=True, help="Write gains and filters to the axis.")
def tune(
    call: Call,
    file: str | None,
    amplitude: Fraction,
    reach: Fraction,
    every: Fraction,
    bandwidth: Fraction,
    margin: float,
    tick: Fraction | None,
    picture: str | None,
    write: bool,
) -> None:
    """Fits a model of the machine and computes gains for it."""
    from moire.analysis import scope
    from moire.analysis import tune as tuner  # NumPy only where it is needed

    tick_s = float(tick or Fraction(1, call.node.identity.tick_hz))
    if file is None:
        record = scope.excite(call.switch_on(), amplitude, every, reach)
        times, commands, positions = scope.lsb(record)
        plant = tuner.identify_samples(times, commands, positions, tick_s)
    else:
        plant = tuner.identify(tuner.Record(*read_record(file), tick_s))
    tuning = tuner.propose(plant, float(bandwidth), margin)
    if picture:
        write_bytes(picture, tuner.picture(plant, tuning))
    if write:
        call.axis.set_tuning(tuning)
    gains = {name: tuning.real(name) for name in tuner.SCALES}
    resonance = f", resonance at {plant.resonance_hz:.0f} Hz" if plant.resonance_hz else ""
    written = f"written to {call.where}" if write else "not written: add --write"
    rows = [
        f"plant: {plant.gain:.4g} LSB per tick per command, "
        f"time constant {1e3 * plant.time_constant_s:.3g} ms, "
        f"delay {plant.delay} ticks{resonance}, {100 * plant.unexplained:.0f} % unexplained",
        f"loop: {tuning.bandwidth_hz:.1f} Hz, "
        f"phase margin {tuning.phase_margin_degree:.0f} degrees, "
        f"gain margin {tuning.gain_margin:.2f}",
        *(f"  {name:<3} {value:.8g}" for name, value in gains.items()),
        f"filters: {len(tuning.filters)}; {written}",
    ]
    call.say_of_axis(
        {
            "plant": asdict(plant),
            "gains": gains,
            "filters": tuning.filters,
            "bandwidth_hz": tuning.bandwidth_hz,
            "phase_margin_degree": tuning.phase_margin_degree,
            "gain_margin": tuning.gain_margin,
            "written": write,
        },
        "\n".join(rows),
    )


def read_record(file: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Commands and positions, from rows of two numbers; a first row of words is skipped."""
    rows = [
        row.split(",")
        for row in read_text(file).splitlines()
        if row.strip() and not row.startswith("#")
    ]
    try:
        rows = rows[1:] if rows and not re.match(r"\s*[+-]?[0-9.]", rows[0][0]) else rows
        command, position = zip(*((float(left), float(right)) for left, right in rows))
    except ValueError:
        raise BadFile(
            f"the file {file} is no record: each row has two numbers, command and position, with a "
            "comma between"
        ) from None
    return command, position
