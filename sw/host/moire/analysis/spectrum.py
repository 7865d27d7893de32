# SPDX-License-Identifier: Apache-2.0
"""The amplitude spectrum of evenly sampled values: how large the sine of each frequency in them is.

found = spectrum(record.time_s, record.error_nm)
print(found.largest)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy

from moire.errors import MoireError

WINDOW = "Hann"
FEWEST = 16  # samples


class NoSpectrum(MoireError):
    """There are too few samples."""


@dataclass(frozen=True)
class Spectrum:
    """Amplitudes (peak, not rms) in the unit of the values, by frequency from 0 to half the rate of
    the samples. The mean is left out, so that the amplitude at 0 is 0.
    """

    frequency_hz: list[float]
    amplitude: list[float]

    @property
    def largest(self) -> tuple[float, float]:
        """Frequency in Hz and amplitude of the largest line."""
        amplitude, frequency_hz = max(zip(self.amplitude, self.frequency_hz))
        return frequency_hz, amplitude


def spectrum(time_s: Sequence[float], values: Sequence[float]) -> Spectrum:
    """The spectrum of values at these times, which are evenly spaced; raises NoSpectrum.

    The Hann window (periodic) is divided by its mean, so that a sine on a line has its amplitude;
    one midway between two lines shows 85 % of it on both.
    """
    count = len(values)
    if count < FEWEST:
        raise NoSpectrum(f"{count} samples are too few for a spectrum: {FEWEST} at least")
    window = 0.5 - 0.5 * numpy.cos(2 * numpy.pi * numpy.arange(count) / count)
    taken = numpy.asarray(values, dtype=float)
    taken = taken - (window * taken).sum() / window.sum()
    amplitude = 2 * abs(numpy.fft.rfft(window * taken)) / window.sum()
    if count % 2 == 0:
        amplitude[-1] /= 2  # the line at half the rate stands for itself alone
    every_s = (time_s[-1] - time_s[0]) / (count - 1)
    return Spectrum(numpy.fft.rfftfreq(count, every_s).tolist(), amplitude.tolist())
