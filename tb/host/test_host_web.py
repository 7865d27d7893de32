# SPDX-License-Identifier: Apache-2.0
"""moire.web: the doors of HTTP and WebSocket, by real sockets in front of the compiled firmware."""

import contextlib
import http.client
import json
import re
import socket
import ssl
import subprocess
import sys
import threading

import pytest
from wsproto.events import Message

from moire.bus.arbiter import CLAIM_S, request
from moire.bus.gateway import Gateway, Waiting
from moire.bus.protocol import request_body
from moire.bus.recent import Recent
from moire.bus.transport import open_bus
from moire.client import remedies
from moire.client.bus import Bus
from moire.client.names import CAUSE_CODES
from moire.errors import PortError, Refused
from moire.made.bus_tables import FAULTS, PARAMETERS
from moire.web import access, app, door, openapi, stream
from moire.web.access import Meter, kept_token
from moire.web.api import OPERATIONS
from moire.web.bridge import Bridge
from moire.web.client import ServerRefused
from moire.web.door import Settings, WebDoor
from moire.web.refusals import BadRequest
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.fakes.served import HANG_S, Http, Served, homed

AXIS = "/api/nodes/1/axes/0"


@pytest.fixture(scope="module")
def shared():
    """For what leaves the axis as it was: at rest, and off once its client has left."""
    made = Served(homed(scope_words=256))
    yield made
    made.end()


@pytest.fixture
def served(request):
    made = Served(homed(), **getattr(request, "param", {}))
    yield made
    made.end()


def all_received(connection):
    """What comes until the other end closes the connection."""
    data = b""
    with contextlib.suppress(ConnectionResetError):
        while more := connection.recv(65536):
            data += more
    return data


# ------------------------------------------------------------------ the table of operations


# a node without a station refuses do_job: test_host_web_runs.py has a station
OF_A_STAGE = [one for one in OPERATIONS if one.name != "do_job"]


@pytest.mark.parametrize("operation", OF_A_STAGE, ids=[one.name for one in OF_A_STAGE])
def test_every_operation_answers_with_the_fields_that_its_description_promises(shared, operation):
    body = {"move": {"to": "0.1um"}, "home": {"method": 37}, "set_parameter": {"value": "9mm/s"}}
    body["set_parameters"] = {"velocity": "9 mm/s", "kp": 3}
    path = operation.path.format(node=1, axis=0, name="velocity")
    body["jog"] = {"by": "0.1um"}
    shared.wait_until(lambda: shared.node.state() == "off")  # the client before has been seen off
    with shared.http() as client:
        if operation.name == "give_up_scope":
            client.done("POST", f"{AXIS}/scope", {"trigger": "fault"})
        if operation.name == "scope_record":
            client.done("POST", f"{AXIS}/scope", {"take": True})
            shared.wait_until(lambda: shared.door.bridge.recordings[1, "arm_scope"].state == "full")
        if operation.name == "give_up_ticks":
            client.done("POST", f"{AXIS}/ticks", {"trigger": "bits", "of": "faults"})
        if operation.name == "ticks_record":
            client.done("POST", f"{AXIS}/ticks", {"take": True, "samples": 16})
            armed = shared.door.bridge.recordings[1, "record_ticks"]
            shared.wait_until(lambda: armed.state == "full")
        if operation.name == "hold":
            client.done("POST", f"{AXIS}/jog", body["jog"])
        values = client.done(operation.method, path, body.get(operation.name))
    assert values.keys() == operation.answer.keys()


def test_the_openapi_document_and_the_page_have_every_operation(shared):
    with shared.http() as client:
        document = client.done("GET", "/api/openapi.json")
        client.request("GET", "/api/help")
        page = client.getresponse().read().decode()
    assert document["openapi"].startswith("3.1")
    for operation in OPERATIONS:
        known = document["paths"][operation.path][operation.method.lower()]
        assert known["operationId"] == operation.name and operation.path in page
        named = {one["name"] for one in known["parameters"] if one["in"] == "path"}
        assert named == set(re.findall(r"{(\w+)}", operation.path))
        body = known.get("requestBody", {"content": openapi.content({"properties": {}})})
        given = {one["name"] for one in known["parameters"] if one["in"] == "query"} | body[
            "content"
        ]["application/json"]["schema"]["properties"].keys()
        assert given == {one.name for one in operation.given}
    assert len({one.name for one in OPERATIONS}) == len(OPERATIONS)


