# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/frame_check.sv: step(...) advances one cycle and returns (valid, good,
frame_good, frame_bad, sync) after it; good is None without valid.

It keeps the bytes of the frame and asks zlib at its end.
"""

import zlib


def frame(command, body):
    """The words of a whole frame as (data, ninth)."""
    payload = bytes([command, len(body)]) + bytes(body)
    return [(command, 1)] + [
        (b, 0) for b in payload[1:] + zlib.crc32(payload).to_bytes(4, "little")
    ]


CYCLES = 9  # from a word to its result; sync comes one cycle later


class FrameCheck:
    def __init__(self, longest=64):
        self.longest = longest
        self.bytes = None  # of the running frame, the command byte first
        # cycles until the result of a word: passed, ended, good, for all nodes
        self.left, self.result = 0, None
        self.to_all = 0  # in the cycle before a good frame for all nodes ended

    def step(self, valid, data, command, framing_error, rst=0):
        if rst:
            self.bytes, self.left, self.to_all = None, 0, 0
            return 0, None, 0, 0, 0
        broken = passed = ended = good = to_all = 0
        out = 0, None, 0, 0
        sync, self.to_all = self.to_all, 0
        if self.left:
            self.left -= 1
            if not self.left and self.result[0]:
                _, ended, good, self.to_all = self.result
                out = 1, good, good, int(ended and not good)
                ended = good = 0
        if self.bytes is not None and framing_error:
            self.bytes, broken = None, 1
        if valid and command:
            broken |= self.bytes is not None
            self.bytes, passed = bytes([data]) if data & 0x20 else None, 1
        elif valid and self.bytes is not None:
            self.bytes, passed = self.bytes + bytes([data]), 1
            length = self.bytes[1]
            if not 1 <= length <= self.longest:
                self.bytes, broken = None, 1
            elif len(self.bytes) == length + 6:
                ended = 1
                good = int(zlib.crc32(self.bytes[:-4]) == int.from_bytes(self.bytes[-4:], "little"))
                to_all = int(good and not self.bytes[0] & 15)
                self.bytes = None
        if valid:
            self.left, self.result = CYCLES - 1, (passed, ended, good, to_all)
        return *out[:3], int(out[3] or broken), sync

    def word(self, valid, data, command):
        """A word and the cycles that it takes: (passed, good, bad, sync)."""
        seen = [self.step(valid and not n, data, command, 0) for n in range(CYCLES + 1)]
        passed, good, *_ = seen[CYCLES - 1]
        return passed, int(passed and good), sum(bad for *_, bad, _ in seen), seen[-1][-1]
