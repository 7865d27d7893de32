# SPDX-License-Identifier: Apache-2.0
"""moire.bus.gateway and its clients: pyserial and our own transports, against the
compiled firmware behind real sockets and pseudo terminals.
"""

import contextlib
import io
import json
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import pytest
import serial
import serial.rfc2217

from moire.bus import cobs
from moire.bus.gateway import Gateway, PacketClient
from moire.bus.protocol import frame, request_body
from moire.bus.transport import CobsBus, SerialBus, open_bus
from moire.cli import command_line
from moire.client.bus import Bus
from moire.errors import BusGarbled, MoireError, NoAnswer, PortError
from moire.made.registers import MAP_CRC
from tb.bench import seed
from tb.fakes.bus_node import START, BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.fakes.served import HANG_S, ServedBus
from tb.fakes.served import homed as homed_node
from tools import obey_signals

pytestmark = pytest.mark.filterwarnings(
    "ignore:set(Daemon|Name).. is deprecated:DeprecationWarning"
)  # in pyserial
SEED = seed()


class Served(ServedBus):
    """A gateway in a thread, with all three entrances open."""

    def __init__(self, *nodes):
        super().__init__(*(nodes or [BusNode()]))
        host = "127.0.0.1"
        self.ports = {
            "rfc2217": f"rfc2217://{host}:{self.gateway.open_rfc2217(host, 0)}",
            "tcp": f"socket://{host}:{self.gateway.open_tcp(host, 0)}",
            "terminal": self.gateway.open_pty(),
        }
        self.begin()


@pytest.fixture
def served(request):
    made = Served(*getattr(request, "param", ()))
    yield made
    made.end()


@pytest.fixture
def homed():
    """A gateway to a node whose axis has its zero."""
    made = Served(homed_node())
    yield made
    made.end()


def opened(served, entrance, parity="auto"):
    return open_bus(served.ports[entrance], parity=parity)


def patient(port):
    """A bus that waits for its answers as long as a busy computer may need."""
    return Bus(port, answer_s=HANG_S)


ENTRANCES = [
    ("rfc2217", "mark"),
    ("rfc2217", "odd"),
    ("rfc2217", "none"),
    ("tcp", "auto"),
    ("terminal", "auto"),
]


# ------------------------------------------------------------------ every entrance


@pytest.mark.parametrize("entrance, parity", ENTRANCES)
def test_the_same_work_is_done_through_every_entrance(served, entrance, parity):
    node = served.far.nodes[0]
    with opened(served, entrance, parity) as port:
        axis = patient(port).axis()
        axis.enable()
        assert axis.status().state == "holding"
        assert axis.set_parameter("velocity", "7mm/s").counts == 8750
        assert (
            node.executed.count("enable") == 1
            and node.axes[0].enabled
            and node.parameter("velocity") == 8750
        )
        # before the client leaves, since the gateway then speaks to the node in its own thread
        assert node.counters["frames_bad"] == 0


def test_auto_uses_nine_bits_over_rfc2217_and_packets_elsewhere(served):
    kinds = []
    for entrance in served.ports:
        with opened(served, entrance) as port:
            kinds.append(type(port))
    assert kinds == [SerialBus, CobsBus, CobsBus]


def test_every_byte_arrives_with_the_ninth_bit_it_was_sent_with(served):
    words = []
    served.far.to_nodes = lambda word: words.append(word) or []
    source = random.Random(SEED)
    sent = [source.randrange(512) for _ in range(60)] + [0xFF, 0x1FF, 0xF0, 0x1FA]
    with opened(served, "rfc2217", "mark") as port:
        port.send(sent)
        served.wait_until(lambda: len(words) == len(sent))
    assert words == sent


def test_a_change_of_parity_over_rfc2217_waits_for_nothing(served, monkeypatch):
    """The setter of pyserial would sleep until the other end has agreed."""

    def sleep(seconds):
        raise AssertionError(f"slept {seconds} s")

    with opened(served, "rfc2217", "mark") as port:
        axis = patient(port).axis()
        with monkeypatch.context() as patch:
            patch.setattr(serial.rfc2217, "time", SimpleNamespace(time=time.time, sleep=sleep))
            for _ in range(20):  # four changes each
                axis.status()
            with pytest.raises(AssertionError, match="slept"):
                port.port.parity = serial.PARITY_ODD


def test_the_stock_client_alone_reads_a_position_in_8n1(served):
    with serial.serial_for_url(served.ports["rfc2217"], timeout=1) as port:
        reader, contents = cobs.PacketReader(), []
        port.write(cobs.packet(0x21, request_body("status", 9, axis=0)))
        while not contents:
            contents = reader.feed(port.read(1))
        body = cobs.body_of(contents[0])
        assert (
            contents[0][0] == 0x51
            and body[:3] == bytes([9, 2, 0])
            and int.from_bytes(body[11:19], "little") == START
        )


