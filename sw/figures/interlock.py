# SPDX-License-Identifier: Apache-2.0
"""Figure of the drive-enable interlock: does any fault, in whatever cycle it comes, leave the drive
on, or report a wrong cause or position afterwards.

Most faults are injected into the Verilated axis, whose registers are driven over its bus
(interlock_run.cpp); some into the whole node with its firmware, in the twin, where a person at the
host resets them; and some stop the soft core itself. The campaigns of 10^6 faults of the axis and
of 10^4 of each machine are `make soak K="guard_axis guard_s0 guard_s2 guard_s3 guard_core"`.
"""

import random
import struct
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from campaigns.campaign import Campaign, Counts
from experiments import s2_stage, s3_zero
from figures.common import Figure, Quick, bar, console, shares
from firmware import build as firmware_build
from moire import Bus
from moire.client.axis import Axis as BusAxis
from moire.errors import BusError, Refused
from twin import Axis, Node, Twin, TwinTransport, build
from twin.build import ROOT

DRIVER = Path(__file__).with_name("interlock_run.cpp")
BENCH = Path(__file__).with_name("one_axis_bench.sv")
FAULTS = 10**4
NODE_FAULTS, CORE_FAULTS = 200, 100  # of them: in the whole node; in its soft core
SHARE = 400  # faults of the axis in one run, with a seed of its own
CLK_HZ = 1_800_000
TICK_S = 1 / 4000
WATCHDOG_S = 0.04
ANSWER_S = 0.01  # that the longest answer takes on the bus, after its request
CORE_SILENCE_S = 0.02 + 1_200_000 / CLK_HZ  # the node's watchdog of its soft core
IDLE_S = 0.05  # until the round of the firmware that set a parameter has ended
ROUND_S = 0.005  # a request on the bus, and the round of the firmware that finds it
# nm between the position reported last and the latched one, beyond what the axis moves while it
# holds: a cut signal has any phase, half a period off at most
FORGIVEN_NM = {"encoder_cut": 400}
CAUSES = {
    "estop": "estop",
    "limit_low": "limit_low",
    "limit_high": "limit_high",
    "drive_fault": "drive",
    "encoder_cut": "encoder",
    "bus": "bus_watchdog",
}  # what is injected: what must be reported
# no reset while it persists; after a reset a pressed switch only blocks the motion into it
PERSISTENT = ("estop", "drive_fault", "encoder_cut")
INSTRUCTIONS = {"hang": 0x0000006F, "trap": 0x00000000}  # jump to itself; none at all


# ------------------------------------------------------------------ the axis


def interlock_run(count: int, seed: int) -> dict[str, int]:
    """What the program counts over so many faults, {name: number}."""
    words = build.run([build.simulation(DRIVER, BENCH), count, seed], "interlock_run").split()
    return dict(zip(words[1::2], map(int, words[::2])))


def axis_faults(
    count: int, seed: int = 1, done: Callable[[int], None] = lambda n: None
) -> dict[str, int]:
    """{name: number} over so many faults of the axis: faults, failures, and those of each cause."""
    totals: dict[str, int] = {}

    def run(share: tuple[int, int]) -> dict[str, int]:
        counts = interlock_run(*share)
        done(share[0])
        return counts

    with ThreadPoolExecutor(2) as pool:
        for counts in pool.map(run, shares(count, SHARE, seed)):
            for name, value in counts.items():
                totals[name] = totals.get(name, 0) + value
    return totals


# ------------------------------------------------------------------ the node


def powered_up(
    source: random.Random, firmware: Sequence[int] | None = None
) -> tuple[Twin, BusAxis]:
    """A twin of one node and its axis with the drive on."""
    twin = Twin(
        [Node(1, [Axis("stage")])],
        seed=source.randrange(1 << 31),
        clk_hz=CLK_HZ,
        node_parameters={"FILTERS": 0},
        firmware=firmware,
    )
    twin.run_until_ready()
    axis = Bus(TwinTransport(twin)).axis(1)
    axis.enable()
    return twin, axis


Powered = tuple[Twin, BusAxis]


