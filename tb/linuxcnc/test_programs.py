# SPDX-License-Identifier: Apache-2.0
"""LinuxCNC without a screen runs G-code through the driver, in lockstep with a node that has ideal
axes. Skipped by name where LinuxCNC is not installed (`make linuxcnc`).
"""

import fcntl
import os
import pty
from dataclasses import replace
from functools import cache

import numpy
import pytest

from linuxcnc_config import headless
from linuxcnc_config.generate import load
from linuxcnc_config.programs import FIRST_LINE, PROGRAMS, moments
from tb.linuxcnc.ideal_node import CLK_HZ, STREAMING, TICK, IdealNode, Served

PERIODS_PER_MM = 250.0
TICK_S = TICK / CLK_HZ
# where the acceleration of 500 mm/s2 steps: the velocity of a set-point, from its two neighbours at
# 1 ms, differs by a quarter of the step, and the cubic by 4/27 of this over 1 ms; four times in a row
MOST_ERROR_MM = 4 * 500 * 1e-6 / 4 * 4 / 27


@pytest.fixture(autouse=True)
def needs_linuxcnc():
    if why := reason():
        pytest.skip(why)


@cache
def reason():
    """Why LinuxCNC cannot run here; None if it can."""
    return headless.missing()


def run(folder, served, steps, programs=None):
    """LinuxCNC with the mill at a served node."""
    mill = replace(load("mill"), node=f"udp:127.0.0.1:{served.port}", simulated=True)
    texts = {f"{name}.ngc": program.text() for name, program in (programs or {}).items()}
    return headless.run(mill, folder, steps, texts)


def path_of(node):
    return moments(node.path, PERIODS_PER_MM)


def test_circle_pocket_helix_and_blended_corners_are_on_their_paths(tmp_path):
    steps, marks = [["on"], ["home"]], {}
    node = IdealNode(3)
    for name in PROGRAMS:
        steps += [["start", f"{name}.ngc"], ["finish"]]
    with Served(node) as served:
        ran = run(tmp_path, served, steps, PROGRAMS)
    assert ran.done, ran.printed + str(ran.report)
    path = path_of(node)
    for name, program in PROGRAMS.items():
        errors, path = program.errors(path)
        marks[name] = errors.max()
    print({name: f"{1000 * error:.4f} um" for name, error in marks.items()})
    assert 0.01 < marks.pop("corners") <= 0.05
    assert max(marks.values()) < MOST_ERROR_MM
    for axis in node.axes:
        assert (axis.late, axis.refused) == (0, 0) and axis.accepted > 3000


def messages(ran):
    """All error messages that LinuxCNC showed."""
    return ran.report[-1]["messages"] if ran.report else []


def cutting(node):
    """Whether the axes are on the circle, a quarter after its start."""
    x, y, _ = (axis.position / PERIODS_PER_MM for axis in node.axes)
    return node.axes[0].mode == STREAMING and x > 15 and y > 14


def lost_for(periods):
    """A condition that is true for some periods from the moment of cutting on."""
    left = [0]

    def lose(node):
        if not left[0] and cutting(node):
            left[0] = periods
        if left[0] > 1:
            left[0] -= 1
            return True
        return False

    return lose


CIRCLE = {"circle": PROGRAMS["circle"]}
AGAIN = [["on"], ["start", "circle.ngc"], ["finish"]]


def test_feed_override_and_hold_stay_on_the_circle(tmp_path):
    node = IdealNode(3)
    steps = [["on"], ["home"], ["start", "circle.ngc"], ["line", FIRST_LINE], ["override", 0.5]]
    steps += [["pause"], ["resume"], ["override", 1.2], ["finish"]]
    with Served(node) as served:
        ran = run(tmp_path, served, steps, CIRCLE)
    assert ran.done, ran.printed + str(ran.report)
    path = path_of(node)
    errors, after = CIRCLE["circle"].errors(path)
    assert errors.max() < MOST_ERROR_MM
    on_circle = path[len(path) - len(after) - len(errors) :][200 : len(errors) - 400]
    speeds = numpy.linalg.norm(numpy.diff(on_circle, axis=0), axis=1) / TICK_S
    assert speeds.min() < 0.01 and 11.9 < speeds.max() < 12.1  # mm/s, held, and at 120 %


