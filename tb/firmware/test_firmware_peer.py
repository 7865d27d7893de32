# SPDX-License-Identifier: Apache-2.0
"""The peer port: two nodes over a cable that adds, loses and damages bytes. For a main node the
test calls what the job calls.
"""

import ctypes
import random
import zlib

import pytest

from tb.bench import seed
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.peripherals import I2c, PeerPort, PeripheralParts, Sensor, Table
from twin.compiled.tables import CAUSE, PARAMETER, TABLE

OPERATION = {name: operation["code"] for name, operation in TABLE["operation"].items()}
PHASE = {code: name for name, (code, _) in TABLE["peer_phase"].items()}
SETTING = TABLE["setting"]
LEGACY, FRAMES = 1, 2
READY = 1  # a store_state
MAIN, SUB = 0, 1
ORDER, DONE = b"\xff\xff\xaa", b"\xff\xff\x55"
ARCSEC = 100
AXIS = {
    "position_source": 2,
    "velocity": 30000,
    "acceleration": 500000,
    "jerk": 50000000,
    "homing_latch_speed": 300,
    "following_limit": 2**31 - 1,
}


class Node(CompiledNode):
    """One of the two nodes; the test plays the other one, since the compiled firmware has its
    variables only once.
    """

    def __init__(self, mode, role):
        self.random = random.Random(seed())
        self.table = Table(self.random)
        self.sensor, self.port, self.i2c = Sensor(self.random, self.table), PeerPort(), I2c()
        self.settings = {"peer_mode": mode, "peer_role": role}
        super().__init__(
            Axis(), image="station", peripherals=PeripheralParts(self.sensor, self.port, self.i2c)
        )
        self.begin()

    def begin(self):
        assert self.run(5000, until=lambda: self.firmware.store_state() == READY)
        self.set(**AXIS)
        self.configure(**self.settings)
        self.run(50)

    def power_cut(self):
        """Cut the power; it is there again at once, and the node is given its settings again."""
        self.i2c.power_cut(self.random)
        self.port.received.clear()
        self.port.sent.clear()
        self.firmware.firmware_start()
        self.begin()

    def configure(self, **settings):
        for name, value in settings.items():
            self.ask("set_setting", setting=SETTING[name]["id"], value=value)

    def say(self, data):
        self.port.received.extend(data)

    def peer(self):
        peer = self.ask("peer")
        return {**peer, "phase": PHASE[peer["phase"]], "ended": CAUSE[peer["ended"]]}

    def heard(self, ms=20):
        """What the node sends meanwhile."""
        self.other = self.port.other = PeerPort()
        self.run(ms)
        return bytes(self.other.received)

    def order(self, station=0, arcsec=0):
        return CAUSE[self.firmware.peer_turn_to(station, ctypes.c_uint32(round(arcsec * ARCSEC)))]


def stations(node, *arcsec):
    node.ask("job_begin")
    for number, angle in enumerate(arcsec):
        node.ask("job_add", station=number, angle=angle * ARCSEC)
    node.ask("job_save")
    assert node.run(2000, until=lambda: node.firmware.store_state() == READY)


# ------------------------------------------------------------------ frames, by hand


def frame(body):
    data, out = body + zlib.crc32(body).to_bytes(4, "little"), b""
    for part in data.split(b"\0"):
        assert len(part) < 254
        out += bytes([len(part) + 1]) + part
    return b"\0" + out + b"\0"


def bodies(data):
    """The bodies of all good frames."""
    found = []
    for part in data.split(b"\0"):
        whole, at = b"", 0
        while at < len(part):
            whole += (b"\0" if at else b"") + part[at + 1 : at + part[at]]
            at += part[at]
        if len(whole) > 4 and zlib.crc32(whole[:-4]) == int.from_bytes(whole[-4:], "little"):
            found.append(whole[:-4])
    return found


def turn_to(sequence, arcsec):
    return bytes([sequence, OPERATION["turn_to"]]) + round(arcsec * ARCSEC).to_bytes(4, "little")


