# SPDX-License-Identifier: Apache-2.0
"""The carriers of the C driver: a UDP socket, and a serial port at a pseudo terminal."""

import ctypes
import os
import pty
import random
import socket

import pytest
from cobs import cobs

from tb.bench import seed
from tb.linuxcnc.compiled import LONGEST, Carrier, driver

PATIENCE_NS = 2_000_000_000
FORMS = "write udp:HOST:PORT, serial:DEVICE:BAUD or spi:DEVICE:HZ, with a number at the end"


@pytest.fixture
def carrier():
    found = Carrier()
    yield found
    driver().carrier_close(ctypes.byref(found))


def opened(carrier, where):
    """Opens a carrier; the reason if it cannot be opened."""
    why = driver().carrier_open(ctypes.byref(carrier), where.encode())
    return why and why.decode()


def send(carrier, packet):
    return driver().carrier_send(ctypes.byref(carrier), packet, ctypes.c_size_t(len(packet)))


def receive(carrier, patience_ns=PATIENCE_NS):
    packet = ctypes.create_string_buffer(LONGEST)
    until = ctypes.c_int64(driver().carrier_now() + patience_ns)
    length = driver().carrier_receive(ctypes.byref(carrier), packet, until)
    return packet.raw[:length]


def packets(dice):
    """Packets of all kinds of lengths and contents, those that COBS treats specially among them."""
    for length in (1, 4, 253, 254, 255, 256, 508, 509, LONGEST):
        yield bytes([7]) * length
        yield bytes(length)
        yield dice.randbytes(length)
        yield bytes(dice.choice([0, 1]) for _ in range(length))


def test_udp_brings_packets_both_ways(carrier):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as node:
        node.bind(("127.0.0.1", 0))
        node.settimeout(2)
        assert opened(carrier, f"udp:127.0.0.1:{node.getsockname()[1]}") is None
        for packet in packets(random.Random(seed())):
            assert send(carrier, packet)
            got, host = node.recvfrom(4096)
            node.sendto(packet[::-1], host)
            assert got == packet and receive(carrier) == packet[::-1]


def test_udp_takes_packets_from_its_node_only(carrier):
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as node,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        node.bind(("127.0.0.1", 0))
        opened(carrier, f"udp:127.0.0.1:{node.getsockname()[1]}")
        send(carrier, b"hello")
        host = node.recvfrom(100)[1]
        other.sendto(b"foreign", host)
        node.sendto(b"own", host)
        assert receive(carrier) == b"own"


def test_it_does_not_wait_longer_than_its_deadline(carrier):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as node:
        node.bind(("127.0.0.1", 0))
        opened(carrier, f"udp:127.0.0.1:{node.getsockname()[1]}")
        assert receive(carrier, 0) == b"" and receive(carrier, 100_000) == b""


def test_a_serial_port_carries_cobs_packets(carrier):
    master, slave = pty.openpty()
    try:
        assert opened(carrier, f"serial:{os.ttyname(slave)}:3000000") is None
        for packet in packets(random.Random(seed())):
            assert send(carrier, packet)
            got = os.read(master, 1)
            while len(got) == 1 or not got.endswith(b"\0"):
                got += os.read(master, 4096)
            assert got[:1] == b"\0" and cobs.decode(got[1:-1]) == packet
            coded = cobs.encode(packet[::-1]) + b"\0"
            os.write(master, coded[:3])
            os.write(master, coded[3:])
            assert receive(carrier) == packet[::-1]
    finally:
        os.close(master)
        os.close(slave)


def test_noise_on_a_serial_port_costs_only_the_packet_in_it(carrier):
    dice = random.Random(seed())
    master, slave = pty.openpty()
    try:
        opened(carrier, f"serial:{os.ttyname(slave)}:1000000")
        for _ in range(50):
            noise = dice.randbytes(dice.randrange(2000)) + b"\0"
            os.write(master, noise + cobs.encode(b"good") + b"\0")
            got = [receive(carrier, 0)]
            while got[-1] != b"good":
                got.append(receive(carrier))
                assert got[-1], "the packet after the noise was lost"
    finally:
        os.close(master)
        os.close(slave)


@pytest.mark.parametrize(
    "where, why",
    [
        ("tcp:localhost:5", FORMS),
        ("udp:localhost", FORMS),
        ("serial:/dev/ttyUSB1:fast", FORMS),
        ("serial:/dev/ttyUSB1:3M", FORMS),
        ("serial:/dev/ttyUSB1:", FORMS),
        ("serial:/dev/ttyUSB1:0", FORMS),
        ("udp:no.such.host.invalid:5", "the address of the node is unknown"),
        ("serial:/dev/no_such_port:115200", "the serial port cannot be opened"),
        ("serial:/dev/null:115200", "the device is no serial port"),
        ("x" * 200, "the place of the node is too long"),
    ],
)
def test_a_place_that_cannot_be_opened_is_refused_in_a_sentence(carrier, where, why):
    assert opened(carrier, where) == why and carrier.file == -1


def test_a_serial_port_of_another_program_is_refused(carrier):
    master, slave = pty.openpty()
    other = Carrier()
    try:
        assert opened(other, f"serial:{os.ttyname(slave)}:1000000") is None
        found = opened(carrier, f"serial:{os.ttyname(slave)}:1000000")
        assert found == "another program uses the serial port"
    finally:
        driver().carrier_close(ctypes.byref(other))
        os.close(master)
        os.close(slave)
