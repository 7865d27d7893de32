# SPDX-License-Identifier: Apache-2.0
"""The image `counter`: a node without drives measures, and says so where a drive is asked for."""

import pytest

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import FAULT, PARAMETER, PERIOD

OF_DRIVES = {
    "enable": dict(axis=0, on=1),
    "home": dict(axis=0),
    "move": dict(axis=0, target=PERIOD),
    "prepare": dict(axis=0, target=PERIOD),
    "start": dict(axes=1),
    "start_at_sync": dict(axes=1),
    "stop": dict(axis=0),
}


@pytest.fixture
def machine():
    return CompiledNode(*[Axis() for _ in range(4)], address=1, image="counter")


@pytest.mark.parametrize("operation", OF_DRIVES)
def test_what_needs_a_drive_is_not_built(machine, operation):
    assert machine.request(operation, **OF_DRIVES[operation])[0] == "not_built"
    assert machine.status(0)["state"] == "off"


def test_a_record_that_excites_the_axis_is_not_built_and_any_other_is_made(machine):
    setting = dict(axis=0, trigger=0, before=0, every=4, level=0, amplitude=0)
    assert machine.request("arm_scope", **{**setting, "amplitude": 100})[0] == "not_built"
    assert machine.request("arm_scope", **setting)[0] == "ok"


def test_each_axis_reports_its_position(machine):
    for n, axis in enumerate(machine.axes):
        axis.machine = (n + 1) * PERIOD
    assert [machine.status(n)["position"] for n in range(4)] == [(n + 1) * PERIOD for n in range(4)]


def test_a_fault_is_reported_until_it_is_reset(machine):
    machine.axes[2].causes = FAULT["estop"]
    machine.run(2)
    assert machine.status(2)["state"] == "faulted" and machine.status(1)["state"] == "off"
    machine.axes[2].causes = 0
    assert machine.request("reset_faults", axis=2)[0] == "ok"
    assert machine.status(2)["state"] == "off"


def test_parameters_are_set_and_read_back(machine):
    machine.set(3, counts_per_period=4, decoder_mode=1)
    reply = machine.ask("get_parameter", axis=3, parameter=PARAMETER["decoder_mode"]["id"])
    assert reply["value"] == 1
