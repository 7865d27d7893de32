# SPDX-License-Identifier: Apache-2.0
"""Figures of bits that flip by themselves in the running chip: does any flip of a flip-flop end in
a wrong motion without a fault, or keep a drive on that must be off.

The machine is settled once, in the parent process; each flip happens in a child, which fork()
makes a copy of the settled machine. Every bit of every register is flipped once in each machine, at
a random moment of a motion; of the memories, random bits. The campaigns over all of them are
`make soak K="flips_s0 flips_s2 flips_s3 interlock_flips_s0 interlock_flips_s2 interlock_flips_s3"`;
docs/evidence.md defines the outcomes.
"""

import os
import pickle
import random
import re
import select
import signal
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass, field
from functools import cache, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from campaigns.campaign import Campaign, Counts
from experiments import s0_stage, s2_stage, s3_zero
from figures.common import Figure, Quick, console
from figures.interlock import INSTRUCTIONS, TICK_S
from firmware import build as firmware_build
from moire.client.axis import Axis
from moire.client.bus import Bus
from moire.client.records import Status
from moire.errors import BusError, Refused
from twin import Twin, build
from twin.build import ROOT
from twin.nodes.twin import Register

Path = npt.NDArray[np.float64]
TRACE_HZ = 4000
POLL_S = 0.01
REST_S = 0.04  # of the observation after each motion, in which late requests are repeated, too
LONGEST_S = 120  # of a processor for one flip, after which it counts as lost
LONGEST_MOVE_S = 2.5  # beyond the time of the reference: settle_timeout is 2 s
BEFORE_S = 0.003  # of a motion, before a cause to stop
LOOKS_S = (0.0, 0.0003, 0.002, 0.01)  # at a drive that must be off, each after the one before
AT_ONCE = 2  # copies of a machine, in a figure
WATCHDOG_S = 0.1  # setting of the bus watchdog
MARGIN_S = 0.02  # after which a watchdog must have acted
MEMORY_SHARE = 0.25  # flips of memories for one of a flip-flop
NO_FLIP_FLOP = "no flip-flop"
UNSAFE = ("wrong motion", "on without an answer", "lost")
# What stops a drive: names of registers as the RTL has them, from the pins to the outputs
PROTECTION = re.compile(
    r"u_interlock\.|u_axis\.(?:first_fault|fault_position|command|control_\w+)$|axis_+faults$|"
    r"drive_enable$|g_drive\.passed$|encoder_fault_mask$|u_actuator\.|u_inputs\.|u_estop\.|"
    r"u_core_watchdog\.|u_rs485\.(?:u_watchdog\.|watchdog_time$|u_timeout\.)|core_trap$|"
    r"^watchdog_expired$|^heartbeat_kick$|^dac_\w+$|^bridge_\w+$|(?:^|__)step$|(?:^|__)direction$|"
    r"strobes_reset_faults$"
)


# ------------------------------------------------------------------ the machines


@dataclass
class Session:
    """A machine with its drives on, at rest."""

    twin: Twin
    bus: Bus
    axes: list[Axis]
    registers: list[Register] = field(init=False)
    rest_nm: list[float] = field(init=False)  # where the axes are at rest

    def __post_init__(self) -> None:
        self.rest_nm = [axis.status().target_nm for axis in self.axes]
        self.registers = self.twin.registers()
        self.bus.poll_s = POLL_S
        for axis in self.axes:
            axis.set_parameter("watchdog_time", WATCHDOG_S)

    @property
    def on(self) -> list[int]:
        """Numbers of the axes whose drives are on in truth."""
        return [n for n in range(len(self.axes)) if self.twin.truth(n).enabled]


@dataclass(frozen=True)
class Machine:
    """A machine, the motion that all of its axes make, and what counts as a wrong one."""

    power_up: Callable[[int], Session]  # homed, the drives on
    distance_nm: float  # of a move, and back
    path_nm: float  # from the path without a flip: a wrong motion beyond
    end_nm: float  # from the end of it: a wrong motion beyond