def poll(sequence):
    return bytes([sequence, OPERATION["turn_state"]])


# ------------------------------------------------------------------ the sub-node, legacy


def test_the_legacy_order_turns_to_the_next_station_and_gets_the_legacy_answer():
    node = Node(LEGACY, SUB)
    stations(node, 600, 900, 1500)
    for angle in (600, 900, 1500):
        node.say(ORDER)
        assert node.heard(200) == b"" and node.peer()["phase"] == "turning"
        node.port.other = PeerPort()
        assert node.run(60_000, until=lambda: node.port.other.received and not node.port.sent)
        assert bytes(node.port.other.received) == DONE and node.peer()["phase"] == "turned"
        assert abs(node.table.angle - angle) <= 2
    node.say(ORDER)
    assert node.heard(3000) == b""
    assert (node.peer()["phase"], node.peer()["ended"]) == ("failed", "no_station")


@pytest.mark.parametrize(
    "before",
    [
        b"",
        b"\xff",
        b"\xff\xff\xff",
        b"\xff\xaa",
        b"\xff\xff\x55",
        b"\xff\xff\x00\xff",
        b"\xaa\xaa",
        bytes(range(256)),
    ],
)
def test_an_order_is_found_after_any_garbage(before):
    node = Node(LEGACY, SUB)
    stations(node, 600)
    for byte in before:
        node.say([byte])
        node.run(1)
    assert node.peer()["phase"] == "idle"
    node.say(ORDER)
    node.run(20)
    assert (
        node.peer()["phase"] == "turning"
        and node.peer()["garbage"] == len(before)
        and node.peer()["heard"] == 1
    )


def test_a_node_that_hears_nothing_but_garbage_for_long_still_hears_an_order():
    node, source = Node(LEGACY, SUB), random.Random(seed())
    stations(node, 600)
    sent = 0
    for _ in range(500):
        part = bytes(
            source.choice((0xFF, 0xFF, 0x55, 0x00, source.randrange(256))) for _ in range(20)
        ).replace(ORDER, b"")
        sent += len(part)
        node.say(part + b"\0")
        node.run(3)
    assert node.peer()["phase"] == "idle" and node.peer()["garbage"] == sent + 500
    node.say(ORDER)
    node.run(20)
    assert node.peer()["phase"] == "turning"


def test_a_turn_that_fails_is_not_answered_and_the_next_order_tries_it_again():
    node = Node(LEGACY, SUB)
    stations(node, 3600, 7200)
    node.say(ORDER)
    node.run(500)
    node.sensor.dead = True
    assert (
        node.heard(2000) == b""
        and node.peer()["ended"] == "sensor_timed_out"
        and node.peer()["phase"] == "failed"
    )
    node.sensor.dead = False
    node.run(50)
    node.say(ORDER)
    assert (
        node.run(60_000, until=lambda: node.peer()["phase"] == "turned")
        and abs(node.table.angle - 3600) <= 2
    )


def test_an_order_that_comes_while_the_table_turns_is_ignored():
    node = Node(LEGACY, SUB)
    stations(node, 600, 1200)
    node.say(ORDER)
    node.run(100)
    node.say(ORDER)
    assert node.run(60_000, until=lambda: node.peer()["phase"] == "turned")
    node.run(500)
    assert abs(node.table.angle - 600) <= 2 and node.peer()["phase"] == "turned"


def turned(node, angle):
    """Orders a turn and checks where the table is."""
    node.say(ORDER)
    node.port.other = PeerPort()
    assert node.run(60_000, until=lambda: node.port.other.received and not node.port.sent), (
        node.peer()
    )
    assert bytes(node.port.other.received) == DONE and abs(node.table.angle - angle) <= 2


def test_the_next_station_can_be_set_and_survives_a_power_cut():
    node = Node(LEGACY, SUB)
    stations(node, 600, 900, 1500)
    assert node.request("peer_next", station=3)[0] == "no_station"
    node.ask("peer_next", station=2)
    node.run(100)
    node.power_cut()
    assert (node.peer()["stations"], node.peer()["next"]) == (3, 2)
    turned(node, 1500)
    assert node.peer()["next"] == 3


