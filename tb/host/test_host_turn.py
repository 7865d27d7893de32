# SPDX-License-Identifier: Apache-2.0
"""moire.client.indexing_table, settings and their commands, against the firmware of a station with
a table, a sensor and a peer port.
"""

import io
import json
import random
from fractions import Fraction

import pytest

from moire.cli import command_line
from moire.client.bus import Bus
from moire.client.indexing_table import IndexingTable
from moire.client.job import Job
from moire.client.settings import Settings
from moire.errors import MotionFailed, OutOfRange, Refused, UnknownName
from moire.made.bus_tables import SETTINGS
from tb.fakes.rs485_bus import Rs485Bus
from tb.firmware.test_turn import Station
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.peripherals import I2c, PeerPort, PeripheralParts, Sensor
from twin.compiled.peripherals import Table as Worm

ADDRESS = 2


class Panel:
    def __init__(self, machine=None):
        self.machine = machine or Station()
        self.bus = Bus(Rs485Bus(self.machine))
        self.node = self.bus.node(ADDRESS)
        self.table, self.settings = IndexingTable(self.node), Settings(self.node)

    def call(self, text):
        """Exit code, standard output and standard error of a command."""
        out, err = io.StringIO(), io.StringIO()
        code = command_line.main(
            ["--address", str(ADDRESS), *text.split()],
            lambda options: Rs485Bus(self.machine),
            out,
            err,
        )
        return code, out.getvalue(), err.getvalue()


def test_a_turn_ends_at_the_angle_and_reports_what_is_left():
    panel, phases = Panel(), []
    state = panel.table.turn("1deg", progress=lambda state: phases.append(state.phase))
    assert (
        state.phase == "idle"
        and state.ended == "ok"
        and state.target == 3600
        and abs(state.left) <= Fraction(1, 2)
    )
    assert abs(panel.machine.error(3600)) <= 2 and {"reading", "coming_up", "closing_in"} <= set(
        phases
    )
    sensor = panel.table.sensor()
    assert (
        abs(sensor.angle - 3600) < 2
        and 0 <= sensor.age_s <= Fraction(12, 1000)
        and not sensor.dead
        and sensor.frames > 50
    )


def test_a_failed_turn_is_reported_in_words():
    panel = Panel()
    panel.machine.table.blocked = True
    with pytest.raises(
        MotionFailed, match="node 2 is not at 1deg: the table did not follow its steps"
    ) as failed:
        panel.table.turn("1deg")
    assert failed.value.cause == "stiction"


def test_whatever_interrupts_the_wait_stops_the_table():
    panel = Panel()

    def impatient(state):
        if state.phase == "coming_up":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        panel.table.turn("90deg", progress=impatient)
    panel.bus.transport.wait(0.3)
    assert panel.table.state().ended == "stopped" and panel.machine.status()["state"] == "holding"


@pytest.mark.parametrize("angle", ["360deg", "-1arcsec", "1000deg"])
def test_an_angle_beyond_one_turn_is_never_sent(angle):
    panel = Panel()
    with pytest.raises(OutOfRange, match="0deg or more and below 360deg"):
        panel.table.begin(angle)


def test_settings_are_real_units_and_words():
    panel = Panel()
    assert (
        panel.settings.get("turn_tolerance").written() == "0.5arcsec"
        and panel.settings.get("peer_mode").written() == "off"
    )
    assert (
        panel.settings.set("turn_allowance", "1.5arcmin").value == 90
        and panel.settings.get("turn_allowance").counts == 9000
    )
    assert (
        panel.settings.set("turn_settle", "0.25s").written() == "250ms"
        and panel.settings.set("peer_mode", "frames").counts == 2
    )
    assert panel.settings.set("turn_share", 0.7).counts == 70
    for name, value in (
        ("turn_share", 1),
        ("turn_tries", 1.5),
        ("peer_role", "slave"),
        ("sensor_zero", "360deg"),
    ):
        with pytest.raises(OutOfRange):
            panel.settings.set(name, value)
    with pytest.raises(UnknownName, match="did you mean turn_tolerance"):
        panel.settings.get("tolerance")


def test_saved_settings_are_restored():
    panel = Panel()
    panel.settings.set("turn_direction", "shorter")
    saved = panel.settings.save()
    assert list(saved) == list(SETTINGS)
    for name, setting in SETTINGS.items():
        panel.settings.node.request("set_setting", setting=setting.id, value=setting.max)
        assert panel.settings.get(name).counts == setting.max
    panel.settings.load(saved)
    assert panel.settings.save() == saved
    with pytest.raises(OutOfRange):
        panel.settings.load({"turn_tries": "7", "turn_share": "7"})
    assert panel.settings.get("turn_tries").counts == SETTINGS["turn_tries"].default


def test_a_node_of_the_other_image_reports_not_built():
    panel = Panel(CompiledNode(Axis()))
    with pytest.raises(Refused, match="built without this function"):
        panel.settings.get("turn_direction")
    with pytest.raises(Refused, match="built without this function"):
        panel.table.begin("1deg")


def sub_node():
    """A sub-node in legacy mode, which counts its stations itself, with its EEPROM."""
    source = random.Random(1)
    panel = Panel(
        CompiledNode(
            Axis(),
            image="station",
            peripherals=PeripheralParts(Sensor(source, Worm(source)), PeerPort(), I2c()),
        )
    )
    panel.settings.load({"peer_role": "sub", "peer_mode": "legacy"})
    return panel


def test_a_sub_node_counts_the_stations_of_its_list():
    panel = sub_node()
    Job(panel.node).load(["0deg", "10deg", "350deg"])
    assert (panel.table.peer().stations, panel.table.peer().next) == (3, 0)
    panel.table.next_station(2)
    panel.bus.transport.wait(0.1)
    assert panel.table.peer().next == 2 and "next 2 of 3" in panel.call("turn status")[1]
    with pytest.raises(Refused, match="no such station"):
        panel.table.next_station(3)


def test_the_commands_turn_the_table_and_report_its_angle(tmp_path):
    panel, file = Panel(), tmp_path / "station.json"
    code, out, _ = panel.call("turn to 0.5deg -- turn status")
    assert (
        code == 0 and "arcsec left" in out and "target 30arcmin" in out and "sensor  alive" in out
    )
    assert abs(panel.machine.error(1800)) <= 2
    code, out, err = panel.call("turn to 400deg")
    assert code == 2 and out == "" and err.count("\n") == 1 and "below 360deg" in err
    code, out, _ = panel.call(f"settings set peer_mode legacy -- settings save {file} --json")
    assert code == 0 and json.loads(file.read_text())["peer_mode"] == "legacy"
    code, out, _ = panel.call(f"settings load {file} -- settings get turn_tolerance")
    assert code == 0 and "0.5arcsec" in out
    file.write_text("[]")
    code, _, err = panel.call(f"settings load {file}")
    assert code == 2 and "holds no settings" in err
    assert len(panel.call("settings list")[1].splitlines()) == len(SETTINGS)
