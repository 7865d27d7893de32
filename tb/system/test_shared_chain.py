# SPDX-License-Identifier: Apache-2.0
"""A node of three sine axes, of which the first two share an interpolation chain and the third has
one of its own: each has its own correction, homes and moves, and a fault of one is not that of
another.
"""

import random

import numpy as np
import pytest

from figures import calibration as figures_calibration
from moire.client.bus import Bus
from tb.bench import seed
from tb.system.test_s0_correction import calibrated
from twin import Axis, Node, Twin, TwinTransport
from twin.nodes.twin import drives

FIRST, SECOND, OWN = range(3)
NODE = {**drives("HAS_BRIDGE"), "FILTERS": 0, "HAS_OWN_CHAIN": 1 << OWN}
CLK_HZ = 4_800_000  # a tick has the cycles that the motion engine needs for three axes
PERIOD_M = 0.8e-6
PLACES = 6  # of a period
LOOKS = 4  # readings at each position: the noise of one is 0.7 nm
LOADING_S = 1.5  # time until the tables of two axes are computed and in force

assert calibrated  # the fixture


@pytest.fixture
def twin():
    with Twin(
        [Node(1, [Axis(), Axis(), Axis()])],
        plant=figures_calibration.HARMONICS_OF_TWIN,
        seed=seed() % 1000,
        clk_hz=CLK_HZ,
        node_parameters=NODE,
    ) as made:
        yield made


def axes_of(twin):
    bus = Bus(TwinTransport(twin), random_source=random.Random(seed()))
    twin.run_until_ready()
    return [bus.axis(1, n) for n in range(3)]


def left_nm(twin, axis):
    """Largest difference of the node's position from the true one over a period, without its
    mean.
    """
    machine, away = twin.machine(axis.number), []
    for n in range(PLACES):
        machine.set_position(n * PERIOD_M / PLACES)
        twin.run(0.001)
        looks = [axis.status().position_nm - machine.state.position_nm for _ in range(LOOKS)]
        away.append(np.mean(looks))
    return np.abs(np.array(away) - np.mean(away)).max()


def test_each_axis_has_a_correction_of_its_own(twin, calibrated):
    axes = axes_of(twin)
    for axis in (axes[SECOND], axes[OWN]):
        axis.set_correction(calibrated)
    twin.run(LOADING_S)
    left = [left_nm(twin, axis) for axis in axes]
    assert left[FIRST] > 4 and left[SECOND] < 1.5 and left[OWN] < 1.5, left


def test_all_axes_home_and_move_at_once_and_a_fault_stays_with_its_axis(twin):
    axes = axes_of(twin)
    for axis in axes:
        axis.enable()
        axis.request("home")
    for axis in axes:
        assert axis.wait().homed
    for n, axis in enumerate(axes):
        axis.begin_move(f"{20 + 10 * n}um")
    for n, axis in enumerate(axes):
        ended = axis.wait()
        assert ended.ended == "ok" and not ended.faults
        assert abs(ended.position_nm - (20 + 10 * n) * 1000) < 1000
    twin.set_plant(FIRST, signal_amplitude=0.05)
    twin.run(0.1)
    assert [bool(axis.status().faults) for axis in axes] == [True, False, False]
