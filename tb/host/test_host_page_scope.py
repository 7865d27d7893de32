# SPDX-License-Identifier: Apache-2.0
"""What the page needs of the server to measure: records of the scope with one owner at a time, sine
and cosine with their ellipse, and what the server has met on the bus.
"""

import itertools
import math
from contextlib import closing

import pytest

from moire.analysis import spectrum
from moire.analysis.scope import Scope
from moire.bus.transport import open_bus
from moire.client.bus import Bus
from moire.web import lissajous
from moire.web.client import ServerRefused
from moire.web.recording import POLL_S
from tb.fakes.served import Served, homed
from twin.compiled.tables import DEFINES

AXIS = "/api/nodes/1/axes/0"
NEVER = {"trigger": "fault"}


@pytest.fixture(scope="module")
def shared():
    """For tests that leave a server which works."""
    made = Served(homed())
    yield made
    made.end()


@pytest.fixture
def served(shared):
    """The drive is off, and no client has asked for anything."""
    (node,) = shared.far.nodes
    shared.wait_until(lambda: node.state() == "off")
    shared.door.bridge.recordings.clear()
    shared.gateway.arbiter.recorder_of.clear()
    node.port.requests.clear()
    yield shared
    node.port.on_request = lambda name, fields: None
    shared.far.from_nodes = lambda word: [word]
    shared.far.nodes = (node,)
    shared.door.bridge.absent.clear()


def until(served, *states):
    served.wait_until(lambda: served.door.bridge.recordings[1, "arm_scope"].state in states)


def recorded(served, client, **fields):
    """The record of a motion."""
    client.request("POST", f"{AXIS}/scope", {"trigger": "motion", "before": 20, **fields})
    client.request("POST", f"{AXIS}/move", {"by": "100 um"})
    until(served, "full")
    return client.request("GET", f"{AXIS}/scope/record")


# ------------------------------------------------------------------ scope


def test_a_record_is_what_the_host_reads_itself_with_its_csv_and_its_spectra(served):
    with served.stream() as client:
        found = recorded(served, client)
        state = client.request("GET", f"{AXIS}/scope")
    with closing(open_bus(served.tcp)) as port:
        record = Scope(Bus(port).axis(1, 0)).read()
    assert found["csv"] == record.csv()
    assert (found["trigger"], found["before"]) == ("motion", record.before)
    assert found["time_s"] == record.time_s and found["time_s"][record.before] == 0
    assert found["position_nm"] == record.position_nm and found["error_nm"] == record.error_nm
    assert found["drive_command"] == record.command
    own = spectrum.spectrum(record.time_s, record.error_nm)
    assert found["window"] == "Hann" and found["frequency_hz"] == own.frequency_hz
    assert found["spectrum"]["error_nm"] == own.amplitude
    assert found["spectrum"].keys() == {"position_nm", "error_nm", "drive_command"}
    assert (state["state"], state["done"], state["samples"]) == ("full", 128, 128)
    assert state["number"] == found["number"]
    assert state["axis"] == "1.0" and state["owner"] is None


def test_fewer_samples_are_read_and_the_trigger_is_among_them(served):
    with served.stream() as client:
        found = recorded(served, client, samples=32, every="2ms")
        before = found["before"]  # fewer than asked for if the trigger comes soon
        assert len(found["time_s"]) == 32 and found["time_s"][before] == 0 and before <= 20
        assert found["time_s"][31] == pytest.approx((31 - before) * 2e-3, abs=1e-4)
        assert served.node.executed.count("read_scope") == 7  # five samples in each


