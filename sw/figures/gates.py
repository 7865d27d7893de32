# SPDX-License-Identifier: Apache-2.0
"""Figure of the gates: machines of each family of FPGAs on the netlist of their node, as the board
builds it, in the twin.

The netlist is that of rtl/node.sv with the parameters, the synthesis and the firmware of `make
board`; only the clock is slower, and the top with PLL and pins is not there. A netlist of S3 homes
to the index of its scale and moves, one of S0 does so by sine and cosine. The iCE40 boards have no
drives: there the counter box captures the index of an axis that something else pushes, and shows
where it is.
"""

import random
from collections.abc import Callable, Sequence

from boards import board as boards
from boards import build as boards_build
from boards import machine as machines
from boards.fit import Design, fit
from boards.size import firmware_stem
from experiments import s0_stage
from experiments.s3_zero import CLK_HZ, COUNT_M, SETTINGS, Motor
from figures.common import Figure, Quick, console
from figures.synthesis import SynthesisError, yosys
from moire.client.bus import Bus
from moire.errors import MoireError
from twin import BuildError, Twin, TwinTransport, build
from twin.netlist import NetlistError
from twin.nodes.twin import CLK_HZ as S0_CLK_HZ
from twin.nodes.twin import Axis, Node

BY_TWIN = ("CLK_HZ", "AXES", "FIRMWARE")  # parameters of the node that the twin sets itself
TARGET_MM = 0.5
NEAR_UM = 2.0  # two counts of the scale
S0_TARGET_NM = 20_000
S0_NEAR_NM = 50.0  # a sixteenth of a period of the signals
BOX_HZ = 5_000_000
BOX_START_S = 0.3  # until its serial core has read its firmware and listens
BOX_ANSWER_S = 0.5  # its answers take four times as long as at 20 MHz
STEP_S, REST_S, LONGEST_S = 2e-3, 0.05, 2.0  # of motion by hand
HAND_UM, AROUND_UM = 40.0, 150.0  # how near a hand comes; where it passes the index from and to


def parameters(design: Design) -> dict[str, int | str]:
    """The parameters of the node of a design, without those that the twin sets."""
    return {name: value for name, value in design.parameters.items() if name not in BY_TWIN}


def twin_of(design: Design, nodes: Sequence[Node], seed: int, clk_hz: int) -> Twin:
    """Nodes that are the netlist of a design, with its firmware."""
    part, folder = design.board.part, boards_build.write(design)
    boards_build.make_firmware(design, folder)
    return Twin(
        nodes,
        seed=seed,
        clk_hz=clk_hz,
        node_parameters=parameters(design),
        firmware=build.words_of(folder / f"{firmware_stem(design.machine)}.hex"),
        netlist=f"{part.family.name} {part.synthesis}".strip(),
    )


class GateMotor(Motor):
    """S3 with the netlist of its node on a board."""

    def __init__(self, design: Design, seed: int) -> None:
        self.design = design
        super().__init__(seed)

    def twin_of(self, nodes: Sequence[Node], seed: int) -> Twin:
        return twin_of(self.design, nodes, seed, CLK_HZ)


def homes_and_moves(design: Design, seed: int) -> str:
    """Why a linear motor on the netlist of its node does not home to its index and move to a
    target; empty if it does.
    """
    motor = GateMotor(design, seed)
    zero = motor.search().zero_counts
    motor.axis.enable()
    motor.axis.move(mm=TARGET_MM)
    error_um = motor.position_um - zero * COUNT_M * 1e6 - TARGET_MM * 1e3
    status = motor.axis.status()
    console.print(f"{design.name}: zero at count {zero}, target missed by {error_um:.2f} um")
    if zero != 0 or not status.homed or status.faults:
        return f"zero at count {zero}, {status.fault_words or 'no fault'}"
    return f"{error_um:.2f} um beside the target" if abs(error_um) > NEAR_UM else ""


class GateStage:
    """The X axis of S0 with the netlist of its node on a board."""

    def __init__(self, design: Design, seed: int) -> None:
        self.twin = twin_of(design, [Node(s0_stage.ADDRESSES["X"])], seed, S0_CLK_HZ)
        port, source = TwinTransport(self.twin), random.Random(seed)
        self.twin.run_until_ready()
        bus = Bus(port, random_source=source, poll_s=s0_stage.POLL_S)
        self.axis = bus.axis(s0_stage.ADDRESSES["X"])

    @property
    def true_nm(self) -> float:
        return self.twin.true_position_nm(0)


