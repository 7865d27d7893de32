# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/uart_tx.sv in integers.

step(valid, data, ninth, bit_time) advances one cycle and returns (ready, tx, driver_enable) after
it, for the same bit_time; `ready` is also the answer to `valid` of the next cycle.
"""

from tb.serial.bit_timer import BitTimer


class UartTx:
    def __init__(self, ninth=1, parts=8):
        self.has_ninth, self.parts = ninth, parts
        self.lead, self.trail = parts + 1, parts // 2 + 1  # ticks
        self.state, self.bits, self.timer, self.left = "idle", [], BitTimer(parts), 0

    def ready(self, bit_time):
        """left: ticks until the lead, the bit or the trail ends."""
        ends = self.left == 1 and self.timer.tick(bit_time)
        return int(
            self.state == "lead"
            and ends
            or self.state == "send"
            and ends
            and len(self.bits) == 1
            or self.state == "trail"
        )

    def step(self, valid, data, ninth, bit_time, rst=0):
        take = valid and self.ready(bit_time)
        trail = self.state == "trail"
        tick = self.timer.step(bit_time, self.state == "idle" or (trail and valid))
        if rst:
            self.state = "idle"
        elif take:
            self.bits = [0, *(data >> n & 1 for n in range(8)), *[ninth] * self.has_ninth, 1]
            self.state, self.left = "send", self.parts
        elif self.state == "idle":
            self.state, self.left = ("lead" if valid else "idle"), self.lead
        elif tick and self.left > 1:
            self.left -= 1
        elif tick and self.state == "send" and len(self.bits) > 1:
            self.bits.pop(0)
            self.left = self.parts
        elif tick:
            self.state, self.left = ("idle" if trail else "trail"), self.trail
        tx = self.bits[0] if self.state == "send" else 1
        return self.ready(bit_time), tx, int(self.state != "idle")
