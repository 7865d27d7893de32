# SPDX-License-Identifier: Apache-2.0
"""What rtl/drive/spi_dac.sv does, in integers: clk(...) is one clk and returns what is on the pins
after it.
"""

from tb.peripheral.spi_word_sender import SpiWordSender


def code_of(command, trim):
    return 32768 + max(-32768, min(32767, command + trim))


class SpiDac:
    def __init__(self):
        self.reset()

    def reset(self):
        self.frames, self.ready = SpiWordSender(), 1
        self.due, self.enable, self.wanted, self.idle = 1, 0, 0, 0
        return self.frames.pins()[1:]

    def clk(self, rst=0, half_period=0, refresh=0, trim=0, enable=0, valid=0, command=0):
        """cs_n, sclk, sdi, sent."""
        if rst:
            return self.reset()
        free = self.ready
        present = self.due or self.idle >= refresh
        self.ready, *pins = self.frames.step(present, code_of(self.wanted, trim), half_period)
        self.idle = self.idle + 1 & 0xFFFF if free else 0
        self.due = int(bool(self.due and not free or valid and enable or enable != self.enable))
        self.wanted = 0 if not enable else command if valid else self.wanted
        self.enable = enable
        return tuple(pins)
