# SPDX-License-Identifier: Apache-2.0
"""What sw/firmware/learner.c computes, in Python's integers: the sine, the ellipse, the table, the bursts of a pass."""
from math import isqrt

ORDERS, POINTS, PHASES, PARTS, PASS, BLOCKS, BINS, LINES = 10, 256, 2048, 16, 39, 256, 128, 128
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
    """The solution of the equations, column 5 the right side, in units of 2^-28, or None."""
    m, size = [row[:] for row in m], len(m)
    columns = [*range(size), 5]
    for i in range(size):
        if m[i][i] < UNIT >> 16:
            return None
        for j in range(i + 1, size):
            factor = quotient(m[i][j] * UNIT, m[i][i])
            if abs(factor) > 4 * UNIT:
                return None
            for k in columns[j:]:
                m[j][k] -= factor * m[i][k] >> 28
    solution = [0] * 5
    for i in reversed(range(size)):
        rest = m[i][5] - sum(m[i][j] * solution[j] >> 28 for j in range(i + 1, size))
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
    scale = lambda s, up: s << up if up > 0 else s >> -up
    shift = count.bit_length() - 1
    m = [[scale(total[i][j], 28 - 12 * (DEGREE[i] + DEGREE[j])) >> shift if j >= i else 0 for j in range(6)] for i in range(5)]
    mean_square = quotient(m[0][5] * UNIT, m[0][0])
    if outside * 16 > count or mean_square > UNIT + UNIT // 4:
        return AMPLITUDE, values
    eighth = isqrt(mean_square * UNIT) >> 19
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


def judge(phases, spoiled=False):
    """(reason, travel) of PHASES phases."""
    steps = [(b - a + 32768 & 65535) - 32768 for a, b in zip(phases, phases[1:])]
    size = PHASES // PARTS
    gone = [sum(steps[max(part * size - 1, 0):(part + 1) * size - 1]) for part in range(PARTS)]     # the first part is one step shorter
    travel, slowest, fastest = sum(gone), min(gone), max(gone)
    if spoiled:
        return AMPLITUDE, travel
    if max(map(abs, steps)) > 8192:
        return TOO_FAST, travel
    if abs(travel) < 16384 and fastest < 16384 and slowest > -16384:
        return STANDSTILL, travel
    if abs(travel) < 8 * 65536:
        return PARTIAL_CIRCLE, travel
    slowest, fastest = (-fastest, -slowest) if travel < 0 else (slowest, fastest)
    return (UNSTEADY if slowest <= 0 or fastest > 2 * slowest else LEARNING), travel


def places(phases, table):
    """Place of each phase, 2^-20 period, from about 0."""
    found, travel, last = [], 0, phases[0]
    for phase in phases:
        travel += (phase - last + 32768 & 65535) - 32768
        last = phase
        found.append(travel * 16 - table[phase >> 9])
    return found


def window_of(turn):
    return 32768 - cosine_of(turn) >> 1


def waves_of(vibration, turn):
    phase = vibration * turn >> 16
    return cosine_of(phase), sine_of(phase)


def base_of(turn, vibration, dimmed=32768):
    time = turn - 32768
    return (32768, time, time * time >> 15, *(wave * dimmed >> 15 for wave in waves_of(vibration, turn)))


def smooth(solution, base):
    return sum(s * b for s, b in zip(solution, base)) >> 19


BLOCK_TURNS = [n * 256 + 128 for n in range(BLOCKS)]


def fit(block, size, vibration):
    """The motion, and the vibration, through the blocks; None: not well conditioned."""
    half = vibration >> 12
    dimmed = cosine_of(half) * cosine_of(2 * half) * cosine_of(4 * half) >> 30
    m = [[0] * 6 for _ in range(size)]
    for turn, place in zip(BLOCK_TURNS, block):
        base = base_of(turn, vibration, dimmed)
        for i in range(size):
            weighed = window_of(turn) * base[i] >> 15
            for j in range(i, size):
                m[i][j] += weighed * base[j] >> 10
            m[i][5] += weighed * place >> 19
    return solve(m)


def spectrum(rest):
    """(real, imaginary) of the lines of BLOCKS numbers, by radix 2 in time."""
    real, imaginary = [rest[int(f"{n:08b}"[::-1], 2)] for n in range(BLOCKS)], [0] * BLOCKS
    for level in range(8):
        half = 1 << level
        for a in (n for n in range(BLOCKS) if not n & half):
            b, angle = a + half, a % half << 15 - level
            c, s = cosine_of(angle), sine_of(angle)
            x, y = c * real[b] + s * imaginary[b] >> 15, c * imaginary[b] - s * real[b] >> 15
            real[a], real[b], imaginary[a], imaginary[b] = real[a] + x, real[a] - x, imaginary[a] + y, imaginary[a] - y
    return real, imaginary


