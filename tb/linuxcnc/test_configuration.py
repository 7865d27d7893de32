# SPDX-License-Identifier: Apache-2.0
"""The generator of configurations for LinuxCNC, and the set-up of a link."""

import math
import re
from pathlib import Path
from unittest.mock import Mock

import pytest

from boards.toml_file import ROOT
from linuxcnc_config.__main__ import main
from linuxcnc_config.generate import CARRIERS, Misfit, exchange_bits, load, texts
from linuxcnc_config.lists import READS, WRITES
from linuxcnc_config.set_up import Backlash, Unfit, bit_time_of, set_up
from linuxcnc_config.set_up import main as set_up_program
from moire.client.link import Captures, places
from moire.errors import Refused
from moire.made import link_tables as layout
from tb.linuxcnc.ideal_node import CLK_HZ, IdealNode, address, placed

MILL = """
title = "mill"
[node]
image = "steps"
memory_kib = 64
address = 3
[linuxcnc]
bus = "/dev/ttyUSB0"
node = "serial:/dev/ttyUSB1:3000000"
[[axis]]
name = "X"
drives = ["stepper"]
[axis.linuxcnc]
period_um = 4
travel = [-1, 149]
velocity = 50
acceleration = 500
"""


def written(tmp_path, change=("", "")):
    path = tmp_path / "mill.toml"
    path.write_text(MILL.replace(*change))
    return str(path)


def test_the_configuration_has_the_numbers_of_the_machine_file(tmp_path):
    made = texts(load(written(tmp_path)))
    for line in ("MAX_VELOCITY = 50", "MAX_ACCELERATION = 500", "MIN_LIMIT = -1", "JOINTS = 1"):
        assert f"\n{line}\n" in made["mill.ini"]
    assert "\nsetp moire.0.axis.0.scale 250\n" in made["mill.hal"]  # periods per mm
    assert re.search(
        r"set_up --port /dev/ttyUSB0 --address 3 --axes 1 --session \d+ --baud 3000000 --watchdog "
        r"210\n",
        made["mill.hal"],
    )
    assert 'node="serial:/dev/ttyUSB1:3000000" axes=1 session=' in made["mill.hal"]


def test_the_backlash_of_a_machine_file_comes_to_the_set_up(tmp_path, monkeypatch):
    features = ('drives = ["stepper"]', 'drives = ["stepper"]\nfeatures = ["backlash"]')
    found = written(tmp_path, features)
    text = Path(found).read_text()
    Path(found).write_text(text + 'backlash_um = 2.5\ntake_up = 8\nsensor = "motor"\n')
    line = texts(load(found))["mill.hal"].split("set_up", 1)[1].splitlines()[0]
    assert line.endswith(" --backlash 0:2.5um:8.0mm/s:0.25um:motor")
    assert Backlash.parsed(line.split()[-1]) == (0, Backlash("2.5um", "8.0mm/s", "0.25um", True))
    axis = Mock()
    monkeypatch.setattr("linuxcnc_config.set_up.Axis", axis)
    set_up(IdealNode(1), 1, 5, backlash={0: Backlash("2.5um", "8mm/s", "1um", True)})
    axis().set_backlash.assert_called_once_with("2.5um", "8mm/s", "1um", True)


def test_an_axis_without_backlash_in_the_machine_file_has_none_in_the_node():
    node = IdealNode(2)
    for n, built in enumerate((1, 0)):
        word = placed("axis", "built", drive=1, set_points=1, backlash=built)
        node.names[address("axis", "built", n)] = lambda word=word: word
        node.write(address("feedback", "backlash", n), 82)
    set_up(node, 2, 5)
    assert [node.read(address("feedback", "backlash", n)) for n in range(2)] == [0, 82]


def test_a_carrier_that_is_no_serial_line_gets_no_baud_rate(tmp_path):
    hal = texts(load(written(tmp_path, ("serial:/dev/ttyUSB1:3000000", "udp:10.0.0.2:27181"))))
    assert "--baud" not in hal["mill.hal"]


