# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/compensate/segment_correction.sv in integers: clk(...) advances one cycle; the
attributes hold the state after it.
"""

from tb.compensate.segment_table import segment_table


def wrap(value, bits=48):
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


class SegmentCorrection:
    """points are those that were written; a busy table uses those of the cycle in which it was
    asked.
    """

    def __init__(self, index=8):
        self.index, self.round = index, index + 22  # cycles of the table
        self.points = [0] * (1 << index)
        self.moved_by = self.stored = self.read_value = 0
        self.off = True
        self.reset()

    def reset(self):
        self.done = self.moved = self.busy = self.reading = self.known = False
        self.corrected = self.first = 0
        self.stop()

    def stop(self):
        self.left = None  # cycles until the table is done
        self.answers = self.answered = self.in_force = self.outside = False
        self.error = 0

    def clk(
        self,
        rst=0,
        enable=0,
        linear=0,
        origin_written=0,
        origin=0,
        segment_length=1,
        segments=1,
        write=0,
        point=0,
        value=0,
        read=0,
        read_point=0,
        valid=0,
        position=0,
        shift=0,
        shift_periods=0,
    ):
        fresh = self.answer if enable and valid and self.answered else self.error
        begins, ends = (
            bool(enable and self.answers and not self.in_force),
            bool(not enable and self.in_force),
        )
        asking = bool(
            enable and not self.busy and not self.reading and (valid or not self.in_force)
        )
        periods = shift_periods << 16 if shift else 0

        if valid or self.moved:
            self.corrected = wrap(position - fresh)
        self.moved_by = wrap(periods + (-self.answer if begins else self.error if ends else 0))
        self.moved, self.done = bool(shift or begins or ends), bool(valid)

        free = self.reading and not self.busy
        if free:
            self.stored = self.read_value
        self.known = not read and (self.known or free)
        self.reading = bool(read or (self.reading and self.busy))
        self.read_value = self.points[read_point]

        if self.answers:
            self.outside = self.beyond
        self.answered = bool((self.answers or (self.answered and not valid)) and self.in_force)
        self.in_force = self.in_force or begins
        self.error = self.answer if begins else fresh
        self.busy = asking or (self.busy and not self.answers and not self.off)
        self.off = not enable
        self.answers = self.left == 1
        if self.answers:
            corrected, self.beyond = segment_table(
                self.asked_position,
                self.points[: segments + 1],
                self.origin,
                segment_length,
                linear,
                index_bits=self.index,
            )
            self.answer = self.asked_position - corrected
        self.left = self.left - 1 if self.left and not self.answers else None
        if asking:
            self.left, self.asked_position, self.origin = self.round - 1, position, self.first

        if origin_written or shift:
            self.first = origin if origin_written else wrap(self.first + periods)
        if write:
            self.points[point] = value
        if rst or not enable:
            self.stop()
        if rst:
            self.reset()
