# SPDX-License-Identifier: Apache-2.0
"""The commands about the loop of the fine stage: fine check and fine tune."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeVar

import click

from moire.cli.files import write_bytes
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import FILE, SHARE_ABOVE_ZERO

if TYPE_CHECKING:
    from moire.analysis import fine

group = Group(
    "fine",
    help="Measure the response of the fine stage, check its gains with it, or compute new ones.",
    example="moire --port /dev/ttyUSB0 fine check --picture fine.png",
)
moire.add_command(group)

Function = TypeVar("Function", bound=Callable[..., None])
OPTIONS = (
    click.option(
        "--amplitude",
        type=SHARE_ABOVE_ZERO,
        default="0.4%",
        metavar="SHARE",
        help="The DAC steps between minus and plus this share of full scale. The default is 0.4%.",
    ),
    click.option(
        "--steps",
        type=click.IntRange(3, 100),
        default=6,
        metavar="N",
        help="Number of steps, which are averaged. The default is 6.",
    ),
    click.option(
        "--picture",
        type=FILE,
        metavar="FILE",
        help="Draw the response with its model, the open loop and its sensitivity, as PNG.",
    ),
)


def measuring(function: Function) -> Function:
    """The options of a command that measures the response."""
    for option in reversed(OPTIONS):
        function = option(function)
    return function


@group.command(
    "check",
    help="Measure the response of the fine stage in open loop, and compute the loop with the gains "
    "that the axis has. Gains without enough margin are an error, which says what to change. The "
    "drive is switched on if it is off, and the axis must stand where the fine stage is used.",
    example="moire --port /dev/ttyUSB0 fine check --picture fine.png",
)
@measuring
def check(call: Call, amplitude: Fraction, steps: int, picture: str | None) -> None:
    """The picture is drawn before the gains are refused."""
    from moire.analysis import fine  # NumPy only where it is needed

    plant = measured(call, amplitude, steps)
    axis = call.axis
    gains = fine.Gains(*(axis.get_parameter(name).counts for name in fine.NAMES))
    if picture:
        with call.session.computing():
            drawn = fine.picture(plant, gains)
        write_bytes(picture, drawn)
    say(call, plant, gains, fine.check(plant, gains), "in force", {})


@group.command(
    "tune",
    help="Measure the response of the fine stage in open loop, and compute gains for it: a pure "
    "integrator, or with --damped a faster loop whose derivative damps the resonance.",
    example="moire --port /dev/ttyUSB0 fine tune --write",
)
@measuring
@click.option(
    "--damped",
    is_flag=True,
    help="Damp the resonance: for a soft flexure on a floor that moves. It needs a short delay.",
)
@click.option("--write", is_flag=True, help="Write the gains to the axis.")
def tune(
    call: Call,
    amplitude: Fraction,
    steps: int,
    picture: str | None,
    damped: bool,
    write: bool,
) -> None:
    """Nothing is written that the check refuses."""
    from moire.analysis import fine

    plant = measured(call, amplitude, steps)
    gains = fine.propose(plant, damped)
    if picture:
        with call.session.computing():
            drawn = fine.picture(plant, gains)
        write_bytes(picture, drawn)
    found = fine.check(plant, gains)
    if write:
        for name in fine.NAMES:
            call.axis.write_parameter(name, gains.counts(name))
    where = f"written to {call.where}" if write else "not written: add --write"
    say(call, plant, gains, found, where, {"written": write})


def measured(call: Call, amplitude: Fraction, steps: int) -> fine.Plant:
    """The fine stage as it responds now."""
    from moire.analysis import fine, fine_steps

    return fine.identify(fine_steps.measure(call.switch_on(), amplitude, steps))


def say(
    call: Call,
    plant: fine.Plant,
    gains: fine.Gains,
    found: fine.Loop,
    where: str,
    more: dict[str, Any],
) -> None:
    """The response and what the gains give with it."""
    from moire.analysis import fine

    resonance_hz, amplification = plant.peak
    rows = [
        f"fine stage: {plant.model.gain:.4g} LSB of position per LSB of the DAC, resonance at "
        f"{resonance_hz:.0f} Hz, amplified {amplification:.1f} times, "
        f"delay {1e3 * plant.delay_s:.2f} ms, {100 * plant.unexplained:.0f} % unexplained",
        f"loop: {found.crossover_hz:.1f} Hz, "
        f"phase margin {found.phase_margin_degree:.0f} degrees, "
        f"gain margin {found.gain_margin:.2f}, "
        f"sensitivity {found.sensitivity:.2f} at most, at {found.worst_hz:.0f} Hz",
        *(f"  {name} {gains.real(name):.8g}" for name in fine.NAMES),
        f"gains: {where}",
    ]
    call.say_of_axis(
        {
            "gain": plant.model.gain,
            "resonance_hz": resonance_hz,
            "amplification": amplification,
            "delay_s": plant.delay_s,
            "unexplained": plant.unexplained,
            "model": asdict(plant.model),
            "gains": {name: gains.real(name) for name in fine.NAMES},
            "loop": asdict(found),
            **more,
        },
        "\n".join(rows),
    )
