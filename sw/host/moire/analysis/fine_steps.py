# SPDX-License-Identifier: Apache-2.0
"""Measures how the fine stage of an axis responds to steps of its DAC.

    steps = fine_steps.measure(axis, amplitude="0.4%")
    plant = fine.identify(steps)                # moire.analysis.fine

The axis is at standstill with both loops open: the motor rests, and the DAC alternates between two
values around the middle. After each step the recorder of the calibration stores the phase 2048
times at equal intervals, from which the response is known up to half of RATE_HZ.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import numpy
from numpy.typing import NDArray

from moire import units
from moire.client.access import COUNTS, FULL_SCALE
from moire.client.axis import Axis
from moire.client.built import remedy
from moire.client.names import code_name
from moire.errors import MoireError, OutOfRange, Refused
from moire.made.bus_tables import OPERATIONS, SCOPE_STATES

Array = NDArray[numpy.float64]

AMPLITUDE = "0.4%"  # of full scale
STEPS = 6
RATE_HZ = 10_000  # of the recorded phases, as near as the sample rate allows
PHASES = 2048  # of a record, as many as the recorder stores
AT_ONCE = sum(field.startswith("word_") for field, _ in OPERATIONS["read_fine"].reply)
PATIENCE_S = 20.0  # until the motor and the fine stage are at rest, and a record is complete
# Cycles from the servo tick, at which the position is taken, to the command of the fine stage
# (rtl/drive/pid_loop.sv). The recording does not contain them, since it begins with a command.
LOOP_CYCLES = 134


class NotMeasured(MoireError):
    """The response was not recorded; the text says why."""


@dataclass(frozen=True)
class Steps:
    """What was recorded after some equal steps of the DAC."""

    positions: Array  # a row for each step, as if all went up, from 0 on; LSB of 2^-16 period
    interval_s: float  # from position to position; the DAC gets the step with the first one
    size: float  # of a step, LSB of the DAC
    tick_s: float  # of the loop
    compute_s: float  # from the servo tick to the command of the loop

    def __post_init__(self) -> None:
        assert self.positions.ndim == 2 and self.interval_s > 0 and self.size > 0


def positions_of(words: Iterable[int]) -> Array:
    """The positions from the first one on, in LSB, of words with two phases each."""
    packed = numpy.array(list(words), dtype=numpy.uint32)
    phases = numpy.column_stack([packed & 0xFFFF, packed >> 16]).ravel().astype(numpy.int64)
    moved = (numpy.diff(phases) + COUNTS // 2) % COUNTS - COUNTS // 2
    return numpy.concatenate([[0.0], numpy.cumsum(moved, dtype=float)])


def measure(axis: Axis, amplitude: units.Value = AMPLITUDE, count: int = STEPS) -> Steps:
    """The responses of an axis to `count` steps between -amplitude and +amplitude (of full scale).

    The axis must be enabled and at rest. Both loops are open meanwhile; at the end the axis holds
    the position where it then is. Raises Refused, NotMeasured or OutOfRange.
    """
    offset = offset_of(axis, amplitude)
    if not 3 <= count <= 100:
        raise OutOfRange(f"{count} steps: from 3 to 100")
    check_built(axis)
    identity = axis.node.identity
    every = max(1, round(Fraction(identity.sample_hz, RATE_HZ)))

    def work() -> list[Array]:
        rows = []
        for number in range(count + 1):
            sign = 1 if number % 2 else -1
            axis.request("step_fine", offset=sign * offset, every=every)
            words = record(axis)
            if number:  # the first step only goes to where the others begin
                rows.append(sign * positions_of(words))
        return rows

    rows = axis.stopping_on_error(work)
    axis.stop_and_wait()
    return Steps(
        numpy.array(rows),
        every / identity.sample_hz,
        2.0 * offset,
        1 / identity.tick_hz,
        LOOP_CYCLES / identity.clk_hz,
    )


def offset_of(axis: Axis, amplitude: units.Value) -> int:
    """An amplitude in LSB of the DAC; raises OutOfRange unless the DAC can make it both ways."""
    share = units.parse_share(amplitude)
    offset, trim = round(share * FULL_SCALE), axis.get_parameter("dac_trim").counts
    most = FULL_SCALE - 1 - abs(trim)
    if not 1 <= offset <= most:
        raise OutOfRange(
            f"an amplitude of {100 * float(share):g} % of full scale: from "
            f"{100 / FULL_SCALE:.3f} % to {100 * most / FULL_SCALE:.1f} %, which dac_trim leaves"
        )
    return offset


def check_built(axis: Axis) -> None:
    """Raises NotMeasured unless the axis has a fine stage and can record its phases."""
    built = axis.built()
    for feature in ("fine_stage", "recorder"):
        if not built.has(feature):
            raise NotMeasured(
                f"node {axis.node.address} axis {axis.number} cannot measure the response of a "
                f"fine stage: {remedy(feature)}"
            )
    if axis.get_parameter("drive").written() == "dac":
        raise NotMeasured("the parameter drive is dac: the DAC is the drive, and no fine stage")


def record(axis: Axis) -> list[int]:
    """The words of the step that was requested, as soon as they are complete."""
    end = axis.transport.now() + PATIENCE_S
    words: list[int] = []
    while len(words) < PHASES // 2:
        reply = read(axis)
        if reply["invalid"]:
            raise NotMeasured(
                "sine and cosine were disturbed during the recording: see `moire signal`"
            )
        if code_name(SCOPE_STATES, reply["state"], "state") == "full":
            words += [reply[f"word_{n}"] for n in range(AT_ONCE)]
            continue
        if axis.transport.now() > end:
            raise NotMeasured(
                f"the fine stage did not come to rest, or was not recorded, within "
                f"{PATIENCE_S:g} s: is the ADC read at its sample rate?"
            )
        axis.node.bus.until_next_poll(axis.node)
    return words[: PHASES // 2]


def read(axis: Axis) -> dict[str, int]:
    """A reply to read_fine; raises NotMeasured if the axis has left the open loop."""
    try:
        return axis.request("read_fine")
    except Refused as refused:
        if refused.cause != "not_prepared":
            raise
        why = axis.status().fault_words or "it was stopped or switched off"
        raise NotMeasured(
            f"the recording of node {axis.node.address} axis {axis.number} ended early: {why}"
        ) from None
