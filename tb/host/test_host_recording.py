# SPDX-License-Identifier: Apache-2.0
"""moire.bus.recording, the self-test and the commands that only read: a session is recorded and
replayed, and faults are found.
"""

import errno
import io
import json
import os

import pytest

from moire.bus import recording
from moire.cli import ports
from moire.client.bus import Bus
from moire.errors import BadFile
from moire.made.registers import MAP_CRC
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.call import Call, sentence
from twin.compiled.tables import FAULT, PERIOD

SINE = ("sine", "monitor", "harmonics", "recorder")  # what is built of sine and cosine


def recorded(tmp_path, text="home -- move 1mm -- status", node=None):
    file = tmp_path / "session.jsonl"
    assert Call(f"--record {file} {text}", node or BusNode()).code == 0
    return file


# ------------------------------------------------------------------ record and replay


def test_a_session_replays_to_the_same_machine_with_the_same_bytes(tmp_path):
    file, node = recorded(tmp_path), BusNode()
    call = Call(f"replay {file}", node)
    assert call.code == 0 and call.out.endswith("the same, 0 with other values, 0 different\n")
    assert int(call.out.split()[0]) > 20
    done = [name for name in node.executed if name not in ("status", "identify", "get_parameter")]
    assert done == ["enable", "home", "move", "read_register", "stop", "enable"]
    assert node.axes[0].position == 1_000_000 * 65536 // 800


def test_other_values_are_distinguished_from_other_outcomes(tmp_path):
    file, other, broken = recorded(tmp_path, "status"), BusNode(), BusNode(map_crc=5)
    other.axes[0].machine += 1
    reported = Call(f"replay {file} --json", other).results[0]
    assert (reported["same"], reported["other_values"], reported["different"]) == (7, 1, 0)
    broken.map_crc = MAP_CRC
    message = sentence(Call(f"replay {file}", broken), 1)
    assert "answers differ from the record: at 0." in message and "came instead of" in message


def test_a_replay_to_a_silent_node_differs(tmp_path):
    assert "nothing came instead of 61" in sentence(
        Call(f"replay {recorded(tmp_path, 'status')}", BusNode(2)), 1
    )


def test_a_record_is_shown_in_words_without_a_port(tmp_path):
    rows = Call(f"replay --show {recorded(tmp_path)}").out.splitlines()
    assert rows[0].split()[2:] == ["node", "1:", "identify"] and rows[1].strip().startswith(
        "ok map_crc="
    )
    assert (
        any("move axis=0 target=81920000" in row for row in rows)
        and sum("no right reply" in row for row in rows) == 0
    )


def test_errors_on_the_bus_are_in_the_record(tmp_path):
    bus = Rs485Bus(BusNode())
    broken = [True]
    bus.from_nodes = lambda word: [word ^ broken.pop()] if broken else [word]
    with open(tmp_path / "bad.jsonl", "w") as file:
        Bus(recording.Recorder(bus, file)).identify(1)
    rows = recording.listing(recording.read((tmp_path / "bad.jsonl").read_text()))
    assert [row.strip() for row in rows if "no right" in row] == ["no right reply: 60"]


def test_a_recorder_hides_nothing_of_its_transport():
    class Deep(Rs485Bus):
        handshake, character_s = False, 0.125

        def reaches(self, address):
            return address == 3

        def set_baud(self, baud):
            self.character_s = 1 / baud

        def send_break(self):
            self.broken = True

    bus = recording.Recorder(Deep(), open("/dev/null", "w"))
    assert (
        bus.handshake,
        bus.time_is_stopped,
        bus.character_s,
        bus.reaches(3),
        bus.reaches(4),
    ) == (False, True, 0.125, True, False)
    bus.set_baud(4)
    bus.send_break()
    assert bus.character_s == 0.25 and bus.transport.broken


def test_a_change_of_the_baud_rate_and_the_break_after_it_are_recorded_and_replayed(tmp_path):
    file = recorded(tmp_path, "baud 500000 1 -- home -- status")
    events = [set(call) - {"at"} for call in recording.read(file.read_text())]
    assert [call for call in events if call & {"baud", "break"}] == [{"baud"}, {"break"}, {"baud"}]
    node = BusNode()
    assert Call(f"replay {file}", node).code == 0
    assert node.counters["breaks"] == 1 and node.port.hears(115200) and node.homed()
    rows = Call(f"replay --show {file}").out.splitlines()
    assert [
        row.split(" s  ")[1] for row in rows if " baud from" in row or row.endswith("break")
    ] == ["500000 baud from here on", "break", "115200 baud from here on"]


