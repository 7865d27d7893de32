# SPDX-License-Identifier: Apache-2.0
"""moire.bus.arbiter: several clients of one bus, in front of the compiled firmware."""

import itertools

import pytest

from moire.bus.arbiter import Arbiter, request
from moire.bus.gateway import Gateway
from moire.bus.protocol import IN_MOTION, parse_reply, request_body
from moire.client.names import CAUSE_CODES
from moire.client.node import register_fields
from moire.made.bus_tables import CAUSES, PARAMETERS
from moire.web.bridge import Bridge
from tb.fakes.bus_node import PERIOD, BusNode
from tb.fakes.rs485_bus import Rs485Bus
from twin.compiled.tables import FAULT

FAR = 1000 * PERIOD  # a target that is not reached within a test


class Clients:
    """A bus with nodes, and the requests of clients that are texts."""

    def __init__(self, *nodes):
        self.far = Rs485Bus(*nodes)
        self.gateway = Gateway(self.far)
        self.arbiter = self.gateway.arbiter
        self.numbers = itertools.count(250)  # through 255

    def ask(self, client, operation, address=1, **fields):
        """The name of the cause of the reply."""
        body = request_body(operation, next(self.numbers), **fields)
        reply = parse_reply(self.arbiter.answer(client, address, body))
        assert reply.sequence == body[0] and reply.operation == body[1]
        return CAUSES[reply.cause][0]

    def pass_time(self, seconds):
        """Time passes as in Gateway.serve."""
        end = self.far.now() + seconds
        while self.far.now() < end:
            self.arbiter.see_off()
            self.far.wait(0.001)


@pytest.fixture
def node():
    made = BusNode()
    made.home()
    return made


@pytest.fixture
def clients(node):
    made = Clients(node)
    yield made
    made.gateway.close()


def begin_to_move(clients, client, axis=0):
    assert clients.ask(client, "enable", axis=axis, on=1) == "ok"
    assert clients.ask(client, "move", axis=axis, target=FAR) == "ok"


def test_a_motion_of_another_client_is_refused_and_the_first_one_goes_on(clients, node):
    begin_to_move(clients, "A")
    for operation, fields in (
        ("move", {"axis": 0, "target": 0}),
        ("home", {"axis": 0}),
        ("prepare", {"axis": 0, "target": 0}),
        ("start", {"axes": 1}),
        ("start_at_sync", {"axes": 1}),
        ("turn_to", {"angle": 0}),
    ):
        assert clients.ask("B", operation, **fields) == "other_client"
    assert node.executed.count("move") == 1 and "home" not in node.executed
    assert node.state() == "moving"
    assert clients.ask("A", "move", axis=0, target=FAR - 1) == "ok"  # its own new target


def test_every_client_may_look_stop_and_switch_off(clients, node):
    begin_to_move(clients, "A")
    for operation in ("status", "position", "encoder", "signal"):
        assert clients.ask("B", operation, axis=0) == "ok"
    assert clients.ask("B", "stop", axis=0) == "ok"
    clients.pass_time(0.2)
    assert node.state() == "holding" and node.ended() == "stopped"
    begin_to_move(clients, "A")
    assert clients.ask("B", "enable", axis=0, on=0) == "ok"
    assert node.state() == "off"


def test_an_axis_that_has_stopped_belongs_to_nobody(clients, node):
    begin_to_move(clients, "A")
    clients.pass_time(0.05)
    assert clients.ask("B", "stop", axis=0) == "ok"
    assert clients.ask("B", "move", axis=0, target=0) == "other_client"  # it is not at rest yet
    clients.pass_time(0.2)
    assert clients.ask("B", "move", axis=0, target=0) == "ok"
    assert clients.ask("A", "move", axis=0, target=FAR) == "other_client"
    assert node.state() == "moving"


ARMED = dict(axis=0, trigger=0, before=0, every=4, level=100)


def test_a_scope_that_only_looks_is_no_motion_and_one_that_drives_is(clients, node):
    begin_to_move(clients, "a")
    assert clients.ask("b", "arm_scope", **ARMED, amplitude=0) == "ok"
    assert clients.arbiter.moved_by == {(1, 0): "a"}
    assert clients.arbiter.recorder_of == {(1, "arm_scope"): "b"}
    assert clients.ask("b", "arm_scope", **ARMED, amplitude=99) == "other_client"
    clients.ask("a", "stop", axis=0)
    while clients.arbiter.state((1, 0)) in IN_MOTION:
        clients.far.wait(0.01)
    assert clients.ask("b", "arm_scope", **ARMED, amplitude=99) == "ok"
    assert clients.arbiter.moved_by == {(1, 0): "b"}
    clients.arbiter.depart("b")
    assert clients.arbiter.recorder_of == {}


