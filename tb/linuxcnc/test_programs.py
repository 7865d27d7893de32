# SPDX-License-Identifier: Apache-2.0
"""LinuxCNC without a screen runs G-code through the driver, in lockstep with a node that has ideal
axes. Skipped by name where LinuxCNC is not installed (`make linuxcnc`).

A start of LinuxCNC takes seconds: all programs run in one of them, one after the other, and the
tests look at their parts of the path.
"""

import fcntl
import math
import os
import pty
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy
import pytest

from linuxcnc_config import headless
from linuxcnc_config.generate import Spindle, load
from linuxcnc_config.programs import (
    FIRST_LINE,
    PASSES,
    SURFACE,
    TOUCHED,
    circle,
    corners,
    grooves_of,
    helix,
    moments,
    passes_text,
    pocket,
    thread_errors,
    threaded,
)
from linuxcnc_config.set_up import set_up
from moire.client.link import Captures
from tb.linuxcnc.ideal_node import (
    CLK_HZ,
    PERIOD_CYCLES,
    STILL,
    STREAMING,
    TICK,
    IdealAxis,
    IdealNode,
    Served,
)

SESSION = 0x4D01
PERIODS_PER_MM = 250.0
TICK_S = TICK / CLK_HZ
# where the acceleration of 500 mm/s2 steps: the velocity of a set-point, from its two neighbours at
# 1 ms, differs by a quarter of the step, and the cubic by 4/27 of this over 1 ms; four in a row
MOST_ERROR_MM = 4 * 500 * 1e-6 / 4 * 4 / 27
PERIODS_PER_TURN, TURNS_S, PITCH_MM = 1024, 20, 0.5
CAPTURES = Captures(PERIOD_CYCLES / CLK_HZ, 0.3e-3)
LSB_MM = 1 / 65536 / PERIODS_PER_MM

PROGRAMS = {
    "circle": circle((5, 5), 2, 1, 600),
    "pocket": pocket((3, 3), 2, 1, 1, 900),
    "helix": helix((6, 6), 1, 2, 3, 600),
    "corners": corners((3, 3, 2), 2, 0.05, 900),
    "surface": SURFACE.program([(24, 4), (26, 6)], 3, 600),
    "threaded": threaded((3, 3, 5), 2, PITCH_MM, TURNS_S),
}
LATHE = passes_text((6, 3, 5), 3, PITCH_MM, TURNS_S)
GANTRY = """
title = "portal"
[node]
image = "steps_stream"
memory_kib = 64
address = 1
[linuxcnc]
bus = "/dev/ttyUSB0"
node = "serial:/dev/ttyUSB1:6000000"
""" + "".join(
    f"""
[[axis]]
name = "{name}"
drives = ["stepper"]
[axis.linuxcnc]
{keys}
"""
    for name, keys in {
        name: 'gantry = "Y"\napart_um = 50'
        if name == "Y2"
        else "period_um = 4\ntravel = [-1, 149]\nvelocity = 50\nacceleration = 500"
        for name in ("X", "Y", "Y2", "Z")
    }.items()
)
PLL_PINS = [f"moire.0.{name}" for name in ("pll-locked", "pll-phase-error", "capture-age")]
LATCHES = [f"moire.0.axis.{n}.position-latch" for n in range(3)]
COUNTS = [f"moire.0.encoder.3.{name}" for name in ("count", "rawcounts")]
PINS = {  # steps after a program
    "surface": [
        ["pins", *LATCHES],
        ["pin", "moire.0.digin.0.in", False],
        ["pin", "moire.0.digin.0.in-not", True],
    ],
    "lathe": [
        ["pins", *COUNTS],
        ["set", "moire.0.encoder.3.reset", 1],
        ["pin", "moire.0.encoder.3.count", 0],
    ],
}
EXPIRED = "moire.0.watchdog.has-bit"
REFUSED = [f"moire.0.{name}" for name in ("requests-refused", "refused-cause")]
LOST = {"cable": 300, "burst": 12}  # packets; more and less than the watchdog of the node waits
HELD = circle((12, 16), 2, 1, 600)
STOPPED = {  # what interrupts a circle
    "estop": circle((6, 10), 1, 1, 600),
    "cable": circle((6, 14), 1, 1, 600),
    "power": circle((6, 18), 1, 1, 600),
    "burst": circle((6, 22), 1, 1, 600),
}


