# SPDX-License-Identifier: Apache-2.0
"""What sw/firmware/learner.c computes, in Python's integers: the sine, the ellipse, the table, a burst, a pass."""
from math import isqrt

ORDERS, POINTS, PHASES, PARTS, PASS = 10, 256, 2048, 16, 39
(LEARNING, FROZEN, STANDSTILL, PARTIAL_CIRCLE, AMPLITUDE, DISTORTED, TOO_FAST, UNSTEADY, ONE_SPEED, VIBRATION) = range(10)
UNIT = 1 << 28
DEGREE = (0, 1, 1, 2, 2, 2)


def quotient(dividend, divisor):
    """The division of C: towards zero."""
    size = abs(dividend) // abs(divisor)
    return size if (dividend < 0) == (divisor < 0) else -size


def clamp(value, limit):
    return max(-limit, min(limit, value))


def quarter_table():
    table, sine, cosine = [], 0, 1 << 30
    for _ in range(257):
        table.append(sine + (1 << 14) >> 15)
        sine, cosine = (sine * 1073721611 + cosine * 6588356 + (1 << 29) >> 30, cosine * 1073721611 - sine * 6588356 + (1 << 29) >> 30)
    return table


QUARTER = quarter_table()


def sine_of(phase):
    point = (phase + 32 >> 6) & 1023
    size = QUARTER[256 - (point & 255) if point & 256 else point & 255]
    return -size if point & 512 else size


def cosine_of(phase):
    return sine_of(phase + 16384)


IDENTITY = dict(sin_offset=0, cos_offset=0, gain=65536, shear=0, cosine=(0,) * ORDERS, sine=(0,) * ORDERS)


def fits(values):
    return (32768 <= values["gain"] < 131072 and abs(values["shear"]) <= 65536 and abs(values["sin_offset"]) <= 16384
            and abs(values["cos_offset"]) <= 16384
            and all(abs(quotient(v, 2)) <= 1 << 20 for v in (*values["cosine"], *values["sine"])))


# ---- the ellipse

