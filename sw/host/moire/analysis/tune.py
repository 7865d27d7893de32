# SPDX-License-Identifier: Apache-2.0
"""Gains for the servo of an axis, from a record of its response in open loop.

    command = tune.excitation(4000, amplitude=3000)     # one for each servo tick, in open loop
    record = tune.Record(command, position, tick_s)     # position at each tick
    plant = tune.identify(record)
    tuning = tune.propose(plant, bandwidth_hz=40)
    Path("tuning.png").write_bytes(tune.picture(plant, tuning))

Commands have the full scale 2^15, and positions are in LSB of 2^-16 period. The plant is a velocity
that follows the command with a gain, one time constant and a delay, and a mode of the mechanics
between the motor and the scale, if it has one:
v[n+1] = a v[n] + b ((1 - part) u[n - delay] + part u[n - delay - 1]).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy
from numpy.typing import ArrayLike, NDArray

from moire.analysis import report
from moire.errors import MoireError

Array = NDArray[numpy.float64]
Complex = NDArray[numpy.complex128]
Filter = tuple[int, int, int, int, int]  # b0, b1, b2, -a1, -a2 of a filter

FULL_SCALE = 1 << 15  # of a command
SCALES = {
    "kp": 16,
    "ki": 24,
    "kd": 16,
    "kv": 16,
    "ka": 8,
}  # fraction bits of the gains, as axis_registers has them
MOST = (1 << 24) - 1
COEFFICIENT = 1 << 30  # of a filter
LONGEST_DELAY = 12  # ticks that are tried
SHORTEST_RECORD = 200  # ticks
SHORTEST_SAMPLES = 60  # of a record with samples at any times
MOVED = 20  # LSB; less is no motion
UNEXPLAINED = 0.35  # of the rms of the velocity; more is too noisy, or a different kind of plant
SATURATED = 0.05  # share of the samples at full scale; more is too much
COHERENT = 0.8  # share of the motion at a resonance that is a response to the command
INTEGRAL_CORNER = 1 / 8  # of the bandwidth
LEAST_PHASE_MARGIN = 30.0  # degrees, of gains that are not refused
LEAST_GAIN_MARGIN = 1.5
SMALLER = 0.8  # factor from one try of a gain to the next
TRIES = 30


def tick_delay(hz: ArrayLike, tick_s: float) -> Complex:
    """The response of a delay by one tick at these frequencies."""
    return numpy.asarray(numpy.exp(-2j * numpy.pi * numpy.asarray(hz, float) * tick_s), complex)


class NotTuned(MoireError):
    """The record, or what is asked for, allows no gains; the text says why, and what would."""


class Unsuitable(NotTuned):
    """Gains make the loop unstable, or leave it too little margin; the text says what to change."""


@dataclass(frozen=True)
class Record:
    """One value for each servo tick: position[n] is where the axis was at command[n]."""

    command: ArrayLike  # full scale 2^15
    position: ArrayLike  # 2^-16 period
    tick_s: float


@dataclass(frozen=True)
class Plant:
    """The response of an axis to the drive command."""

    a: float
    b: float  # LSB in one tick, per command
    delay: int  # ticks
    tick_s: float
    unexplained: float = 0.0  # share of the rms of the velocity that the model does not explain
    resonance_hz: float | None = None
    part: float = 0.0  # ticks beyond `delay`, 0 to 1
    damping: float | None = (
        None  # of critical, of a mode at resonance_hz; None: no mode is modelled
    )

    @property
    def gain(self) -> float:
        """The final velocity in LSB in one tick, per command."""
        return self.b / (1 - self.a)

    @property
    def time_constant_s(self) -> float:
        """The time constant in s."""
        return -self.tick_s / math.log(self.a) if self.a > 0 else 0.0

    @property
    def mode(self) -> tuple[float, float]:
        """c1 and c2 of the mode, out[n] = (1 - c1 - c2) in[n] + c1 out[n-1] + c2 out[n-2]."""
        if self.damping is None or self.resonance_hz is None:
            return 0.0, 0.0
        angle = 2 * math.pi * self.resonance_hz * self.tick_s
        radius = math.exp(-self.damping * angle)
        turn = angle * math.sqrt(max(0.0, 1 - self.damping**2))
        return 2 * radius * math.cos(turn), -(radius**2)

    def response(self, hz: ArrayLike) -> Complex:
        """Position over command at these frequencies."""
        back = tick_delay(hz, self.tick_s)
        c1, c2 = self.mode
        late = (1 - self.part + self.part * back) * back ** (self.delay + 1)
        shaped = (1 - c1 - c2) / (1 - c1 * back - c2 * back**2)
        response: Complex = self.b * late * shaped / (1 - self.a * back) / (1 - back)
        return response


@dataclass(frozen=True)
class Tuning:
    """Gains and filters of the servo, and what they give."""

    kp: int  # the gains are in counts of the registers
    ki: int
    kd: int
    kv: int
    ka: int
    filters: tuple[Filter, ...]
    bandwidth_hz: float  # frequency at which the open loop has the gain 1
    phase_margin_degree: float
    gain_margin: float

    def real(self, name: str) -> float:
        """A gain as a real number."""
        counts: int = getattr(self, name)
        return counts / (1 << SCALES[name])

    def response(self, hz: ArrayLike, tick_s: float) -> Complex:
        """Command over error at these frequencies, filters included."""
        back = tick_delay(hz, tick_s)
        servo: Complex = (
            self.real("kp") + self.real("ki") / (1 - back) + self.real("kd") * (1 - back)
        )
        for coefficients in self.filters:
            servo = servo * filter_response(coefficients, hz, tick_s)
        return servo


# ------------------------------------------------------------------ excitation and identification


def excitation(
    ticks: int,
    amplitude: float,
    kind: str = "steps",
    tick_s: float | None = None,
    low_hz: float | None = None,
    high_hz: float | None = None,
    seed: int = 1,
) -> NDArray[numpy.int64]:
    """Commands for the open loop, one for each tick; raises NotTuned.

    They are `steps` of random length between -amplitude and +amplitude, or a `chirp` from low_hz
    to high_hz.
    """
    if not 0 < amplitude < FULL_SCALE:
        raise NotTuned(f"an amplitude of {amplitude} is no command: from 1 to {FULL_SCALE - 1}")
    if ticks < SHORTEST_RECORD:
        raise NotTuned(f"{ticks} ticks are too few to tell anything: at least {SHORTEST_RECORD}")
    if kind == "steps":
        draw = numpy.random.default_rng(seed)
        # each step is followed by its mirror image, so that the axis stays where it is
        lengths = draw.choice([2, 4, 8, 16, 32], size=ticks // 4)
        signs = numpy.concatenate(
            [numpy.r_[numpy.ones(n), -numpy.ones(n)] * draw.choice([-1, 1]) for n in lengths]
        )
        return numpy.asarray(amplitude * signs[:ticks]).astype(numpy.int64)
    if kind == "chirp":
        if not tick_s or not low_hz or not high_hz or not 0 < low_hz < high_hz < 0.5 / tick_s:
            raise NotTuned("a chirp needs tick_s and 0 < low_hz < high_hz < half the tick rate")
        t = numpy.arange(ticks) * tick_s
        growth = math.log(high_hz / low_hz) / t[-1]
        phase = 2 * math.pi * low_hz * (numpy.exp(growth * t) - 1) / growth
        return numpy.asarray(numpy.round(amplitude * numpy.sin(phase))).astype(numpy.int64)
    raise NotTuned(f"there is no excitation '{kind}': steps or chirp")


def answer(command: Array, a: float, delay: int) -> Array:
    """The distance that a plant with b = 1 moves in the tick that begins with each command."""
    delayed = numpy.concatenate([numpy.zeros(delay), command])[: len(command)]
    kernel = a ** numpy.arange(
        min(len(command), 1 + int(math.log(1e-9) / math.log(a)) if a > 0 else 1)
    )
    size = 1 << (len(command) + len(kernel)).bit_length()
    product = numpy.fft.rfft(delayed, size) * numpy.fft.rfft(kernel, size)
    return numpy.asarray(numpy.fft.irfft(product, size)[: len(command)], float)


def fitted(command: Array, velocity: Array, a: float, delay: int) -> tuple[float, float]:
    """The sum of squares that is left, and b, of a fit of the velocity.

    It is a least-squares fit of the response of the plant and a constant.
    """
    shape = answer(command, a, delay)
    matrix = numpy.column_stack([shape, numpy.ones_like(shape)])
    solution, *_ = numpy.linalg.lstsq(matrix, velocity, rcond=None)
    return float(numpy.sum((velocity - matrix @ solution) ** 2)), float(solution[0])


def golden(function: Callable[[float], float], low: float, high: float, steps: int = 30) -> float:
    """The minimum of a function that has only one, by golden-section search."""
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


def resonance(command: Array, velocity: Array, model: Array, tick_s: float) -> float | None:
    """The frequency in Hz at which the axis responds far more than its model, None without one."""
    size = max(64, min(1024, 1 << (len(command) // 4).bit_length() - 1))
    pieces = range(0, len(command) - size + 1, size // 2)
    window = numpy.hanning(size)
    u, v, m = (
        [numpy.fft.rfft(window * (x[n : n + size] - x[n : n + size].mean())) for n in pieces]
        for x in (command, velocity, model)
    )
    power = numpy.sum(numpy.abs(u) ** 2, axis=0)
    cross = [numpy.sum(numpy.asarray(z) * numpy.conj(u), axis=0) for z in (v, m)]
    known = (power > 1e-3 * power.max()) & (
        abs(cross[0]) ** 2 > COHERENT * power * numpy.sum(numpy.abs(v) ** 2, axis=0)
    )
    ratio = numpy.where(
        known, abs(cross[0]) / numpy.maximum(abs(cross[1]), 1e-12 * abs(cross[1]).max()), 0
    )[3:-1]
    at = int(ratio.argmax())
    return (at + 3) / size / tick_s if ratio[at] > 3 else None


def check_response(command: Array, position: Array) -> None:
    """Raises NotTuned unless the command changes within its limits, and the axis moves."""
    if numpy.ptp(command) == 0:
        raise NotTuned("the command did not change: give an excitation")
    if numpy.mean(abs(command) >= FULL_SCALE - 1) > SATURATED:
        raise NotTuned("the command was at full scale: use a smaller amplitude")
    if numpy.ptp(position) < MOVED:
        raise NotTuned(
            f"no motion: the position moved by {numpy.ptp(position):.0f} LSB; is the drive on, "
            "and the amplitude above friction?"
        )


def check_direction(gain: float) -> None:
    """Raises NotTuned unless a positive command moves the axis up."""
    if gain <= 0:
        raise NotTuned(
            "a positive command moves the axis down: swap the motor's wires or the direction of "
            "the grating"
        )


def identify(record: Record) -> Plant:
    """The plant that responds as in the record; raises NotTuned where the record cannot show it."""
    command, position = numpy.asarray(record.command, float), numpy.asarray(record.position, float)
    if command.shape != position.shape or command.ndim != 1:
        raise NotTuned(
            f"{command.size} commands and {position.size} positions: a record has one of each at "
            "every tick"
        )
    if len(command) < SHORTEST_RECORD:
        raise NotTuned(
            f"{len(command)} ticks are too few to tell anything: at least {SHORTEST_RECORD}"
        )
    if not (numpy.isfinite(command).all() and numpy.isfinite(position).all()):
        raise NotTuned("the record has values that are no numbers")
    check_response(command, position)
    velocity, command = numpy.diff(position), command[:-1]
    best = math.inf, 0.0, 0.0, 0  # squares that are left, a, b, delay
    for delay in range(LONGEST_DELAY + 1):

        def left(log_time: float, delay: int = delay) -> float:
            return fitted(command, velocity, math.exp(-math.exp(-log_time)), delay)[0]

        log_time = golden(left, math.log(0.15), math.log(len(command)))
        a = math.exp(-math.exp(-log_time))
        squares, b = fitted(command, velocity, a, delay)
        if squares < best[0] * (1 - 1e-9):
            best = squares, a, b, delay
    squares, a, b, delay = best
    unexplained = math.sqrt(
        squares / max(float(numpy.sum((velocity - velocity.mean()) ** 2)), 1e-30)
    )
    frequency = resonance(command, velocity, b * answer(command, a, delay), record.tick_s)
    if unexplained > UNEXPLAINED and frequency is None:
        raise NotTuned(
            f"too noisy: {100 * unexplained:.0f} % of the velocity is not a response to the "
            "command; use a larger amplitude"
        )
    check_direction(b)
    return Plant(a, b, delay, record.tick_s, unexplained, frequency)


def identify_samples(
    time_s: ArrayLike, commands: ArrayLike, positions: ArrayLike, tick_s: float
) -> Plant:
    """Does the same as identify() with few samples at any times, such as those of the scope.

    Each command is in force from its time to the next. The plant is the continuous one that
    responds in this way, at the tick of the servo. Raises NotTuned.
    """
    time, command, position = (
        numpy.asarray(values, float) for values in (time_s, commands, positions)
    )
    if not len(time) == len(command) == len(position) or len(time) < SHORTEST_SAMPLES:
        raise NotTuned(
            f"{len(time)} samples are too few to tell anything: at least {SHORTEST_SAMPLES}"
        )
    check_response(command[:-1], position)
    distances, lengths = numpy.diff(position), numpy.diff(time)
    best = math.inf, 0.0, 0.0, 0.0  # squares that are left, gain, time constant, delay
    for delay in numpy.arange(0.0, lengths.min(), tick_s / 2).tolist():

        def left(log_time: float, delay: float = delay) -> float:
            return fitted_distances(lengths, command, distances, math.exp(log_time), delay)[0]

        log_time = golden(left, math.log(tick_s / 4), math.log(time[-1] - time[0]))
        squares, gain = fitted_distances(lengths, command, distances, math.exp(log_time), delay)
        if squares < best[0] * (1 - 1e-9):
            best = squares, gain, math.exp(log_time), delay
    squares, gain, time_constant, delay = best
    total = float(numpy.sum((distances - distances.mean()) ** 2))
    unexplained = math.sqrt(squares / max(total, 1e-30))
    if unexplained > UNEXPLAINED:
        raise NotTuned(
            f"too noisy: {100 * unexplained:.0f} % of the motion is not a response to the "
            "command; use a larger amplitude"
        )
    check_direction(gain)
    a = math.exp(-tick_s / time_constant)
    return Plant(a, gain * tick_s * (1 - a), math.ceil(delay / tick_s), tick_s, unexplained)


def fitted_distances(
    lengths: Array, command: Array, distances: Array, time_constant: float, delay: float
) -> tuple[float, float]:
    """The sum of squares that is left, and the gain, of a fit of the distances between samples.

    It is a least-squares fit of the distances of a first-order velocity with gain 1, and a drift.
    """
    velocity, before, out = 0.0, 0.0, []
    for length, now in zip(lengths, command):
        distance = 0.0
        for given, part in ((before, delay), (now, length - delay)):
            decay = math.exp(-part / time_constant)
            distance += given * part + (velocity - given) * time_constant * (1 - decay)
            velocity = given + (velocity - given) * decay
        before = now
        out.append(distance)
    matrix = numpy.column_stack([out, lengths])
    solution, *_ = numpy.linalg.lstsq(matrix, distances, rcond=None)
    return float(numpy.sum((distances - matrix @ solution) ** 2)), float(solution[0])


# ------------------------------------------------------------------ filters


def coefficients(b0: float, b2: float, a1: float, a2: float) -> Filter:
    """The rounded coefficients, with b1 such that a constant passes exactly unchanged."""
    d0, d2, c1, c2 = (round(value * COEFFICIENT) for value in (b0, b2, -a1, -a2))
    return d0, COEFFICIENT - d0 - d2 - c1 - c2, d2, c1, c2


def angular_frequency(frequency_hz: float, tick_s: float) -> float:
    """The frequency in rad in one tick; raises NotTuned above half the tick rate."""
    if not 0 < frequency_hz < 0.5 / tick_s:
        raise NotTuned(
            f"a filter at {frequency_hz:g} Hz: from 0 to {0.5 / tick_s:g} Hz, half the tick rate"
        )
    return 2 * math.pi * frequency_hz * tick_s


def low_pass(frequency_hz: float, tick_s: float, quality: float = math.sqrt(0.5)) -> Filter:
    """A second-order low-pass filter; raises NotTuned."""
    w = angular_frequency(frequency_hz, tick_s)
    alpha = math.sin(w) / 2 / quality
    b = (1 - math.cos(w)) / 2 / (1 + alpha)
    return coefficients(b, b, -2 * math.cos(w) / (1 + alpha), (1 - alpha) / (1 + alpha))


def notch(frequency_hz: float, tick_s: float, quality: float = 1.5) -> Filter:
    """A notch filter; raises NotTuned."""
    w = angular_frequency(frequency_hz, tick_s)
    alpha = math.sin(w) / 2 / quality
    return coefficients(
        1 / (1 + alpha), 1 / (1 + alpha), -2 * math.cos(w) / (1 + alpha), (1 - alpha) / (1 + alpha)
    )


def filter_response(values: Filter, hz: ArrayLike, tick_s: float) -> Complex:
    """The response of a filter at these frequencies."""
    b0, b1, b2, c1, c2 = (value / COEFFICIENT for value in values)
    back = tick_delay(hz, tick_s)
    response: Complex = (b0 + b1 * back + b2 * back**2) / (1 - c1 * back - c2 * back**2)
    return response


# ------------------------------------------------------------------ gains


def propose(
    plant: Plant,
    bandwidth_hz: float,
    phase_margin_degree: float = 50.0,
    filters: Sequence[Filter] | None = None,
) -> Tuning:
    """Gains for a bandwidth and a phase margin; raises NotTuned.

    `filters` are made by low_pass() and notch(); None is a notch at the resonance of the plant, if
    it has one.
    """
    tick_s, highest = plant.tick_s, 0.5 / plant.tick_s
    if not 0 < bandwidth_hz < highest / 2:
        raise NotTuned(
            f"a bandwidth of {bandwidth_hz:g} Hz: from 0 to {highest / 2:g} Hz, a quarter of the "
            "tick rate"
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
            f"{large[0]} = {real[large[0]]:.4g} does not fit its register: the plant responds too "
            "little to a command"
        )
    if whole["kp"] < 8:
        raise NotTuned(
            f"kp = {real['kp']:.3g} is too small for its register: the plant responds too much to "
            "a command"
        )
    rough = Tuning(
        **whole, filters=tuple(filters), bandwidth_hz=0, phase_margin_degree=0, gain_margin=0
    )
    found = with_margins(plant, rough)
    if found.phase_margin_degree < 0.6 * phase_margin_degree or not good(plant, found):
        raise NotTuned(
            f"no gains give {phase_margin_degree:g} degrees at {bandwidth_hz:g} Hz: the loop would "
            f"have {found.phase_margin_degree:.0f} degrees and a gain margin of "
            f"{found.gain_margin:.2f}; ask for less bandwidth"
        )
    return found


def with_margins(plant: Plant, tuning: Tuning) -> Tuning:
    """The same gains and filters, with the bandwidth and the margins that they give."""
    bandwidth_hz, phase_margin, gain_margin = margins(plant, tuning)
    return replace(
        tuning,
        bandwidth_hz=bandwidth_hz,
        phase_margin_degree=phase_margin,
        gain_margin=gain_margin,
    )


def good(plant: Plant, tuning: Tuning) -> bool:
    """Whether the loop is stable with the margins that it must have at least."""
    return (
        tuning.phase_margin_degree >= LEAST_PHASE_MARGIN
        and tuning.gain_margin >= LEAST_GAIN_MARGIN
        and stable(plant, tuning)
    )


def check(plant: Plant, tuning: Tuning) -> Tuning:
    """The gains of an axis with the margins that they give with its plant; raises Unsuitable."""
    found = with_margins(plant, tuning)
    if good(plant, found):
        return found
    wrong = "is unstable"
    if stable(plant, found):
        wrong = (
            f"has a phase margin of {found.phase_margin_degree:.0f} degrees and a gain margin of "
            f"{found.gain_margin:.2f}; it needs {LEAST_PHASE_MARGIN:.0f} degrees and "
            f"{LEAST_GAIN_MARGIN:g}"
        )
    raise Unsuitable(f"with these gains the loop of the servo {wrong}: {advice(plant, found)}")


def advice(plant: Plant, tuning: Tuning) -> str:
    """Which gains to change, and to which values: one alone if that is enough."""
    if tuning.kp == 0:
        return "set kp, which is 0, or let `moire tune --write` set all gains"
    for names in (("ki",), ("kd",), ("kp",), ("kp", "ki", "kd")):
        for power in range(1, TRIES):
            counts: dict[str, Any] = {
                name: int(getattr(tuning, name) * SMALLER**power) for name in names
            }
            tried = with_margins(plant, replace(tuning, **counts))
            if all(counts.values()) and good(plant, tried):
                values = [f"{name} to {tried.real(name):.6g}" for name in names]
                return f"set {' and '.join(values)} at most"
    return "no smaller gains help: let `moire tune --write` set gains and filters"


def gains_at(
    plant: Plant, bandwidth_hz: float, phase_margin_degree: float, filters: Sequence[Filter]
) -> tuple[float, float, float]:
    """kp, ki and kd with which the open loop is 1 at the bandwidth, with this phase margin."""
    w = 2 * math.pi * bandwidth_hz * plant.tick_s
    back = complex(math.cos(w), -math.sin(w))
    machine = complex(plant.response(bandwidth_hz))
    for values in filters:
        machine *= complex(filter_response(values, bandwidth_hz, plant.tick_s))
    required = complex(numpy.exp(1j * math.radians(phase_margin_degree - 180))) / machine
    required /= abs(required)
    # the response of the servo over kp: without kd, and what kd adds
    fixed, rate = 1 + w * INTEGRAL_CORNER / (1 - back), 1 - back
    part = max(0.0, -(fixed / required).imag / (rate / required).imag)
    if ((fixed + part * rate) / required).real <= 0 or (rate / required).imag <= 0 and part > 0:
        raise NotTuned(
            f"no gains give {phase_margin_degree:g} degrees at {bandwidth_hz:g} Hz: a delay of "
            f"{plant.delay + 1} ticks and a time constant of {1e3 * plant.time_constant_s:.3g} ms "
            "turn the phase too far; ask for less bandwidth"
        )
    kp = 1 / abs((fixed + part * rate) * machine)
    return kp, kp * w * INTEGRAL_CORNER, kp * part


def open_loop(plant: Plant, tuning: Tuning, hz: ArrayLike) -> Complex:
    """The response of the open loop at these frequencies."""
    return plant.response(hz) * tuning.response(hz, plant.tick_s)


def margins(plant: Plant, tuning: Tuning) -> tuple[float, float, float]:
    """The highest frequency in Hz at which the open loop has the gain 1, the phase margin there in
    degrees, and the gain margin.
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