def test_a_stage_is_homed_moved_and_read_in_units(served):
    with served.http() as client:
        assert client.done("POST", f"{AXIS}/home", {"method": "37"})["homed"]
        end = client.done("POST", f"{AXIS}/move", {"to": "150 um"})
        assert end["state"] == "holding" and end["error_nm"] == 0 and end["duration_s"] > 0
        assert client.done("POST", f"{AXIS}/move", {"by": "-50um"})["position_nm"] == 100_000
        assert client.done("GET", f"{AXIS}/position")["position_nm"] == 100_000
        assert client.done("GET", "/api")["moved_by"]["1.0"].startswith("the HTTP client at ")
        assert client.done("PUT", f"{AXIS}/parameters/velocity", {"value": "7mm/s"})["value"] == 7
        assert served.node.parameter("velocity") == 8750


@pytest.mark.parametrize("path, body", [("move", {"to": "1 um"}), ("jog", {"by": "1 um"})])
def test_a_motion_of_an_axis_that_is_not_homed_leaves_its_drive_off(path, body):
    served = Served(BusNode())
    try:
        with served.http() as client:
            status, answer = client.ask("POST", f"{AXIS}/{path}", body)
        assert status == 409 and "refused 'move': the axis has no zero yet" in json.dumps(answer)
        assert "enable" not in served.node.executed
    finally:
        served.end()


def test_a_fault_comes_with_its_meaning_and_what_to_do(served):
    with served.http() as client:
        client.done("POST", f"{AXIS}/enable")
        served.node.axes[0].causes |= 1 << next(c for c, (n, _) in FAULTS.items() if n == "estop")
        served.wait_until(lambda: served.node.state() == "faulted")
        found = client.done("GET", f"{AXIS}?max_age=0s")
        assert found["faults"] == ["estop"] and found["to_do"] == remedies.FAULTS["estop"]
        (fault,) = client.done("GET", f"{AXIS}/faults")["faults"]
        assert fault == {
            "name": "estop",
            "words": "emergency stop",
            "first": True,
            "to_do": remedies.FAULTS["estop"],
        }
        status, values = client.ask("POST", f"{AXIS}/clear")
        assert (status, values["error"]["cause"]) == (409, "fault_persists")
        assert "emergency stop" in values["error"]["text"]
        served.node.axes[0].causes = 0
        assert client.done("POST", f"{AXIS}/clear")["faults"] == []


def test_every_fault_and_every_named_cause_has_a_remedy():
    assert remedies.FAULTS.keys() == {name for name, _ in FAULTS.values()}
    assert remedies.CAUSES.keys() <= CAUSE_CODES.keys()


WRONG = [
    ("POST", f"{AXIS}/move", {"to": "1.5"}, 400, "no_unit"),
    ("POST", f"{AXIS}/move", {"to": "1.5 volts"}, 400, "no_unit"),
    ("POST", f"{AXIS}/move", {"to": 1.5}, 400, "wrong_type"),
    ("POST", f"{AXIS}/move", {}, 400, "missing_field"),
    ("POST", f"{AXIS}/move", {"to": "1mm", "by": "1mm"}, 400, "missing_field"),
    ("POST", f"{AXIS}/move", {"too": "1mm"}, 400, "unknown_field"),
    ("POST", f"{AXIS}/move", {"to": "1mm", "wait": "perhaps"}, 400, "wrong_type"),
    ("POST", f"{AXIS}/move", {"to": "1e99 m"}, 400, "out_of_range"),
    ("POST", f"{AXIS}/move", {"to": "100 m"}, 409, "out_of_travel"),
    ("POST", f"{AXIS}/home", {"method": 99}, 400, "out_of_range"),
    ("POST", f"{AXIS}/move", b"{", 400, "no_json"),
    ("POST", f"{AXIS}/move", b"[" * 20000, 400, "no_json"),
    ("POST", f"{AXIS}/move", b"\xff\xfe\x00", 400, "no_json"),
    ("POST", f"{AXIS}/move", b"[]", 400, "no_json"),
    ("POST", f"{AXIS}/move", b" " * 40000, 413, "too_large"),
    ("PUT", f"{AXIS}/parameters/velocity", {"value": "5"}, 400, "no_unit"),
    ("PUT", f"{AXIS}/parameters/velocity", {"value": 5}, 400, "no_unit"),
    ("PUT", f"{AXIS}/parameters/velocity", {"value": None}, 400, "missing_field"),
    ("PUT", f"{AXIS}/parameters/velosity", {"value": "5mm/s"}, 404, "unknown_name"),
    ("PATCH", f"{AXIS}/parameters", {"kp": 1, "velocity": "5km"}, 400, "no_unit"),
    ("GET", f"{AXIS}?max_age=1", None, 400, "no_unit"),
    ("GET", f"{AXIS}?max_age=-1s", None, 400, "out_of_range"),
    ("GET", "/api/nodes/1/axes/5", None, 404, "no_such_axis"),
    ("GET", "/api/nodes/1/axes/x", None, 404, "no_such_path"),
    ("GET", "/api/nodes/16/axes/0", None, 400, "out_of_range"),
    ("GET", "/api/nodes/3/axes/0", None, 504, "no_answer"),
    ("GET", "/elsewhere", None, 404, "no_such_path"),
    ("POST", "/api/nodes/1/axes/5/take", None, 404, "no_such_axis"),
    ("DELETE", AXIS, None, 405, "wrong_method"),
    ("BREW", AXIS, None, 405, "wrong_method"),
]