def test_the_set_up_writes_the_bit_time_of_a_baud_rate_at_the_clock_of_the_node():
    node = IdealNode(1)
    set_up(node, 1, 5, bit_time=bit_time_of(node, 115_200))
    assert node.bit_time == round(16 * CLK_HZ / 115_200) == 333
    assert bit_time_of(node, 600_000) == 4 * 16 and bit_time_of(node, 37) < 1 << 20
    range_of_node = "which has 2.4 MHz: choose from 37 to 600000 baud"
    for baud, cycles in ((3_000_000, "0.80"), (620_000, "3.87"), (30, "80000.00")):
        words = f"a bit of {baud} baud takes {cycles} cycles of the node, {range_of_node}"
        with pytest.raises(Unfit, match=re.escape(words)):
            bit_time_of(node, baud)


def test_the_axes_stop_under_control_before_the_watchdog_switches_their_drives_off(tmp_path):
    node = IdealNode(1)
    set_up(node, 1, 5)
    assert node.read(address("node", "late_limit")) == 20 and node.watchdog_s == 0.2
    for change, watchdog_ms in (
        (("velocity = 50", "velocity = 50"), 5 + 5 + 200),
        (("velocity = 50", "velocity = 20"), 5 + 5 + 80),
        (("[linuxcnc]", "[linuxcnc]\ndelay_ms = 10.5"), 216),
        (("acceleration = 500", "acceleration = 20"), 1000),
    ):
        assert load(written(tmp_path, change)).watchdog_ms == watchdog_ms


def machine_of(tmp_path, node, axes):
    """A machine file with so many axes at a node."""
    found = written(tmp_path, ("serial:/dev/ttyUSB1:3000000", node))
    axis = MILL[MILL.index("[[axis]]") :]
    with Path(found).open("a") as file:
        file.writelines(axis.replace('"X"', f'"{name}"') for name in "YZABCUV"[: axes - 1])
    return found


@pytest.mark.parametrize(
    "node, axes",
    [
        ("serial:/dev/ttyUSB1:3000000", 3),
        ("serial:/dev/ttyUSB1:3514245", 4),
        ("spi:/dev/spidev0.0:12000000", 8),
        ("udp:10.0.0.2:27181", 8),
    ],
)
def test_a_line_that_is_fast_enough_for_the_packets_of_the_axes_is_taken(tmp_path, node, axes):
    assert load(machine_of(tmp_path, node, axes)).node == node


@pytest.mark.parametrize(
    "node, axes, least",
    [
        ("serial:/dev/ttyUSB1:3000000", 4, "3514245 baud"),
        ("serial:/dev/ttyUSB1:6000000", 8, "6355480 baud"),
        ("spi:/dev/spidev0.0:5000000", 8, "5024568 Hz"),
    ],
)
def test_a_line_too_slow_for_the_packets_of_the_axes_is_refused(tmp_path, node, axes, least):
    words = f"the packets of {axes} axes need {least} at least to fit into 1 ms"
    with pytest.raises(Misfit, match=words):
        load(machine_of(tmp_path, node, axes))


def test_the_page_has_the_bytes_and_the_times_of_an_exchange():
    page = (ROOT / "docs" / "linuxcnc.md").read_text(encoding="utf-8")
    rows = re.findall(r"  \| (\d) \| (\d+) \| (.*) \| ([\d ]+) \| (.*) ms \|", page)
    assert len(rows) == 6
    for axes, count, exchange, least, spi in rows:
        bits, played_s = exchange_bits("serial", int(axes))
        took_ms = 1e3 * (bits / 3e6 + played_s)
        assert int(count) == bits / 10
        assert exchange == (f"{took_ms:.2f} ms" if took_ms < 1 else "does not fit")
        assert int(least.replace(" ", "")) == math.ceil(bits / (1e-3 - played_s))
        bits, played_s = exchange_bits("spi", int(axes))
        assert spi == f"{1e3 * (bits / 12e6 + played_s):.2f}"


SPINDLE = """
[[axis]]
name = "S"
[axis.linuxcnc]
periods_per_turn = 1024
"""


