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
from linuxcnc_config.set_up import set_up
from tb.linuxcnc.ideal_node import CLK_HZ, STREAMING, TICK, IdealNode, Served

SESSION = 0x4D01
PERIODS_PER_MM = 250.0
TICK_S = TICK / CLK_HZ
# where the acceleration of 500 mm/s2 steps: the velocity of a set-point, from its two neighbours at
# 1 ms, differs by a quarter of the step, and the cubic by 4/27 of this over 1 ms; four in a row
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
    set_up(served.node, len(served.node.axes), SESSION)
    node = f"udp:127.0.0.1:{served.port}"
    mill = replace(load("mill_linuxcnc"), bus="", node=node, session=SESSION, simulated=True)
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
    """A condition that is true for some periods from the moment of cutting on, once."""
    left = [periods]

    def lose(node):
        if left[0] == periods and not cutting(node):
            return False
        left[0] -= left[0] > 0
        return left[0] > 0

    return lose


CIRCLE = {"circle": PROGRAMS["circle"]}
CUT = [["start", "circle.ngc"]]
AGAIN = [["on"], *CUT, ["finish"]]


def last_circle(node):
    """The errors of the last circle: backwards it looks like forwards."""
    return CIRCLE["circle"].errors(path_of(node)[::-1])[0]


def test_feed_override_hold_and_lost_packets_stay_on_the_circle(tmp_path):
    node = IdealNode(3)
    steps = [["on"], ["home"], *CUT, ["line", FIRST_LINE], ["override", 0.5]]
    steps += [["pause"], ["resume"], ["override", 1.2], ["finish"]]
    with Served(node, lose=lambda node: node.tick % 100 < 4) as served:
        ran = run(tmp_path, served, steps, CIRCLE)
    assert ran.done, ran.printed + str(ran.report)
    path = path_of(node)
    errors, after = CIRCLE["circle"].errors(path)
    assert errors.max() < MOST_ERROR_MM
    on_circle = path[len(path) - len(after) - len(errors) :][200 : len(errors) - 400]
    speeds = numpy.linalg.norm(numpy.diff(on_circle, axis=0), axis=1) / TICK_S
    assert speeds.min() < 0.01 and 11.9 < speeds.max() < 12.1  # mm/s, held, and at 120 %


def test_after_an_emergency_stop_of_the_node_linuxcnc_runs_again(tmp_path):
    node = IdealNode(3)
    events = [(cutting, IdealNode.press_estop)]
    events.append((lambda node: node.stopped_for(0.2), lambda node: node.press_estop(False)))
    with Served(node, events) as served:
        ran = run(tmp_path, served, [["on"], ["home"], *CUT, ["stopped"], *AGAIN], CIRCLE)
    assert ran.done, ran.printed + str(ran.report)
    assert "moire: axis 0: emergency stop" in messages(ran)
    assert last_circle(node).max() < MOST_ERROR_MM


def test_after_the_cable_was_pulled_linuxcnc_runs_again_without_homing(tmp_path):
    node = IdealNode(3)
    with Served(node, lose=lost_for(100)) as served:
        ran = run(tmp_path, served, [["on"], ["home"], *CUT, ["stopped"], *AGAIN], CIRCLE)
    assert ran.done, ran.printed + str(ran.report)
    assert "moire: packets were lost for too long" in messages(ran)
    assert last_circle(node).max() < MOST_ERROR_MM


def test_a_node_whose_power_was_cut_is_set_up_and_homed_again(tmp_path):
    node = IdealNode(3)
    events = [(cutting, IdealNode.restart)]
    events.append((lambda node: node.unset_for(0.1), lambda node: set_up(node, 3, SESSION)))
    steps = [["on"], ["home"], *CUT, ["stopped"], ["on"], ["home"], *AGAIN]
    with Served(node, events) as served:
        ran = run(tmp_path, served, steps, CIRCLE)
    assert ran.done, ran.printed + str(ran.report)
    assert last_circle(node).max() < MOST_ERROR_MM


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
