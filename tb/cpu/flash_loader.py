# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/flash_loader.sv: step(miso) advances one cycle, pins() are those after it, and
stored(miso) is what is stored in the cycle that begins, with the level of miso in it.

Time is counted in periods of 64 cycles: wake, pause, command, words. After them send(data, ends)
sends a byte in the 16 cycles after the cycle that begins.
"""

WAKE, READ = 0xAB000000, 0x03000000


class FlashLoader:
    def __init__(self, words=4096, start=131072, pause=64, slot=0):
        self.words, self.start, self.pause = words, start + 65536 * slot, pause
        self.reset()

    def reset(self):
        self.cycle, self.sent, self.bits = 0, WAKE, []
        self.left, self.byte, self.selected, self.ends = 0, 0, False, True

    @property
    def period(self):
        return self.cycle // 64

    @property
    def done(self):
        return int(self.period >= self.pause + 2 + self.words)

    @property
    def cs_n(self):
        if self.done:
            return int(not self.selected)
        return int(0 < self.period <= self.pause)

    def pins(self):
        """(cs_n, sclk, done) and the level of mosi while a command is sent, else None."""
        if self.done:
            mosi = self.byte >> (self.left - 1) // 2 & 1 if self.left else None
            return self.cs_n, int(self.left % 2), 1, mosi
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

    def answer(self):
        """The byte that was received while the last one was sent."""
        return sum(bit << 7 - n for n, bit in enumerate(self.bits))

    def step(self, miso, rst=0, send=None):
        """One cycle; `send` is (data, ends) with the strobe."""
        if rst:
            self.reset()
            return
        if self.done:
            if self.left:
                self.bits = [*self.bits, miso] if self.left % 2 else self.bits
                self.left -= 1
                self.selected = bool(self.left) or not self.ends
            elif send:
                (self.byte, self.ends), self.left, self.selected = send, 16, True
                self.bits = []
            return
        if self.cycle % 2:
            self.bits = [*self.bits, miso] if self.cycle % 64 != 63 else []
        if not self.done:
            self.cycle += 1
