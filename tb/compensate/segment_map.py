# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/compensate/segment_map.sv in integers: clk(...) advances one cycle; the attributes
hold the state after it.
"""

from tb.compensate.segment_table import segment_table


def signed(value, bits):
    value &= (1 << bits) - 1
    return value - (value >> bits - 1 << bits)


def error_at(points, angle):
    """The error in 2^-16 count at an angle in 2^-32 turn; points are those of one turn."""
    errors = [*points, points[0]]
    return (
        angle
        - segment_table(
            angle,
            errors,
            0,
            -(-(2**32) // len(points)),
            linear=1,
            index_bits=len(errors).bit_length(),
        )[0]
    )


class SegmentMap:
    def __init__(self, segments=36, w=32):
        self.segments, self.w = segments, w
        self.round = (2 * segments + 1).bit_length() + 23  # cycles
        self.sets = [[0] * segments, [0] * segments]
        self.position_q = self.corrected = 0
        self.reset()

    def reset(self):
        self.page, self.swapped = 0, False
        self.stop()

    def stop(self):
        self.left, self.correction, self.refreshed = None, 0, False

    def clk(self, rst=0, enable=0, write=0, term=0, even=0, odd=0, swap=0, angle=0, position=0):
        on = enable and self.swapped
        self.corrected = signed((self.position_q << 16) - self.correction, self.w + 16)
        self.position_q = position
        self.refreshed = self.left == 1
        if self.refreshed:
            self.correction = error_at(self.points, self.angle)
        if on and self.left is None:
            self.left, self.angle, self.points = self.round, angle, list(self.sets[self.page])
        self.left = self.left - 1 if self.left and not self.refreshed else None
        if write:
            for number, value in ((2 * term, even), (2 * term + 1, odd)):
                if number < self.segments:
                    self.sets[1 - self.page][number] = value
        if swap:
            self.page, self.swapped, self.left = 1 - self.page, True, None
        if rst or not on:
            self.stop()
        if rst:
            self.reset()