def solve(m):
    """The solution of 5 equations in units of 2^-28, or None."""
    m = [row[:] for row in m]
    for i in range(5):
        if m[i][i] < UNIT >> 16:
            return None
        for j in range(i + 1, 5):
            factor = quotient(m[i][j] * UNIT, m[i][i])
            if abs(factor) > 4 * UNIT:
                return None
            for k in range(j, 6):
                m[j][k] -= factor * m[i][k] >> 28
    solution = [0] * 5
    for i in reversed(range(5)):
        rest = m[i][5] - sum(m[i][j] * solution[j] >> 28 for j in range(i + 1, 5))
        coarse = quotient(rest * 16, m[i][i])
        solution[i] = coarse * (UNIT // 16) + quotient((rest * 16 - coarse * m[i][i]) * (UNIT // 16), m[i][i])
        if abs(solution[i]) > 4 * UNIT:
            return None
    return solution


def ellipse_fit(samples, values=IDENTITY, low=0, high=65535):
    """(reason, values) of samples (cos, sin), full scale 2^15."""
    total, sector, outside = [[0] * 6 for _ in range(5)], [0] * 16, 0
    legs = [], []
    for cosine, sine in samples:
        x, y = cosine + 4 >> 3, sine + 4 >> 3
        base = 1, x, y, x * x - y * y, 2 * x * y, x * x + y * y
        for i in range(5):
            for j in range(i, 6):
                total[i][j] += base[i] * base[j]
        legs[0].append(x)
        legs[1].append(y)
        outside += not (low >> 3) ** 2 <= base[5] <= (high >> 3) ** 2
        u, v = cosine - values["cos_offset"], sine - values["sin_offset"]
        less, more = sorted((abs(u), abs(v)))
        sector[(u < 0) + 2 * (v < 0) + 4 * (abs(u) < abs(v)) + 8 * (less * 12 > more * 5)] += 1
    count = len(samples)
    if not count:
        return PARTIAL_CIRCLE, values
    scaled = {0: lambda s: s * UNIT, 1: lambda s: s << 16, 2: lambda s: s << 4, 3: lambda s: s >> 8, 4: lambda s: s >> 20}
    m = [[quotient(scaled[DEGREE[i] + DEGREE[j]](total[i][j]), count) if j >= i else 0 for j in range(6)] for i in range(5)]
    if outside * 16 > count or m[0][5] > UNIT + UNIT // 4:
        return AMPLITUDE, values
    eighth = isqrt(m[0][5] * UNIT) >> 19
    if all(max(leg) - min(leg) < eighth for leg in legs):
        return STANDSTILL, values
    if any(sector[n] < count // 128 or (sector[n] + sector[n ^ 8]) * 64 < count for n in range(16)):
        return PARTIAL_CIRCLE, values
    solution = solve(m)
    if solution is None:
        return PARTIAL_CIRCLE, values
    _, b, c, d, e = solution
    p, q = UNIT - d, UNIT + d
    if min(p, q) < UNIT // 4:
        return DISTORTED, values
    determinant = p * q - e * e >> 28
    if determinant < UNIT // 4:
        return DISTORTED, values
    root = isqrt(determinant * UNIT)
    x, y = quotient(q * b + e * c, determinant) >> 1, quotient(p * c + e * b, determinant) >> 1
    fit = values | dict(cos_offset=clamp(x + (1 << 12) >> 13, 32767), sin_offset=clamp(y + (1 << 12) >> 13, 32767),
                        gain=quotient(q * 65536 + root // 2, root), shear=quotient(-e * 65536, root))
    return (LEARNING, fit) if fits(fit) else (DISTORTED, values)


# ---- the harmonics

def table_entry(values, point):
    total = sum(values["cosine"][k] * cosine_of((k + 1) * point * 256) + values["sine"][k] * sine_of((k + 1) * point * 256)
                for k in range(ORDERS))
    return clamp(total + (1 << 18) >> 19, 0x1FFFF)


def table_of(values):
    return [table_entry(values, point) for point in range(POINTS)]


def burst_of(phases, spoiled=False):
    """(reason, |travel|, cosine, sine) of PHASES phases; the last two are what they say of each order, 2^-20 period."""
    real, imaginary = [0] * ORDERS, [0] * ORDERS
    for n, phase in enumerate(phases):
        window = 32768 - cosine_of(n * (65536 // PHASES) + 32768 // PHASES) >> 2
        for k in range(ORDERS):
            real[k] += window * cosine_of((k + 1) * phase) >> 10
            imaginary[k] += window * sine_of((k + 1) * phase) >> 10
    steps = [(b - a + 32768 & 65535) - 32768 for a, b in zip(phases, phases[1:])]
    gone, size = [], PHASES // PARTS
    for part in range(PARTS):                                       # the first part is one step shorter
        gone.append(sum(steps[max(part * size - 1, 0):(part + 1) * size - 1]))
    travel = sum(gone)
    slowest, fastest = min(gone), max(gone)
    reason = LEARNING
    if spoiled:
        reason = AMPLITUDE
    elif max(map(abs, steps)) > 8192:
        reason = TOO_FAST
    elif abs(travel) < 16384 and fastest < 16384 and slowest > -16384:
        reason = STANDSTILL
    elif abs(travel) < 8 * 65536:
        reason = PARTIAL_CIRCLE
    else:
        slowest, fastest = (-fastest, -slowest) if travel < 0 else (slowest, fastest)
        if slowest <= 0 or fastest > 2 * slowest:
            reason = UNSTEADY
    cosine = [clamp(quotient(imaginary[k] * 333772, (k + 1) << 29), 32767) for k in range(ORDERS)]
    sine = [clamp(quotient(-real[k] * 333772, (k + 1) << 29), 32767) for k in range(ORDERS)]
    return reason, abs(travel), cosine, sine


def order_of(cosine, sine):
    """(cosine, sine, variance) of one order over the bursts of a pass, 2^-24 period and 2^-40 period^2."""
    count = len(cosine)
    x, y = sorted(cosine)[count // 2], sorted(sine)[count // 2]
    away = [(a - x) ** 2 + (b - y) ** 2 for a, b in zip(cosine, sine)]
    good = [n for n in range(count) if away[n] <= 9 * sorted(away)[count // 2] + 4]
    n, a, b = len(good), sum(cosine[g] for g in good), sum(sine[g] for g in good)
    square = (a - n * x) ** 2 + (b - n * y) ** 2
    variance = quotient(sum(away[g] for g in good) - square // n, n * (n - 1))
    return quotient(a * 16, n), quotient(b * 16, n), variance


def pass_of(bursts, values):
    """(values, variance) after a pass of bursts (cosine, sine)."""
    orders = [order_of([cosine[k] for cosine, _ in bursts], [sine[k] for _, sine in bursts]) for k in range(ORDERS)]
    cosine, sine, variance = zip(*orders)
    return values | dict(cosine=cosine, sine=sine), sum(variance)
