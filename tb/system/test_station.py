# SPDX-License-Identifier: Apache-2.0
"""A sub-node of S4 as it ships, image `station` on the RTL: its worm table in the twin goes to
angles of its sensor.
"""

import io
import math
import re
from pathlib import Path

import pytest

from moire.cli import command_line
from moire.client.bus import Bus
from moire.client.indexing_table import TURN, IndexingTable
from moire.client.job import Job
from moire.client.settings import Settings
from moire.made.bus_tables import CAUSES, FAULTS
from tb.firmware.test_firmware_peer import OPERATION, bodies, frame, poll, turn_to
from tb.system.station_node import station_bus, station_twin
from twin import Devices, TwinTransport
from twin.nodes.twin import Axis, Node

RECIPE = Path(__file__).resolve().parents[2] / "docs" / "indexing.md"
SUB, MAIN = 0, 1  # indices of the nodes in the twin
ESTOP = next(bit for bit, (name, _) in FAULTS.items() if name == "estop")
QUICK = {
    "turn_allowance": "40arcsec",
    "turn_take_up": "40arcsec",
    "turn_share": "0.7",
    "turn_settle": "50ms",
}


class Station:
    def __init__(self):
        table = Axis("worm_table", {"sensor_dropped": 0.005, "sensor_corrupt": 0.005})
        nodes = [Node(1, [table], Devices(eeprom=True)), Node(2, [])]
        self.twin = station_twin(nodes, peers=(SUB, MAIN))
        node = station_bus(self.twin, 1).node(1)
        self.settings, self.table, self.job = Settings(node), IndexingTable(node), Job(node)
        self.settings.load(QUICK)
        self.to_sub, self.from_sub = (
            self.twin.peer_lines[MAIN, SUB],
            self.twin.peer_lines[SUB, MAIN],
        )

    def beside(self, arcsec):
        """An angle at this distance from the angle of the table."""
        return round(self.table.sensor().angle + arcsec) % TURN

    def error(self, target):
        true = math.degrees(self.twin.truth(SUB).position_rad) * 3600
        return (true - target + TURN / 2) % TURN - TURN / 2

    def exchange(self, body):
        """Send a body to the sub-node; returns the bodies of its answers."""
        self.to_sub.put(frame(body))
        self.twin.run(0.1)
        return bodies(self.from_sub.take_received())


@pytest.fixture(scope="module")
def station():
    made = Station()
    yield made
    made.twin.close()


def test_a_target_below_is_reached_from_below_within_two_arcsec_of_the_truth(station):
    target = station.beside(-100)
    state = station.table.turn(target)
    assert abs(state.left) <= 0.5 and abs(station.error(target)) <= 2
    truth = station.twin.truth(SUB)
    assert truth.lost_steps == 0 and truth.step_timing_errors == 0


def test_a_frame_from_the_peer_turns_the_table_amid_garbage(station):
    station.settings.set("peer_role", "sub")
    station.settings.set("peer_mode", "frames")
    target = station.beside(200)
    station.to_sub.garbage(20)
    assert any(
        station.exchange(turn_to(7, target)) == [bytes([7, OPERATION["turn_to"], 0])]
        for _ in range(10)
    )
    assert any(
        reply[:3] == bytes([8 + n, OPERATION["turn_state"], 0])
        for n in range(10)
        for reply in station.exchange(poll(8 + n))
    )
    station.to_sub.garbage(0)
    assert station.table.wait().ended == "ok" and abs(station.error(target)) <= 2
    assert station.table.peer().garbage > 0


def test_an_emergency_stop_is_reported_to_the_peer_and_reset_by_it_when_it_is_over(station):
    station.settings.set("peer_role", "sub")
    station.settings.set("peer_mode", "frames")
    causes = {code: name for code, (name, _) in CAUSES.items()}

    def request(sequence, operation, fields=b"\0"):
        reply = station.exchange(bytes([sequence, OPERATION[operation]]) + fields)[0]
        return causes[reply[2]], reply[3:]

    with station.twin.fault("estop", SUB):
        station.exchange(turn_to(30, station.beside(100)))
        assert request(31, "turn_to", b"\0" * 4)[0] == "faulted"
        cause, fields = request(32, "status")
        assert cause == "ok" and int.from_bytes(fields[6:8], "little") == 1 << ESTOP
        assert request(33, "reset_faults")[0] == "fault_persists"
    assert request(34, "reset_faults")[0] == "ok"
    target = station.beside(100)
    assert station.exchange(turn_to(35, target)) == [bytes([35, OPERATION["turn_to"], 0])]
    assert station.table.wait().ended == "ok" and abs(station.error(target)) <= 2


def test_the_bytes_as_printed_turn_the_table_to_its_next_station(station):
    station.settings.set("peer_role", "sub")
    station.settings.set("peer_mode", "legacy")
    target = station.beside(200)
    station.job.load([target])
    station.from_sub.take_received()
    station.to_sub.put(b"\xff\xff\xaa")
    station.twin.run(0.1)
    assert station.table.peer().phase == "turning" and station.table.wait().ended == "ok"
    station.twin.run(0.1)
    assert (
        bytes(station.from_sub.take_received()) == b"\xff\xff\x55"
        and abs(station.error(target)) <= 2
    )


class LeftOpen(TwinTransport):
    """A transport that stays open when a call of the command line ends, so that the machine goes
    on.
    """

    def close(self):
        self.twin.run(0.01)


def test_the_recipe_of_indexing_md_turns_the_table_as_it_is_printed():
    commands = re.findall(r"^    moire (.+)$", RECIPE.read_text(), re.MULTILINE)
    assert len(commands) == 3
    target_deg = float(re.search(r" turn to ([\d.]+)deg$", commands[-1])[1])
    nodes = [Node(1, []), Node(2, [Axis("worm_table")], Devices(eeprom=True))]
    with station_twin(nodes) as twin:
        twin.set_position(1, math.radians(target_deg - 0.2))  # near, so that the motion is short
        twin.run(0.1)
        before = twin.truth(1)
        for command in commands:
            out, err = io.StringIO(), io.StringIO()
            assert (
                command_line.main(command.split(), lambda options: LeftOpen(twin), out, err) == 0
            ), err.getvalue()
        truth = twin.truth(1)
        assert truth.steps - before.steps > 3000 and truth.lost_steps == 0
        assert abs(math.degrees(truth.position_rad) * 3600 - 3600 * target_deg) <= 2
        axis = Bus(TwinTransport(twin)).axis(2)
        assert axis.get_parameter("deglitch").written() == "10us" and axis.status().faults == ()
