# SPDX-License-Identifier: Apache-2.0
"""moire.bus.transport: the parity of each byte, and the error for a port that does not open."""

import errno
import os
import socket
from types import SimpleNamespace

import pytest
import serial
from serial.urlhandler import protocol_socket

from moire.bus import cobs, transport
from moire.bus.protocol import ODD_ADDRESSES
from moire.bus.transport import SerialBus
from moire.client.bus import Bus
from moire.errors import PortError, UnknownName
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus


class FakePort:
    """Replaces serial.Serial: turns bytes and parity into words for a node, as the bus does."""

    def __init__(self, name="fake", mark=True, node=None, **settings):
        self.settings, self.node, self.sync = settings, node or BusNode(), mark
        self.held, self.timeout, self.words, self.answers, self.is_open = (
            "N",
            0,
            [],
            bytearray(),
            True,
        )

    @property
    def parity(self):
        return self.held

    @parity.setter
    def parity(self, value):
        if value in "MS" and not self.sync:
            raise ValueError(f"Invalid parity: {value!r}")
        self.held = value

    def write(self, data):
        for byte in data:
            ones = byte.bit_count() & 1
            ninth = {"M": 1, "S": 0, "E": ones, "O": ones ^ 1}[self.held]
            self.words.append(byte | ninth << 8)
            self.answers += bytes(self.node.port.receive(self.words[-1]))

    def flush(self):
        pass

    def reset_input_buffer(self):
        self.answers.clear()

    @property
    def in_waiting(self):
        return len(self.answers)

    def read(self, count):
        taken, self.answers = bytes(self.answers[:count]), self.answers[count:]
        return taken

    def fileno(self):
        raise OSError("no descriptor")

    def close(self):
        self.is_open = False


def serial_bus(parity="auto", **port):
    made = []

    def open_port(name, **settings):
        made.append(FakePort(name, **port, **settings))
        return made[0]

    return SerialBus("COM7", 1_000_000, parity, open_port), made[0]


@pytest.mark.parametrize(
    "mark, parity", [(True, "auto"), (True, "odd"), (False, "auto"), (False, "odd"), (True, "mark")]
)
def test_an_exchange_has_the_ninth_bit_on_command_bytes_only(mark, parity):
    bus, port = serial_bus(parity, mark=mark, node=BusNode(address=7))
    assert Bus(bus).axis(address=7).status().state == "off"
    assert [word for word in port.words if word >> 8] == [0x127, 0x117] * 3
    assert port.node.counters["frames_bad"] == 0 and port.node.counters["frames_good"] == 3
    assert port.settings["baudrate"] == 1_000_000 and port.settings["stopbits"] == 1


@pytest.mark.parametrize("mark", [True, False])
def test_every_byte_is_sent_with_the_required_ninth_bit(mark):
    bus, port = serial_bus(mark=mark)
    bus.send(range(256))
    assert port.words == list(range(256))


def test_mark_reaches_all_addresses_and_odd_parity_eight():
    bus, port = serial_bus(mark=True)
    assert all(bus.reaches(address) for address in range(1, 16))
    bus.send([0x123])
    assert port.words == [0x123]
    bus, port = serial_bus(mark=False)
    assert (
        tuple(address for address in range(1, 16) if bus.reaches(address))
        == ODD_ADDRESSES
        == (1, 2, 4, 7, 8, 11, 13, 14)
    )
    with pytest.raises(
        PortError, match="odd parity reaches only the addresses 1, 2, 4, 7, 8, 11, 13, 14"
    ):
        bus.send([0x123])
    assert port.words == []


def test_find_calls_only_addresses_that_odd_parity_reaches():
    bus, port = serial_bus(mark=False, node=BusNode(address=11))
    client = Bus(bus)
    client.FIND_ANSWER_S = 0.001
    assert [node.address for node in client.find()] == [11]
    assert {word & 15 for word in port.words if word >> 8} == set(ODD_ADDRESSES)


def test_mark_parity_that_is_requested_and_missing_is_refused():
    with pytest.raises(PortError, match="no MARK and SPACE parity: use parity odd"):
        serial_bus("mark", mark=False)
    with pytest.raises(PortError, match="allowed are auto, mark, odd"):
        serial_bus("even")