@pytest.mark.parametrize("served", [(BusNode(1), BusNode(6), BusNode(15))], indirect=True)
def test_find_sees_all_nodes_through_packets(served, monkeypatch):
    with opened(served, "tcp") as port:
        assert Bus(port).find([2]) == []
        monkeypatch.setattr(Bus, "FIND_ANSWER_S", HANG_S)
        assert [node.address for node in patient(port).find([1, 6, 15])] == [1, 6, 15]


def test_clients_at_three_entrances_do_not_disturb_each_other(served):
    with contextlib.ExitStack() as stack:
        axes = [
            patient(stack.enter_context(opened(served, entrance, parity))).axis()
            for entrance, parity in (("rfc2217", "mark"), ("tcp", "auto"), ("terminal", "auto"))
        ]
        failures = []

        def work(axis):
            try:
                for _ in range(15):
                    axis.status()
            except MoireError as error:
                failures.append(error)

        threads = [threading.Thread(target=work, args=[axis]) for axis in axes]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert not failures


def test_noise_at_a_packet_entrance_is_dropped_and_the_next_request_answered(served):
    source = random.Random(SEED)
    with opened(served, "tcp") as port:
        axis = patient(port).axis()
        for _ in range(20):
            port.port.write(source.randbytes(50))
        right = bytes([0x21]) + b"\x03\x01\x02\x00\x00\x00\x00\x00"
        port.port.write(cobs.sealed(right))  # a packet with a wrong CRC-32
        assert axis.status().state == "off"
        assert served.far.nodes[0].counters["frames_bad"] == 0
    assert served.gateway.refused >= 1


def test_a_reply_that_comes_too_late_is_not_taken_for_the_next(served):
    with opened(served, "tcp") as port:
        bus = patient(port)
        bus.node()
        port.port.write(cobs.packet(0x21, request_body("counters", 200)))
        assert bus.request(1, "read_register", address=0) == {"value": MAP_CRC}
        assert bus.request(1, "read_register", address=0) == {"value": MAP_CRC}


def test_a_slow_answer_is_awaited_without_a_request_of_another_client_in_between():
    far = Rs485Bus(BusNode())
    gateway, node = Gateway(far), far.nodes[0]
    gateway.sequences = [0] * 16  # with which no byte of a reply is the ready byte, 0x61
    assert gateway.arbiter.answer("A", 1, request_body("identify", 1))
    ready_at = far.now() + 0.125  # the node is planning; its hardware acknowledges requests
    far.from_nodes = lambda word: [word] if word == 0x61 or far.now() >= ready_at else []
    assert gateway.arbiter.answer("A", 1, request_body("enable", 2, axis=0, on=1))
    assert node.executed == ["identify", "enable"] and node.counters["repeated"] >= 1
    gateway.close()


@pytest.mark.parametrize(
    "knows_server, operation, fields, told",
    [
        (True, "identify", {}, [5]),
        (False, "identify", {}, []),  # a client that may not know this message
        (True, "status", {"axis": 0}, []),  # the node may be busy
    ],
)
def test_a_client_that_looks_for_nodes_learns_where_nobody_is(
    knows_server, operation, fields, told
):
    gateway, sent = Gateway(Rs485Bus(BusNode())), []
    stream = SimpleNamespace(write=lambda data: sent.append(data) or True)
    client = PacketClient(gateway, stream)
    if knows_server:
        client.take(cobs.speed_request(1))
        sent.clear()
    client.take(cobs.packet(0x25, request_body(operation, 9, **fields)))
    gateway.serve_next()
    found = [content for data in sent for content in cobs.PacketReader().feed(data)]
    assert [cobs.nobody_at(content) for content in found] == told
    gateway.close()


def test_a_node_that_is_absent_delays_the_others_by_one_attempt_only():
    far = Rs485Bus(BusNode())
    gateway = Gateway(far)
    identify = request_body("identify", 0)[1:]
    assert gateway.ask(9, identify) is None and far.now() < 0.1
    assert gateway.ask(1, identify)
    far.from_nodes = lambda word: []
    assert gateway.ask(1, identify) is None
    absent_at = far.now()
    assert gateway.ask(1, identify) is None and far.now() < absent_at + 0.1
    gateway.close()


def test_no_answer_is_reported_through_packets_too(served):
    with opened(served, "tcp") as port:
        with pytest.raises(
            NoAnswer,
            match="nobody answers at address 5, asked 2 times: check power, wiring, baud rate",
        ):
            Bus(port, tries=2).node(5)


