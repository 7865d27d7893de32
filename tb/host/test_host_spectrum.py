# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.spectrum: the amplitude of sines of known frequency."""

import math

import pytest

from moire.analysis.spectrum import FEWEST, NoSpectrum, spectrum

EVERY_S, COUNT = 1e-3, 128


def sampled(*sines, offset=0.0, count=COUNT):
    """Times from before 0 on, and the sum of sines (frequency in Hz, amplitude)."""
    times = [(n - 20) * EVERY_S for n in range(count)]
    values = [offset + sum(a * math.sin(math.tau * f * t + 0.3) for f, a in sines) for t in times]
    return times, values


@pytest.mark.parametrize("line", [3, 10, 40, 61])
def test_a_sine_on_a_line_has_its_amplitude_and_frequency(line):
    hz = line / (COUNT * EVERY_S)
    found = spectrum(*sampled((hz, 2.5), offset=1e6 + 0.5))
    assert found.largest == pytest.approx((hz, 2.5))
    assert found.amplitude[0] == pytest.approx(0, abs=1e-6)
    assert len(found.frequency_hz) == len(found.amplitude) == COUNT // 2 + 1
    assert found.frequency_hz[-1] == pytest.approx(500)


def test_a_sine_between_two_lines_shows_85_percent_on_both():
    found = spectrum(*sampled((20.5 / (COUNT * EVERY_S), 1.0)))
    assert found.amplitude[20:22] == pytest.approx([0.849, 0.849], abs=0.005)


def test_the_line_at_half_the_rate_has_its_amplitude_too():
    times, _ = sampled(count=FEWEST)
    found = spectrum(times, [3 * (-1) ** n for n in range(FEWEST)])
    assert found.largest == pytest.approx((500, 3))
    hz = 7 / (17 * EVERY_S)  # an odd number of samples has no line at half the rate
    found = spectrum(*sampled((hz, 2.5), count=17))
    assert found.largest == pytest.approx((hz, 2.5))
    assert found.amplitude[-2:] == pytest.approx([2.5, 1.25])


def test_too_few_samples_have_no_spectrum():
    with pytest.raises(NoSpectrum, match="15 samples are too few for a spectrum: 16"):
        spectrum(*sampled((100, 1), count=FEWEST - 1))