@pytest.mark.parametrize("method, path, body, status, cause", WRONG)
def test_a_wrong_request_is_refused_with_cause_and_remedy_and_moves_nothing(
    shared, method, path, body, status, cause
):
    moves = shared.node.executed.count("move")
    with shared.http() as client:
        found, values = client.ask(method, path, body)
        assert (found, values["error"]["cause"]) == (status, cause)
        assert values["error"]["text"] and values["error"]["to_do"]
        assert client.done("GET", f"{AXIS}/position")  # the connection lives
    if cause != "out_of_travel":
        assert shared.node.executed.count("move") == moves
    assert shared.gateway.arbiter.moved_by.keys() <= {(1, 0)}


@pytest.mark.parametrize("served", [{}], indirect=True)
def test_a_node_of_another_build_is_named(served):
    served.far.nodes = (BusNode(1, map_crc=1),)
    with served.http() as client:
        status, values = client.ask("GET", AXIS)
        assert (status, values["error"]["cause"]) == (502, "wrong_build")
        assert "register map" in client.done("GET", "/api/nodes")["nodes"][0]["error"]


# ------------------------------------------------------------------ several clients


def test_a_motion_of_another_client_is_refused_with_the_name_of_the_owner(served):
    with served.http() as first, served.http() as second, open_bus(served.tcp) as port:
        first.done("POST", f"{AXIS}/move", {"to": "100 mm", "wait": False})
        status, values = second.ask("POST", f"{AXIS}/move", {"to": "0 mm"})
        owner = "the HTTP client at {}:{}".format(*first.sock.getsockname())
        assert (status, values["error"]["cause"]) == (409, "other_client")
        assert values["error"]["owner"] == owner and owner in values["error"]["text"]
        assert second.done("GET", AXIS)["moved_by"] == owner
        with pytest.raises(Refused, match="another client moves this axis"):
            Bus(port, answer_s=HANG_S).axis().begin_move("0mm")
        assert served.node.executed.count("move") == 1
        second.done("POST", f"{AXIS}/stop")
        served.wait_until(lambda: served.node.state() == "holding")


def test_the_owner_may_be_a_client_of_tcp(served):
    with open_bus(served.tcp) as port, served.stream() as client:
        axis = Bus(port, answer_s=HANG_S).axis()
        axis.enable()
        axis.begin_move("100mm")
        with pytest.raises(ServerRefused, match="other_client|another client") as refused:
            client.request("POST", f"{AXIS}/move", {"to": "0 mm"})
        assert refused.value.error["owner"] == "the COBS client at {}:{}".format(
            *port.port._socket.getsockname()
        )


def test_an_axis_is_taken_over_from_another_client(served, monkeypatch):
    monkeypatch.setattr("moire.web.handlers.REACT_S", 0)
    with served.http() as first, served.http() as second:
        first.done("POST", f"{AXIS}/move", {"to": "100 mm", "wait": False})
        taken = second.done("POST", f"{AXIS}/take")
        assert taken["state"] == "holding" and taken["ended"] == "stopped"
        status, values = first.ask("POST", f"{AXIS}/move", {"to": "100 mm"})
        assert (status, values["error"]["cause"]) == (409, "other_client")
        target = taken["position_nm"] + 1000
        end = second.done("POST", f"{AXIS}/move", {"to": f"{target} nm"})
        assert end["ended"] == "ok" and served.node.executed.count("move") == 2
        first.done("POST", f"{AXIS}/move", {"by": "1 um"})  # now it is free again


def test_a_move_may_take_the_axis_over_by_itself(served, monkeypatch):
    monkeypatch.setattr("moire.web.handlers.REACT_S", 0)
    with served.http() as first, served.http() as second:
        first.done("POST", f"{AXIS}/move", {"to": "100 mm", "wait": False})
        body = {"by": "1 um", "take": True}
        assert second.done("POST", f"{AXIS}/move", body)["ended"] == "ok"