@pytest.mark.parametrize(
    "error, sentence",
    [
        (
            serial.SerialException(
                errno.ENOENT,
                "could not open port COM7: [Errno 2] No such file or directory: 'COM7'",
            ),
            "there is no port COM7",
        ),
        (FileNotFoundError(errno.ENOENT, "No such file or directory"), "there is no port COM7"),
        (
            serial.SerialException(errno.EBUSY, "could not open port"),
            "the port COM7 is in use by another program",
        ),
        (
            serial.SerialException(
                errno.EAGAIN,
                "Could not exclusively lock port COM7: [Errno 11] Resource temporarily unavailable",
            ),
            "the port COM7 is in use by another program",
        ),
        (
            serial.SerialException(
                "could not open port 'COM7': PermissionError(13, 'Access is denied.', None, 5)"
            ),
            "the port COM7 is in use by another program",
        ),
        (
            serial.SerialException(
                errno.EACCES, "could not open port COM7: [Errno 13] Permission denied: 'COM7'"
            ),
            "no permission to use the port COM7",
        ),
        (ValueError("Not a valid baudrate: -1"), "the port COM7 cannot do 1000000 baud"),
        (
            OSError(errno.EIO, "Input/output error"),
            "the port COM7 does not open: Input/output error",
        ),
    ],
)
def test_a_port_that_does_not_open_is_reported_with_the_reason_in_one_sentence(error, sentence):
    def open_port(*_, **__):
        raise error

    with pytest.raises(PortError) as caught:
        SerialBus("COM7", 1_000_000, open_port=open_port)
    assert str(caught.value).startswith(sentence) and "\n" not in str(caught.value)


def test_a_missing_device_is_reported_with_the_real_library_too():
    with pytest.raises(PortError, match="there is no port /dev/no_such_port"):
        SerialBus("/dev/no_such_port")


def test_a_port_that_disappears_is_a_port_error():
    bus, port = serial_bus()

    def gone(_):
        raise serial.SerialException("device reports readiness to read but returned no data")

    port.read = gone
    with pytest.raises(PortError, match="the port COM7 failed: device reports readiness"):
        bus.receive(1, 0.1)


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no pseudo terminals")
@pytest.mark.parametrize(
    "parity, message",
    [
        ("auto", "sends no parity bit"),
        ("odd", "sends no parity bit"),
        ("mark", "no MARK and SPACE parity"),
    ],
)
def test_a_port_that_drops_the_parity_bit_is_refused_and_not_trusted(parity, message):
    # what a pseudo terminal does
    near, far = os.openpty()
    with pytest.raises(PortError, match=message):
        SerialBus(os.ttyname(far), parity=parity)
    os.close(near)
    os.close(far)


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no pseudo terminals")
def test_a_port_in_use_is_reported_with_the_real_library_too():
    near, far = os.openpty()
    with serial.Serial(os.ttyname(far), exclusive=True):
        with pytest.raises(PortError, match="is in use by another program"):
            SerialBus(os.ttyname(far))
    os.close(near)
    os.close(far)


def test_a_connection_by_tcp_closes_without_a_pause(monkeypatch):
    clock = SimpleNamespace(sleep=lambda seconds: pytest.fail("it waits"))
    monkeypatch.setattr(protocol_socket, "time", clock)
    with socket.create_server(("127.0.0.1", 0)) as server:
        bus = transport.open_bus(f"socket://127.0.0.1:{server.getsockname()[1]}")
        other, _ = server.accept()
        with other:
            bus.close()
            assert other.recv(1) == b"", "the server sees the end"
        bus.close()


def test_a_connection_that_the_server_has_ended_closes_too():
    with socket.create_server(("127.0.0.1", 0)) as server:
        bus = transport.open_bus(f"socket://127.0.0.1:{server.getsockname()[1]}")
        other, _ = server.accept()
        bus.port.write(b"unread")
        other.close()  # with what is unread, so that the connection is reset
        with pytest.raises(serial.SerialException):
            while True:
                bus.port.read(1)
        bus.close()


@pytest.mark.parametrize("port", ["socket://127.0.0.1:70000", "socket://127.0.0.1"])
def test_a_wrong_address_of_a_tcp_port_is_refused(port):
    with pytest.raises(PortError, match="socket"):
        transport.open_bus(port)


def test_receive_ends_when_its_time_has_passed():
    bus, _ = serial_bus()
    began = bus.now()
    assert bus.receive(3, 0.03) == [] and 0.02 < bus.now() - began < 1


class Clock:
    """Replaces the module time: time passes only in sleep and read."""

    def __init__(self):
        self.now = 0.0

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


