# SPDX-License-Identifier: Apache-2.0
"""moire.web: what the live page needs of the server: its files, jogs that end by themselves, and
stops that hold for a motion that is being begun.
"""

import re
import threading
from importlib.resources import files

import pytest

from moire.client.axis import Axis
from moire.client.groups import BEGINNINGS, OTHERS, group_of
from moire.made.bus_tables import PARAMETERS
from moire.web import jog, page
from moire.web.client import ServerRefused
from tb.fakes.served import HANG_S, Http, Served, homed

AXIS = "/api/nodes/1/axes/0"
FAR = {"by": "1 m"}
FILES = {file.name: file.read_text() for file in files("moire.web").joinpath("static").iterdir()}


@pytest.fixture(scope="module")
def shared():
    """For what leaves the axis as it was."""
    made = Served(homed())
    yield made
    made.end()


@pytest.fixture
def served():
    made = Served(homed())
    yield made
    made.end()


# ------------------------------------------------------------------ files


def get(client, path):
    client.request("GET", path)
    found = client.getresponse()
    return found, found.read().decode()


def test_the_page_comes_with_all_it_names_and_may_load_nothing_else(shared):
    with shared.http() as client:
        found, text = get(client, "/")
        assert found.status == 200 and found.getheader("content-type").startswith("text/html")
        assert found.getheader("content-security-policy") == page.POLICY
        assert "unsafe" not in page.POLICY and page.POLICY.startswith("default-src 'none'")
        named = set(re.findall(r'(?:src|href)="(/page/[^"]+)"', text))
        assert named == {f"/page/{name}" for name in FILES if name != "index.html"}
        for path in named:
            found, body = get(client, path)
            kind = "css" if path.endswith("css") else "javascript"
            assert found.status == 200 and kind in found.getheader("content-type")
            assert found.getheader("x-content-type-options") == "nosniff"
            assert body == FILES[path.removeprefix("/page/")]
        found, body = get(client, "/page/no.js")
        assert found.status == 404 and '"no_such_path"' in body


def test_uplot_is_served_where_it_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "files", lambda package: tmp_path)
    for name in ("static/index.html", "uplot/uPlot.esm.js", "uplot/LICENSE"):
        assert not page.has_plots() or name.startswith("uplot")
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    found = page.responses()
    assert page.has_plots() and [*found] == ["/", "/page/uplot/uPlot.esm.js"]
    assert found["/page/uplot/uPlot.esm.js"].media_type == "text/javascript"


@pytest.mark.parametrize("name", FILES)
def test_a_file_names_no_other_site_and_has_no_code_inside_html(name):
    assert not re.search(r"(https?:)?//\w+\.\w", FILES[name])
    for wrong in ("eval(", "new Function", "onclick=", "style=", "<style", "<script>"):
        assert wrong not in FILES[name], wrong


def test_the_modules_import_only_each_other():
    for name, text in FILES.items():
        for other in re.findall(r'from "\./([^"]+)"', text):
            assert other in FILES, (name, other)
        assert text.count(' from "') == text.count(' from "./')


def test_every_field_that_the_page_shows_exists_once_in_its_template():
    fields = re.findall(r'data-field="(\w+)"', FILES["index.html"])
    assert len(fields) == len(set(fields))
    shown = set(re.findall(r"this\.fields\.(\w+)|this\.put\(\"(\w+)\"", FILES["axis.js"]))
    assert {one or other for one, other in shown} <= set(fields)
    ids = set(re.findall(r'id="([\w-]+)"', FILES["index.html"]))
    assert set(re.findall(r'at\("([\w-]+)"\)', FILES["main.js"])) <= ids


def test_the_page_needs_no_token_but_what_it_asks_for_does(tmp_path):
    names = {"token": tmp_path / "token", "read_token": tmp_path / "reads"}
    served = Served(homed(), **names)
    token, reads = (path.read_text().strip() for path in names.values())
    try:
        with served.http() as client:
            assert get(client, "/")[0].status == 200
            assert client.ask("GET", "/api")[0] == 401
            for given, may in ((token, True), (reads, False)):
                status, values = client.ask("GET", "/api", Authorization=f"Bearer {given}")
                assert (status, values["may_change"]) == (200, may)
        with served.stream(token=reads) as client:
            assert client.request("GET", "/api")["may_change"] is False
            for path in ("jog", "hold", "stop"):
                with pytest.raises(ServerRefused, match="only reads"):
                    client.request("POST", f"{AXIS}/{path}", FAR if path == "jog" else None)
    finally:
        served.end()


