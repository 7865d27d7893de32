# SPDX-License-Identifier: Apache-2.0
"""`moire twin --machine` as a separate program: a client finds and moves the machine of each
experiment.
"""

import pytest

from experiments.machines import MACHINES
from moire.bus import twin_port
from tb.system.test_gateway import moire, served

pytestmark = pytest.mark.filterwarnings(
    "ignore:set(Daemon|Name).. is deprecated:DeprecationWarning"
)  # in pyserial


def test_the_machines_on_the_page_are_those_that_exist():
    assert list(twin_port.MACHINES) == list(MACHINES)


@pytest.mark.parametrize(
    ("machine", "entrance", "axes", "location", "distance", "near_nm"),
    [
        ("s0_fine", "tcp", {1: 1}, (), "100um", 3),
        ("s2", "rfc2217", {1: 3}, ("--axis", "2"), "200um", 1000),
        ("s3", "tcp", {1: 1}, (), "100um", 1000),
        ("s4", "terminal", {1: 1, 2: 1}, ("--address", "2"), "200um", 1000),
    ],
)
def test_every_machine_is_found_and_moved_by_a_client(
    machine, entrance, axes, location, distance, near_nm
):
    with served("--machine", machine) as ports:
        assert ports["machine"] == machine and ports["nodes"] == list(axes)
        found, _, moved = moire(
            "--port",
            ports[entrance],
            "find",
            *map(str, axes),
            "--",
            "home",
            "--method",
            "35",
            *location,
            "--",
            "move",
            distance,
            *location,
        )
        assert {node["address"]: node["axes"] for node in found["nodes"]} == axes and all(
            node["matches"] for node in found["nodes"]
        )
        assert abs(moved["error_nm"]) < near_nm and moved["target_nm"] > 99_000
