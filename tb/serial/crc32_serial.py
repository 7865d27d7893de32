# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/crc32_serial.sv, made with zlib: step(start, valid, data, check) advances one
cycle and returns (busy, done, wrong, crc) after it; wrong and crc are None where they are not
defined.
"""

import zlib

CYCLES = 8  # after that of the byte


class Crc32Serial:
    def __init__(self):
        self.crc, self.left, self.checked, self.wrong = 0, 0, 0, 0

    def step(self, start, valid, data, check, rst=0):
        done = self.left == 1
        self.left = max(self.left - 1, 0)
        if start or rst:
            self.crc, self.left, self.checked, self.wrong = 0, 0, 0, 0
        if valid and not rst:
            self.left = CYCLES
            if check:
                expected = self.crc.to_bytes(4, "little")[self.checked]
                self.checked += 1
                self.wrong = int(self.wrong or data != expected)
            else:
                self.crc = zlib.crc32(bytes([data]), self.crc)
        ready = not self.left
        crc = self.crc if ready and not self.checked else None
        return int(self.left > 0), int(done and not rst), self.wrong if ready else None, crc
