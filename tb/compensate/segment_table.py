# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/compensate/segment_table.sv in integers: segment_table(...) corrects one position,
SegmentTable.clk(...) advances one cycle.
"""


def segment_table(position, errors, origin, length, linear, enable=1, index_bits=8):
    """Return (corrected, outside); errors are those of the borders 0..segments."""
    segments, distance = len(errors) - 1, position - origin
    outside = distance < 0 or distance >= length * min(segments, 1 << index_bits)
    if outside:
        error = errors[0] if distance < 0 else errors[segments]
    else:
        n, remainder = divmod(distance, length)
        low, high = errors[n], errors[n + 1]
        fraction = (remainder << 16) // length
        error = low + ((high - low) * fraction + 32768 >> 16) if linear else low + high + 1 >> 1
    return position - (error if enable else 0), outside


class SegmentTable:
    """done, corrected, outside and error are the outputs after a cycle. Settings and table must not
    change while a position is being processed.
    """

    LATENCY = 30  # cycles from valid to done, for INDEX = 8

    def __init__(self):
        self.left, self.done, self.corrected, self.outside, self.error = (
            None,
            False,
            None,
            None,
            None,
        )

    def clk(self, rst=0, valid=0, position=0, **settings):
        self.done = self.left == 1 and not rst
        if self.done:
            corrected, self.outside = segment_table(self.position, **settings)
            self.error = self.position - corrected
            self.corrected = (corrected + 2**47) % 2**48 - 2**47
        if rst or self.done:
            self.left = None
        elif self.left:
            self.left -= 1
        elif valid:
            self.left, self.position = self.LATENCY - 1, position