def s0(seed: int) -> Session:
    """X of the stage with an interferometer."""
    stage = s0_stage.Stage.power_up(seed, names=("X",))
    stage.home("X")
    return Session(stage.twin, stage.bus, [stage.axes["X"]])


def s2(seed: int) -> Session:
    """Three axes with steppers."""
    stage = s2_stage.Stage.power_up(seed)
    stage.home()
    return Session(stage.twin, stage.bus, list(stage.axes.values()))


def s3(seed: int) -> Session:
    """The linear motor."""
    motor = s3_zero.Motor(seed)
    motor.axis.enable()
    motor.axis.home()
    return Session(motor.twin, motor.bus, [motor.axis])


MACHINES = {
    "s0": Machine(s0, 100e3, 5e3, 500.0),
    "s2": Machine(s2, 500e3, 100e3, 5e3),
    "s3": Machine(s3, 500e3, 100e3, 2e3),
}


# ------------------------------------------------------------------ one copy of a machine for each


def forked(
    jobs: Iterable[Any], work: Callable[[Any], Any], at_once: int = 1
) -> Iterator[tuple[Any, Any]]:
    """(job, result) of work(job), each in a copy of this process, in any order; None for a copy
    that died or took too long.
    """
    running: dict[int, tuple[int, Any]] = {}  # {reading end of the pipe: (process, job)}

    def ended() -> Iterator[tuple[Any, Any]]:
        for reading in select.select(list(running), [], [])[0]:
            process, job = running.pop(reading)
            with os.fdopen(reading, "rb") as pipe:
                said = pipe.read()
            os.waitpid(process, 0)
            yield job, pickle.loads(said) if said else None

    for job in jobs:
        while len(running) >= at_once:
            yield from ended()
        reading, writing = os.pipe()
        process = os.fork()
        if not process:
            try:
                signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST_S)
                said = pickle.dumps(work(job))
                with os.fdopen(writing, "wb") as pipe:
                    pipe.write(said)
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(0)
        os.close(writing)
        running[reading] = process, job
    while running:
        yield from ended()


# ------------------------------------------------------------------ a motion with a flip


@dataclass(frozen=True)
class Flip:
    """A bit that changes so many seconds after the request to move."""

    register: Register
    word: int
    bit: int
    after_s: float

    def __str__(self) -> str:
        word = f"[{self.word}]" if self.register.words > 1 else ""
        return f"{self.register.name}{word} bit {self.bit} after {self.after_s * 1e3:.2f} ms"


@dataclass
class Run:
    """What was seen of two moves, there and back."""

    error: str = ""  # what the host was told, "" if nothing was wrong
    unanswered: bool = False  # the node does not answer, and a drive stays on
    on: bool = True  # the drives at the end, in truth
    flipped: bool = False
    same: bool = False  # the state became that of the reference, to the last bit
    repeats: int = 0  # of requests
    polls: int = 0
    states: list[Any] = field(default_factory=list)  # of the reference after each poll
    took_s: list[float] = field(default_factory=list)  # of each move, until it had settled
    paths: list[Path] = field(default_factory=list)  # nm, of each axis there and back


def word_of(status: Status) -> str:
    """What a status says that is wrong, "" if nothing is."""
    if status.faults:
        return f"fault {' '.join(status.first_fault or status.faults)}"
    if not status.enabled:
        return "drive off"
    return "" if status.ended in ("ok", "running") else f"ended: {status.ended}"


class Converged(Exception):
    """The state is as it would be without the flip, so everything that follows is, too."""


