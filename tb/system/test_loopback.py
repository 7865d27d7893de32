# SPDX-License-Identifier: Apache-2.0
"""The walk of the pins through a loop-back plug, on a node with a step generator as shipped: each
wire that is cut or stuck is found, and the settings of before are there again.
"""

import random

import pytest

from experiments.s4_job import CLK_HZ, NODE
from moire.analysis import loopback
from moire.client.bus import Bus
from tb.bench import seed
from twin import Axis, Node, Twin, TwinTransport
from twin.nodes.twin import ALL_PERIPHERALS


def node_with(machine):
    print(f"SEED={seed()}")
    twin = Twin(
        [Node(1, [Axis(machine)])],
        seed=seed() % 1000,
        clk_hz=CLK_HZ,
        node_parameters=ALL_PERIPHERALS | NODE,  # that of S4: one build for all its tests
    )
    twin.run_until_ready()
    return twin, Bus(TwinTransport(twin), random_source=random.Random(seed()), poll_s=0.01).node(1)


@pytest.fixture(scope="module")
def plugged():
    return node_with("loopback_plug")


def failed(node):
    return [check.name for check in loopback.plug_checks(node) if not check.passed]


def test_a_sound_board_passes_and_has_its_settings_again(plugged):
    _, node = plugged
    axis = node.axis(0)
    for name, value in (("drive", "steps"), ("position_source", "counts"), ("velocity", "7mm/s")):
        axis.set_parameter(name, value)
    before = axis.save_parameters()
    checks = list(loopback.plug_checks(node))
    print(checks)
    names = ("closed inputs", "steps", "enable")
    assert [check.name for check in checks] == [f"axis 0 {name}" for name in names]
    assert all(check.passed for check in checks)
    assert checks[1].words == "40 counts of 40 steps up, 0 after as many down"
    assert axis.save_parameters() == before
    assert not axis.status().enabled


@pytest.mark.parametrize(
    "fault, level, name",
    [
        ("a_stuck", False, "steps"),
        ("b_stuck", True, "steps"),
        ("z_stuck", False, "enable"),
        ("limit_low", False, "closed inputs"),
        ("limit_high", False, "closed inputs"),
        ("drive_fault", False, "steps"),
    ],
)
def test_a_wire_that_is_cut_or_stuck_is_found(fault, level, name, plugged):
    twin, node = plugged
    with twin.machines[0].fault(fault, level):
        assert failed(node) == [f"axis 0 {name}"]
    assert failed(node) == []


def test_an_emergency_stop_that_is_open_is_found(plugged):
    twin, node = plugged
    twin.inject("estop", 0)
    twin.run(0.01)
    assert failed(node) == ["axis 0 closed inputs"]
    twin.clear("estop", 0)


def test_inputs_that_nothing_is_connected_to_read_as_pressed(plugged):
    twin, node = plugged
    checks = list(loopback.open_checks(node))
    assert [check.passed for check in checks] == [False]
    assert checks[0].words == "reads 0: limit_low_open, limit_high_open, estop_open"
    twin.inject("estop", 0)
    twin.inject("limit_low")
    twin.inject("limit_high")
    twin.run(0.01)
    assert [check.words for check in loopback.open_checks(node)] == ["each reads 1"]
    twin.clear("estop", 0)
    twin.clear("limit_low")
    twin.clear("limit_high")
