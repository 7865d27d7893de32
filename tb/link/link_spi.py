# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/link/link_spi.sv in integers: outputs(...) gives the outputs of a cycle, step(...)
advances it.
"""

from moire.made import link_tables as layout

NAMES = ("miso", "valid", "data", "ends", "broken", "cut", "reply_taken")


class LinkSpi:
    def __init__(self):
        self.before = 0
        self.reset()

    def reset(self):
        self.bits, self.request, self.sent = [], b"", [0] * 8
        self.state = "request"

    def seen(self, cs_n, sclk, mosi):
        """(the bits of the byte with that of this cycle, whether a byte is whole)"""
        rises = sclk and not self.before and not cs_n
        bits = [*self.bits, mosi] if rises else self.bits
        return bits, len(bits) == 8

    def outputs(self, cs_n, sclk, mosi, **_):
        """The outputs by NAMES; None where a value has no meaning in this cycle."""
        bits, whole = self.seen(cs_n, sclk, mosi)
        begun = bool(self.bits or self.request)
        requested = self.state == "request"
        valid = int(whole and requested)
        data = int("".join(map(str, bits)), 2) if valid else None
        broken = int(cs_n and requested and begun)
        if requested:
            cut = broken
        else:
            cut = int(cs_n and (self.state != "done" or bool(self.bits)))
        taken = int(self.state != "answer" or whole)
        ends = int(self.state == "ended" or broken)
        return self.sent[0], valid, data, ends, broken, cut, taken

    def step(self, rst, writes, cs_n, sclk, mosi, accepted, reply_valid, reply_data, reply_last):
        bits, whole = self.seen(cs_n, sclk, mosi)
        rises = bits is not self.bits
        self.before = sclk
        if rst or cs_n:
            return self.reset()
        self.bits = [] if whole else bits
        if rises:
            self.sent = [*self.sent[1:], 0]
        if self.state == "request" and whole:
            self.request += bytes([int("".join(map(str, bits)), 2)])
            if len(self.request) == 4 * (writes + layout.FRAME_WORDS):
                self.state = "ended"
        elif self.state == "ended":
            self.state = "judged"
        elif self.state == "judged":
            self.state = "answer" if accepted else "done"
        elif self.state == "answer" and whole and reply_valid:
            self.sent = [reply_data >> n & 1 for n in range(7, -1, -1)]
            self.state = "last" if reply_last else "answer"
        elif self.state == "last" and whole:
            self.state = "done"
        return None
