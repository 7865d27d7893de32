# SPDX-License-Identifier: Apache-2.0
"""Makes the tables of docs/boards.md from the boards and machines of constraints/."""

import os
import sys
from pathlib import Path

from boards import board, machine, placements
from boards.board import Board
from boards.build import fitting
from boards.fit import Design
from boards.machine import Axis, Machine
from boards.placements import Build
from figures import record
from figures.comparison import comparisons
from tables import made_files
from tables.made_files import ROOT

PAGE = ROOT / "docs" / "boards.md"
BEGIN = "<!-- Made by tables/boards.py from constraints/: do not edit. -->\n"
END = "<!-- End of the made tables. -->\n"


PLACED = (
    "What was placed so far, by `make boards` ([placements](#placements)); the hash is that of the "
    "placement with the first seed:"
)
SIZE = "axis_step_lut"  # the figure that others have a number for
AXES_OF_A_MILL = 3
BESIDE = (
    "What three axes of a mill with scales take elsewhere: an encoder counter and a step generator "
    "for each axis, measured from public sources (`sw/figures/peers.toml`), without the part that "
    f"talks to the PC. An axis of Moire is what each further one adds to a node (`{SIZE}` in the "
    "[README](../README.md#figures)); soft core, bus and motion engine come once for a node, and "
    "are in the builds of `mill` above. A logic cell of an iCE40 is a LUT4 with its flip-flop and "
    "carry:"
)


def table(head: str, rows: list[list[str]]) -> list[str]:
    """A table of Markdown; the columns of the head are separated by commas."""
    columns = head.split(", ")
    lines = [f"| {' | '.join(each)} |" for each in [columns, ["---"] * len(columns), *rows]]
    return ["", *lines]


def link(file: str) -> str:
    return os.path.relpath(ROOT / file, PAGE.parent)


def levels(one: Board) -> str:
    """The levels of its connectors."""
    pads = [pad for pins in one.connectors.values() for pad in pins.values()]
    found = sorted({pad.volts for pad in pads})
    words = " and ".join(f"{volts:g} V" for volts in found)
    return f"{words}, outputs until their buffers are replaced" if one.buffer else words


def board_row(one: Board) -> list[str]:
    balls = {pad.ball for pins in one.connectors.values() for pad in pins.values()}
    own = balls - {pad.ball for pad in one.on_board.values()}
    on_usb = "its USB serial port and RS-485" if "usb_rx" in one.on_board else "RS-485"
    return [
        f"[`{one.name}`]({link(one.file)})",
        one.title,
        f"{one.part.name}: {one.part.lut} LUT, {one.part.block_ram} block RAMs",
        f"{one.node_hz / 1e6:g} MHz",
        str(len(own)),
        levels(one),
        on_usb,
    ]


def kind(axis: Axis) -> str:
    """What an axis is, in words."""
    scale = "sine, cosine and A/B/Z" if axis.has("sine") else "A/B/Z"
    return f"{scale}, {', '.join(axis.drives) or 'no drive'}"


def machine_row(one: Machine) -> list[str]:
    kinds = sorted({kind(axis) for axis in one.axes})
    firmware = f"`{one.image}`, {one.core} core, {one.memory_kib} KiB"
    return [
        f"[`{one.name}`]({link(one.file)})",
        one.title,
        "none" if one.orders else f"{len(one.axes)}: {'; '.join(kinds)}",
        ", ".join(one.peripherals) or "none",
        "none" if one.orders else firmware,
    ]


def design_row(one: Design) -> list[str]:
    return [
        f"`make board BOARD={one.board.name} MACHINE={one.machine.name}`",
        f"{one.estimate.lut} of {one.board.part.lut}",
        f"{one.estimate.block_ram} of {one.board.part.block_ram}",
        str(len(one.connections)),
    ]


def placed_row(one: Design, known: Build) -> list[str]:
    """What the record says of a build."""
    placed = [known.seeds[seed] for seed in sorted(known.seeds)]
    mhz = [each.mhz for each in placed if not each.failed]
    failed = [str(seed) for seed, each in known.seeds.items() if each.failed]
    if not placed:
        placer = one.board.part.family.placer
        worst = "not placed yet" if placer else "no open tool places it"
    else:
        worst = f"failed with seed {', '.join(failed)}" if failed else f"{min(mhz):.1f}"
    return [
        f"`{one.machine.name}` on `{one.board.name}`",
        known.used,
        f"{one.board.node_hz / 1e6:g}",
        str(len(placed)),
        worst,
        f"{max(mhz):.1f}" if mhz else "",
        f"`{placed[0].placement}`" if placed and placed[0].placement else "",
        max(each.date for each in placed).isoformat() if placed else "",
    ]


def beside() -> list[list[str]]:
    """The size of an axis, of others and of Moire, and of three."""
    found = [(peer.name, peer.value, peer.source) for peer in comparisons()[SIZE].peers]
    ours = record.read()[SIZE]
    what = f"{ours.unit}; counts and steps; filter, profile, servo, homing, interlock"
    rows = [*sorted(found, key=lambda row: row[1]), ("Moire", ours.value, what)]
    return [
        [name, f"{value:.0f}", f"{AXES_OF_A_MILL * value:.0f}", does] for name, value, does in rows
    ]


def make() -> dict[Path, str]:
    boards = [board.named(name) for name in board.names()]
    machines = [machine.named(name) for name in machine.names()]
    designs, refused = fitting()
    known = placements.read()
    lines = [
        *table(
            "board, what it is, part, clock of the node, pins, levels, bus",
            [board_row(one) for one in boards],
        ),
        *table(
            "machine, what it is, axes, peripherals, firmware",
            [machine_row(one) for one in machines],
        ),
        *table(
            "command, LUT or logic cells by estimate, block RAMs by estimate, signals",
            [design_row(one) for one in designs],
        ),
        *(["", "Wired, but too large:", ""] * bool(refused)),
        *(f"- {why}" for why in refused),
        "",
        PLACED,
        *table(
            "build, takes of its part, clock in MHz, seeds, worst MHz, best MHz, hash, date",
            [placed_row(one, known.get(one.name, Build())) for one in designs],
        ),
        "",
        BESIDE,
        *table("whose, an axis, three axes, cells and what an axis does", beside()),
        "",
    ]
    return {PAGE: made_files.filled(PAGE, BEGIN, END, lines)}


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__ or "", make))
