# SPDX-License-Identifier: Apache-2.0
"""Recordings of real devices beside the checkout. Tests and figures do without an absent one."""

import csv
from collections.abc import Iterator
from pathlib import Path

from twin.build import ROOT

CAPTURES = ROOT.parent / "shared" / "captures"
KEYBOARD = CAPTURES / "ps2_keyboard_asdfgh.csv"
TYPED = bytes.fromhex("1cf01c 1bf01b 23f023 2bf02b 34f034 33f033")  # of KEYBOARD: a s d f g h


def rows(recording: Path) -> Iterator[tuple[int, ...]]:
    """(sample, levels...) of each change of a recording, without its head."""
    with open(recording, newline="") as lines:
        for row in csv.reader(line for line in lines if line[0].isdigit()):
            yield tuple(map(int, row))