def compared(session: Session, run: Run, reference: Run | None) -> None:
    """Adds the state of node and machines to the reference; raises Converged if it is the same."""
    twin = session.twin
    machines = [astuple(twin.truth(n)) for n in range(len(session.axes))]
    state = twin.digest(), machines, session.bus.statistics.repeats
    run.polls += 1
    if reference is None:
        run.states.append(state)
    elif twin.flipped() and [state] == reference.states[run.polls - 1 : run.polls]:
        raise Converged


def go(
    session: Session, run: Run, reference: Run | None, distance_nm: float, until_s: float
) -> None:
    """Requests a move of all axes to this distance from rest, and polls them until they have
    ended.
    """
    for axis, rest_nm in zip(session.axes, session.rest_nm, strict=True):
        axis.request("move", target=axis.to_counts(rest_nm + distance_nm))
    moving = set(session.axes)
    while moving and not run.error:
        session.bus.transport.wait(POLL_S)
        for axis in session.axes:
            status = axis.status()
            run.error = run.error or word_of(status)
            if status.ended != "running":
                moving.discard(axis)
        compared(session, run, reference)
        if moving and session.twin.time() > until_s:
            run.error = run.error or "not ended"


def observed(
    session: Session, machine: Machine, flip: Flip | None, reference: Run | None = None
) -> Run:
    """Moves all axes there and back, with a flip in the first move; without a flip, it is the
    reference, which gives each motion its time.
    """
    run, twin = Run(), session.twin
    before = session.bus.statistics.repeats
    for n in range(len(session.axes)):
        twin.trace(n, TRACE_HZ)
    if flip:
        twin.flip_after(flip.after_s, flip.register, flip.bit, flip.word)
    try:
        for number, distance_nm in enumerate((machine.distance_nm, 0.0)):
            begun = twin.time()
            took_s = reference.took_s[number] if reference else 0.0
            go(session, run, reference, distance_nm, begun + took_s + LONGEST_MOVE_S)
            run.took_s.append(twin.time() - begun)
            until_s = max(twin.time(), begun + took_s if reference else 0.0) + REST_S
            while not run.error and twin.time() < until_s - 1e-6:
                twin.run(min(POLL_S, until_s - twin.time()))
                for axis in session.axes:
                    run.error = run.error or word_of(axis.status())
                compared(session, run, reference)
            run.paths += [twin.take_trace(n)["position_m"] * 1e9 for n in range(len(session.axes))]
            if run.error:
                break
    except Converged:
        run.same = True
    except Refused as refused:
        run.error = f"refused: {refused.cause}"
    except BusError:
        run.error = "no answer"
        twin.run(WATCHDOG_S + core_silence_s(session) + MARGIN_S)
        run.unanswered = bool(session.on)
    run.repeats = session.bus.statistics.repeats - before
    run.flipped = twin.flipped()
    run.on = len(session.on) == len(session.axes)
    return run


def core_silence_s(session: Session) -> float:
    """Time after which the watchdog of the soft core acts, rtl/interlock/core_watchdog.sv."""
    return 0.02 + 1_200_000 / session.twin.clk_hz


def distances(run: Run, reference: Run) -> tuple[float, float]:
    """nm: (largest distance from the path, and from the ends of it) of any axis."""
    path = end = 0.0
    axes = len(reference.paths) // 2
    last = int(REST_S / 2 * TRACE_HZ)  # samples at the end of each motion
    for n, seen in enumerate(run.paths):
        right = reference.paths[n]
        length = min(len(seen), len(right))
        if n < axes:  # there: begun before the flip, at each moment where it would have been
            path = max(path, float(np.max(np.abs(seen[:length] - right[:length]))))
        else:  # back: begun when the host was ready, at no moment outside of the way
            low, high = float(right.min()), float(right.max())
            path = max(path, low - float(seen.min()), float(seen.max()) - high)
        end = max(end, abs(float(seen[-last:].mean() - right[-last:].mean())))
    return path, end


