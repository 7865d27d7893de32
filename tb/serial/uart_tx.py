# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/uart_tx.sv in integers.

step(valid, data, ninth, bit_time) advances one cycle and returns (ready, tx, driver_enable) after
it; `ready` is also the answer to `valid` of the next cycle. Times are exact sixteenths of a cycle:
an edge comes in the cycle at or before its time.
"""


class UartTx:
    def __init__(self, ninth=1):
        self.has_ninth = ninth
        self.state, self.bits, self.left = "idle", [], 0

    def ready(self):
        ends = self.left < 16
        return int(
            self.state == "lead"
            and ends
            or self.state == "send"
            and ends
            and len(self.bits) == 1
            or self.state == "trail"
        )

    def step(self, valid, data, ninth, bit_time, rst=0):
        whole, ends = max(bit_time, 128), self.left < 16
        take = valid and self.ready()
        fraction = self.left if ends else 0
        if rst:
            self.state = "idle"
        elif take:
            self.bits = [0, *(data >> n & 1 for n in range(8)), *[ninth] * self.has_ninth, 1]
            self.left = whole - 16 if self.state == "trail" else self.left + whole - 16
            self.state = "send"
        elif self.state == "idle":
            self.state, self.left = ("lead" if valid else "idle"), whole - 1
        elif not ends:
            self.left -= 16
        elif self.state == "send" and len(self.bits) > 1:
            self.bits.pop(0)
            self.left += whole - 16
        elif self.state == "send":
            self.state, self.left = "trail", fraction + whole // 2
        elif self.state == "lead":
            self.state, self.left = "trail", fraction + whole - 16
        else:
            self.state = "idle"
        return self.ready(), self.bits[0] if self.state == "send" else 1, int(self.state != "idle")
