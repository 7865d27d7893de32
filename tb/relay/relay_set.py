# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/relay/relay_set.sv: clk(...) is one cycle, and the attributes are the state after
it. zlib computes the CRC-32 at the end of a row. image(...) makes the bytes of a set.
"""

import math
import zlib

SETTINGS = 5


def marker(k, segments=0):
    return 0x4D4F4900 + (128 + segments if segments else k)


def image(
    terms,
    counts_per_turn,
    minimum_edge_separation=1,
    hysteresis=0x4000,
    filter_required=0,
    index_low=0,
    gate_mask=0,
    gate=0,
    segments=0,
):
    """The bytes of a set; terms are the words (amplitude, phase) of each order from 1 up, or two
    points each.
    """
    angle = round(2**48 / counts_per_turn) if counts_per_turn else 0
    radians = round(2 * math.pi * 2**40 / counts_per_turn) % 2**32 if counts_per_turn else 0
    words = [
        marker(len(terms), segments),
        counts_per_turn,
        angle % 2**32,
        angle >> 32 | minimum_edge_separation << 16,
        radians,
        hysteresis | filter_required << 16 | (index_low << 4 | gate_mask << 2 | gate) << 24,
    ]
    for amplitude, phase in terms:
        words += [amplitude % 2**32, phase % 2**32]
    body = b"".join(word.to_bytes(4, "little") for word in words)
    return body + zlib.crc32(body).to_bytes(4, "little")


class RelaySet:
    def __init__(self, k=16, segments=0):
        self.k, self.segments = k, segments
        self.row = self.judged = None  # bytes so far; the complete row of the cycle before
        self.settings, self.identity = 0, 0
        self.loaded = self.good = self.bad = False
        self.write = None  # (term, amplitude, phase)

    def clk(self, rst=0, start=0, valid=0, data=0):
        if rst:
            self.__init__(self.k, self.segments)
            return
        judged, self.judged, self.write = self.judged, None, None
        self.good = (
            judged is not None
            and zlib.crc32(judged[:-4]) == int.from_bytes(judged[-4:], "little")
            and self.sensible(judged)
        )
        self.bad = judged is not None and not self.good
        if self.good:
            self.settings = int.from_bytes(judged[4 : 4 + 4 * SETTINGS], "little")
            self.identity, self.loaded = int.from_bytes(judged[-4:], "little"), True
        if valid and self.row is not None:
            self.row += bytes([data])
            terms = len(self.row) - 4 - 4 * SETTINGS
            if terms > 0 and terms % 8 == 0:
                amplitude, phase = (
                    int.from_bytes(self.row[n:][:4], "little")
                    for n in (len(self.row) - 8, len(self.row) - 4)
                )
                self.write = terms // 8 - 1, amplitude, phase
            if terms == 8 * self.k + 4:
                self.judged, self.row = None if start else self.row, None
        if start:
            self.row = b""

    def sensible(self, row):
        """The checks beyond the CRC-32."""
        words = [int.from_bytes(row[n : n + 4], "little") for n in range(0, len(row), 4)]
        sizes = [~word % 2**32 if word >> 31 else word for word in words[1 + SETTINGS : -1]]
        held = max(sizes) < 2**23 if self.segments else sum(sizes[::2]) < 2**29
        return words[0] == marker(self.k, self.segments) and 1609 <= words[1] <= 2**25 and held
