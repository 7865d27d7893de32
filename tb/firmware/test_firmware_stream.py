# SPDX-License-Identifier: Apache-2.0
"""stream.c against its model in integers: exact pieces, limits, lateness, stops, and the way back
to profiles.
"""

import math
import random
from fractions import Fraction

import pytest

from tb.bench import seed
from tb.control import motion_engine
from tb.firmware.stream_model import cubic, pieces_to, targets
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import CLK_HZ, PERIOD

ONE = 1 << 40  # a period
TAIL = 150_000 * 4000 // CLK_HZ + 4  # ticks of the last piece of a set-point
TICK_HZ = 4000
VELOCITY, ACCELERATION = 6000, 125_000  # the limits in period/s and period/s2
TRAVEL = {
    "travel_low": -5000 * PERIOD,
    "travel_high": 20_000 * PERIOD,
    "home_method": 37,
    "position_source": 1,
}


def homed(axes=1):
    machine = CompiledNode(*(Axis() for _ in range(axes)), image="stream")
    for n in range(axes):
        machine.set(axis=n, **TRAVEL)
        machine.ask("enable", axis=n, on=1)
        machine.ask("home", axis=n)
    assert machine.run(
        1000, until=lambda: all(machine.status(n)["ended"] == "ok" for n in range(axes))
    )
    for axis in machine.axes:
        axis.pushed = []
    return machine


def per_tick(velocity):
    """A velocity in period/s on the bus."""
    return round(velocity * ONE / TICK_HZ)


def point(tick, position, velocity=0.0, last=0, axis=0):
    """The fields of a set-point; position and velocity in periods and periods per second."""
    return dict(
        axis=axis,
        last=last,
        tick=tick,
        position=round(position * PERIOD),
        velocity=per_tick(velocity),
    )


def sine(tick, amplitude=50.0, hz=1.0):
    """A path from rest to rest in a whole period: position and velocity."""
    w, t = 2 * math.pi * hz, tick / TICK_HZ
    return amplitude * (1 - math.cos(w * t)) / 2, amplitude * w * math.sin(w * t) / 2


def begin(machine, late_limit=0, axis=0):
    machine.ask("begin_stream", axis=axis, late_limit=late_limit)


def play(machine, points, started=False):
    """Send set-points as there is room, start the stream, and run until it has settled."""
    for n, fields in enumerate(points):
        while (cause := machine.request("set_point", **fields)[0]) == "queue_full":
            if not started:
                machine.ask("start", axes=1)
                started = True
            machine.run(1)
        assert cause == "ok", (n, cause)
    if not started:
        machine.ask("start", axes=1)
    return ended(machine)


def ended(machine, axis=0):
    assert machine.run(20_000, until=lambda: machine.status(axis)["ended"] != "running")
    return machine.status(axis)["ended"]


def model_of(points, tail=TAIL):
    """The pieces of the model."""
    pieces, state, tick = [], (0, 0), 0
    for fields in points:
        more, state = pieces_to(
            state,
            fields["tick"] - tick,
            fields["position"],
            fields["velocity"],
            tail,
            fields["last"],
        )
        pieces += more
        tick = fields["tick"]
    return pieces


def random_path(draw, end=4000):
    """A period of a sine, from rest to rest, at random intervals."""
    ticks = [0]
    while end - ticks[-1] > 256:
        most = min(256, end - ticks[-1] - 2)
        ticks.append(ticks[-1] + min(most, draw.choice([2, 3, 8, 40, 41, 155, 200, 256])))
    return [point(t, *sine(t)) for t in ticks[1:]] + [point(end, 0, last=1)]


def test_the_pieces_are_those_of_the_model_and_pass_through_every_set_point():
    draw = random.Random(seed())
    machine = homed()
    points = random_path(draw)
    begin(machine)
    assert play(machine, points) == "ok"
    pieces = model_of(points)
    assert machine.axes[0].pushed == pieces
    assert machine.axes[0].target == points[-1]["position"]
    made = [0, *targets(pieces)]
    for fields in points[:-1]:
        assert abs(made[fields["tick"]] - (fields["position"] << 24)) < 1 << 24, fields
    state = machine.ask("stream", axis=0)
    assert state["open"] == 0 and state["accepted"] == len(points)
    assert state["late"] == state["extrapolated"] == 0


