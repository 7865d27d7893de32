# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/registers/event_counters.sv: step(...) advances one cycle. `count` is the answer to
the read of the cycle before, and `counts` are those in the memory.
"""


class EventCounters:
    def __init__(self, counters=16, width=32):
        self.counters, self.most = counters, (1 << width) - 1
        self.counts = [0] * counters
        self.reset()

    def reset(self):
        self.waiting, self.in_turn = set(), set()
        self.place, self.raising, self.fresh = 0, False, True
        self.cleared = None  # counter of the clear of the cycle before

    def step(self, events, read, clear, number, rst=0):
        """`events` is the set of the counters that have one."""
        answer = self.counts[number]
        access = read or clear or self.cleared is not None
        if self.cleared is not None:
            self.counts[self.cleared] = 0
        idle = self.place == 0 and not self.waiting and not self.fresh
        if self.raising and not access and not idle:
            here = self.place
            if self.fresh:
                self.counts[here] = 0
            elif here in self.in_turn:
                self.counts[here] = min(self.counts[here] + 1, self.most)
            if here == 0:
                self.in_turn, self.waiting = self.waiting, set()
            self.place = (here + 1) % self.counters
            self.fresh = self.fresh and self.place != 0
        self.raising = not access and (idle or not self.raising)
        self.cleared = number if clear else None
        self.waiting = self.waiting | events
        if rst:
            self.reset()
        return answer
