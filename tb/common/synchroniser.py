# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/common/synchroniser.sv: step(d) advances one cycle and returns q after it.

With CROSSINGS=seed in the environment, it is the model of sw/twin/crossings/synchroniser.sv, whose
random numbers come from the seed and from the name of the instance.
"""

from twin import crossings

MASK = (1 << 32) - 1


def first(name, seed):
    """The first random number of an instance: FNV-1a of its name."""
    number = 0x811C9DC5 ^ seed
    for letter in name.encode():
        number = (number ^ letter) * 0x01000193 & MASK
    return number or 1


def following(number):
    """xorshift32"""
    number ^= number << 13 & MASK
    number ^= number >> 17
    return number ^ (number << 5 & MASK)


class Synchroniser:
    def __init__(self, w=1, stages=2, reset=0, name="synchroniser"):
        self.reset = reset % (1 << w)
        self.stages = [self.reset] * stages
        self.first = first(name, crossings.seed()) if crossings.seed() else 0
        self.drawn = self.first
        self.late = 0

    def step(self, d, rst=0):
        fresh = (d ^ self.stages[0]) & ~self.late
        kept = fresh & self.drawn
        if rst:
            self.stages, self.late = [self.reset] * len(self.stages), 0
            self.drawn = self.first
        else:
            self.stages, self.late = [d ^ kept, *self.stages[:-1]], kept
            if fresh and self.drawn:
                self.drawn = following(self.drawn)
        return self.stages[-1]
