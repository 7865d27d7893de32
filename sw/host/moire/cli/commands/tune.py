# SPDX-License-Identifier: Apache-2.0
"""The command tune."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from moire.cli.files import read_json, read_text, write_bytes, write_json, write_text
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import (
    DISTANCE,
    DURATION,
    FILE,
    FREQUENCY,
    NUMBER,
    SHARE_ABOVE_ZERO,
    SPEED,
    Name,
)
from moire.errors import BadFile

if TYPE_CHECKING:
    from moire.analysis import frequency_response, proposals
    from moire.analysis import tune as tuner


RESPONSE, STEPS = "response", "steps"


def contradiction(given: Mapping[str, Any]) -> str | None:
    """What is wrong with the options together."""
    if given["undo"]:
        others = [name for name in ("file", "bandwidth", "check", "write", "keep") if given[name]]
        return f"--undo and {others[0]} do not go together" if others else None
    if given["check"] and given["write"]:
        return "--check and --write do not go together: a check changes nothing"
    if given["check"] and given["bandwidth"] is not None:
        return "--check and --bandwidth do not go together: the axis has its gains"
    if given["file"] and given["method"] == RESPONSE:
        return "--method response and FILE do not go together: the response is measured now"
    if given["keep"] and not given["write"]:
        return "--keep goes with --write: nothing is replaced"
    return None


@moire.command(
    "tune",
    help="Measure how an axis responds, and propose gains, filters and feed-forward for its "
    "servo, with the margins that each would give; or check those that it has. By default the "
    "frequency response is measured in closed loop: a multisine is added to the commands while the "
    "axis moves slowly, and the node records error and command at each servo tick. That needs "
    "SCOPE_WORDS of rtl/node.sv and an axis that is homed. Else the axis is driven back and forth "
    "in open loop. See docs/tuning.md, and `moire fine` for the fine stage.",
    example="moire --port twin home -- tune --picture tuning.png --write",
    check=contradiction,
)
@click.argument(
    "file",
    required=False,
    type=FILE,
    metavar="FILE",
    help="A recorded response: each row has the command (full scale 32768) and the position (2^-16 "
    "periods) of one servo tick. Without it the axis is switched on and measured.",
)
@click.option(
    "--method",
    type=Name("method", (RESPONSE, STEPS)),
    metavar=f"{RESPONSE},{STEPS}",
    help="response: the frequency response in closed loop; steps: steps of the command in open "
    "loop. The default is response if the node can record it.",
)
@click.option(
    "--peak",
    type=SHARE_ABOVE_ZERO,
    default="15%",
    metavar="SHARE",
    help="The largest value of the multisine. The default is 15%.",
)
@click.option(
    "--speed",
    type=SPEED,
    metavar="SPEED",
    help="The speed of the axis while its frequency response is measured, such as 2mm/s; 0mm/s: "
    "it stays where it is. The default keeps the errors of sine and cosine away from what is "
    "measured.",
)
@click.option(
    "--records",
    type=click.IntRange(1, 100),
    default=2,
    metavar="N",
    help="Number of records of the frequency response, which are averaged. The default is 2.",
)
@click.option(
    "--lowest",
    type=FREQUENCY,
    default="1Hz",
    metavar="FREQUENCY",
    help="The lowest frequency of the frequency response. The default is 1Hz; what is below 20 Hz "
    "takes four fifths of the time.",
)
@click.option(
    "--points",
    type=FILE,
    metavar="CSV",
    help="Write the measured frequency response: plant, open loop, closed loop, coherence.",
)
@click.option(
    "--amplitude",
    type=SHARE_ABOVE_ZERO,
    default="20%",
    metavar="SHARE",
    help="The drive command of the steps. The default is 20%.",
)
@click.option(
    "--reach",
    type=DISTANCE,
    default="1mm",
    metavar="LENGTH",
    help="How far the axis may move with steps. The default is 1mm.",
)
@click.option(
    "--every",
    type=DURATION,
    default="2ms",
    metavar="TIME",
    help="The time from sample to sample with steps. The default is 2ms.",
)
@click.option(
    "--bandwidth",
    type=FREQUENCY,
    metavar="FREQUENCY",
    help="The bandwidth of the closed loop, such as 40Hz. Without it each proposal is as fast as "
    "the margins allow.",
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
@click.option("--write", is_flag=True, help="Write the fastest proposal to the axis.")
@click.option(
    "--keep",
    type=FILE,
    metavar="FILE",
    help="Keep the gains and filters that --write replaces in this file, for --undo.",
)
@click.option("--undo", type=FILE, metavar="FILE", help="Write gains and filters kept by --keep.")
def tune(
    call: Call,
    file: str | None,
    method: str | None,
    peak: Fraction,
    speed: Fraction | None,
    records: int,
    lowest: Fraction,
    points: str | None,
    amplitude: Fraction,
    reach: Fraction,
    every: Fraction,
    bandwidth: Fraction | None,
    margin: float,
    tick: Fraction | None,
    picture: str | None,
    check: bool,
    write: bool,
    keep: str | None,
    undo: str | None,
) -> None:
    """Measures, fits a model of the machine, and computes gains for it."""
    from moire.analysis import measured_plant, proposals, response_measurement, scope
    from moire.analysis import tune as tuner  # NumPy only where it is needed
    from moire.analysis.tick_scope import TickScope

    if undo:
        tuning = kept(undo)
        call.axis.set_tuning(tuning)
        call.say_of_axis({"undone": undo}, f"{call.where}: gains and filters of {undo} in force")
        return
    tick_s = float(tick or Fraction(1, call.node.identity.tick_hz))
    response = None
    identify: Callable[[], tuner.Plant]
    if file is not None:
        identify = partial(tuner.identify, tuner.Record(*read_record(file), tick_s))
    elif method == RESPONSE or (method is None and TickScope(call.axis).words()):
        nm_s = None if speed is None else speed * 1_000_000
        response = response_measurement.measure(
            call.switch_on(), peak, nm_s, records, float(lowest)
        )
        if points:
            write_text(points, response.csv())
        identify = partial(measured_plant.fit, response)
    else:
        record = scope.excite(call.switch_on(), amplitude, every, reach)
        identify = partial(tuner.identify_samples, *scope.lsb(record), tick_s)
    current = response_measurement.in_force(call.axis)
    wished_hz = None if bandwidth is None else float(bandwidth)
    has_filters = call.axis.built().has("filters")
    with call.session.computing():
        plant = identify()
        if check:
            found = [proposals.judged(plant, proposals.IN_FORCE, current)]
        else:
            found = proposals.of(plant, current, margin, wished_hz, has_filters)
        drawn = proposals.picture(plant, found) if picture else b""
    if picture:
        write_bytes(picture, drawn)
    if check:
        tuner.check(plant, current)
    chosen = found[0] if check else proposals.best(found)
    if write:
        if keep:
            write_json(keep, {name: getattr(current, name) for name in KEPT})
        call.axis.set_tuning(chosen.tuning)
    gains = {name: chosen.tuning.real(name) for name in tuner.SCALES}
    written = (
        "in force" if check else f"written to {call.where}" if write else "not written: add --write"
    )
    rows = [
        plant_in_words(plant),
        *(response_in_words(response) if response else ()),
        *(in_words(one) for one in found),
        *(f"  {name:<3} {value:.8g}" for name, value in gains.items()),
        f"{chosen.name}, filters: {len(chosen.tuning.filters)}; {written}",
    ]
    call.say_of_axis(
        {
            "plant": {name: getattr(plant, name) for name in PLANT},
            "proposals": [
                {
                    "name": one.name,
                    "bandwidth_hz": one.tuning.bandwidth_hz,
                    "phase_margin_degree": one.tuning.phase_margin_degree,
                    "gain_margin_db": one.gain_margin_db,
                    "sensitivity": one.sensitivity,
                    "overshoot": one.overshoot,
                    "settling_s": one.settling_s,
                }
                for one in found
            ],
            "gains": gains,
            "filters": chosen.tuning.filters,
            "bandwidth_hz": chosen.tuning.bandwidth_hz,
            "phase_margin_degree": chosen.tuning.phase_margin_degree,
            "gain_margin": chosen.tuning.gain_margin,
            "written": write,
        },
        "\n".join(rows),
    )


PLANT = ("a", "b", "delay", "part", "tick_s", "unexplained", "resonance_hz", "damping")
KEPT = ("kp", "ki", "kd", "kv", "ka", "filters")


def plant_in_words(plant: tuner.Plant) -> str:
    """The fitted model."""
    resonance = f", resonance at {plant.resonance_hz:.0f} Hz" if plant.resonance_hz else ""
    if plant.damping is not None:
        resonance += f" with a damping of {100 * plant.damping:.1f} %"
    return (
        f"plant: {plant.gain:.4g} LSB per tick per command, "
        f"time constant {1e3 * plant.time_constant_s:.3g} ms, "
        f"delay {plant.delay + plant.part:.3g} ticks{resonance}, "
        f"{100 * plant.unexplained:.0f} % unexplained"
    )


def response_in_words(response: frequency_response.Response) -> list[str]:
    """What was measured."""
    clear = response.clear
    return [
        f"response: {len(response.hz)} frequencies from {response.hz[0]:.3g} to "
        f"{response.hz[-1]:.3g} Hz, {response.periods} periods, crest factor "
        f"{response.crest:.2f}, coherence {response.coherence.min():.2f} at least"
        + ("" if clear.all() else f"; {int((~clear).sum())} frequencies are not clear")
    ]


def in_words(one: proposals.Proposal) -> str:
    """A proposal with what it gives."""
    if not one.stable:
        return f"loop, {one.name}: unstable"
    tuning = one.tuning
    return (
        f"loop, {one.name}: {tuning.bandwidth_hz:.1f} Hz, "
        f"phase margin {tuning.phase_margin_degree:.0f} degrees, "
        f"gain margin {one.gain_margin_db:.1f} dB, "
        f"disturbances amplified {one.sensitivity:.2f} times at most, "
        f"step: {100 * one.overshoot:.0f} % over, settled after {1e3 * one.settling_s:.0f} ms"
    )


def kept(file: str) -> tuner.Tuning:
    """The gains and filters of a file that --keep wrote; raises BadFile."""
    from moire.analysis import response_measurement

    content = read_json(file)
    try:
        gains = {name: int(content[name]) for name in KEPT if name != "filters"}
        filters = tuple(tuple(int(value) for value in values) for values in content["filters"])
        if any(len(values) != 5 for values in filters):
            raise ValueError
    except (KeyError, TypeError, ValueError):
        raise BadFile(
            f"the file {file} has no gains and filters: `moire tune --write --keep` makes one"
        ) from None
    return response_measurement.made(gains, filters)


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
