# SPDX-License-Identifier: Apache-2.0
"""The command watch."""

from dataclasses import asdict
from fractions import Fraction

import click

from moire.cli.options import FOR
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import WAITING_TIME

EVERY_S = 0.2


@moire.command(
    "watch",
    help="Show the state and the position of an axis repeatedly.",
    example="moire --port /dev/ttyUSB0 watch --every 0.5s",
)
@click.option(
    "--every",
    type=WAITING_TIME,
    metavar="TIME",
    help=f"The time from row to row, with its unit. The default is {EVERY_S}s.",
)
@FOR
def watch(call: Call, every: Fraction | None, duration: Fraction | None) -> None:
    """Polls between the rows too, so that the watchdog of the node leaves the drive on."""
    began = call.now()
    for sample in call.axis.samples(EVERY_S if every is None else every, duration):
        seconds, status = sample.time_s - began, sample.status
        error_nm = status.target_nm - status.position_nm
        faults = f": {status.fault_words}" if status.faults else ""
        call.say_of_axis(
            {"time_s": seconds, **asdict(status)},
            f"{seconds:9.3f} s  {call.described.length(status.position_nm):>17}  "
            f"error {error_nm:10.1f} nm  "
            f"{status.velocity_mm_s:9.4f} mm/s  {status.words}{faults}",
        )