def test_other_axes_are_free():
    node = BusNode(axes=2)
    node.home(axis=0)
    node.home(axis=1)
    clients = Clients(node, BusNode(2))
    clients.far.nodes[1].home()
    begin_to_move(clients, "A", axis=0)
    begin_to_move(clients, "B", axis=1)
    assert clients.ask("B", "start", axes=3) == "other_client"  # one of them is A's
    assert clients.ask("B", "enable", address=2, axis=0, on=1) == "ok"
    assert clients.ask("B", "move", address=2, axis=0, target=FAR) == "ok"
    clients.gateway.close()


def test_a_repeated_request_gets_the_same_reply_whatever_others_have_sent_since(clients, node):
    assert clients.ask("A", "enable", axis=0, on=1) == "ok"
    move = request_body("move", 7, axis=0, target=FAR)
    reply = clients.arbiter.answer("A", 1, move)
    assert clients.ask("B", "status", axis=0) == "ok"
    assert clients.ask("B", "stop", axis=0) == "ok"
    assert clients.arbiter.answer("A", 1, move) == reply
    assert node.executed.count("move") == 1


def test_equal_sequence_numbers_of_two_clients_are_two_requests(clients, node):
    status = request_body("status", 9, axis=0)
    for client in ("A", "B"):
        reply = clients.arbiter.answer(client, 1, status)
        assert reply[:2] == status[:2] and len(reply) > 3
    assert node.executed.count("status") == 2


def test_each_reading_of_a_followed_position_is_new(clients, node):
    follow = request_body("follow", 9, axis=0)
    first = clients.arbiter.answer("A", 1, follow)
    node.axes[0].machine += 10 * PERIOD
    assert clients.arbiter.answer("A", 1, follow) != first


def test_the_axis_of_a_client_that_has_gone_is_stopped_and_then_switched_off(clients, node):
    begin_to_move(clients, "A")
    clients.pass_time(0.02)
    clients.arbiter.depart("A")
    clients.arbiter.see_off()
    assert node.state() == "stopping" and node.axes[0].enabled  # under control
    assert clients.ask("B", "move", axis=0, target=0) == "other_client"
    clients.pass_time(1)
    assert node.ended() == "stopped" and node.state() == "off"
    assert node.axes[0].causes == 0  # no watchdog has expired
    assert not clients.arbiter.farewells
    assert clients.ask("B", "enable", axis=0, on=1) == "ok"
    assert clients.ask("B", "move", axis=0, target=0) == "ok"


def test_a_drive_that_stands_is_switched_off_when_its_client_has_gone(clients, node):
    assert clients.ask("A", "enable", axis=0, on=1) == "ok"
    clients.arbiter.depart("B")
    clients.pass_time(0.1)
    assert node.state() == "holding"
    clients.arbiter.depart("A")
    clients.pass_time(0.1)
    assert node.state() == "off" and "stop" not in node.executed


def test_a_drive_that_another_client_now_needs_stays_on_until_that_one_has_gone(clients, node):
    assert clients.ask("A", "enable", axis=0, on=1) == "ok"
    begin_to_move(clients, "B")
    clients.arbiter.depart("A")
    clients.pass_time(0.1)
    assert node.state() == "moving"
    clients.arbiter.depart("B")
    clients.pass_time(1)
    assert node.state() == "off" and node.ended() == "stopped"


def test_a_drive_that_a_fault_has_switched_off_belongs_to_who_switches_it_on_again(clients, node):
    assert clients.ask("A", "enable", axis=0, on=1) == "ok"
    assert clients.ask("B", "enable", axis=0, on=1) == "ok"
    assert clients.arbiter.switched_on_by == {(1, 0): "A"}  # it was on
    node.axes[0].causes = FAULT["drive"]
    clients.pass_time(0.01)
    assert node.state() == "faulted"
    node.axes[0].causes = 0
    assert clients.ask("B", "reset_faults", axis=0) == "ok"
    assert clients.ask("B", "enable", axis=0, on=1) == "ok"
    clients.arbiter.depart("A")
    clients.pass_time(0.1)
    assert node.state() == "holding"
    clients.arbiter.depart("B")
    clients.pass_time(0.1)
    assert node.state() == "off"