@dataclass(frozen=True)
class Machine:
    """A machine whose first axis gets faults."""

    power_up: Callable[[random.Random], Powered]  # the drive on
    faults: Sequence[str]  # names of CAUSES; without a sine signal a cut at standstill is not seen
    held_nm: float  # that the axis moves at most while it holds and its scale is sound


def on(stage: Twin, axis: BusAxis) -> Powered:
    axis.enable()
    return stage, axis


def s2(source: random.Random) -> Powered:
    stage = s2_stage.Stage.power_up(source.randrange(1 << 31))
    return on(stage.twin, stage.axes["X"])


def s3(source: random.Random) -> Powered:
    motor = s3_zero.Motor(source.randrange(1 << 31))
    return on(motor.twin, motor.axis)


WITHOUT_CUT = [name for name in CAUSES if name != "encoder_cut"]
S0 = Machine(powered_up, list(CAUSES), 100)
MACHINES = {
    "s0": S0,
    "s2": Machine(s2, WITHOUT_CUT, 500),
    "s3": Machine(s3, WITHOUT_CUT, 1000),
}


def refused(request: Callable[[], object], cause: str) -> bool:
    try:
        request()
    except Refused as error:
        return error.cause == cause
    return False


def node_fault(
    twin: Twin, axis: BusAxis, fault: str, source: random.Random, held_nm: float = S0.held_nm
) -> str | None:
    """What was wrong with one fault, None if nothing was: the drive must be off in time, cause and
    position must be right, and only a person may enable the drive again.
    """
    axis.dwell(0.002 + source.random() * 0.005)
    before = axis.status()
    if not before.enabled or before.faults:
        return f"not on before: {before.fault_words}"
    if fault == "bus":
        twin.run(WATCHDOG_S - ANSWER_S)  # the last good frame ended before its answer
        if not twin.truth().enabled:
            return "off too soon"
        twin.run(ANSWER_S)
    else:
        twin.run(source.random() * TICK_S)
        twin.inject(fault)
    twin.run(TICK_S)
    if twin.truth().enabled:
        return "drive not off within a tick"
    status = axis.status()
    if status.first_fault != (CAUSES[fault],):
        return f"reported as {status.first_fault}"
    off_nm = abs(axis.encoder().fault_position_nm - before.position_nm)
    if off_nm > held_nm + FORGIVEN_NM.get(fault, 0):
        return f"latched position {off_nm:.0f} nm off"
    if not refused(axis.enable, "faulted"):
        return "enabled with a fault latched"
    if fault in PERSISTENT and not refused(axis.reset, "fault_persists"):
        return "reset while the cause persists"
    if fault != "bus":
        twin.clear(fault)
    twin.run(0.005)
    if not axis.status().faults or twin.truth().enabled:
        return "the cause went, and the fault with it"
    axis.reset()
    if axis.status().faults or twin.truth().enabled:
        return "not reset, or on by itself"
    axis.enable()
    return None


def node_faults(
    count: int, seed: int, done: Callable[[int], None] = lambda n: None, machine: Machine = S0
) -> list[str]:
    """Sentences about faults of the node that went wrong."""
    source, wrong = random.Random(seed), []
    twin, axis = machine.power_up(source)
    axis.set_parameter("watchdog_time", WATCHDOG_S)
    for n in range(count):
        fault = machine.faults[(seed + n) % len(machine.faults)]
        if sentence := node_fault(twin, axis, fault, source, machine.held_nm):
            wrong.append(f"{fault} at {twin.time():.3f} s: {sentence}")
            twin.close()
            twin, axis = machine.power_up(source)
            axis.set_parameter("watchdog_time", WATCHDOG_S)
        done(1)
    twin.close()
    return wrong


def spoilt_firmware(instruction: int) -> list[int]:
    """The firmware's words, with this instruction of 32 bits where the request to reset faults
    begins.
    """
    words = build.firmware(axes=1)
    _, symbols = firmware_build.read_elf(ROOT / "build" / "firmware" / "firmware.elf")
    content = bytearray(struct.pack(f"<{len(words)}I", *words))
    struct.pack_into("<I", content, symbols["axis_reset_faults"], instruction)
    return [word for (word,) in struct.iter_unpack("<I", content)]


