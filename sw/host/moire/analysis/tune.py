# SPDX-License-Identifier: Apache-2.0
"""Gains for pid_servo from a record of how an axis answers: excite, identify, propose, look.

    command = tune.excitation(4000, amplitude=3000)             # one per servo tick, given in open
                                                                loop
    plant = tune.identify(tune.Record(command, position, tick_s))      # position in LSB of 2^-16
    period at each tick
    tuning = tune.propose(plant, bandwidth_hz=40)
    Path("tuning.png").write_bytes(tune.picture(plant, tuning))

The plant is a velocity that follows the command with a gain, one time constant and a delay: v[n+1]
= a v[n] + b u[n - delay].
"""

import math
from dataclasses import dataclass

import numpy

from moire.analysis import report
from moire.errors import MoireError

FULL_SCALE = 1 << 15  # of a command
SCALES = {
    "kp": 16,
    "ki": 24,
    "kd": 16,
    "kv": 16,
    "ka": 8,
}  # fraction bits of the gains, as axis_registers has them
MOST = (1 << 24) - 1
COEFFICIENT = 1 << 30  # of biquad_cascade
LONGEST_DELAY = 12  # ticks tried
SHORTEST_RECORD = 200  # ticks
SHORTEST_SAMPLES = 60  # of a record at any times
MOVED = 20  # LSB; less is no motion
UNEXPLAINED = 0.35  # of the velocity's rms; more is too noisy, or not such a plant
SATURATED = 0.05  # of the samples at full scale
COHERENT = 0.8  # at a resonance: the part of the motion there that is an answer
INTEGRAL_CORNER = 1 / 8  # of the bandwidth


class NotTuned(MoireError):
    """The record or the wish allows no gains; the text says why, and what would."""


@dataclass(frozen=True)
class Record:
    """One value a servo tick: position[n] stood when command[n] was given."""

    command: object  # full scale 2^15
    position: object  # 2^-16 period
    tick_s: float


@dataclass(frozen=True)
class Plant:
    a: float
    b: float  # LSB a tick, per command
    delay: int  # ticks
    tick_s: float
    unexplained: float = 0.0  # part of the velocity's rms that the model leaves
    resonance_hz: float | None = None

    @property
    def gain(self):
        """Velocity in LSB a tick per command, at rest."""
        return self.b / (1 - self.a)

    @property
    def time_constant_s(self):
        return -self.tick_s / math.log(self.a) if self.a > 0 else 0.0

    def response(self, hz):
        """Position by command at frequencies."""
        back = numpy.exp(-2j * numpy.pi * numpy.asarray(hz, float) * self.tick_s)
        return self.b * back ** (self.delay + 1) / (1 - self.a * back) / (1 - back)


@dataclass(frozen=True)
class Tuning:
    kp: int  # these five as the registers take them
    ki: int
    kd: int
    kv: int
    ka: int
    filters: tuple  # of coefficient sets b0, b1, b2, -a1, -a2 for biquad_cascade
    bandwidth_hz: float  # where the open loop crosses 1
    phase_margin_degree: float
    gain_margin: float

    def real(self, name):
        return getattr(self, name) / (1 << SCALES[name])

    def response(self, hz, tick_s):
        """Command by error at frequencies, filters included."""
        back = numpy.exp(-2j * numpy.pi * numpy.asarray(hz, float) * tick_s)
        servo = self.real("kp") + self.real("ki") / (1 - back) + self.real("kd") * (1 - back)
        for coefficients in self.filters:
            servo = servo * filter_response(coefficients, hz, tick_s)
        return servo


# ------------------------------------------------------------------ excitation and identification


def excitation(ticks, amplitude, kind="steps", tick_s=None, low_hz=None, high_hz=None, seed=1):
    """Commands for the open loop: `steps` of random length between +-amplitude, or a `chirp` from
    low_hz to high_hz.
    """
    if not 0 < amplitude < FULL_SCALE:
        raise NotTuned(f"an amplitude of {amplitude} is no command: from 1 to {FULL_SCALE - 1}")
    if ticks < SHORTEST_RECORD:
        raise NotTuned(f"{ticks} ticks are too few to tell anything: at least {SHORTEST_RECORD}")
    if kind == "steps":
        draw = numpy.random.default_rng(seed)
        lengths = draw.choice(
            [2, 4, 8, 16, 32], size=ticks // 4
        )  # each and its mirror: the axis stays where it is
        signs = numpy.concatenate(
            [numpy.r_[numpy.ones(n), -numpy.ones(n)] * draw.choice([-1, 1]) for n in lengths]
        )
        return (amplitude * signs[:ticks]).astype(int)
    if kind == "chirp":
        if not tick_s or not low_hz or not high_hz or not 0 < low_hz < high_hz < 0.5 / tick_s:
            raise NotTuned("a chirp needs tick_s and 0 < low_hz < high_hz < half the tick rate")
        t = numpy.arange(ticks) * tick_s
        growth = math.log(high_hz / low_hz) / t[-1]
        return numpy.round(
            amplitude * numpy.sin(2 * math.pi * low_hz * (numpy.exp(growth * t) - 1) / growth)
        ).astype(int)
    raise NotTuned(f"there is no excitation '{kind}': steps or chirp")


