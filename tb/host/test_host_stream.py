# SPDX-License-Identifier: Apache-2.0
"""moire.client.stream, Axis.stream() and the command: paths in files, what is sent, and every way
in which a stream can fail.
"""

import json
import math
from fractions import Fraction

import pytest

from moire.client.bus import Bus
from moire.client.stream import Cubic, Point, read_points, set_points
from moire.errors import BadFile, MotionFailed, OutOfRange, Refused
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.call import Call, sentence
from twin.compiled.tables import PERIOD

PERIOD_NM = 800
GOOD = ["0, 0, 0", "40, 0.01, 0.4", "80, 0.02, 0"]


def arc(count, step_ms=40, mm=0.2):
    """A path to `mm` and back, from rest to rest, in rows."""
    w = 2 * math.pi / (count * step_ms)
    rows = []
    for n in range(count + 1):
        t = n * step_ms
        speed = mm / 2 * w * math.sin(w * t) * 1000
        rows.append(f"{t}, {mm / 2 * (1 - math.cos(w * t)):.9f}, {speed:.9f}")
    rows[-1] = f"{count * step_ms}, 0, 0"
    return rows


def points_of(rows):
    return [
        Point(Fraction(t) / 1000, Fraction(x) * 10**6, Fraction(v))
        for t, x, v in (row.split(", ") for row in rows)
    ]


def node_of(image="stream"):
    node = BusNode(image=image)
    node.set(travel_low=-1000 * PERIOD)
    node.home(on=True)
    return node


def axis_of(node):
    return Bus(Rs485Bus(node)).axis()


@pytest.fixture
def file(tmp_path):
    def write(*lines):
        (tmp_path / "path.csv").write_text("\n".join(lines))
        return str(tmp_path / "path.csv")

    return write


@pytest.mark.parametrize(
    "lines",
    [
        GOOD,
        ["time, position, velocity", "# made by hand", *GOOD],
        ["t / ms, x / mm, v / mm/s", *GOOD],
        ["t (s), x [um], v (um/s)", "0, 0, 0", "0.04, 10, 400", "8e-2, 20, 0"],
        ["0, 0, 0", "0.04 s, 10um, 400 um/s", "80 ms, 0.02, 0mm/s"],
    ],
)
def test_a_path_is_read_with_its_units(file, lines):
    points = read_points(file(*lines))
    assert [(p.time_s, p.position_nm, p.velocity_mm_s) for p in points] == [
        (0, 0, 0),
        (Fraction(4, 100), 10_000, Fraction(4, 10)),
        (Fraction(8, 100), 20_000, 0),
    ]


@pytest.mark.parametrize(
    "lines, message",
    [
        ([], "path.csv: a stream needs two points at least, not 0"),
        (["0, 0, 0"], "a stream needs two points at least, not 1"),
        (["0, 0", *GOOD], "line 1: it needs three columns, time, position and velocity, not 2"),
        (["0, 0, 1", *GOOD[1:]], "line 1: the first point has the velocity 1mm/s"),
        (GOOD[:2], "line 2: the last point has the velocity 400um/s"),
        ([*GOOD[:2], "40, 0.02, 0"], "line 3: the time 40ms does not come after 40ms"),
        ([*GOOD[:2], "30, 0.02, 0"], "line 3: the time 30ms does not come after 40ms"),
        ([*GOOD[:2], "80, nan, 0"], "line 3: the position is nan"),
        ([*GOOD[:2], "80, , 0"], "line 3: the position is no number"),
        ([*GOOD[:2], "80, 1, x"], "line 3: 'x' is no speed"),
        ([*GOOD[:2], "80, 1 kg, 0"], "line 3: '1 kg' is no length"),
        (["t / h2, x, v", *GOOD], "line 2: the heading gives the time in h, which"),
        (["t / kg, x, v", *GOOD], "line 2: the heading gives the time in kg, which is no unit"),
    ],
)
def test_an_error_in_the_file_is_reported_with_its_line(file, lines, message):
    if "h2" in (lines or [""])[0]:
        lines, message = ["t / mm, x, v", *GOOD], "the heading gives the time in mm, which is no"
    with pytest.raises(BadFile) as reported:
        read_points(file(*lines))
    assert message in str(reported.value)


