# SPDX-License-Identifier: Apache-2.0
"""The live page in Chromium, in front of the compiled firmware. Without Chromium and Playwright
(`make chromium`) these tests are skipped, and without uPlot (`make page`) those of the plots.
"""

import json
import re

import pytest

from figures import browser as chromium
from moire.client import remedies
from moire.client.bus import Bus
from moire.client.segments import Segments, SegmentTable
from moire.description import AxisDescription, Description
from moire.made.bus_tables import FAULTS
from moire.web import page as live_page
from moire.web.jog import Jog
from tb.bench import ROOT
from tb.fakes.bus_node import BusNode
from tb.fakes.frozen_network import FrozenNetwork
from tb.fakes.rs485_bus import Rs485Bus
from tb.fakes.served import Served, homed
from tb.host.test_host_feedback import node_with_signal
from tb.host.test_host_job import Workshop
from tb.host.test_host_page_scope import turning
from twin.compiled.tables import PERIOD

AXIS = "/api/nodes/1/axes/0"
PICTURE = ROOT / "build" / "report" / "page.png"  # docs/page.png is a copy
SCOPE_PICTURE = PICTURE.with_name("page_scope.png")  # the same
PATIENCE_MS = 30_000
WIDTHS = (380, 1280, 2560)
PLOTS = pytest.mark.skipif(not live_page.has_plots(), reason="uPlot is not fetched: make page")
HOLD_S = 2  # of a jog: a busy computer delays what the page asks for ten times a second
ESTOP = next(code for code, (name, _) in FAULTS.items() if name == "estop")


@pytest.fixture(scope="module")
def browser():
    if reason := chromium.missing():
        pytest.skip(reason)
    with chromium.opened() as made:
        yield made


@pytest.fixture(scope="module")
def context(browser):
    with browser.new_context(viewport={"width": 1280, "height": 1000}, has_touch=True) as made:
        made.set_default_timeout(PATIENCE_MS)
        yield made


@pytest.fixture(scope="module")
def shared(browser):
    """For all tests that leave a server which works."""
    made = Served(homed())
    yield made
    made.end()


@pytest.fixture(scope="module")
def ticking(browser):
    """A server of a node of two axes with a recorder of ticks."""
    made = Served(homed(axes=2, scope_words=1024))
    yield made
    made.end()


@pytest.fixture
def served(shared):
    """The drive is off, and nothing has been asked for."""
    with shared.http() as client:
        client.done("POST", f"{AXIS}/disable")
    shared.node.axes[0].causes = 0
    shared.node.port.requests.clear()
    shared.node.port.on_request = lambda name, fields: None
    return shared


def opened(context, url):
    """The page at this address, connected."""
    page = context.new_page()
    page.goto(url)
    see(page, "#link", "connected")
    return page


@pytest.fixture(scope="module")
def shared_page(context, shared):
    made, wrong = opened(context, shared.door.url), []
    made.on("pageerror", lambda error: wrong.append(error))
    yield made
    made.close()
    assert wrong == []


@pytest.fixture
def page(served, shared_page):
    see(shared_page, ".axis .state", "drive off")
    return shared_page


def see(page, selector, text):
    """Waits until an element has this text."""
    page.locator(selector).filter(has_text=text).first.wait_for()


def press(page, name):
    page.locator(".axis").first.get_by_role("button", name=name, exact=True).click()


def move(page, text, button="Move to"):
    page.locator(".axis").first.get_by_label("Move", exact=True).fill(text)
    press(page, button)


def moving(served):
    served.wait_until(lambda: served.node.state() == "moving")


def at_rest(served):
    served.wait_until(lambda: served.node.state() == "holding")
    assert served.node.ended() == "stopped" and served.node.axes[0].causes == 0


# ------------------------------------------------------------------ an axis


def test_an_axis_is_homed_moved_and_stepped_and_a_wrong_number_is_explained(served, page):
    served.node.set(0, home_method=37)
    press(page, "Home")
    see(page, ".message", "homed: ")
    move(page, "0.15")
    see(page, ".message", "reached: 0.150")
    see(page, ".position", "0.150\u2009000")
    move(page, "−0.05", "Move by")
    see(page, ".message", "reached: 0.100")
    press(page, "+ step")
    see(page, ".message", "reached: 0.110")
    moves = served.node.executed.count("move")
    move(page, "1,5")
    see(page, ".message.wrong", '"1,5" is no number: write one such as 1.5')
    move(page, "900")
    see(page, ".message.wrong", "allowed -800um to 119.6mm")
    see(page, ".message.wrong", remedies.CAUSES["out_of_travel"])
    assert served.node.executed.count("move") == moves + 1  # the node refuses the second one
    press(page, "Disable")
    see(page, ".axis .state", "drive off")


