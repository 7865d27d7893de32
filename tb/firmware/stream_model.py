# SPDX-License-Identifier: Apache-2.0
"""Model of sw/firmware/bus/stream.c in integers: the pieces of a stream of set-points, and the
target that the motion engine makes of them.

All lengths are 2^-40 period; a piece is (velocity, acceleration, jerk, ticks, last).
"""

from math import comb


def towards_zero(dividend, divisor):
    """The quotient, rounded towards zero."""
    quotient = abs(dividend) // divisor
    return -quotient if dividend < 0 else quotient


def after(state, piece):
    """(moved, velocity) at the end of a piece that begins at `state`."""
    moved, _ = state
    velocity, acceleration, jerk, ticks, _ = piece
    return (
        moved + velocity * ticks + acceleration * comb(ticks, 2) + jerk * comb(ticks, 3),
        velocity + acceleration * ticks + jerk * comb(ticks, 2),
    )


def pieces_to(state, ticks, position, velocity, tail, last):
    """The one or two pieces from a state to a set-point, and the state at their end. `position` is
    in 2^-16 period.
    """
    moved, first = state
    change = velocity - first
    more = (position << 24) - (velocity >> 1) - moved - first * ticks
    jerk = towards_zero(6 * (change * (ticks - 1) - 2 * more), ticks * (ticks**2 - 1))
    acceleration = towards_zero(more - jerk * comb(ticks, 3), comb(ticks, 2))
    pieces = []
    for part in [ticks - tail, tail] if ticks > tail else [ticks]:
        pieces.append((state[1], acceleration, jerk, part, 0))
        state = after(state, pieces[-1])
        acceleration += jerk * part
    pieces[-1] = (*pieces[-1][:4], int(last))
    return pieces, state


def targets(pieces):
    """The target of each tick as the engine makes it, before it is rounded to 2^-16 period: the
    mean of two steps, from rest at 0.
    """
    moved = 0
    for velocity, acceleration, jerk, ticks, _ in pieces:
        for n in range(ticks):
            moved += velocity + acceleration * n + jerk * comb(n, 2)
            after_it = velocity + acceleration * (n + 1) + jerk * comb(n + 1, 2)
            yield moved + (after_it >> 1)


def cubic(begin, end, ticks, n):
    """The true cubic n ticks after `begin`; both are (position, velocity per tick) of numbers."""
    (p0, v0), (p1, v1) = begin, end
    acceleration = (6 * (p1 - p0) - ticks * (4 * v0 + 2 * v1)) / ticks**2
    jerk = (6 * ticks * (v0 + v1) - 12 * (p1 - p0)) / ticks**3
    return p0 + n * (v0 + n * (acceleration / 2 + n * jerk / 6)), jerk
