# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/crc32_stream.sv, made with zlib: step(start, valid, data) advances one cycle
and returns crc after it.
"""

import zlib


class Crc32Stream:
    def __init__(self):
        self.crc = 0

    def step(self, start, valid, data, rst=0):
        if start or rst:
            self.crc = 0
        elif valid:
            self.crc = zlib.crc32(bytes([data]), self.crc)
        return self.crc
