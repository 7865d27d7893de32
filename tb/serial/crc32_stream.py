# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/crc32_stream.sv, made with zlib: step(start, valid, data) advances one cycle
and returns crc after it, or None while a byte is not done.
"""

import zlib


class Crc32Stream:
    def __init__(self, bits=8):
        self.crc, self.left = 0, 0
        self.steps = 0 if bits == 8 else 8 // bits  # cycles after that of the byte

    def step(self, start, valid, data, rst=0):
        self.left = max(self.left - 1, 0)
        if start or rst:
            self.crc, self.left = 0, 0
        if valid and not rst:
            self.crc, self.left = zlib.crc32(bytes([data]), self.crc), self.steps
        return None if self.left else self.crc
