# SPDX-License-Identifier: Apache-2.0
"""A serial flash chip as its data sheet defines it: commands 03 read, AB wake, 06 write enable, 02
program, 20 erase a sector, 05 status.

pins(chip_n, sclk, sdo) is called whenever a level may have changed, and returns sdi. A chip that is
asleep does not answer, as after an iCE40 has configured itself. Programming only clears bits, and a
power failure may stop it after any byte: see `power`."""

SECTOR = 4096


class Flash:
    def __init__(self, size=1 << 21):
        self.memory = bytearray(b"\xff" * size)
        self.asleep, self.writable = True, False
        self.power = None  # bytes that may still be programmed before power fails; None: no failure
        self.chip_n = 1
        self.sclk = 0
        self.sdi = 1
        self.received = b""
        self.bits = self.count = 0
        self.answer = 0xFF

    def pins(self, chip_n, sclk, sdo):
        if chip_n:
            if not self.chip_n:
                self.ends()
            self.received, self.bits, self.count, self.answer = b"", 0, 0, 0xFF
        elif sclk and not self.sclk:
            self.bits, self.count = self.bits << 1 & 0xFF | sdo, self.count + 1
            if self.count == 8:
                self.received, self.count = self.received + bytes([self.bits]), 0
                self.answer = self.answers()
        elif not sclk and self.sclk:
            self.sdi = self.answer >> 7 - self.count & 1
        self.chip_n, self.sclk = chip_n, sclk
        return self.sdi

    def address(self):
        return int.from_bytes(self.received[1:4], "big") % len(self.memory)

    def answers(self):
        if self.asleep:
            return 0xFF
        if self.received[0] == 0x03 and len(self.received) >= 4:
            return self.memory[(self.address() + len(self.received) - 4) % len(self.memory)]
        return self.writable << 1 if self.received[0] == 0x05 else 0xFF

    def ends(self):
        command, complete = self.received[:1], self.count == 0
        if not command or not complete:
            return
        if self.asleep:
            self.asleep = command != b"\xab"
        elif command == b"\x06":
            self.writable = True
        elif self.writable and command == b"\x20":
            begin = self.address() // SECTOR * SECTOR
            self.change({begin + n: 0xFF for n in range(SECTOR)})
        elif self.writable and command == b"\x02":
            page = self.address() // 256 * 256
            self.change(
                {
                    page + (self.address() + n) % 256: byte
                    & self.memory[page + (self.address() + n) % 256]
                    for n, byte in enumerate(self.received[4:])
                }
            )

    def change(self, bytes_at):
        self.writable = False
        for address, byte in bytes_at.items():
            if self.power is not None:
                if self.power == 0:
                    return
                self.power -= 1
            self.memory[address] = byte