def answer(command, a, delay):
    """What the plant with b = 1 moves in the tick that begins with each command."""
    delayed = numpy.concatenate([numpy.zeros(delay), command])[: len(command)]
    kernel = a ** numpy.arange(
        min(len(command), 1 + int(math.log(1e-9) / math.log(a)) if a > 0 else 1)
    )
    size = 1 << (len(command) + len(kernel)).bit_length()
    return numpy.fft.irfft(numpy.fft.rfft(delayed, size) * numpy.fft.rfft(kernel, size), size)[
        : len(command)
    ]


def fitted(command, velocity, a, delay):
    """(squares left, b): least squares of the velocity over the answer and a constant."""
    shape = answer(command, a, delay)
    matrix = numpy.column_stack([shape, numpy.ones_like(shape)])
    solution, *_ = numpy.linalg.lstsq(matrix, velocity, rcond=None)
    return float(numpy.sum((velocity - matrix @ solution) ** 2)), float(solution[0])


def golden(function, low, high, steps=30):
    """Where a function with one valley has it."""
    ratio = (math.sqrt(5) - 1) / 2
    left, right = high - ratio * (high - low), low + ratio * (high - low)
    at_left, at_right = function(left), function(right)
    for _ in range(steps):
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - ratio * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + ratio * (high - low)
            at_right = function(right)
    return (low + high) / 2