def test_a_sub_node_continues_its_list_after_a_power_cut_at_any_moment():
    """A station that was answered is not repeated. One that was not answered is, unless only its
    answer was lost. None is ever left out unnoticed.
    """
    node, angles = Node(LEGACY, SUB), [300 + 90 * n for n in range(12)]
    stations(node, *angles)
    done = 0
    while done < len(angles):
        node.say(ORDER)
        node.port.other = PeerPort()
        node.run(
            node.random.uniform(0, 9000),
            until=lambda: node.port.other.received and not node.port.sent,
        )
        answered = bytes(node.port.other.received) == DONE
        node.power_cut()
        assert node.peer()["next"] in ((done + 1,) if answered else (done, done + 1))
        done = node.peer()["next"]
    assert node.peer()["stations"] == len(angles)


def test_an_order_that_comes_while_the_eeprom_is_read_is_done_once_the_list_is_loaded():
    node = Node(LEGACY, SUB)
    stations(node, 300)
    node.i2c.power_cut(node.random)
    node.firmware.firmware_start()
    node.say(ORDER)
    node.configure(**node.settings)
    node.set(**AXIS)
    assert node.peer()["stations"] == 0 and node.peer()["heard"] == 0
    assert (
        node.run(60_000, until=lambda: node.peer()["phase"] == "turned")
        and abs(node.table.angle - 300) <= 2
    )


def test_done_is_sent_only_when_the_count_is_in_the_journal():
    node = Node(LEGACY, SUB)
    stations(node, 300)
    node.say(ORDER)
    node.run(50)
    node.i2c.bus.devices.clear()
    assert node.heard(20_000) == b"" and (node.peer()["phase"], node.peer()["ended"]) == (
        "failed",
        "eeprom_missing",
    )
    assert abs(node.table.angle - 300) <= 2


def test_a_new_list_begins_with_its_first_station():
    node = Node(LEGACY, SUB)
    stations(node, 300, 600)
    turned(node, 300)
    assert node.peer()["next"] == 1
    stations(node, 300, 600)
    assert node.peer()["next"] == 0


def test_the_list_does_not_change_while_the_table_turns():
    node = Node(LEGACY, SUB)
    stations(node, 600, 1200)
    node.say(ORDER)
    node.run(100)
    assert node.request("job_begin")[0] == node.request("peer_next", station=0)[0] == "busy"


def test_only_a_sub_node_has_a_next_station():
    node = Node(LEGACY, MAIN)
    stations(node, 600, 1200)
    assert (
        node.request("peer_next", station=1)[0] == "peer_off"
        and node.ask("job_stations")["journal"] == 0
    )


# ------------------------------------------------------------------ the main node, legacy


def test_the_main_node_sends_the_legacy_order_and_waits_for_the_answer():
    node = Node(LEGACY, MAIN)
    assert node.order(3) == "ok" and node.heard() == ORDER
    assert node.peer()["phase"] == "turning" and node.order(4) == "busy"
    node.say(b"\xff\x55\xff\xff\xff\x55")
    node.run(5)
    assert node.peer()["phase"] == "turned" and node.peer()["station"] == 3
    assert (
        PHASE[node.firmware.peer_state()] == "turned" and CAUSE[node.firmware.peer_cause()] == "ok"
    )


def test_a_missing_answer_is_a_time_out_and_an_unexpected_one_is_ignored():
    node = Node(LEGACY, MAIN)
    node.say(DONE)
    node.run(5)
    assert node.peer()["phase"] == "idle"
    node.configure(peer_timeout=500)
    node.order()
    node.run(490)
    assert node.peer()["phase"] == "turning"
    node.run(20)
    assert (node.peer()["phase"], node.peer()["ended"]) == ("silent", "check_sub_node")
    node.say(DONE)
    node.run(5)
    assert node.peer()["phase"] == "silent"


