# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/flash_loader.sv: step(miso) advances one cycle, pins() are those after it, and
stored(miso) is what is stored in the cycle that begins, with the level of miso in it.

Time is counted in periods of 64 cycles: wake, pause, command, words.
"""

WAKE, READ = 0xAB000000, 0x03000000


class FlashLoader:
    def __init__(self, words=4096, start=131072, pause=64):
        self.words, self.start, self.pause = words, start, pause
        self.reset()

    def reset(self):
        self.cycle, self.sent, self.bits = 0, WAKE, []

    @property
    def period(self):
        return self.cycle // 64

    @property
    def done(self):
        return int(self.period >= self.pause + 2 + self.words)

    @property
    def cs_n(self):
        return int(0 < self.period <= self.pause or self.done)

    def pins(self):
        """(cs_n, sclk, done) and the level of mosi while a command is sent, else None."""
        sends = self.period in (0, self.pause + 1)
        word = WAKE if self.period == 0 else READ | self.start
        mosi = word >> 31 - self.cycle % 64 // 2 & 1 if sends else None
        return self.cs_n, int(self.cycle % 2 and not self.cs_n), self.done, mosi

    def stored(self, miso):
        """(address, word) that is stored in this cycle, or None."""
        first = self.pause + 2
        if self.cycle % 64 != 63 or self.period < first or self.done:
            return None
        bits = [*self.bits, miso]
        octets = [sum(b << 7 - n for n, b in enumerate(bits[k : k + 8])) for k in range(0, 32, 8)]
        return self.period - first, int.from_bytes(bytes(octets), "little")

    def step(self, miso, rst=0):
        if rst:
            self.reset()
            return
        if self.cycle % 2:
            self.bits = [*self.bits, miso] if self.cycle % 64 != 63 else []
        if not self.done:
            self.cycle += 1
