# SPDX-License-Identifier: Apache-2.0
"""What a plan must be: the player's recursion in closed form, and the shortest time that continuous
motion could take.
"""

from math import comb

TICK_HZ = 4000


def limits(velocity, acceleration, jerk):
    """From period/s, /s2, /s3 to 2^-40 period per tick, /tick2, /tick3."""
    return (
        velocity * 2**40 // TICK_HZ,
        acceleration * 2**40 // TICK_HZ**2,
        min(jerk * 2**40 // TICK_HZ**3, 2**31 - 1),
    )


def gone(segment, n):
    """2^-40 period after n ticks of a segment (velocity, acceleration, jerk, ticks)."""
    velocity, acceleration, jerk, _ = segment
    return velocity * n + acceleration * comb(n, 2) + jerk * comb(n, 3)


def distance(plan):
    return sum(gone(segment, segment[3]) for segment in plan)


def steps(plan):
    """The step of each tick, 2^-40 period: the input of the servo."""
    for segment in plan:
        velocity, acceleration, jerk, ticks = segment
        for _ in range(ticks):
            yield velocity
            velocity, acceleration = velocity + acceleration, acceleration + jerk


def peaks(plan):
    """Largest |step| and its largest first and second difference, from and to rest.

    Inside a segment the second difference is constant and the first is monotone, so three steps at
    either end of each tell all,
    and those where the first difference changes its sign.
    """
    peak = [0, 0, 0]
    before = [0, 0]  # the two steps before
    rest = (0, 0, 0, 2)
    for segment in [*plan, rest]:
        velocity, acceleration, jerk, ticks = segment
        turns = acceleration * (acceleration + jerk * (ticks - 1)) < 0
        turn = abs(acceleration // jerk) if turns else 0
        near = sorted(
            {
                n
                for middle in (1, turn, ticks - 2)
                for n in range(middle - 2, middle + 3)
                if 0 <= n < ticks
            }
        )
        last = -1
        for n in near:
            if n != last + 1:  # a gap: start the differences from scratch
                before = [velocity + acceleration * (n - k) + jerk * comb(n - k, 2) for k in (2, 1)]
            step = velocity + acceleration * n + jerk * comb(n, 2)
            values = step, step - before[1], step - 2 * before[1] + before[0]
            peak = [max(p, abs(v)) for p, v in zip(peak, values)]
            before, last = [before[1], step], n
    return peak


def shortest(length, velocity, acceleration, jerk):
    """Ticks of the fastest continuous motion from rest to rest: length in 2^-40 period, limits as
    above.
    """
    if acceleration**2 <= velocity * jerk:
        ramp = (
            velocity / acceleration + acceleration / jerk
        )  # full acceleration is reached on the way to full speed
    else:
        ramp = 2 * (velocity / jerk) ** 0.5
    if length >= velocity * ramp:
        return length / velocity + ramp
    if acceleration**2 <= velocity * jerk and length >= 2 * acceleration**3 / jerk**2:
        half = acceleration / jerk / 2
        return 2 * ((half**2 + length / acceleration) ** 0.5 + half)
    return 4 * (length / (2 * jerk)) ** (1 / 3)
