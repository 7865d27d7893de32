# SPDX-License-Identifier: Apache-2.0
"""The correction from the calibration to the position. The compiled calibration of the firmware
determines the errors of the interferometer, the values are written to the node over the bus, and
the positions of the node are compared with the true position of the table.
"""

import random

import numpy as np
import pytest

from figures import calibration as figures_calibration
from moire.client.axis import CORRECTION
from moire.client.bus import Bus
from twin import Twin, TwinTransport
from twin.parameters import tables as parameters

PLACES = 16  # of a period
LOOKS = 8  # readings at each position: the noise of one is 0.7 nm
LOADING_S = 0.6  # time until the table of the node is computed and in force


@pytest.fixture(scope="module")
def machine_and_axis():
    with Twin(nodes=(1,), plant=figures_calibration.HARMONICS_OF_TWIN) as twin:
        bus = Bus(TwinTransport(twin), random_source=random.Random(1))
        twin.run_until_ready()
        yield twin.machine(), bus.axis(1)


@pytest.fixture(scope="module")
def calibrated():
    machine, *_ = figures_calibration.calibrated(
        1,
        0,
        0,
        curve=figures_calibration.curve_of_twin(),
        amplitude=parameters.values()["signal_amplitude"],
    )
    assert machine.calibration.complete
    return {
        **machine.values,
        "cosine": list(machine.values["cosine"]),
        "sine": list(machine.values["sine"]),
    }


def left_nm(machine, axis, correction):
    """Largest difference of the node's position from the true one over a period with this
    correction, without its mean. The table
    rests at each position."""
    axis.set_correction(correction)
    axis.node.bus.transport.wait(LOADING_S)
    away = []
    for n in range(PLACES):
        machine.set_position(n * 0.8e-6 / PLACES)
        axis.node.bus.transport.wait(0.001)
        away.append(
            np.mean([axis.status().position_nm - machine.state.position_nm for _ in range(LOOKS)])
        )
    return np.abs(np.array(away) - np.mean(away)).max()


def test_harmonics_of_the_calibration_are_subtracted_from_every_position(
    machine_and_axis, calibrated
):
    machine, axis = machine_and_axis
    flat = {"cosine": [0] * 10, "sine": [0] * 10}
    uncorrected = left_nm(machine, axis, {**dict.fromkeys(CORRECTION, 0), "gain": 65536, **flat})
    ellipse = left_nm(machine, axis, {**calibrated, **flat})
    harmonics = left_nm(machine, axis, calibrated)
    assert uncorrected > 6 and ellipse > 3 and harmonics < 1, (
        f"{uncorrected:.2f}, {ellipse:.2f}, {harmonics:.2f} nm"
    )