# ------------------------------------------------------------------ what a page shows


def test_a_sample_of_the_stream_has_what_a_status_has(shared):
    with shared.stream(axes="1.0") as client:
        (row,) = client.samples()["samples"]
        assert row.keys() == client.request("GET", AXIS).keys()


def test_a_parameter_has_its_group_its_limits_and_its_default_in_words(shared):
    with shared.http() as client:
        found = client.done("GET", f"{AXIS}/parameters")["parameters"]
        client.done("PUT", f"{AXIS}/parameters/kp", {"value": "3"})
        changed = client.done("GET", f"{AXIS}/parameters/kp")
        client.done("PUT", f"{AXIS}/parameters/kp", {"value": changed["default_written"]})
        assert client.done("GET", f"{AXIS}/parameters/kp")["value"] == changed["default"]
    known = {one["name"]: one for one in found}
    assert known["velocity"]["group"] == "motion" and known["kp"]["group"] == "servo"
    assert known["drive"]["allowed"] == "bridge, steps, dac"
    assert known["travel_low"]["default_written"] == "-800um"
    assert changed["written"] == "3" != changed["default_written"]


def test_every_parameter_has_a_group_and_every_beginning_a_parameter():
    assert {group_of(name) for name in PARAMETERS}.isdisjoint({OTHERS})
    for beginning in BEGINNINGS:
        assert any(name.startswith(beginning) for name in PARAMETERS), beginning
    assert group_of("unheard_of") == OTHERS and group_of("step_low") == "drive"


# ------------------------------------------------------------------ jog


@pytest.fixture
def patient(monkeypatch):
    """A jog does not end by itself."""
    monkeypatch.setattr(jog, "HOLD_S", HANG_S)


def test_a_jog_whose_client_asks_for_no_more_is_stopped_under_control(served):
    with served.stream() as client:
        assert client.request("POST", f"{AXIS}/jog", FAR)["state"] == "moving"
        for _ in range(3):
            client.request("POST", f"{AXIS}/hold")
        assert served.node.state() == "moving"
        served.wait_until(lambda: served.node.state() == "holding")
        assert served.node.ended() == "stopped" and served.node.axes[0].causes == 0
        assert served.node.executed.count("move") == served.node.executed.count("stop") == 1
        with pytest.raises(ServerRefused) as refused:
            client.request("POST", f"{AXIS}/hold")
        assert (refused.value.status, refused.value.cause) == (409, "no_jog")
        assert served.node.executed.count("move") == 1


def test_a_jog_that_is_held_goes_on_after_its_first_deadline(served, patient):
    with served.stream() as client:
        client.request("POST", f"{AXIS}/jog", FAR)
        made = next(iter(served.door.bridge.jogs.values()))
        first = made.timer
        client.request("POST", f"{AXIS}/hold")
        assert first.cancelled() and not made.timer.cancelled()
        assert made.timer.when() > first.when()


def test_a_jog_ends_at_the_end_of_the_travel(served, patient):
    with served.stream() as client:
        for name, value in (("travel_low", "-8 um"), ("travel_high", "8 um")):
            client.request("PUT", f"{AXIS}/parameters/{name}", {"value": value})
        for by, end in (("1 m", 8000), ("-1 m", -8000)):
            client.request("POST", f"{AXIS}/jog", {"by": by})
            served.wait_until(lambda: served.node.ended() == "ok")
            assert client.request("GET", AXIS)["target_nm"] == end
            client.request("POST", f"{AXIS}/stop")


def test_a_jog_of_a_client_that_ends_is_stopped_and_its_drive_switched_off(served, patient):
    with served.stream() as client:
        client.request("POST", f"{AXIS}/jog", FAR)
    served.wait_until(lambda: served.node.state() == "off")
    assert served.node.ended() == "stopped" and served.door.bridge.jogs == {}


def test_a_stop_of_anybody_ends_a_jog_for_good(served, patient):
    with served.stream() as client, served.http() as other:
        client.request("POST", f"{AXIS}/jog", FAR)
        with pytest.raises(ServerRefused, match="jogs the axis already"):
            client.request("POST", f"{AXIS}/jog", FAR)
        other.done("POST", f"{AXIS}/stop")
        with pytest.raises(ServerRefused, match="its jog has ended"):
            client.request("POST", f"{AXIS}/hold")
        served.wait_until(lambda: served.node.state() == "holding")
        assert served.node.executed.count("move") == 1
        client.request("POST", f"{AXIS}/jog", FAR)


def lapse(served, made):
    """A jog has not been held for so long."""
    served.door.bridge.loop.call_soon_threadsafe(made.lapse)


