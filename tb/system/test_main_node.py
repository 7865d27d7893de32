# SPDX-License-Identifier: Apache-2.0
"""S4 as it ships, image `station` in two nodes on the RTL: a job with its table, sensor, EEPROM,
panel and machine, and a power cut.
"""

import math

from moire.client.indexing_table import TURN, IndexingTable
from moire.client.job import Job
from moire.client.settings import Settings
from tb.system.station_node import station_bus, station_twin
from twin.devices.devices import Devices
from twin.nodes.twin import Axis, Node

MAIN, SUB = 0, 1  # indices of the nodes in the twin
DEVICES = Devices(
    eeprom=True,
    keypad=True,
    display=True,
    keyboard=True,
    edm=True,
    table=SUB,
    parameters={"edm_cut_time": 0.3},
)


def test_a_job_is_cut_at_its_angles_through_a_power_cut_and_no_station_twice():
    nodes = [Node(1, [Axis("unconnected")], DEVICES), Node(2, [Axis("worm_table")])]
    with station_twin(nodes, peers=(MAIN, SUB)) as twin:
        bus = station_bus(twin, 2)
        for address, role in ((1, "main"), (2, "sub")):
            Settings(bus.node(address)).set("peer_role", role)
            Settings(bus.node(address)).set("peer_mode", "frames")
        Settings(bus.node(2)).set("turn_share", 0.8)  # a turn ends after fewer tries
        job, devices, here = (
            Job(bus.node(1)),
            twin.devices(MAIN),
            IndexingTable(bus.node(2)).sensor().angle,
        )
        first = round(here) + 200 if here < TURN - 500 else 100
        angles = [first, first + 150]
        assert job.load(angles).angles == tuple(angles)
        devices.type([0x1C, 0xF0, 0x1C])  # a person types, so the keys of the job wait
        job.start()
        while not devices.cuts:
            bus.transport.wait(0.1)
            assert job.state().state not in ("paused", "unsure"), job.state()
        twin.power_cut(MAIN)
        bus.transport.wait(0.2)
        twin.power_on(MAIN)
        bus.transport.wait(0.2)
        report = job.wait()
        assert (report.state, report.cause, report.station) == ("unsure", "power_lost", 0) and len(
            devices.cuts
        ) == 1
        bus.transport.wait(1.5)  # the node has found its panel again
        assert devices.lines[1].rstrip() == "the power was lost" and devices.cuts[0].complete
        job.do("next")
        assert job.wait().state == "finished"
        assert all(
            abs(math.degrees(cut.angle_start_rad) * 3600 - angle) <= 2
            for cut, angle in zip(devices.cuts, angles, strict=True)
        )
        assert all(
            abs(math.degrees(cut.angle_end_rad - cut.angle_start_rad)) * 3600 < 0.1 and cut.complete
            for cut in devices.cuts
        )
