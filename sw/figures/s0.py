# SPDX-License-Identifier: Apache-2.0
"""Figures of S0: the X-Y stage, its bus, its node."""

import itertools
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from rich.progress import Progress

from campaigns.campaign import Campaign, Counts
from experiments import s0_stage
from figures.common import Figure, Quick, bar, console
from moire.bus.protocol import (
    TO_NODE,
    Exchange,
    Reply,
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
from twin import FrameBench, cells_of

SEED = 1
SETTLE_TIME = PARAMETERS["settle_time"].id
ADDRESS = 1
READY = ready_byte(ADDRESS, TO_NODE)
CELLS = 11  # of a character on the bus
TURNAROUND = [1] * 3  # cells before the master sends again, while the node's driver releases
ANSWER_CELLS = 150  # of silence after which no answer comes any more
READINGS = 8  # of a zero
WORK_CELLS = 400  # that a request may take, at the low clock of the bench


def homed_stage(seed: int, progress: Progress | None = None) -> s0_stage.Stage:
    stage = s0_stage.Stage.power_up(seed)
    stage.find()
    for name in progress.track(stage.axes) if progress else stage.axes:
        stage.home(name)
    return stage


def s0_coarse_um_max(count: int = 100, seed: int = SEED) -> float:
    with bar("homing") as progress:
        stage = homed_stage(seed, progress)
    with bar("moves") as progress:
        task = progress.add_task("", total=count)
        moves = s0_stage.random_moves(stage, count, seed, done=lambda move: progress.advance(task))
    errors, times = (
        np.array([getattr(move, name) for move in moves]) for name in ("error_nm", "time_s")
    )
    console.print(
        f"target - true position: max {np.abs(errors).max():.1f} nm, "
        f"rms {np.sqrt((errors**2).mean()):.1f} nm, mean {errors.mean():.1f} nm; "
        f"a move takes {np.median(times):.2f} s (median), {times.max():.2f} s at most"
    )
    return float(np.abs(errors).max() / 1000)


def apart_nm(stage: s0_stage.Stage) -> float:
    """True position, the mean of before and after the answer, less the answer."""
    before = stage.true_nm("X", from_zero=False)
    position = stage.axes["X"].status().position_nm
    return (before + stage.true_nm("X", from_zero=False)) / 2 - float(position)


def homings(count: int, seed: int) -> Iterator[list[float]]:
    """Readings of the zero after each of so many homings from random positions."""
    source, stage = random.Random(seed), s0_stage.Stage.power_up(seed)
    stage.find()
    for _ in range(count):
        stage.home("X")
        stage.dwell(0.05)
        yield [apart_nm(stage) for _ in range(READINGS)]
        stage.move("X", source.uniform(-0.5e6, 1.5e6))


def s0_home_spread_nm(count: int = 20, seed: int = SEED) -> float:
    with bar("homings from random positions") as progress:
        readings = list(progress.track(homings(count, seed), total=count))
    zeros, single = np.mean(readings, axis=1), np.ptp(readings)
    console.print(
        f"zero at {zeros.mean():.2f} nm, rms {zeros.std():.2f} nm; the switch scatters by "
        f"+-200 nm. Each zero is the mean of {READINGS} readings, since the axis moves while it "
        f"holds: single ones spread by {single:.1f} nm"
    )
    return float(np.ptp(zeros))


# ------------------------------------------------------------------ the bus


def requests(source: random.Random) -> Iterator[bytes]:
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


def damaged(cells: Sequence[int], source: random.Random) -> list[int]:
    """The cells with one, two or three of them inverted."""
    cells = list(cells)
    for position in source.sample(range(len(cells)), source.randint(1, 3)):
        cells[position] ^= 1
    return cells


def heard(cells: Sequence[int]) -> list[int]:
    """Words that a PC's port makes of bit cells: a character begins with a low cell. It counts
    without a stop bit, too, but a break does not.
    """
    words, at, idle = [], 0, True
    while at <= len(cells) - CELLS:
        if cells[at] or not idle:
            idle, at = bool(cells[at]), at + 1
            continue
        idle = bool(cells[at + CELLS - 1])
        word = sum(bit << n for n, bit in enumerate(cells[at + 1 : at + 10]))
        if idle or word:
            words.append(word)
        at += CELLS
    return words


def node_answer(bench: FrameBench) -> tuple[Reply | None, list[int]]:
    """(last reply of the node, None if it is damaged; its words)"""
    words = bench.exchange(TURNAROUND + cells_of(read_words(ADDRESS)), quiet_cells=ANSWER_CELLS)
    if len(words) < 7 or list(frame(words[0], bytes(words[2:-4]))) != words[1:]:
        return None, words
    return parse_reply(bytes(words[2:-4])), words


class Judge:
    """Decides whether a node has accepted a frame: it repeats its last reply until then.

    The sequence number of the new reply does not matter, since the number of the frame itself may
    be damaged. Only a frame with the number of the frame before would not be noticed; the node
    takes it for a repetition and does not carry it out.
    """

    def __init__(self, reply: Reply | None) -> None:
        self.last = reply

    def accepted(self, reply: Reply | None) -> bool:
        changed, self.last = reply != self.last, reply
        return changed


@dataclass
class Frames:
    """What became of damaged frames, and of the undamaged ones between them."""

    wrong: int = 0  # accepted by the node
    wrong_host: int = 0  # accepted by the host
    refused: int = 0  # undamaged ones
    lost: int = 0  # answers

    @property
    def failures(self) -> int:
        return self.wrong + self.wrong_host + self.refused + self.lost


def damaged_frames(
    frames: int, bench: FrameBench, seed: int, done: Callable[[], None] = lambda: None
) -> Frames:
    """Each frame is damaged on its way to the node, and the reply on its way to the host. After
    every hundredth an undamaged frame must be accepted, so that a count of zero means something.
    """
    source, total = random.Random(seed), Frames()
    judge, bodies = Judge(node_answer(bench)[0]), requests(source)
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
        if ready and ready != [READY]:  # the damage made it a command to reply
            bench.exchange(TURNAROUND, quiet_cells=ANSWER_CELLS)
        if bench.exchange(
            TURNAROUND + sent[len(command) :], enough=1, quiet_cells=ANSWER_CELLS // 2
        ):
            bench.exchange(TURNAROUND, quiet_cells=ANSWER_CELLS)
        if whole:
            bench.idle(WORK_CELLS)
        reply, words = node_answer(bench)
        if reply is None:
            total.lost += 1
            total.refused += whole
            continue
        accepted = judge.accepted(reply)
        if whole:
            total.refused += not (accepted and reply.sequence == body[0])
            continue
        total.wrong += accepted
        done()
        exchange = Exchange(ADDRESS, bytes([reply.sequence, reply.operation]), tries=1)
        exchange.feed([READY])
        exchange.feed(heard(damaged(cells_of(words), source) + [1] * CELLS))
        # with the last stop bit alone damaged the reply is whole, and right
        total.wrong_host += exchange.state == State.DONE and exchange.reply != reply
    return total


def s0_bus_wrong(
    frames: int = 100_000, make_bench: Callable[[int], FrameBench] = FrameBench, seed: int = SEED
) -> int:
    with bar("damaged frames") as progress:
        task = progress.add_task("", total=frames)
        total = damaged_frames(frames, make_bench(ADDRESS), seed, lambda: progress.advance(task))
    console.print(
        f"{frames} damaged requests: {total.wrong} accepted by the node; their damaged replies: "
        f"{total.wrong_host} accepted by the host; {total.refused} of {frames // 100} undamaged "
        f"requests between them refused; answers missing afterwards: {total.lost}"
    )
    if total.refused or total.lost:
        raise BusError(
            ADDRESS, f"the node missed {total.refused} undamaged frames and {total.lost} answers"
        )
    return total.wrong + total.wrong_host


FIGURES = {
    "s0_coarse_um_max": Figure(
        s0_coarse_um_max,
        "um",
        "largest |target - true position| of 100 random moves (0.1 um to 2 mm), motor only; a "
        "perfect scale, no vibration, no drift",
        "<= 0.05",
        Quick({"count": 3}, "three moves"),
        4,
        "the paper 0.8",
    ),
    "s0_home_spread_nm": Figure(
        s0_home_spread_nm,
        "nm",
        "spread of the zero over 20 homings from random positions, each the mean of 8 readings "
        "(single readings 4.4 to 6.7), the switch scattering by +-200 nm",
        "<= 5",
        Quick({"count": 2}, "two homings"),
        2,
    ),
    "s0_bus_wrong": Figure(
        s0_bus_wrong,
        "frames",
        "frames accepted wrongly of 10^5 with one to three flipped bits, each way",
        "0",
        Quick({"frames": 400}, "400 frames"),
        0,
    ),
}


MOVES_A_PART = 50
FRAMES_A_PART = 2000
HOMINGS_A_PART = 5
COARSE_NM, HOME_NM = 50, 5  # bounds of s0_coarse_um_max and s0_home_spread_nm


def moves_of_part(part: int, seed: int) -> Counts:
    errors = [
        abs(move.error_nm) for move in s0_stage.random_moves(homed_stage(seed), MOVES_A_PART, seed)
    ]
    failed = sum(error > COARSE_NM for error in errors)
    return {"moves": len(errors), "failed": failed, "nm": max(errors)}


def frames_of_part(part: int, seed: int) -> Counts:
    totals = damaged_frames(FRAMES_A_PART, FrameBench(ADDRESS), seed)
    return {"frames": 2 * FRAMES_A_PART, **totals.__dict__, "failures": totals.failures}


def homings_of_part(part: int, seed: int) -> Counts:
    zeros = np.array([np.mean(readings) for readings in homings(HOMINGS_A_PART, seed)])
    off = np.abs(zeros - np.median(zeros))
    return {"homings": len(zeros), "failed": int((off > HOME_NM).sum()), "nm": float(off.max())}


CAMPAIGNS = {
    "s0_moves": Campaign(
        "random moves of S0, motor only; failed: true position more than 50 nm off the target",
        moves_of_part,
        parts=100,
        tried="moves",
        failed="failed",
        largest=("nm",),
    ),
    "s0_bus": Campaign(
        "frames of S0 with one to three flipped bits, half of them each way; failed: accepted "
        "ones, and good ones refused",
        frames_of_part,
        parts=1000,
        tried="frames",
        failed="failures",
    ),
    "homing_s0": Campaign(
        "homings of S0 from random positions to a switch that scatters by +-200 nm; failed: zero "
        "more than 5 nm off the others of its power-up",
        homings_of_part,
        parts=2000,
        tried="homings",
        failed="failed",
        largest=("nm",),
    ),
}
