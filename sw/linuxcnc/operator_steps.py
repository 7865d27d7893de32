#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The operator of a LinuxCNC without a screen: [DISPLAY]DISPLAY of a configuration.

Runs with the Python of LinuxCNC, in the folder of the configuration. It obeys the steps of
steps.json in their order and writes report.json: for each step done whether it succeeded, the
position afterwards, and the error messages so far.

    patience SECONDS   how long each further step may take, on the clock of the computer
    on                 resets the emergency stop, switches the machine on
    home               homes all joints
    homing             begins to home all joints
    abort              aborts what is under way, as Esc does
    start PROGRAM      runs a G-code file
    line N             waits until the motion has reached line N of the program
    finish             waits until the program has ended
    override F         feed override, 1 is 100 %
    pause, resume      feed hold
    stopped            waits until the machine is off or the emergency stop is on
    set NAME VALUE     sets a pin of HAL that nothing else sets
    pin NAME VALUE     waits until a pin of HAL has a value
    pins NAME …        reads pins of HAL, into the report
"""

import json
import sys
import time
from pathlib import Path

import hal

import linuxcnc

PATIENCE_S = 120.0  # of each step at first
LOOK_S = 0.01
STEADY_LOOKS = 20  # in a row, at a state that lasts


class Operator:
    """What a person would do at the screen."""

    def __init__(self):
        self.command, self.status = linuxcnc.command(), linuxcnc.stat()
        self.errors, self.messages = linuxcnc.error_channel(), []
        self.component = hal.component("operator")  # without one, no pin can be read
        self.component.ready()
        self.values = {}  # of pins that were read
        self.patience_s = PATIENCE_S

    def patience(self, seconds):
        self.patience_s = seconds
        return True

    def look(self):
        """Reads the status and collects the messages."""
        self.status.poll()
        while message := self.errors.poll():
            self.messages.append(message[1].strip())

    def wait(self, condition):
        """Whether the condition has come true in time."""
        end = time.monotonic() + self.patience_s
        while time.monotonic() < end:
            self.look()
            if condition():
                return True
            time.sleep(LOOK_S)
        return False

    def is_on(self):
        return self.status.task_state == linuxcnc.STATE_ON

    def is_idle(self):
        status = self.status
        return status.interp_state == linuxcnc.INTERP_IDLE and status.inpos and not status.queue

    def stays(self, condition):
        """Whether a condition is true for STEADY_LOOKS in a row."""
        for _ in range(STEADY_LOOKS):
            if not condition():
                return False
            time.sleep(LOOK_S)
            self.look()
        return True

    def on(self):
        def tried():
            for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
                self.command.state(state)
                self.command.wait_complete()
                self.look()
            return self.stays(self.is_on)

        return self.wait(tried)

    def homing(self):
        self.command.mode(linuxcnc.MODE_MANUAL)
        self.command.wait_complete()
        if any(self.status.homed[n] for n in range(self.status.joints)):
            self.command.teleop_enable(0)
            self.command.wait_complete()
            self.command.unhome(-1)
            self.command.wait_complete()
        self.command.home(-1)
        return True

    def abort(self):
        self.command.abort()
        self.command.wait_complete()
        return True

    def home(self):
        self.homing()
        joints = range(self.status.joints)
        done = self.wait(lambda: not self.is_on() or all(self.status.homed[n] for n in joints))
        return done and self.finish()

    def start(self, program):
        self.command.mode(linuxcnc.MODE_AUTO)
        self.command.wait_complete()
        self.command.program_open(str(Path(program).resolve()))
        self.command.wait_complete()
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        return self.wait(
            lambda: not self.is_on() or self.status.interp_state != linuxcnc.INTERP_IDLE
        )

    def line(self, number):
        return self.wait(lambda: self.status.motion_line >= number or not self.is_on())

    def finish(self):
        ended = self.wait(lambda: not self.is_on() or self.stays(self.is_idle))
        return ended and self.is_on()

    def override(self, factor):
        self.command.feedrate(factor)
        return self.wait(lambda: abs(self.status.feedrate - factor) < 1e-6)

    def pause(self):
        self.command.auto(linuxcnc.AUTO_PAUSE)
        return self.wait(lambda: self.status.paused and self.status.current_vel < 1e-9)

    def resume(self):
        self.command.auto(linuxcnc.AUTO_RESUME)
        return self.wait(lambda: not self.status.paused)

    def stopped(self):
        return self.wait(lambda: not self.is_on())

    def set(self, name, value):
        hal.set_p(name, str(value))
        return True

    def pin(self, name, value):
        return self.wait(lambda: hal.get_value(name) == value)

    def pins(self, *names):
        self.values = {name: hal.get_value(name) for name in names}
        return True

    def obey(self, step):
        """One step, as a row of the report."""
        done = getattr(self, step[0])(*step[1:])
        self.look()
        joints = [self.status.joint_actual_position[n] for n in range(self.status.joints)]
        row = {"step": step, "done": bool(done), "joints": joints, "messages": self.messages[:]}
        return {**row, "pins": self.values}


def main():
    operator, report = Operator(), []
    for step in json.loads(Path("steps.json").read_text(encoding="utf-8")):
        report.append(operator.obey(step))
        if not report[-1]["done"]:
            break
    Path("report.json").write_text(json.dumps(report), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
