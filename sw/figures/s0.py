# SPDX-License-Identifier: Apache-2.0
"""Figures of S0: the X-Y stage, its line, its node, its twin."""

import itertools
import random

import numpy as np

from experiments import s0_stage
from figures.common import Figure, bar, console
from figures.synthesis import synthesise
from moire.bus.protocol import (
    TO_NODE,
    Exchange,
    State,
    frame,
    parse_reply,
    read_words,
    ready_byte,
    request_body,
    write_words,
)
from moire.errors import BusError
from moire.made.bus_tables import PARAMETERS
from twin import FrameBench, build, cells_of, realtime_factor
from twin.nodes.twin import CLK_HZ

SEED = 1
SETTLE_TIME = PARAMETERS["settle_time"].id
ADDRESS = 1
READY = ready_byte(ADDRESS, TO_NODE)
CELLS = 11  # of a character on the line
TURNAROUND = [
    1
] * 3  # cells before the master speaks again: the node's driver lets go of the line meanwhile
ANSWER_CELLS = 150  # of silence after which no answer comes any more
READINGS = 8  # of a zero
WORK_CELLS = 400  # that a request may take, at the low clk of the bench


def homed_stage(progress):
    stage = s0_stage.Stage.power_up(SEED)
    stage.find()
    task = progress.add_task("", total=len(stage.axes))
    for name in stage.axes:
        stage.home(name)
        progress.advance(task)
    return stage


def s0_coarse_um_max(count=100):
    with bar("homing") as progress:
        stage = homed_stage(progress)
    with bar("moves") as progress:
        task = progress.add_task("", total=count)
        moves = s0_stage.random_moves(stage, count, SEED, done=lambda move: progress.advance(task))
    errors, times = (
        np.array([getattr(move, name) for move in moves]) for name in ("error_nm", "time_s")
    )
    console.print(
        f"true position - target: max {np.abs(errors).max():.1f} nm, rms {np.sqrt((errors**2).mean()):.1f} nm, "
        f"mean {errors.mean():.1f} nm; a move takes {np.median(times):.2f} s (median), {times.max():.2f} s at most"
    )
    return np.abs(errors).max() / 1000


def apart_nm(stage):
    """True place less position; the place is the mean of those before and after the answer."""
    before = stage.true_nm("X", from_zero=False)
    position = stage.axes["X"].status().position_nm
    return (before + stage.true_nm("X", from_zero=False)) / 2 - float(position)


def s0_home_spread_nm():
    source, readings = random.Random(SEED), []
    stage = s0_stage.Stage.power_up(SEED)
    stage.find()
    with bar("homings from random places") as progress:
        task = progress.add_task("", total=20)
        for _ in range(20):
            stage.home("X")
            stage.dwell(0.05)
            readings.append([apart_nm(stage) for _ in range(READINGS)])
            progress.advance(task)
            stage.move("X", source.uniform(-0.5e6, 1.5e6))
    zeros, single = np.mean(readings, axis=1), np.ptp(readings)
    console.print(
        f"zero at {zeros.mean():.2f} nm, rms {zeros.std():.2f} nm; the switch scatters by +-200 nm. Each zero is the mean of "
        f"{READINGS} readings, since the axis moves while it holds: single ones spread by {single:.1f} nm"
    )
    return np.ptp(zeros)


# ------------------------------------------------------------------ the line


def requests(source):
    """Bodies of every length that a host sends, with a sequence number that differs from the one
    before.
    """
    for number in itertools.count(1):
        parameter, value, target = (
            source.randrange(1, 33),
            source.randrange(1, 10000),
            source.randrange(-1 << 40, 1 << 40),
        )
        operation, fields = source.choice(
            (
                ("identify", {}),
                ("status", {"axis": 0}),
                ("get_parameter", {"axis": 0, "parameter": parameter}),
                ("set_parameter", {"axis": 0, "parameter": SETTLE_TIME, "value": value}),
                ("move", {"axis": 0, "target": target}),
            )
        )
        yield request_body(operation, number % 256, **fields)


def damaged(cells, source):
    """The cells with one, two or three of them turned over, none twice."""
    cells = list(cells)
    for place in source.sample(range(len(cells)), source.randint(1, 3)):
        cells[place] ^= 1
    return cells


def heard(cells):
    """Words that a PC's port makes of bit cells: a character begins with a low cell; it counts
    without a stop bit too, a break does not.
    """
    words, place, idle = [], 0, True
    while place <= len(cells) - CELLS:
        if cells[place] or not idle:
            idle, place = bool(cells[place]), place + 1
            continue
        idle, word = (
            bool(cells[place + CELLS - 1]),
            sum(bit << n for n, bit in enumerate(cells[place + 1 : place + 10])),
        )
        if idle or word:
            words.append(word)
        place += CELLS
    return words


def node_answer(bench):
    """What the node has to say: its last reply, None if it is not whole."""
    words = bench.exchange(TURNAROUND + cells_of(read_words(ADDRESS)), quiet_cells=ANSWER_CELLS)
    if len(words) < 7 or list(frame(words[0], bytes(words[2:-4]))) != words[1:]:
        return None, words
    return parse_reply(bytes(words[2:-4])), words