@pytest.mark.parametrize("entrance, parity", [("tcp", "auto"), ("rfc2217", "none")])
def test_status_says_how_fast_a_simulated_machine_runs(served, entrance, parity, monkeypatch):
    monkeypatch.setattr(served.gateway, "measure_speed", lambda: None)
    out = io.StringIO()
    for speed, words in (
        (None, None),
        (0.3256, "0.33 simulated seconds per second"),
        (1e9, "4294967.29 simulated"),
    ):
        served.gateway.speed = speed
        call = ["--port", served.ports[entrance], "--parity", parity, "status"]
        assert command_line.main([*call, "--patience", f"{HANG_S}s"], None, out, out) == 0
        assert words is None and "simulated" not in out.getvalue() or words in out.getvalue()
    assert served.gateway.refused == 0


def test_a_server_that_is_too_old_to_say_its_speed_is_no_error(served, monkeypatch):
    monkeypatch.setattr("moire.bus.gateway.speed_reply", lambda *_: None)
    with opened(served, "tcp") as port:
        assert port.speed() is None
        assert patient(port).axis().status().state == "off"


def test_a_client_that_disconnects_is_forgotten(served):
    for _ in range(3):
        with opened(served, "tcp") as port:
            patient(port).node()
    served.wait_until(lambda: len(served.gateway.clients) == 1)  # the terminal stays


@pytest.mark.parametrize("signal_name", ["SIGTERM", "SIGHUP", "SIGINT", "SIGKILL"])
def test_a_process_that_is_ended_leaves_its_axis_stopped_and_off(signal_name, homed):
    node = homed.far.nodes[0]
    with started(homed, "move", "100mm") as process:
        homed.wait_until(lambda: node.state() == "moving")
        process.send_signal(getattr(signal, signal_name))
        _, err = process.communicate(timeout=HANG_S)
    homed.wait_until(lambda: node.state() == "off")
    assert node.ended() == "stopped" and node.axes[0].causes == 0
    number = getattr(signal, signal_name)
    if number == signal.SIGKILL:
        assert process.returncode == -number
    else:
        words = "interrupted" if number == signal.SIGINT else f"ended by {signal_name}"
        assert process.returncode == 128 + number
        assert err == f"moire: {words}; what moved was stopped under control\n"


def test_a_process_leaves_a_drive_on_that_another_one_has_switched_on(homed):
    node = homed.far.nodes[0]
    with opened(homed, "tcp") as port:
        axis = patient(port).axis()
        axis.enable()
        with started(homed, "move", "1um") as process:
            while process.poll() is None:
                axis.status()  # its watchdog hears a host that lives
            _, err = process.communicate(timeout=HANG_S)
        assert process.returncode == 0, err
        assert axis.status().state == "holding" and node.written("enable") == [{"axis": 0, "on": 1}]


def test_a_command_takes_an_axis_over_that_another_client_moves(homed):
    node = homed.far.nodes[0]
    with opened(homed, "tcp") as port:
        axis = patient(port).axis()
        axis.enable()
        axis.begin_move("100mm")
        assert "another client moves this axis" in complaint(
            f"--port {homed.ports['tcp']} move 0mm", 1
        )
        call = f"--port {homed.ports['tcp']} --patience {HANG_S}s move 1um --by --take"
        out = io.StringIO()
        assert command_line.main(call.split(), None, out, out) == 0, out.getvalue()
        assert node.executed.count("move") == 2 and node.executed.count("stop") == 1


def test_stopping_goes_ahead_of_all_requests_that_wait():
    far = Rs485Bus(BusNode())
    gateway, answers = Gateway(far), []
    clients = [PacketClient(gateway, SimpleNamespace()) for _ in range(5)]
    for number, client in enumerate(clients):
        client.send = answers.append
        last = number == len(clients) - 1
        body = request_body(*("stop" if last else "position", number), axis=0)
        gateway.take_packet(client, bytes([0x21]) + frame(0x21, body))
    gateway.serve_next()
    assert far.nodes[0].executed == ["stop"]
    gateway.serve_next()  # the polls are one
    assert far.nodes[0].executed == ["stop", "position"] and not gateway.waiting
    assert len(answers) == 5
    bodies = [cobs.body_of(cobs.PacketReader().feed(answer)[0]) for answer in answers]
    assert [body[0] for body in bodies] == [4, 0, 1, 2, 3]
    gateway.close()


# ------------------------------------------------------------------ errors


