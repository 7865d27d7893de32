# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/interpolation_chain.sv, of the models of its blocks: InterpolationChain
advances all axes by one cycle, OwnChain computes the samples of one axis without any time.
"""

from collections import deque
from typing import NamedTuple

from tb.interpolate import arctan_quotient, harmonic_correction, signal_correction
from tb.interpolate.correction_settings import CorrectionSettings
from tb.interpolate.fringe_tracker import FringeTracker
from tb.interpolate.harmonic_correction import HarmonicCorrection
from tb.interpolate.sample_arbiter import SampleArbiter
from tb.interpolate.signal_correction import Settings, SignalCorrection
from tb.position.count_phase_check import CountPhaseCheck
from tb.sense.outlier_filter import OutlierFilter


class Outputs(NamedTuple):
    """What leaves the chain after a cycle; None where its strobe is low."""

    sampled: tuple[int, int, int, int] | None  # axis, sin, cos, rejected
    plain: tuple[int, int] | None  # axis, phase
    done: tuple[int, int, int, int] | None  # axis, step, phase, overspeed
    disagreement: int
    overrun: int
    lost: int


class OneAxis:
    """Stands in for SampleArbiter: the only sample is served as it comes."""

    @staticmethod
    def served(samples):
        return (0, *samples[0][1:]) if samples[0][0] else None


class InterpolationChain:
    def __init__(self, axes, w, has_harmonics=1, sample_cycles=1):
        self.axes, self.w, self.has_harmonics = axes, w, has_harmonics
        self.sample_cycles = sample_cycles if axes == 1 else 1
        self.tables = HarmonicCorrection(axes)
        self.reset()

    def reset(self):
        self.arbiter = SampleArbiter(self.axes)
        self.settings = CorrectionSettings(self.axes)
        self.outlier = [(0, 0)] * self.axes  # step, hold
        self.limits = [0] * self.axes
        self.outliers = [OutlierFilter() for _ in range(self.axes)]
        self.correction = SignalCorrection(self.w, self.axes)
        self.arctan = arctan_quotient.ArctanQuotient(self.sample_cycles)
        self.tables.reset()
        self.trackers = [FringeTracker() for _ in range(self.axes)]
        self.check = CountPhaseCheck(self.axes)
        # what the blocks gave in the last cycle
        self.served = self.sampled = self.corrected = self.plain = self.straight = self.done = None
        self.loaded, self.overruns = None, set()
        behind = arctan_quotient.LATENCY + signal_correction.LATENCY
        self.axes_of_plain = deque([None] * (behind - 1))
        self.axes_of_straight = deque([None] * (harmonic_correction.LATENCY - 1))

    def step(self, samples, counts, axis=0, words=None, enable=0, learn=0, rst=0):
        """`samples` has (is new, sin, cos) of each axis, `words` the settings that are written for
        an axis: outlier (step, hold), limit, correction (a dictionary), load, point (point, value),
        swap.
        """
        words, several = words or {}, self.axes > 1
        served, lost = self.arbiter.step(samples) if several else (None, set())
        here = self.served if several else OneAxis.served(samples)

        sampled = None
        if here:
            n, *sample = here
            sampled = n, *self.outliers[n].sample(*sample, *self.outlier[n])

        n, *sample = self.sampled[:3] if self.sampled else (0, 0, 0)
        load_axis, values = self.loaded or (0, None)
        valid, *corrected = self.correction.step(
            self.sampled is not None, *sample, values, axis=n, load_axis=load_axis
        )
        self.axes_of_plain.append(n if self.sampled else None)
        loaded = self.settings.step(axis, words.get("correction"), words.get("load", 0))

        found, phase = self.arctan.step(self.corrected is not None, *(self.corrected or (0, 0)))
        n = self.axes_of_plain.popleft()
        plain = (n, phase) if found else None

        n, phase = self.plain or (0, 0)
        ready, phase = self.tables.step(
            self.plain is not None,
            phase,
            enable,
            words.get("point"),
            words.get("swap", 0),
            axis=n,
            table_axis=axis,
        )
        self.axes_of_straight.append(n)
        n = self.axes_of_straight.popleft()
        straight = (n, phase) if ready else None

        tracked = self.straight if self.has_harmonics else self.plain
        done = None
        if tracked:
            n, phase = tracked
            step, overspeed = self.trackers[n].follow(phase)
            done = n, step, phase, overspeed

        n, step, *_ = self.done or (0, 0)
        self.check.step(learn, self.done is not None, n, step, counts[n], self.limits[n])

        if "outlier" in words:
            self.outlier[axis] = words["outlier"]
        if "limit" in words:
            self.limits[axis] = words["limit"]
        self.served, self.sampled, self.plain, self.straight = served, sampled, plain, straight
        self.corrected, self.done, self.loaded = corrected if valid else None, done, loaded
        late, self.overruns = sum(1 << n for n in self.overruns), lost
        if rst:
            self.reset()
            late = 0
        overrun, disagreement = int(bool(self.overruns)), self.check.disagreement
        return Outputs(self.sampled, self.plain, self.done, disagreement, overrun, late)


class OwnChain:
    """The chain of one axis, sample by sample."""

    def __init__(self, w, outlier=(0, 0), settings=None, table=None):
        self.w, self.outlier, self.table = w, outlier, table
        self.settings = settings or Settings()
        self.outliers, self.tracker = OutlierFilter(), FringeTracker()

    def sample(self, sin, cos):
        """(step, phase, overspeed) of a sample."""
        sin, cos, _ = self.outliers.sample(sin, cos, *self.outlier)
        sin, cos = signal_correction.corrected(sin, cos, self.settings, self.w)
        phase = arctan_quotient.phase_of(sin, cos)
        if self.table:
            phase = harmonic_correction.corrected(phase, self.table)
        step, overspeed = self.tracker.follow(phase)
        return step, phase, overspeed