@pytest.fixture(autouse=True, scope="module")
def needs_linuxcnc():
    if why := reason():
        pytest.skip(why)


@cache
def reason():
    """Why LinuxCNC cannot run here; None if it can."""
    return headless.missing()


def run(folder, served, steps, programs=None):
    """LinuxCNC with the mill and a spindle at a served node, which captures if it has a PLL."""
    axes = len(served.node.axes)
    set_up(served.node, axes, SESSION, captures=CAPTURES if served.node.has_pll else None)
    node = f"udp:127.0.0.1:{served.port}"
    spindle = Spindle("S", PERIODS_PER_TURN) if axes > 3 else None
    mill = replace(load("mill_linuxcnc"), bus="", node=node, session=SESSION, simulated=True)
    return headless.run(replace(mill, spindle=spindle), folder, steps, programs)


def at_mm(node):
    return [axis.position / PERIODS_PER_MM for axis in node.axes[:3]]


def near(node, program):
    """Whether the axes are within a circle, or on it."""
    return math.dist(at_mm(node)[:2], program.moves[0].centre) < 1.1 * program.moves[0].radius


def cutting(node, program):
    """Whether the axes are on a circle, a quarter after its start."""
    (x, y, _), centre = at_mm(node), program.moves[0].centre
    streams = node.axes[0].mode == STREAMING
    return streams and near(node, program) and x > centre[0] and y > centre[1]


def above(positions):
    """The height of the probe over the surface, in periods."""
    return SURFACE.above([p / PERIODS_PER_MM for p in positions[:3]]) * PERIODS_PER_MM


class Losses:
    """The packets that are lost: four in a row of 25 at HELD, and those of LOST."""

    def __init__(self):
        self.left = dict(LOST)

    def __call__(self, node):
        if near(node, HELD):
            return node.tick % 100 < 4 * 4
        for name, left in self.left.items():
            if left < LOST[name] or cutting(node, STOPPED[name]):
                self.left[name] -= left > 0
                if left:
                    return True
        return False


class Day(NamedTuple):
    """What has happened."""

    node: IdealNode
    ran: headless.Run
    path: numpy.ndarray  # mm
    folder: Path

    def parts(self):
        """{program: distances of its path from it} of PROGRAMS and HELD, and the path on HELD."""
        found, path = {}, self.path
        for name, program in [*PROGRAMS.items(), ("held", HELD)]:
            found[name], after = program.errors(path)
            ended = len(path) - len(after)
            part, path = path[ended - len(found[name]) : ended], after
        return found, part

    def last(self, name):
        """The distances of the last run of a circle: backwards it looks like forwards."""
        path = self.path[::-1]
        for other in reversed(STOPPED):
            errors, path = STOPPED[other].errors(path)
            if other == name:
                return errors
        raise KeyError(name)

    def pins(self, names):
        """The values of pins, when they were read."""
        row = next(row for row in self.ran.report if row["step"] == ["pins", *names])
        return numpy.array([row["pins"][name] for name in names])

    def messages(self):
        """All error messages that LinuxCNC showed."""
        return self.ran.report[-1]["messages"]


@pytest.fixture(scope="module", params=[False, True], ids=["read on request", "captured before"])
def day(tmp_path_factory, request):
    """All programs, and what interrupts them, with a node that replies what it reads when a request
    comes, and with one that captures it before.
    """
    spin = PERIODS_PER_TURN * TURNS_S * TICK_S
    node = IdealNode(
        3, spindle=IdealAxis(turn=PERIODS_PER_TURN, spin=spin), above=above, has_pll=request.param
    )
    node.refused = [7] * len(node.refused)  # of an earlier session
    steps = [["on"], ["home"], ["pins", *PLL_PINS], ["pins", *REFUSED]]
    for name in [*PROGRAMS, "lathe"]:
        steps += [["start", f"{name}.ngc"], ["finish"], *PINS.get(name, [])]
    steps += [["start", "held.ngc"], ["line", FIRST_LINE], ["override", 0.5]]
    steps += [["pause"], ["resume"], ["override", 1.2], ["finish"], ["override", 1.0]]
    for name in STOPPED:
        steps += [["start", f"{name}.ngc"], ["stopped"]]
        steps += [["pin", EXPIRED, True]] * (name == "cable") + [["on"], ["pin", EXPIRED, False]]
        steps += [["home"]] * (name == "power") + [["start", f"{name}.ngc"], ["finish"]]
    events = [
        (partial(cutting, program=STOPPED["estop"]), IdealNode.press_estop),
        (lambda node: node.stopped_for(0.2), lambda node: node.press_estop(False)),
        (partial(cutting, program=STOPPED["power"]), IdealNode.restart),
        (lambda node: node.unset_for(0.1), lambda node: set_up(node, 4, SESSION)),
    ]
    programs = {**PROGRAMS, **STOPPED, "held": HELD}
    texts = {f"{name}.ngc": program.text() for name, program in programs.items()}
    texts["lathe.ngc"] = LATHE
    folder = tmp_path_factory.mktemp("day")
    with Served(node, events, Losses()) as served:
        ran = run(folder, served, steps, texts)
    assert ran.done, ran.printed + str(ran.report)
    return Day(node, ran, moments(node.path, PERIODS_PER_MM)[:, :3], folder)


