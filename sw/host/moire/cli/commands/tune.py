# SPDX-License-Identifier: Apache-2.0
"""The command tune."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import click

from moire.cli.files import read_text, write_bytes
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import DISTANCE, DURATION, FILE, FREQUENCY, NUMBER, SHARE_ABOVE_ZERO
from moire.errors import BadFile

if TYPE_CHECKING:
    from moire.analysis import tune as tuner
    from moire.client.axis import Axis


def contradiction(given: Mapping[str, Any]) -> str | None:
    """What is wrong with the options together."""
    if given["check"] and given["write"]:
        return "--check and --write do not go together: a check changes nothing"
    if given["check"] and given["bandwidth"] is not None:
        return "--check and --bandwidth do not go together: the axis has its gains"
    if not given["check"] and given["bandwidth"] is None:
        return "--bandwidth is missing"
    return None


@moire.command(
    "tune",
    help="Compute the gains of the servo from the open-loop response of the axis, which is "
    "recorded now or read from a file, or check those that the axis has. See `moire fine` for the "
    "fine stage.",
    example="moire --port /dev/ttyUSB0 tune --bandwidth 40Hz --picture tuning.png",
    check=contradiction,
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
    type=FREQUENCY,
    metavar="FREQUENCY",
    help="The bandwidth of the closed loop, such as 40Hz. Only --check needs none.",
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
@click.option(
    "--check",
    is_flag=True,
    help="Compute the loop with the gains and filters that the axis has. Too little margin is an "
    "error, which says what to change.",
)
@click.option("--write", is_flag=True, help="Write gains and filters to the axis.")
def tune(
    call: Call,
    file: str | None,
    amplitude: Fraction,
    reach: Fraction,
    every: Fraction,
    bandwidth: Fraction | None,
    margin: float,
    tick: Fraction | None,
    picture: str | None,
    check: bool,
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
    if check:
        tuning = tuner.with_margins(plant, tuning_of(call.axis))
    else:
        assert bandwidth is not None, "contradiction() has seen to it"
        tuning = tuner.propose(plant, float(bandwidth), margin)
    if picture:
        write_bytes(picture, tuner.picture(plant, tuning))
    if check:
        tuner.check(plant, tuning)
    if write:
        call.axis.set_tuning(tuning)
    gains = {name: tuning.real(name) for name in tuner.SCALES}
    resonance = f", resonance at {plant.resonance_hz:.0f} Hz" if plant.resonance_hz else ""
    written = (
        "in force" if check else f"written to {call.where}" if write else "not written: add --write"
    )
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


def tuning_of(axis: Axis) -> tuner.Tuning:
    """The gains and filters that an axis has."""
    from moire.analysis import tune as tuner

    gains, filters = axis.tuning()
    return tuner.Tuning(
        **gains,
        filters=tuple((b0, b1, b2, a1, a2) for b0, b1, b2, a1, a2 in filters),
        bandwidth_hz=0.0,
        phase_margin_degree=0.0,
        gain_margin=0.0,
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