class Judge:
    """Says whether a node has accepted a frame: it repeats its last reply until then. The sequence
    number of the new reply does not
    matter, since the damage may lie in that of the frame. Only a frame with the number of the one
    before would go unseen, which the
    node takes for a repetition and does not carry out."""

    def __init__(self, reply):
        self.last = reply

    def accepted(self, reply):
        changed, self.last = reply != self.last, reply
        return changed


def s0_bus_wrong(frames=100_000, make_bench=FrameBench):
    """Each frame damaged on its way to the node, and the node's reply damaged on its way to the
    host. Every hundredth frame
    goes undamaged and must be accepted, so that the count of zero means something."""
    source, bench = random.Random(SEED), make_bench(ADDRESS)
    wrong = wrong_host = lost = good = 0
    judge, bodies = Judge(node_answer(bench)[0]), requests(source)
    with bar("damaged frames") as progress:
        task = progress.add_task("", total=frames)
        for number in range(frames + frames // 100):
            body, whole = next(bodies), number % 101 == 100
            command, payload = (
                cells_of(write_words(ADDRESS)),
                cells_of(list(frame(write_words(ADDRESS)[0] & 0xFF, body))),
            )
            cells = command + payload
            sent = cells if whole else damaged(cells, source)
            ready = bench.exchange(
                TURNAROUND + sent[: len(command)], enough=1, quiet_cells=ANSWER_CELLS
            )
            if ready and ready != [
                READY
            ]:  # the damage made a command to reply of it: hear the node out
                bench.exchange(TURNAROUND, quiet_cells=ANSWER_CELLS)
            if bench.exchange(
                TURNAROUND + sent[len(command) :], enough=1, quiet_cells=ANSWER_CELLS // 2
            ):
                bench.exchange(TURNAROUND, quiet_cells=ANSWER_CELLS)
            if whole:
                bench.idle(WORK_CELLS)
            reply, words = node_answer(bench)
            if reply is None:
                lost += 1
                continue
            accepted = judge.accepted(reply)
            good += whole and accepted and reply.sequence == body[0]
            wrong += not whole and accepted
            if not whole:
                progress.advance(task)
                exchange = Exchange(ADDRESS, bytes([reply.sequence, reply.operation]), tries=1)
                exchange.feed([READY])
                exchange.feed(heard(damaged(cells_of(words), source) + [1] * CELLS))
                wrong_host += (
                    exchange.state == State.DONE and exchange.reply != reply
                )  # only the last stop bit hit: it is whole
    console.print(
        f"{frames} damaged requests: {wrong} accepted by the node; their replies damaged: {wrong_host} accepted by the host; "
        f"{good} of {frames // 100} undamaged requests between them accepted; answers missing afterwards: {lost}"
    )
    if good != frames // 100 or lost:
        raise BusError(
            ADDRESS, f"the node missed {frames // 100 - good} undamaged frames and {lost} answers"
        )
    return wrong + wrong_host


# ------------------------------------------------------------------ node and twin


def node_ecp5_mhz():
    build.firmware()
    found = synthesise(
        "node",
        {"CLK_HZ": 60_000_000, "HAS_STEPPER": 0, "FIRMWARE": "build/firmware/firmware.hex"},
    )
    used = ", ".join(
        f"{found[name]} of {found[f'{name}_of']} {words}"
        for name, words in (
            ("lut", "LUT"),
            ("ff", "FF"),
            ("block_ram", "block RAM"),
            ("dsp", "DSP"),
        )
    )
    console.print(f"LFE5U-25F-6, one axis with bridge, converter, fine stage and filters: {used}")
    return found["fmax_mhz"]


def twin_realtime():
    console.print(f"CLK_HZ {CLK_HZ}, two nodes and their machines, one core")
    return realtime_factor(simulated_s=0.5)


FIGURES = {
    "s0_coarse_um_max": Figure(
        s0_coarse_um_max,
        "um",
        "largest |true position - target| of 100 random moves (0.1 um to 2 mm), motor only",
        "at most 0.05 (paper 0.8)",
        lambda v: v <= 0.05,
        4,
    ),
    "s0_home_spread_nm": Figure(
        s0_home_spread_nm,
        "nm",
        "spread of the zero point over 20 homings from random places",
        "at most 5",
        lambda v: v <= 5,
        2,
    ),
    "s0_bus_wrong": Figure(
        s0_bus_wrong,
        "frames",
        "frames accepted wrongly in 10^5 with one to three flipped bits, each way",
        "0",
        lambda v: v == 0,
        0,
    ),
    "node_ecp5_mhz": Figure(
        node_ecp5_mhz,
        "MHz",
        "S0 node placed and routed for LFE5U-25F-6",
        "at least 60",
        lambda v: v >= 60,
        1,
    ),
    "twin_realtime": Figure(
        twin_realtime,
        "s/s",
        "simulated seconds per second of one core, two nodes and their machines",
        "at least 0.3",
        lambda v: v >= 0.3,
        2,
    ),
}


def soaked(name, *arguments):
    value = FIGURES[name].measure(*arguments)
    return value, FIGURES[name].good(value)


SOAK = {
    "s0_moves": lambda: soaked("s0_coarse_um_max", 5000),
    "s0_bus": lambda: soaked("s0_bus_wrong", 2_000_000),
}
