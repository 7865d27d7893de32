# SPDX-License-Identifier: Apache-2.0
"""Walks the pins of a board without a machine: with nothing connected, and through a loop-back plug
from the outputs of an axis to its inputs, which the wiring page of the board describes.

Steps are output as quadrature, so that each of them is a count of the encoder. An open
`drive_fault_n` reads as no fault.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress

from moire.analysis.selftest import Check
from moire.client.axis import Axis
from moire.client.node import Node
from moire.client.records import Status
from moire.errors import MoireError, Refused
from moire.units import Value

GROUND = "GND"
PLUG = {  # input: what the plug connects it to, an output of the same axis or a level
    "encoder_a": "step",
    "encoder_b": "direction",
    "encoder_z": "drive_enable",
    "limit_low_open": GROUND,
    "limit_high_open": GROUND,
    "estop_open": GROUND,
}
COUNTS = 40  # of a walk, each way
SETTINGS: dict[str, Value] = {  # of an axis during the walk: a count is 1 um
    "drive": "steps",
    "step_output": "quadrature",
    "step_invert": 0,
    "period": "4um",
    "counts_per_period": 4,
    "steps_per_period": 4,
    "position_source": "counts",
    "disagreement_limit": 0,
    "encoder_fault_mask": 1,
    "deglitch": 0,
    "step_trim": 5,
    "kp": 0,
    "ki": 0.0004,
    "kd": 0,
    "kv": 0,
    "ka": 0,
    "integral_limit": 0.99,
    "output_limit": 0.99,
    "travel_low": "-1mm",
    "travel_high": "1mm",
    "following_limit": "20um",
    "velocity": "1mm/s",
    "acceleration": "100mm/s2",
    "jerk": "10m/s3",
    "home_method": 37,
    "settle_window": "1um",
    "settle_time": "5ms",
    "dead_band": 0,
}


def open_checks(node: Node) -> Iterator[Check]:
    """The checks of a board to which nothing is connected: pull-ups read as pressed switches."""
    for number, axis in driven(node):
        status = axis.status()
        closed = [name for name, on in pressed(status).items() if not on]
        words = f"reads 0: {', '.join(closed)}" if closed else "each reads 1"
        yield Check(f"axis {number} open inputs", not closed, words)


def plug_checks(node: Node) -> Iterator[Check]:
    """The checks of a board with a loop-back plug at each axis."""
    for number, axis in driven(node):
        for check in axis_checks(axis):
            yield check._replace(name=f"axis {number} {check.name}")


def pressed(status: Status) -> dict[str, bool]:
    """Whether each of the switches reads 1."""
    return {
        "limit_low_open": status.limit_low,
        "limit_high_open": status.limit_high,
        "estop_open": status.estop,
    }


def driven(node: Node) -> Iterator[tuple[int, Axis]]:
    """The axes with a drive."""
    for number in range(node.identity.axes):
        axis = node.axis(number)
        if axis.built().has("drive"):
            yield number, axis


@contextmanager
def prepared(axis: Axis) -> Iterator[None]:
    """The settings of the walk, and those of before when it ends; the drive is off then."""
    axis.disable()
    before = {name: axis.get_parameter(name).counts for name in SETTINGS}
    try:
        axis.load_parameters(SETTINGS)
        yield
    finally:
        axis.disable()
        for name, counts in before.items():
            with suppress(Refused):  # of a node as at power-up: it names a drive that is not built
                axis.write_parameter(name, counts)


def axis_checks(axis: Axis) -> Iterator[Check]:
    """The checks of one axis; those that need steps are left out if it cannot step."""
    closed = closed_check(axis.status())
    yield closed
    if not axis.built().has("stepper"):
        yield Check("steps", True, "not walked: built without a step generator")
    elif closed.passed:
        with prepared(axis):
            yield from walk(axis)


def closed_check(status: Status) -> Check:
    """The plug closes both switches and the emergency stop."""
    found = [name for name, on in pressed(status).items() if on]
    words = f"reads 1: {', '.join(found)}" if found else "limits and emergency stop read 0"
    return Check("closed inputs", not found, words)


def walk(axis: Axis) -> Iterator[Check]:
    """From `drive_enable` to `encoder_z`, and from `step` and `direction` to both levels of A and
    B, up and down.
    """
    try:
        axis.reset()
        axis.write_feedback("index_events", found=1)
        axis.write_feedback("strobes", arm_index=1)
        axis.enable()
        axis.home()
        start = axis.status().counts
        up = axis.move(um=COUNTS).counts - start
        down = axis.move(um=0).counts - start
    except MoireError as error:
        yield Check("steps", False, f"step to encoder_a, direction to encoder_b: {error}")
        return
    passed = (up, down) == (COUNTS, 0)
    words = f"{up} counts of {COUNTS} steps up, {down} after as many down"
    yield Check("steps", passed, words)
    found = bool(axis.feedback("index_events")["found"])
    words = "seen as an index" if found else "no edge at encoder_z when the drive was switched on"
    yield Check("enable", found, words)