def test_an_emergency_stop_of_the_node_stops_linuxcnc_and_it_runs_again(tmp_path):
    node = IdealNode(3)
    events = [(cutting, IdealNode.press_estop)]
    events.append((lambda node: node.stopped_for(0.5), lambda node: node.press_estop(False)))
    steps = [["on"], ["home"], ["start", "circle.ngc"], ["stopped"], *AGAIN]
    with Served(node, events) as served:
        ran = run(tmp_path, served, steps, CIRCLE)
    assert ran.done, ran.printed + str(ran.report)
    assert "moire: axis 0: emergency stop" in messages(ran)
    assert CIRCLE["circle"].errors(path_of(node))[0].max() < MOST_ERROR_MM


def test_some_lost_packets_do_not_move_the_path(tmp_path):
    node = IdealNode(3)
    with Served(node, lose=lambda node: node.session and node.tick % 100 < 4) as served:
        ran = run(tmp_path, served, [["on"], ["home"], ["start", "circle.ngc"], ["finish"]], CIRCLE)
    assert ran.done, ran.printed + str(ran.report)
    errors, _ = CIRCLE["circle"].errors(path_of(node))
    assert errors.max() < MOST_ERROR_MM
    assert [axis.extrapolated for axis in node.axes] == [0, 0, 0]


def test_a_pulled_cable_stops_the_machine_and_it_runs_again(tmp_path):
    node = IdealNode(3)
    steps = [["on"], ["home"], ["start", "circle.ngc"], ["stopped"], *AGAIN]
    with Served(node, lose=lost_for(300)) as served:
        ran = run(tmp_path, served, steps, CIRCLE)
    assert ran.done, ran.printed + str(ran.report)
    assert "moire: packets were lost for too long" in messages(ran)
    assert node.axes[0].homed


def test_a_node_whose_power_was_cut_is_set_up_and_homed_again(tmp_path):
    node = IdealNode(3)
    steps = [["on"], ["home"], ["start", "circle.ngc"], ["stopped"], ["on"], ["home"], *AGAIN]
    with Served(node, [(cutting, IdealNode.restart)]) as served:
        ran = run(tmp_path, served, steps, CIRCLE)
    assert ran.done, ran.printed + str(ran.report)
    assert CIRCLE["circle"].errors(path_of(node)[-40_000:])[0].max() < MOST_ERROR_MM


@pytest.mark.parametrize(
    "node, axes, sentence",
    [
        (IdealNode(2), 3, "the node has 2 axes, the configuration 3"),
        (IdealNode(3, map_crc=1), 3, "the node is of another build: its register map differs"),
    ],
)
def test_a_node_that_does_not_fit_is_refused_in_a_sentence(tmp_path, node, axes, sentence):
    with Served(node) as served:
        ran = run(tmp_path, served, [["on"]])
    assert ran.exit_code != 0 and not ran.report
    assert f"moire: udp:127.0.0.1:{served.port}: {sentence}" in ran.printed


def test_a_serial_port_of_another_program_is_refused_in_a_sentence(tmp_path):
    master, slave = pty.openpty()
    os.fchmod(slave, 0o666)
    fcntl.flock(slave, fcntl.LOCK_EX)
    port = f"serial:{os.ttyname(slave)}:3000000"
    ran = headless.run(replace(load("mill"), node=port), tmp_path, [["on"]])
    os.close(master)
    os.close(slave)
    assert (
        ran.exit_code != 0 and f"moire: {port}: another program uses the serial port" in ran.printed
    )
