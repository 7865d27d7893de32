# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/set_point_queue.sv in integers: clk(...) advances one cycle."""

from moire.made.registers import FIELDS

MOST = 3  # commits that wait
WORDS = (  # as they are read, those of a set-point first; the third and fourth are not used
    "set_point_position",
    "set_point_velocity",
    None,
    None,
    "stream_travel_low",
    "stream_travel_high",
    "stream_velocity_limit",
    "stream_acceleration_limit",
)
LIMITS = 4  # the first word that is a limit
SET_POINT = {0, 1}  # the words that make one complete


def address_of(block, register, axis=0):
    """The word of the map that is stored: of a register of 64 bits the high one."""
    field = next(f for f in FIELDS if (f.block, f.register) == (block, register))
    return field.address(axis) // 4 + (field.width > 32)


class SetPointQueue:
    def __init__(self, axes):
        self.axes, self.words, self.stored = axes, {}, None
        node = ("set_point_tick", "set_point_commit", "late_limit", "stream_axes")
        self.of_node = {address_of("node", name): name for name in node}
        self.of_axis = {
            address_of("axis", name, n): (n, number)
            for number, name in enumerate(WORDS)
            if name
            for n in range(axes)
        }
        self.reset()

    def reset(self):
        self.late_limit = self.allowed = self.next_tick = self.dropped = 0
        self.slot, self.commits = 0, []  # (slot, tick, axes, those complete) in their order
        self.written = [set() for _ in range(self.axes)]

    @property
    def oldest(self):
        return self.commits[0] if self.commits else (self.slot, None, 0, 0)

    def clk(self, rst=0, stores=0, at=0, value=0, low=0, taken=0, read_axis=0, read_word=0):
        slot = None if read_word >= LIMITS else self.oldest[0]
        self.stored = self.words.get((slot, read_axis, read_word))
        if stores and at in self.of_axis:
            n, word = self.of_axis[at]
            wide = word in (0, 4, 5)
            bits = (value & 0xFFFF) << 32 | low if wide else value
            sign = 47 if wide else 31 if word == 1 else 48
            key = None if word >= LIMITS else self.slot
            self.words[key, n, word] = bits - (bits >> sign << sign + 1)
            self.written[n].add(word)
        if rst:
            self.reset()
            return
        self.dropped, waiting = 0, len(self.commits)
        if taken:
            self.commits.pop(0)
        name = self.of_node.get(at) if stores else None
        if name == "set_point_tick":
            self.next_tick = value
        if name == "late_limit":
            self.late_limit = value & 0xFFFF
        if name == "stream_axes":
            self.allowed = value % (1 << self.axes)
        if name == "set_point_commit" and (named := value % (1 << self.axes)):
            complete = sum(1 << n for n, words in enumerate(self.written) if words >= SET_POINT)
            self.written = [set() for _ in range(self.axes)]
            if waiting == MOST:
                self.dropped = named
            else:
                self.commits.append((self.slot, self.next_tick, named, named & complete))
                self.slot = (self.slot + 1) % (MOST + 1)