def test_a_record_that_broke_off_at_another_baud_rate_leaves_the_nodes_at_the_first_one(tmp_path):
    file = recorded(tmp_path, "baud 500000 1 -- status")
    rows = file.read_text().splitlines()
    file.write_text("\n".join(rows[:-2]))  # without the break and what follows it
    assert recording.last_baud(recording.read(file.read_text())) == 500_000
    call = Call(f"replay {file}")
    assert call.code == 0 and call.bus.nodes[0].port.hears(115200) and call.bus.baud == 115200


def test_a_record_with_another_baud_rate_is_not_replayed_through_a_gateway(tmp_path):
    bus = Rs485Bus(BusNode())
    bus.handshake = False
    assert "the bus of the nodes itself" in sentence(
        Call(f"replay {recorded(tmp_path, 'baud 9600 1')}", bus=bus), 3
    )


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "no json",
        '{"record": "moire bus", "version": 1, "protocol_crc": 0}',
        json.dumps({**recording.KIND, "protocol_crc": recording.PROTOCOL_CRC}) + '\n{"at": 1}',
        json.dumps({**recording.KIND, "protocol_crc": recording.PROTOCOL_CRC})
        + '\n{"at": 1, "send": [512]}',
        json.dumps({**recording.KIND, "protocol_crc": recording.PROTOCOL_CRC})
        + '\n{"at": 1, "receive": [1], "expected": 1}',
        *(
            json.dumps({**recording.KIND, "protocol_crc": recording.PROTOCOL_CRC})
            + f'\n{{"at": 1, {call}}}'
            for call in (
                '"baud": 0',
                '"baud": "fast"',
                '"baud": 1e9',
                '"baud": true',
                '"break": 1',
                '"break": true, "baud": 9600',
            )
        ),
    ],
)
def test_a_file_that_is_no_record_is_refused(tmp_path, text):
    (tmp_path / "no.jsonl").write_text(text)
    assert "is no record of a bus: make one with" in sentence(
        Call(f"replay {tmp_path / 'no.jsonl'}"), 2
    )


def test_a_record_of_another_protocol_is_refused():
    with pytest.raises(BadFile, match="recorded with another protocol table"):
        recording.read(json.dumps({**recording.KIND, "protocol_crc": 1}))


def test_a_record_that_cannot_be_written_is_one_sentence(tmp_path):
    call = Call(f"--record {tmp_path}/no/such.jsonl status")
    assert "such.jsonl cannot be written" in sentence(call, 2) and call.bus.closed
    call = Call("--record /dev/full status")
    assert "No space left on device" in sentence(call, 2) and call.bus.closed
    assert call.bus.nodes[0].executed == []


class FullDisk(io.StringIO):
    """A file that has room for so many lines."""

    name = "session.jsonl"

    def __init__(self, room):
        super().__init__()
        self.room = room

    def write(self, text):
        self.room -= 1
        if self.room < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super().write(text)


@pytest.mark.parametrize("room", [1, 2, 60, 61])
def test_a_record_that_ends_since_the_disk_is_full_disturbs_nothing(monkeypatch, room):
    node, file = BusNode(), FullDisk(room)
    monkeypatch.setattr(ports, "open", lambda *_, **__: file, raising=False)
    call = Call("--record session.jsonl home -- move 1mm", node)
    assert "the record session.jsonl ends at" in sentence(call, 2)
    assert "No space left on device" in call.err and file.closed and call.bus.closed
    assert node.axes[0].position == 1250 * PERIOD and not node.axes[0].enabled


# ------------------------------------------------------------------ watch, fault and self-test


def test_watch_prints_the_state_at_the_given_interval_and_ends_in_time():
    call = Call("watch --every 0.1s --for 0.5s --json")
    assert [round(reported["time_s"], 1) for reported in call.results] == [
        0.0,
        0.1,
        0.2,
        0.3,
        0.4,
        0.5,
    ] and call.results[0]["state"] == "off"
    assert "drive off" in Call("watch --for 0s").out


def test_watch_sends_requests_often_enough_for_the_watchdog():
    node = BusNode()
    Call("watch --every 10s --for 20s", node)
    assert node.executed.count("status") > 100


