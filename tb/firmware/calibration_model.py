# SPDX-License-Identifier: Apache-2.0
"""What sw/firmware/calibration computes, in Python's integers: the sine, the ellipse, the table and
the bursts of a pass.
"""

from math import isqrt

ORDERS, POINTS, PHASES, PARTS, PASS, BLOCKS, BINS, LINES = 10, 256, 2048, 16, 39, 256, 128, 128
(
    RUNNING,
    FROZEN,
    STANDSTILL,
    PARTIAL_CIRCLE,
    AMPLITUDE,
    DISTORTED,
    TOO_FAST,
    UNSTEADY,
    ONE_SPEED,
    VIBRATION,
) = range(10)
UNIT = 1 << 28
DEGREE = (0, 1, 1, 2, 2, 2)


def quotient(dividend, divisor):
    """The division of C: towards zero."""
    size = abs(dividend) // abs(divisor)
    return size if (dividend < 0) == (divisor < 0) else -size


def clamp(value, limit):
    return max(-limit, min(limit, value))


def circle():
    """The sine of 512 points."""
    quarter, sine, cosine = [], 0, 1 << 30
    for _ in range(129):
        quarter.append(sine * 32767 + (1 << 29) >> 30)
        sine, cosine = (
            sine * 1073660973 + cosine * 13176464 + (1 << 29) >> 30,
            cosine * 1073660973 - sine * 13176464 + (1 << 29) >> 30,
        )
    half = quarter + quarter[127:0:-1]
    return half + [-channel for channel in half]


WAVE = circle()


def sine_at(point):
    return WAVE[point % 512]


def cosine_at(point):
    return WAVE[(point + 128) % 512]


def turn_of(size, phase):
    return size * ((phase + 64) % 128 - 64) * 201 >> 21


def sine_of(phase):
    point = phase + 64 >> 7
    return sine_at(point) + turn_of(cosine_at(point), phase)


def cosine_of(phase):
    point = phase + 64 >> 7
    return cosine_at(point) - turn_of(sine_at(point), phase)


IDENTITY = dict(
    sin_offset=0,
    cos_offset=0,
    gain=65536,
    quadrature_error=0,
    cosine=(0,) * ORDERS,
    sine=(0,) * ORDERS,
    shift=0,
)


def fits(values):
    return (
        32768 <= values["gain"] < 131072
        and abs(values["quadrature_error"]) <= 65536
        and abs(values["sin_offset"]) <= 16384
        and abs(values["cos_offset"]) <= 16384
        and all(
            abs(quotient(v, 2)) <= 1 << 20
            for v in (*values["cosine"], *values["sine"], values["shift"])
        )
    )


# ---- the ellipse


