# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/peripheral/ps2_host.sv. pins() returns the outputs, step(...) is a cycle."""


def frame(byte, damaged=0):
    """The eleven bits of a byte: start, data LSB first, odd parity, stop."""
    return [0, *(byte >> n & 1 for n in range(8)), (bin(byte).count("1") + 1 + damaged) % 2, 1]


class Ps2Host:
    def __init__(self, clk_hz):
        ms = clk_hz // 1000
        self.hold, self.setup, self.gap, self.first = (
            clk_hz // 10_000,
            ms // 50 + 1,
            ms * 3 // 10,
            ms * 15,
        )
        self.longest = (1 << self.first.bit_length()) - 1
        self.elapsed, self.bits, self.clock_q = 0, [], 0
        self.received, self.damaged = None, None
        self.reset()

    def reset(self):
        self.state, self.data_low, self.valid, self.sent, self.unsent = "release", 0, 0, 0, 0

    def rested(self):
        return int(self.state == "held" and self.elapsed >= self.hold and not self.valid)

    def pins(self, command_valid=0):
        """(command_ready, valid, received, damaged, sent, unsent, held, busy, clock_low, data_low);
        received, damaged only with valid.
        """
        rested, byte = self.rested(), (self.received, self.damaged) if self.valid else (None, None)
        return (
            rested,
            self.valid,
            *byte,
            self.sent,
            self.unsent,
            int(rested and not command_valid),
            int(self.state in ("receive", "request", "command")),
            int(self.state in ("held", "request")),
            self.data_low,
        )

    def step(self, clock, data, hold=0, ready=0, command=None, damaged=0, rst=0):
        fall, rested = self.clock_q and not clock, self.rested()
        elapsed, self.elapsed = self.elapsed, min(self.elapsed + 1, self.longest)
        self.clock_q, self.sent, self.unsent = clock, 0, 0
        if self.valid and ready:
            self.valid = 0
        if self.state == "idle":
            self.elapsed, self.bits = 0, []
            self.state = (
                "receive"
                if fall and not data
                else "held"
                if hold or command is not None
                else "idle"
            )
        elif self.state == "receive":
            if fall:
                self.bits, self.elapsed = [*self.bits, data], 0
            cut = elapsed >= self.gap
            if cut or len(self.bits) == 10:
                byte = sum(b << n for n, b in enumerate(self.bits[:8]))
                self.received = 0 if cut else byte
                self.damaged = int(cut or self.bits != frame(byte)[1:])
                self.valid, self.state, self.elapsed = 1, "held", 0
        elif self.state == "held":
            if rested and command is not None:
                self.bits, self.state, self.data_low, self.elapsed = (
                    frame(command, damaged)[1:],
                    "request",
                    1,
                    0,
                )
            elif rested and not hold:
                self.state = "release"
        elif self.state == "request":
            if elapsed >= self.setup:
                self.state, self.elapsed = "command", 0
        elif self.state == "command":
            if fall and not self.bits:
                self.sent, self.unsent, self.state, self.data_low, self.elapsed = (
                    int(not data),
                    int(data),
                    "release",
                    0,
                    0,
                )
            elif fall:
                self.data_low, self.bits, self.elapsed = 1 - self.bits[0], self.bits[1:], 0
            elif elapsed >= (self.first if len(self.bits) == 10 else self.gap):
                self.data_low, self.unsent, self.state, self.elapsed = 0, 1, "held", 0
        elif clock:
            self.state = "idle"
        if rst:
            self.reset()