def test_a_claim_ends_by_itself_and_hands_the_drive_over():
    gateway = Gateway(Rs485Bus(homed()))
    arbiter, node, numbers = gateway.arbiter, gateway.transport.nodes[0], iter(range(250))

    def ask(client, operation, **fields):
        body = request_body(operation, next(numbers), axis=0, **fields)
        return arbiter.answer(client, 1, body)[2]

    assert ask("A", "enable", on=1) == 0
    arbiter.claim("B", (1, 0))
    assert ask("A", "move", target=0) == CAUSE_CODES["other_client"]
    arbiter.depart("A")
    arbiter.see_off()
    assert node.state() == "holding" and arbiter.switched_on_by[1, 0] == "B"
    ends = gateway.transport.now() + CLAIM_S
    while gateway.transport.now() < ends:
        assert ask("C", "move", target=0) == CAUSE_CODES["other_client"]
        assert ask("C", "position") == 0  # the watchdog of the bus hears somebody
        gateway.transport.wait(0.1)
    assert ask("C", "move", target=0) == 0
    gateway.close()


def test_what_a_client_has_asked_for_is_not_done_once_it_has_left():
    gateway, answers = Gateway(Rs485Bus(homed())), []
    gateway.enqueue(Waiting("A", 1, request_body("enable", 1, axis=0, on=1), answers.append))
    gateway.depart("A")
    gateway.poll(0)
    assert answers == [None] and gateway.transport.nodes[0].executed == []
    gateway.close()


def test_a_second_stop_is_not_taken_for_the_first_one_repeated():
    bridge, sent = Bridge(Gateway(Rs485Bus())), []
    bridge.gateway.call_soon = sent.append
    first, other = (bridge.client(None, name) for name in ("first", "other"))
    for client in (first, *[other] * 255, first):  # 256 numbers of one counter later
        bridge.send(client, 1, request("stop", axis=0))
    bodies = [one.args[0].body for one in sent]
    assert bodies[0] != bodies[-1] and bodies[0][1:] == bodies[-1][1:]
    bridge.close()
    bridge.gateway.close()


@pytest.mark.parametrize("node", [0, 16, 999])
@pytest.mark.parametrize("path", ["stop", "disable", "enable", "take", "move"])
def test_a_node_that_cannot_be_is_refused_and_the_server_goes_on(shared, node, path):
    with shared.http() as client:
        status, values = client.ask(
            "POST", f"/api/nodes/{node}/axes/0/{path}", {"to": "1 mm"} if path == "move" else None
        )
        assert status == 400 and f"there is no address {node}" in values["error"]["text"]
        client.done("GET", f"{AXIS}?max_age=0s")


def test_connections_with_one_name_are_one_client(served):
    headers = {"Moire_Client": "bench"}
    with Http(*served.place, **headers) as first, Http(*served.place, **headers) as second:
        first.done("POST", f"{AXIS}/move", {"to": "100 mm", "wait": False})
        first.close()
        assert second.done("GET", AXIS)["moved_by"] == "the client 'bench'"
        again = second.done("POST", f"{AXIS}/move", {"to": "99 mm", "wait": False})
        assert again["state"] == "moving"


def test_a_named_client_that_asks_nothing_any_more_has_left(served, monkeypatch):
    with Http(*served.place, Moire_Client="bench") as client:
        client.done("POST", f"{AXIS}/move", {"to": "100 mm", "wait": False})
    assert served.node.state() == "moving"
    monkeypatch.setattr("moire.web.bridge.LEASE_S", 0)
    served.wait_until(lambda: served.node.state() == "off")
    assert served.node.ended() == "stopped" and served.node.axes[0].causes == 0


@pytest.mark.parametrize("name", ["", "x" * 41, "a\tb"])
def test_a_name_that_is_none_is_refused(shared, name):
    with shared.http() as client:
        status, values = client.ask("GET", AXIS, Moire_Client=name)
        assert (status, values["error"]["cause"]) == (400, "wrong_name")


def ended_http(served):
    client = served.http()
    client.begin("POST", f"{AXIS}/move", {"to": "100 mm"})
    return client.close


def ended_http_without_waiting(served):
    client = served.http()
    client.done("POST", f"{AXIS}/move", {"to": "100 mm", "wait": False})
    return client.close


def ended_named(served):
    client = Http(*served.place, Moire_Client="bench")
    client.begin("POST", f"{AXIS}/move", {"to": "100 mm"})
    return client.close


def ended_websocket(served):
    client = served.stream(axes="1.0")
    client.begin("POST", f"{AXIS}/move", {"to": "100 mm"})
    return client.close


@pytest.mark.parametrize(
    "begun", [ended_http, ended_http_without_waiting, ended_named, ended_websocket]
)
def test_a_client_that_ends_in_mid_motion_leaves_its_axis_stopped_and_off(served, begun):
    end = begun(served)
    served.wait_until(lambda: served.node.state() == "moving")
    end()
    served.wait_until(lambda: served.node.state() == "off")
    assert served.node.ended() == "stopped" and served.node.axes[0].causes == 0
    assert served.node.executed.count("stop") == 1


