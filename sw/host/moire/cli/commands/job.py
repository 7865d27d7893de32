# SPDX-License-Identifier: Apache-2.0
"""The commands about the job of a main node: job load, read, status, start, wait, pause, resume,
stop, answer.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import click

from moire.cli.files import write_text
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.tables import add_action_commands
from moire.cli.values import ADDRESS, FILE, WHOLE, Name
from moire.client.indexing_table import angle_text
from moire.client.job import Job, JobState, equal_parts, read_stations
from moire.client.names import CAUSE_CODES
from moire.errors import MotionFailed
from moire.made.bus_tables import JOB_ACTIONS

ANSWERS = ("again", "next", "resume", "stop")
TABLE = click.option(
    "--table",
    type=ADDRESS,
    metavar="N",
    help="The address of the sub-node. It is polled too, so that its bus watchdog leaves its drive "
    "on.",
)

group = Group(
    "job",
    help="Load, start, watch and control the job of a main node (S4), which cuts one station after "
    "the other.",
    example="moire --port /dev/ttyUSB0 job start --wait",
)
moire.add_command(group)


def one_source(arguments: Mapping[str, Any]) -> str | None:
    """The stations come from one source."""
    if (arguments["file"] is None) == (arguments["equal"] is None):
        return "give either FILE or --equal N"
    return None


@group.command(
    "load",
    help="Write the stations of a job, and the settings with them, into the EEPROM of the node.",
    example="moire --port /dev/ttyUSB0 job load former.csv",
    check=one_source,
)
@click.argument(
    "file",
    required=False,
    type=FILE,
    metavar="FILE",
    help="CSV: each line is the angle of a station, in degrees or with its unit.",
)
@click.option(
    "--equal", type=WHOLE, metavar="N", help="Divide a turn into this number of equal parts."
)
def load(call: Call, file: str | None, equal: int | None) -> None:
    """All angles are checked before the first is written."""
    angles = equal_parts(equal) if equal is not None else read_stations(file or "")
    program = Job(call.node).load(angles)
    first, last = angle_text(program.angles[0]), angle_text(program.angles[-1])
    call.say(
        {"stations": len(program.angles), "generation": program.generation},
        f"{len(program.angles)} stations from {first} to {last}, saved in the EEPROM",
    )


@group.command(
    "read",
    help="Read the stations that are stored in the node.",
    example="moire --port /dev/ttyUSB0 job read former.csv",
)
@click.argument(
    "file",
    required=False,
    type=FILE,
    metavar="FILE",
    help="The CSV file to write. Without it the command prints the stations.",
)
def read(call: Call, file: str | None) -> None:
    """For 'job load'."""
    program = Job(call.node).read()
    if not program.angles:
        raise MotionFailed(
            program.cause, CAUSE_CODES[program.cause], "the node has no list of stations"
        )
    text = "\n".join(f"{float(angle / 3600):.7f}" for angle in program.angles)
    if file is not None:
        write_text(file, text + "\n")
        text = f"{len(program.angles)} stations in {file}"
    angles = [float(angle) for angle in program.angles]
    call.say({"generation": program.generation, "angles": angles}, text)


@group.command(
    "status",
    help="Show the state of the job, why it waits, and which answers it takes.",
    example="moire --port /dev/ttyUSB0 job status",
)
def status(call: Call) -> None:
    """One read-back."""
    say_state(call, Job(call.node).state())


@group.command(
    "start",
    help="Cut all stations from the first one on.",
    example="moire --port /dev/ttyUSB0 job start --wait",
)
@click.option(
    "--wait",
    is_flag=True,
    help="Wait until all stations are cut. The exit code is 1 when a person has to answer.",
)
@TABLE
def start(call: Call, wait: bool, table: int | None) -> None:
    """Without --wait the command returns at once."""
    job = Job(call.node)
    job.start()
    if wait:
        wait_for_end(call, table)
    else:
        say_state(call, job.state())


@group.command(
    "wait",
    help="Wait until all stations are cut. The exit code is 1 when a person has to answer.",
    example="moire --port /dev/ttyUSB0 job wait --table 2",
)
@TABLE
def wait(call: Call, table: int | None) -> None:
    """For a job that is already under way."""
    wait_for_end(call, table)


def act(call: Call, action: str) -> None:
    """Carry out an action, and show the state after it."""
    job = Job(call.node)
    job.do(action)
    say_state(call, job.state())


add_action_commands(group, JOB_ACTIONS, ("pause", "resume", "stop"), act)


@group.command(
    "answer",
    help="Say what to do with a station of which the node does not know whether it was cut.",
    example="moire --port /dev/ttyUSB0 job answer next",
)
@click.argument(
    "answer",
    type=Name("answer", ANSWERS),
    metavar=",".join(ANSWERS),
    help="again: cut it again; next: it is cut; resume: wait for the end of the cut; stop: end the "
    "job.",
)
def answer(call: Call, answer: str) -> None:
    """'job status' shows which answers the node takes."""
    act(call, answer)


def wait_for_end(call: Call, table: int | None) -> None:
    """Wait for the end of the job, or for a question."""
    progress: Callable[[JobState], object] | None = None
    if table is not None:
        axis = call.bus.axis(table)
        progress = lambda _: axis.status()
    state = Job(call.node).wait(progress)
    say_state(call, state)
    if state.cause != "ok":
        raise MotionFailed(
            state.cause, CAUSE_CODES[state.cause], f"the job waits: {state.cause_words}"
        )


def say_state(call: Call, state: JobState) -> None:
    """Print the state of the job."""
    rows = [state.words]
    if state.cause != "ok":
        rows.append(f"  because  {state.cause_words}")
    if state.answers:
        rows.append(f"  takes    {', '.join(state.answers)}")
    rows.append(f"  node     {state.flag_words or 'nothing answers'}")
    call.say(
        {**asdict(state), "words": state.words, "cause_words": state.cause_words}, "\n".join(rows)
    )