def outcome_of(run: Run | None, reference: Run, machine: Machine) -> tuple[str, str]:
    """(class, cause) of a run; the classes are those of docs/evidence.md."""
    if run is None:
        return "lost", "the simulation died or did not end"
    if not run.flipped:
        return NO_FLIP_FLOP, ""
    if run.same and not run.error:
        return "harmless", "state as without it"
    if run.unanswered:
        return "on without an answer", run.error
    if run.error:
        return "fault", run.error
    path, end = distances(run, reference)
    if path > machine.path_nm or end > machine.end_nm or not run.on:
        return "wrong motion", f"path {path:.0f} nm, end {end:.0f} nm"
    if run.repeats > reference.repeats:
        return "recovered", "request repeated"
    if end > machine.end_nm / 10 or path > machine.path_nm / 10:
        return "recovered", "path"
    return "harmless", ""


def bits_of(registers: Sequence[Register]) -> list[tuple[Register, int, int]]:
    """(register, word, bit) of all flip-flops."""
    return [(one, 0, bit) for one in registers if one.words == 1 for bit in range(one.bits)]


def memory_bits(
    registers: Sequence[Register], count: int, source: random.Random
) -> Iterator[tuple[Register, int, int]]:
    """Random bits of random memories, each memory as often as another."""
    memories = [one for one in registers if one.words > 1]
    for n in range(count):
        one = memories[n % len(memories)]
        yield one, source.randrange(one.words), source.randrange(one.bits)


def common_seed(part: int, seed: int) -> int:
    """A seed that all parts of a campaign share: the seeds of its parts follow each other."""
    return seed - part


def flips(
    name: str, part: int, parts: int, seed: int, at_once: int = 1, most: int | None = None
) -> Iterator[tuple[Flip, str, str]]:
    """(flip, class, cause) of one part of all bits of a machine, `most` of them at most."""
    machine, source = MACHINES[name], random.Random(seed)
    session = machine.power_up(seed)
    reference: Run | None
    ((_, reference),) = forked([None], partial(observed, session, machine))
    if reference is None or reference.error:
        raise RuntimeError(f"{name}: the motion without a flip fails: {reference}")
    bits = bits_of(session.registers)
    random.Random(common_seed(part, seed)).shuffle(bits)
    chosen = bits[part::parts][:most]
    chosen += memory_bits(session.registers, round(len(chosen) * MEMORY_SHARE), source)
    jobs = [Flip(*one, source.uniform(0.0, reference.took_s[0])) for one in chosen]
    work = partial(observed, session, machine, reference=reference)
    for flip, run in forked(jobs, work, at_once):
        yield flip, *outcome_of(run, reference, machine)
    session.twin.close()


# ------------------------------------------------------------------ what must stop a drive


def inject(fault: str, session: Session, axis: int) -> None:
    """Begins a fault of an axis, or of the node."""
    session.twin.inject(fault, 0 if fault == "estop" else axis)


@cache
def round_of_firmware(axes: int) -> tuple[int, int]:
    """(number, content) of the word of the soft core's memory where each round begins."""
    words = build.firmware(axes=axes)
    elf = ROOT / "build" / "firmware" / f"{firmware_build.stem_of('axis', axes, 'soft')}.elf"
    number = firmware_build.read_elf(elf)[1]["firmware_poll"] // 4
    return number, words[number]


def hang(session: Session, axis: int) -> None:
    """Makes the soft core jump to itself where each round of the firmware begins."""
    twin = session.twin
    number, content = round_of_firmware(len(session.axes))
    memory = next(one for one in session.registers if one.name == "g_core.u_core.u_memory.memory")
    for bit in range(memory.bits):
        if (content ^ INSTRUCTIONS["hang"]) >> bit & 1:
            twin.flip_after(0.0, memory, bit, number)
            twin.run(1 / twin.clk_hz)


def silence(session: Session, axis: int) -> None:
    """Nothing: the host sends no more from now on."""


def disable(session: Session, axis: int) -> None:
    """The host switches the drive off."""
    session.axes[axis].disable()


