# SPDX-License-Identifier: Apache-2.0
"""moire.client.job and its commands, against the firmware of a main node with its EEPROM, the EDM
and a sub-node.
"""

import io
import json

import pytest

from moire.cli import command_line
from moire.client.bus import Bus
from moire.client.job import Job, equal_parts, read_stations
from moire.errors import BadFile, OutOfRange, Refused
from tb.fakes.rs485_bus import Rs485Bus, port_of
from twin.compiled.station import Station
from twin.compiled.sub_node import SubNode

ADDRESS = 2


class Workshop:
    def __init__(self, **options):
        self.station = Station(**{"absent": ("keypad", "display"), **options})
        self.station.sub_node = SubNode()
        self.station.setting(peer_mode=2)
        self.job = Job(Bus(Rs485Bus(self.station)).node(ADDRESS))

    def call(self, text):
        """Exit code, standard output and standard error of a command."""
        out, err = io.StringIO(), io.StringIO()
        code = command_line.main(
            ["--address", str(ADDRESS), *text.split()],
            lambda options: Rs485Bus(self.station),
            out,
            err,
        )
        return code, out.getvalue(), err.getvalue()


def test_a_station_list_is_loaded_read_and_cut():
    workshop = Workshop()
    program = workshop.job.load(["0deg", "1.5deg", "7200arcsec"])
    assert program.angles == (0, 5400, 7200) and program.generation == 1
    workshop.job.start()
    states = []
    state = workshop.job.wait(progress=lambda state: states.append(state.state))
    assert (
        state.state == "finished"
        and state.words == "all cut, station 3 of 3"
        and len(workshop.station.edm.cuts) == 3
    )
    assert {"turning", "cutting"} <= set(states) and workshop.station.sub_node.angles == [
        0,
        540_000,
        720_000,
    ]


def test_a_turn_is_divided_to_the_nearest_count():
    parts = equal_parts(7)
    assert (
        len(parts) == 7
        and parts[0] == 0
        and all(abs(part - 1_296_000 * n / 7) <= 0.005 for n, part in enumerate(parts))
    )
    for count in (0, -1, 361):
        with pytest.raises(OutOfRange, match="1 to 360 stations"):
            equal_parts(count)


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        ([], "1 to 360 stations, not 0"),
        (["0deg"] * 361, "not 361"),
        (["1deg", "360deg"], "station 2: an angle is 0deg or more"),
        (["1deg", "1deg"], "station 2 at 1deg does not lie above"),
        (["-1deg"], "station 1: an angle"),
        (["2deg", "1deg"], "station 2 at 1deg"),
    ],
)
def test_a_wrong_station_list_is_refused_before_the_first_byte(angles, words):
    workshop = Workshop()
    with pytest.raises(OutOfRange, match=words):
        workshop.job.load(angles)
    assert workshop.station.eeprom.writes == 0


def test_stations_come_from_a_file_in_degrees_or_with_units(tmp_path):
    file = tmp_path / "former.csv"
    file.write_text("angle,remark\n0, first # the first\n\n10.5\n11deg\n# all\n39700arcsec;x\n")
    assert read_stations(file) == [0, 37_800, 39_600, 39_700]
    file.write_text('"angle";"remark, number"\n"0";"first, 1"\n10.5;2,5\n')
    assert read_stations(file) == [0, 37_800]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no stations"),
        ("angle\n", "no stations"),
        ("1\nx\n", "line 2"),
        ("a\nb\n1\n", "line 2"),
        ("1\n2mm\n", "line 2"),
        ("0°\n10\n20\n", "line 1"),
        ("angle;remark\n12,5;b\n", "line 2: '12,5;b' may begin with a decimal comma"),
        ("0\n12,5\n", "line 2: '12,5' may begin with a decimal comma"),
        ('"12,5",b\n', "line 1: .* decimal comma"),
        ("12 ,5;b\n", "line 1"),
    ],
)
def test_a_bad_line_of_a_file_is_named(tmp_path, text, words):
    file = tmp_path / "former.csv"
    file.write_text(text)
    with pytest.raises(BadFile, match=words):
        read_stations(file)
    with pytest.raises(BadFile, match="cannot be read"):
        read_stations(tmp_path / "none.csv")


def test_answers_that_the_job_does_not_wait_for_are_refused_in_words():
    workshop = Workshop()
    workshop.job.load(["0deg"])
    with pytest.raises(Refused, match="the job does not expect this now"):
        workshop.job.do("next")


def test_the_commands_do_a_whole_job(tmp_path):
    workshop, file = Workshop(), tmp_path / "read.csv"
    assert workshop.call("job load --equal 4")[:2] == (
        0,
        "4 stations from 0arcsec to 270deg, saved in the EEPROM\n",
    )
    assert (
        workshop.call(f"job read {file}")[0] == 0
        and file.read_text() == "0.0000000\n90.0000000\n180.0000000\n270.0000000\n"
    )
    assert workshop.call(f"job load {file}")[0] == 0
    code, reported, _ = workshop.call("job start --wait")
    assert (
        code == 0
        and reported.startswith("all cut, station 4 of 4\n  takes    start\n")
        and len(workshop.station.edm.cuts) == 4
    )
    reported = json.loads(workshop.call("job status --json")[1])
    assert (
        reported["state"] == "finished"
        and reported["answers"] == ["start"]
        and reported["flags"] == ["eeprom"]
    )


def test_a_question_is_printed_and_answered():
    workshop = Workshop()
    workshop.call("settings set job_start_limit 1s")
    workshop.call("job load --equal 2")
    workshop.station.edm.deaf = True
    code, reported, errors = workshop.call("job start --wait")
    assert (
        code == 1
        and "because  the cut did not start in time" in reported
        and "takes    stop, again, next" in reported
    )
    assert errors == "moire: the job waits: the cut did not start in time\n"
    assert workshop.call("job resume")[2].endswith("the job does not expect this now\n")
    workshop.station.edm.deaf = False
    assert workshop.call("job answer again")[0] == 0
    assert workshop.call("job wait")[0] == 0 and len(workshop.station.edm.cuts) == 2


def test_waiting_polls_the_table_too():
    workshop = Workshop()
    port = port_of(workshop.station)
    workshop.call("job load --equal 2")
    assert workshop.call("job start --wait")[0] == 0 and "status" not in port.executed
    assert (
        workshop.call("job start --wait --table 2")[0] == 0 and port.executed.count("status") > 20
    )
    code, _, errors = workshop.call("job wait --table 3")
    assert code == 3 and "address 3" in errors


def test_pause_resume_and_stop_from_the_command_line():
    workshop = Workshop()
    workshop.call("job load --equal 3")
    assert workshop.call("job start")[0] == workshop.call("job pause")[0] == 0
    assert workshop.call("job wait")[0] == 1
    assert workshop.call("job resume")[0] == 0 and workshop.call("job stop")[0] == 0
    assert (
        workshop.call("job wait")[0] == 0
        and json.loads(workshop.call("job status --json")[1])["state"] == "idle"
    )


def test_a_missing_eeprom_is_reported_in_words():
    workshop = Workshop(absent=("eeprom", "keypad", "display"))
    workshop.station.run(1500)
    code, _, errors = workshop.call("job load --equal 3")
    assert code == 1 and errors.endswith("the EEPROM does not answer\n")
    assert workshop.call("job start")[2].endswith("the EEPROM does not answer\n")
    assert "because  the EEPROM does not answer" in workshop.call("job status")[1]