def test_a_stop_is_carried_out_however_much_its_client_asks_of_other_nodes_in_between(node):
    other = BusNode(2)
    gateway = Clients(node, other).gateway
    bridge = Bridge(gateway)
    client = bridge.client(None, "test")
    stop, position = (request(name, axis=0) for name in ("stop", "position"))
    for address, body in ((1, stop), *[(2, position)] * 255, (1, stop)):
        bridge.send(client, address, body)
        gateway.poll(0)
    assert [node.executed.count("stop"), other.executed.count("position")] == [2, 255]
    gateway.close()


def test_an_axis_whose_node_does_not_answer_at_once_is_stopped_when_it_does(clients, node):
    velocity = PARAMETERS["velocity"]
    slow = velocity.default // 10
    assert clients.ask("A", "set_parameter", axis=0, parameter=velocity.id, value=slow) == "ok"
    begin_to_move(clients, "A")
    clients.far.from_nodes = lambda word: []
    clients.arbiter.depart("A")
    clients.arbiter.see_off()
    assert clients.arbiter.farewells and node.state() in IN_MOTION
    clients.far.from_nodes = lambda word: [word]
    clients.pass_time(1)
    assert node.ended() == "stopped" and node.state() == "off"
    assert not clients.arbiter.farewells


def test_a_node_without_power_ends_the_care_for_its_axes(clients, node):
    begin_to_move(clients, "A")
    clients.far.from_nodes = lambda word: []
    clients.arbiter.depart("A")
    clients.pass_time(1)
    assert not clients.arbiter.farewells and not clients.arbiter.moved_by


def test_a_request_that_the_node_does_not_know_is_passed_on(clients, node):
    for body in (bytes([5]), bytes([6, 250]), bytes([7, 5, 0])):
        reply = parse_reply(clients.arbiter.answer("A", 1, body))
        assert reply.sequence == body[0]
        assert reply.cause in (CAUSE_CODES["unknown_operation"], CAUSE_CODES["wrong_length"])


def word(body):
    """(register, value) of a body without its sequence number; no value of a reading."""
    return int.from_bytes(body[1:3], "little"), int.from_bytes(body[3:], "little")


def address_of(name):
    return register_fields(name)[0].address(0)


def test_the_words_of_a_register_of_64_bits_that_two_clients_read_stay_together():
    register, count, latched = address_of("axis.position"), itertools.count(1), [0]

    def ask(address, body):
        """Reading the low word latches the high one; each value has two equal words."""
        if word(body)[0] == register:
            latched[0] = next(count)
        return bytes([body[0], 0]) + latched[0].to_bytes(4, "little")

    arbiter = Arbiter(ask, lambda: 0.0)

    def read(client, number):
        body = request_body("read_register", number % 256, address=number)
        return parse_reply(arbiter.answer(client, 1, body)).fields["value"]

    for _ in range(2):
        low = [read(client, register) for client in "AB"]
        assert low == [read(client, register + 4) for client in "AB"]
        assert low[0] != low[1]


def test_a_low_word_that_waits_for_its_high_word_is_not_taken_for_another_register():
    start, step = (address_of(f"feedback.compare_{name}") for name in ("start", "step"))
    written, waiting = {}, [0]

    def ask(address, body):
        """A low word waits; the next high word stores both."""
        register, value = word(body)
        if register in (start, step):
            waiting[0] = value
        else:
            written[register - 4] = value << 32 | waiting[0]
        return bytes([body[0], 0])

    arbiter = Arbiter(ask, lambda: 0.0)
    for client, register, value in (
        ("A", start, 1),
        ("B", step, 2),
        ("A", start + 4, 3),
        ("B", step + 4, 4),
    ):
        body = request_body("write_register", value, address=register, value=value)
        assert arbiter.answer(client, 1, body) is not None
    assert written == {start: 3 << 32 | 1, step: 4 << 32 | 2}


def test_no_answer_is_no_reply_and_the_request_may_be_repeated():
    answers = iter([None, b"\x01\x00"])
    arbiter = Arbiter(lambda address, body: next(answers), lambda: 0.0)
    body = request_body("identify", 3)
    assert arbiter.answer("A", 1, body) is None
    assert arbiter.answer("A", 1, body) == bytes([3, 1, 0])