def test_a_fault_is_shown_with_what_to_do_and_cleared(served, page):
    press(page, "Enable")
    see(page, ".axis .state", "holding position")
    served.node.axes[0].causes |= 1 << ESTOP
    see(page, ".fault", f"Fault: emergency stop. What to do: {remedies.FAULTS['estop']}.")
    assert page.locator(".fault").get_attribute("role") == "alert"
    press(page, "Clear fault")
    see(page, ".message.wrong", remedies.CAUSES["fault_persists"])
    served.node.axes[0].causes = 0
    press(page, "Clear fault")
    see(page, ".axis .state", "drive off")
    page.locator(".fault").wait_for(state="hidden")


# ------------------------------------------------------------------ stop


def by_the_space_bar(page):
    page.keyboard.press(" ")


def by_the_space_bar_in_a_field(page):
    page.get_by_label("Move", exact=True).press(" ")
    assert page.get_by_label("Move", exact=True).input_value() == "100"


def by_the_space_bar_on_another_button(page):
    page.locator(".axis").get_by_role("button", name="Home", exact=True).focus()
    page.keyboard.press(" ")


def by_the_button_on_top(page):
    page.mouse.wheel(0, 5000)
    page.locator("#stop").click()


def by_enter_on_the_button_on_top(page):
    page.locator("#stop").focus()
    page.keyboard.press("Enter")


def by_the_button_of_the_axis(page):
    press(page, "Stop")


def by_the_button_when_the_websocket_is_silent(page):
    page.evaluate(
        """() => {
            const { send } = WebSocket.prototype;
            WebSocket.prototype.send = function (text) {
                // nothing else may be lost: without its beat the page would connect again
                if (text.includes("/stop")) WebSocket.prototype.send = send;
                else send.call(this, text);
            };
        }"""
    )
    page.locator("#stop").click()


@pytest.mark.parametrize(
    "stop",
    [
        by_the_space_bar,
        by_the_space_bar_in_a_field,
        by_the_space_bar_on_another_button,
        by_the_button_on_top,
        by_enter_on_the_button_on_top,
        by_the_button_of_the_axis,
        by_the_button_when_the_websocket_is_silent,
    ],
)
def test_a_motion_is_stopped(served, page, stop):
    move(page, "100")
    moving(served)
    stop(page)
    at_rest(served)
    assert "home" not in served.node.executed


# ------------------------------------------------------------------ hold to move


def lifted(page, at):
    page.mouse.up()


def left(page, at):
    page.mouse.move(at["x"] + at["width"] / 2, at["y"] - 60)


def hidden(page, at):
    page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")


def without_focus(page, at):
    page.evaluate("window.dispatchEvent(new Event('blur'))")


def stopped(page, at):
    page.keyboard.press(" ")


def frozen(page, at):
    page.evaluate("setTimeout(() => { const end = Date.now() + 3500; while (Date.now() < end); })")


@pytest.mark.parametrize("let_go", [lifted, left, hidden, without_focus, stopped, frozen])
def test_a_held_button_moves_until_it_is_let_go(served, page, let_go, monkeypatch):
    monkeypatch.setattr("moire.web.jog.HOLD_S", HOLD_S)
    held, hold = [], Jog.hold
    monkeypatch.setattr(Jog, "hold", lambda self: (held.append(self), hold(self)))
    button = page.get_by_role("button", name=re.compile("hold to move \\+"))
    button.scroll_into_view_if_needed()
    at = button.bounding_box()
    page.mouse.move(at["x"] + at["width"] / 2, at["y"] + at["height"] / 2)
    page.mouse.down()
    moving(served)
    served.wait_until(lambda: len(held) > 5)
    assert served.node.state() == "moving"
    let_go(page, at)
    at_rest(served)
    page.locator("[data-hold='+'][aria-pressed=false]").wait_for()
    assert served.node.executed.count("move") == 1


def test_a_finger_that_slides_off_the_button_stops_the_axis(served, page):
    page.set_viewport_size({"width": 380, "height": 800})
    button = page.get_by_role("button", name=re.compile("hold to move \\+"))
    button.scroll_into_view_if_needed()
    at = button.bounding_box()
    point = {"x": at["x"] + at["width"] / 2, "y": at["y"] + at["height"] / 2}
    finger = page.context.new_cdp_session(page)

    def touch(kind, *points):
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": list(points)})

    touch("touchStart", point)
    moving(served)
    see(page, "[data-field=owner]", "the WebSocket client")
    assert button.bounding_box() == at  # it stays under the finger, whatever is shown
    touch("touchMove", {**point, "y": point["y"] - 100})
    at_rest(served)
    touch("touchEnd")
    page.set_viewport_size({"width": 1280, "height": 1000})


