# SPDX-License-Identifier: Apache-2.0
"""The loop of the fine stage: its measured response, the margins that gains have with it, and gains
by the rules of docs/control.md.

    plant = fine.identify(fine_steps.measure(axis))
    fine.check(plant, gains)                     # raises Unsuitable: says what to change
    gains = fine.propose(plant)
    Path("fine.png").write_bytes(fine.picture(plant, gains))

The response is position over command, in LSB of 2^-16 period per LSB of the DAC. A flexure with one
mode, a delay and some creep is fitted to the steps. Where the steps differ from that model by more
than their noise, the response is what was measured. So a second resonance counts, too.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy
from numpy.typing import ArrayLike, NDArray

from moire.analysis import report
from moire.analysis.fine_steps import Steps
from moire.analysis.least_squares import least_squares
from moire.analysis.tune import MOVED, NotTuned, Unsuitable, tick_delay
from moire.made.bus_tables import PARAMETERS

Array = NDArray[numpy.float64]
Complex = NDArray[numpy.complex128]

NAMES = ("fine_kp", "fine_ki", "fine_kd")
# |1 / (1 + open loop)| is nowhere larger: no margin of gain below 1.67, none of phase below 23
LARGEST_SENSITIVITY = 2.5
PROPOSED_SENSITIVITY = 2.3  # of the gains that are proposed
CREEP_S = (0.01, 0.1)  # time constants of the part of the response that is slow
LOWEST_HZ = 20.0  # of a mode that is looked for
SIGNIFICANT = 3.5  # standard errors by which a measured point differs from the model
POOLED = 32  # neighbours on each side, over which the error of a point is averaged
STARTS = 2  # guesses from which the model is fitted
RESONANT = 1.5  # amplification; a stage with less has no resonance that matters
UNEXPLAINED = 0.25  # of the rms of the response; more is noise, or no flexure
PADDING = 64  # of a spectrum: its points are this much closer than those of the steps
IMAGES = 2  # of the response, above and below, which the sampling folds back
RATIO_OF_GAINS = 0.45  # of a pure integrator at the resonance: loop gain, see docs/control.md
DAMPED_SHARE = 0.25  # bandwidth of a damped loop, of the resonance
DAMPED_CENTRE = 0.7  # frequency at which the derivative is set, of the resonance
DAMPED_KP = 0.07  # proportional loop gain of a damped loop
FINER = 0.9  # factor from one try of a gain to the next
TRIES = 80


@dataclass(frozen=True)
class Gains:
    """Gains of the fine stage, in counts of their registers."""

    fine_kp: int
    fine_ki: int
    fine_kd: int

    @classmethod
    def of(cls, real: Mapping[str, float]) -> "Gains":
        """The gains that are next to these real numbers; raises NotTuned if one does not fit."""
        counts = {name: round(real[name] / lsb(name)) for name in NAMES}
        for name, value in counts.items():
            if not PARAMETERS[name].min <= value <= PARAMETERS[name].max:
                raise NotTuned(f"{name} = {real[name]:.4g} does not fit its register")
        return cls(**counts)

    def counts(self, name: str) -> int:
        """One of them."""
        value: int = getattr(self, name)
        return value

    def real(self, name: str) -> float:
        """One of them as a real number."""
        return self.counts(name) * lsb(name)

    def controller(self, hz: ArrayLike, tick_s: float) -> Complex:
        """Command over error at these frequencies."""
        back = tick_delay(hz, tick_s)
        kp, ki, kd = (self.real(name) for name in NAMES)
        response: Complex = kp + ki / (1 - back) + kd * (1 - back)
        return response


def lsb(name: str) -> float:
    """What one count of a parameter is worth."""
    return float(PARAMETERS[name].lsb)


@dataclass(frozen=True)
class Flexure:
    """The fitted model: a mode behind a delay, and creep."""

    mode_gain: float  # LSB of position for one LSB of the DAC
    resonance_hz: float
    damping: float  # of critical
    delay_s: float  # from the command of the loop to the motion
    creep: tuple[float, ...]  # gains, with the time constants CREEP_S

    @property
    def gain(self) -> float:
        """The final deflection for one LSB of the DAC, LSB."""
        return self.mode_gain + sum(self.creep)

    def response(self, hz: ArrayLike) -> Complex:
        """Position over command at these frequencies."""
        frequency = numpy.asarray(hz, float)
        ratio, s = frequency / self.resonance_hz, 2j * numpy.pi * frequency
        mode = self.mode_gain / (1 - ratio**2 + 2j * self.damping * ratio)
        response: Complex = numpy.asarray(mode, complex)
        for gain, time_constant_s in zip(self.creep, CREEP_S, strict=True):
            response = response + gain / (1 + s * time_constant_s)
        return numpy.asarray(response * numpy.exp(-s * self.delay_s), complex)


@dataclass(frozen=True)
class Points:
    """The measured response at equally spaced frequencies from 0 on."""

    spacing_hz: float
    response: Complex
    error: Array  # standard error of the mean of the steps

    @property
    def hz(self) -> Array:
        """The frequencies."""
        return numpy.asarray(numpy.arange(len(self.response)) * self.spacing_hz, float)

    def at(self, hz: ArrayLike) -> tuple[Complex, Array]:
        """Response and standard error between the points."""
        where = numpy.asarray(hz, float)
        real, imaginary, error = (
            numpy.interp(where, self.hz, part)
            for part in (self.response.real, self.response.imag, self.error)
        )
        return numpy.asarray(real + 1j * imaginary, complex), numpy.asarray(error, float)


@dataclass(frozen=True)
class Plant:
    """The fine stage as it was measured."""

    model: Flexure
    points: Points
    tick_s: float
    compute_s: float  # from the servo tick to the command
    unexplained: float  # share of the rms of the steps that the model does not explain

    @property
    def delay_s(self) -> float:
        """From the servo tick, at which the position is taken, to the motion."""
        return self.compute_s + self.model.delay_s

    def response(self, hz: ArrayLike) -> Complex:
        """Position over command: the model, or what was measured where that differs from it."""
        model = self.model.response(hz)
        measured, error = self.points.at(hz)
        beyond = numpy.abs(measured - model)
        share = 1 - (SIGNIFICANT * error / numpy.maximum(beyond, 1e-300)) ** 2
        return numpy.asarray(model + (measured - model) * numpy.clip(share, 0, 1), complex)

    def sampled(self, hz: ArrayLike) -> Complex:
        """Position at a servo tick over the command of the loop, which holds for a tick."""
        total = numpy.zeros(numpy.shape(hz), complex)
        for image in range(-IMAGES, IMAGES + 1):
            at = numpy.asarray(hz, float) + image / self.tick_s
            turn = 2j * numpy.pi * at * self.tick_s
            held = numpy.where(at == 0, 1, (1 - numpy.exp(-turn)) / numpy.where(at == 0, 1, turn))
            late = numpy.exp(-2j * numpy.pi * at * self.compute_s)
            total += held * late * (self.response(at) if image == 0 else self.model.response(at))
        return total

    @cached_property
    def hz(self) -> Array:
        """Frequencies up to half the tick rate, dense around the resonance."""
        highest, centre = 0.5 / self.tick_s, self.model.resonance_hz
        width = centre * max(self.model.damping, 1e-4)
        near = centre + width * numpy.linspace(-30, 30, 1201)
        hz = numpy.concatenate([numpy.geomspace(0.1, highest, 3000), near])
        return numpy.unique(hz[(hz >= 0.1) & (hz <= highest)])

    @cached_property
    def on_grid(self) -> Complex:
        """sampled() at the frequencies `hz`."""
        return self.sampled(self.hz)

    @cached_property
    def peak(self) -> tuple[float, float]:
        """Frequency in Hz and amplification of the largest response; without a resonance those of
        the mode.
        """
        hz = self.hz[self.hz >= LOWEST_HZ]
        size = numpy.abs(self.response(hz)) / abs(self.model.gain)
        at = int(size.argmax())
        if size[at] < RESONANT:
            return self.model.resonance_hz, float(max(1.0, size[at]))
        return float(hz[at]), float(size[at])


@dataclass(frozen=True)
class Loop:
    """What gains give with a plant."""

    stable: bool
    crossover_hz: float  # the highest at which the open loop has the gain 1; 0: nowhere
    phase_margin_degree: float
    gain_margin: float
    sensitivity: float  # the largest of |1 / (1 + open loop)|
    worst_hz: float  # where it is; of an unstable loop, where it oscillates

    @property
    def good(self) -> bool:
        """Whether it is stable with the margin that this module demands."""
        return self.stable and self.sensitivity <= LARGEST_SENSITIVITY

    @property
    def words(self) -> str:
        """What is wrong with it, as a part of a sentence."""
        if not self.stable:
            return f"oscillates at {self.worst_hz:.0f} Hz"
        return (
            f"amplifies disturbances of {self.worst_hz:.0f} Hz {self.sensitivity:.1f} times, "
            f"more than {LARGEST_SENSITIVITY:g}"
        )


# ------------------------------------------------------------------ the response


def spectrum(steps: Steps) -> Points:
    """The response at frequencies up to half the rate of the positions.

    A step excites all frequencies, the low ones most. Its response is the transform of the
    differences of the positions, which end when the flexure has come to rest.
    """
    rows, samples = steps.positions.shape
    size = PADDING << (samples - 1).bit_length()
    hz = numpy.fft.rfftfreq(size, steps.interval_s)
    turn = numpy.pi * hz * steps.interval_s
    differences = numpy.diff(steps.positions, axis=1) / steps.size
    middle = numpy.exp(-1j * turn) / numpy.sinc(turn / numpy.pi)
    each = numpy.array([numpy.fft.rfft(row, size) * middle for row in differences])
    power = numpy.sum(numpy.abs(each - each.mean(axis=0)) ** 2, axis=0) / (rows - 1) / rows
    # few steps give an uncertain error: it is not below that of the neighbourhood
    error = numpy.sqrt(numpy.maximum(power, pooled(power, POOLED * PADDING)))
    return Points(float(hz[1]), each.mean(axis=0), error)


def pooled(values: Array, reach: int) -> Array:
    """The means of all values and their neighbours, `reach` on each side."""
    sums = numpy.concatenate([[0.0], numpy.cumsum(values)])
    at = numpy.arange(len(values))
    first, last = numpy.maximum(at - reach, 0), numpy.minimum(at + reach + 1, len(values))
    return numpy.asarray((sums[last] - sums[first]) / (last - first), float)


def parts(time_s: Array, resonance_hz: float, damping: float, delay_s: float) -> Array:
    """Columns whose sum is a step response: before it, the mode, creep."""
    after = numpy.maximum(time_s - delay_s, 0.0)
    natural = 2 * math.pi * resonance_hz
    root = numpy.sqrt(complex(damping**2 - 1 + 1e-12))
    low, high = natural * (-damping + root), natural * (-damping - root)
    mode = (1 + (high * numpy.exp(low * after) - low * numpy.exp(high * after)) / (low - high)).real
    creep = [-numpy.expm1(-after / time_constant_s) for time_constant_s in CREEP_S]
    return numpy.column_stack([numpy.ones_like(time_s), mode, *creep])


Values = tuple[float, float, float]  # resonance, damping, delay


def left(time_s: Array, rise: Array, values: Values) -> tuple[Array, Array]:
    """What a step response has beyond the best sum of parts(), and the weights of that sum."""
    matrix = parts(time_s, *values)
    weights, *_ = numpy.linalg.lstsq(matrix, rise, rcond=None)
    return numpy.asarray(rise - matrix @ weights, float), numpy.asarray(weights, float)


def fit(time_s: Array, rise: Array, guess: Values) -> tuple[Values, float]:
    """The values that fit best, from a guess on, and the sum of squares that is left.

    They are the least squares of Levenberg and Marquardt.
    """

    def values(logs: Array) -> Values:
        resonance_hz, damping, delay_s = map(float, numpy.exp(logs))
        return resonance_hz, damping, delay_s

    def beyond(logs: Array) -> Array:
        return left(time_s, rise, values(logs))[0]

    logs, found = least_squares(beyond, numpy.log(numpy.asarray(guess, float)))
    return values(logs), float(found @ found)


def guesses(points: Points, interval_s: float) -> Iterator[Values]:
    """Values from which a fit may begin."""
    inside = (points.hz >= LOWEST_HZ) & (points.hz <= 0.4 / interval_s)
    peak_hz = float(points.hz[inside][numpy.abs(points.response[inside]).argmax()])
    for resonance_hz in (peak_hz, max(peak_hz, 0.05 / interval_s)):
        for damping in (0.003, 0.01, 0.03, 0.1, 0.5):
            for delay_s in (interval_s, 3 * interval_s):
                yield resonance_hz, damping, delay_s


def identify(steps: Steps) -> Plant:
    """The plant that responds as in the steps; raises NotTuned where they do not show it."""
    rise = steps.positions.mean(axis=0)
    if numpy.ptp(rise) < MOVED:
        raise NotTuned(
            f"no motion: the position moved by {numpy.ptp(rise):.0f} LSB; is the amplifier of the "
            "fine stage on, and the amplitude large enough?"
        )
    rise = numpy.asarray(rise / steps.size, float)
    points = spectrum(steps)
    time_s = numpy.asarray(numpy.arange(len(rise)) * steps.interval_s, float)
    starts = sorted(
        guesses(points, steps.interval_s),
        key=lambda guess: float(numpy.sum(left(time_s, rise, guess)[0] ** 2)),
    )
    values, squares = min(
        (fit(time_s, rise, guess) for guess in starts[:STARTS]), key=lambda fitted: fitted[1]
    )
    weights = left(time_s, rise, values)[1]
    model = Flexure(float(weights[1]), *values, tuple(map(float, weights[2:])))
    settled = rise[len(rise) // 2 :].mean() - rise[0]
    unexplained = math.sqrt(squares / float(numpy.sum((rise - rise[0]) ** 2)))
    if unexplained > UNEXPLAINED:
        raise NotTuned(
            f"{100 * unexplained:.0f} % of the response are not that of a fine stage with one "
            "resonance: use a larger amplitude or more steps, and keep the machine quiet"
        )
    if settled <= 0 or model.gain <= 0:
        raise NotTuned(
            "a positive command moves the fine stage down: swap the leads of the piezo, or the "
            "direction of the grating"
        )
    return Plant(model, points, steps.tick_s, steps.compute_s, unexplained)


# ------------------------------------------------------------------ the loop


def loop(plant: Plant, gains: Gains) -> Loop:
    """What these gains give."""
    hz = plant.hz
    opened = plant.on_grid * gains.controller(hz, plant.tick_s)
    back = 1 + opened
    worst = int(numpy.abs(back).argmin())
    # Nyquist: with an integral 1 + L begins at -90 degrees; of a stable loop it ends at 0, and
    # goes round 0 not once
    angle = numpy.unwrap(numpy.angle(back))
    begins = -math.pi / 2 if gains.fine_ki else 0.0
    stable = abs(angle[0] - begins) < math.pi / 2 and abs(angle[-1]) < math.pi
    crossings = numpy.flatnonzero(numpy.diff((numpy.abs(opened) >= 1).astype(int)))
    turns = numpy.flatnonzero((numpy.diff(numpy.sign(opened.imag)) != 0) & (opened.real[:-1] < 0))
    sizes = numpy.abs(opened.real[turns])
    inside, outside = sizes[sizes < 1], turns[sizes >= 1]
    if not stable and outside.size:
        worst = int(outside[-1])
    return Loop(
        stable=bool(stable),
        crossover_hz=float(hz[crossings[-1]]) if crossings.size else 0.0,
        phase_margin_degree=float(numpy.degrees(numpy.abs(numpy.angle(-opened[crossings]))).min())
        if crossings.size
        else 180.0,
        gain_margin=float(1 / inside.max()) if inside.size else math.inf,
        sensitivity=float(1 / numpy.abs(back).min()),
        worst_hz=float(hz[worst]),
    )


def integrator(plant: Plant) -> Gains:
    """A pure integrator: its loop gain at the resonance stays well below 1."""
    peak_hz, amplification = plant.peak
    crossover = peak_hz * min(RATIO_OF_GAINS / amplification, DAMPED_SHARE)
    ki = 2 * math.pi * crossover * plant.tick_s / plant.model.gain
    return Gains.of({"fine_kp": 0.0, "fine_ki": ki, "fine_kd": 0.0})


def damped(plant: Plant) -> Gains:
    """A faster integrator, and a derivative that damps the resonance."""
    peak_hz, _ = plant.peak
    speed = 2 * math.pi * DAMPED_SHARE * peak_hz
    natural = 2 * math.pi * DAMPED_CENTRE * peak_hz
    gain = plant.model.gain
    return Gains.of(
        {
            "fine_kp": DAMPED_KP / gain,
            "fine_ki": speed * plant.tick_s / gain,
            "fine_kd": speed / natural**2 / plant.tick_s / gain,
        }
    )


def scaled(gains: Gains, share: float, names: tuple[str, ...] = NAMES) -> Gains:
    """The gains with some of them multiplied."""
    return replace(gains, **{name: int(gains.counts(name) * share) for name in names})


def first_good(
    plant: Plant, tried: Callable[[float], Gains], limit: float = PROPOSED_SENSITIVITY
) -> Gains | None:
    """The gains for the largest share from 1 down that keep this limit; None: none do."""
    for power in range(TRIES):
        gains = tried(FINER**power)
        found = loop(plant, gains)
        if found.stable and found.sensitivity <= limit:
            return gains
    return None


def propose(plant: Plant, damping: bool = False) -> Gains:
    """Gains of a pure integrator, or with a derivative that damps the mode; raises NotTuned."""
    rule = damped(plant) if damping else integrator(plant)
    gains = first_good(plant, lambda share: scaled(rule, share))
    if gains is None or gains.fine_ki == 0:
        raise NotTuned(
            f"no gains give the loop a margin: the delay of {1e3 * plant.delay_s:.2f} ms is too "
            f"long for a resonance at {plant.peak[0]:.0f} Hz"
        )
    if damping and gains.fine_ki <= integrator(plant).fine_ki:
        raise NotTuned(
            f"a derivative does not damp this resonance: at {plant.peak[0]:.0f} Hz the delay of "
            f"{1e3 * plant.delay_s:.2f} ms turns it too far; use a pure integrator"
        )
    return gains


def check(plant: Plant, gains: Gains) -> Loop:
    """What these gains give; raises Unsuitable if that is not a loop with enough margin."""
    found = loop(plant, gains)
    if found.good:
        return found
    peak_hz, amplification = plant.peak
    raise Unsuitable(
        f"with these gains the loop of the fine stage {found.words}; the stage amplifies "
        f"{amplification:.1f} times at its resonance of {peak_hz:.0f} Hz: {advice(plant, gains)}"
    )


def alone(plant: Plant, gains: Gains, name: str) -> Gains | None:
    """The gains with one of them reduced so far that they fit; None: that is not enough."""
    better = first_good(plant, lambda share: scaled(gains, share, (name,)))
    return better if better is not None and better.counts(name) else None


def advice(plant: Plant, gains: Gains) -> str:
    """Which parameter to change, and to which value: one alone if that is enough."""
    for name in ("fine_ki", "fine_kd", "fine_kp"):
        better = alone(plant, gains, name)
        if better is not None:
            return f"set {name} to {better.real(name):.6g} at most"
    try:
        better = propose(plant, damping=gains.fine_kd > 0)
    except NotTuned:
        better = propose(plant)
    values = [f"{name} to {better.real(name):.6g}" for name in NAMES]
    return f"set {', '.join(values[:-1])} and {values[-1]}"


# ------------------------------------------------------------------ the picture


def picture(plant: Plant, gains: Gains) -> bytes:
    """The measured response with the model, the open loop and the sensitivity, as PNG."""
    figure, (size, phase, loop_panel) = report.drawing(height=8.0, nrows=3, sharex=True)
    hz = plant.hz[plant.hz >= 1]
    points_hz = numpy.geomspace(1, hz[-1], 150)
    measured, error = plant.points.at(points_hz)
    seen = numpy.abs(measured) > 2 * error
    model = plant.model.response(hz)
    size.loglog(hz, abs(model), color=report.colour(0), label="model")
    size.loglog(
        points_hz[seen],
        abs(measured[seen]),
        ".",
        color=report.colour(1),
        markersize=4,
        label="measured",
    )
    size.set_ylabel("LSB per LSB of the DAC")
    phase.semilogx(hz, numpy.degrees(numpy.unwrap(numpy.angle(model))), color=report.colour(0))
    turned = numpy.degrees(numpy.angle(measured[seen] / plant.model.response(points_hz[seen])))
    straight = numpy.interp(points_hz[seen], hz, numpy.degrees(numpy.unwrap(numpy.angle(model))))
    phase.semilogx(points_hz[seen], straight + turned, ".", color=report.colour(1), markersize=4)
    phase.set_ylabel("phase / degree")
    opened = plant.sampled(hz) * gains.controller(hz, plant.tick_s)
    loop_panel.loglog(hz, abs(opened), color=report.colour(2), label="open loop")
    loop_panel.loglog(hz, abs(1 / (1 + opened)), color=report.colour(3), label="sensitivity")
    loop_panel.axhline(LARGEST_SENSITIVITY, color="#555555", linewidth=0.8, linestyle="--")
    loop_panel.axhline(1, color="#555555", linewidth=0.8)
    loop_panel.set_ylabel("gain")
    loop_panel.set_xlabel("frequency / Hz")
    report.legend(figure, size)
    loop_panel.legend(frameon=False, fontsize="small", loc="lower left")
    return report.png(figure)
