# SPDX-License-Identifier: Apache-2.0
"""The runs of a study as parts of a campaign (docs/campaigns.md): which machine a part is, and what
its counts say.

The parts begin with those of one effect alone: for each repeat one with all effects at their
baseline and one for each effect at its bad value, all with the same random numbers. The other
parts are those of the Monte Carlo: further ones follow when more are asked for.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from math import inf

import numpy as np

from campaigns.campaign import Campaign, Counts, Result
from moire.errors import MotionFailed, NotCalibrated, Refused
from study.machines import MACHINES
from study.study_file import Study

RUNS, FAULTED, SIMULATED, ENDED = "runs", "faulted", "simulated_s", "ended"
ERROR, VALUE = "error_nm", "value"  # "error_nm 3", "value scale_linear"


@dataclass(frozen=True)
class Run:
    """One machine: which effect is tried alone ("" for none) or a draw of all of them."""

    drawn: bool
    effect: str
    seed: int  # of the machine
    values: Mapping[str, float]


def run_of(study: Study, part: int, part_seed: int) -> Run:
    """The run that a part is. The seed of the part 0 is that of the first repeat."""
    if part >= study.singles:
        shares = np.random.default_rng(part_seed).random(len(study.effects))
        values = {
            effect.name: effect.distribution.at(float(share))
            for effect, share in zip(study.effects, shares, strict=True)
        }
        return Run(True, "", part_seed, values)
    repeat, number = divmod(part, 1 + len(study.effects))
    values, name = study.baseline, ""
    if number:
        effect = study.effects[number - 1]
        name, values[effect.name] = effect.name, effect.alone
    return Run(False, name, part_seed - part + repeat, values)


def carry_out(study: Study, part: int, part_seed: int) -> Counts:
    """Runs a part. A machine that cannot home or move has faulted, which is a result, too; any
    other error, such as that of firmware which does not fit this host, leaves the part undone.
    """
    run = run_of(study, part, part_seed)
    counts: dict[str, float | str] = {RUNS: 1, FAULTED: 0}
    counts |= {f"{VALUE} {name}": value for name, value in run.values.items()}
    targets = part_seed - part
    try:
        measured = MACHINES[study.machine].run(
            {**study.fixed, **run.values}, study.measure, run.seed, targets
        )
    except (Refused, MotionFailed, NotCalibrated) as error:
        return {**counts, FAULTED: 1, ENDED: str(error)}
    counts[SIMULATED] = measured.simulated_s
    counts |= {f"{ERROR} {n}": error for n, error in enumerate(measured.errors_nm)}
    return counts


def campaign_of(study: Study) -> Campaign:
    """The campaign whose parts are the runs."""
    return Campaign(
        f"runs of the machine {study.machine}; failed: machines that could not home or move",
        partial(carry_out, study),
        study.parts,
        RUNS,
        FAULTED,
        allowed=1.0,
    )


@dataclass(frozen=True)
class Outcome:
    """What came of a run. A machine that faulted has no errors and infinite ones as summary."""

    part: int
    run: Run
    errors_nm: tuple[float, ...]
    ended: str = ""  # why it faulted
    seconds: float = 0.0
    largest_nm: float = field(init=False)
    rms_nm: float = field(init=False)

    def __post_init__(self) -> None:
        errors = np.array(self.errors_nm or (inf,))
        object.__setattr__(self, "largest_nm", float(np.abs(errors).max()))
        object.__setattr__(self, "rms_nm", float(np.sqrt((errors**2).mean())))


def outcome_of(study: Study, result: Result) -> Outcome:
    """The outcome that the counts of a part say."""
    task, counts = result.task, result.counts
    errors = tuple(
        float(counts[name])
        for n in range(study.measure.moves)
        if (name := f"{ERROR} {n}") in counts
    )
    run = run_of(study, task.part, task.part_seed)
    return Outcome(task.part, run, errors, str(counts.get(ENDED, "")), result.seconds)
