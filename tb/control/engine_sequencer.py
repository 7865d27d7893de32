# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_sequencer.sv: clk(...) advances one cycle and returns the outputs
after it.
"""

from tables.microcode.assembler import LINES, codes
from tables.microcode.numbers import ACTIONS, CONDITIONS


class EngineSequencer:
    def __init__(self, axes):
        self.axes = axes
        self.codes = [code for _, code in codes()]
        self.codes += [0] * (LINES - len(self.codes))
        self.count = None  # not known before the first count
        self.reset()

    def reset(self):
        self.next = self.target = 0  # the lines that may be fetched
        self.condition = self.unless = 0  # of the line before
        self.axis = self.ticking = self.busy = self.overrun = 0
        self.read_action = self.action = 0

    def line(self, conditions):
        """The number of the line that is fetched with these conditions."""
        own = {
            "never": 0,
            "ticking": self.ticking,
            "loop": int(self.count != 1),
            "due": self.busy,
            "wrapped": int(self.axis == 0),
        }
        level = {CONDITIONS[name]: value for name, value in own.items()}.get(
            self.condition, conditions >> self.condition & 1
        )
        return self.target if level != self.unless else self.next

    def clk(self, rst=0, tick=0, conditions=0):
        """conditions: the levels as the input of that name."""
        line, action = self.line(conditions), self.action
        code = self.codes[line]
        acts = self.condition == 0 and not self.unless
        self.action = self.read_action if acts else 0
        self.read_action = code >> 26 & 255
        self.next, self.target = (line + 1) % LINES, code >> 26
        if self.condition == CONDITIONS["loop"] and self.count is not None:
            self.count = (self.count - 1) % 32
        self.condition, self.unless = code >> 19 & 63, code >> 25 & 1
        if action >> 5 == 5:
            self.count = action & 31
        finishes = action == ACTIONS["finished"]
        self.overrun = int(tick and self.busy and not finishes)
        self.busy = int(tick or self.busy and not finishes)
        self.ticking = int(action == ACTIONS["set ticking"] or self.ticking and not finishes)
        if action == ACTIONS["first_axis"]:
            self.axis = 0
        elif action == ACTIONS["next_axis"]:
            self.axis = (self.axis + 1) % self.axes
        if rst:
            self.reset()
        return self.codes[self.line(conditions)], self.action, self.axis, self.busy, self.overrun
