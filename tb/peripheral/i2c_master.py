# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/peripheral/i2c_master.sv: step(...) is one cycle and returns the pins
after it.
"""

START, STOP, WRITE, READ, RECOVER = range(5)
OK, NOT_ACKNOWLEDGED, LOST, NO_BUS = range(4)


class I2cMaster:
    def __init__(self, clk_hz, bus_hz, stretch_us):
        self.low, self.high = (
            -(-clk_hz // 10 * 11 // (2 * bus_hz)),
            -(-clk_hz // 10 * 9 // (2 * bus_hz)),
        )
        self.stretch = clk_hz // 1000 * stretch_us // 1000
        self.elapsed = 0
        self.kind, self.bits, self.read = None, [], []
        self.result, self.read_data = None, None
        self.reset()

    def reset(self):
        self.state, self.free, self.owned, self.scl_low, self.sda_low, self.done = (
            "idle",
            0,
            0,
            0,
            0,
            0,
        )

    def go(self, state):
        self.state, self.elapsed = state, 0

    def end(self, result=None, let_go=False):
        self.done, self.result = 1, self.result if result is None else result
        if let_go:
            self.owned = self.scl_low = self.sda_low = 0
        self.go("idle")

    def pins(self):
        """(command_ready, done, result, read_data, owned, scl_low, sda_low); result is for done."""
        result = self.result if self.done else None
        return (
            int(self.state == "idle"),
            self.done,
            result,
            self.read_data,
            self.owned,
            self.scl_low,
            self.sda_low,
        )

    def step(self, scl, sda, command=None, data=0, acknowledge=0, rst=0):
        free, elapsed = self.free, self.elapsed
        self.free = min(free + 1, self.low) if scl and sda else 0
        self.elapsed, self.done = elapsed + 1, 0
        if self.state == "idle":
            self.elapsed = 0
            if command is not None:
                command = min(command, RECOVER)
                self.kind, self.read, self.result = command, [], OK
                self.bits = (
                    [*(data >> n & 1 for n in range(7, -1, -1)), 1]
                    if command == WRITE
                    else [1] * 8 + [1 - acknowledge]
                )
                if command == START and not self.owned:
                    self.go("free")
                elif command != RECOVER and not self.owned:
                    self.end(LOST)
                else:
                    self.scl_low = 1
                    self.go("pulled")
        elif self.state in ("rise", "free", "ended") and elapsed >= self.stretch:
            self.end(NO_BUS, let_go=True)
        elif self.state == "pulled":
            if elapsed == self.low // 4:
                self.sda_low = (
                    1 - self.bits[len(self.read)]
                    if self.kind in (WRITE, READ)
                    else int(self.kind == STOP)
                )
            if elapsed == self.low - 1:
                self.scl_low = 0
                self.go("free" if self.kind == START else "rise")
        elif self.state == "rise":
            if scl:
                self.go("raised")
        elif self.state == "raised":
            if elapsed == self.high - 1:
                self.read.append(sda)
                self.bit(sda, len(self.read) == 9)
        elif self.state == "free":
            if free == self.low:
                self.sda_low = 1
                self.go("begun")
        elif self.state == "begun":
            if elapsed == self.high - 1:
                self.scl_low = self.owned = 1
                self.end()
        elif free == self.low:
            self.end()
        if rst:
            self.reset()
        return self.pins()

    def bit(self, sda, ninth):
        """The end of a bit's high time."""
        if self.kind == STOP:
            self.sda_low = self.owned = 0
            self.go("ended")
        elif self.kind == RECOVER:
            self.scl_low = 1
            self.kind = STOP if sda or ninth else RECOVER
            self.go("pulled")
        elif self.kind == WRITE and not ninth and not self.sda_low and not sda:
            self.end(LOST, let_go=True)
        else:
            self.scl_low = 1
            self.go("pulled")
            if ninth:
                if self.kind == READ:
                    self.read_data = int("".join(map(str, self.read[:8])), 2)
                self.end(NOT_ACKNOWLEDGED if self.kind == WRITE and sda else OK)