def test_a_drive_stays_on_as_long_as_its_client_is_there(served):
    with served.stream() as client:
        client.request("POST", f"{AXIS}/enable")
        enabled = served.far.now()
        for n in range(21):  # 2 s; the watchdog of the bus has half a second
            served.wait_until(lambda after=n * 0.1: served.far.now() - enabled >= after)
            client.request("GET", "/api")  # which asks no node
        assert served.node.state() == "holding"


def test_a_node_that_is_absent_is_asked_once_and_not_by_every_client(served):
    frames = []
    served.far.to_nodes = lambda word: frames.append(word) or [word]
    with served.http() as first, served.http() as second:
        assert first.done("GET", "/api/nodes") == second.done("GET", "/api/nodes")
    assert len([word for word in frames if word == 0x125]) == 1  # the command byte of node 5


def test_stop_is_answered_for_an_axis_that_is_off(served):
    with served.http() as client:
        assert client.done("POST", f"{AXIS}/stop")["state"] == "off"


# ------------------------------------------------------------------ replies that are shared


def test_a_reply_to_a_poll_is_shared_until_something_changes():
    recent = Recent()
    identify, status, velocity = (
        request_body(*operation, **fields)[1:]
        for operation, fields in (
            (("identify", 0), {}),
            (("status", 0), {"axis": 0}),
            (("get_parameter", 0), {"axis": 0, "parameter": PARAMETERS["velocity"].id}),
        )
    )
    for body in (identify, status, velocity):
        recent.note(1, body, bytes([body[0], 0]), 5.0)
        recent.note(2, body, bytes([body[0], 0]), 5.0)
    assert recent.find(1, status, 5.0).time == 5.0 and recent.find(1, status, 5.1) is None
    recent.note(1, request_body("move", 0, axis=0, target=0)[1:], b"\5\0", 6.0)
    assert recent.find(1, status, 0) is None and recent.find(2, status, 0)
    assert recent.find(1, identify, 0) and recent.find(1, velocity, 0)
    set_one = {"axis": 0, "parameter": PARAMETERS["velocity"].id, "value": 1}
    recent.note(1, request_body("set_parameter", 0, **set_one)[1:], b"\x09\0", 6.0)
    assert recent.find(1, velocity, 0) is None and recent.find(1, identify, 0) is None
    recent.note(2, request_body("counters", 0)[1:], None, 6.0)  # the node has gone
    assert recent.find(2, identify, 0) is None


def test_a_read_after_a_change_sees_the_change(served):
    path = f"{AXIS}?max_age=1h"
    with served.http() as client:
        for change, state in (("enable", "holding"), ("disable", "off")):
            assert client.done("GET", path)
            client.done("POST", f"{AXIS}/{change}")
            assert client.done("GET", path)["state"] == state
        polls = served.node.executed.count("status")
        client.done("GET", path)
        assert served.node.executed.count("status") == polls
        time = served.gateway.time  # the bus may be ahead of the clock: its time then rests
        served.wait_until(lambda: served.gateway.time > time)
        client.done("GET", f"{AXIS}?max_age=0s")
        assert served.node.executed.count("status") == polls + 1


def test_the_speed_of_a_simulated_machine_is_measured(monkeypatch):
    gateway, clock = Gateway(Rs485Bus(BusNode())), [100.0]
    monkeypatch.setattr("moire.bus.gateway.time.monotonic", lambda: clock[0])
    gateway.speed_since = clock[0], gateway.time
    clock[0] += 2
    gateway.time += 0.5
    gateway.measure_speed()
    assert gateway.speed == 0.25
    gateway.transport.time_is_stopped, gateway.speed = False, None
    clock[0] += 2
    gateway.measure_speed()
    assert gateway.speed is None
    gateway.close()


# ------------------------------------------------------------------ the stream


def test_a_stream_has_new_samples_of_the_axes_that_were_asked_for(served):
    with served.stream(axes="1.0", every="2ms", only="position") as client:
        times = [client.samples()["samples"][0]["time_s"] for _ in range(20)]
        assert all(after - before >= 0.0019 for before, after in zip(times, times[1:]))
        client.send({"id": "now", "stream": {"axes": "1.0,1.0"}})
        while "state" not in (row := client.samples()["samples"][0]):
            pass
        assert row["state"] == "off" and row["address"] == 1
        client.send({"stream": {"axes": "4.0"}})
        while "error" not in (row := client.samples()["samples"][0]):
            pass
        assert row["error"]["cause"] == "no_answer"