def resonance(command, velocity, model, tick_s):
    """The frequency in Hz at which the axis answers far more than its model, None without one."""
    size = max(64, min(1024, 1 << (len(command) // 4).bit_length() - 1))
    pieces = range(0, len(command) - size + 1, size // 2)
    window = numpy.hanning(size)
    u, v, m = (
        [numpy.fft.rfft(window * (x[n : n + size] - x[n : n + size].mean())) for n in pieces]
        for x in (command, velocity, model)
    )
    power = sum(abs(x) ** 2 for x in u)
    cross = [sum(x * numpy.conj(y) for x, y in zip(z, u)) for z in (v, m)]
    known = (power > 1e-3 * power.max()) & (
        abs(cross[0]) ** 2 > COHERENT * power * sum(abs(x) ** 2 for x in v)
    )
    ratio = numpy.where(
        known, abs(cross[0]) / numpy.maximum(abs(cross[1]), 1e-12 * abs(cross[1]).max()), 0
    )[3:-1]
    at = int(ratio.argmax())
    return (at + 3) / size / tick_s if ratio[at] > 3 else None


def identify(record) -> Plant:
    """The plant that answers as the record does; NotTuned where the record cannot tell."""
    command, position = numpy.asarray(record.command, float), numpy.asarray(record.position, float)
    if command.shape != position.shape or command.ndim != 1:
        raise NotTuned(
            f"{command.size} commands and {position.size} positions: a record has one of each a tick"
        )
    if len(command) < SHORTEST_RECORD:
        raise NotTuned(
            f"{len(command)} ticks are too few to tell anything: at least {SHORTEST_RECORD}"
        )
    if not (numpy.isfinite(command).all() and numpy.isfinite(position).all()):
        raise NotTuned("the record has values that are no numbers")
    if numpy.ptp(command) == 0:
        raise NotTuned("the command did not change: give an excitation")
    if numpy.mean(abs(command) >= FULL_SCALE - 1) > SATURATED:
        raise NotTuned("the command stood at full scale: use a smaller amplitude")
    if numpy.ptp(position) < MOVED:
        raise NotTuned(
            f"no motion: the position moved by {numpy.ptp(position):.0f} LSB; is the drive on, "
            "and the amplitude above friction?"
        )
    velocity, command = numpy.diff(position), command[:-1]
    best = None
    for delay in range(LONGEST_DELAY + 1):

        def left(log_time, delay=delay):
            return fitted(command, velocity, math.exp(-math.exp(-log_time)), delay)[0]

        log_time = golden(left, math.log(0.15), math.log(len(command)))
        a = math.exp(-math.exp(-log_time))
        squares, b = fitted(command, velocity, a, delay)
        if best is None or squares < best[0] * (1 - 1e-9):
            best = squares, a, b, delay
    squares, a, b, delay = best
    unexplained = math.sqrt(
        squares / max(float(numpy.sum((velocity - velocity.mean()) ** 2)), 1e-30)
    )
    frequency = resonance(command, velocity, b * answer(command, a, delay), record.tick_s)
    if unexplained > UNEXPLAINED and frequency is None:
        raise NotTuned(
            f"too noisy: {100 * unexplained:.0f} % of the velocity is not an answer to the command; use a larger amplitude"
        )
    if b <= 0:
        raise NotTuned(
            "a positive command moves the axis down: swap the motor's wires or the direction of the grating"
        )
    return Plant(a, b, delay, record.tick_s, unexplained, frequency)


def identify_samples(time_s, command, position, tick_s) -> Plant:
    """As identify(), from samples at any times and few of them, such as those of moire.scope: each
    command holds from its time to the
    next. The plant is the continuous one that answers so, at the servo's tick."""
    time, command, position = (
        numpy.asarray(values, float) for values in (time_s, command, position)
    )
    if not len(time) == len(command) == len(position) or len(time) < SHORTEST_SAMPLES:
        raise NotTuned(
            f"{len(time)} samples are too few to tell anything: at least {SHORTEST_SAMPLES}"
        )
    if numpy.ptp(command[:-1]) == 0:
        raise NotTuned("the command did not change: give an excitation")
    if numpy.mean(abs(command) >= FULL_SCALE - 1) > SATURATED:
        raise NotTuned("the command stood at full scale: use a smaller amplitude")
    if numpy.ptp(position) < MOVED:
        raise NotTuned(
            f"no motion: the position moved by {numpy.ptp(position):.0f} LSB; is the amplitude above friction?"
        )
    ways, lengths = numpy.diff(position), numpy.diff(time)
    best = None
    for delay in numpy.arange(0.0, lengths.min(), tick_s / 2):

        def left(log_time, delay=delay):
            return fitted_ways(lengths, command, ways, math.exp(log_time), delay)[0]

        log_time = golden(left, math.log(tick_s / 4), math.log(time[-1] - time[0]))
        squares, gain = fitted_ways(lengths, command, ways, math.exp(log_time), delay)
        if best is None or squares < best[0] * (1 - 1e-9):
            best = squares, gain, math.exp(log_time), delay
    squares, gain, time_constant, delay = best
    unexplained = math.sqrt(squares / max(float(numpy.sum((ways - ways.mean()) ** 2)), 1e-30))
    if unexplained > UNEXPLAINED:
        raise NotTuned(
            f"too noisy: {100 * unexplained:.0f} % of the motion is not an answer to the command; use a larger amplitude"
        )
    if gain <= 0:
        raise NotTuned(
            "a positive command moves the axis down: swap the motor's wires or the direction of the grating"
        )
    a = math.exp(-tick_s / time_constant)
    return Plant(a, gain * tick_s * (1 - a), math.ceil(delay / tick_s), tick_s, unexplained)


def fitted_ways(lengths, command, ways, time_constant, delay):
    """(squares left, gain): least squares of the ways between samples over those of a first-order
    velocity of gain 1, and a drift.
    """
    velocity, before, out = 0.0, 0.0, []
    for length, now in zip(lengths, command):
        way = 0.0
        for given, part in ((before, delay), (now, length - delay)):
            decay = math.exp(-part / time_constant)
            way += given * part + (velocity - given) * time_constant * (1 - decay)
            velocity = given + (velocity - given) * decay
        before = now
        out.append(way)
    matrix = numpy.column_stack([out, lengths])
    solution, *_ = numpy.linalg.lstsq(matrix, ways, rcond=None)
    return float(numpy.sum((ways - matrix @ solution) ** 2)), float(solution[0])


# ------------------------------------------------------------------ filters


def coefficients(b0, b2, a1, a2):
    """Rounded, b1 such that a constant passes exactly unchanged."""
    b0, b2, c1, c2 = (round(value * COEFFICIENT) for value in (b0, b2, -a1, -a2))
    return b0, COEFFICIENT - b0 - b2 - c1 - c2, b2, c1, c2


def prewarped(frequency_hz, tick_s):
    if not 0 < frequency_hz < 0.5 / tick_s:
        raise NotTuned(
            f"a filter at {frequency_hz:g} Hz: from 0 to {0.5 / tick_s:g} Hz, half the tick rate"
        )
    return 2 * math.pi * frequency_hz * tick_s


def low_pass(frequency_hz, tick_s, quality=math.sqrt(0.5)):
    w = prewarped(frequency_hz, tick_s)
    alpha = math.sin(w) / 2 / quality
    b = (1 - math.cos(w)) / 2 / (1 + alpha)
    return coefficients(b, b, -2 * math.cos(w) / (1 + alpha), (1 - alpha) / (1 + alpha))


def notch(frequency_hz, tick_s, quality=1.5):
    w = prewarped(frequency_hz, tick_s)
    alpha = math.sin(w) / 2 / quality
    return coefficients(
        1 / (1 + alpha), 1 / (1 + alpha), -2 * math.cos(w) / (1 + alpha), (1 - alpha) / (1 + alpha)
    )


def filter_response(values, hz, tick_s):
    b0, b1, b2, c1, c2 = (value / COEFFICIENT for value in values)
    back = numpy.exp(-2j * numpy.pi * numpy.asarray(hz, float) * tick_s)
    return (b0 + b1 * back + b2 * back**2) / (1 - c1 * back - c2 * back**2)


# ------------------------------------------------------------------ gains


def propose(plant, bandwidth_hz, phase_margin_degree=50.0, filters=None) -> Tuning:
    """Gains for a bandwidth and a phase margin; filters of low_pass and notch, None: a notch at the
    plant's resonance if it has one.
    """
    tick_s, highest = plant.tick_s, 0.5 / plant.tick_s
    if not 0 < bandwidth_hz < highest / 2:
        raise NotTuned(
            f"a bandwidth of {bandwidth_hz:g} Hz: from 0 to {highest / 2:g} Hz, a quarter of the tick rate"
        )
    if not 20 <= phase_margin_degree <= 80:
        raise NotTuned(f"a phase margin of {phase_margin_degree:g} degrees: from 20 to 80")
    if filters is None:
        filters = () if plant.resonance_hz is None else (notch(plant.resonance_hz, tick_s),)
    kp, ki, kd = gains_at(plant, bandwidth_hz, phase_margin_degree, filters)
    real = {"kp": kp, "ki": ki, "kd": kd, "kv": (1 - plant.a) / plant.b, "ka": 1 / plant.b}
    whole = {name: round(value * (1 << SCALES[name])) for name, value in real.items()}
    if large := [name for name, value in whole.items() if value > MOST]:
        raise NotTuned(
            f"{large[0]} = {real[large[0]]:.4g} does not fit its register: the plant answers too little to a command"
        )
    if whole["kp"] < 8:
        raise NotTuned(
            f"kp = {real['kp']:.3g} is too small for its register: the plant answers too much to a command"
        )
    rough = Tuning(
        **whole, filters=tuple(filters), bandwidth_hz=0, phase_margin_degree=0, gain_margin=0
    )
    crossover, phase_margin, gain_margin = margins(plant, rough)
    if phase_margin < 0.6 * phase_margin_degree or gain_margin < 1.5 or not stable(plant, rough):
        raise NotTuned(
            f"no gains give {phase_margin_degree:g} degrees at {bandwidth_hz:g} Hz: the loop would have {phase_margin:.0f} "
            f"degrees and a gain margin of {gain_margin:.2f}; ask for less bandwidth"
        )
    return Tuning(
        **whole,
        filters=tuple(filters),
        bandwidth_hz=crossover,
        phase_margin_degree=phase_margin,
        gain_margin=gain_margin,
    )


def gains_at(plant, bandwidth_hz, phase_margin_degree, filters):
    """kp, ki, kd with which the open loop is 1 at the bandwidth with that margin."""
    w = 2 * math.pi * bandwidth_hz * plant.tick_s
    back = complex(math.cos(w), -math.sin(w))
    machine = complex(plant.response(bandwidth_hz))
    for values in filters:
        machine *= complex(filter_response(values, bandwidth_hz, plant.tick_s))
    wanted = complex(numpy.exp(1j * math.radians(phase_margin_degree - 180))) / machine
    wanted /= abs(wanted)
    fixed, rate = (
        1 + w * INTEGRAL_CORNER / (1 - back),
        1 - back,
    )  # of kp: what kd = 0 gives, and what kd adds
    part = max(0.0, -(fixed / wanted).imag / (rate / wanted).imag)
    if ((fixed + part * rate) / wanted).real <= 0 or (rate / wanted).imag <= 0 and part > 0:
        raise NotTuned(
            f"no gains give {phase_margin_degree:g} degrees at {bandwidth_hz:g} Hz: a delay of {plant.delay + 1} ticks and a "
            f"time constant of {1e3 * plant.time_constant_s:.3g} ms turn the phase too far; ask for less bandwidth"
        )
    kp = 1 / abs((fixed + part * rate) * machine)
    return kp, kp * w * INTEGRAL_CORNER, kp * part


def open_loop(plant, tuning, hz):
    return plant.response(hz) * tuning.response(hz, plant.tick_s)


def margins(plant, tuning):
    """(Hz at which the open loop last crosses 1, degrees there, gain that may be added where the
    phase is -180 degrees).
    """
    hz = numpy.geomspace(1e-4, 0.499, 6000) / plant.tick_s
    loop = open_loop(plant, tuning, hz)
    size, phase = abs(loop), numpy.degrees(numpy.unwrap(numpy.angle(loop)))
    above = numpy.flatnonzero(size >= 1)
    if above.size == 0:
        return 0.0, 180.0, math.inf
    at = above[-1]
    turned = at + numpy.flatnonzero(numpy.diff(numpy.floor((phase[at:] + 180) / 360)) != 0)
    margin = (phase[at] + 180 + 180) % 360 - 180
    return float(hz[at]), float(margin), float(1 / size[turned].max()) if turned.size else math.inf


def step(plant, tuning, ticks=None, size=1000.0, limit=FULL_SCALE - 1.0):
    """(target, position) over the ticks after a step of the target, in the arithmetic of the plant;
    no feed-forward.
    """
    ticks = ticks or max(60, round(6 / (tuning.bandwidth_hz or 0.01 / plant.tick_s) / plant.tick_s))
    kp, ki, kd = (tuning.real(name) for name in ("kp", "ki", "kd"))
    queue, states = [0.0] * plant.delay, [[0.0] * 4 for _ in tuning.filters]
    position = velocity = total = 0.0
    out = []
    for _ in range(ticks):
        out.append(position)
        error = size - position
        asked = kp * error + total + ki * error - kd * velocity
        if abs(asked) < limit:
            total += ki * error
        command = max(-limit, min(limit, asked))
        for values, state in zip(tuning.filters, states):
            inputs = (command, *state)
            command = sum(value / COEFFICIENT * x for value, x in zip(values, inputs))
            state[:] = inputs[0], state[0], command, state[2]
        queue.append(max(-limit, min(limit, command)))
        velocity = plant.a * velocity + plant.b * queue.pop(0)
        position += velocity
    return numpy.full(ticks, size), numpy.array(out)


def stable(plant, tuning):
    """A step of any size comes to rest on its target."""
    ticks = round(30 / max(margins(plant, tuning)[0], 1e-3 / plant.tick_s) / plant.tick_s)
    target, position = step(plant, tuning, ticks, limit=math.inf)
    return bool(abs(position[-ticks // 5 :] - target[-1]).max() < 0.1 * target[-1])


def picture(plant, tuning) -> bytes:
    """Bode plot of the open loop and the answer to a step, as a PNG."""
    figure, (size, phase, answer_panel) = report.drawing(height=8.0, nrows=3)
    hz = numpy.geomspace(1e-3, 0.49, 800) / plant.tick_s
    loop = open_loop(plant, tuning, hz)
    size.loglog(hz, abs(loop), color=report.colour(0), label="open loop")
    size.loglog(hz, abs(loop / (1 + loop)), color=report.colour(1), label="closed loop")
    size.axhline(1, color="#555555", linewidth=0.8)
    size.set_ylabel("gain")
    phase.semilogx(hz, numpy.degrees(numpy.unwrap(numpy.angle(loop))), color=report.colour(0))
    phase.axhline(-180, color="#555555", linewidth=0.8)
    phase.set_ylabel("phase / degree")
    phase.set_xlabel("frequency / Hz")
    for panel in (size, phase):
        panel.axvline(tuning.bandwidth_hz, color="#555555", linewidth=0.8, linestyle="--")
    target, position = step(plant, tuning)
    time_ms = numpy.arange(len(target)) * plant.tick_s * 1e3
    answer_panel.plot(time_ms, target, color="#555555", linestyle="--", label="target")
    answer_panel.plot(time_ms, position, color=report.colour(0))
    answer_panel.set_xlabel("time / ms")
    answer_panel.set_ylabel("position / LSB")
    report.legend(figure, size)
    return report.png(figure)