@pytest.mark.parametrize(
    "fields, words",
    [
        ({"samples": 15}, "read 16 to 128 samples"),
        ({"samples": 129}, "read 16 to 128 samples"),
        ({"samples": 32, "before": 32}, "32 of 32 samples before the trigger do not fit"),
        ({"before": -1}, "-1 samples before the trigger do not fit"),
        ({"trigger": "noon"}, "no trigger 'noon'"),
        ({"every": "1us"}, "samples come every 250us to 50ms"),
        ({"before": "many"}, "'before' is no whole number"),
        ({"before": True}, "'before' is no whole number"),
        ({"before": 10**9}, "'before' is no whole number"),
        ({"level": "1"}, "unit"),
    ],
)
def test_wrong_settings_are_refused_and_leave_the_scope_free(served, fields, words):
    with served.stream() as client, served.stream() as other:
        with pytest.raises(ServerRefused, match=words) as refused:
            client.request("POST", f"{AXIS}/scope", fields)
        assert refused.value.status == 400
        assert "arm_scope" not in served.node.executed
        assert other.request("GET", f"{AXIS}/scope")["state"] == "empty"
        assert other.request("POST", f"{AXIS}/scope", NEVER)["state"] == "waiting"


def test_a_scope_belongs_to_one_client_until_it_gives_it_up(served):
    with served.stream() as client, served.stream() as other:
        client.request("POST", f"{AXIS}/scope", NEVER)
        with pytest.raises(ServerRefused, match="waits for a record of another client") as refused:
            other.request("POST", f"{AXIS}/scope", NEVER)
        assert (refused.value.status, refused.value.cause) == (409, "scope_in_use")
        state = other.request("GET", f"{AXIS}/scope")
        assert refused.value.error["owner"] == state["owner"]
        with pytest.raises(ServerRefused, match="waits for no record"):
            other.request("DELETE", f"{AXIS}/scope")
        given_up = client.request("DELETE", f"{AXIS}/scope")
        assert (given_up["state"], given_up["words"]) == (
            "ended",
            "ended without a record: given up",
        )
        assert other.request("POST", f"{AXIS}/scope", NEVER)["state"] == "waiting"
        assert served.node.executed.count("arm_scope") == 2


def test_a_scope_of_a_client_that_has_left_is_free(served):
    with served.stream() as client:
        client.request("POST", f"{AXIS}/scope", NEVER)
    until(served, "ended")
    with served.stream() as other:
        state = other.request("GET", f"{AXIS}/scope")
        assert state["words"] == "ended without a record: its client has left"
        other.request("POST", f"{AXIS}/scope", NEVER)


def test_a_scope_may_be_taken_over_and_the_other_client_reads_why_its_record_ended(served):
    with served.stream() as client, served.stream() as other:
        client.request("POST", f"{AXIS}/scope", NEVER)
        first = served.door.bridge.recordings[1, "arm_scope"]
        taken = other.request("POST", f"{AXIS}/scope", {**NEVER, "take": True})
        served.wait_until(lambda: first.state == "ended")
        assert first.number < taken["number"]
        assert first.ended == f"{taken['owner']} has armed the scope" and taken["owner"]


def test_a_refused_arming_leaves_the_record_of_the_same_client_alone(served):
    with served.stream() as client:
        client.request("POST", f"{AXIS}/scope", NEVER)
        with pytest.raises(ServerRefused, match="no trigger"):
            client.request("POST", f"{AXIS}/scope", {"trigger": "noon"})
        assert client.request("GET", f"{AXIS}/scope")["state"] == "waiting"
        client.request("POST", f"{AXIS}/scope", {"trigger": "now"})
        until(served, "full")


def test_a_scope_that_a_client_of_tcp_waits_for_is_refused_and_one_it_has_read_is_free(served):
    with served.stream() as client, closing(open_bus(served.tcp)) as port:
        Scope(Bus(port).axis(1, 0)).arm("fault")
        with pytest.raises(ServerRefused, match="another client: the COBS client at"):
            client.request("POST", f"{AXIS}/scope", NEVER)
        Scope(Bus(port).axis(1, 0)).arm("now")
        Scope(Bus(port).axis(1, 0)).wait()
        assert client.request("POST", f"{AXIS}/scope", NEVER)["state"] == "waiting"