def test_circle_pocket_helix_and_blended_corners_are_on_their_paths(day):
    errors = {name: found.max() for name, found in day.parts()[0].items()}
    print({name: f"{1000 * error:.4f} um" for name, error in errors.items()})
    assert 0.01 < errors.pop("corners") <= 0.05
    assert max(errors.values()) < MOST_ERROR_MM


def test_the_pins_of_the_pll_say_how_long_before_the_request_the_node_captured(day):
    locked, error, age_ms = day.pins(PLL_PINS)
    assert (locked, error) == (day.node.has_pll, 0)
    assert age_ms == pytest.approx(1e3 * CAPTURES.lead_s if locked else 0)


def test_the_requests_that_the_node_refused_in_an_earlier_session_do_not_count(day):
    assert not day.pins(REFUSED).any()


def test_the_points_that_g38_touches_are_on_the_surface(day):
    points = numpy.loadtxt(day.folder / TOUCHED)[:, :3]
    places = [move.end[:2] for move in PROGRAMS["surface"].moves[1::3]]
    assert len(points) == len(places) and abs(points[:, :2] - places).max() < MOST_ERROR_MM
    assert max(abs(SURFACE.above(point)) for point in points) < 3 * LSB_MM
    assert math.dist(day.pins(LATCHES), points[-1]) < LSB_MM, "the last touch"


def test_g33_and_each_pass_of_g76_follow_the_spindle_in_the_same_groove(day):
    turns = numpy.array(day.node.path)[:, 4] / PERIODS_PER_TURN
    there = abs(day.path[:, 1] - PROGRAMS["threaded"].start[1]) < MOST_ERROR_MM
    z = numpy.where(there, day.path[:, 2], numpy.nan)  # of no other program
    grooves = grooves_of(turns, z, PITCH_MM, TURNS_S, TICK_S)
    assert len(grooves) == 1 + PASSES
    within, apart = thread_errors(grooves)
    print(f"a pass follows the spindle within {within:.5f} turns, passes {apart:.5f}")
    assert within < 1e-3 and apart < 1e-3
    count, rawcounts = day.pins(COUNTS)
    assert count > 0 and (rawcounts - count) % (4 * PERIODS_PER_TURN) == 0, "0 at an index"


def test_feed_override_hold_and_lost_packets_stay_on_the_circle(day):
    errors, part = day.parts()
    assert errors["held"].max() < MOST_ERROR_MM
    speeds = numpy.linalg.norm(numpy.diff(part[200:-400], axis=0), axis=1) / TICK_S
    assert speeds.min() < 0.01 and 11.9 < speeds.max() < 12.1  # mm/s, held, and at 120 %


def test_after_an_emergency_stop_of_the_node_linuxcnc_runs_again(day):
    assert "moire: axis 0: emergency stop" in day.messages()
    assert day.last("estop").max() < MOST_ERROR_MM


def test_after_the_cable_was_pulled_linuxcnc_runs_again_without_homing(day):
    assert "moire: packets were lost for too long" in day.messages()
    assert day.last("cable").max() < MOST_ERROR_MM


def test_after_a_burst_of_losses_the_axes_stop_under_control_and_linuxcnc_runs_again(day):
    assert day.last("burst").max() < MOST_ERROR_MM
    cuts = [cut for axis in day.node.axes[:3] for cut in axis.cuts]  # since the power was cut
    assert len(cuts) >= 3 and max(map(abs, cuts)) < STILL