def test_a_key_that_is_held_moves_until_it_is_lifted(served, page):
    page.locator("[data-hold='+']").focus()
    page.keyboard.down("Enter")
    moving(served)
    page.keyboard.up("Enter")
    at_rest(served)


def test_a_page_that_is_closed_leaves_its_axis_stopped_and_off(served, context):
    page = opened(context, served.door.url)
    move(page, "100")
    moving(served)
    page.close()
    served.wait_until(lambda: served.node.state() == "off")
    assert served.node.ended() == "stopped" and served.node.axes[0].causes == 0


def test_a_network_that_is_gone_stops_a_jog(served, context):
    network = FrozenNetwork(served.place)
    page = opened(context, f"http://127.0.0.1:{network.port}")
    see(page, ".axis .state", "drive off")
    page.locator("[data-hold='+']").focus()
    page.keyboard.down("Enter")
    moving(served)
    network.frozen.set()
    at_rest(served)
    network.close()
    see(page, "#lost", "The server is lost")
    assert page.locator("[data-hold='+']").get_attribute("aria-pressed") == "false"


# ------------------------------------------------------------------ several pages, lost servers


def test_two_pages_share_an_axis(served, page, context, monkeypatch):
    monkeypatch.setattr("moire.web.handlers.REACT_S", 0)
    other = opened(context, served.door.url)
    move(page, "100")
    moving(served)
    see(other, "[data-field=owner]", "the WebSocket client at 127.0.0.1")
    move(other, "0.01", "Move by")
    see(other, ".message.wrong", "another client moves this axis")
    assert served.node.executed.count("move") == 1 and served.node.state() == "moving"
    press(other, "Take the axis over")
    see(page, ".message", "stopped")
    see(other, ".message", "reached: ")
    move(page, "100")
    moving(served)
    other.keyboard.press(" ")
    at_rest(served)
    see(page, ".message", "stopped")


def test_a_server_that_is_killed_is_shown_as_lost_and_found_again(browser, context):
    first = Served(homed())
    page, port = opened(context, first.door.url), first.place[1]
    first.end()
    see(page, "#lost", "The server is lost: what is shown is old.")
    assert not page.locator("#stop").is_visible()
    second = Served(homed(), port=port)
    try:
        see(page, "#link", "connected")
        page.locator("#lost").wait_for(state="hidden")
        move(page, "0.1")
        see(page, ".message", "reached: 0.100")
    finally:
        page.close()
        second.end()


def test_a_node_that_is_switched_on_later_is_found(browser, context):
    served = Served(homed())
    (node,), served.far.nodes = served.far.nodes, ()
    page = opened(context, served.door.url)
    try:
        page.locator("#empty").wait_for()
        assert not page.locator("#stop").is_visible()
        served.far.nodes = (node,)
        served.door.bridge.absent.clear()
        see(page, ".axis .state", "drive off")
        assert page.locator("#stop").is_visible() and not page.locator("#empty").is_visible()
    finally:
        page.close()
        served.end()


def test_a_token_is_asked_for_and_one_that_only_reads_shows_no_controls(browser, context, tmp_path):
    names = {"token": tmp_path / "token", "read_token": tmp_path / "reads"}
    served = Served(homed(), **names)
    token, reads = (path.read_text().strip() for path in names.values())
    try:
        page = context.new_page()
        page.goto(served.door.url)
        for given, said in (("wrong", "the token is wrong."), (reads, "")):
            page.get_by_label("Token").fill(given)
            page.keyboard.press("Enter")
            if said:
                see(page, "#access-text", said)
        see(page, "#link", "connected, read only")
        see(page, ".axis .state", "drive off")
        assert not page.locator("#stop").is_visible()
        assert page.locator(".axis button:visible").count() == 0
        page.evaluate("sessionStorage.clear()")
        page.goto(f"{served.door.url}/#token={token}")
        page.reload()
        see(page, "#link", "connected")
        page.locator("#stop").wait_for()
        assert token not in page.url
    finally:
        served.end()


# ------------------------------------------------------------------ what is drawn


