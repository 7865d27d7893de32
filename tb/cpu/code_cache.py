# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/code_cache.sv: step(request, address, miso) advances one cycle; ready, word and
pins() are those after it.

Time is counted in periods of 64 cycles: wake and pause after a reset, then command and words of
each line that is read.
"""

WAKE, READ, LINE_WORDS = 0xAB000000, 0x03000000, 8


class CodeCache:
    def __init__(self, start, lines, pause):
        self.start, self.lines, self.pause = start, lines, pause
        self.reset()

    def reset(self):
        self.kept: dict[int, tuple[int, list[int]]] = {}  # {line: (its number, its words)}
        self.wakes, self.reads = 0, None  # cycles since the reset, since the line was asked for
        self.number, self.words, self.bits = 0, [], []
        self.sent, self.ready, self.word, self.looked = WAKE, 0, None, False

    @property
    def awake(self):
        return self.wakes == 64 * (self.pause + 1)

    def pins(self):
        """(cs_n, sclk), and the level of mosi while a command is sent, else None."""
        at = self.reads if self.awake else self.wakes
        selected = at is not None and (self.awake or at < 64)
        mosi = self.sent >> 31 - at // 2 & 1 if selected and at < 64 else None
        return int(not selected), int(selected and at % 2), mosi

    def step(self, request, address, miso, rst=0):
        """One cycle."""
        if rst:
            self.reset()
            return
        looked, missed, self.looked, self.ready = self.looked, False, False, 0
        if not self.awake:
            self.wakes += 1
        elif self.reads is not None:
            self.read(miso)
        elif looked:
            missed = self.word is None
        else:
            self.looked = bool(request)
        if missed:
            self.number, self.reads, self.words, self.bits = address // LINE_WORDS, 0, [], []
            self.sent = READ | self.start + 4 * LINE_WORDS * self.number
            self.looked = False
        if self.looked:
            number = address // LINE_WORDS
            kept, words = self.kept.get(number % self.lines, (None, []))
            self.word = words[address % LINE_WORDS] if kept == number else None
            self.ready = int(self.word is not None)

    def read(self, miso):
        """A cycle of the command or of the words of a line."""
        if self.reads >= 64 and self.reads % 2:
            self.bits.append(miso)
        if len(self.bits) == 32:
            octets = [
                sum(b << 7 - n for n, b in enumerate(self.bits[k : k + 8])) for k in range(0, 32, 8)
            ]
            self.words.append(int.from_bytes(bytes(octets), "little"))
            self.bits = []
        self.reads += 1
        if len(self.words) == LINE_WORDS:
            self.kept[self.number % self.lines] = self.number, self.words
            self.reads = None
