# SPDX-License-Identifier: Apache-2.0
"""Pictures (PNG) of what moire.analysis.metrology computes. Lengths are in nm."""

from collections.abc import Mapping, Sequence

import numpy
from numpy.typing import ArrayLike

from moire.analysis import report
from moire.analysis.metrology import (
    SECTORS,
    Array,
    Circle,
    Positioning,
    allan_deviation,
    density,
)

ERROR = "error (target \N{MINUS SIGN} position)"


def standstill(error_nm: ArrayLike, rate_hz: float) -> bytes:
    """The spectral density and the cumulative rms of an error at standstill."""
    found = density(error_nm, rate_hz)
    figure, (spectrum, sums) = report.drawing(height=3.6, ncols=2)
    spectrum.loglog(found.frequency_hz, found.amplitude, color=report.colour(0), linewidth=1.0)
    spectrum.set_ylabel("density / nm/\N{SQUARE ROOT}Hz")
    sums.semilogx(found.frequency_hz, found.cumulative_rms, color=report.colour(1), linewidth=1.2)
    sums.set_ylabel("cumulative rms / nm")
    sums.set_ylim(bottom=0)
    for panel in (spectrum, sums):
        panel.set_xlabel("frequency / Hz")
    return report.png(figure)


def allan(error_nm: ArrayLike, rate_hz: float) -> bytes:
    """The Allan deviation of an error at standstill, beside a line of slope -1/2."""
    tau_s, deviation = allan_deviation(error_nm, rate_hz)
    figure, (panel,) = report.drawing()
    panel.loglog(tau_s, deviation, "o-", color=report.colour(0), markersize=4, label="measured")
    panel.loglog(
        tau_s,
        deviation[0] * numpy.sqrt(tau_s[0] / tau_s),
        color="#999999",
        linewidth=0.9,
        linestyle="--",
        label="white noise (slope \N{MINUS SIGN}1/2)",
    )
    panel.set_xlabel("averaging time / s")
    panel.set_ylabel("Allan deviation / nm")
    report.legend(figure, panel)
    return report.png(figure)


def positioning(test: Positioning) -> bytes:
    """A test by ISO 230-2: every error, the means of both directions, and two standard deviations
    on either side.
    """
    figure, (panel,) = report.drawing(height=3.8)
    target_mm = numpy.asarray(test.target) / 1e6
    directions = (
        ("from below", test.up, test.mean_up, test.scatter_up),
        ("from above", test.down, test.mean_down, test.scatter_down),
    )
    for number, (name, errors, mean, scatter) in enumerate(directions):
        colour = report.colour(number)
        panel.plot(target_mm, errors, ".", color=colour, markersize=4, alpha=0.6)
        panel.plot(target_mm, mean, color=colour, linewidth=1.4, label=f"{name}, mean")
        band = (mean - 2 * scatter, mean + 2 * scatter)
        panel.fill_between(target_mm, *band, color=colour, alpha=0.15)
    panel.set_xlabel("target / mm")
    panel.set_ylabel(f"{ERROR} / nm")
    report.legend(figure, panel)
    return report.png(figure)


def circles(tests: Mapping[str, Circle], unit: str = "\N{MICRO SIGN}m", factor: float = 1) -> bytes:
    """Tests of circular paths by ISO 230-4, side by side with one magnification: the radial
    deviation from the circle that fits both directions best, outside the programmed radius where
    the path is too wide. `factor` converts the unit of the tests to `unit`.
    """
    figure, panels = report.drawing(height=4.0, ncols=len(tests), subplot_kw={"polar": True})
    angle = numpy.linspace(0, 2 * numpy.pi, SECTORS + 1)
    most = factor * max(test.deviation for test in tests.values())
    for panel, (name, test) in zip(panels, tests.items(), strict=True):
        panel.plot(angle, numpy.zeros(len(angle)), color="#999999", linewidth=0.9)
        for number, (words, points) in enumerate(
            zip(("counterclockwise", "clockwise"), test.paths)
        ):
            radial = factor * test.radial(points, test.centre)
            panel.plot(
                angle + numpy.pi / SECTORS,
                numpy.append(radial, radial[0]),
                color=report.colour(number),
                linewidth=1.2,
                label=words,
            )
        panel.set_ylim(-2 * most, most)
        panel.tick_params(labelsize=7)
        panel.set_title(f"{name}\nG(b) = {factor * test.deviation:.3g} {unit}", fontsize=9)
    figure.supxlabel(f"radial deviation / {unit}", fontsize=9)
    report.legend(figure, panels[0])
    return report.png(figure)


def settling(times_s: Mapping[str, Sequence[float]], window_nm: float) -> bytes:
    """The distribution of the settling times of each axis, as the share of moves that have settled
    after a time.
    """
    figure, (panel,) = report.drawing()
    for number, (name, times) in enumerate(times_s.items()):
        ordered: Array = 1000 * numpy.sort(numpy.asarray(times, float))
        share = 100 * numpy.arange(1, len(ordered) + 1) / max(1, len(ordered))
        panel.step(ordered, share, where="post", color=report.colour(number), label=name)
    panel.set_xlabel(
        f"time from the end of the profile until the position stays within "
        f"\N{PLUS-MINUS SIGN}{window_nm:.3g} nm of its last one / ms"
    )
    panel.set_ylabel("settled moves / %")
    panel.set_xlim(left=0)
    panel.set_ylim(0, 103)
    report.legend(figure, panel)
    return report.png(figure)


def harmonic_bars(
    amplitudes: Mapping[str, ArrayLike], label: str = "amplitude / nm", logarithmic: bool = False
) -> bytes:
    """The amplitudes of the harmonics of several errors, side by side, from order 1 on."""
    from matplotlib.ticker import MaxNLocator

    figure, (panel,) = report.drawing()
    width = 0.8 / len(amplitudes)
    for number, (name, values) in enumerate(amplitudes.items()):
        heights = numpy.asarray(values, float)
        places = numpy.arange(1, len(heights) + 1) + (number + 0.5) * width - 0.4
        panel.bar(places, heights, width, color=report.colour(number), label=name)
    if logarithmic:
        panel.set_yscale("log")
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    panel.set_xlabel("order")
    panel.set_ylabel(label)
    report.legend(figure, panel)
    return report.png(figure)