def test_a_client_that_takes_no_samples_loses_them_and_delays_nobody(served, monkeypatch):
    monkeypatch.setattr(stream, "WAITING_SAMPLES", 3)
    release = threading.Event()
    slow = stream.Session.write

    async def write(session):
        while not release.is_set():
            await stream.asyncio.sleep(0.001)
        await slow(session)

    monkeypatch.setattr(stream.Session, "write", write)
    with served.stream(axes="1.0", only="position") as client, served.http() as other:
        polls = lambda: served.node.executed.count("position")
        served.wait_until(lambda: polls() > 20)
        assert other.done("GET", f"{AXIS}?max_age=0s")["state"] == "off"
        release.set()
        assert [client.samples()["lost"] for _ in range(3)] == [0, 0, 0]
        while not (lost := client.samples()["lost"]):
            pass
        assert lost >= 10


def test_requests_over_a_websocket_are_answered_by_their_numbers(served):
    with served.stream() as client:
        move = client.begin("POST", f"{AXIS}/move", {"to": "100 mm"})
        served.wait_until(lambda: served.node.state() == "moving")
        assert client.request("POST", f"{AXIS}/stop")["address"] == 1
        with pytest.raises(ServerRefused) as refused:
            client.answer_to(move)
        assert refused.value.cause == "stopped" and refused.value.status == 409


@pytest.mark.parametrize(
    "message, cause",
    [
        ("nonsense", "no_json"),
        ('{"id": 1}', "missing_field"),
        ('{"id": [], "method": "GET", "path": 5}', "missing_field"),
        ('{"method": "GET", "path": "/api", "body": 5}', "wrong_type"),
        ('{"method": "GET", "path": "/nowhere"}', "no_such_path"),
        ('{"stream": 5}', "wrong_type"),
        ('{"stream": {"axes": "1"}}', "wrong_type"),
        ('{"stream": {"axes": "1.0", "every": "5"}}', "no_unit"),
        ('{"stream": {"only": "all"}}', "wrong_type"),
    ],
)
def test_a_wrong_message_is_refused_with_its_cause(shared, message, cause):
    with shared.stream() as client:
        client.put(Message(data=message))
        found = client.receive()
        assert found["error"]["cause"] == cause and found["status"] in (400, 404)
        assert client.request("GET", "/api")["version"]


def test_a_wish_in_the_address_that_is_wrong_is_refused_before_the_websocket_opens(shared):
    with pytest.raises(ServerRefused) as refused:
        shared.stream(axes="one")
    assert (refused.value.status, refused.value.cause) == (400, "wrong_type")


# ------------------------------------------------------------------ who may ask


def test_another_site_and_another_name_of_this_computer_are_refused(shared):
    host, port = shared.place
    own = f"{host}:{port}"
    with shared.http() as client:
        assert client.ask("GET", "/api", Origin=f"http://{own}")[0] == 200
        for headers, cause in (
            ({"Origin": "https://evil.example"}, "wrong_origin"),
            ({"Origin": "null"}, "wrong_origin"),
            ({"Origin": f"http://localhost:{port + 1}"}, "wrong_origin"),
            ({"Host": "evil.example"}, "wrong_host"),
        ):
            status, values = client.ask("POST", f"{AXIS}/stop", **headers)
            assert (status, values["error"]["cause"]) == (403, cause)


def test_only_those_with_the_token_may_ask(tmp_path):
    files = {"token": tmp_path / "token", "read_token": tmp_path / "reads"}
    served = Served(homed(), **files)
    tokens = {name: path.read_text().strip() for name, path in files.items()}
    assert served.door.made == {files[name]: tokens[name] for name in files}
    assert all(path.stat().st_mode & 0o777 == 0o600 for path in files.values())
    try:
        with served.http() as client:
            for given, status, cause in (
                (None, 401, "no_token"),
                ("Bearer wrong", 401, "wrong_token"),
                (f"Basic {tokens['token']}", 401, "no_token"),
                (f"Bearer {tokens['read_token']}", 403, "read_only"),
                (f"bearer {tokens['token']}", 200, None),
            ):
                headers = {"Authorization": given} if given else {}
                found, values = client.ask("POST", f"{AXIS}/stop", **headers)
                assert (found, values.get("error", {}).get("cause")) == (status, cause)
            reads = {"Authorization": f"Bearer {tokens['read_token']}"}
            assert client.ask("GET", AXIS, **reads)[0] == 200
        with pytest.raises(ServerRefused, match="needs a token"):
            served.stream()
        with served.stream(token=tokens["read_token"]) as client:
            assert client.request("GET", "/api")["version"]
            with pytest.raises(ServerRefused, match="only reads"):
                client.request("POST", f"{AXIS}/stop")
    finally:
        served.end()
    gateway = Gateway(Rs485Bus(BusNode()))
    again = WebDoor(gateway, Settings(**files))
    assert again.made == {}  # a token is shown once
    again.close()
    gateway.close()