def solve(m, largest=4 * UNIT):
    """The solution of the equations, in 2^-28, or None if they are ill-conditioned; column 5 is the
    right side.
    """
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
        residual = m[i][5] - sum(m[i][j] * solution[j] >> 28 for j in range(i + 1, size))
        coarse = quotient(residual * 16, m[i][i])
        solution[i] = coarse * (UNIT // 16) + quotient(
            (residual * 16 - coarse * m[i][i]) * (UNIT // 16), m[i][i]
        )
        if abs(solution[i]) > largest:
            return None
    return solution


def ellipse_fit(samples, values=IDENTITY, low=0, high=65535):
    """(reason, values) of samples (cos, sin), full scale 2^15."""
    total, sector, outside = [[0] * 6 for _ in range(5)], [0] * 16, 0
    channels = [], []
    for cosine, sine in samples:
        x, y = cosine + 4 >> 3, sine + 4 >> 3
        base = 1, x, y, x * x - y * y, 2 * x * y, x * x + y * y
        for i in range(5):
            for j in range(i, 6):
                total[i][j] += base[i] * base[j]
        channels[0].append(x)
        channels[1].append(y)
        outside += not (low >> 3) ** 2 <= base[5] <= (high >> 3) ** 2
        u, v = cosine - values["cos_offset"], sine - values["sin_offset"]
        less, more = sorted((abs(u), abs(v)))
        sector[(u < 0) + 2 * (v < 0) + 4 * (abs(u) < abs(v)) + 8 * (less * 12 > more * 5)] += 1
    count = len(samples)
    if not count:
        return PARTIAL_CIRCLE, values
    scale = lambda s, up: s << up if up > 0 else s >> -up
    shift = count.bit_length() - 1
    m = [
        [
            scale(total[i][j], 28 - 12 * (DEGREE[i] + DEGREE[j])) >> shift if j >= i else 0
            for j in range(6)
        ]
        for i in range(5)
    ]
    mean_square = quotient(m[0][5] * UNIT, m[0][0])
    if outside * 16 > count or mean_square > UNIT + UNIT // 4:
        return AMPLITUDE, values
    eighth = isqrt(mean_square * UNIT) >> 19
    if all(max(channel) - min(channel) < eighth for channel in channels):
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
    fit = values | dict(
        cos_offset=clamp(x + (1 << 12) >> 13, 32767),
        sin_offset=clamp(y + (1 << 12) >> 13, 32767),
        gain=quotient(q * 65536 + root // 2, root),
        quadrature_error=quotient(-e * 65536, root),
    )
    return (RUNNING, fit) if fits(fit) else (DISTORTED, values)


# ---- the harmonics


def table_entry(values, point):
    total = sum(
        values["cosine"][k] * cosine_at((k + 1) * point * 2)
        + values["sine"][k] * sine_at((k + 1) * point * 2)
        for k in range(ORDERS)
    )
    return clamp(total + (values["shift"] << 15) + (1 << 18) >> 19, 0x1FFFF)


def table_of(values):
    return [table_entry(values, point) for point in range(POINTS)]


def judge(phases, spoiled=False):
    """(reason, travel) of PHASES phases."""
    steps = [(b - a + 32768 & 65535) - 32768 for a, b in zip(phases, phases[1:])]
    size = PHASES // PARTS
    gone = [
        sum(steps[max(part * size - 1, 0) : (part + 1) * size - 1]) for part in range(PARTS)
    ]  # the first part is one step shorter
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
    return (UNSTEADY if slowest <= 0 or fastest > 2 * slowest else RUNNING), travel


def travels(phases):
    """Distance from the first phase to each, 2^-16 period."""
    found, travel, last = [], 0, phases[0]
    for phase in phases:
        travel += (phase - last + 32768 & 65535) - 32768
        last = phase
        found.append(travel)
    return found


def turn_of_block(n):
    return n * 256 + 128


def window_of(n):
    return 32767 - cosine_at(2 * n + 1) >> 1


def motion_of(n):
    time = turn_of_block(n) - 32768
    return 32768, time, time * time >> 15


def waves_of(vibration, turn):
    phase = vibration * turn >> 16
    return cosine_of(phase), sine_of(phase)


def position_of_motion(solution, base):
    return sum(s * b for s, b in zip(solution, base)) >> 19


def position_of_vibration(solution, waves):
    return clamp(solution[3] * waves[0] + solution[4] * waves[1] >> 19, 1 << 22)


def attenuation(half):
    return (cosine_of(half) * cosine_of(2 * half) >> 15) * cosine_of(4 * half) >> 15


def fit(block, vibration=None):
    """Fit the motion, and the vibration with it, to the blocks; None if ill-conditioned."""
    size = 3 if vibration is None else 5
    m = [[0] * 6 for _ in range(size)]
    for n, position in enumerate(block):
        base, window = motion_of(n), window_of(n)
        if vibration is not None:
            base += tuple(
                wave * attenuation(vibration >> 12) >> 15
                for wave in waves_of(vibration, turn_of_block(n))
            )
        for i in range(size):
            weighed = window * base[i] >> 15
            for j in range(i + 1):  # of two factors the later one is weighed,
                m[j][i] += weighed * base[j] >> 10
            m[i][5] += weighed * position
    for i in range(3):
        for j in range(i, 3):  # in the motion alone the earlier one
            m[i][j] = sum(
                (window_of(n) * motion_of(n)[i] >> 15) * motion_of(n)[j] >> 10
                for n in range(BLOCKS)
            )
    for row in m:
        row[5] >>= 19
    return solve(m, 1 << 33)


def transform(residual):
    """(real, imaginary) of the lines of BLOCKS real numbers: even ones real, odd ones imaginary;
    radix 2 in time, halved at every level.
    """
    points = BLOCKS // 2
    order = [int(f"{n:07b}"[::-1], 2) for n in range(points)]
    real, imaginary = [residual[2 * n] for n in order], [residual[2 * n + 1] for n in order]
    for level in range(7):
        half = 1 << level
        for a in (n for n in range(points) if not n & half):
            b, point = a + half, a % half << 8 - level
            c, s = cosine_at(point), sine_at(point)
            x, y = c * real[b] + s * imaginary[b] >> 15, c * imaginary[b] - s * real[b] >> 15
            real[a], real[b] = real[a] + x >> 1, real[a] - x >> 1
            imaginary[a], imaginary[b] = imaginary[a] + y >> 1, imaginary[a] - y >> 1
    lines = []
    for n in range(points):
        m, c, s = -n % points, cosine_at(2 * n), sine_at(2 * n)
        x, y = imaginary[n] + imaginary[m], real[m] - real[n]
        lines.append(
            (
                real[n] + real[m] + (c * x + s * y >> 15) >> 1,
                imaginary[n] - imaginary[m] + (c * y - s * x >> 15) >> 1,
            )
        )
    return lines


def quarter_log2(power):
    shifts = max(power.bit_length() - 3, 0)
    return 4 * shifts + (power >> shifts)


def vibration_of(line, lines):
    """The frequency of the strongest common line, 2^-16 cycle a burst, or None."""
    power = [x * x + y * y for x, y in lines]
    at = max(range(2, LINES - 2), key=lambda n: (line[n], -n))
    at += (power[at + 1] > power[at]) or -(power[at - 1] > power[at])
    beside = at + 1 if power[at + 1] > power[at - 1] else at - 1
    if not power[at]:
        return None
    both = sum(a * b for a, b in zip(lines[at], lines[beside]))
    share = max(0, min(65536, quotient(-both * 65536, power[at])))
    away = quotient((2 * share - 65536) * 16384, 65536 + share) * 4
    found = at * 65536 + (away if beside > at else -away)
    return found if found >= 3 << 15 else None


class Pass:
    """A pass of bursts, none of which is refused."""

    def __init__(self, values=IDENTITY):
        self.values, self.bursts, self.spectra, self.every, self.line = values, 0, 0, 0, [0] * LINES
        self.information, self.cosine, self.sine, self.squares = (
            [0] * ORDERS,
            [0] * ORDERS,
            [0] * ORDERS,
            0,
        )
        self.travels = []

    def candidate(self):
        channels = {}
        for channel, sums in (("cosine", self.cosine), ("sine", self.sine)):
            channels[channel] = tuple(
                clamp(quotient(total * 4096, known), 1 << 21)
                if self.bursts >= 4 and known >= 256
                else before
                for total, known, before in zip(sums, self.information, self.values[channel])
            )
        return self.values | channels

    def take(self, phases, every=1):
        """Take a burst; returns False if the motion could not be fitted, which refuses it."""
        candidate = self.candidate()
        _, travel = judge(phases)
        gone, table = travels(phases), [table_entry(candidate, 2 * n + 1) for n in range(BINS)]
        block = [
            sum(gone[8 * n : 8 * n + 8]) * 2
            - (sum(table[p >> 9] for p in phases[8 * n : 8 * n + 8]) >> 3)
            for n in range(BLOCKS)
        ]
        vibration, solution = 0, fit(block)
        if solution is None:
            return False
        residual = [
            clamp(p - position_of_motion(solution, motion_of(n)), 32767) * window_of(n) >> 16
            for n, p in enumerate(block)
        ]
        lines = transform(residual)
        levels = [quarter_log2(x * x + y * y) for x, y in lines]
        if every != self.every:
            self.spectra = 0
        self.line = list(map(min, self.line, levels)) if self.spectra else levels
        self.every, self.spectra = every, min(self.spectra + 1, 255)
        if self.spectra >= 3 and (found := vibration_of(self.line, lines)) is not None:
            vibration, solution = found, fit(block, found)
            if solution is None:
                return False
        self.project(phases, table, travel, vibration, solution, candidate)
        self.travels.append(abs(travel))
        self.bursts += 1
        return True

    def project(self, phases, table, travel, vibration, solution, candidate):
        seen, power, gone = [[0] * BINS for _ in range(3)], 0, travels(phases)
        bend = sine_of(vibration >> 12) ** 2 >> 11
        for n in range(BLOCKS):
            base, window, turn = motion_of(n), window_of(n) >> 5, n * 256 + 16
            speed = solution[1] * 32768 + 2 * solution[2] * base[1] + (1 << 28) >> 29
            smooth = position_of_motion(solution, base) - quotient(speed * 7, 2)
            waves = waves_of(vibration, turn)
            swing = position_of_vibration(solution, waves)
            swinging = swing - position_of_vibration(solution, waves_of(vibration, turn - 32))
            for channel, wave in zip(seen[1:], waves):
                channel[phases[8 * n] >> 9] += window * wave >> 5
            for phase, travelled in zip(phases[8 * n : 8 * n + 8], gone[8 * n :]):
                residual = clamp(travelled * 16 - table[phase >> 9] - smooth - swing, 32767)
                seen[0][phase >> 9] += window * residual >> 5
                smooth += speed
                swinging -= bend * swing + (1 << 16) >> 17
                swing += swinging
            power += window * residual * residual
        square = power >> 17
        weight = 32768 if square <= 1 << 20 else (1 << 35) // square
        step, own = vibration // PHASES, quotient(travel, PHASES - 1)
        for k in range(ORDERS):
            points = [(k + 1) * (4 * n + 2) for n in range(BINS)]
            waves = [cosine_at(p) for p in points], [sine_at(p) for p in points]
            (x, y), cosine, sine = [
                [sum(map(int.__mul__, row, wave)) >> shift for wave in waves]
                for row, shift in zip(seen, (25, 27, 27))
            ]
            near, far = (
                (cosine[0] + sine[1], sine[0] - cosine[1]),
                (cosine[0] - sine[1], sine[0] + cosine[1]),
            )
            halves = [(step + side * (k + 1) * own) % (1 << 32) >> 1 for side in (-1, 1)]
            shared = [
                channel * attenuation(half) >> 15
                for half, band in zip(halves, (near, far))
                for channel in band
            ]
            retained = max(0, 32768 - (sum(channel * channel for channel in shared) >> 15))
            self.information[k] += weight * retained >> 15
            self.cosine[k] += weight * (x + (retained * candidate["cosine"][k] >> 15)) >> 12
            self.sine[k] += weight * (y + (retained * candidate["sine"][k] >> 15)) >> 12
            if self.bursts >= 4:
                self.squares += (weight * x >> 15) ** 2 + (weight * y >> 15) ** 2

    def scatter(self):
        least = min(self.information)
        return isqrt((self.squares // least << 22) // least)