@contextlib.contextmanager
def started(served, *words):
    """A process of `moire` at the TCP entrance."""
    command = [sys.executable, "-m", "moire", "--port", served.ports["tcp"]]
    with subprocess.Popen(
        [*command, "--patience", f"{HANG_S}s", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=obey_signals,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def complaint(text, code):
    out, err = io.StringIO(), io.StringIO()
    words = [*text.split(), "--patience", f"{HANG_S}s"]
    assert command_line.main(words, None, out, err) == code, err.getvalue()
    assert err.getvalue().count("\n") == 1 and err.getvalue().startswith("moire: ")
    return err.getvalue()


def test_a_server_that_is_not_there_is_one_sentence():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        free = taken.getsockname()[1]
    for scheme in ("rfc2217", "socket"):
        assert f"nobody listens at {scheme}://127.0.0.1:{free}" in complaint(
            f"--port {scheme}://127.0.0.1:{free} find", 4
        )


def test_a_tcp_port_in_use_is_one_sentence():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        number = taken.getsockname()[1]
        with pytest.raises(
            PortError,
            match=f"the TCP port {number} at 127.0.0.1 does not open: .*already in use; choose",
        ):
            Gateway(Rs485Bus(BusNode())).open_tcp("127.0.0.1", number)


def test_a_pseudo_terminal_in_use_is_one_sentence(served):
    with opened(served, "terminal"):
        assert "is in use by another program" in complaint(
            f"--port {served.ports['terminal']} find", 4
        )


def test_no_permission_is_one_sentence(tmp_path, monkeypatch):
    def refused(*_, **__):
        raise serial.SerialException(
            13, "could not open port /dev/ttyUSB0: [Errno 13] Permission denied: '/dev/ttyUSB0'"
        )

    monkeypatch.setattr(serial, "serial_for_url", refused)
    assert (
        "no permission to use the port /dev/ttyUSB0: on Linux, join the group dialout"
        in complaint("--port /dev/ttyUSB0 find", 4)
    )


@pytest.mark.parametrize("entrance", ["rfc2217", "tcp", "terminal"])
def test_a_port_unplugged_during_a_move_is_one_sentence_that_names_the_watchdog(entrance):
    served = Served(homed_node())
    node = served.far.nodes[0]
    threading.Thread(
        target=lambda: (served.wait_until(lambda: "move" in node.executed), served.end())
    ).start()
    message = complaint(f"--port {served.ports[entrance]} move 100mm", 4)
    assert (
        served.ports[entrance] in message
        and "axis 0 of node 1 could not be stopped by the host, its watchdog has to" in message
    )


@pytest.mark.parametrize("served", [(BusNode(1, map_crc=1),)], indirect=True)
def test_a_node_of_another_build_is_one_sentence(served):
    message = complaint(f"--port {served.ports['tcp']} status", 5)
    assert (
        "node 1 was made from another register map" in message
        and "build both from the same sources" in message
    )


@pytest.mark.parametrize("served", [(BusNode(1), BusNode(1))], indirect=True)
def test_two_nodes_with_one_address_are_one_sentence(served):
    served.far.nodes[1].axes[0].machine += 999
    with opened(served, "rfc2217", "mark") as port:
        with pytest.raises(
            BusGarbled, match="wrong CRC-32; as from noise, .* or two nodes with the address 1"
        ):
            patient(port).axis().status()


def fake_twin(baud, machine, seed, nodes=(1, 2)):
    bus = Rs485Bus(*map(BusNode, nodes))
    bus.addresses = nodes
    return bus


def test_ctrl_c_ends_a_served_twin_without_an_error(monkeypatch):
    monkeypatch.setattr("moire.cli.commands.twin.open_twin", fake_twin)

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(Gateway, "follow_clock", interrupt)
    err = io.StringIO()
    assert (
        command_line.main("twin --http 0 --rfc2217 0 --tcp 0".split(), None, io.StringIO(), err)
        == 0
        and err.getvalue() == ""
    )


def test_the_ports_are_printed_as_json(monkeypatch, tmp_path):
    monkeypatch.setattr("moire.cli.commands.twin.open_twin", fake_twin)
    out, link = io.StringIO(), tmp_path / "link"
    arguments = [
        "twin",
        "--nodes",
        "3",
        "4",
        "--http",
        "0",
        "--rfc2217",
        "0",
        "--tcp",
        "0",
        "--link",
        str(link),
        "--for",
        "50ms",
        "--json",
    ]
    assert command_line.main(arguments, None, out, io.StringIO()) == 0
    reported = json.loads(out.getvalue())
    assert (
        reported["machine"] == "s0"
        and reported["nodes"] == [3, 4]
        and reported["rfc2217"].startswith("rfc2217://127.0.0.1:")
        and reported["http"].startswith("http://127.0.0.1:")
        and not link.exists()
    )
