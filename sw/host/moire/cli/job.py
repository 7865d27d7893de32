# SPDX-License-Identifier: Apache-2.0
"""The commands `moire job …`: the program of stations of a main node, and its job. The command line
adds them to its parser:

add_to(group, command)
"""

from dataclasses import asdict
from pathlib import Path

from moire.client.indexing_table import angle_text
from moire.client.job import Job, equal_parts, read_stations
from moire.client.names import CAUSE_CODES
from moire.errors import BadFile, MotionFailed

ANSWERS = ("again", "next", "resume", "stop")


def add_to(group, command):
    """group(name, text, example=): the sub-parsers of a new command; command(name, handler, text,
    example, under): one of them.
    """
    job = group(
        "job",
        "the job of a main node (S4): stations, cut one after the other",
        example="moire --port /dev/ttyUSB0 job start --wait",
    )
    load = command(
        "load",
        do_load,
        "write a program of stations, and the settings with it, into the EEPROM",
        "moire --port /dev/ttyUSB0 job load former.csv",
        job,
    )
    source = load.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "file",
        nargs="?",
        metavar="FILE",
        help="CSV: a line for each station, its angle in degrees or with a unit",
    )
    source.add_argument("--equal", type=int, metavar="N", help="so many equal parts of a turn")
    read = command(
        "read",
        do_read,
        "the program that is stored",
        "moire --port /dev/ttyUSB0 job read former.csv",
        job,
    )
    read.add_argument("file", nargs="?", metavar="FILE", help="CSV; to the screen unless given")
    command(
        "status",
        do_status,
        "what the job does, why it waits, and for which answers",
        "moire --port /dev/ttyUSB0 job status",
        job,
    )
    start = command(
        "start",
        do_start,
        "cut all stations from the first one on",
        "moire --port /dev/ttyUSB0 job start --wait",
        job,
    )
    start.add_argument(
        "--wait",
        action="store_true",
        help="until all are cut; ends with 1 when a person has to answer",
    )
    wait = command(
        "wait",
        do_wait,
        "until all are cut; ends with 1 when a person has to answer",
        "moire --port /dev/ttyUSB0 job wait --table 2",
        job,
    )
    for waits in (start, wait):
        waits.add_argument(
            "--table",
            type=int,
            metavar="N",
            help="address of the sub-node: it is asked too, so that its line watchdog "
            "leaves its drive on",
        )
    for name, text in (
        ("pause", "stand before the next cut"),
        ("resume", "go on"),
        ("stop", "end the job; a cut under way goes on"),
    ):
        command(name, do_action, text, f"moire --port /dev/ttyUSB0 job {name}", job)
    answer = command(
        "answer",
        do_answer,
        "what to do with a station of which it is not known whether it was cut",
        "moire --port /dev/ttyUSB0 job answer next",
        job,
    )
    answer.add_argument(
        "answer",
        choices=ANSWERS,
        help="again: cut it again; next: it is cut; resume: wait for the end of the cut; stop",
    )


def job_of(session, options):
    return Job(session.bus.node(options.address))


def say_state(session, state):
    rows = [state.words]
    if state.cause != "ok":
        rows.append(f"  because  {state.cause_words}")
    if state.answers:
        rows.append(f"  takes    {', '.join(state.answers)}")
    rows.append(f"  node     {state.flag_words or 'nothing answers'}")
    session.say(
        {**asdict(state), "words": state.words, "cause_words": state.cause_words}, "\n".join(rows)
    )


def do_status(session, options):
    say_state(session, job_of(session, options).state())


def do_action(session, options):
    job = job_of(session, options)
    job.do(options.action)
    say_state(session, job.state())


def do_answer(session, options):
    job = job_of(session, options)
    job.do(options.answer)
    say_state(session, job.state())


def do_start(session, options):
    job = job_of(session, options)
    job.start()
    if options.wait:
        do_wait(session, options)
    else:
        say_state(session, job.state())


def do_wait(session, options):
    table = None if options.table is None else session.bus.axis(options.table)
    state = job_of(session, options).wait(table and (lambda state: table.status()))
    say_state(session, state)
    if state.cause != "ok":
        raise MotionFailed(
            state.cause, CAUSE_CODES[state.cause], f"the job waits: {state.cause_words}"
        )


def do_load(session, options):
    angles = read_stations(options.file) if options.file else equal_parts(options.equal)
    program = job_of(session, options).load(angles)
    session.say(
        {"stations": len(program.angles), "generation": program.generation},
        f"{len(program.angles)} stations from {angle_text(program.angles[0])} to {angle_text(program.angles[-1])}, kept in the EEPROM",
    )


def do_read(session, options):
    program = job_of(session, options).read()
    if not program.angles:
        raise MotionFailed(program.cause, CAUSE_CODES[program.cause], "the node has no program")
    text = "\n".join(f"{float(angle / 3600):.7f}" for angle in program.angles)
    if options.file:
        try:
            Path(options.file).write_text(text + "\n", encoding="utf-8")
        except OSError as error:
            raise BadFile(f"{options.file} cannot be written: {error.strerror}") from None
        text = f"{len(program.angles)} stations in {options.file}"
    session.say(
        {"generation": program.generation, "angles": [float(angle) for angle in program.angles]},
        text,
    )