@PLOTS
def test_the_plots_and_the_parameters_show_what_the_axis_does_at_every_width(served, page):
    move(page, "0.5", "Move by")
    see(page, ".message", "reached")
    position = "#charts .plot[aria-label^='Position in mm over the last 30 s: axis 1.0 from']"
    page.locator(position).wait_for()
    drawn = page.locator("#charts .plot canvas").evaluate_all(
        """all => all.map(one => new Set(new Uint32Array(one.getContext("2d").getImageData(
           0, 0, one.width, one.height).data.buffer)).size)"""
    )
    assert len(drawn) == 4 and min(drawn) > 3
    page.get_by_role("button", name="Read").click()
    page.get_by_role("searchbox").fill("kp")
    see(page, "#parameters tr:visible", "proportional gain")
    page.get_by_label("kp, axis 1.0", exact=True).fill("0.5")
    page.keyboard.press("Enter")
    see(page, "#parameters .message", "kp is 0.5")
    assert served.node.parameter("kp") == 1 << 15
    page.get_by_label("kp, axis 1.0", exact=True).fill("many")
    page.keyboard.press("Enter")
    see(page, "#parameters .message.wrong", "many")
    page.get_by_role("searchbox").fill("")
    shown = page.locator("#parameters [name=shown]")
    shown.select_option("default")
    names = page.locator("#parameters tbody tr:visible th").all_inner_texts()
    assert "kp" in names and "velocity" not in names
    shown.select_option("saved")  # nothing: this node has no EEPROM
    see(page, "#parameters tr:visible", "; saved: ")
    assert page.locator("#parameters tbody tr:visible th").all_inner_texts() == names
    page.get_by_role("searchbox").fill("fine_")
    for scheme in ("dark", "light"):
        page.emulate_media(color_scheme=scheme)
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 1000})
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            assert page.locator("#stop").is_visible()
    page.set_viewport_size({"width": 1280, "height": 1000})
    page.evaluate("window.scrollTo(0, 0)")
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=PICTURE)


# the samples whose place in a chart has no pixel of its colour within one pixel
NOT_DRAWN = """async ([name, xs, values]) => {
    const plot = document.querySelector(`.plot[data-signal="${name}"]`);
    while (!plot.querySelector(".u-over")) await new Promise(requestAnimationFrame);
    const canvas = plot.querySelector("canvas");
    const outer = canvas.getBoundingClientRect();
    const inner = plot.querySelector(".u-over").getBoundingClientRect();
    const { from, to, low, high } = JSON.parse(plot.dataset.range);
    const context = canvas.getContext("2d");
    const scale = canvas.width / outer.width;
    const colour = getComputedStyle(plot).getPropertyValue(`--series-${plot.dataset.series}`)
        .match(/[0-9a-f]{2}/g).map((one) => parseInt(one, 16));
    return xs.map((_, at) => at).filter((at) => {
        const x = inner.left - outer.left + (xs[at] - from) / (to - from) * inner.width;
        const y = inner.bottom - outer.top - (values[at] - low) / (high - low) * inner.height;
        const { data } = context.getImageData(
            Math.floor(x * scale) - 1, Math.floor(y * scale) - 1, 3, 3);
        for (let n = 0; n < data.length; n += 4) {
            const near = colour.every((one, part) => Math.abs(one - data[n + part]) < 60);
            if (near && data[n + 3] > 60) return false;
        }
        return true;
    });
}"""


def written(value, digits, unit):
    """A number as the page writes it."""
    text = f"{abs(value):.{digits}f}"
    sign = "" if float(text) == 0 else "+" if value > 0 else "−"
    return f"{sign}{text} {unit}"


def scope_of(page):
    """The controls of the scope, with a motion as its trigger."""
    scope = page.locator("#scope")
    scope.locator("[name=trigger]").select_option("motion")
    scope.locator("[name=samples]").select_option("128")
    return scope