def test_a_record_that_a_client_of_tcp_has_replaced_ends_and_says_so(served):
    with served.stream() as client, closing(open_bus(served.tcp)) as port:
        client.request("POST", f"{AXIS}/scope", NEVER)
        Scope(Bus(port).axis(1, 0)).arm("fault")
        until(served, "ended")
        words = client.request("GET", f"{AXIS}/scope")["words"]
        assert words.startswith("ended without a record: the COBS client at ")
        with pytest.raises(ServerRefused, match="there is no record of axis 1.0"):
            client.request("GET", f"{AXIS}/scope/record")


def test_a_record_ends_when_the_node_was_switched_off_or_does_not_answer(served):
    with served.stream() as client:
        client.request("POST", f"{AXIS}/scope", NEVER)
        served.far.nodes, nodes = (homed(),), served.far.nodes
        until(served, "ended")
        assert "switched off" in client.request("GET", f"{AXIS}/scope")["words"]
        served.far.nodes = nodes
        client.request("POST", f"{AXIS}/scope", NEVER)
        served.far.nodes = ()
        until(served, "ended")
        assert "nobody answers" in client.request("GET", f"{AXIS}/scope")["words"]


def test_a_scope_looks_at_an_axis_that_another_client_moves(served):
    with served.stream() as client, served.stream() as other:
        other.request("POST", f"{AXIS}/move", {"by": "100 mm", "wait": False})
        client.request("POST", f"{AXIS}/scope", {"trigger": "now"})
        until(served, "full")
        found = client.request("GET", f"{AXIS}/scope/record")["position_nm"]
        assert found[-1] > found[0]
        assert client.request("GET", AXIS)["moved_by"].startswith("the WebSocket client")
    assert POLL_S < 0.1  # many looks in the shortest record


# ------------------------------------------------------------------ recorder of ticks

TICKS = f"{AXIS}/ticks"


@pytest.fixture(scope="module")
def ticking():
    """A server of a node with a recorder of ticks."""
    made = Served(homed(axes=2, scope_words=1024))
    yield made
    made.end()


def ticks_until(server, *states):
    server.wait_until(lambda: server.door.bridge.recordings[1, "record_ticks"].state in states)


def test_a_record_of_ticks_has_samples_before_its_trigger_and_is_what_the_host_reads(ticking):
    body = {"signals": "target,error,1.error,faults", "samples": 200, "before": 50}
    body |= {"trigger": "rises", "of": "position", "level": "20um"}
    with ticking.stream() as client:
        state = client.request("POST", TICKS, body)
        assert (state["state"], state["samples"], state["trigger"]) == ("waiting", 200, "rises")
        client.request("POST", f"{AXIS}/move", {"by": "100 um"})
        ticks_until(ticking, "full")
        found = client.request("GET", f"{TICKS}/record")
    assert found["before"] == 50 and found["time_s"][50] == 0 and len(found["time_s"]) == 200
    assert found["columns"]["position_nm"][50] >= 20_000 > found["columns"]["position_nm"][49]
    heading = "time_s,target_nm,error_nm,axis_1_error_nm,faults_bits,position_nm"
    assert found["csv"].splitlines()[0] == heading and len(found["csv"].splitlines()) == 201
    assert [*found["columns"]] == [*found["spectrum"]] == heading.split(",")[1:]
    own = spectrum.spectrum(found["time_s"], found["columns"]["error_nm"])
    assert found["spectrum"]["error_nm"] == own.amplitude


def test_after_a_delay_the_first_sample_of_a_record_of_ticks_is_late(ticking):
    with ticking.stream() as client:
        client.request("POST", TICKS, {"samples": 32, "delay": "5ms", "every": "500us"})
        ticks_until(ticking, "full")
        found = client.request("GET", f"{TICKS}/record", {"first": 30})
    assert found["before"] == 0 and found["first"] == 30
    assert found["time_s"] == pytest.approx([0.005 + 30 * 0.0005, 0.005 + 31 * 0.0005])