def interpolates(design: Design, seed: int) -> str:
    """Why an axis on the netlist of its node does not home and move as its sine and cosine say;
    empty if it does. The true zero is unknown, but for whole periods of the signals.
    """
    stage = GateStage(design, seed)
    axis = stage.axis
    axis.enable()
    axis.home()
    axis.move(nm=S0_TARGET_NM)
    status = axis.status()
    away_nm = stage.true_nm - status.position_nm
    wrong_nm = away_nm - round(away_nm / s0_stage.PERIOD_NM) * s0_stage.PERIOD_NM
    console.print(f"{design.name}: {status.position_nm:.1f} nm shown, {wrong_nm:.1f} nm wrong")
    if status.faults or status.encoder_events:
        return ", ".join((*status.faults, *status.encoder_events))
    for what, nm in (("shown", wrong_nm), ("reached", status.position_nm - S0_TARGET_NM)):
        if abs(nm) > S0_NEAR_NM:
            return f"{nm:.1f} nm wrong in what is {what}"
    return ""


class Box:
    """The counter box of which the first axis is moved by hand."""

    def __init__(self, design: Design, seed: int) -> None:
        nodes = [Node(1, [Axis("linear_motor")] * len(design.machine.axes))]
        self.twin = twin_of(design, nodes, seed, BOX_HZ)
        self.twin.run(BOX_START_S)
        port, source = TwinTransport(self.twin), random.Random(seed)
        self.axis = Bus(port, answer_s=BOX_ANSWER_S, random_source=source).axis(1)
        for name in ("deglitch", "period", "counts_per_period"):
            self.axis.set_parameter(name, SETTINGS[name])

    def push_to(self, target_um: float) -> None:
        """Pushes the mover near the target; it is at rest then."""
        machine, began = self.twin.machines[0], self.twin.time()
        while abs(distance := target_um - self.true_um) > HAND_UM:
            if self.twin.time() - began > LONGEST_S:
                raise MoireError(f"the mover stays {distance:.0f} um beside {target_um} um")
            force = 4e-3 * distance + (1.1 if distance > 0 else -1.1)
            machine.push(force - 140 * machine.state.velocity_m_s)
            self.twin.run(STEP_S)
        machine.push(0.0)
        self.twin.run(REST_S)

    @property
    def true_um(self) -> float:
        return float(self.twin.machines[0].state.position_m * 1e6)


def counts_and_captures(design: Design, seed: int) -> str:
    """Why the netlist of the counter box does not show where a mover is that is pushed by hand,
    measured from the index that the box has captured; empty if it does.
    """
    box = Box(design, seed)
    box.push_to(-AROUND_UM)
    box.axis.capture_from("index")
    box.push_to(AROUND_UM)
    captures, _ = box.axis.captures()
    if not captures or captures[0].sources != ("index",):
        return "the index was not captured"
    box.push_to(TARGET_MM * 1e3)
    status = box.axis.status()
    shown_um = (status.position_nm - captures[0].position_nm) / 1e3
    console.print(f"{design.name}: {shown_um:.0f} um shown, {box.true_um:.2f} um true")
    if status.encoder_events:
        return ", ".join(status.encoder_events)
    wrong_um = shown_um - box.true_um
    return f"{wrong_um:.2f} um wrong" if abs(wrong_um) > NEAR_UM else ""


Check = Callable[[Design, int], str]
MACHINES: Sequence[tuple[str, str, Check]] = (
    ("colorlight_i5", "s3", homes_and_moves),
    ("ulx3s_85f", "s0", interpolates),
    ("icebreaker", "counter_box", counts_and_captures),
    ("tang_nano_20k", "s3", homes_and_moves),
)


def elaborates(design: Design, _seed: int) -> str:
    """Why Yosys does not read the top of a design; empty if it does."""
    top = boards_build.write(design) / "top.sv"
    yosys(top, {}, "proc", f"gates-{design.name}", design.board.part.family.read_cells)
    return ""


def gates_home_move(simulates: bool = True, seed: int = 1) -> float:
    """Machines that fail; without a simulation, those of which the top is not read."""
    failed = 0
    for board, machine, check in MACHINES:
        design = fit(boards.named(board), machines.named(machine))
        try:
            why = (check if simulates else elaborates)(design, seed)
        except (MoireError, BuildError, NetlistError, SynthesisError) as error:
            why = str(error)
        if why:
            failed += 1
            console.print(f"{design.name}: {why}", markup=False, highlight=False)
    return float(failed)


FIGURES = {
    "gates_home_move": Figure(
        gates_home_move,
        "machines",
        "of four machines for ECP5, iCE40 and Gowin, those that fail in the twin on the netlist "
        "that Yosys makes of their node, with the parameters, synthesis options and firmware of "
        "the board and a slower clock: S3 on Colorlight i5 and on Tang Nano 20K homes to its index "
        "and moves; S0 on ULX3S 85F homes and moves by sine and cosine; the counter box on "
        "iCEBreaker, which has no drives, captures the index of an axis that is pushed, and shows "
        "where it is",
        "0",
        Quick({"simulates": False}, "Yosys elaborates the tops; nothing is simulated"),
        0,
    ),
}