def level_of(power):
    shifts = max(power.bit_length() - 3, 0)
    return 4 * shifts + (power >> shifts)


def vibration_of(line, real, imaginary):
    """2^-16 cycle a burst of the line that stays, or None."""
    power = [x * x + y * y for x, y in zip(real, imaginary)]
    at = max(range(2, LINES - 2), key=lambda n: (line[n], -n))
    at += (power[at + 1] > power[at]) or -(power[at - 1] > power[at])
    beside = at + 1 if power[at + 1] > power[at - 1] else at - 1
    unit = power[at] >> 16
    if not unit:
        return None
    share = max(0, min(65536, quotient(-(real[at] * real[beside] + imaginary[at] * imaginary[beside]), unit)))
    away = quotient((2 * share - 65536) * 16384, 65536 + share) * 4
    return at * 65536 + (away if beside > at else -away)


class Pass:
    """A pass of bursts, none of them refused."""

    def __init__(self, values=IDENTITY):
        self.values, self.bursts, self.spectra, self.every, self.line = values, 0, 0, 0, [0] * LINES
        self.information, self.cosine, self.sine, self.squares = [0] * ORDERS, [0] * ORDERS, [0] * ORDERS, 0
        self.travels = []

    def candidate(self):
        legs = {}
        for leg, sums in (("cosine", self.cosine), ("sine", self.sine)):
            legs[leg] = tuple(clamp(quotient(total * 4096, known), 1 << 21) if self.bursts >= 4 and known >= 256 else before
                              for total, known, before in zip(sums, self.information, self.values[leg]))
        return self.values | legs

    def take(self, phases, every=1):
        """False: the burst is refused, since the motion could not be fitted."""
        candidate = self.candidate()
        _, travel = judge(phases)
        place = places(phases, [table_entry(candidate, 2 * n + 1) for n in range(BINS)])
        slope = quotient(travel * 65536, PHASES - 1)
        block = [sum(p >> 3 for p in place[8 * n:8 * n + 8]) - (slope * (16 * n + 7) >> 13) for n in range(BLOCKS)]
        vibration, solution = 0, fit(block, 3, 0)
        if solution is None:
            return False
        rest = [clamp(p - smooth(solution, base_of(turn, 0)), 131068) * window_of(turn) >> 12 for turn, p in zip(BLOCK_TURNS, block)]
        real, imaginary = spectrum(rest)
        levels = [level_of(x * x + y * y) for x, y in zip(real[:LINES], imaginary)]
        if every != self.every:
            self.spectra = 0
        self.line = list(map(min, self.line, levels)) if self.spectra else levels
        self.every, self.spectra = every, min(self.spectra + 1, 255)
        if self.spectra >= 3 and (found := vibration_of(self.line, real, imaginary)) is not None:
            vibration, solution = found, fit(block, 5, found)
            if solution is None:
                return False
        self.project(phases, place, slope, vibration, solution, candidate)
        self.travels.append(abs(travel))
        self.bursts += 1
        return True

    def project(self, phases, place, slope, vibration, solution, candidate):
        seen, power = [[0] * BINS for _ in range(3)], 0
        for n, (phase, p) in enumerate(zip(phases, place)):
            turn, phase_bin = n * 32 + 16, phase >> 9
            base, window = base_of(turn, vibration), window_of(n * 32 + 16) >> 5
            rest = clamp(p - (slope * n >> 12) - smooth(solution, base), 32767)
            seen[0][phase_bin] += window * rest >> 5
            seen[1][phase_bin] += window * base[3] >> 5
            seen[2][phase_bin] += window * base[4] >> 5
            power += window * rest * rest
        square = power >> 20
        weight = 32768 if square <= 1 << 20 else (1 << 35) // square
        for k in range(ORDERS):
            turns = [(k + 1) * (n * 512 + 256) for n in range(BINS)]
            waves = [cosine_of(t) for t in turns], [sine_of(t) for t in turns]
            (x, y), *shared = [[sum(map(int.__mul__, row, wave)) >> shift for wave in waves] for row, shift in zip(seen, (25, 30, 30))]
            kept = max(0, 32768 - (sum(leg * leg for row in shared for leg in row) >> 14))
            self.information[k] += weight * kept >> 15
            self.cosine[k] += weight * (x + (kept * candidate["cosine"][k] >> 15)) >> 12
            self.sine[k] += weight * (y + (kept * candidate["sine"][k] >> 15)) >> 12
            if self.bursts >= 4:
                self.squares += (weight * x >> 15) ** 2 + (weight * y >> 15) ** 2

    def scatter(self):
        least = min(self.information)
        return isqrt((self.squares // least << 22) // least)
