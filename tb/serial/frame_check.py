# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/frame_check.sv: step(...) advances one cycle and returns (valid, data,
command, good, frame_good, frame_bad, sync) after it.

It keeps the bytes of the frame and asks zlib at its end.
"""

import zlib


def frame(command, body):
    """The words of a whole frame as (data, ninth)."""
    payload = bytes([command, len(body)]) + bytes(body)
    return [(command, 1)] + [
        (b, 0) for b in payload[1:] + zlib.crc32(payload).to_bytes(4, "little")
    ]


class FrameCheck:
    def __init__(self, longest=64):
        self.longest, self.bytes = (
            longest,
            None,
        )  # bytes of the running frame, the command byte first

    def step(self, valid, data, command, framing_error, rst=0):
        if rst:
            self.bytes = None
            return 0, data, command, 0, 0, 0, 0
        good = bad = passed = sync = 0
        if self.bytes is not None and framing_error:
            self.bytes, bad = None, 1
        if valid and command:
            bad |= self.bytes is not None
            self.bytes, passed = bytes([data]) if data & 0x20 else None, 1
        elif valid and self.bytes is not None:
            self.bytes, passed = self.bytes + bytes([data]), 1
            length = self.bytes[1]
            if not 1 <= length <= self.longest:
                self.bytes, bad = None, 1
            elif len(self.bytes) == length + 6:
                good = int(zlib.crc32(self.bytes[:-4]) == int.from_bytes(self.bytes[-4:], "little"))
                sync = int(good and not self.bytes[0] & 15)
                self.bytes, bad = None, 1 - good
        return passed, data, command, good, good, int(bad), sync
