# SPDX-License-Identifier: Apache-2.0
"""What a server carries out for its clients: calibrations and jobs; segment tables, the amplitude
along the travel, and the names of machine.toml.
"""

import asyncio

import pytest

from moire.client.segments import Segments, SegmentTable
from moire.description import AxisDescription, Description
from moire.web import calibrating
from moire.web.api import OPERATIONS
from moire.web.bridge import THREADS, Client, ClientBus
from moire.web.refusals import BadRequest
from tb.fakes.served import Served, homed
from tb.host.test_host_feedback import node_with_signal
from tb.host.test_host_job import Workshop
from tb.host.test_host_page_scope import turning
from twin.compiled.tables import PERIOD

AXIS = "/api/nodes/1/axes/0"
RUN = f"{AXIS}/calibration"
ADDRESSES = range(1, THREADS["long"] + 1)


@pytest.fixture
def served(request):
    made = Served(getattr(request, "param", homed)())
    yield made
    made.end()


def of_signal():
    """A homed node whose calibration can learn."""
    node = node_with_signal()
    node.home()
    return node


def client_axis(served):
    """The axis as another client has it. A test must not ask the node itself here: the gateway's
    thread may be in the middle of a request to it.
    """
    bridge = served.door.bridge
    return ClientBus(bridge, bridge.client(None, "test")).axis(1, 0)


def ended(served, client):
    """The calibration when it runs no more."""
    served.wait_until(lambda: served.door.bridge.calibrations[1, 0].state != "running")
    return client.done("GET", RUN)


@pytest.mark.parametrize("served", [of_signal], indirect=True)
def test_an_axis_is_calibrated_by_the_server(served):
    velocity = served.node.parameter("velocity")
    with served.http() as client, served.http() as other:
        before = client.done("GET", RUN)
        assert (before["state"], before["before_nm"]) == ("none", [])
        begun = client.done("POST", RUN, {"distance": "80 um", "timeout": "1min"})
        assert begun.keys() == before.keys() and begun["state"] == "running"
        status, values = other.ask("POST", RUN)
        assert (status, values["error"]["cause"]) == (409, "calibrates_already")
        done = ended(served, client)
        assert done["state"] == "done" and done["strokes"] >= 2 and done["accepted"] > 0
        assert done["orders"] == list(range(1, 11)) and done["before_nm"] == [0.0] * 10
        assert client_axis(served).calibration().frozen
    assert served.node.parameter("velocity") == velocity


def test_a_stop_ends_a_calibration_with_its_cause(served):
    with served.http() as client, served.http() as other:
        client.done("POST", RUN, {"distance": "30 mm"})
        served.wait_until(lambda: served.node.state() == "moving")
        other.done("POST", f"{AXIS}/stop")
        found = ended(served, client)
    assert found["state"] == "ended" and "stopped by the host" in found["words"]
    assert client_axis(served).calibration().frozen


def test_a_stop_between_two_strokes_ends_a_calibration(served, monkeypatch):
    begun = calibrating.Run.progress
    with served.http() as client, served.http() as other:

        def progress(run, state):
            begun(run, state)
            if run.strokes == 1:
                other.done("POST", f"{AXIS}/stop")

        monkeypatch.setattr(calibrating.Run, "progress", progress)
        client.done("POST", RUN)
        found = ended(served, client)
    assert (found["state"], found["strokes"]) == ("ended", 1)
    assert "was stopped while it was being begun" in found["words"]
    assert served.node.state() == "holding" and client_axis(served).calibration().frozen


def test_a_calibration_whose_client_leaves_is_ended_properly(served):
    velocity = served.node.parameter("velocity")
    with served.http() as client:
        client.done("POST", RUN, {"distance": "30 mm"})
        served.wait_until(lambda: served.node.state() == "moving")
    served.wait_until(lambda: served.node.state() == "off")
    served.wait_until(lambda: served.node.parameter("velocity") == velocity)
    with served.http() as client:
        found = ended(served, client)
    assert (found["state"], found["words"]) == ("ended", "its client has left")
    assert client_axis(served).calibration().frozen


def test_a_wrong_calibration_is_refused_and_an_axis_without_a_zero_stays_off():
    served = Served(node_with_signal())
    try:
        with served.http() as client:
            status, values = client.ask("POST", RUN, {"distance": "3"})
            assert (status, values["error"]["cause"]) == (400, "no_unit")
            status, values = client.ask("POST", RUN)
            assert values["error"]["cause"] == "not_homed" and "enable" not in served.node.executed
    finally:
        served.end()


