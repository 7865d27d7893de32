# SPDX-License-Identifier: Apache-2.0
"""The measured frequency response of an axis in closed loop: plant, open loop and closed loop.

    response = measure(axis)                         # the axis moves slowly and evenly meanwhile
    plant = fit(response)                            # a plant of moire.analysis.tune
    Path("response.png").write_bytes(picture(response, plant, tuning))

A multisine is added to the commands of the servo, one value at each servo tick, and error and
command are recorded at the same ticks. The multisine is periodic and the records are whole periods
of it, so nothing leaks from one frequency to another. With the excitation d, the command u = d +
(command of the servo) and the position y:

    plant  G = y / u          sensitivity  S = u / d = 1 / (1 + L)
    open loop  L = 1 / S - 1  closed loop  T = 1 - S

u and y are averaged over the periods before they are divided, which leaves no bias by the noise
that the loop feeds back. Frequencies are in Hz, G is in LSB of 2^-16 period for a command of full
scale 2^15, and its phase contains the delay from a servo tick, at which the position is taken, to
the motion.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from fractions import Fraction

import numpy
from numpy.typing import ArrayLike, NDArray

from moire import units
from moire.analysis.least_squares import least_squares
from moire.analysis.tick_scope import TickScope, Trigger
from moire.analysis.tune import (
    FULL_SCALE,
    SATURATED,
    UNEXPLAINED,
    NotTuned,
    Plant,
    Tuning,
    check_direction,
)
from moire.client.access import COUNTS
from moire.client.axis import Axis
from moire.client.calibration import ends_of_stroke

Array = NDArray[numpy.float64]
Complex = NDArray[numpy.complex128]

PERIOD = 4096  # ticks of the multisine of low frequencies
LINES = 140  # frequencies of it, fewer where whole periods leave fewer
LOW_LINES = 40  # of that of the low frequencies
LOWEST_HZ = 1.0
SPLIT_HZ = 20.0  # below this the multisine has its full period, above it a quarter
HIGHEST_SHARE = 0.2  # of the tick rate
PEAK = "15%"  # of full scale, of the multisine
FLATTENINGS = 300  # steps that lower its crest factor
CUTS = 0.3, 0.9  # of the peak, in the first and in the last of these steps
PERIODS = 2  # of a record
RECORDS = 2
SPEED_PERIODS = 0.625  # signal periods of the scale in a tick: away from all that is measured
LEAST_COHERENCE = 0.8
CLEAR_ERROR = 0.02  # relative standard error of a point that counts half in a fit
MOST_INCOHERENT = 0.25  # share of the frequencies that may have less
SIGNALS = ("error", "command")
AT_SPEED = 0.99  # of the speed: the axis moves evenly
SPARE = 1.02  # of the stroke
APPROACH = 0.1  # of the stroke, below it, from where the motions of the slower loop come
LEAST_SENSITIVITY = 0.1  # share of the excitation that the loop must leave
SOFT_BANDWIDTH = 6.0  # of the slower loop, in lowest frequencies
MOST_OF_THE_SPEED = 0.3  # that the excitation of the slower loop may take
SAMPLES_OF_A_CYCLE = 4  # of the highest frequency, at least, where fewer samples are recorded
SETTLING_PERIODS = 1  # of the multisine, until its response is periodic
MODE_GAIN = 0.5  # a mode is one if it leaves less than this share of the squares


class NotCoherent(NotTuned):
    """The response is not clear enough above the disturbances; the text says what to change."""


@dataclass(frozen=True)
class Excitation:
    """One period of a periodic waveform, and the frequencies that it contains."""

    values: NDArray[numpy.int64]  # commands, full scale 2^15
    lines: NDArray[numpy.int64]  # cycles in a period
    tick_s: float

    @property
    def hz(self) -> Array:
        """The frequencies."""
        return numpy.asarray(self.lines / (len(self.values) * self.tick_s), float)

    @property
    def crest(self) -> float:
        """Peak over rms."""
        rms = float(numpy.sqrt(numpy.mean(self.values.astype(float) ** 2)))
        return float(numpy.abs(self.values).max()) / rms

    @property
    def sparse(self) -> int:
        """Ticks from sample to sample that suffice to record the response; a power of two."""
        most = len(self.values) / (SAMPLES_OF_A_CYCLE * float(self.lines[-1]))
        return max(1, 1 << int(math.log2(max(most, 1.0))))

    def spectrum(self, signal: ArrayLike, every: int = 1) -> Complex:
        """The signal at the frequencies of the excitation: amplitude and phase of each period.

        A row for each whole period of the signal, which has a value in `every` ticks.
        """
        rows = numpy.asarray(signal, float).reshape(-1, len(self.values) // every)
        return numpy.asarray(numpy.fft.rfft(rows, axis=1)[:, self.lines] * 2 / rows.shape[1])


def multisine(
    tick_s: float,
    low_hz: float = LOWEST_HZ,
    high_hz: float | None = None,
    peak: units.Value = PEAK,
    period: int = PERIOD,
    count: int = LINES,
) -> Excitation:
    """A multisine of about `count` frequencies, evenly spaced on a logarithmic axis.

    All have the same amplitude. `peak` is a share of full scale. The phases begin as Schroeder's,
    which spread the energy over the period; cutting the peaks and restoring the amplitudes in turn
    lowers the crest factor further. Raises NotTuned.
    """
    highest = HIGHEST_SHARE / tick_s if high_hz is None else high_hz
    share = float(units.parse_share(peak))
    lowest = 1 / (period * tick_s)
    if not lowest * 0.97 <= low_hz < highest <= 0.45 / tick_s:
        raise NotTuned(
            f"from {low_hz:g} to {highest:g} Hz: a period of {period} ticks has frequencies from "
            f"{lowest:.3g} Hz, and the tick rate allows {0.45 / tick_s:g} Hz"
        )
    if not 0 < share < 1:
        raise NotTuned(f"a peak of {100 * share:g} % of full scale: above 0 and below 100 %")
    wished = numpy.geomspace(max(low_hz, lowest), highest, count) / lowest
    lines = numpy.unique(numpy.round(wished).astype(numpy.int64))
    order = numpy.arange(len(lines))
    phases = -math.pi * order * (order - 1) / len(lines)
    for limit_share in numpy.linspace(*CUTS, FLATTENINGS):
        wave = synthesised(lines, phases, period)
        limit = limit_share * numpy.abs(wave).max()
        phases = numpy.angle(numpy.fft.rfft(numpy.clip(wave, -limit, limit))[lines])
    wave = synthesised(lines, phases, period)
    values = numpy.round(wave / numpy.abs(wave).max() * share * (FULL_SCALE - 1))
    return Excitation(values.astype(numpy.int64), lines, tick_s)


def synthesised(lines: NDArray[numpy.int64], phases: Array, period: int) -> Array:
    """The sum of cosines with these phases."""
    spectrum = numpy.zeros(period // 2 + 1, complex)
    spectrum[lines] = numpy.exp(1j * phases)
    return numpy.asarray(numpy.fft.irfft(spectrum, period), float)


@dataclass(frozen=True)
class Response:
    """What was measured, one value of each array for each frequency."""

    hz: Array
    plant: Complex  # position over command, LSB per command
    sensitivity: Complex  # 1 / (1 + open loop)
    coherence: Array  # share of motion and command that responds to the excitation, 0 to 1
    error: Array  # standard error of the plant, relative to it
    tick_s: float
    period_nm: float
    crest: float
    periods: int  # averaged

    @property
    def open_loop(self) -> Complex:
        """The open loop of the gains that the axis had."""
        return numpy.asarray(1 / self.sensitivity - 1, complex)

    @property
    def closed_loop(self) -> Complex:
        """From the target to the position, without feed-forward."""
        return numpy.asarray(1 - self.sensitivity, complex)

    @property
    def clear(self) -> NDArray[numpy.bool_]:
        """Where the coherence suffices."""
        return numpy.asarray(self.coherence >= LEAST_COHERENCE)

    def csv(self) -> str:
        """The response as CSV, with a heading that names the units."""
        scale = self.period_nm / COUNTS * FULL_SCALE  # nm for full scale
        rows = [
            "frequency_hz,plant_nm_per_full_scale,plant_degree,open_loop,open_loop_degree,"
            "closed_loop,closed_loop_degree,coherence,plant_relative_error"
        ]
        parts = (self.plant * scale, self.open_loop, self.closed_loop)
        for n, hz in enumerate(self.hz):
            cells = [f"{hz:.6g}"]
            for part in parts:
                cells += [f"{abs(part[n]):.6g}", f"{math.degrees(numpy.angle(part[n])):.3f}"]
            rows.append(",".join([*cells, f"{self.coherence[n]:.5f}", f"{self.error[n]:.3g}"]))
        return "\n".join(rows) + "\n"


def level(records: Array, length: int) -> Array:
    """The records without their drift, which is what changes from period to period on average."""
    if records.shape[1] == length:
        return records
    drift = (records[:, length:] - records[:, :-length]).mean(axis=1) / length
    return numpy.asarray(records - numpy.outer(drift, numpy.arange(records.shape[1])), float)


def coherent_share(rows: Complex) -> Array:
    """The share of the power that is the same in all rows."""
    power = numpy.mean(numpy.abs(rows) ** 2, axis=0)
    return numpy.asarray(numpy.abs(rows.mean(axis=0)) ** 2 / numpy.maximum(power, 1e-300), float)


def computed(
    excitation: Excitation,
    errors: ArrayLike,
    commands: ArrayLike,
    period_nm: float,
    every: int = 1,
) -> Response:
    """The response, from error and command at each tick, or at one in `every`: a row for each
    record of whole periods.

    Error and command belong to one tick, and each record begins with the first value of the
    excitation. Raises NotTuned where the command was at its limit or the axis did not respond.
    """
    error_rows, command_rows = (
        numpy.atleast_2d(numpy.asarray(rows, float)) for rows in (errors, commands)
    )
    length = len(excitation.values) // every
    if error_rows.shape != command_rows.shape or error_rows.shape[1] % length:
        raise NotTuned(
            f"{error_rows.shape[1]} errors and {command_rows.shape[1]} commands: a record has one "
            f"of each at every sample of whole periods of {length} samples"
        )
    if numpy.ptp(error_rows) == 0:
        raise NotTuned("no motion: the error did not change; is the drive on?")
    y = -excitation.spectrum(level(error_rows, length), every)
    u = excitation.spectrum(command_rows, every)
    d = excitation.spectrum(excitation.values)[0]
    count = len(y)
    mean_y, mean_u = y.mean(axis=0), u.mean(axis=0)
    plant = mean_y / mean_u
    coherence = numpy.minimum(coherent_share(y), coherent_share(u))
    residual = numpy.abs(y - plant * u) ** 2
    error = numpy.sqrt(residual.sum(axis=0) / max(count - 1, 1) / count) / numpy.abs(mean_y)
    return Response(
        excitation.hz,
        numpy.asarray(plant, complex),
        numpy.asarray(mean_u / d, complex),
        numpy.asarray(coherence, float),
        numpy.asarray(error, float),
        excitation.tick_s,
        period_nm,
        excitation.crest,
        count,
    )


def check(response: Response) -> Response:
    """The same response; raises NotCoherent where too much of it is not clear."""
    unclear = ~response.clear
    if unclear.mean() <= MOST_INCOHERENT:
        return response
    worst = response.hz[unclear]
    raise NotCoherent(
        f"the coherence is below {LEAST_COHERENCE:g} at {100 * unclear.mean():.0f} % of the "
        f"frequencies, from {worst.min():.3g} to {worst.max():.3g} Hz: use a larger peak, more "
        "records, or a slow motion that keeps friction from changing its sign"
    )


# ------------------------------------------------------------------ measurement


def in_force(axis: Axis) -> Tuning:
    """The gains and filters that an axis has; their margins are not known yet."""
    return made(*axis.tuning())


def made(gains: Mapping[str, int], filters: Sequence[Sequence[int]]) -> Tuning:
    """Gains and filters in counts, whose margins are not known yet."""
    return Tuning(
        **gains,
        filters=tuple((b0, b1, b2, a1, a2) for b0, b1, b2, a1, a2 in filters),
        bandwidth_hz=0.0,
        phase_margin_degree=0.0,
        gain_margin=0.0,
    )


def speed_nm_s(axis: Axis) -> float:
    """A speed at which the errors of sine and cosine disturb no frequency that is measured.

    They repeat with each signal period; at this speed their frequency, its double and what the
    sampling makes of them are above a quarter of the tick rate.
    """
    return SPEED_PERIODS * float(axis.period_nm) * axis.node.identity.tick_hz


def measure(
    axis: Axis,
    peak: units.Value = PEAK,
    speed: units.Number | None = None,
    records: int = RECORDS,
    low_hz: float = LOWEST_HZ,
    high_hz: float | None = None,
    progress: Callable[[int, int], object] = lambda done, records: None,
) -> Response:
    """The response of an axis, which must be enabled, homed and at rest, by some records.

    Meanwhile the axis moves to and fro at `speed` (nm/s; None: speed_nm_s(); 0: it stays), so that
    friction does not change its sign, on the side of its position where its travel has room.
    Frequencies above SPLIT_HZ are measured first. The loop suppresses what is lower than its
    bandwidth: the frequencies below SPLIT_HZ, and those of which it leaves less than
    LEAST_SENSITIVITY, are measured with smaller gains.
    The node times each record: its motion, the excitation and the recording begin there, at ticks,
    so the measurement does not depend on how fast host and connection are.
    `peak` is the largest value of the multisine, a share of full scale; `progress` gets the number
    of records done and their number. At the end the axis has its own gains and override again, and
    stands where it was. Raises NotTuned, NotRecorded, OutOfRange, Refused or MotionFailed.
    """
    tick_s = 1 / axis.node.identity.tick_hz
    high = multisine(tick_s, max(low_hz, SPLIT_HZ), high_hz, peak, PERIOD // 4)
    wished = speed_nm_s(axis) if speed is None else float(speed)
    tuning = in_force(axis)
    check_room(axis, high, wished, records)
    begin_nm = far_nm = Fraction(axis.status().target_nm)
    if wished:
        begin_nm, far_nm = ends_of_stroke(axis, stroke(axis, PERIOD, wished, APPROACH))
    motion = Motion(wished, begin_nm, far_nm >= begin_nm)
    done = 0

    def one_more() -> None:
        nonlocal done
        done += 1
        progress(done, 2 * records)

    def work() -> Response:
        response = recorded(axis, high, motion, records, one_more)
        low = low_band(response, high, low_hz, wished / float(axis.period_nm) * COUNTS)
        if low is None:
            return response
        factor = softness(response, low_hz)
        soft = lambda: softened(axis, tuning, factor)
        return joined(recorded(axis, low, motion, records, one_more, soft), response, tuning)

    response = axis.stopping_on_error(work)
    if wished:
        axis.move(nm=begin_nm)
    return check(response)


def check_room(axis: Axis, excitation: Excitation, speed_nm_s: float, records: int) -> None:
    """Raises NotTuned unless axis and node can do this, and the command has room for the peak."""
    scope, length = TickScope(axis), len(excitation.values)
    if speed_nm_s and not axis.status().homed:
        raise NotTuned(
            "the axis has no zero yet, so its travel is not known: home it first, or measure with "
            "--speed 0mm/s or --method steps"
        )
    if scope.longest(SIGNALS) < PERIODS * length:
        raise NotTuned(
            f"{PERIODS} periods of {length} ticks do not fit into the recorder of the node: it has "
            f"{scope.words()} words; ask for a shorter period"
        )
    if records < 1:
        raise NotTuned(f"{records} records are too few: at least 1")
    limit = axis.get_parameter("output_limit").counts
    largest = int(numpy.abs(excitation.values).max())
    if largest > limit // 2:
        raise NotTuned(
            f"a peak of {100 * largest / FULL_SCALE:.0f} % is more than half of the output_limit, "
            f"{100 * limit / FULL_SCALE:.0f} %: the command would be at its limit; use a smaller "
            "peak"
        )


@dataclass(frozen=True)
class Motion:
    """How an axis moves while it is measured."""

    speed_nm_s: float  # 0: not at all
    begin_nm: Fraction  # where it stands at the beginning, and at the end
    up: bool  # it moves above that place, else below it

    def ends_nm(self, stroke_nm: Fraction | int) -> list[Fraction]:
        """The lowest and the highest position of a motion of this length."""
        far_nm = self.begin_nm + (stroke_nm if self.up else -stroke_nm)
        return sorted([self.begin_nm, far_nm])


def recorded(
    axis: Axis,
    excitation: Excitation,
    motion: Motion,
    records: int,
    progress: Callable[[], object],
    soft: Callable[[], AbstractContextManager[None]] | None = None,
) -> Response:
    """The response by some records, each with a motion of its own.

    With `soft`, which makes the gains smaller, all motions go up, and the axis comes to their
    beginning from below with its own gains: then friction has its sign already, and makes no error.
    """
    scope, length = TickScope(axis), len(excitation.values)
    every = excitation.sparse
    scope.load(excitation.values)
    speed_nm_s, approach = motion.speed_nm_s, 0.0 if soft is None else APPROACH
    ends_nm = motion.ends_nm(stroke(axis, length, speed_nm_s, approach) if speed_nm_s else 0)
    errors, commands = [], []
    for number in range(records):
        trigger = Trigger(delay=SETTLING_PERIODS * length + 1)
        begin_nm, end_nm = ends_nm if soft is not None or number % 2 == 0 else ends_nm[::-1]
        if speed_nm_s:
            trigger = at_speed(axis, speed_nm_s, trigger.delay)
            axis.move(nm=begin_nm)
            if soft is not None:
                axis.move(nm=begin_nm + (end_nm - begin_nm) * Fraction(approach / (1 + approach)))
        with nullcontext() if soft is None else soft(), scope.excited(length):
            scope.start(
                SIGNALS, PERIODS * length // every, every * Fraction(excitation.tick_s), trigger
            )
            if speed_nm_s:
                with slowed(axis, speed_nm_s):
                    axis.begin_move(nm=end_nm)
                    scope.wait()
            values = scope.read().values
        status = axis.status()
        if status.faults:
            axis.reached(status)
        errors.append(values["error"])
        commands.append(values["command"])
        progress()
    limit = axis.get_parameter("output_limit").counts
    if float(numpy.mean(numpy.abs(commands) >= limit)) > SATURATED:
        raise NotTuned("the command was at its limit: use a smaller peak, or a slower motion")
    return computed(excitation, errors, commands, float(axis.period_nm), every)


def top_speed_nm_s(axis: Axis) -> float:
    """The speed of a motion at full override."""
    return axis.get_parameter("velocity").counts * float(axis.period_nm)


def stroke(axis: Axis, period: int, speed_nm_s: float, approach: float) -> Fraction:
    """The length in nm of the motion of a record with this period in ticks, and before it the
    approach, a share of it.

    It begins and ends as at full override, but slower.
    """
    velocity, acceleration, jerk = (
        axis.get_parameter(name).counts for name in ("velocity", "acceleration", "jerk")
    )
    ramps_nm = top_speed_nm_s(axis) * (velocity / acceleration + acceleration / jerk)
    lasts_s = (SETTLING_PERIODS + PERIODS) * period / axis.node.identity.tick_hz
    return Fraction(SPARE * (1 + approach) * (speed_nm_s * lasts_s + ramps_nm))


@contextmanager
def slowed(axis: Axis, speed_nm_s: float) -> Iterator[None]:
    """The axis with an override for this speed, as long as the block lasts; then it stops."""
    override = axis.override()
    axis.override(min(1.0, speed_nm_s / top_speed_nm_s(axis)))
    try:
        yield
    finally:
        axis.stop_if_enabled()
        axis.override(override)


def at_speed(axis: Axis, speed_nm_s: float, delay: int) -> Trigger:
    """So many ticks after the target of a motion has reached its speed, up or down."""
    nm_s = AT_SPEED * min(speed_nm_s, top_speed_nm_s(axis))
    return Trigger("beyond", "target_velocity", f"{nm_s * 1e-6:.9g}mm/s", delay=delay)


# low frequencies, which the loop suppresses


def crossover_hz(response: Response) -> float:
    """The lowest measured frequency at which the open loop is below 1; the highest one if none."""
    below = numpy.flatnonzero(numpy.abs(response.open_loop) < 1)
    return float(response.hz[below[0] if below.size else -1])


def softness(response: Response, low_hz: float) -> float:
    """The factor of the gains with which the loop lets this frequency through."""
    return min(1.0, SOFT_BANDWIDTH * low_hz / crossover_hz(response))


def low_band(
    response: Response, high: Excitation, low_hz: float, speed_lsb_s: float
) -> Excitation | None:
    """A multisine of the low frequencies that are not measured yet; None if there are none.

    Its peak does not stop a motion.
    """
    slow = response.hz[numpy.abs(response.sensitivity) < LEAST_SENSITIVITY]
    top_hz = max([SPLIT_HZ, *(slow * 1.02)])
    if low_hz >= top_hz:
        return None
    at = max(0, min(len(slow), len(response.hz) - 1))
    velocity = float(numpy.abs(response.plant[at]) * 2 * math.pi * response.hz[at])
    peak = float(numpy.abs(high.values).max())
    if speed_lsb_s:
        peak = min(peak, MOST_OF_THE_SPEED * speed_lsb_s / velocity)
    return multisine(high.tick_s, low_hz, top_hz, peak / FULL_SCALE, PERIOD, LOW_LINES)


@contextmanager
def softened(axis: Axis, tuning: Tuning, factor: float) -> Iterator[None]:
    """The axis with gains that make its loop slower by this factor, as long as the block lasts."""
    factors = {"kp": factor, "ki": factor**2, "kd": factor}
    try:
        for name, part in factors.items():
            axis.write_parameter(name, round(getattr(tuning, name) * part))
        yield
    finally:
        axis.stop_if_enabled()  # gains do not change during a motion
        for name in factors:
            axis.write_parameter(name, getattr(tuning, name))


def joined(low: Response, high: Response, tuning: Tuning) -> Response:
    """The response `low` of the slower loop, and above it `high`.

    The open loop of the low frequencies is the measured plant times the servo, which is known.
    """
    above = high.hz > low.hz[-1] * 1.0001
    servo = tuning.response(low.hz, low.tick_s)
    sensitivity = 1 / (1 + low.plant * servo)
    return Response(
        numpy.concatenate([low.hz, high.hz[above]]),
        numpy.concatenate([low.plant, high.plant[above]]),
        numpy.concatenate([sensitivity, high.sensitivity[above]]),
        numpy.concatenate([low.coherence, high.coherence[above]]),
        numpy.concatenate([low.error, high.error[above]]),
        high.tick_s,
        high.period_nm,
        high.crest,
        high.periods,
    )


# ------------------------------------------------------------------ model


@dataclass(frozen=True)
class MeasuredPlant(Plant):
    """A fitted plant whose response is what was measured, where it was measured clearly."""

    measured: Response | None = None

    def response(self, hz: ArrayLike) -> Complex:
        """Position over command: the model, times what was measured beyond it."""
        model = super().response(hz)
        if self.measured is None:
            return model
        clear = self.measured.clear
        at = self.measured.hz[clear]
        beyond = numpy.log(self.measured.plant[clear] / super().response(at))
        where = numpy.log(numpy.maximum(numpy.asarray(hz, float), 1e-9))
        size = numpy.interp(where, numpy.log(at), beyond.real)
        turn = numpy.interp(where, numpy.log(at), numpy.unwrap(beyond.imag))
        inside = (where >= math.log(at[0])) & (where <= math.log(at[-1]))
        return numpy.asarray(model * numpy.exp(numpy.where(inside, size + 1j * turn, 0)), complex)


def modelled(values: Array, tick_s: float, has_mode: bool) -> Plant:
    """The plant of the parameters of a fit: the logarithms of its time constant in ticks, gain,
    ticks of delay, second time constant in ticks, and of frequency and damping of the mode.
    """
    time, gain, late, second = (float(value) for value in numpy.exp(values[:4]))
    a = math.exp(-1 / max(time, 0.05))
    whole = int(late)
    mode = (float(math.exp(values[4])), float(math.exp(values[5]))) if has_mode else (None, None)
    return Plant(
        a=a,
        b=gain * (1 - a),
        delay=whole,
        tick_s=tick_s,
        resonance_hz=mode[0],
        part=late - whole,
        damping=mode[1],
        lag=math.exp(-1 / max(second, 0.05)),
    )


def fit(response: Response) -> MeasuredPlant:
    """The plant that responds as it was measured; raises NotTuned where no model does."""
    check(response)
    clear = response.clear
    hz, points = response.hz[clear], response.plant[clear]
    weight = 1 / (1 + response.error[clear] / CLEAR_ERROR)
    check_direction(-float(points[:3].imag.mean()))  # the position follows the velocity

    def misfit(values: Array, has_mode: bool) -> Array:
        with numpy.errstate(all="ignore"):
            ratio = numpy.log(modelled(values, response.tick_s, has_mode).response(hz) / points)
        turn = (ratio.imag + math.pi) % (2 * math.pi) - math.pi
        parts = numpy.concatenate([ratio.real * weight, turn * weight])
        return numpy.asarray(numpy.nan_to_num(parts, nan=1e3, posinf=1e3, neginf=-1e3), float)

    def best(starts: list[list[float]], has_mode: bool) -> tuple[Array, Array]:
        fits = [least_squares(lambda v: misfit(v, has_mode), numpy.log(start)) for start in starts]
        return min(fits, key=lambda fitted: float(fitted[1] @ fitted[1]))

    w = 2 * math.pi * hz * response.tick_s
    rigid = [
        [time, float(numpy.median(numpy.abs(points) * w * numpy.hypot(1, w * time))), late, 0.5]
        for time in (4.0, 40.0, 400.0)
        for late in (0.5, 1.5, 3.5)
    ]
    values, left = best(rigid, False)
    beyond = numpy.abs(points / modelled(values, response.tick_s, False).response(hz))
    upper = hz > hz[0] * 10
    peak_hz = float(hz[upper][beyond[upper].argmax()]) if upper.any() else float(hz[-1])
    time, gain, late, _ = numpy.exp(values)
    with_mode, left_with_mode = best(
        [
            [time, gain, max(0.3, late - second), second, peak_hz, damping]
            for second in (0.1, 1.0)
            for damping in (0.01, 0.05, 0.2)
        ],
        True,
    )
    has_mode = bool(left_with_mode @ left_with_mode < MODE_GAIN * (left @ left))
    if has_mode:
        values, left = with_mode, left_with_mode
    found = modelled(values, response.tick_s, has_mode)
    left_out = numpy.abs(found.response(hz) / points - 1) ** 2 * weight
    unexplained = float(numpy.sqrt(left_out.sum() / weight.sum()))
    if unexplained > UNEXPLAINED:
        raise NotTuned(
            f"{100 * unexplained:.0f} % of the response are not that of a motor with one "
            "resonance: measure again with a larger peak, and look at the points in the picture"
        )
    return MeasuredPlant(**{**vars(found), "unexplained": unexplained, "measured": response})