def test_the_motion_engine_makes_the_targets_of_the_model():
    """Its model in integers is equal to the hardware in every bit."""
    draw = random.Random(seed())
    points = random_path(draw, 2000)
    pieces = model_of(points, tail=14)
    axis, left, made = motion_engine.Axis(), list(pieces), []
    axis.settings["override"] = motion_engine.FULL

    def feed():
        while left and len(axis.queue) < motion_engine.DEPTH:
            velocity, acceleration, jerk, ticks, last = left.pop(0)
            axis.settings |= dict(
                segment_velocity=velocity,
                segment_acceleration=acceleration,
                segment_jerk=jerk,
                segment_ticks=ticks | last * motion_engine.LAST,
            )
            axis.serve({"push"}, 0)

    feed()
    axis.serve({"start"}, 0)
    axis.tick(0, 15_000)  # prepares the first step
    for _ in range(2000):
        feed()
        axis.tick(0, 15_000)
        made.append(axis.target)
    assert made[:-1] == [target >> 24 for target in targets(pieces)][:-1]
    assert made[-1] == points[-1]["position"] and not axis.moving


@pytest.mark.parametrize("ticks", [2, 3, 4, 40, 155, 256])
def test_between_two_set_points_the_target_is_the_cubic(ticks):
    """The deviation from the true cubic is that of a discrete velocity: |jerk| T / 124."""
    count = max(8, 400 // ticks)
    path = [sine(n * ticks, 20.0, TICK_HZ / ticks / count) for n in range(count + 1)]
    points = [
        point(n * ticks, *(path[n] if n < count else (0.0, 0.0)), last=int(n == count))
        for n in range(1, count + 1)
    ]
    made = [0, *targets(model_of(points, tail=14))]
    knots = [(Fraction(0), Fraction(0))] + [
        (Fraction(p["position"] << 24), Fraction(p["velocity"])) for p in points
    ]
    for n, (first, second) in enumerate(zip(knots, knots[1:])):
        for tick in range(ticks if n < count - 1 else ticks - 1):
            true, jerk = cubic(first, second, ticks, tick)
            before = cubic(knots[n - 1], first, ticks, 0)[1] if n else Fraction(0)
            bound = abs(jerk - before) * 2 + abs(jerk) * ticks / 120 + (1 << 20)
            assert abs(made[n * ticks + tick] - true) <= bound


def test_rounding_does_not_add_up_over_thousands_of_set_points():
    points = [
        point(40 * n, 0.001 * n + 1 / 3, 0.1) if n < 5000 else point(40 * n, 5.0, last=1)
        for n in range(1, 5001)
    ]
    made = [0, *targets(model_of(points, tail=14))]
    errors = [abs(made[p["tick"]] - (p["position"] << 24)) for p in points[:-1]]
    assert max(errors) < 1 << 15  # 2^-25 period


def test_a_stream_is_refused_where_a_motion_would_be():
    machine = homed()
    assert machine.request("begin_stream", axis=0, late_limit=401)[0] == "out_of_range"
    assert machine.request("begin_stream", axis=1, late_limit=0)[0] == "no_such_axis"
    assert machine.request("set_point", **point(40, 0))[0] == "no_stream"
    machine.ask("move", axis=0, target=9000 * PERIOD)
    machine.run(20)
    assert machine.request("begin_stream", axis=0, late_limit=0)[0] == "busy"
    machine.ask("enable", axis=0, on=0)
    assert machine.request("begin_stream", axis=0, late_limit=0)[0] == "not_enabled"
    fresh = CompiledNode(Axis(), image="stream")
    fresh.set(**TRAVEL)
    fresh.ask("enable", axis=0, on=1)
    assert fresh.request("begin_stream", axis=0, late_limit=0)[0] == "not_homed"


@pytest.mark.parametrize("image", ["axis", "steps", "station"])
def test_an_image_without_streams_says_not_built(image):
    machine = CompiledNode(Axis(), image=image)
    for operation, fields in (
        ("begin_stream", dict(axis=0, late_limit=0)),
        ("set_point", point(40, 0)),
        ("stream", dict(axis=0)),
    ):
        assert machine.request(operation, **fields)[0] == "not_built"


@pytest.mark.parametrize(
    "fields, cause",
    [
        (point(1, 0), "set_point_late"),
        (point(0, 0), "set_point_late"),
        (point(257, 0), "out_of_range"),
        (point(200, 0, last=2), "out_of_range"),
        (point(200, 20_001), "out_of_travel"),
        (point(200, -5001), "out_of_travel"),
        (point(200, 1, 1.0, last=1), "set_point_limits"),  # not at rest
        (point(256, 0, VELOCITY + 1), "set_point_limits"),
        (point(256, 10_000), "set_point_limits"),  # it cannot be reached
        (point(4, 0.02), "set_point_limits"),  # too much acceleration
        (point(2, 2000), "set_point_limits"),  # a jerk above 32 bits
        (point(200, 100, 4 * ACCELERATION * 0.05), "set_point_limits"),
    ],
)
def test_a_set_point_that_cannot_be_played_is_refused_by_name_and_changes_nothing(fields, cause):
    machine = homed()
    begin(machine)
    assert machine.request("set_point", **fields)[0] == cause
    assert not machine.axes[0].pushed
    state = machine.ask("stream", axis=0)
    assert state["end"] == state["accepted"] == 0 and state["open"] == 1
    assert state["late"] == (cause == "set_point_late")
    assert play(machine, [point(200, 5.0, last=1)]) == "ok"
    assert machine.axes[0].target == 5 * PERIOD


def test_the_peak_of_the_velocity_between_two_set_points_is_limited_too():
    """From 5000 period/s to 5000: the mean velocity is 6100, so it is higher between them."""
    machine = homed()
    begin(machine)
    machine.ask("set_point", **point(256, 160, 5000))
    higher = point(456, 160 + 6100 * 0.05, 5000)
    assert machine.request("set_point", **higher)[0] == "set_point_limits"
    machine.ask("set_point", **point(456, 160 + 5400 * 0.05, 5000))


def test_the_queue_is_reported_and_a_full_one_refuses():
    machine = homed()
    begin(machine)
    room = machine.ask("stream", axis=0)["room"]
    assert room == 8
    for n in range(1, 9):
        assert machine.ask("set_point", **point(200 * n, n * 0.01))["room"] == 8 - n
    assert machine.request("set_point", **point(1800, 0))[0] == "queue_full"
    state = machine.ask("stream", axis=0)
    assert (state["room"], state["queued"], state["end"]) == (0, 1600, 1600)


def test_the_end_of_the_queue_is_extrapolated_until_the_late_limit_then_the_axis_stops():
    machine = homed()
    begin(machine, late_limit=2 * TAIL + 10)
    machine.ask("set_point", **point(200, 10, 400))
    machine.ask("start", axes=1)
    assert ended(machine) == "set_point_late"
    axis = machine.axes[0]
    assert [piece[3] for piece in axis.pushed] == [200 - TAIL, TAIL, TAIL, TAIL]
    assert all(piece[1:3] == (0, 0) for piece in axis.pushed[2:])
    assert not axis.faults and machine.status()["state"] == "holding"
    state = machine.ask("stream", axis=0)
    assert (state["open"], state["extrapolated"]) == (0, 2 * TAIL)
    assert machine.request("set_point", **point(900, 10))[0] == "no_stream"
    assert len({piece[0] for piece in axis.pushed[2:]}) == 1  # constant velocity


def test_without_a_late_limit_a_missing_set_point_stops_the_axis_at_once():
    machine = homed()
    begin(machine)
    machine.ask("set_point", **point(200, 10, 400))
    machine.ask("start", axes=1)
    assert ended(machine) == "set_point_late"
    assert [piece[3] for piece in machine.axes[0].pushed] == [200 - TAIL, TAIL]
    assert not machine.axes[0].faults


def test_a_late_set_point_is_reached_from_where_the_stream_is_and_one_that_is_over_is_counted():
    machine = homed()
    begin(machine, late_limit=TAIL)
    machine.ask("set_point", **point(200, 10, 400))
    machine.ask("start", axes=1)
    assert machine.run(1000, until=lambda: machine.ask("stream", axis=0)["extrapolated"])
    over = machine.ask("stream", axis=0)["end"]
    assert over == 200 + TAIL
    assert machine.request("set_point", **point(over, 26, 400))[0] == "set_point_late"
    assert machine.request("set_point", **point(200, 10, 400))[0] == "set_point_late"
    at = 10 + (over - 200) * 400 / TICK_HZ
    machine.ask("set_point", **point(over + 200, at + 10, 0, last=1))
    assert ended(machine) == "ok" and machine.axes[0].target == round((at + 10) * PERIOD)
    assert machine.ask("stream", axis=0)["late"] == 2
    middle = machine.axes[0].pushed[2]
    assert middle == (middle[0], 0, 0, TAIL, 0)


def test_a_lost_set_point_makes_the_next_interval_longer():
    machine = homed()
    begin(machine)
    points = [point(60 * n, *sine(60 * n, 20, 2)) for n in range(1, 33)]
    points = [p for n, p in enumerate(points) if n % 5 != 3] + [point(2000, 0, last=1)]
    assert play(machine, points) == "ok"
    assert machine.axes[0].pushed == model_of(points)


@pytest.mark.parametrize("started", [True, False])
def test_a_stop_ends_the_stream_and_a_profile_begins_where_it_stopped(started):
    machine = homed()
    begin(machine)
    for n in range(1, 8):
        machine.ask("set_point", **point(200 * n, 20 * n, 400))
    if started:
        machine.ask("start", axes=1)
        machine.run(150)
    machine.ask("stop", axis=0)
    assert ended(machine) == "stopped"
    assert machine.request("set_point", **point(2000, 0))[0] == "no_stream"
    assert machine.ask("stream", axis=0)["open"] == 0
    at = machine.axes[0].target
    assert (at > 0) == started
    machine.axes[0].pushed = []
    machine.ask("move", axis=0, target=at + 50 * PERIOD)
    assert ended(machine) == "ok" and machine.axes[0].target == at + 50 * PERIOD
    assert machine.axes[0].pushed[0][0] < per_tick(40)  # from rest


def test_profile_and_stream_follow_each_other_without_a_jump():
    machine = homed()
    position = 0
    for _ in range(2):
        machine.ask("move", axis=0, target=round((position + 7) * PERIOD) + 3)
        assert ended(machine) == "ok"
        at = machine.axes[0].target / PERIOD
        begin(machine)
        assert play(machine, [point(250, at + 3, 20), point(500, at + 4, last=1)]) == "ok"
        assert machine.axes[0].target == round((at + 4) * PERIOD)
        position = at + 4


def test_a_fault_ends_the_stream():
    machine = homed()
    begin(machine, late_limit=400)
    machine.ask("set_point", **point(200, 10, 400))
    machine.ask("start", axes=1)
    machine.run(20)
    machine.axes[0].causes = 1 << 2  # emergency stop
    assert ended(machine) == "ended_by_fault"
    assert machine.request("set_point", **point(400, 20))[0] == "no_stream"
    machine.axes[0].causes = 0
    machine.ask("reset_faults", axis=0)
    machine.ask("enable", axis=0, on=1)
    assert machine.ask("stream", axis=0)["open"] == 0
    machine.axes[0].pushed = []
    machine.ask("move", axis=0, target=0)
    assert ended(machine) == "ok" and machine.axes[0].target == 0


def test_another_target_is_refused_while_a_stream_plays():
    machine = homed()
    begin(machine)
    for n in range(1, 8):
        machine.ask("set_point", **point(200 * n, 20 * n, 400))
    machine.ask("start", axes=1)
    machine.run(100)
    assert machine.request("move", axis=0, target=0)[0] == "busy"
    assert machine.request("begin_stream", axis=0, late_limit=0)[0] == "busy"
    machine.ask("stop", axis=0)
    assert ended(machine) == "stopped"


def test_a_stream_goes_on_while_another_axis_gets_a_new_target_in_flight():
    machine = homed(axes=2)
    begin(machine, late_limit=400)
    machine.ask("move", axis=1, target=8000 * PERIOD)
    for n in range(1, 9):
        machine.ask(
            "set_point", **point(200 * n, *((n, 20) if n < 8 else (8, 0)), last=int(n == 8))
        )
    machine.ask("start", axes=1)
    machine.run(100)
    machine.ask("move", axis=1, target=4000 * PERIOD)
    assert ended(machine) == "ok" and machine.axes[0].target == 8 * PERIOD
    assert ended(machine, axis=1) == "ok" and machine.axes[1].target == 4000 * PERIOD
    assert not machine.axes[0].faults and not machine.axes[1].faults