@dataclass(frozen=True)
class Cause:
    """Something after which a drive must be off."""

    begin: Callable[[Session, int], None]
    within_s: Callable[[Session], float]
    watchdog_s: float = WATCHDOG_S  # setting of the bus watchdog; 0: no limit


STOPS = {
    **{
        fault: Cause(partial(inject, fault), lambda session: TICK_S)
        for fault in ("estop", "drive_fault", "limit_low", "limit_high")
    },
    "disable": Cause(disable, lambda session: MARGIN_S),
    # a bit of its counter costs a watchdog at most the time that it has counted so far
    "bus": Cause(silence, lambda session: 2 * WATCHDOG_S + MARGIN_S),
    "core": Cause(hang, lambda session: 2 * core_silence_s(session) + MARGIN_S, 0.0),
}


def protection_bits(registers: Sequence[Register]) -> list[tuple[Register, int, int]]:
    """All bits of the interlock, the watchdogs, the inputs of what stops, and the outputs."""
    return [bit for bit in bits_of(registers) if PROTECTION.search(bit[0].name)]


def unstopped(session: Session, machine: Machine, flip_and_cause: tuple[Flip, str]) -> str:
    """Begins a motion, flips a bit before or after a cause to stop, and returns what was wrong: ""
    if the drive is off in time and stays off.
    """
    flip, name = flip_and_cause
    cause, twin = STOPS[name], session.twin
    found = re.search(r"g_axis\[(\d)\]", flip.register.name)
    axis = int(found[1]) if found else 0
    session.axes[0].set_parameter("watchdog_time", cause.watchdog_s)
    for one, rest_nm in zip(session.axes, session.rest_nm, strict=True):
        one.request("move", target=one.to_counts(rest_nm + machine.distance_nm))
    twin.flip_after(flip.after_s, flip.register, flip.bit, flip.word)
    twin.run(BEFORE_S)
    # a flip that is still to come gives way to those of hang(): it has its turn in other trials
    cause.begin(session, axis)
    twin.run(cause.within_s(session))
    for later_s in LOOKS_S:
        twin.run(later_s)
        if twin.truth(axis).enabled:
            return f"on after {name}, {later_s * 1e3:g} ms late"
    return ""


def protection_flips(
    name: str, part: int, parts: int, seed: int, at_once: int = 1, most: int | None = None
) -> Iterator[tuple[Flip, str, str | None]]:
    """(flip, cause to stop, what was wrong) of one part of all bits of what stops the drives of a
    machine, each with each cause; None if the simulation died.
    """
    machine, source = MACHINES[name], random.Random(seed)
    session = machine.power_up(seed)
    round_of_firmware(len(session.axes))  # once, before the copies
    tried = [(bit, cause) for bit in protection_bits(session.registers) for cause in STOPS]
    random.Random(common_seed(part, seed)).shuffle(tried)
    jobs = []
    for bit, cause in tried[part::parts][:most]:
        late_s = 0.0 if cause == "core" else STOPS[cause].within_s(session) / 2
        jobs.append((Flip(*bit, source.uniform(0.0, BEFORE_S + late_s)), cause))
    for (flip, cause), wrong in forked(jobs, partial(unstopped, session, machine), at_once):
        yield flip, cause, wrong
    session.twin.close()


# ------------------------------------------------------------------ figures and campaigns


def unsafe_flips(
    count: int = 500, machines: Sequence[str] = tuple(MACHINES), seed: int = 1
) -> float:
    """Percent of so many flips of flip-flops of each machine that end in a wrong motion."""
    classes: Counter[tuple[str, str]] = Counter()
    worst: Counter[str] = Counter()
    for name in machines:
        for flip, kind, cause in flips(name, 0, 1, seed, AT_ONCE, count):
            if flip.register.words > 1:
                continue
            classes[name, kind] += 1
            if kind in UNSAFE:
                worst[f"{name} {flip.register.name}"] += 1
                console.print(f"  {name} {flip}: {kind}, {cause}", markup=False)
    for (name, kind), number in sorted(classes.items()):
        console.print(f"{name}: {number} {kind}")
    bad = sum(number for (_, kind), number in classes.items() if kind in UNSAFE)
    real = sum(number for (_, kind), number in classes.items() if kind != NO_FLIP_FLOP)
    return 100 * bad / real