def test_a_jog_outlives_what_another_client_is_refused(served, patient):
    with served.stream() as client, served.http() as other:
        client.request("POST", f"{AXIS}/jog", FAR)
        for path, body in (("jog", FAR), ("move", {"to": "0 mm"}), ("hold", None)):
            status, values = other.ask("POST", f"{AXIS}/{path}", body)
            assert status == 409 and values["error"]["cause"] in ("other_client", "no_jog")
        lapse(served, next(iter(served.door.bridge.jogs.values())))  # it ends by itself still
        served.wait_until(lambda: served.node.state() == "holding")
        assert served.node.ended() == "stopped"


def test_a_jog_that_lapses_while_the_node_does_not_answer_is_stopped_when_it_does(served):
    with served.stream() as client:
        client.request("POST", f"{AXIS}/jog", FAR)
        served.far.nodes, nodes = (), served.far.nodes
        served.wait_until(lambda: served.door.bridge.gateway.stops[1, 0] > 1)
        assert nodes[0].state() == "moving"
        served.far.nodes = nodes
        served.wait_until(lambda: served.node.state() == "holding")
        assert served.node.ended() == "stopped"


def test_a_lapse_does_not_stop_the_motion_that_has_followed_the_jog(served, patient):
    with served.stream() as client:
        client.request("POST", f"{AXIS}/jog", {"by": "1 um"})
        made = next(iter(served.door.bridge.jogs.values()))
        served.wait_until(lambda: served.node.ended() == "ok")
        client.request("POST", f"{AXIS}/move", {"to": "100 mm", "wait": False})
        assert made.ended and made.timer.cancelled() and served.door.bridge.jogs == {}
        lapse(served, made)
        client.request("GET", AXIS, {"max_age": "0s"})
        assert served.node.executed.count("stop") == 0


def test_a_jog_that_lapses_before_the_node_has_it_is_stopped_at_once(served, monkeypatch):
    begin, lapsed = Axis.begin_move, threading.Event()
    lapse = jog.Jog.lapse
    monkeypatch.setattr(jog.Jog, "lapse", lambda made: (lapse(made), lapsed.set()))

    def late(axis, *arguments, **lengths):
        assert lapsed.wait(HANG_S)
        return begin(axis, *arguments, **lengths)

    monkeypatch.setattr(Axis, "begin_move", late)
    with served.stream() as client:
        client.request("POST", f"{AXIS}/jog", FAR)
        served.wait_until(lambda: served.node.state() == "holding")
        assert served.node.ended() == "stopped"


# ------------------------------------------------------------------ a stop during the beginning


@pytest.mark.parametrize("path, body", [("move", {"to": "100 mm"}), ("jog", FAR)])
@pytest.mark.parametrize("what, state", [("stop", "holding"), ("disable", "off")])
def test_a_stop_before_the_node_has_the_motion_holds_for_it(
    served, monkeypatch, patient, path, body, what, state
):
    begin, asked, go = Axis.begin_move, threading.Event(), threading.Event()

    def late(axis, *arguments, **lengths):
        asked.set()
        assert go.wait(HANG_S)
        return begin(axis, *arguments, **lengths)

    monkeypatch.setattr(Axis, "begin_move", late)
    with served.stream() as client, served.http() as other:
        number = client.begin("POST", f"{AXIS}/{path}", body)
        assert asked.wait(HANG_S)
        other.done("POST", f"{AXIS}/{what}")
        go.set()
        with pytest.raises(ServerRefused) as refused:
            client.answer_to(number)
        assert refused.value.cause == ("stopped" if what == "stop" else "not_enabled")
        served.wait_until(lambda: served.node.state() == state)
        assert served.node.ended() == "stopped" or what == "disable"


def test_a_drive_that_was_switched_on_for_a_motion_that_is_stopped_is_off_again(
    served, monkeypatch
):
    enable, asked, go = Axis.enable, threading.Event(), threading.Event()

    def late(axis):
        asked.set()
        assert go.wait(HANG_S)
        enable(axis)

    monkeypatch.setattr(Axis, "enable", late)
    with served.stream() as client, Http(*served.place) as other:
        number = client.begin("POST", f"{AXIS}/move", {"to": "100 mm"})
        assert asked.wait(HANG_S)
        other.done("POST", f"{AXIS}/stop")
        go.set()
        with pytest.raises(ServerRefused, match="stopped while it was being begun"):
            client.answer_to(number)
        assert served.node.state() == "off" and "move" not in served.node.executed
