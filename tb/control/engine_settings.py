# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_settings.sv in integers: write_out(...) is what it writes in this
cycle, clk(...) then advances one cycle.
"""

OUTSIDE = 0x70  # the first number of what is not in memory


def address_of(number, filter):
    """The address of a setting in the memory of its axis."""
    if number < 0x40:
        return number
    return 128 + 16 * filter + number % 16 if number & 0x10 else 64 + 4 * (number % 16) + 3


class EngineSettings:
    def __init__(self, word_w):
        self.word_w, self.waiting = word_w, None

    def write_out(self, operand=0, write=0, write_at=0, word=0):
        """(address, value) of the word that is written in this cycle, or None."""
        if write:
            return write_at, word
        if self.waiting is None or operand < OUTSIDE and operand % 8 == self.waiting[1] % 8:
            return None
        axis, number, filter, value = self.waiting
        at = address_of(number, filter) % (1 << self.word_w)
        return axis << self.word_w | at, value % (1 << 72)

    def clk(self, setting=None, rst=0, **engine):
        """setting: (axis, number of the word, filter, value) or None. Returns waits."""
        if self.write_out(**engine) and not engine.get("write"):
            self.waiting = None
        if setting:
            self.waiting = setting
        if rst:
            self.waiting = None
        return int(self.waiting is not None)
