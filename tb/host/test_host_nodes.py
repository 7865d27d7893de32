# SPDX-License-Identifier: Apache-2.0
"""moire.client: finding the nodes of a bus at any baud rate, and refusing another build."""

import pytest

from moire.client.bus import Bus
from moire.errors import BusError, BusGarbled, NoAnswer, PortError, Refused, WrongBuild
from moire.made.bus_tables import PROTOCOL_CRC
from moire.made.registers import MAP_CRC
from tb.fakes.bus_node import BusNode, other_protocol
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.stage import two_nodes


def test_find_lists_every_node_of_any_build():
    wire = Rs485Bus(BusNode(3, axes=2), BusNode(15, map_crc=5))
    found = Bus(wire).find()
    assert [(node.address, node.axes, node.matches) for node in found] == [
        (3, 2, True),
        (15, 1, False),
    ]
    assert wire.now() < 2, "all addresses, of which 13 are silent"
    assert Bus(wire).find([1, 2]) == []


def test_no_answer_is_a_clear_exception():
    with pytest.raises(NoAnswer, match="nobody answers at address 4, asked 5 times: check power"):
        Bus(Rs485Bus(BusNode(1))).axis(4)


@pytest.mark.parametrize(
    "made, value, words",
    [
        (lambda crc: BusNode(map_crc=crc), MAP_CRC, "register map"),
        (other_protocol, PROTOCOL_CRC, "protocol table"),
    ],
)
def test_a_node_of_another_build_is_refused_with_both_numbers(made, value, words):
    with pytest.raises(
        WrongBuild, match=f"{words}.*CRC-32 0000BEEF in the node, {value:08X} in this host"
    ) as caught:
        Bus(Rs485Bus(made(0xBEEF))).axis()
    assert (caught.value.node, caught.value.host) == (0xBEEF, value)


def test_an_axis_that_does_not_exist_is_refused():
    with pytest.raises(Refused, match="node 1 has no axis 1: it has only axis 0"):
        Bus(Rs485Bus(BusNode())).axis(1, 1)
    with pytest.raises(Refused, match="axes 0 to 1"):
        Bus(Rs485Bus(BusNode(axes=2))).axis(1, 2)


def test_a_garbled_bus_and_a_silent_bus_are_different_errors():
    wire = Rs485Bus(BusNode())
    wire.from_nodes = lambda word: [word ^ 4]
    with pytest.raises(BusGarbled, match="garbled, tried 5 times: 65 came instead of 61"):
        Bus(wire).axis()


def test_a_new_baud_rate_is_set_in_all_nodes_or_in_none():
    wire, bus = two_nodes()
    bus.set_baud(500_000, [1, 2])
    assert bus.baud_changed and wire.character_s == pytest.approx(22e-6)
    bus.first_baud()
    assert not bus.baud_changed and wire.character_s == pytest.approx(11 / 115_200)
    with pytest.raises(Refused, match="set_baud"):
        bus.set_baud(1_000_000, [1, 2])  # more than an eighth of the clock
    with pytest.raises(NoAnswer):
        bus.set_baud(500_000, [1, 3])
    assert wire.character_s == pytest.approx(11 / 115_200)


@pytest.mark.parametrize("rate", [115_200, 500_000, 9_600])
def test_nodes_at_any_usual_baud_rate_are_found_and_the_bus_keeps_that_rate(rate):
    wire, bus = two_nodes()
    for node in wire.nodes:
        node.use_baud(rate)
    found, baud = bus.find_baud([1, 2])
    assert [identity.address for identity in found] == [1, 2] and baud == rate
    assert bus.axis(2).status().homed


def test_nodes_at_a_rate_that_nobody_tries_in_time_are_back_at_the_first_one():
    wire, bus = two_nodes()
    for node in wire.nodes:
        node.use_baud(9_600)
    found, baud = bus.find_baud()  # of all addresses: longer than 5 s
    assert [identity.address for identity in found] == [1, 2] and baud == 115_200
    assert wire.now() > 5


def test_a_rate_that_the_port_cannot_do_is_skipped_but_a_missing_port_is_an_error():
    wire, bus = two_nodes()
    able, set_baud = {115_200, 9_600}, wire.set_baud
    for node in wire.nodes:
        node.use_baud(9_600)

    def choosy(baud):
        if baud not in able:
            raise PortError("the port COM7 failed")
        set_baud(baud)

    wire.set_baud = choosy
    assert bus.find_baud()[1] == 9_600
    able.clear()
    with pytest.raises(PortError, match="COM7"):
        bus.find_baud()


def test_without_a_node_the_first_rate_is_kept_and_garbled_answers_are_reported():
    wire, bus = two_nodes()
    assert bus.find_baud([5], rates=(9_600,)) == ([], 115_200) and wire.baud == 115_200
    wire.from_nodes = lambda word: [word ^ 1]
    with pytest.raises(BusGarbled):
        bus.find_baud(rates=(9_600,))


def test_find_reports_two_nodes_with_one_address_that_identify_themselves_alike():
    wire = Rs485Bus(BusNode(), BusNode())
    assert [identity.address for identity in Bus(wire).find()] == [
        1
    ]  # equal in every cycle: the two could not be distinguished
    wire.nodes[1].clk += 1_200_000  # it was powered up 0.3 s before the other
    with pytest.raises(BusGarbled, match="two nodes with the address 1"):
        Bus(wire).find()


def test_what_needs_the_bus_itself_is_refused_through_a_gateway():
    wire, bus = two_nodes()
    wire.handshake = False
    for action in (
        bus.sync,
        lambda: bus.set_baud(9600, [1]),
        bus.find_baud,
        lambda: bus.start(bus.axis(1)),
    ):
        with pytest.raises(BusError, match="the bus of the nodes itself"):
            action()