def test_an_axis_without_a_drive_is_the_encoder_of_the_spindle(tmp_path):
    found = written(tmp_path)
    assert "spindle" not in texts(load(found))["mill.hal"]
    Path(found).write_text(Path(found).read_text() + SPINDLE)
    hal = texts(load(found))["mill.hal"]
    assert "--axes 2" in hal and "axes=2" in hal
    assert "\nsetp moire.0.encoder.1.scale 1024\n" in hal
    for pin, end in (("position", "revs"), ("velocity", "speed-in"), ("index", "index-enable")):
        line = next(line for line in hal.splitlines() if line.startswith(f"net spindle-{pin} "))
        assert "moire.0.encoder.1." in line and line.endswith(f" spindle.0.{end}")


GANTRY = """
[[axis]]
name = "X2"
drives = ["stepper"]
[axis.linuxcnc]
gantry = "X"
apart_um = 50
"""


def test_the_second_side_of_a_gantry_is_a_joint_of_the_same_axis(tmp_path):
    found = written(tmp_path)
    Path(found).write_text(Path(found).read_text() + GANTRY)
    made = texts(load(found))
    ini, hal = made["mill.ini"], made["mill.hal"]
    assert "KINEMATICS = trivkins coordinates=XX kinstype=BOTH" in ini and "\nJOINTS = 2\n" in ini
    assert ini.count("[AXIS_X]") == 1 and "[AXIS_X2]" not in ini
    assert re.findall(r"HOME_SEQUENCE = (\S+)", ini) == ["-1", "-1"], "they move home together"
    assert "setp wcomp.0.max 0.05" in hal and "are more than 50 um apart" in hal
    assert "net X-square => iocontrol.0.emc-enable-in" in hal


def test_axes_beside_a_gantry_are_homed_in_the_order_of_their_numbers_without_a_gap(tmp_path):
    found = written(tmp_path)
    second = MILL[MILL.index("[[axis]]") :].replace('"X"', '"Y"')
    Path(found).write_text(MILL + GANTRY + second)
    assert homed_in(found) == ["-1", "-1", "2"]


def homed_in(machine):
    """HOME_SEQUENCE of the joints."""
    return re.findall(r"HOME_SEQUENCE = (\S+)", texts(load(machine))["mill.ini"])


def test_home_sequence_is_the_order_and_may_have_gaps(tmp_path):
    """LinuxCNC's Home All ends at the first number without a joint."""
    found = written(tmp_path)
    axis = MILL[MILL.index("[[axis]]") :]
    numbers = {"X": 5, "Y": 2, "Z": 5}
    rows = [axis.replace('"X"', f'"{name}"') for name in numbers]
    rows = [f"{row}home_sequence = {n}\n" for row, n in zip(rows, numbers.values())]
    Path(found).write_text(MILL[: MILL.index("[[axis]]")] + "".join(rows))
    assert homed_in(found) == ["1", "0", "1"]
    Path(found).write_text(MILL[: MILL.index("[[axis]]")] + rows[0] + GANTRY + rows[1])
    assert homed_in(found) == ["-2", "-2", "1"]


@pytest.mark.parametrize(
    "change, words",
    [
        (('gantry = "X"', 'gantry = "Y"'), "gantry 'Y' must be an axis before this one"),
        (("apart_um = 50", "apart_um = 0"), "apart_um 0 must be above 0"),
        (("apart_um = 50", ""), "apart_um is missing"),
        (("apart_um = 50", "apart_um = 50\nvelocity = 3"), "there is no key velocity"),
        (("[[axis]]", GANTRY.replace("X2", "X3") + "[[axis]]"), "one with a single side"),
    ],
)
def test_a_gantry_that_does_not_fit_is_refused_in_a_line(tmp_path, change, words):
    path = tmp_path / "mill.toml"
    path.write_text(MILL + GANTRY.replace(*change, 1))
    with pytest.raises(Misfit, match=re.escape(words)):
        load(str(path))


@pytest.mark.parametrize(
    "text, words",
    [
        (MILL + SPINDLE.replace("1024", "0"), "periods_per_turn 0 must be above 0"),
        (MILL + SPINDLE + SPINDLE.replace("S", "T"), "then one spindle at most"),
        (MILL.replace("[[axis]]", SPINDLE + "[[axis]]"), "needs the axes with a drive first"),
    ],
)
def test_a_spindle_that_does_not_fit_is_refused_in_a_line(tmp_path, text, words):
    path = tmp_path / "mill.toml"
    path.write_text(text)
    with pytest.raises(Misfit, match=words):
        load(str(path))