def test_a_stopped_order_is_over_for_the_main_node():
    node = Node(LEGACY, MAIN)
    node.order()
    node.firmware.peer_stop()
    assert (node.peer()["phase"], node.peer()["ended"]) == ("failed", "stopped")


# ------------------------------------------------------------------ the sub-node, frames


def test_a_request_in_a_frame_is_done_and_answered_with_the_body_of_the_bus():
    node = Node(FRAMES, SUB)
    node.say(frame(turn_to(7, 600)))
    assert bodies(node.heard()) == [bytes([7, OPERATION["turn_to"], 0])]
    node.say(frame(poll(8)))
    reply = bodies(node.heard())[0]
    assert (
        reply[:3] == bytes([8, OPERATION["turn_state"], 0])
        and int.from_bytes(reply[7:11], "little") == 60_000
    )
    assert (
        node.run(60_000, until=lambda: node.ask("turn_state")["phase"] == 0)
        and abs(node.table.angle - 600) <= 2
    )


def test_a_repeated_request_is_answered_again_and_not_done_again():
    node = Node(FRAMES, SUB)
    node.say(frame(turn_to(1, 600)))
    first = bodies(node.heard())
    node.run(30_000, until=lambda: node.ask("turn_state")["phase"] == 0)
    node.say(frame(bytes([2, OPERATION["stop"], 0])))
    node.heard()
    node.say(frame(turn_to(1, 300)))
    node.run(30_000, until=lambda: node.ask("turn_state")["phase"] == 0)
    pushed = len(node.axes[0].pushed)
    node.say(frame(turn_to(1, 300)))
    assert bodies(node.heard(200)) == first and len(node.axes[0].pushed) == pushed
    assert node.peer()["repeated"] == 1
    node.say(frame(turn_to(2, 600)))
    node.heard(500)
    assert len(node.axes[0].pushed) > pushed  # another one is


def test_a_refused_request_is_answered_with_its_cause():
    node = Node(FRAMES, SUB)
    for sequence, (body, cause) in enumerate(
        [
            (b"\xc8", "unknown_operation"),
            (bytes([OPERATION["turn_to"]]), "wrong_length"),
            (turn_to(0, 1296000)[1:], "out_of_range"),
        ]
    ):
        node.say(frame(bytes([sequence]) + body))
        assert [CAUSE[reply[2]] for reply in bodies(node.heard())] == [cause]


def test_damaged_frames_are_counted_and_not_answered_and_the_next_one_is():
    node, source = Node(FRAMES, SUB), random.Random(seed())
    good = bytes([9, OPERATION["identify"]])
    for _ in range(200):
        whole = bytearray(frame(poll(source.randrange(256))))
        kind = source.randrange(4)
        if kind == 0:
            whole[source.randrange(1, len(whole) - 1)] ^= 1 << source.randrange(8)
        elif kind == 1:
            del whole[source.randrange(1, len(whole) - 1)]
        elif kind == 2:
            whole.insert(source.randrange(1, len(whole)), source.randrange(256))
        else:
            whole = bytearray(source.randbytes(source.randrange(64)))
        before = node.peer()["heard"]
        node.say(whole + b"\0")
        reported = node.heard(8)
        assert (
            bodies(reported) == []
            and reported == b""
            or kind == 2
            and node.peer()["heard"] == before + 1
        )  # a zero between frames is none
    node.say(frame(good))
    assert len(bodies(node.heard())) == 1 and node.peer()["garbage"] > 150


def test_a_frame_without_an_end_does_not_hang_the_port():
    node = Node(FRAMES, SUB)
    for _ in range(100):
        node.say(b"\x55" * 50)
        node.run(5)
    node.say(frame(poll(1)))
    assert len(bodies(node.heard())) == 1


# ------------------------------------------------------------------ the main node, frames


