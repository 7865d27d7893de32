# SPDX-License-Identifier: Apache-2.0
"""Streamed set-points through registers, on two simulated nodes: the S0 stage with its motor, and a
stepper stage. The host writes the registers over the bus; hardware plays the set-points.
"""

import math
import random

import pytest

from moire.client.bus import Bus
from moire.errors import OutOfRange, Refused
from moire.made.bus_tables import CAUSES
from tb.bench import seed
from tb.control.set_point_piece import piece_of, played
from tb.control.set_point_player import signed
from twin import Twin, TwinTransport, build
from twin.nodes.twin import NODE, Node, drives
from twin.nodes.twin import Axis as Machine

PARAMETERS = (
    NODE | drives("HAS_BRIDGE", "HAS_STEPPER") | {"HAS_SET_POINTS": 255, "HAS_BACKLASH": 255}
)
TOP = (1 << 46, 1 << 46)  # no limits: the model of a path that was accepted
INTERVAL = 240  # ticks, 60 ms: four writes at 115 200 baud take some 25 ms
POINTS = 10  # intervals of a wave
FIRST = 240  # ticks until the first set-point: at most 255 after what is queued
STEPPER = {
    "drive": 1,
    "position_source": 2,
    "period": "5um",
    "steps_per_period": 4,
    "ki": 0,
    "encoder_fault_mask": 0,  # it has no sine and cosine
    "settle_window": "2um",  # more than a step
}
S0_ADDRESS, STEPPER_ADDRESS = 1, 2


CODES = {name: code for code, (name, *_) in CAUSES.items()}


class Host:
    """A host that knows the registers of one axis only."""

    def __init__(self, twin, axis):
        self.twin, self.axis, self.node = twin, axis, axis.node
        self.requests = dict(enable=0, home=0, stream=0, reset_faults=0)
        self.points = []  # (tick, position, velocity) of those that were committed

    def read(self, name):
        fields = self.node.read_named(name)
        return fields["value"] if set(fields) == {"value"} else fields

    def write(self, name, value):
        self.node.write_named(name, value=value)

    def request(self, **changes):
        self.requests |= changes
        self.node.write_named("node.axis_requests", **self.requests)
        self.twin.run(0.03)
        return self.read("axis.supervision")

    def begin(self, late_limit=400):
        """Enabled, homed and prepared, all by registers."""
        self.request(enable=1, home=0, stream=0)
        self.request(home=1)
        self.write("node.late_limit", late_limit)
        self.until(lambda: self.read("axis.supervision")["homed"])
        self.until(lambda: self.status() == "holding")
        shown = self.request(stream=1)
        assert shown["refusal"] == 0
        assert self.read("axis.stream_state")["mode"] == 1 and self.status() == "prepared"
        self.points = [(0, self.read("axis.target"), 0)]

    def until(self, met, most=100):
        for _ in range(most):
            if met():
                return
            self.twin.run(0.02)
        raise AssertionError("it did not happen")

    def status(self):
        return self.axis.status().state

    def commit(self, tick, position, velocity):
        """velocity in 2^-24 period per tick. Without a tick, it is FIRST ticks from now."""
        self.write("axis.set_point_position", position)
        self.write("axis.set_point_velocity", velocity)
        tick = self.read("node.tick_count") + FIRST if tick is None else tick
        self.write("node.set_point_tick", tick)
        self.write("node.set_point_commit", 1)
        self.points.append((tick, position, velocity))

    def wave(self, n, size, count=POINTS):
        """The set-point n of a wave, which begins and ends at rest."""
        angle = 2 * math.pi * n / count
        speed = size * 2 * math.pi / count / INTERVAL * math.sin(angle)
        return self.points[0][1] + round(size * (1 - math.cos(angle))), round(speed * 256)

    def commit_wave(self, n, size):
        tick = self.points[1][0] + INTERVAL * n if n else None
        self.commit(tick, *self.wave(n, size))

    def targets(self):
        """{tick: target} from the first set-point on, by the model."""
        (tick, position, _), *rest = self.points[1:]
        state, found = (position << 24, 0), {tick: position}
        for at, position, velocity in rest:
            _, piece = piece_of(state, (position, velocity << 16), at - tick, TOP)
            for n, (place, fast, _) in enumerate(played(state, *piece[:2], at - tick), start=1):
                found[tick + n] = place + (fast >> 1) >> 24
            state, tick = piece[2:], at
        return found

    def seen(self):
        """(tick before, target, tick after)"""
        return self.read("node.tick_count"), self.read("axis.target"), self.read("node.tick_count")


