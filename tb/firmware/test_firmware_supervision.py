# SPDX-License-Identifier: Apache-2.0
"""supervision.c: what a host asks for by the register axis_requests."""

import pytest

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import DEFINES, PERIOD

PARAMETERS = {
    "travel_low": -50 * PERIOD,
    "travel_high": 2000 * PERIOD,
    "home_distance": 100 * PERIOD,
    "homing_search_speed": 2000,
}


@pytest.fixture
def machine():
    """An axis far from its switch, whose drive the host has switched on."""
    found = CompiledNode(Axis(position=1500 * PERIOD, low=0), image="stream")
    found.set(**PARAMETERS)
    ask(found, enable=1)
    assert found.status()["state"] == "holding"
    return found


def ask(machine, **requests):
    """The requests for axis 0, and time for the firmware to serve them."""
    masks = {name: DEFINES[f"NODE_AXIS_REQUESTS_{name.upper()}_SHIFT"] for name in requests}
    machine.word[DEFINES["NODE_AXIS_REQUESTS"]] = sum(
        value << masks[name] for name, value in requests.items()
    )
    machine.run(5)


def test_a_homing_ends_where_its_request_falls_and_begins_again_where_it_rises(machine):
    ask(machine, enable=1, home=1)
    machine.run(100)
    assert machine.status()["state"] == "homing"
    ask(machine, enable=1, home=0)
    assert machine.run(2000, until=lambda: machine.status()["state"] == "holding")
    status = machine.status()
    assert status["ended"] == "stopped" and not status["flags"] & {"homed"}
    assert machine.axes[0].position > 100 * PERIOD, "it has not gone on to the switch"
    ask(machine, enable=1, home=1)
    assert machine.run(20_000, until=lambda: machine.status()["ended"] == "ok")


def test_a_request_to_home_that_falls_after_the_homing_changes_nothing(machine):
    ask(machine, enable=1, home=1)
    assert machine.run(20_000, until=lambda: machine.status()["ended"] == "ok")
    ask(machine, enable=1, home=0)
    status = machine.status()
    assert (status["state"], status["ended"]) == ("holding", "ok") and "homed" in status["flags"]
    machine.ask("move", axis=0, target=300 * PERIOD)
    ask(machine, enable=1, home=0)
    assert machine.status()["state"] == "moving"
