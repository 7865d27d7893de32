# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/peripheral/ps2_device.sv. pins(...) returns the outputs; step(...) is one
cycle.
"""

from tb.peripheral.ps2_host import frame


class Ps2Device:
    def __init__(self, clk_hz):
        self.length, self.free = clk_hz // 50_000, clk_hz // 20_000
        self.received = self.damaged = None
        self.bits = []
        self.reset()

    def reset(self):
        self.state, self.elapsed, self.quarter, self.bit = "release", 0, 0, 0
        self.clock_low = self.data_low = self.valid = self.aborted = 0

    def eleventh(self):
        return self.elapsed == self.length - 1 and self.quarter == 0 and self.bit == 10

    def pins(self, clock):
        """(send_ready, valid, received, damaged, aborted, busy, clock_low, data_low); received and
        damaged only with valid.
        """
        byte = (self.received, self.damaged) if self.valid else (None, None)
        return (
            int(self.state == "send" and self.eleventh() and clock),
            self.valid,
            *byte,
            self.aborted,
            int(self.state in ("send", "receive")),
            self.clock_low,
            self.data_low,
        )

    def step(self, clock, data, send=None, damaged=0, ready=0, rst=0):
        self.aborted, waiting = 0, self.valid
        if self.valid and ready:
            self.valid = 0
        if self.state == "idle":
            free, self.elapsed = (
                self.elapsed >= self.free,
                min(self.elapsed + 1, self.free) if clock else 0,
            )
            if clock and free and (not waiting if not data else send is not None):
                self.state, self.elapsed, self.quarter, self.bit = (
                    "send" if data else "receive",
                    0,
                    0,
                    0,
                )
                self.bits = [*frame(send, damaged)[1:], 1] if data else []
                self.data_low = data
        elif self.state == "release":
            self.elapsed = 0
            if data or not clock:
                self.state = "idle"
        else:
            last = self.elapsed == self.length - 1
            if not clock and (self.quarter == 0 or self.quarter == 3 and last and self.bit < 10):
                self.state, self.elapsed, self.clock_low, self.data_low, self.aborted = (
                    "idle",
                    0,
                    0,
                    0,
                    1,
                )
            elif not last:
                self.elapsed += 1
            else:
                if self.state == "receive" and self.eleventh():
                    byte = sum(b << n for n, b in enumerate(self.bits[:8]))
                    self.received, self.damaged, self.valid = (
                        byte,
                        int(self.bits != frame(byte)[1:]),
                        1,
                    )
                self.elapsed, self.clock_low = 0, int(self.quarter in (0, 1))
                if self.quarter == 3:
                    if self.state == "receive":
                        self.bits.append(data)
                        self.data_low = int(self.bit == 9 and data)
                    else:
                        self.data_low = 1 - self.bits[self.bit]
                    self.bit += 1
                    self.state = "release" if self.bit == 11 else self.state
                self.quarter = (self.quarter + 1) % 4
        if rst:
            self.reset()