class Answering:
    """The sub-node: answers the requests of the main node, if `hears` says so."""

    def __init__(self, node):
        self.node, self.asked, self.phase, self.ended, self.target, self.cause = (
            node,
            [],
            0,
            "no_motion_yet",
            0,
            "ok",
        )
        self.answers, self.last = True, None
        node.port.other = self.port = PeerPort()

    def millisecond(self):
        data = bytes(self.port.received)
        if data.count(0) < 2 or data[-1]:
            return
        self.port.received.clear()
        for body in bodies(data):
            self.asked.append(body)
            if self.answers:
                self.node.say(frame(self.reply(body)))

    def reply(self, body):
        cause = "ok"
        if body[1] == OPERATION["turn_to"] and body != self.last:
            cause = self.cause
            if cause == "ok":
                self.phase, self.ended, self.target = (
                    1,
                    "running",
                    int.from_bytes(body[2:6], "little"),
                )
        elif body[1] == OPERATION["stop"]:
            self.phase, self.ended = 0, "stopped"
        code = next(number for number, name in CAUSE.items() if name == cause)
        fields = b""
        if body[1] == OPERATION["turn_state"]:
            ended = next(number for number, name in CAUSE.items() if name == self.ended)
            fields = bytes([self.phase, ended, 0, 0]) + self.target.to_bytes(4, "little") + bytes(8)
        if body[1] == OPERATION["status"]:
            fields = (
                bytes(4)
                + (3 << 2).to_bytes(2, "little")
                + (1 << 3).to_bytes(2, "little")
                + bytes(30)
            )
        self.last = body
        return body[:2] + bytes([code]) + fields

    def run(self, ms, until=lambda: False):
        for _ in range(ms):
            self.node.run(1)
            self.millisecond()
            if until():
                return True
        return False

    def operations(self):
        names = {code: name for name, code in OPERATION.items()}
        return [names[body[1]] for body in self.asked]


def test_the_main_node_polls_orders_and_polls_until_the_table_has_turned():
    node = Node(FRAMES, MAIN)
    sub = Answering(node)
    assert node.order(5, 600) == "ok"
    sub.run(500)
    assert sub.operations()[:3] == ["turn_state", "set_parameter", "turn_to"] and set(
        sub.operations()[3:]
    ) == {"turn_state"}
    assert len({body[0] for body in sub.asked}) == len(sub.asked) and 5 <= len(sub.asked) <= 14
    assert sub.target == 60_000 and node.peer()["phase"] == "turning"
    sub.phase, sub.ended = 0, "ok"
    sub.run(100)
    assert (node.peer()["phase"], node.peer()["ended"], node.peer()["station"]) == (
        "turned",
        "ok",
        5,
    )
    count = len(sub.asked)
    sub.run(500)
    assert len(sub.asked) == count  # then it is quiet


@pytest.mark.parametrize("ended", ["sensor_timed_out", "stiction", "ended_by_fault"])
def test_the_main_node_reports_the_cause_of_the_sub_node(ended):
    node = Node(FRAMES, MAIN)
    sub = Answering(node)
    node.order(0, 600)
    sub.run(200)
    sub.phase, sub.ended = 0, ended
    sub.run(200)
    assert (node.peer()["phase"], node.peer()["ended"]) == ("failed", ended)
    assert node.firmware.peer_faults() == (
        1 << 3 if ended == "ended_by_fault" else 0
    )  # the first of them


def test_the_speed_goes_before_each_order():
    node = Node(FRAMES, MAIN)
    sub = Answering(node)
    node.configure(job_speed=25)
    node.order(0, 600)
    sub.run(200)
    reported = next(body for body in sub.asked if body[1] == OPERATION["set_parameter"])
    assert (
        reported[2:4] == bytes([0, PARAMETER["feed_override"]["id"]])
        and int.from_bytes(reported[4:], "little") == 65536 // 4
    )


def test_an_order_that_is_refused_has_failed():
    node = Node(FRAMES, MAIN)
    sub = Answering(node)
    sub.cause = "faulted"
    node.order(0, 600)
    sub.run(200)
    assert (node.peer()["phase"], node.peer()["ended"]) == ("failed", "faulted")


