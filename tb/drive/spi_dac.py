# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/spi_dac.sv in integers: clk(...) advances one cycle and returns the pins after
it.
"""

from tb.peripheral.spi_word_sender import SpiWordSender


def code_of(command, trim):
    """The offset binary code of a command."""
    return 32768 + max(-32768, min(32767, command + trim))


class SpiDac:
    def __init__(self):
        self.reset()

    def reset(self):
        self.frames, self.ready = SpiWordSender(), 1
        self.due, self.enable, self.required, self.idle = 1, 0, 0, 0
        return self.frames.pins()[1:]

    def clk(self, rst=0, half_period=0, refresh=0, trim=0, enable=0, valid=0, command=0):
        """Advance one cycle and return (cs_n, sclk, sdi, sent)."""
        if rst:
            return self.reset()
        free = self.ready
        send = self.due or self.idle >= refresh
        self.ready, *pins = self.frames.step(send, code_of(self.required, trim), half_period)
        self.idle = self.idle + 1 & 0xFFFF if free else 0
        self.due = int(bool(self.due and not free or valid and enable or enable != self.enable))
        self.required = 0 if not enable else command if valid else self.required
        self.enable = enable
        return tuple(pins)
