# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_sequencer.sv: clk(...) advances one cycle and returns the outputs
after it.
"""

from tables.engine_microcode import ACTIONS, CONDITIONS, LINES, codes


class EngineSequencer:
    def __init__(self, axes):
        self.axes = axes
        self.codes = [code for _, code in codes()]
        self.codes += [0] * (LINES - len(self.codes))
        self.count = None  # not known before the first count
        self.reset()

    def reset(self):
        self.line = self.axis = self.ticking = self.busy = self.overrun = 0
        self.actions = [0, 0]  # of the line whose operand is there, of the line that is executed

    def clk(self, rst=0, tick=0, conditions=0):
        """conditions: the levels as the input of that name."""
        code, action = self.codes[self.line], self.actions[1]
        number = code >> 19 & 63
        own = {
            "never": 0,
            "ticking": self.ticking,
            "loop": self.count != 1,
            "due": self.busy,
            "wrapped": int(self.axis == 0),
        }
        level = {CONDITIONS[name]: value for name, value in own.items()}.get(
            number, conditions >> number & 1
        )
        jumps = level != code >> 25 & 1
        acts = number == 0 and not code >> 25 & 1
        self.actions = [code >> 26 & 255 if acts else 0, self.actions[0]]
        self.line = code >> 26 if jumps else (self.line + 1) % LINES
        if number == CONDITIONS["loop"] and self.count is not None:
            self.count = (self.count - 1) % 32
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
        return self.codes[self.line], self.actions[1], self.axis, self.busy, self.overrun