def test_an_answer_with_gaps_is_read_completely_and_its_end_is_detected(monkeypatch):
    """A USB adapter delivers its bytes every 16 ms, and all gaps together are longer than the
    answer may take.
    """
    bus, port = serial_bus()
    clock, chunks = Clock(), [bytes([n]) * 3 for n in range(5)]
    monkeypatch.setattr(transport, "time", clock)

    def read(count):
        if chunks and clock.now > 0.016 * (6 - len(chunks)):
            port.answers += chunks.pop(0)
        if not port.answers:
            clock.sleep(0.001)
        taken, port.answers = bytes(port.answers[:count]), port.answers[count:]
        return taken

    port.read = read
    assert bus.receive(100, 0.02) == [n for n in range(5) for _ in range(3)]
    assert clock.now == pytest.approx(0.016 * 5 + bus.GAP_S, abs=0.005)
    assert bus.receive(1, 0.02) == [] and clock.now == pytest.approx(
        0.016 * 5 + bus.GAP_S + 0.02, abs=0.006
    )


def test_open_bus_opens_a_simulated_machine_by_name(monkeypatch):
    opened = []

    class EntryPoint:
        @staticmethod
        def load():
            return lambda machine, seed: opened.append(machine) or Rs485Bus(BusNode())

    def entry_points(**which):
        assert which == {"group": "moire.ports", "name": "twin"}
        return [EntryPoint]

    monkeypatch.setattr("importlib.metadata.entry_points", entry_points)
    for port, machine in (("twin", "s0"), ("twin:s2", "s2"), ("twin:", "s0")):
        with transport.open_bus(port, baud=9600) as bus:
            assert bus.baud == 9600 and opened.pop() == machine
            bus.set_baud(115200)
            assert [node.address for node in Bus(bus).find()] == [1]
    with pytest.raises(UnknownName, match="no simulated machine 's9': known are s0, s0_fine"):
        transport.open_bus("twin:s9")


# ------------------------------------------------------------------ a served machine that is slow


class SlowServer:
    """A port to a server that answers a request after so long, and says its speed at once. Its
    clock goes on while nothing comes.
    """

    def __init__(self, speed, answer_s):
        self.speed, self.answer_s, self.clock = speed, answer_s, 0.0
        self.due, self.asked, self.is_old = [], 0, False

    def monotonic(self):
        return self.clock

    def write(self, data):
        (content,) = cobs.PacketReader().feed(data)
        if (said := cobs.speed_reply(content, self.speed)) is not None:
            self.asked += 1
            self.due += [] if self.is_old else [(self.clock, said)]
        else:
            self.due.append((self.clock + self.answer_s, cobs.packet(0x51, b"\1\2\3")))

    def read(self, count):
        for entry in self.due:
            if entry[0] <= self.clock:
                self.due.remove(entry)
                return entry[1]
        self.clock += 0.005
        return b""

    @property
    def in_waiting(self):
        return 0

    def reset_input_buffer(self):
        pass


@pytest.mark.parametrize(
    "speed, answer_s, is_old, comes",
    [
        (0.25, 0.35, False, True),  # of 0.1 s of the machine
        (0.25, 0.45, False, False),
        (None, 0.35, False, False),  # no simulation: the clock holds
        (4.0, 0.05, False, True),  # a fast one has no less time
        (0.25, 0.35, True, False),  # a server that does not say it
        (0.001, 9.0, False, True),  # hardly moves: at most a hundred times as long
        (0.001, 11.0, False, False),
    ],
)
def test_patience_is_that_of_a_slow_machine(monkeypatch, speed, answer_s, is_old, comes):
    server = SlowServer(speed, answer_s)
    server.is_old = is_old
    monkeypatch.setattr(transport, "time", server)
    bus = transport.CobsBus("COM7", open_port=lambda *_, **__: server)
    bus.send([0x121, 1, 2, 0x111])
    words = bus.receive(9, 0.1)
    assert bool(words) == comes and server.asked == (answer_s > 0.1)
    assert not comes or words[0] == 0x51


@pytest.mark.parametrize("address, waits", [(1, False), (2, True)])
def test_nobody_is_waited_for_where_the_server_says_that_nobody_is(monkeypatch, address, waits):
    server = SlowServer(None, 0)
    monkeypatch.setattr(transport, "time", server)
    bus = transport.CobsBus("COM7", open_port=lambda *_, **__: server)
    bus.send([0x121, 1, 2, 0x111])
    server.due = [(0, cobs.nobody(1, address))]
    assert bus.receive(9, 0.1) == [] and (server.clock > 0) == waits