def unsafe_protection_flips(
    count: int = 1000, machines: Sequence[str] = tuple(MACHINES), seed: int = 1
) -> float:
    """Of so many flips in what stops the drives of each machine: those with a drive on too long."""
    bad = 0
    for name in machines:
        for flip, cause, wrong in protection_flips(name, 0, 1, seed, AT_ONCE, count):
            if wrong != "":
                bad += 1
                console.print(f"  {name} {flip}, {cause}: {wrong or 'died'}", markup=False)
    return float(bad)


FIGURES = {
    "flips_unsafe_pct": Figure(
        unsafe_flips,
        "%",
        "of 500 flips of random flip-flops of each of the nodes of S0, S2 and S3, at random "
        "moments of a motion: those that end in a wrong motion without a fault",
        "<= 0.5",
        Quick({"count": 4, "machines": ("s3",)}, "4 flips in S3"),
        2,
    ),
    "flips_unsafe_interlock": Figure(
        unsafe_protection_flips,
        "flips",
        "of 1000 flips in each of these nodes, of random flip-flops of interlock, watchdogs, the "
        "inputs of what stops a drive and the outputs, each with a cause to stop: those that leave "
        "a drive on",
        "0",
        Quick({"count": 6, "machines": ("s3",)}, "6 flips in S3"),
        0,
    ),
}
PARTS = {"s0": 400, "s2": 1000, "s3": 100}  # of a campaign: some minutes each


def flips_of_part(name: str, part: int, seed: int) -> Counts:
    """The counts of one part of a campaign, one for each class."""
    counts: Counter[str] = Counter({"flips": 0, "unsafe": 0})
    bad = []
    for flip, kind, cause in flips(name, part, PARTS[name], seed):
        if kind == NO_FLIP_FLOP:
            continue
        memory = flip.register.words > 1
        counts[f"{kind}, memory" if memory else kind] += 1
        counts["flips"] += not memory
        counts["unsafe"] += not memory and kind in UNSAFE
        if kind in UNSAFE:
            bad.append(f"{flip}: {kind}, {cause}")
    return {**counts, **({"what": "\n".join(bad)} if bad else {})}


def protection_of_part(name: str, part: int, seed: int) -> Counts:
    """The counts of one part of the campaign over what stops the drives."""
    counts: Counter[str] = Counter({"flips": 0, "unsafe": 0})
    bad = []
    for flip, cause, wrong in protection_flips(name, part, PARTS[name], seed):
        counts["flips"] += 1
        if wrong != "":
            counts["unsafe"] += 1
            bad.append(f"{flip}, {cause}: {wrong or 'died'}")
    return {**counts, **({"what": "\n".join(bad)} if bad else {})}


CAMPAIGNS = {
    **{
        f"flips_{name}": Campaign(
            f"flips of every flip-flop of the node of {name.upper()} in a motion, and of random "
            "bits of its memories; failed: a flip-flop that ends in a wrong motion without a fault",
            partial(flips_of_part, name),
            PARTS[name],
            "flips",
            "unsafe",
            allowed=0.005,
        )
        for name in MACHINES
    },
    **{
        f"interlock_flips_{name}": Campaign(
            f"flips of every flip-flop of what stops the drives of {name.upper()}, each with each "
            "cause to stop; failed: a drive stays on",
            partial(protection_of_part, name),
            PARTS[name],
            "flips",
            "unsafe",
        )
        for name in MACHINES
    },
}