def press_estop(node):
    node.axes[0].causes = FAULT["estop"]
    node.run(1)


def test_fault_reports_cause_position_and_what_to_do():
    assert "no fault is latched" in Call("fault").out
    node = BusNode()
    press_estop(node)
    node.set_axis(ENCODER_EVENTS=4)
    node.set_feedback(FIRST_SIGNAL_FAULTS=1)
    out = Call("fault", node).out
    assert (
        out.startswith(
            "node 1 axis 0: emergency stop\n  first     emergency stop, at 1.50703125um\n"
        )
        and "signal too small" in out
    )
    assert "release the emergency stop; then 'moire reset', then 'moire home'" in out
    assert Call("fault --json", node).results[0]["first_fault"] == ["estop"]


def test_selftest_passes_a_sound_node():
    call = Call("selftest", BusNode(axes=2))
    assert call.code == 0 and call.out.count("passed") == 3 + 2 * 5 and "axis 1 sensor" in call.out


def test_selftest_passes_a_sound_node_without_sine_and_cosine():
    node = BusNode(absent=SINE)
    call = Call("selftest", node)
    assert (
        call.code == 0
        and "passed   axis 0 sensor      no illegal edge; built without sine and cosine\n"
        in call.out
    )
    node.set_axis(ENCODER_EVENTS=1)
    assert (
        "FAILED   axis 0 sensor      both quadrature levels changed at once"
        in Call("selftest", node).out
    )


def test_fault_of_a_node_without_sine_and_cosine_reports_what_exists():
    node = BusNode(absent=SINE)
    press_estop(node)
    assert "emergency stop" in Call("fault", node).out and "signal" not in Call("fault", node).out


def spoil_limits(node):
    node.set(amplitude_low=200)


def spoil_signal(node):
    node.set_feedback(SIGNAL_FAULTS=2, FIRST_SIGNAL_FAULTS=2)


def spoil_parameter(node):
    node.force("pwm_frequency", 1)


def spoil_register(node):
    def once_identified(name, fields):
        node.map_crc = MAP_CRC if name == "identify" else 5

    node.port.on_request = once_identified


@pytest.mark.parametrize(
    "spoil, name, message",
    [
        (press_estop, "axis 0 interlock", "emergency stop pressed"),
        (spoil_limits, "axis 0 sensor", "amplitude 103, allowed 200 to 160"),
        (spoil_signal, "axis 0 sensor", "signal too large"),
        (spoil_parameter, "axis 0 parameters", "out of range: pwm_frequency"),
        (spoil_register, "bus", "wrong_values 50"),
    ],
)
def test_selftest_finds_and_names_what_is_wrong(spoil, name, message):
    node = BusNode()
    spoil(node)
    call = Call("selftest", node)
    assert f"FAILED   {name}" in call.out and message in call.out
    assert f"node 1 failed 1 of 8 checks: {name}" in sentence(call, 1)
    reported = Call("selftest --json", node).results
    assert reported[0]["passed"] is False and [
        check["name"] for check in reported[0]["checks"] if not check["passed"]
    ] == [name]
    assert reported[1]["error"] == "SelfTestFailed"


def test_selftest_of_the_pins_leaves_the_checks_of_the_machine_out():
    call = Call("selftest --pins open", BusNode())
    assert "FAILED   axis 0 open inputs reads 0: limit_low_open, limit_high_open, es" in call.out
    assert "node 1 failed 1 of 4 checks: axis 0 open inputs" in sentence(call, 1)
    node = BusNode()
    call = Call("selftest --pins plug", node)
    assert "passed   axis 0 closed inputs limits and emergency stop read 0\n" in call.out
    assert "parameters" not in call.out and not node.axes[0].enabled


def test_selftest_of_other_pins_is_refused():
    call = Call("selftest --pins all", BusNode())
    assert call.code != 0 and "check of the pins" in call.err


def test_selftest_counts_errors_on_the_bus():
    bus, count = Rs485Bus(BusNode()), [0]

    def every_hundredth(word):
        count[0] += 1
        return [word ^ 1] if count[0] % 100 == 0 and count[0] > 300 else [word]

    bus.to_nodes = every_hundredth
    call = Call("selftest", bus=bus)
    assert "FAILED   bus" in call.out and "frames_bad" in call.out and "repeats" in call.out