def test_a_stream_is_shown_while_it_goes_on_and_may_be_ended(ticking):
    with ticking.stream() as client:
        body = {"signals": "error", "every": "1ms", "duration": "90s"}
        assert client.request("POST", TICKS, body)["state"] == "recording"
        first = len(client.request("GET", f"{TICKS}/record")["time_s"])
        made = ticking.door.bridge.recordings[1, "record_ticks"]
        ticking.wait_until(lambda: made.done > first)
        more = client.request("GET", f"{TICKS}/record", {"first": first})
        assert more["time_s"][0] == pytest.approx(1e-3 * first) and more["csv"] == ""
        state = client.request("DELETE", TICKS)
        assert state["state"] == "full" and state["done"] == state["samples"] < 90_000
        whole = client.request("GET", f"{TICKS}/record")
        assert len(whole["time_s"]) == state["samples"] and whole["csv"]
        assert whole["time_s"] == pytest.approx([1e-3 * n for n in range(state["samples"])])
        client.request("POST", TICKS, {**body, "duration": "50ms"})
        ticks_until(ticking, "full")
        assert len(client.request("GET", f"{TICKS}/record")["time_s"]) == 50


def test_what_can_be_recorded_is_listed_and_a_node_without_a_recorder_has_no_words(ticking, served):
    with ticking.stream() as client:
        found = client.request("GET", f"{TICKS}/recorder")
    assert (found["words"], found["axes"], found["channels"]) == (1024, 2, 8)
    assert found["signals"]["integral"].startswith("integral of the position loop")
    assert found["tick_s"] == 1 / 4000 and "rises" in found["triggers"]
    with served.stream() as client:
        assert client.request("GET", f"{TICKS}/recorder")["words"] == 0
        with pytest.raises(ServerRefused, match="build it with SCOPE_WORDS"):
            client.request("POST", TICKS)


@pytest.mark.parametrize(
    "fields, words",
    [
        ({"samples": 15}, "0 of 15 samples before the trigger do not fit"),
        ({"samples": 20, "before": 20}, "20 of 20 samples before the trigger do not fit"),
        ({"before": -1}, "-1 samples before the trigger"),
        ({"before": 5, "delay": "1ms"}, "give one of both"),
        ({"signals": "noise"}, "no signal 'noise' to record"),
        ({"signals": "2.error"}, "no axis 2"),
        ({"signals": " , "}, "a recording has 1 to 8 signals"),
        ({"samples": 9999}, "from 1 to 341"),
        ({"trigger": "noon"}, "no trigger 'noon'"),
        ({"trigger": "rises", "level": "1"}, "unit"),
        ({"duration": "1h"}, "a stream of 43200000 words: from 1 to 100000"),
        ({"duration": "0s"}, "a stream of 0 words"),
    ],
)
def test_wrong_settings_of_ticks_are_refused_and_leave_the_recorder_free(ticking, fields, words):
    with ticking.stream() as client, ticking.stream() as other:
        with pytest.raises(ServerRefused, match=words):
            client.request("POST", TICKS, fields)
        other.request("POST", TICKS, {"samples": 16})
        ticks_until(ticking, "full")


def test_a_recorder_of_ticks_belongs_to_one_client_and_the_scope_beside_it_to_another(ticking):
    never = {"trigger": "bits", "of": "faults"}
    with ticking.stream() as client, ticking.stream() as other:
        client.request("POST", TICKS, never)
        with pytest.raises(ServerRefused, match="recorder of ticks of node 1 waits") as refused:
            other.request("POST", TICKS, never)
        assert refused.value.cause == "scope_in_use"
        other.request("POST", f"{AXIS}/scope", NEVER)
        assert client.request("GET", TICKS)["state"] == "waiting"
        assert other.request("POST", TICKS, {**never, "take": True})["state"] == "waiting"
        with pytest.raises(ServerRefused, match="there is no record"):
            other.request("GET", f"{TICKS}/record")
        assert "given up" in other.request("DELETE", TICKS)["words"]


# ------------------------------------------------------------------ sine and cosine


def turning(node, amplitude=100, offset=0):
    """Each reading of the encoder finds the signal a little farther round its circle."""
    turns = itertools.count()

    def turn(name, fields):
        if name == "encoder":
            angle = 0.5 * next(turns)
            cos, sin = round(amplitude * math.cos(angle)), round(amplitude * math.sin(angle))
            word = cos + offset & 0xFFFF, sin & 0xFFFF
            node.axes[0].word[DEFINES["AXIS_SAMPLE"]] = word[1] | word[0] << 16

    node.port.on_request = turn