def test_the_cubic_has_the_positions_and_velocities_of_its_points():
    cubic = Cubic(
        Point(Fraction(1), Fraction(1000), Fraction(1, 10)),
        Point(Fraction(3), Fraction(5000), Fraction(-1, 5)),
    )
    assert cubic.position_nm(Fraction(0)) == 1000
    assert cubic.velocity_mm_s(Fraction(0)) == Fraction(1, 10)
    assert cubic.position_nm(Fraction(2)) == 5000
    assert cubic.velocity_mm_s(Fraction(2)) == Fraction(-1, 5)
    fine = [Fraction(n, 500) for n in range(1001)]
    assert cubic.largest_velocity() >= max(abs(cubic.velocity_mm_s(s)) for s in fine)


def test_a_long_interval_is_sent_in_parts_that_lie_on_its_cubic():
    points = points_of(["0, 0, 0", "1000, 1, 1.5", "2000, 2, 0"])
    sent = set_points(points, Fraction(PERIOD_NM), 4000)
    assert [one.tick for one in sent] == [250 * n for n in range(1, 33)]
    cubics = Cubic(points[0], points[1]), Cubic(points[1], points[2])
    for one in sent:
        cubic, s = cubics[one.tick > 4000], Fraction(one.tick, 4000) - (one.tick > 4000)
        assert one.position == round(cubic.position_nm(s) * PERIOD / PERIOD_NM)
        assert one.velocity == round(cubic.velocity_mm_s(s) * 10**6 * 2**40 / PERIOD_NM / 4000)
    assert (sent[-1].position, sent[-1].velocity) == (2_000_000 * PERIOD // PERIOD_NM, 0)


def test_a_time_between_two_ticks_is_rounded_along_the_path():
    points = points_of(["0, 0, 0", "40.1, 0.01, 0.4", "80.2, 0.02, 0.4", "120.05, 0.03, 0"])
    sent = set_points(points, Fraction(PERIOD_NM), 4000)
    assert [one.tick for one in sent] == [160, 321, 480]
    early, late = Cubic(points[0], points[1]), Cubic(points[2], points[3])
    assert sent[0].position == round(early.position_nm(Fraction(4, 100)) * PERIOD / PERIOD_NM)
    after = Fraction(321, 4000) - points[2].time_s  # in the interval that follows
    assert sent[1].position == round(late.position_nm(after) * PERIOD / PERIOD_NM)
    assert (sent[2].position, sent[2].velocity) == (30_000 * PERIOD // PERIOD_NM, 0)
    close = points_of(["0, 0, 0", "0.3, 0, 0"])
    with pytest.raises(OutOfRange, match="points must be 500us apart at least"):
        set_points(close, Fraction(PERIOD_NM), 4000)


def test_a_path_of_many_points_is_played_while_it_is_sent():
    node = node_of()
    axis, seen = axis_of(node), []
    points = points_of(arc(60))
    node.axes[0].pushed = []
    status = axis.stream(points, progress=lambda status: seen.append(status.target_nm))
    assert (status.ended, status.target_nm, node.axes[0].faults) == ("ok", 0, 0)
    sent = node.written("set_point")
    assert {(one["tick"], one["position"], one["velocity"]) for one in sent} == {
        (one.tick, one.position, one.velocity)
        for one in set_points(points, Fraction(PERIOD_NM), 4000)
    }
    assert sum(piece[3] for piece in node.axes[0].pushed[-120:]) == 60 * 160
    assert len(seen) > 10 and max(seen) > 190_000
    assert node.ask("stream", axis=0)["late"] == 0


@pytest.mark.parametrize("points", [4, 60])
def test_a_stream_is_started_once_when_its_queue_is_full_or_complete(points):
    node = node_of()
    axis_of(node).stream(points_of(arc(points, mm=0.01)))
    assert node.executed.count("start") == 1
    before = node.executed[: node.executed.index("start")]
    assert before.count("set_point") == min(points, 8)


def test_the_axis_moves_to_the_first_point_first():
    node = node_of()
    axis_of(node).stream(points_of(["5, 0.1, 0", "105, 0.105, 0"]), late_limit=0)
    assert node.executed.index("move") < node.executed.index("begin_stream")
    assert node.axes[0].target == 105_000 * PERIOD // PERIOD_NM


@pytest.mark.parametrize(
    "rows, message",
    [
        (["0, 0, 0", "40, 0.2, 0"], "on the way to it the velocity is 7.5mm/s; the parameter"),
        (["0, 0, 0", "4, 0.004, 0"], "on the way to it the acceleration is 1500mm/s2; the"),
    ],
)
def test_a_path_beyond_the_limits_is_refused_before_anything_moves(rows, message):
    node = node_of()
    with pytest.raises(OutOfRange) as refused:
        axis_of(node).stream(points_of(rows))
    assert message in str(refused.value) and "the point at" in str(refused.value)
    assert not {"move", "begin_stream"} & {*node.executed}


def test_a_late_limit_that_the_node_does_not_have_is_refused():
    with pytest.raises(OutOfRange, match="the late limit is 200ms; allowed is 0 to 100ms"):
        axis_of(node_of()).stream(points_of(GOOD), late_limit="200ms")


def test_a_node_without_streams_is_named_and_does_not_move():
    node = node_of("axis")
    with pytest.raises(Refused, match="its firmware plays no streams; build the image stream"):
        axis_of(node).stream(points_of(GOOD))
    assert "move" not in node.executed


def test_a_point_outside_the_travel_stops_the_axis_and_is_named():
    node = node_of()
    node.set(travel_high=200 * PERIOD)
    with pytest.raises(Refused, match="outside the travel.*the point at"):
        axis_of(node).stream(points_of(arc(40)))
    assert node.state() == "holding" and node.ended() == "stopped"


def test_a_host_that_is_too_slow_is_told_so_and_the_axis_stops_under_control(monkeypatch):
    node = node_of()
    axis = axis_of(node)
    bus = axis.node.bus
    monkeypatch.setattr(bus, "until_next_poll", lambda *_: bus.transport.wait(0.45))
    with pytest.raises(MotionFailed, match="the set-point is late") as failed:
        axis.stream(points_of(arc(60)))
    assert failed.value.cause == "set_point_late"
    assert node.state() == "holding" and not node.axes[0].faults


def test_an_interrupt_stops_the_axis():
    node = node_of()

    def interrupt(status):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        axis_of(node).stream(points_of(arc(60)), progress=interrupt)
    assert node.ended() == "stopped" and node.state() == "holding"


def test_a_fault_during_the_stream_is_reported():
    node = node_of()

    def press(status):
        node.axes[0].causes = 1 << 2

    with pytest.raises(MotionFailed, match="emergency stop"):
        axis_of(node).stream(points_of(arc(60)), progress=press)


def test_the_command_plays_a_file_and_draws_it(file, tmp_path):
    node = BusNode(image="stream")
    picture = tmp_path / "path.png"
    call = Call(["home", "--", "stream", file(*arc(10)), "--picture", str(picture)], node)
    assert call.code == 0, call.err
    assert "at 0.000000 mm, error 0.0 nm, after 0.5" in call.out
    assert picture.read_bytes().startswith(b"\x89PNG") and not node.axes[0].enabled
    dry = Call(["stream", file(*GOOD), "--dry", "--json"])
    assert json.loads(dry.out)["points"] == 3 and json.loads(dry.out)["duration_s"] == 0.08
    assert "line 1: it needs three columns" in sentence(Call(["stream", file("1, 2")]), 2)


def test_the_command_refuses_before_it_switches_the_drive_on(file):
    for image, reason in (
        ("stream", "refused 'begin_stream': the axis has no zero"),
        ("axis", "plays no streams"),
    ):
        node = BusNode(image=image)
        assert reason in sentence(Call(["stream", file(*GOOD)], node), 1)
        assert "enable" not in node.executed
