# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/position/position_capture.sv: step() advances one cycle and returns (present, entry,
free, overrun) after it.
"""

from collections import deque

NEVER = 65535
INDEX, TICK, SOFTWARE = 1, 2, 4


def rising(probe, probes=2):
    return 1 << 3 + probe


def falling(probe, probes=2):
    return 1 << 3 + probes + probe


class PositionCapture:
    def __init__(self, probes=2, depth=16):
        self.probes, self.depth = probes, depth
        self.entries, self.present, self.since, self.probe = deque(), 0, NEVER, None

    def sources(self, index, tick, software, probe):
        changed = 0 if self.probe is None else self.probe ^ probe
        return (
            index
            | tick << 1
            | software << 2
            | (changed & probe) << 3
            | (changed & ~probe) << 3 + self.probes
        )

    def step(
        self,
        enabled=0,
        index=0,
        tick=0,
        software=0,
        probe=0,
        now=0,
        valid=0,
        position=0,
        pop=0,
        clear=0,
        rst=0,
    ):
        """An entry is (sources, age, time, position)."""
        sources, age = (
            self.sources(index, tick, software, probe) & enabled,
            0 if valid else self.since,
        )
        full = len(self.entries) == self.depth
        if pop and self.present:
            self.entries.popleft()
        self.present = int(len(self.entries) > 0)  # an event of this cycle is not at the output yet
        if sources and not full:
            self.entries.append((sources, age, now, position))
        self.probe, self.since = probe, min(age + 1, NEVER)
        overrun = int(sources > 0 and full)
        if clear or rst:
            self.entries.clear()
            self.present = overrun = 0
        if rst:
            self.probe, self.since = None, NEVER
        return (
            self.present,
            self.entries[0] if self.present else None,
            self.depth - len(self.entries),
            overrun,
        )
