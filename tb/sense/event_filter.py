# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/event_filter.sv: step(skip, required, tolerated, levels, rst) advances one
cycle and returns the outputs after it.
"""


class Level:
    """One level. A disturbance has had `seen` samples of the new level, and `against` samples of
    the old level since the first of them.
    """

    def __init__(self):
        self.filtered, self.seen, self.against = 0, 0, 0

    def forget(self):
        self.seen = self.against = 0

    def sample(self, last, tolerated, level):
        if level != self.filtered:
            if self.seen & last == last:
                self.filtered = level
                self.forget()
            else:
                self.seen += 1
        elif self.against & tolerated == tolerated:
            died = self.seen > 0
            self.forget()
            return int(died)
        elif self.seen:
            self.against += 1
        return 0


class EventFilter:
    def __init__(self, levels=1, settle=4):
        self.levels, self.settling, self.settle = [Level() for _ in range(levels)], settle, 0
        self.skipped = self.last = 0

    def step(self, skip, required, tolerated, levels, rst=0):
        """`levels` is a list, the lowest bit first; returns the lists filtered, rejected."""
        rejected = [0] * len(self.levels)
        sample = self.skipped & skip == skip
        if rst or self.settle:
            for own, level in zip(self.levels, levels):
                own.filtered = level
                own.forget()
        elif sample:
            rejected = [
                own.sample(self.last, tolerated, level) for own, level in zip(self.levels, levels)
            ]
        self.last = max(required, 1) - 1
        self.skipped = 0 if rst or sample else self.skipped + 1
        self.settle = self.settling if rst else max(self.settle - 1, 0)
        return [own.filtered for own in self.levels], rejected
