# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/decode/index_latch.sv: clear() returns the signal to the decoder in this cycle,
step() completes the cycle.
"""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Settings:
    active_low: int = 0
    gate_mask: int = 0  # bit 0 a, bit 1 b
    gate: int = 0
    take_up: int = 1
    take_down: int = 1
    each: int = 0
    clears: int = 0
    counts_per_revolution: int = 0

    def but(self, **changes):
        return replace(self, **changes)

    def holds(self, a, b, z):
        """The levels are within the gated index."""
        return bool((z ^ self.active_low) and not ((self.gate ^ (a | b << 1)) & self.gate_mask))


class IndexLatch:
    def __init__(self, w=32, check=1):
        self.w, self.check = w, check
        self.later, self.enabled, self.zeroed, self.reference = (0, 0, 0), 0, 0, 0
        self.reset()

    def reset(self):
        self.up = self.down = self.used = self.armed = self.found = self.index_count = 0
        self.known = self.judge = self.turn = self.judge_turn = self.wrong = 0

    def wrap(self, value):
        return (value + (1 << self.w - 1)) % (1 << self.w) - (1 << self.w - 1)

    def met(self, direction):
        return self.up if direction else self.down

    def clear(self, settings, direction):
        return int(self.met(direction) and self.enabled and settings.clears)

    def step(self, settings, levels, ready, direction, stepped, count, arm=0, rst=0, probe=0):
        """Complete a cycle with levels (a, b, z); stepped is the step of the decoder in this cycle:
        -1, 0, +1. Returns (armed, found, index_count, revolution_wrong).
        """
        met = self.met(direction)
        take = int(met and self.enabled)
        entering = (
            ready and settings.holds(*levels) and not settings.holds(*self.later) and not self.used
        )
        on = settings.each and settings.counts_per_revolution
        per = settings.counts_per_revolution
        self.wrong = int(
            bool(
                self.check
                and self.judge_turn
                and (self.turn % (1 << self.w)) not in (0, per, -per % (1 << self.w))
            )
        )
        self.judge_turn, self.turn = self.judge, self.wrap(self.index_count - self.reference)
        self.judge = int(bool(take and self.known and on))
        self.known = int(bool(on and (self.known or take)))
        if self.found:
            self.reference = 0 if self.zeroed else self.index_count
        if take:
            self.zeroed = settings.clears
        if take or probe:
            self.index_count = self.wrap(count + stepped)
        self.used = int((self.used or met) and levels[2] != settings.active_low)
        self.up, self.down = (
            int(entering and settings.take_up),
            int(entering and settings.take_down),
        )
        self.enabled = int(settings.each or self.armed)
        self.armed, self.found = int(arm or (self.armed and not take)), take
        self.later = tuple(levels)
        if rst:
            self.reset()
        return self.armed, self.found, self.index_count, self.wrong
