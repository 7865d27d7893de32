# SPDX-License-Identifier: Apache-2.0
"""What rtl/drive/spi_dac.sv does, in integers: clk(...) is one clk and returns what is on the pins after it."""

RAISE, HALVES = 33, 36                  # half periods of sclk in a frame: before cs_n rises; in all


def code_of(command, trim):
    return 32768 + max(-32768, min(32767, command + trim))


class SpiDac:
    def __init__(self):
        self.reset()

    def reset(self):
        self.n = None                   # clk since the frame began, None: no frame
        self.due, self.enable, self.wanted, self.idle = 1, 0, 0, 0
        self.pins = (1, 0, 0, 0)
        return self.pins

    def clk(self, rst=0, half_clk=0, refresh=0, trim=0, enable=0, valid=0, command=0):
        """cs_n, sclk, sdi, sent."""
        if rst:
            return self.reset()
        cs_n, sclk, sdi, sent = self.pins
        idle, sent = self.n is None, 0
        if idle and (self.due or self.idle >= refresh):
            self.n, self.code, self.length, self.due = 0, code_of(self.wanted, trim), max(1, half_clk), 0
        elif not idle:
            self.n += 1
        if self.n is not None:
            half, rest = divmod(self.n, self.length)
            cs_n, sclk = int(half >= RAISE), int(half % 2 and half < RAISE)
            sdi, sent = self.code >> (15 - min(half // 2, 15)) & 1, int(half == RAISE and rest == 0)
            if half == HALVES:
                self.n = None
        self.idle = self.idle + 1 & 0xFFFF if idle else 0
        self.due = int(bool(self.due or valid and enable or enable != self.enable))
        self.wanted = 0 if not enable else command if valid else self.wanted
        self.enable, self.pins = enable, (cs_n, sclk, sdi, sent)
        return self.pins
