# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/peripheral/angle_frame.sv: step(...) is one cycle and returns the pins
after it.
"""

LONGEST = 0xFFFF_FFFF


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ (0x1021 if crc & 0x8000 else 0)) & 0xFFFF
    return crc


def frame(number, angle):
    """The eight bytes of a frame."""
    data = bytes([0xA5, number, *angle.to_bytes(4, "little")])
    return data + crc16(data).to_bytes(2, "little")


class AngleFrame:
    def __init__(self, w):
        self.top = (1 << w) - 1
        self.bytes, self.silent, self.elapsed = b"", 0, 0
        self.angle = self.number = None
        self.reset()

    def reset(self):
        self.bytes, self.valid, self.known, self.age = b"", 0, 0, 0
        self.crc_errors = self.broken = self.missed = 0

    def count(self, value, by=1):
        return min(value + by, self.top)

    def pins(self, stale_after):
        """(valid, angle, number, age, stale, crc_errors, broken, missed); angle and number are None
        before the first frame.
        """
        stale = int(not self.known or bool(stale_after) and self.age > stale_after)
        return (
            self.valid,
            self.angle,
            self.number,
            self.age,
            stale,
            self.crc_errors,
            self.broken,
            self.missed,
        )

    def step(self, gap, stale_after, byte=None, framing_error=0, clear=0, rst=0):
        complete, silent = len(self.bytes) == 8, self.silent
        first = byte == 0xA5 and (complete or not self.bytes)
        inside = self.bytes and not complete
        self.valid, self.age, elapsed = 0, min(self.age + 1, LONGEST), self.elapsed
        self.silent = 0 if byte is not None else min(silent + 1, 0xFFFFFF)
        self.elapsed = 1 if first else min(elapsed + 1, LONGEST)
        if (
            complete
            and frame(self.bytes[1], int.from_bytes(self.bytes[2:6], "little")) == self.bytes
        ):
            self.missed = (
                self.count(self.missed, (self.bytes[1] - self.number - 1) % 256)
                if self.known
                else self.missed
            )
            self.valid, self.known, self.number = 1, 1, self.bytes[1]
            self.angle, self.age = (
                int.from_bytes(self.bytes[2:6], "little"),
                min(elapsed + 1, LONGEST),
            )
        elif complete:
            self.crc_errors = self.count(self.crc_errors)
        if inside and (framing_error or byte is None and silent >= gap):
            self.broken, self.bytes = self.count(self.broken), b""
        elif complete or not self.bytes:
            self.bytes = b"\xa5" if first else b""
        elif byte is not None:
            self.bytes += bytes([byte])
        if clear:
            self.crc_errors = self.broken = self.missed = 0
        if rst:
            self.reset()
        return self.pins(stale_after)