@pytest.mark.parametrize(
    "amplitude, offset, verdict, to_do",
    [
        (100, 0, "good", ""),
        (20, 5, "weak", "clean scale and head"),
        (120, 10, "saturated", "lower the gain"),
    ],
)
def test_samples_of_a_moving_axis_have_their_ellipse_and_their_amplitude_in_words(
    served, amplitude, offset, verdict, to_do
):
    turning(served.node, amplitude, offset)
    with served.stream() as client:
        found = client.request("GET", f"{AXIS}/signal", {"samples": 64})
    assert len(found["cos"]) == len(found["sin"]) == 64
    ellipse = found["ellipse"]
    assert ellipse["amplitude"] == pytest.approx(amplitude, abs=0.5)
    assert ellipse["cos_offset"] == pytest.approx(offset, abs=0.5)
    assert ellipse["quadrature_error_deg"] == pytest.approx(0, abs=0.5)
    assert ellipse["deviation"] < 0.5 and len(found["curve"]["cos"]) > 60
    assert found["verdict"] == verdict and found["to_do"].startswith(to_do)
    assert f"{ellipse['amplitude']:.1f} ADC counts" in found["words"]


def test_samples_of_several_requests_are_kept_for_each_client_until_it_begins_afresh(
    served, monkeypatch
):
    monkeypatch.setattr(lissajous, "KEPT", 30)
    turning(served.node)
    with served.stream() as client, served.stream() as other:
        counts = [
            len(client.request("GET", f"{AXIS}/signal", body)["cos"])
            for body in ({"samples": 10}, {"samples": 10}, {"samples": 10, "fresh": True})
        ]
        assert counts == [10, 20, 10]
        assert len(other.request("GET", f"{AXIS}/signal", {"samples": 40})["cos"]) == 30
        for wrong in (0, 129):
            with pytest.raises(ServerRefused, match="ask for 1 to 128"):
                client.request("GET", f"{AXIS}/signal", {"samples": wrong})


def test_an_axis_at_rest_has_no_ellipse_and_is_to_be_moved(served):
    with served.http() as client:
        found = client.done("GET", f"{AXIS}/signal?samples=20")
    assert len(found["cos"]) == 1 and found["ellipse"] is None and found["curve"]["cos"] == []
    assert found["verdict"] == "unknown" and "too few different samples: 1 of" in found["words"]


@pytest.mark.parametrize("absent, words", [("sine", "has no sine and cosine"), ("monitor", "")])
def test_an_axis_without_a_sine_is_refused_and_one_without_a_monitor_has_no_limits(absent, words):
    served = Served(homed(absent=(absent,)))
    turning(served.node)
    try:
        with served.http() as client:
            status, values = client.ask("GET", f"{AXIS}/signal")
    finally:
        served.end()
    if words:
        assert status == 409 and words in values["error"]["text"]
    else:
        assert status == 200 and "no signal monitor" in values["words"]


# ------------------------------------------------------------------ bus


def test_the_statistics_of_the_bus_count_what_the_server_meets(served):
    with served.stream() as client, closing(open_bus(served.tcp)) as port:
        first = client.request("GET", "/api/bus")
        Bus(port).node(1).request("counters")
        spoilt = iter([[0x1FF]])
        served.far.from_nodes = lambda word: next(spoilt, [word])
        client.request("GET", f"{AXIS}/parameters/kp")
        last = client.request("GET", "/api/bus")
        assert last["exchanges"] > first["exchanges"] and last["repeats"] > first["repeats"]
        assert last["garbled"] == first["garbled"] + 1
        served.far.nodes = ()
        with pytest.raises(ServerRefused):
            client.request("GET", f"{AXIS}/parameters/kp")
        assert client.request("GET", "/api/bus")["no_answer"] > last["no_answer"]
        assert [name.split(" at ")[0] for name in last["clients"]] == [
            "the COBS client",
            "the WebSocket client",
        ]