def test_the_touch_probe_comes_to_linuxcnc_if_all_axes_capture_its_edges(tmp_path):
    line = "net probe moire.0.probe => motion.probe-input"
    assert line not in texts(load(written(tmp_path)))["mill.hal"]
    features = ('drives = ["stepper"]', 'drives = ["stepper"]\nfeatures = ["capture"]')
    assert line in texts(load(written(tmp_path, features)))["mill.hal"]


PLL = ('image = "steps"', 'image = "steps"\nperipherals = ["link"]\nlink_pll = true')


def test_the_lead_of_the_captures_comes_to_the_set_up(tmp_path):
    assert "--capture" not in texts(load(written(tmp_path, PLL)))["mill.hal"]
    found = written(tmp_path, PLL)
    text = Path(found).read_text()
    Path(found).write_text(text.replace("[linuxcnc]", "[linuxcnc]\ncapture_us = 200"))
    made = texts(load(found))
    line = made["mill.hal"].split("set_up", 1)[1].splitlines()[0]
    assert line.endswith(" --capture 200:1000")
    assert "# the position comes 7.2 ms after the command" in made["mill.ini"]
    assert made["mill.ini"].count(f"FERROR = {2 * 7.2e-3 * 50:g}") == 2
    Path(found).write_text(text.replace("[linuxcnc]", "[linuxcnc]\ncapture_us = 376"))
    with pytest.raises(Misfit, match="capture_us 376 must be 0 to 375, 3/8 of the period"):
        load(found)
    without = text.replace("link_pll = true", "")
    Path(found).write_text(without.replace("[linuxcnc]", "[linuxcnc]\ncapture_us = 0"))
    with pytest.raises(Misfit, match=r"capture_us needs link_pll = true in \[node\]"):
        load(found)


