# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/registers/event_counters.sv: step(...) advances one cycle. `count` is the answer to
the read of the cycle before, and `counts` are those in the memory.
"""


class EventCounters:
    def __init__(self, counters=16, width=32):
        self.counters, self.most = counters, (1 << width) - 1
        self.counts, self.count = [0] * counters, 0
        self.reset()

    def reset(self):
        self.waiting, self.raised, self.cleared = set(), None, 0

    def step(self, events, read, clear, number, rst=0):
        """`events` is the set of the counters that have one."""
        raised, self.raised = self.raised, None
        new = None
        if self.cleared < self.counters:
            self.counts[self.cleared] = 0
            self.cleared += 1
            starts = False
        else:
            starts = bool(self.waiting) and raised is None and not read and not clear
            new = min(self.waiting) if starts else None
        answer = self.counts[number if read else new] if read or starts else self.count
        if clear:
            self.counts[number] = 0
        if raised is not None:
            if read or clear:
                self.waiting.add(raised)
            else:
                self.counts[raised] = min(self.count + 1, self.most)
        if starts:
            self.waiting.discard(new)
            self.raised = new
        if clear:
            self.waiting.discard(number)
        self.waiting |= events
        self.count = answer
        if rst:
            self.reset()
        return self.count
