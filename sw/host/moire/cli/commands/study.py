# SPDX-License-Identifier: Apache-2.0
"""The command study: tolerances of a machine, tried in the twin."""

import click

from moire.bus.twin_port import of_checkout
from moire.cli.files import read_text
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import FILE, POSITIVE, TEXT, WHOLE
from moire.errors import OutOfRange


@moire.command(
    "study",
    help="Try the tolerances of a machine in the twin: the distribution of its positioning error, "
    "its yield, and which tolerances matter.",
    example="moire study study.toml --runs 200",
    check=lambda given: (
        None
        if bool(given["file"]) != given["example"]
        else "write the FILE of a study, or --example"
    ),
)
@click.argument(
    "file",
    type=FILE,
    required=False,
    metavar="FILE",
    help="TOML: the machine, its specification, what is measured, and a distribution of each "
    "effect. docs/study.md explains it.",
)
@click.option("--example", is_flag=True, help="Print a study with all effects and their sources.")
@click.option(
    "--dry-run", is_flag=True, help="Check the file; show what would be run and how long it takes."
)
@click.option(
    "--runs",
    type=WHOLE,
    metavar="N",
    help="How many machines are drawn. Without it the file says it. More runs later repeat "
    "nothing.",
)
@click.option(
    "--seed",
    type=POSITIVE,
    default=1,
    metavar="N",
    help="The seed of all that is random. The default is 1.",
)
@click.option(
    "--workers",
    type=POSITIVE,
    metavar="N",
    help="How many runs this computer does at once. The default is the number of its cores.",
)
@click.option(
    "--scheduler",
    type=TEXT,
    default="",
    metavar="tcp://HOST:8786",
    help="The Dask scheduler of a cluster that does the runs.",
)
@click.option(
    "--results",
    type=FILE,
    metavar="DIR",
    help="The directory or object store of the results. The default is build/study of the "
    "checkout.",
)
def study(
    call: Call,
    file: str | None,
    example: bool,
    dry_run: bool,
    runs: int | None,
    seed: int,
    workers: int | None,
    scheduler: str,
    results: str | None,
) -> None:
    """The runs that are done are kept: the same command goes on where it was interrupted."""
    if runs is not None and runs < 0:
        raise OutOfRange("--runs takes 0 and up")
    studies = of_checkout("moire.commands", "study", "a study")
    if file is None:
        text = studies.example()
        call.say({"example": text}, text.rstrip("\n"))
        return
    answer = studies.carry_out(
        read_text(file), file, runs, seed, workers, scheduler, results, dry_run
    )
    call.say(answer.values, answer.text)