def test_the_set_up_writes_the_captures_or_refuses_them_before_anything_is_written():
    node = IdealNode(1)
    with pytest.raises(Refused, match="it needs LINK_PLL"):
        set_up(node, 1, 5, captures=Captures(1e-3, 2e-4))
    assert not node.session
    node = IdealNode(1, has_pll=True)
    set_up(node, 1, 5, captures=Captures(1e-3, 2e-4))
    assert (node.period, node.lead) == (CLK_HZ // 1000, CLK_HZ // 5000)
    set_up(node, 1, 6, force=True)
    assert (node.period, node.lead) == (0, 0)


def test_set_up_and_driver_have_the_same_session_and_each_configuration_its_own(tmp_path):
    found = load(written(tmp_path))
    sessions = [re.findall(r"session[ =](\d+)", texts(found)["mill.hal"]) for _ in range(3)]
    assert all(of_set_up == of_driver for of_set_up, of_driver in sessions)
    assert len({one for one, _ in sessions}) == 3


@pytest.mark.parametrize(
    "change, words",
    [
        (("velocity = 50", "velocity = 0"), "velocity 0 must be above 0"),
        (("travel = [-1, 149]", "travel = [5, 5]"), "travel from 5 to 5 has no length"),
        (("travel = [-1, 149]", "travel = [5]"), "travel must be two numbers"),
        (("travel = [-1, 149]", "travel = [1, 149]"), "rest 0 is outside the travel, 1 to 149"),
        (("period_um = 4\n", ""), "period_um is missing"),
        (("velocity = 50", "velocity = 50\nspeed = 2"), "there is no key speed"),
        (('name = "X"', 'name = "left"'), "name 'left': LinuxCNC knows the axes X, Y, Z"),
        (("serial:/dev/ttyUSB1:3000000", "ttyUSB1"), f"write {', '.join(CARRIERS.values())}"),
        (("ttyUSB1:3000000", "ttyUSB1:fast"), "with a number at the end"),
        (("ttyUSB1:3000000", "ttyUSB1:0"), "with a number at the end"),
        (('node = "serial', 'delay_ms = 2\nnode = "serial'), "delay_ms 2: a set-point needs 4"),
        (('node = "serial', 'delay_ms = 15.5\nnode = "serial'), "queues those of 15 at most"),
        (("velocity = 50", "velocity = 50\nhome_sequence = -1"), "must not be below 0"),
        (
            ("velocity = 50", "velocity = 50\nbacklash_um = 5"),
            "backlash_um needs the feature backlash of the axis",
        ),
        (
            (
                'drives = ["stepper"]\n[axis.linuxcnc]',
                'drives = ["dac"]\nfeatures = ["backlash"]\n[axis.linuxcnc]\nbacklash_um = 5',
            ),
            'backlash_um needs a stepper, or sensor = "motor"',
        ),
        (("velocity = 50", "velocity = 50\nbacklash_um = -1"), "backlash_um -1 with take_up 1:"),
        (("velocity = 50", "velocity = 50\ntake_up = 0"), "backlash_um 0 with take_up 0:"),
        (("velocity = 50", 'velocity = 50\nsensor = "wheel"'), "sensor 'wheel' is none of table,"),
        (("[axis.linuxcnc]", "[axis.other]"), "there is no key other"),
        (('drives = ["stepper"]', ""), "no axis has a drive: LinuxCNC has nothing to move"),
    ],
)
def test_a_machine_file_that_does_not_fit_is_refused_in_a_line(tmp_path, change, words):
    with pytest.raises(Misfit) as why:
        load(written(tmp_path, change))
    assert words in str(why.value) and "\n" not in str(why.value)


def test_the_command_writes_a_folder_and_keeps_own_lines(tmp_path, capsys):
    folder = tmp_path / "made"
    for _ in range(2):
        assert main([written(tmp_path), "--out", str(folder)]) == 0
        assert (folder / "custom.hal").read_text() != ""
        (folder / "custom.hal").write_text("# mine\n")
    assert (folder / "custom.hal").read_text() == "# mine\n"
    assert sorted(path.name for path in folder.iterdir()) == [
        "custom.hal",
        "mill.hal",
        "mill.ini",
        "tool.tbl",
    ]
    assert main([str(tmp_path / "none.toml"), "--out", str(folder)]) == 1
    assert "no such file" in capsys.readouterr().err


def test_eight_axes_fit_into_a_packet():
    writes, reads = places(WRITES, 8), places(READS, 8)
    assert len(writes) <= layout.MOST_VALUES and len(reads) <= layout.MOST_VALUES
    assert writes[-1].address == address("node", "set_point_commit")


def test_the_set_up_refuses_another_number_of_axes_and_another_host():
    node = IdealNode(2)
    with pytest.raises(Unfit, match="the node has 2 axes, the configuration has 3"):
        set_up(node, 3, 5)
    set_up(node, 2, 5)
    with pytest.raises(Unfit, match="another host runs the node, in session 5"):
        set_up(node, 2, 6)
    set_up(node, 2, 6, force=True)
    node.advance(2_400_000)  # the watchdog has expired
    set_up(node, 2, 7)
    assert node.session == 7


def test_the_set_up_refuses_a_node_without_a_link():
    node = IdealNode(1)
    node.read_named = lambda name: {"built": 0}
    with pytest.raises(Unfit, match="the node has no real-time link"):
        set_up(node, 1, 5)


def test_the_set_up_program_says_in_a_line_why_it_fails(capsys):
    line = ["--port", "/dev/no_such_port", "--axes", "3", "--session", "5"]
    with pytest.raises(SystemExit):
        set_up_program([*line, "--backlash", "0:5um"])
    assert "--backlash needs five parts" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        set_up_program([*line, "--capture", "200"])
    assert "--capture needs two numbers, as 200:1000" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        set_up_program([*line, "--baud", "fast"])
    assert "--baud: invalid int value: 'fast'" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        set_up_program([*line, "--baud", "0"])
    assert "--baud must be above 0" in capsys.readouterr().err
    assert set_up_program(line) == 1
    assert re.fullmatch(r"moire: /dev/no_such_port: .*\n", capsys.readouterr().err)
