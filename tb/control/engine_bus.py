# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_bus.sv in integers: waits(...) are the levels in this cycle, clk(...)
then advances one cycle.
"""

from tables.engine_words import SEGMENT
from tables.microcode.numbers import SETTINGS
from tb.control.engine_words import FOUND

WORD = 1 << 32
PARTS = [SETTINGS[SEGMENT + name] for name in ("velocity", "acceleration", "jerk", "ticks")]
OFFERED = 2  # cycles that a word of a piece is offered before it is taken


def signed(value, bits):
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


class EngineBus:
    def __init__(self, axes, filters):
        self.axes, self.filters = axes, filters
        self.reset()

    def reset(self):
        self.setting = None  # (axis, number, filter, value) that is being given
        self.scaled, self.left = None, 0  # the one that is being shifted, for how many cycles
        self.pushes, self.filter_at, self.axis, self.of_gain = False, 0, 0, False
        self.gains = self.push = 0  # bits of axes
        self.shift_by = None
        self.offered = 0  # cycles in which a word of a piece was offered

    def waits(self, ready=1, setting_waits=0, pending=0, moves=0, moved=0, stores=0, piece=None):
        """(hold, waits, settled, piece_taken)"""
        hold = bool(self.scaled or self.setting) or setting_waits or self.pushes or not ready
        settled = not (hold or self.push | pending | moves | moved > 0)
        waits = not settled or piece is not None
        self.taken = bool(piece and self.offered == OFFERED and settled and not stores)
        return int(hold), int(waits), int(settled), int(self.taken)

    def word_of(self, address):
        """(axis, word) of an address of the map, or None."""
        block = (address >> 6) - 4
        word = FOUND.get((block >> 3, address & 63)) if 0 <= block < 24 else None
        return (block & 7, word) if word else (0, None)

    def value_of(self, word, value, value_low):
        """The value of the setting in the unit of the engine."""
        if word.wide:
            return signed(value << 32 | value_low, 64)
        if word.name == "override":
            return min(value, 65536) << 16
        return (signed(value, 32) if word.signed else value) << word.shift

    def clk(
        self,
        stores=0,
        address=0,
        value=0,
        value_low=0,
        setting_waits=0,
        moved=0,
        moved_by=(),
        streamed=0,
        piece=None,
        rst=0,
    ):
        """Advance one cycle. moved, streamed: bits of axes. piece: (axis, part, word) or None."""
        if rst:
            self.reset()
            return
        for n in range(self.axes):
            if moved >> n & 1:
                self.shift_by = moved_by[n]
        done = not self.scaled and not self.setting and not setting_waits
        self.push = int(done and self.pushes) << self.axis
        self.pushes = self.pushes and not done
        self.gains, self.setting = 0, None
        self.shift()
        self.offered = 0 if self.taken or not piece else min(self.offered + 1, OFFERED)
        if self.taken:
            self.axis, part, value = piece
            self.setting = self.axis, PARTS[part], None, value
            self.pushes = part == len(PARTS) - 1
        axis, word = self.word_of(address)
        filter_at = self.filter_at
        if stores and word and axis < self.axes and word.name == "filter_address":
            self.filter_at = value & 31
        if not stores or not word or word.name == "filter_address" or axis >= self.axes:
            return
        if word.name.startswith(SEGMENT) and streamed >> axis & 1:
            return
        number = word.at ^ 0x10
        if word.name == "filter_value":
            if filter_at >> 3 >= self.filters:
                return
            number = 0x50 + (filter_at & 7)
        self.axis = axis
        self.scaled = axis, number, filter_at >> 3, self.value_of(word, value, value_low)
        self.left = word.places
        self.pushes = word.name == "segment_ticks"
        self.of_gain = word.name in ("kp", "kd", "kv", "ka")
        if word.wide:
            self.shift()

    def shift(self):
        """What happens to the setting in a cycle."""
        if self.scaled and self.left <= 1:
            self.setting, self.scaled = self.scaled, None
            self.gains = int(self.of_gain) << self.axis
        self.left -= 1
