# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/position/count_phase_check.sv: step() advances one cycle and returns the levels of
disagreement after it.
"""

LATENCY = 3


def wrapped(difference):
    """Wrap to 32 bits with a sign: 2^16 periods."""
    return (difference + (1 << 31)) % (1 << 32) - (1 << 31)


class CountPhaseCheck:
    def __init__(self, axes=1):
        self.travelled = [None] * axes  # None: to be learned
        self.disagreement, self.flow = 0, [None] * (LATENCY - 1)

    def judge(self, axis, step, count, limit):
        """Take one step; returns whether position and count disagree."""
        if self.travelled[axis] is None or not limit:
            self.travelled[axis] = count << 14
            return 0
        self.travelled[axis] += step
        return int(abs(wrapped(self.travelled[axis] - (count << 14))) > limit)

    def step(self, learn, valid, axis, step, count, limit):
        """`learn` has one bit for each axis."""
        self.flow.append((axis, self.judge(axis, step, count, limit)) if valid else None)
        ready = self.flow.pop(0)
        if ready:
            self.disagreement = self.disagreement & ~(1 << ready[0]) | ready[1] << ready[0]
        for n in range(len(self.travelled)):
            if learn >> n & 1:
                self.travelled[n] = None
                self.disagreement &= ~(1 << n)
                self.flow = [(n, 0) if one and one[0] == n else one for one in self.flow]
        return self.disagreement