def core_fault(twin: Twin, axis: BusAxis, kind: str) -> str | None:
    """What was wrong with a soft core that stops, None if nothing was."""
    later = f"{2 * CORE_SILENCE_S:.1f}s"  # the bus watchdog is not to be the first
    axis.set_parameter("watchdog_time", later)
    twin.run(IDLE_S)
    begun = twin.time()
    if answers(axis, "reset_faults"):
        return "the soft core still answers"
    if kind == "hang":
        twin.run(begun + CORE_SILENCE_S - ROUND_S - twin.time())
        if not twin.truth().enabled:
            return "off too soon"
        twin.run(2 * ROUND_S)
    twin.run(TICK_S)
    if twin.truth().enabled:
        return "drive not off in time"
    if answers(axis, "enable", on=1):
        return "the soft core still answers"
    twin.run(0.01)
    return "on again" if twin.truth().enabled else None


def answers(axis: BusAxis, operation: str, **fields: Any) -> bool:
    try:
        axis.node.bus.exchange(1, operation, tries=1, answer_s=ROUND_S, axis=0, **fields)
    except BusError:
        return False
    return True


def core_faults(count: int, seed: int, done: Callable[[int], None] = lambda n: None) -> list[str]:
    source, wrong = random.Random(seed), []
    images = {kind: spoilt_firmware(instruction) for kind, instruction in INSTRUCTIONS.items()}
    for n in range(count):
        kind = list(INSTRUCTIONS)[n % len(INSTRUCTIONS)]
        twin, axis = powered_up(source, images[kind])
        twin.run(source.random() * 0.02)
        if sentence := core_fault(twin, axis, kind):
            wrong.append(f"{kind}: {sentence}")
        twin.close()
        done(1)
    return wrong


def guard_failures(
    faults: int = FAULTS, in_node: int = NODE_FAULTS, in_core: int = CORE_FAULTS, seed: int = 1
) -> float:
    with bar(f"{faults} faults") as progress:
        task = progress.add_task("", total=faults)

        def done(n: int) -> None:
            progress.advance(task, n)

        wrong = node_faults(in_node, 2 * seed - 1, done) + core_faults(in_core, 2 * seed, done)
        totals = axis_faults(faults - in_node - in_core, seed, done)
    console.print("axis: " + ", ".join(f"{value} {name}" for name, value in totals.items()))
    console.print(f"node: {in_node} faults, {in_core} of its soft core, {len(wrong)} failures")
    for sentence in wrong:
        console.print(f"  {sentence}")
    return float(totals["failures"] + len(wrong))


FIGURES = {
    "guard_failures": Figure(
        guard_failures,
        "faults",
        "of 10^4 faults in random cycles, 300 of them in the whole node: drive not off within a "
        "servo tick, wrong first cause or position, or reset without a person; 100 of the 300 stop "
        "the soft core: drive not off within its watchdog, or on again",
        "0",
        Quick({"faults": 208, "in_node": 3, "in_core": 1}, "208 faults, 4 of them in the node"),
        0,
    ),
}

FAULTS_A_PART = 10  # of a machine


def judged(wrong: Sequence[str]) -> Counts:
    words = {"what": "\n".join(wrong)} if wrong else {}
    return {"faults": FAULTS_A_PART, "failures": len(wrong), **words}


def faults_of_machine(name: str, part: int, seed: int) -> Counts:
    return judged(node_faults(FAULTS_A_PART, seed, machine=MACHINES[name]))


def faults_of_core(part: int, seed: int) -> Counts:
    return judged(core_faults(FAULTS_A_PART, seed))


def guard(what: str, run: Callable[[int, int], Counts]) -> Campaign:
    failed = "drive not off in time, wrong first cause or position, or reset without a person"
    return Campaign(f"{what}; failed: {failed}", run, 1000, "faults", "failures")


CAMPAIGNS = {
    "guard_axis": guard(
        "faults in random cycles of the Verilated axis",
        lambda part, seed: interlock_run(1000, seed),
    ),
    **{
        f"guard_{name}": guard(
            f"faults in random cycles of the whole node of {name.upper()}, {', '.join(one.faults)}",
            partial(faults_of_machine, name),
        )
        for name, one in MACHINES.items()
    },
    "guard_core": guard("stops of the soft core, by a jump to itself or a trap", faults_of_core),
}
