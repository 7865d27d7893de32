# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/set_point_piece.sv in integers: piece_of(...) is the arithmetic, clk(...)
advances one cycle and returns (busy, valid, refused) after it, and the piece if there is one.

All lengths are 2^-40 period, but the position of a set-point, which is 2^-16 period.
"""

FARTHEST = 1 << 54
DIGITS = 64  # of a quotient


def piece_of(begin, set_point, ticks, limits):
    """(cycles from begin_piece to valid, piece); the piece is None if the set-point is refused,
    else (acceleration, jerk, end position, end velocity).
    """
    (begin_position, begin_velocity), (position, velocity) = begin, set_point
    gap = (position << 24) - begin_position
    if abs(gap) >= FARTHEST:
        return 1, None
    more = gap - (velocity >> 1) - begin_velocity * ticks
    if ticks == 1:
        single = begin_velocity + more
        fits = abs(single) <= limits[0] and abs(more) <= limits[1]
        return 3, (0, 0, begin_position + single, single) if fits else None
    change = velocity - begin_velocity
    cycles = 1 + ticks + 1 + 2 * DIGITS
    acceleration = 2 * (3 * more - (ticks - 2) * change) // (ticks * (ticks + 1))
    if acceleration >> 47 not in (0, -1):
        return cycles, None
    cycles += 1 + 3 * DIGITS
    jerk = 6 * ((ticks - 1) * change - 2 * more) // (ticks * (ticks + 1) * (ticks - 1))
    if jerk >> 31 not in (0, -1):
        return cycles, None
    steps = played(begin, acceleration, jerk, ticks)
    for n, (_, fast, steep) in enumerate(steps, start=1):
        if abs(fast) > limits[0] or abs(steep) > limits[1]:
            return cycles + n, None
    return cycles + ticks, (acceleration, jerk, *steps[-1][:2])


def played(begin, acceleration, jerk, ticks):
    """What the engine plays: (position and velocity after it, acceleration in it) of each tick."""
    position, velocity = begin
    found = []
    for _ in range(ticks):
        position, velocity = position + velocity, velocity + acceleration
        found.append((position, velocity, acceleration))
        acceleration += jerk
    return found


class SetPointPiece:
    def __init__(self):
        self.left, self.piece = 0, None

    def clk(self, rst=0, begin_piece=0, begin=(0, 0), set_point=(0, 0), ticks=2, limits=(0, 0)):
        valid = 0
        if rst:
            self.left = 0
            return (0, 0, 0), None
        if self.left:
            self.left -= 1
            valid = int(self.left == 0)
        elif begin_piece:
            cycles, self.piece = piece_of(begin, set_point, ticks, limits)
            self.left = cycles - 1
            valid = int(self.left == 0)
        refused = int(bool(valid and self.piece is None))
        return (int(self.left > 0), valid, refused), self.piece if valid else None
