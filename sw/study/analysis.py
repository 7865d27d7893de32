# SPDX-License-Identifier: Apache-2.0
"""What the runs of a study say: the distribution of the positioning error, the yield, and which
effects matter.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, sqrt
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from campaigns.campaign import upper_bound
from study.runs import Outcome
from study.study_file import Study

QUANTILES = (0.5, 0.9, 0.95, 0.99)
CHANCE = 0.05  # that any of the effects that do nothing is called certain


@dataclass(frozen=True)
class Importance:
    """What one effect does. `increase_nm` is the mean of the repeats, infinite where the effect
    alone makes the machine fault, None if there are none; `correlation` is the rank correlation of
    its magnitude with the error in the Monte Carlo, None with fewer than three runs.
    """

    name: str
    increase_nm: float | None
    correlation: float | None
    certain: bool  # whether the correlation is more than chance

    @property
    def weight(self) -> tuple[float, float]:
        """By which effects are ranked: the increase alone, then the correlation."""
        increase = -inf if self.increase_nm is None else self.increase_nm
        return increase, abs(self.correlation or 0.0)


@dataclass(frozen=True)
class Findings:
    """The results of a study. Errors are the ones that the specification names: the largest of a
    run, or the rms if only that is specified."""

    study: Study
    drawn: Sequence[Outcome]  # the Monte Carlo
    baseline_nm: float | None  # error without an effect alone, mean of the repeats
    scatter_nm: float | None  # largest difference between these repeats
    ranking: Sequence[Importance]

    @property
    def errors_nm(self) -> npt.NDArray[np.float64]:
        """The error of each drawn machine, infinite if it faulted."""
        return np.array([error_of(self.study, outcome) for outcome in self.drawn])

    @property
    def good(self) -> int:
        """Number of drawn machines that keep the specification."""
        return sum(self.study.spec.met(one.largest_nm, one.rms_nm) for one in self.drawn)

    @property
    def faulted(self) -> Sequence[Outcome]:
        return [outcome for outcome in self.drawn if outcome.ended]

    @property
    def share(self) -> float:
        """The yield: the share of good machines."""
        return self.good / len(self.drawn)

    @property
    def least_share(self) -> float:
        """The yield that the counts prove with 95 % confidence (Clopper-Pearson, one side)."""
        return 1 - upper_bound(len(self.drawn) - self.good, len(self.drawn))

    def quantile(self, share: float) -> float:
        """The error that this share of the drawn machines does not exceed; one of the runs."""
        ordered = np.sort(self.errors_nm)
        return float(ordered[min(len(ordered) - 1, int(np.ceil(share * len(ordered))) - 1)])


def error_of(study: Study, outcome: Outcome) -> float:
    return outcome.rms_nm if study.spec.largest_nm is None else outcome.largest_nm


def ranks(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Ranks from 0 on; equal values have the mean of theirs."""
    _, group, counts = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    means: npt.NDArray[np.float64] = last - (counts + 1) / 2
    return means[group]


def rank_correlation(first: npt.NDArray[np.float64], second: npt.NDArray[np.float64]) -> float:
    """Spearman's coefficient; 0 if one of them is the same everywhere."""
    one, other = ranks(first), ranks(second)
    if np.ptp(one) == 0 or np.ptp(other) == 0:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def chance_correlation(study: Study, drawn: Sequence[Outcome]) -> float:
    """The rank correlation that none of the effects exceeds by chance, with 95 % confidence."""
    deviations = NormalDist().inv_cdf(1 - CHANCE / 2 / len(study.effects))
    return deviations / sqrt(len(drawn) - 1)


def increase_alone(study: Study, single: Sequence[Outcome], name: str) -> float | None:
    """Mean over the repeats of the error with this effect less that of the baseline with the same
    random numbers."""
    base = {o.run.seed: error_of(study, o) for o in single if not o.run.effect}
    found = [
        error_of(study, o) - base[o.run.seed] if isfinite(error_of(study, o)) else inf
        for o in single
        if o.run.effect == name and isfinite(base.get(o.run.seed, inf))
    ]
    return float(np.mean(found)) if found else None


def findings(study: Study, outcomes: Sequence[Outcome]) -> Findings:
    """The results of these runs, which need not be all of the study."""
    drawn = [outcome for outcome in outcomes if outcome.run.drawn]
    single = [outcome for outcome in outcomes if not outcome.run.drawn]
    base = [error_of(study, outcome) for outcome in single if not outcome.run.effect]
    errors = np.array([error_of(study, outcome) for outcome in drawn])
    ranking = []
    for effect in study.effects:
        correlation = None
        if len(drawn) > 2:
            sizes = np.array([abs(outcome.run.values[effect.name]) for outcome in drawn])
            correlation = rank_correlation(sizes, errors)
        certain = correlation is not None and abs(correlation) > chance_correlation(study, drawn)
        alone = increase_alone(study, single, effect.name)
        ranking.append(Importance(effect.name, alone, correlation, certain))
    ranking.sort(key=lambda one: one.weight, reverse=True)
    return Findings(
        study,
        drawn,
        float(np.mean(base)) if base else None,
        float(np.ptp(base)) if len(base) > 1 and all(map(isfinite, base)) else None,
        ranking,
    )