@pytest.fixture(scope="module")
def hosts():
    machines = [
        Node(S0_ADDRESS, [Machine("stage")]),
        Node(STEPPER_ADDRESS, [Machine("stepper_stage", {"stepper_microsteps": 20})]),
    ]
    image = build.firmware("stream")
    with Twin(machines, seed() % 1000, firmware=image, node_parameters=PARAMETERS) as twin:
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed()), poll_s=0.004)
        twin.run_until_ready()
        found = {}
        for address in (S0_ADDRESS, STEPPER_ADDRESS):
            axis = bus.axis(address)
            for name, value in (STEPPER if address == STEPPER_ADDRESS else {}).items():
                axis.set_parameter(name, value)
            axis.set_parameter("home_method", 35)
            axis.set_parameter("travel_low", "-1mm")
            axis.set_parameter("travel_high", "1mm")
            found[address] = Host(twin, axis)
        yield found


@pytest.fixture
def host(hosts):
    """The S0 axis."""
    yield hosts[S0_ADDRESS]
    hosts[S0_ADDRESS].request(enable=0, home=0, stream=0, reset_faults=0)


def test_a_stream_needs_a_drive_that_is_on_and_an_axis_that_is_homed(host):
    assert host.request(stream=1)["refusal"] == CODES["not_enabled"]
    host.request(stream=0)
    host.request(stream=0, enable=1)
    assert host.request(stream=1)["refusal"] == CODES["not_homed"]
    host.request(stream=0, home=1)
    host.axis.override(0.5)
    assert host.request(stream=1)["refusal"] == CODES["out_of_range"]
    host.axis.override(1)
    with pytest.raises(Refused) as why:
        host.write("axis.stream_velocity_limit", 1)  # it is the firmware's
    assert why.value.cause == "no_such_register"


@pytest.mark.parametrize("address, size", [(S0_ADDRESS, 20_000), (STEPPER_ADDRESS, 40_000)])
def test_an_axis_follows_a_streamed_wave_tick_by_tick_and_is_released_at_rest(hosts, address, size):
    host = hosts[address]
    host.begin()
    seen = []
    for n in range(POINTS + 1):
        host.commit_wave(n, size)
        first = host.points[1][0]
        if n > 2:
            while signed(host.read("node.tick_count") - first) < INTERVAL * (n - 2):
                seen.append(host.seen())
    while signed(host.read("node.tick_count") - first) < INTERVAL * POINTS - 40:
        seen.append(host.seen())
    assert host.read("axis.stream_counts") == dict(accepted=POINTS + 1, late=0, refused=0)
    path = host.targets()
    for before, target, after in seen:
        assert target in {path.get(tick) for tick in range(before, after + 1)}, (before, target)
    assert len({target for _, target, _ in seen}) > 12
    host.request(stream=0)
    host.until(lambda: host.status() == "holding")
    status = host.axis.status()
    assert status.ended == "ok" and not status.faults
    assert host.read("axis.stream_state")["ended"] == 1
    assert abs(host.read("axis.target") - host.points[0][1]) <= 1
    host.axis.move(nm=10_000)  # a profile of its own
    host.request(enable=0, home=0)