@PLOTS
def test_a_record_of_the_scope_is_drawn_read_by_cursors_and_exported_as_it_is(served, page):
    scope = scope_of(page)
    scope.locator("[name=share]").select_option("10")
    scope.get_by_role("button", name="Record").click()
    see(page, "#scope .message", "waiting for the trigger")
    move(page, "0.3", "Move by")
    see(page, "#scope .message", "128 samples of axis 1.0, trigger: the axis moves or homes")
    with served.http() as client:
        record = client.done("GET", f"{AXIS}/scope/record")
    time_ms = [1e3 * one for one in record["time_s"]]
    drawn = {
        "Position": ([value / 1e6 for value in record["position_nm"]], 6, "mm"),
        "Error": ([value / 1e3 for value in record["error_nm"]], 4, "µm"),
        "Drive command": ([100 * value for value in record["drive_command"]], 2, "%"),
    }
    assert max(drawn["Position"][0]) > min(drawn["Position"][0])
    for name, (values, _, _) in drawn.items():
        assert page.evaluate(NOT_DRAWN, [name, time_ms, values]) == []
    assert page.evaluate(NOT_DRAWN, ["Position", time_ms, drawn["Position"][0][::-1]]) != []
    for a, b in ((0, record["before"]), (64, 127)):
        scope.get_by_label("Cursor A").fill(str(a))
        scope.get_by_label("Cursor B").fill(str(b))
        rows = scope.locator("tbody tr").evaluate_all(
            "all => all.map(row => [...row.cells].map(cell => cell.textContent))"
        )
        expected = {"Time": (time_ms, 3, "ms"), **drawn}
        assert rows == [
            [name, *(written(v, *how) for v in (values[a], values[b], values[b] - values[a]))]
            for name, (values, *how) in expected.items()
        ]
    scope.get_by_label("Cursor A").focus()
    page.keyboard.press("ArrowRight")
    see(page, "#scope tbody", written(time_ms[65], 3, "ms"))
    chart = scope.locator(".plot").first
    chart.click(position={"x": chart.bounding_box()["width"] - 9, "y": 20})
    see(page, "#scope tbody", written(time_ms[127], 3, "ms"))
    with page.expect_download() as download:
        scope.get_by_role("button", name="Export CSV").click()
    assert download.value.suggested_filename == "scope-1.0.csv"
    assert download.value.path().read_text() == record["csv"]
    scope.locator("[name=view]").select_option("spectrum")
    see(page, "#scope .note", "peak amplitudes, Hann window")
    amplitudes = [value / 1e3 for value in record["spectrum"]["error_nm"]]
    assert page.evaluate(NOT_DRAWN, ["Error", record["frequency_hz"], amplitudes]) == []
    see(page, "#scope figcaption", "Error, amplitude in µm over Hz")
    box = scope.get_by_role("checkbox", name="Drive command")
    box.focus()
    page.keyboard.press("Enter")
    assert scope.locator(".plot:visible").count() == 2
    page.set_viewport_size({"width": 380, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 380
    page.set_viewport_size({"width": 1280, "height": 1000})
    box.check()


@PLOTS
def test_a_record_of_ticks_is_triggered_by_any_signal_and_has_what_came_before(ticking, context):
    page = opened(context, ticking.door.url)
    scope = page.locator("#scope")
    scope.get_by_label("1.position").wait_for(state="attached")
    scope.get_by_label("target", exact=True).uncheck()
    for name in ("position", "integral", "faults"):
        scope.get_by_label(name, exact=True).check()
    scope.locator("summary").filter(has_text="Signals of axis 1").click()
    scope.get_by_label("1.error", exact=True).check()
    scope.locator("[name=trigger]").select_option("rises")
    scope.locator("[name=of]").select_option("position")
    scope.get_by_role("textbox", name="Level").fill("50um")
    scope.locator("[name=share]").select_option("25")
    scope.locator("[name=count]").fill("160")
    scope.get_by_role("button", name="Record").click()
    see(page, "#scope .message", "waiting for the trigger")
    move(page, "0.3", "Move by")
    see(page, "#scope .message", "160 samples of axis 1.0, trigger: it rises to the level")
    with ticking.http() as client:
        record = client.done("GET", f"{AXIS}/ticks/record")
    assert record["before"] == 40 and record["time_s"][40] == 0
    assert [*record["columns"]] == [
        *("error_nm", "command_of_full_scale", "integral_of_full_scale", "position_nm"),
        *("faults_bits", "axis_1_error_nm"),
    ]
    time_ms = [1e3 * one for one in record["time_s"]]
    places = [value / 1e6 for value in record["columns"]["position_nm"]]
    assert page.evaluate(NOT_DRAWN, ["Position", time_ms, places]) == []
    see(page, "#scope figcaption", "Axis 1 error in µm over ms")
    see(page, "#scope figcaption", "Integral in % over ms")
    page.evaluate("document.querySelector('header').style.position = 'static'")
    scope.screenshot(path=SCOPE_PICTURE)
    page.evaluate("document.querySelector('header').style.position = ''")
    with page.expect_download() as download:
        scope.get_by_role("button", name="Export CSV").click()
    assert download.value.path().read_text() == record["csv"]
    page.set_viewport_size({"width": 380, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 380
    page.set_viewport_size({"width": 1280, "height": 1000})
    page.close()


@PLOTS
def test_a_stream_is_drawn_while_it_goes_on_until_it_is_ended(ticking, context):
    page = opened(context, ticking.door.url)
    scope = page.locator("#scope")
    scope.get_by_label("1.position").wait_for(state="attached")
    for name in ("target", "command"):
        scope.get_by_label(name, exact=True).uncheck()
    scope.get_by_label("Duration").fill("900s")  # the machine is faster than the clock
    scope.get_by_label("One every").fill("10ms")
    scope.get_by_role("button", name="Stream").click()
    see(page, "#scope figcaption", "Error in µm over ms")
    drawn = "#scope .plot[data-signal='Error']"
    first = page.locator(drawn).get_attribute("aria-label")
    page.locator(f"{drawn}:not([aria-label='{first}'])").wait_for()
    assert scope.get_by_role("button", name="Export CSV").is_disabled()
    scope.get_by_role("button", name="End the stream").click()
    see(page, "#scope .message", "samples of axis 1.0, a stream")
    with ticking.http() as client:
        record = client.done("GET", f"{AXIS}/ticks/record")
    see(page, "#scope .message", f"{len(record['time_s'])} samples")
    time_ms = [1e3 * one for one in record["time_s"]]
    errors = [value / 1e3 for value in record["columns"]["error_nm"]]
    assert page.evaluate(NOT_DRAWN, ["Error", time_ms, errors]) == []
    scope.locator("[name=view]").select_option("spectrum")
    see(page, "#scope .note", "Largest line of the error")
    page.close()


def test_a_line_is_interrupted_where_samples_are_missing(page):
    found = page.evaluate(
        """async () => {
            const { History } = await import("/page/history.js");
            const history = new History();
            const row = { target_nm: 0, position_nm: 0, velocity_mm_s: 0, drive_command: 0 };
            for (const time_s of [1, 1.1, 1.1, 3, 140]) history.add({ ...row, time_s });
            const kept = history.columns[0].slice();
            for (const time_s of [2, 2.25, 2.75]) history.add({ ...row, time_s });
            history.add({ ...row, time_s: 4, position_nm: -2000 });
            return [kept, history.since(2.2).slice(0, 2)];
        }"""
    )
    assert found == [[140, 140], [[2.25, 2.75, 4, 4], [0, 0, None, 2]]]


def test_without_uplot_the_page_says_what_to_run_and_everything_else_works(
    browser, context, tmp_path, monkeypatch
):
    static = live_page.files("moire.web").joinpath("static")
    (tmp_path / "static").symlink_to(static)
    monkeypatch.setattr(live_page, "files", lambda package: tmp_path)
    served = Served(homed())
    page = opened(context, served.door.url)
    try:
        see(page, "#plots", "There are no plots, since this server has no uPlot: run “make page”")
        assert page.locator("#plots .absent").count() == 1 and page.locator(".plot").count() == 0
        scope = scope_of(page)
        scope.get_by_role("button", name="Record").click()
        see(page, "#scope .message", "waiting for the trigger")
        move(page, "0.3", "Move by")
        see(page, "#scope .message", "128 samples of axis 1.0")
        see(page, "#scope .absent", "make page")
        see(page, "#scope tbody", "Position")
    finally:
        page.close()
        served.end()


def test_the_scope_has_one_owner_who_may_give_it_up_and_another_page_may_take_it(
    served, page, context
):
    other = opened(context, served.door.url)
    for one in (page, other):
        scope_of(one).get_by_role("button", name="Record").click()
        if one is page:
            see(page, "#scope .message", "waiting for the trigger")
    see(other, "#scope .message.wrong", "another client: the WebSocket client at")
    other.get_by_role("button", name="Take the scope over").click()
    see(other, "#scope .message", "waiting for the trigger")
    see(page, "#scope .message.wrong", "has armed the scope")
    other.get_by_role("button", name="Give up").click()
    see(other, "#scope .message", "ended without a record: given up")
    other.locator("#scope").get_by_label("One every").fill("1us")
    other.get_by_role("button", name="Record").click()
    see(other, "#scope .message.wrong", "samples come every 250us to 50ms")
    other.close()


@PLOTS
def test_sine_and_cosine_are_drawn_with_their_ellipse_and_what_to_do(served, page):
    signal = page.locator("#signal")
    measure = signal.get_by_role("button", name="Measure")
    measure.click()
    see(page, "#signal .message", "No ellipse: too few different samples: 1 of")
    turning(served.node)
    see(page, "#signal .message", "ADC counts, which is good: the limits are 32 to 160")
    signal.locator(".plot[aria-label*='samples and their ellipse']").wait_for()
    assert "Quadrature error" in signal.locator("dl").inner_text()
    page.set_viewport_size({"width": 380, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 380
    page.set_viewport_size({"width": 1280, "height": 1000})
    measure.click()
    assert measure.get_attribute("aria-pressed") == "false"
    turning(served.node, 20)
    measure.click()
    see(page, "#signal .message.wrong", "too weak: the smaller channel has")
    see(page, "#signal .message.wrong", "What to do: clean scale and head")
    measure.click()


@PLOTS
def test_the_amplitude_along_the_travel_is_drawn_with_its_limits(served, page):
    turning(served.node)
    page.locator("#signal").get_by_role("button", name="Measure").click()
    chart = page.locator("#signal .plot[aria-label^='Amplitude along the travel']")
    chart.filter().wait_for()
    assert chart.get_attribute("aria-label").endswith("ADC counts; the limits are 32 and 160")
    shown = json.loads(chart.get_attribute("data-range"))
    assert shown["low"] < 32 and shown["high"] > 160
    page.locator("#signal").get_by_role("button", name="Measure").click()


@PLOTS
def test_a_calibration_shows_its_progress_its_harmonics_and_the_segment_table(browser, context):
    node = node_with_signal()
    node.home()
    served = Served(node)
    Segments(Bus(Rs485Bus(node)).axis()).load(SegmentTable(0, 1_000_000, (0, 100, -50)))
    page = opened(context, served.door.url)
    try:
        panel = page.locator("#calibration")
        panel.get_by_label("Distance in mm").fill("0.08")
        panel.get_by_role("button", name="Calibrate").click()
        see(page, "#calibration .message", "the correction is complete and frozen. Strokes")
        see(page, "#calibration .message", "Segment table: linear")
        bars = panel.locator(".plot[aria-label^='Harmonics that are corrected']")
        with served.http() as client:
            now = client.done("GET", f"{AXIS}/calibration")["now_nm"]
        assert ", ".join(f"{one:.3f}" for one in now) in bars.get_attribute("aria-label")
        scale = panel.locator(".plot[aria-label^='Error of the scale at 3 borders']")
        assert "-50.0 to 100.0 nm" in scale.get_attribute("aria-label")
        page.set_viewport_size({"width": 380, "height": 800})
        assert page.evaluate("document.documentElement.scrollWidth") <= 380
        page.set_viewport_size({"width": 1280, "height": 1000})
        panel.get_by_label("Distance in mm").fill("far")
        panel.get_by_role("button", name="Calibrate").click()
        see(page, "#calibration .message.wrong", '"far" is no number')
    finally:
        page.close()
        served.end()


def test_the_first_set_up_is_followed_step_by_step(browser, context):
    served = Served(BusNode())
    page, axis = opened(context, served.door.url), served.node.axes[0]
    try:
        see(page, "#setup summary", "First set-up, step by step")
        page.locator("#setup summary").focus()
        page.keyboard.press("Enter")
        see(page, "#setup [data-step=switches]", "not seen yet: low limit, high limit, emergency")
        pressed = {
            "low limit": {"low_at": axis.machine},
            "high limit": {"low_at": axis.machine - PERIOD, "high_at": axis.machine},
            "emergency stop": {"high_at": axis.machine + PERIOD, "causes": 1 << ESTOP},
        }
        for name, values in pressed.items():
            vars(axis).update(values)
            see(page, "#setup [data-step=switches]", f"pressed now: {name}")
        vars(axis).update(causes=0, high_at=None, pressed_high=False)
        press(page, "Clear fault")
        see(page, "#setup [data-step=switches][data-state=done]", "all were seen")
        for by, state in ((-20_000, "wrong"), (20_000, "done")):
            page.get_by_role("button", name="I am going to move it").click()
            see(page, "#setup [data-step=direction]", "move it now")
            axis.machine += by * PERIOD // 800
            page.locator(f"#setup [data-step=direction][data-state={state}]").wait_for()
        page.locator("#setup [data-step=signal]").get_by_role("button").click()
        see(page, "#setup [data-step=signal]", "too few different samples")
        limit = page.locator("#setup").get_by_label("largest following error")
        limit.fill("5")
        limit.press("Tab")
        see(page, "#setup [data-step=limits][data-state=wrong]", "has no unit")
        limit.fill("40 um")
        limit.press("Tab")
        see(page, "#setup [data-step=limits][data-state=done]", "following_limit is 40um")
        assert served.node.parameter("following_limit") == 50 * 65536
        page.locator("#setup").get_by_role("button", name="Home").click()
        see(page, "#setup [data-step=home][data-state=done]", "homed at")
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 1000})
            assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.set_viewport_size({"width": 1280, "height": 1000})
    finally:
        page.close()
        served.end()


def differing_from_saved(page):
    """The names of the parameters that differ from the saved ones, as the page shows them."""
    page.locator("#parameters [name=shown]").select_option("all")
    page.locator("#parameters [name=shown]").select_option("saved")
    see(page, "#parameters .message", " parameters")
    return page.locator("#parameters tbody tr:visible th").all_inner_texts()


def test_a_job_is_shown_and_begun(browser, context):
    workshop = Workshop()
    workshop.job.load(["0deg", "1.5deg"])
    workshop.station.set(kp=1 << 13)
    workshop.station.save_settings()
    served = Served(workshop.station)
    page = opened(context, served.door.url)
    try:
        see(page, "#job [data-field=words]", "station 1 of 2")
        page.locator("#job").get_by_role("button", name="Start").click()
        page.locator("#job").get_by_role("button", name="Stop the job").click()
        page.locator("#job").get_by_role("button", name="Start").wait_for()
        page.locator("#parameters").get_by_role("button", name="Read").click()
        assert differing_from_saved(page) == []
        page.locator("#parameters [name=shown]").select_option("all")
        page.get_by_label(re.compile("^kp, axis")).fill("0.25")
        page.keyboard.press("Enter")
        see(page, "#parameters .message", "kp is 0.25")
        assert differing_from_saved(page) == ["kp"]
        see(page, "#parameters tr:visible", "; saved: 0.125")
    finally:
        page.close()
        served.end()


def test_an_axis_has_the_name_of_the_description_and_shows_what_differs_from_it(browser, context):
    parameters = {"velocity": "4 mm/s", "kp": "0.125", "home_method": "s0"}
    axes = {"x": AxisDescription("x", 1, 0, parameters=parameters)}
    served = Served(homed(), description=Description("", "", None, axes))
    page = opened(context, served.door.url)
    try:
        see(page, ".axis h2", "x (axis 1.0)")
        with served.http() as client:
            client.done("PUT", f"{AXIS}/parameters/kp", {"value": "0.125"})
            assert client.done("GET", f"{AXIS}/parameters/kp")["as_described"] is True
            assert client.done("GET", f"{AXIS}/parameters/kd")["described"] is None
        page.get_by_role("button", name="Read").click()
        see(page, "#parameters tr", "machine.toml: 4 mm/s")
        page.locator("#parameters [name=shown]").select_option("described")
        names = page.locator("#parameters tbody tr:visible th").all_inner_texts()
        assert names == ["velocity"]
    finally:
        page.close()
        served.end()


def test_the_statistics_of_the_bus_are_shown(served, page):
    see(page, "#bus li", "the WebSocket client at 127.0.0.1")
    with served.http() as client:
        before = client.done("GET", "/api/bus")["repeats"]
    spoilt = iter([[0x1FF]])
    served.far.from_nodes = lambda word: next(spoilt, [word])
    see(page, "#bus dl > :nth-child(2) dd", str(before + 1))
    see(page, "#bus dd", "per s")
    with served.http() as client:
        found = client.done("GET", "/api/bus")
    assert page.locator("#bus dd").nth(3).inner_text() == str(found["garbled"])


def test_everything_that_can_be_pressed_has_a_name(page):
    nameless = page.evaluate(
        """[...document.querySelectorAll("button, input, select, canvas, [role=img]")]
           .filter(one => !one.parentElement.closest("[role=img]"))
           .filter(one => one.offsetParent !== null)
           .filter(one => !(one.getAttribute("aria-label") || one.labels?.length ||
                            one.textContent.trim()))
           .map(one => one.outerHTML)"""
    )
    assert nameless == []


def test_numbers_are_written_as_people_read_them(page):
    expected = {
        "format.mm(-1234567)": "−1.234\u2009567",
        "format.mm(-0.2)": "0.000\u2009000",
        "format.signed(-0.00001, 3)": "0.000",
        "format.signed(2, 1)": "+2.0",
        "format.lengthOf(' −.5 ', 'um')": "-.5 um",
        "[-1.2, 0, 0.7].map(one => plot.label(one, 0.1))": ["−1.2", "0.0", "0.7"],
        "[0.0475, 0.05].map(one => plot.label(one, 0.0025))": ["0.0475", "0.0500"],
        "[-1e-9, 2000].map(one => plot.label(one, 500))": ["0", "2000"],
    }
    found = page.evaluate(
        f"""async () => {{
            const format = await import("/page/format.js");
            const plot = await import("/page/plot.js");
            return [{", ".join(expected)}];
        }}"""
    )
    assert found == list(expected.values())
