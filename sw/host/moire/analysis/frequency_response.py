# SPDX-License-Identifier: Apache-2.0
"""The frequency response of an axis in closed loop: plant, open loop and closed loop, from what was
recorded while a multisine was added to its commands. response_measurement.py makes the records.

The multisine has one value for each servo tick, and error and command are recorded at the same
ticks. It is periodic and the records are whole periods of it, so nothing leaks from one frequency
to another. With the excitation d, the command u = d + (command of the servo) and the position y:

    plant  G = y / u          sensitivity  S = u / d = 1 / (1 + L)
    open loop  L = 1 / S - 1  closed loop  T = 1 - S

u and y are averaged over the periods before they are divided, which leaves no bias by the noise
that the loop feeds back. Frequencies are in Hz, G is in LSB of 2^-16 period for a command of full
scale 2^15, and its phase contains the delay from a servo tick, at which the position is taken, to
the motion.
"""

import math
from dataclasses import dataclass

import numpy
from numpy.typing import ArrayLike, NDArray

from moire import units
from moire.analysis.tune import FULL_SCALE, NotTuned, Tuning
from moire.client.access import COUNTS

Array = NDArray[numpy.float64]
Complex = NDArray[numpy.complex128]

PERIOD = 4096  # ticks of the multisine of low frequencies
LINES = 140  # frequencies of it, fewer where whole periods leave fewer
LOWEST_HZ = 1.0
HIGHEST_SHARE = 0.2  # of the tick rate
PEAK = "15%"  # of full scale, of the multisine
FLATTENINGS = 300  # steps that lower its crest factor
CUTS = 0.3, 0.9  # of the peak, in the first and in the last of these steps
LEAST_COHERENCE = 0.8
MOST_INCOHERENT = 0.25  # share of the frequencies that may have less
SAMPLES_OF_A_CYCLE = 4  # of the highest frequency, at least, where fewer samples are recorded


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
