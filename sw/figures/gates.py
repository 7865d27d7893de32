# SPDX-License-Identifier: Apache-2.0
"""Figure of the gates: a machine of each family of FPGAs on the netlist of its node, as the board
builds it, in the twin.

The netlist is that of rtl/node.sv with the parameters, the synthesis and the firmware of `make
board`; only the clock is slower, and the top with PLL and pins is not there. A netlist of S3 homes
to the index of its scale and moves. The iCE40 boards have no drives: there the counter box captures
the index of an axis that something else pushes, and shows when it is at the target.
"""

import random
from collections.abc import Callable, Mapping, Sequence

from boards import board as boards
from boards import machine as machines
from boards.fit import Design, fit
from experiments.s3_zero import CLK_HZ, COUNT_M, SETTINGS, Motor
from figures.common import Figure, Quick, console
from figures.synthesis import SynthesisError, elaborated, source_of
from moire.client.bus import Bus
from moire.errors import MoireError
from twin import BuildError, Twin, TwinTransport, build
from twin.netlist import NetlistError
from twin.nodes.twin import BAUD, Axis, Node

BY_TWIN = ("CLK_HZ", "AXES", "FIRMWARE")  # parameters of the node that the twin sets itself
TARGET_MM = 0.5
NEAR_UM = 2.0  # two counts of the scale
BOX_HZ, BOX_BAUD = 5_000_000, 28_800  # both a quarter of those of the counter box at 20 MHz
BOX_START_S = 0.3  # until its serial core has read its firmware and listens
STEP_S, LONGEST_S = 5e-3, 2.0  # of motion by hand


def parameters(design: Design) -> dict[str, int | str]:
    """The parameters of the node of a design, without those that the twin sets."""
    return {name: value for name, value in design.parameters.items() if name not in BY_TWIN}


def twin_of(design: Design, nodes: Sequence[Node], seed: int, clk_hz: int, baud: float) -> Twin:
    """Nodes that are the netlist of a design, with its firmware."""
    machine, part = design.machine, design.board.part
    return Twin(
        nodes,
        seed=seed,
        clk_hz=clk_hz,
        baud=baud,
        node_parameters=parameters(design),
        firmware=build.firmware(machine.image, len(machine.axes), machine.core, machine.update),
        netlist=f"{part.family.name} {part.synthesis}".strip(),
    )


class GateMotor(Motor):
    """S3 with the netlist of its node on a board."""

    def __init__(self, design: Design, seed: int) -> None:
        self.design = design
        super().__init__(seed)

    def twin_of(self, nodes: Sequence[Node], seed: int) -> Twin:
        return twin_of(self.design, nodes, seed, CLK_HZ, BAUD)


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


class Box:
    """The counter box of which the first axis is moved by hand."""

    def __init__(self, design: Design, seed: int) -> None:
        nodes = [Node(1, [Axis("linear_motor")] * len(design.machine.axes))]
        self.twin = twin_of(design, nodes, seed, BOX_HZ, BOX_BAUD)
        self.twin.run(BOX_START_S)
        self.axis = Bus(TwinTransport(self.twin), random_source=random.Random(seed)).axis(1)
        for name in ("deglitch", "period", "counts_per_period"):
            self.axis.set_parameter(name, SETTINGS[name])

    def push_to(self, target_um: float, read_um: Callable[[], float]) -> None:
        """Pushes the mover, by what is read of its position, until it is within a count of the
        target.
        """
        began = self.twin.time()
        while abs(distance := target_um - read_um()) > COUNT_M * 1e6:
            if self.twin.time() - began > LONGEST_S:
                raise MoireError(f"the box shows {distance:.1f} um beside the target")
            velocity = self.twin.machines[0].state.velocity_m_s
            self.twin.push(0, 4e-3 * distance + (1.1 if distance > 0 else -1.1) - 140 * velocity)
            self.twin.run(STEP_S)
        self.twin.push(0, 0.0)

    @property
    def true_um(self) -> float:
        return float(self.twin.machines[0].state.position_m * 1e6)


def counts_and_captures(design: Design, seed: int) -> str:
    """Why a mover that is pushed by what the netlist of the counter box shows does not come to the
    target, measured from the index that the box has captured; empty if it does.
    """
    box = Box(design, seed)
    box.push_to(-100, lambda: box.true_um)
    box.axis.capture_from("index")
    box.push_to(100, lambda: box.true_um)
    captures, _ = box.axis.captures()
    if not captures or captures[0].sources != ("index",):
        return "the index was not captured"
    zero_nm = captures[0].position_nm
    shown_um = lambda: (box.axis.status().position_nm - zero_nm) / 1e3
    box.push_to(TARGET_MM * 1e3, shown_um)
    error_um = box.true_um - TARGET_MM * 1e3
    events = box.axis.status().encoder_events
    console.print(f"{design.name}: index at {zero_nm} nm, target missed by {error_um:.2f} um")
    if events:
        return ", ".join(events)
    return f"{error_um:.2f} um beside the target" if abs(error_um) > NEAR_UM else ""


MACHINES: Mapping[str, tuple[str, str, Callable[[Design, int], str]]] = {
    "ecp5": ("colorlight_i5", "s3", homes_and_moves),
    "ice40": ("icebreaker", "counter_box", counts_and_captures),
    "gowin": ("tang_nano_20k", "s3", homes_and_moves),
}


def elaborates(design: Design, _seed: int) -> str:
    """Why Yosys does not read the node of a design; empty if it does."""
    counted = ("AXES",)
    values = parameters(design) | {name: design.parameters[name] for name in counted}
    elaborated(source_of("node"), values)
    return ""


def gates_home_move(simulates: bool = True, seed: int = 1) -> float:
    """Families of which the machine fails; without a simulation, of which the node is not read."""
    failed = 0
    for family, (board, machine, check) in MACHINES.items():
        design = fit(boards.named(board), machines.named(machine))
        try:
            why = (check if simulates else elaborates)(design, seed)
        except (MoireError, BuildError, NetlistError, SynthesisError) as error:
            why = str(error)
        if why:
            failed += 1
            console.print(f"{family}: {why}", markup=False, highlight=False)
    return float(failed)


FIGURES = {
    "gates_home_move": Figure(
        gates_home_move,
        "families",
        "of ECP5, iCE40 and Gowin, those whose machine fails in the twin on the netlist that Yosys "
        "makes of its node, with the parameters, synthesis options and firmware of its board and a "
        "slower clock: S3 on Colorlight i5 and on Tang Nano 20K homes to its index and moves; the "
        "counter box on iCEBreaker, which has no drives, captures the index of an axis that is "
        "pushed, and shows when it is at the target",
        "0",
        Quick({"simulates": False}, "Yosys elaborates the nodes; nothing is simulated"),
        0,
    ),
}
