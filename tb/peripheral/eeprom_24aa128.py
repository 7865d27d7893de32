# SPDX-License-Identifier: Apache-2.0
"""A Microchip 24AA128 on the lines of a bus: 16 KiB, pages of 64 bytes, busy (no acknowledge) while
it writes.

step(scl, sda) is one cycle and returns (scl_low, sda_low).
"""

SIZE, PAGE = 16384, 64


class Eeprom:
    def __init__(self, address=0x50, write_clk=2000, stretch=0):
        self.address, self.write_clk, self.stretch = address, write_clk, stretch
        self.memory = bytearray(b"\xff" * SIZE)
        self.state, self.sda_low, self.scl_low, self.busy, self.last = "idle", 0, 0, 0, (1, 1)
        self.bits, self.page, self.writes, self.pointer = [], {}, 0, 0

    def step(self, scl, sda):
        (scl_before, sda_before), self.last = self.last, (scl, sda)
        self.busy, self.scl_low = max(self.busy - 1, 0), max(self.scl_low - 1, 0)
        if scl and scl_before and sda != sda_before:
            if sda:
                self.stop()
            else:
                self.state, self.bits, self.page, self.sda_low = "address", [], {}, 0
        elif scl and not scl_before:
            if self.state != "idle":
                self.bits.append(sda)
        elif scl_before and not scl and self.state != "idle":
            self.fall()
        return int(self.scl_low > 0), self.sda_low

    def stop(self):
        if (
            self.state == "data" and self.page and not self.bits[1:]
        ):  # at the border of a byte; the stop's own edge came before
            for address, byte in self.page.items():
                self.memory[address] = byte
            self.busy, self.writes = self.write_clk, self.writes + 1
        self.state, self.sda_low, self.page = "idle", 0, {}

    def fall(self):
        self.sda_low = 0
        if len(self.bits) == 8 and self.state != "read":
            self.sda_low = int(self.take(sum(b << 7 - n for n, b in enumerate(self.bits))))
            self.scl_low = self.stretch
        elif self.state == "read" and len(self.bits) == 9 and self.bits[8]:
            self.state = "idle"  # not acknowledged: the read ends
        if len(self.bits) == 9:
            self.bits = []
            if self.state == "answer":
                self.state, self.pointer = "read", (self.pointer - 1) % SIZE
            if self.state == "read":
                self.pointer = (self.pointer + 1) % SIZE
        if self.state == "read" and len(self.bits) < 8:
            self.sda_low = 1 - (self.memory[self.pointer] >> 7 - len(self.bits) & 1)

    def take(self, byte):
        """Take a byte; returns whether it is acknowledged."""
        if self.state == "address":
            mine = byte >> 1 == self.address and not self.busy
            self.state = "idle" if not mine else "answer" if byte & 1 else "high"
            return mine
        if self.state == "high":
            self.pointer, self.state = (byte << 8) % SIZE, "low"
        elif self.state == "low":
            self.pointer, self.state = self.pointer | byte, "data"
        else:
            self.page[self.pointer] = byte
            self.pointer = self.pointer // PAGE * PAGE + (self.pointer + 1) % PAGE
        return True