def test_of_two_calibrations_that_are_begun_at_once_the_second_is_refused():
    class Waiting:
        """A bridge whose commands for A never end."""

        def __init__(self):
            self.calibrations = {}

        async def command(self, client, place, work):
            assert client is first_client
            await asyncio.Event().wait()

    first_client = Client("A")

    async def both():
        bridge = Waiting()
        first = asyncio.create_task(calibrating.begin(bridge, first_client, (1, 0), {}))
        await asyncio.sleep(0)
        with pytest.raises(BadRequest, match="axis 1.0 is being calibrated by A"):
            await calibrating.begin(bridge, Client("B"), (1, 0), {})
        first.cancel()
        await asyncio.wait([first])
        assert bridge.calibrations == {}

    asyncio.run(both())


def test_calibrations_do_not_keep_the_parameters_from_being_read():
    served = Served(*map(homed, ADDRESSES))
    runs = served.door.bridge.calibrations
    try:
        with served.http() as client:
            for address in ADDRESSES:
                begun = f"/api/nodes/{address}/axes/0/calibration"
                client.done("POST", begun, {"distance": "100 mm"})
            assert client.done("GET", f"{AXIS}/parameters")["parameters"]
            assert [run.state for run in runs.values()] == ["running"] * len(ADDRESSES)
    finally:
        served.end()


def test_a_calibration_of_an_axis_that_another_client_moves_is_refused(served):
    with served.http() as client, served.http() as other:
        other.done("POST", f"{AXIS}/move", {"to": "100 mm", "wait": False})
        status, values = client.ask("POST", RUN)
        assert (status, values["error"]["cause"]) == (409, "busy")
        assert client.done("GET", RUN)["state"] == "none"
        assert client.done("GET", AXIS)["state"] == "moving"


def test_the_harmonics_are_amplitudes_in_nm():
    correction = {"cosine": [3 << 20, 0], "sine": [4 << 20, -(1 << 24)]}
    assert calibrating.amplitudes_nm(correction, 800.0) == [250.0, 800.0]


def test_the_segment_table_is_shown_with_its_borders(served):
    with served.http() as client:
        found = client.done("GET", f"{AXIS}/segments")
        assert found["border_nm"] == [] and "0 points loaded" in found["words"]
        Segments(client_axis(served)).load(SegmentTable(0, PERIOD, (0, 100, -50)))
        found = client.done("GET", f"{AXIS}/segments")
    assert found["border_nm"] == pytest.approx([0, PERIOD, 2 * PERIOD], abs=0.02)
    assert found["error_nm"] == pytest.approx([0, 100, -50], abs=0.02)


def test_each_sample_of_the_signal_has_its_amplitude_and_position(served):
    turning(served.node)
    with served.http() as client:
        found = client.done("GET", f"{AXIS}/signal?samples=8")
    assert len(found["amplitude"]) == len(found["position_nm"]) == len(found["cos"]) > 1
    assert found["limits"] == [32, 160] and all(32 < one < 160 for one in found["amplitude"])


# ------------------------------------------------------------------ jobs


def test_a_job_is_begun_paused_and_answered():
    workshop = Workshop()
    workshop.job.load(["0deg", "1.5deg"])
    served = Served(workshop.station)
    job = "/api/nodes/2/job"
    try:
        with served.http() as client:
            found = client.done("GET", job)
            assert found["built"] and (found["state"], found["stations"]) == ("idle", 2)
            assert "start" in found["answers"]
            (one,) = [one for one in OPERATIONS if one.name == "do_job"]
            assert client.done("POST", job, {"action": "start"}).keys() == one.answer.keys()
            status, values = client.ask("POST", job, {"action": "fly"})
            assert status == 400 and "start, pause" in values["error"]["to_do"]
            status, values = client.ask("POST", job, {"action": "start"})
            assert (status, values["error"]["cause"]) == (409, "job_active")
            client.done("POST", job, {"action": "stop"})
    finally:
        served.end()


def test_a_node_without_a_station_has_no_job(served):
    with served.http() as client:
        found = client.done("GET", "/api/nodes/1/job")
        assert found["built"] is False and found["state"] is None
        assert client.ask("POST", "/api/nodes/1/job", {"action": "start"})[0] == 409


# ------------------------------------------------------------------ names


def test_an_axis_is_asked_for_by_its_name():
    axes = {"x": AxisDescription("x", 1, 0, "um")}
    served = Served(homed(), description=Description("", "a machine", None, axes))
    try:
        with served.http() as client, served.stream() as stream:
            known = client.done("GET", "/api")
            assert known["names"] == {"1.0": "x"} and known["machine"] == "a machine"
            assert client.done("GET", "/api/axes/x")["axis"] == 0
            assert client.done("POST", "/api/axes/x/move", {"to": "3 um"})["position_nm"] == 3000
            assert stream.request("GET", "/api/axes/x/position")["position_nm"] == 3000
            status, values = client.ask("GET", "/api/axes/y")
            assert status == 404 and "no axis 'y': named axes are x" in values["error"]["text"]
            assert client.done("GET", "/api/axes/1.0")["address"] == 1
    finally:
        served.end()