def test_another_address_than_the_loopback_one_has_a_token(tmp_path, monkeypatch):
    monkeypatch.setattr(door.Path, "home", lambda: tmp_path)
    gateway = Gateway(Rs485Bus(BusNode()))
    opened = WebDoor(gateway, Settings(host="0.0.0.0"))
    (path,) = opened.made
    assert path == tmp_path / ".config/moire/token" and opened.access.token
    opened.close()
    gateway.close()


@pytest.mark.parametrize(
    "content, mode, words",
    [("x" * 40, 0o644, "chmod 600"), ("short", 0o600, "holds no token"), (None, 0, "cannot be")],
)
def test_a_token_that_others_may_read_or_that_is_none_is_not_used(tmp_path, content, mode, words):
    path = tmp_path / "token"
    if content is None:
        path.mkdir(0o700)
    else:
        path.write_text(content)
        path.chmod(mode)
    with pytest.raises(PortError, match=words):
        kept_token(path)


@pytest.mark.parametrize(
    "settings, words",
    [
        ({"port": 99999}, "the HTTP port 99999 at 127.0.0.1 does not open"),
        ({"host": "no.such.host.invalid", "token": "token"}, "does not open"),
        ({"certificate": "none.pem"}, "TLS needs two files"),
        ({"certificate": "none.pem", "key": "none.pem"}, "TLS does not begin with none.pem"),
        ({"read_token": "reads"}, "needs the other one too"),
    ],
)
def test_settings_that_cannot_be_are_one_sentence(tmp_path, monkeypatch, settings, words):
    monkeypatch.chdir(tmp_path)
    paths = {
        name: value if name in ("host", "port") else door.Path(value)
        for name, value in settings.items()
    }
    gateway = Gateway(Rs485Bus(BusNode()))
    with pytest.raises(PortError, match=words):
        WebDoor(gateway, Settings(**paths))
    gateway.close()