def step(
    plant: Plant,
    tuning: Tuning,
    ticks: int | None = None,
    size: float = 1000.0,
    limit: float = FULL_SCALE - 1.0,
) -> tuple[Array, Array]:
    """Target and position in LSB at each tick after a step of the target, without feedforward.

    `limit` is the largest drive command.
    """
    ticks = ticks or max(60, round(6 / (tuning.bandwidth_hz or 0.01 / plant.tick_s) / plant.tick_s))
    kp, ki, kd = (tuning.real(name) for name in ("kp", "ki", "kd"))
    queue, states = [0.0] * plant.delay, [[0.0] * 4 for _ in tuning.filters]
    position = velocity = total = before = measured = 0.0
    (c1, c2), shaped = plant.mode, [0.0, 0.0]
    out = []
    for _ in range(ticks):
        out.append(position)
        error = size - position
        unlimited = kp * error + total + ki * error - kd * measured
        if abs(unlimited) < limit:
            total += ki * error
        command = max(-limit, min(limit, unlimited))
        for values, state in zip(tuning.filters, states):
            inputs = (command, *state)
            command = sum(value / COEFFICIENT * x for value, x in zip(values, inputs))
            state[:] = inputs[0], state[0], command, state[2]
        queue.append(max(-limit, min(limit, command)))
        given = queue.pop(0)
        velocity = plant.a * velocity + plant.b * ((1 - plant.part) * given + plant.part * before)
        before = given
        measured = (1 - c1 - c2) * velocity + c1 * shaped[0] + c2 * shaped[1]
        shaped = [measured, shaped[0]]
        position += measured
    return numpy.full(ticks, size), numpy.array(out)


def stable(plant: Plant, tuning: Tuning) -> bool:
    """Whether a step of any size comes to rest at its target."""
    ticks = round(30 / max(margins(plant, tuning)[0], 1e-3 / plant.tick_s) / plant.tick_s)
    target, position = step(plant, tuning, ticks, limit=math.inf)
    return bool(abs(position[-ticks // 5 :] - target[-1]).max() < 0.1 * target[-1])


def picture(plant: Plant, tuning: Tuning) -> bytes:
    """The Bode plot of the open loop, and the response to a step, as PNG."""
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
