# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/uart_rx.sv in integers, and waveforms for it.

UartRx.step(rx, bit_time) advances one cycle and returns (valid, data, ninth, framing_error,
start_glitch, busy) after it.
"""

from fractions import Fraction

from tb.serial.bit_timer import BitTimer


class UartRx:
    def __init__(self, ninth=1, parts=8):
        self.last, self.parts = 9 + ninth, parts  # number of the stop bit; ticks of a bit
        self.state, self.timer, self.ticks = "release", BitTimer(parts), 0
        self.bits, self.samples = [], []
        self.data = self.ninth = self.rx = None

    def step(self, rx, bit_time, rst=0):
        valid = framing_error = start_glitch = 0
        tick = self.timer.step(bit_time, self.state == "idle")
        if self.state == "idle":
            self.ticks, self.bits, self.samples = 0, [], []
            if not rx:
                self.state = "receive"
        elif self.state == "release":
            if rx:
                self.state = "idle"
        elif tick:
            self.ticks += 1
            if abs(self.ticks % self.parts - self.parts // 2) <= 1:
                self.samples.append(self.rx)
                if (
                    len(self.samples) == 3
                    or len(self.bits) == self.last
                    and self.samples in ([0, 0], [1, 1])
                ):
                    level, self.samples = int(sum(self.samples) >= 2), []
                    self.bits.append(level)
                    if len(self.bits) == 1 and level:
                        start_glitch, self.state = 1, "idle"
                    elif len(self.bits) == self.last + 1:
                        valid, framing_error = level, 1 - level
                        self.state = "idle" if level else "release"
                        self.data = sum(b << n for n, b in enumerate(self.bits[1:9]))
                        self.ninth = self.bits[9] if self.last == 10 else 0
        self.rx = rx
        if rst:
            valid = framing_error = start_glitch = 0
            self.state = "release"
        return valid, self.data, self.ninth, framing_error, start_glitch, int(self.state != "idle")


def character(data, ninth, stop=1):
    """The levels of one character, one per bit; ninth is None for 8N1."""
    return [0, *(data >> n & 1 for n in range(8)), *([] if ninth is None else [ninth]), stop]


def line(bits, bit_clk, phase=0):
    """The level in each cycle of `bits`, each of which is `bit_clk` cycles long (a fraction will
    do); the first edge is `phase` cycles, in [0, 1), after the first.
    """
    bit_clk, phase = Fraction(bit_clk), Fraction(phase)
    levels, n = [], 0
    for k, bit in enumerate(bits):
        end = phase + (k + 1) * bit_clk
        while n < end:
            levels.append(bit if n >= phase else 1)
            n += 1
    return levels