@pytest.mark.parametrize("after", [0, 200])
def test_a_silent_sub_node_is_reported_after_two_seconds_of_requests(after):
    node = Node(FRAMES, MAIN)
    sub = Answering(node)
    sub.answers = after > 0
    node.order(0, 600)
    sub.run(after)
    sub.answers = False
    sub.run(1900)
    assert node.peer()["phase"] == "turning"
    sub.run(250)
    assert (node.peer()["phase"], node.peer()["ended"]) == ("silent", "peer_silent")
    assert len({body[0] for body in sub.asked[-20:]}) == 1  # the same request each time


def test_a_sub_node_that_lost_its_power_is_reported():
    node = Node(FRAMES, MAIN)
    sub = Answering(node)
    node.order(0, 600)
    sub.run(200)
    sub.phase, sub.ended, sub.target = 0, "no_motion_yet", 0
    sub.run(200)
    assert (node.peer()["phase"], node.peer()["ended"]) == ("failed", "peer_restarted")


def test_a_sub_node_that_still_turns_is_stopped_first():
    node = Node(FRAMES, MAIN)
    sub = Answering(node)
    sub.phase, sub.ended, sub.target = 3, "running", 5
    node.order(0, 600)
    sub.run(500)
    assert sub.operations()[:5] == ["turn_state", "stop", "turn_state", "set_parameter", "turn_to"]
    assert node.peer()["phase"] == "turning"


def test_a_sub_node_that_never_comes_to_rest_is_busy():
    node = Node(FRAMES, MAIN)
    sub = Answering(node)
    sub.cause = "busy"
    node.order(0, 600)
    assert (
        sub.run(11_000, until=lambda: node.peer()["phase"] == "failed")
        and node.peer()["ended"] == "busy"
    )


def test_stop_reaches_the_sub_node():
    node = Node(FRAMES, MAIN)
    sub = Answering(node)
    node.order(0, 600)
    sub.run(200)
    node.firmware.peer_stop()
    sub.run(200)
    assert sub.operations().count("stop") == 1 and (node.peer()["phase"], node.peer()["ended"]) == (
        "failed",
        "stopped",
    )


def test_a_noisy_cable_costs_repetitions_and_nothing_else():
    node, source = Node(FRAMES, MAIN), random.Random(seed())
    sub = Answering(node)

    def spoil(data):
        received = [byte for byte in data if source.random() > 0.01]
        return [
            byte ^ (1 << source.randrange(8)) if source.random() < 0.01 else byte
            for byte in received
        ]

    node.port.spoil, answer = spoil, node.say
    node.say = lambda data: answer(spoil(data))
    for station in range(10):
        assert node.order(station, 100 + station) == "ok"
        before, angle = sub.target, (100 + station) * ARCSEC
        assert (
            sub.run(3000, until=lambda before=before: sub.target != before) and sub.target == angle
        )
        sub.phase, sub.ended = 0, "ok"
        assert sub.run(3000, until=lambda: node.peer()["phase"] == "turned")
    assert (
        node.peer()["garbage"] > 0
        and len(set(sub.asked)) < len(sub.asked)
        and 10 <= sub.operations().count("turn_to") < 30
    )


# ------------------------------------------------------------------ not in use


def test_a_node_whose_peer_port_is_not_in_use_orders_nothing_and_obeys_nothing():
    node = Node(0, MAIN)
    assert node.order() == "peer_off" and node.heard() == b""
    node = Node(0, SUB)
    stations(node, 600)
    node.say(ORDER + frame(poll(1)))
    assert node.heard() == b"" and node.peer()["phase"] == "idle"
    node = Node(LEGACY, SUB)
    assert node.order() == "peer_off"


def test_a_node_without_a_peer_port_reports_that():
    node = Node(FRAMES, MAIN)
    node.peripherals.parts = [node.sensor]
    assert node.order() == "not_built"