def test_a_node_whose_power_was_cut_is_set_up_and_homed_again(day):
    assert day.last("power").max() < MOST_ERROR_MM
    for axis in day.node.axes[:3]:
        assert (axis.late, axis.refused) == (0, 0) and axis.accepted > 500


def test_a_homing_that_is_aborted_ends_and_the_machine_stays_on(tmp_path):
    node = IdealNode(3)
    index = "moire.0.axis.2.index-enable"
    steps = [["on"], ["homing"], ["pin", index, True], ["abort"], ["pin", index, False]]
    steps += [["pins", "moire.0.axis.2.homed"], ["home"]]
    with Served(node) as served:
        ran = run(tmp_path, served, steps)
    assert ran.done, ran.printed + str(ran.report)
    assert not ran.report[-1]["pins"]["moire.0.axis.2.homed"] and not ran.report[-1]["messages"]
    assert all(axis.homed for axis in node.axes)


def test_a_gantry_whose_sides_come_apart_stops_the_machine_until_it_is_square(tmp_path):
    (tmp_path / "gantry.toml").write_text(GANTRY)
    node = IdealNode(4)
    away = partial(IdealNode.slip, axis=2, periods=0.06 * PERIODS_PER_MM)
    events = [
        (lambda node: node.axes[3].homed and node.axes[1].position > 4 * PERIODS_PER_MM, away),
        (
            lambda node: node.axes[2].beside and not node.axes[2].enabled,
            partial(IdealNode.slip, axis=2, periods=0),
        ),
    ]
    steps = [["on"], ["home"], ["start", "line.ngc"], ["stopped"], ["on"]]
    steps += [["start", "line.ngc"], ["finish"]]
    with Served(node, events) as served:
        set_up(node, 4, SESSION)
        port = f"udp:127.0.0.1:{served.port}"
        found = load(str(tmp_path / "gantry.toml"))
        found = replace(found, bus="", node=port, session=SESSION, simulated=True)
        folder = tmp_path / "run"
        ran = headless.run(found, folder, steps, {"line.ngc": "G21 G90 G64\nG1 Y9 F600\nM2\n"})
    assert ran.done, ran.printed + str(ran.report)
    assert "moire: Y and Y2 are more than 50 um apart" in ran.report[-1]["messages"]
    first, second = numpy.array(node.path)[:, 2:4].T / PERIODS_PER_MM
    apart = abs(first - second)
    before = numpy.flatnonzero(first < 4.0)[-1]
    assert apart[:before].max() < LSB_MM and apart[-1] < LSB_MM and abs(first[-1] - 9) < LSB_MM
    assert apart.max() < 0.05, "after the stop LinuxCNC brings the sides together"


def test_a_node_of_another_build_is_refused_in_a_sentence(tmp_path):
    with Served(IdealNode(3, map_crc=1)) as served:
        ran = run(tmp_path, served, [["on"]])
    assert ran.exit_code != 0 and not ran.report
    words = "the node is of another build: its register map differs"
    assert f"moire: udp:127.0.0.1:{served.port}: {words}" in ran.printed


def test_a_serial_port_of_another_program_is_refused_in_a_sentence(tmp_path):
    master, slave = pty.openpty()
    os.fchmod(slave, 0o666)
    fcntl.flock(slave, fcntl.LOCK_EX)
    port = f"serial:{os.ttyname(slave)}:3000000"
    mill = replace(load("mill_linuxcnc"), bus="", node=port, session=SESSION)
    ran = headless.run(mill, tmp_path, [["on"]])
    os.close(master)
    os.close(slave)
    assert ran.exit_code != 0
    assert f"moire: {port}: another program uses the serial port" in ran.printed


def test_linuxcnc_does_not_start_where_the_set_up_fails(tmp_path):
    program = tmp_path / "set_up"
    program.write_text("#!/bin/sh\necho moire: it does not fit >&2\nexit 1\n")
    program.chmod(0o755)
    mill = replace(load("mill_linuxcnc"), bus="/dev/ttyUSB0", python="./set_up")
    ran = headless.run(mill, tmp_path, [["on"]])
    assert ran.exit_code != 0 and "moire: it does not fit" in ran.printed