def table_um(host, *targets_um):
    """True positions of the table after moves to these targets."""
    found = []
    for target in targets_um:
        host.axis.move(nm=1000 * target)
        found.append(host.twin.truth(1).position_m * 1e6 - target)
    return found


def test_without_a_scale_the_backlash_of_a_screw_is_taken_up_at_each_reversal(hosts):
    """The screw has 5 um, and winds up by some 1.5 um against friction; a step is 1.25 um."""
    host = hosts[STEPPER_ADDRESS]
    host.request(enable=1)
    host.request(home=1)
    host.until(lambda: host.read("axis.supervision")["homed"] and host.status() == "holding")
    up, down = table_um(host, 0, 100, 50)[1:]
    before = down - up
    assert 5 < before < 8
    host.axis.set_backlash("5um", "1mm/s", "0.5um", motor_side=True)
    up, down = table_um(host, 0, 100, 50)[1:]
    assert abs(before - (down - up) - 5) < 1.3
    position = host.axis.status()
    assert abs(position.position_nm - 50_000) <= 1250  # it is that of the table, in whole steps
    built = host.node.read_named("feedback.backlash_rate")
    assert built["motor_side"] == 1 and built["value"] == round(1e6 / 5000 * 65536 / 4000)
    host.axis.set_backlash(0, "10mm/s", 0)


@pytest.mark.parametrize(
    "settings", [("-1um", 1, 0), ("2mm", 1, 0), (0, 0, 0), (0, "9m/s", 0), (0, 1, "5um")]
)
def test_a_backlash_outside_its_range_is_refused(host, settings):
    with pytest.raises(OutOfRange, match="the backlash must be 0 to 204"):
        host.axis.set_backlash(*settings)


def test_a_late_stream_stops_under_control_and_says_so(host):
    host.begin(late_limit=40)
    for n in range(3):
        host.commit_wave(n, 20_000)
    host.until(lambda: host.status() == "holding")
    stream, status = host.read("axis.stream_state"), host.axis.status()
    assert status.ended == "set_point_late" and not status.faults
    assert (stream["ended"], stream["extrapolated"]) == (3, 40)
    assert host.read("axis.supervision")["ended"] == CODES["set_point_late"]
    # it begins again only after the request has fallen
    host.twin.run(0.05)
    assert host.read("axis.stream_state")["mode"] == 0
    host.request(stream=0)
    assert host.request(stream=1)["refusal"] == 0
    assert host.read("axis.stream_state")["mode"] == 1


def test_other_motions_are_refused_and_a_stop_ends_the_stream(host):
    host.begin()
    for n in range(3):
        host.commit_wave(n, 20_000)
    host.until(lambda: host.read("axis.stream_state")["mode"] == 2)
    for refused in (
        lambda: host.axis.move(nm=100),
        lambda: host.axis.home(),
        lambda: host.axis.override(0.5),
    ):
        with pytest.raises(Refused) as why:
            refused()
        assert why.value.cause == "busy"
    host.axis.stop()
    host.until(lambda: host.status() == "holding")
    assert host.axis.status().ended == "stopped"
    assert host.read("axis.stream_state")["ended"] == 2
    host.commit(host.read("node.tick_count") + 100, 0, 0)
    assert host.read("axis.stream_state")["refusal"] == 6


def test_a_fault_ends_the_stream_and_a_host_resets_it_by_registers(host):
    host.begin()
    for n in range(2):
        host.commit_wave(n, 20_000)
    with host.twin.fault("estop"):
        host.twin.run(0.02)
        assert host.status() == "faulted" and host.read("axis.stream_state")["ended"] == 4
        assert host.axis.status().ended == "ended_by_fault"
        assert (
            host.request(enable=0, stream=0, reset_faults=1)["refusal"] == CODES["fault_persists"]
        )
    host.request(reset_faults=0)
    assert host.request(reset_faults=1) == dict(
        state=0, homed=1, ended=CODES["ended_by_fault"], refusal=0
    )
    host.request(reset_faults=0)