def test_tls_by_certificate_files(tmp_path):
    certificate, key = tmp_path / "certificate.pem", tmp_path / "key.pem"
    command = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2"
    names = ["-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1"]
    files = ["-keyout", str(key), "-out", str(certificate)]
    made = subprocess.run([*command.split(), *names, *files], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    served = Served(homed(), certificate=certificate, key=key)
    try:
        assert served.door.url.startswith("https://")
        trusted = ssl.create_default_context(cafile=str(certificate))
        client = http.client.HTTPSConnection(*served.place, timeout=HANG_S, context=trusted)
        client.request("GET", AXIS)
        assert json.loads(client.getresponse().read())["state"] == "off"
        client.close()
        with served.raw(b"GET / HTTP/1.1\r\n\r\n") as plain:
            assert b"200" not in all_received(plain)
    finally:
        served.end()


# ------------------------------------------------------------------ clients that are wrong


HEAD = b"POST /api/nodes/1/axes/0/move HTTP/1.1\r\nHost: 127.0.0.1\r\n"


@pytest.mark.parametrize(
    "sent, answer",
    [
        (b"nonsense\r\n\r\n", b" 400 "),
        (b"\x16\x03\x01\x02\x00\x01", b""),  # TLS where there is none
        (b"GET /" + b"a" * 1_000_000 + b" HTTP/1.1\r\n\r\n", b" 400 "),
        (HEAD + b"X: " + b"a" * 1_000_000 + b"\r\n\r\n", b" 400 "),
        (HEAD + b"Content-Length: -1\r\n\r\n", b" 400 "),
        (HEAD + b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n", b" 400 "),
        (HEAD + b"Upgrade: websocket\r\nConnection: upgrade\r\n\r\n", b" 400 "),
        (b"GET /api/stream HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: upgrade\r\n"
         b"Sec-WebSocket-Version: 5\r\n\r\n", b" 4"),
    ],
)  # fmt: skip
def test_what_is_no_http_ends_its_own_connection_only(shared, monkeypatch, sent, answer):
    monkeypatch.setattr(door, "REQUEST_S", 0.05)
    with shared.http() as other, shared.raw(sent) as client:
        received = all_received(client)
        assert answer in received and (not answer or b'"to_do":' in received)
        assert other.done("GET", AXIS)["state"] == "off"


@pytest.mark.parametrize("sent", [b"", b"GET /api HT", HEAD])
def test_a_connection_that_sends_half_a_request_is_closed(shared, monkeypatch, sent):
    monkeypatch.setattr(door, "REQUEST_S", 0.05)
    with shared.raw(sent) as client:
        assert all_received(client) == b""


def test_a_body_that_does_not_arrive_is_refused(shared, monkeypatch):
    monkeypatch.setattr(app, "BODY_S", 0.05)
    with shared.raw(HEAD + b"Content-Length: 10\r\n\r\n{") as client:
        assert b" 408 " in client.recv(4096)


def test_a_second_request_before_the_first_answer_ends_the_connection(served):
    body = b'{"to": "100 mm"}'
    length = b"Content-Length: %d\r\n\r\n" % len(body)
    with served.raw(HEAD + length + body) as client:
        served.wait_until(lambda: served.node.state() == "moving")
        client.sendall(b"GET /api HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert all_received(client) == b""
    served.wait_until(lambda: served.node.state() == "off")


def test_the_operating_system_watches_every_connection():
    with socket.socket() as made:
        door.watch(made)
        found = {
            name: made.getsockopt(socket.IPPROTO_TCP, getattr(socket, name))
            for name in (*door.KEEPALIVE, "TCP_USER_TIMEOUT")
        }
        assert found == {**door.KEEPALIVE, "TCP_USER_TIMEOUT": door.UNTAKEN_MS}
        assert made.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)


def test_there_are_only_so_many_connections(served, monkeypatch):
    monkeypatch.setattr(door, "MOST_CONNECTIONS", 2)
    with served.http() as first:
        first.done("GET", "/api")
        with served.http() as second:
            second.done("GET", "/api")
            with served.raw(b"GET /api HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n") as third:
                assert all_received(third) == b""
            assert first.done("GET", "/api")


def test_a_websocket_counts_until_it_has_ended(served, monkeypatch):
    monkeypatch.setattr(door, "MOST_CONNECTIONS", 2)
    hosts = lambda: served.door.crowd.hosts.total()
    for _ in range(3):
        with served.stream() as one, served.stream() as other:
            assert one.request("GET", "/api") and other.request("GET", "/api") and hosts() == 2
            with served.raw(b"GET /api HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n") as third:
                assert all_received(third) == b""
        served.wait_until(lambda: hosts() == 0)
    with served.http() as client:
        client.done("GET", "/api")


def test_one_host_of_the_network_gets_only_a_part_of_the_connections():
    crowd = door.Crowd(None)
    crowd.hosts.update({"10.0.0.9": door.MOST_OF_ONE_HOST, "127.0.0.1": door.MOST_OF_ONE_HOST})
    assert crowd.is_full_for("10.0.0.9")
    assert not crowd.is_full_for("10.0.0.8") and not crowd.is_full_for("127.0.0.1")


def test_requests_beyond_the_rate_are_refused(monkeypatch):
    clock = [7.0]
    monkeypatch.setattr(access.time, "monotonic", lambda: clock[0])
    meter = Meter()
    for _ in range(int(access.BURST)):
        meter.count()
    with pytest.raises(BadRequest) as refused:
        meter.count()
    assert refused.value.status == 429 and refused.value.cause == "too_many_requests"
    clock[0] += 2 / access.REQUESTS_PER_S
    meter.count()


def test_a_client_has_only_so_many_requests_in_progress_but_may_always_stop(served, monkeypatch):
    monkeypatch.setattr("moire.web.answers.MOST_AT_ONCE", 1)
    with served.stream() as client:
        client.begin("POST", f"{AXIS}/move", {"to": "100 mm"})
        served.wait_until(lambda: served.node.state() == "moving")
        with pytest.raises(ServerRefused) as refused:
            client.request("GET", AXIS)
        assert refused.value.cause == "too_many_requests"
        client.request("POST", f"{AXIS}/stop")


def test_a_message_that_is_too_long_ends_its_websocket(shared):
    with shared.stream() as client:
        with pytest.raises(PortError, match="ended the connection"):
            client.send({"path": "x" * door.LONGEST_MESSAGE})
            client.receive()


def test_a_defect_of_the_server_is_an_answer_too(shared, monkeypatch, capfd):
    def broken(*_):
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr("moire.web.handlers.node_values", broken)
    with shared.http() as client:
        status, values = client.ask("GET", "/api/nodes/1")
        assert (status, values["error"]["cause"]) == (500, "internal")
    with shared.stream() as client, pytest.raises(ServerRefused, match="a defect"):
        client.request("GET", "/api/nodes/1")
    assert "on purpose" in capfd.readouterr().err


def test_the_end_of_the_server_ends_what_is_in_progress(served):
    with served.http() as client:
        client.begin("POST", f"{AXIS}/move", {"to": "100 mm"})
        served.wait_until(lambda: served.node.state() == "moving")
        served.end()
        status, values = client.end()
        assert (status, values["error"]["cause"]) == (503, "port_failed")


def test_no_other_command_loads_the_server():
    program = (
        "import sys; from moire.cli import command_line; "
        "print([name for name in ('moire.web', 'starlette', 'uvicorn', 'asyncio') "
        "if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr
