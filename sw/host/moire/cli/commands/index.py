# SPDX-License-Identifier: Apache-2.0
"""The command about the index of an encoder: index survey."""

from dataclasses import asdict

import click

from moire import units
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.client.index_survey import PASSES
from moire.client.records import IndexSurvey

group = Group(
    "index",
    help="Survey the index (reference mark) of an encoder.",
    example="moire --port /dev/ttyUSB0 index survey -- params save-to-node",
)
moire.add_command(group)


@group.command(
    "survey",
    help="Measure where the index lies between the edges of A and B, set index_gate so that every "
    "search finds the same count, and home the axis. The drive is switched on if it is off. It "
    "warns if the index lies on an edge of A or B for every gate.",
    example="moire --port /dev/ttyUSB0 index survey -- params save-to-node",
)
@click.option(
    "--passes",
    type=click.IntRange(2, 1000),
    default=PASSES,
    metavar="N",
    help=f"Passes over each edge of the index. The default is {PASSES}.",
)
def survey(call: Call, passes: int) -> None:
    """Returns when the axis is at rest and its zero is known."""
    axis = call.switch_on()
    try:
        found = axis.survey_index(call.overwrite if call.watched else None, passes)
    finally:
        call.end_progress()
    values = {**asdict(found), "warning_words": found.warning_words}
    call.say_of_axis(values, f"{call.where}: {survey_words(found)}")


def survey_words(found: IndexSurvey) -> str:
    """The result in one line, and the warning in a second one."""

    def written(nm: float) -> str:
        return units.format_length(round(nm))

    text = (
        f"index {written(found.width_nm)} wide, edges met within {written(found.scatter_nm)}; "
        f"index_gate {found.gate}, {written(found.margin_nm)} clear of the edges of A and B "
        f"(needed {written(found.least_margin_nm)})"
    )
    if found.warnings:
        text += f"\nWARNING {', '.join(found.warnings)}: {found.warning_words}"
    return text
