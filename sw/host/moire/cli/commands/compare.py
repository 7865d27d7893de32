# SPDX-License-Identifier: Apache-2.0
"""The commands about pulses at positions: compare from, off, show."""

from dataclasses import asdict
from fractions import Fraction

import click

from moire import units
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import DURATION, LENGTH, POSITIVE

group = Group(
    "compare",
    help="Send pulses at equidistant positions.",
    example="moire --port twin home -- compare from 1mm 10um --count 50 -- move 2mm",
)
moire.add_command(group)


@group.command(
    "from",
    help="Send pulses at START, START + STEP, START + 2 STEP and so on.",
    example="moire --port twin compare from 1mm 10um --pulse 2us",
)
@click.argument(
    "start", type=LENGTH, metavar="START", help="The position of the first pulse, with its unit."
)
@click.argument(
    "step",
    type=LENGTH,
    metavar="STEP",
    help="The distance to the next pulse, with its unit; it is negative for downward motion.",
)
@click.option(
    "--count",
    type=POSITIVE,
    default=0,
    metavar="N",
    help="The number of pulses. Without it the pulses have no end.",
)
@click.option(
    "--pulse",
    type=DURATION,
    default="1us",
    metavar="TIME",
    help="The length of a pulse. The default is 1us.",
)
@click.option(
    "--gap",
    type=DURATION,
    default="1us",
    metavar="TIME",
    help="The shortest gap between two pulses. The default is 1us.",
)
def compare_from(
    call: Call, start: Fraction, step: Fraction, count: int, pulse: Fraction, gap: Fraction
) -> None:
    """The pulses begin when the axis passes START."""
    call.axis.compare_from(start, step, count, pulse, gap)
    call.say_of_axis(
        {"start_nm": start, "step_nm": step, "count": count},
        f"{call.where}: pulses from {units.format_length(start)} "
        f"every {units.format_length(step)}, count: {count or 'no end'}",
    )


@group.command(
    "off",
    help="Send no more pulses.",
    example="moire --port twin compare off",
)
def compare_off(call: Call) -> None:
    """At once."""
    call.axis.compare_off()
    call.say_of_axis({}, f"{call.where}: no more pulses")


@group.command(
    "show",
    help="Show how many points the axis has passed.",
    example="moire --port twin compare show",
)
def compare_show(call: Call) -> None:
    """And whether a pulse came late."""
    compare = call.axis.compare()
    state = "under way" if compare.armed else "off"
    late = ", some pulses came late: the gap is too long for the speed" if compare.late else ""
    call.say_of_axis(
        asdict(compare), f"{call.where}: {state}, {compare.passed} points passed{late}"
    )
