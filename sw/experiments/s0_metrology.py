# SPDX-License-Identifier: Apache-2.0
"""What a metrologist measures on an axis of S0's stage, with the true position of the model as the
reference: standstill, settling, errors within a signal period, and a test by ISO 230-2.

    axis = Metrology(stage, "X")
    axis.stand_still(seconds=1)
    axis.step(1e6)
    axis.run_iso_230_2(targets(0, 20e6, seed=1), runs=5)
    print(axis.words)

Errors are target minus true position, in nm.
"""

import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from moire.analysis import metrology, metrology_pictures
from moire.analysis.metrology import Array, Positioning

if TYPE_CHECKING:
    from experiments.s0_stage import Stage

RATE_HZ = 4000.0  # of the traces
STEPS = 16  # even; up and down by STEP_NM, and each a STEPSth of a signal period further
STEP_NM = 50_000.0
READINGS = 4  # of the encoder at each step
ORDERS = 6  # of the errors within a signal period
FINAL_S = 0.005
TARGETS = 5  # at least, by ISO 230-2
APPROACH_NM = 100_000.0  # beyond the first and the last target, before the direction changes


@dataclass
class Metrology:
    """What has been measured of one axis, which is homed and enabled."""

    stage: "Stage"
    name: str
    still_nm: Array | None = None  # errors at RATE_HZ
    settled_s: list[float] = field(default_factory=list)
    harmonics_nm: dict[str, Array] = field(default_factory=dict)
    test: Positioning | None = None

    @property
    def window_nm(self) -> float:
        """The window in which the axis counts as settled, either side."""
        axis = self.stage.axes[self.name]
        return axis.to_nm(axis.get_parameter("settle_window").counts)

    def stand_still(self, seconds: float) -> Array:
        """Lets the axis hold its position; returns its errors at RATE_HZ."""
        target_nm = float(self.stage.axes[self.name].status().target_nm)
        self.still_nm = target_nm - self.stage.watch(self.name, seconds, RATE_HZ)["true_nm"]
        return self.still_nm

    def go(self, target_nm: float) -> float:
        """Moves to a target, which begins at a sync; returns the error when the node reports the
        end. The settling time is counted from the end of the profile until the true position stays
        inside the window around the position where it ends, the mean of the last FINAL_S.
        """
        axis, bus = self.stage.axes[self.name], self.stage.bus
        machine = self.stage.machine(self.name)
        duration_s = axis.prepare(nm=target_nm)
        bus.request(axis.node.address, "start_at_sync", axes=1 << axis.number)
        machine.trace(RATE_HZ)
        bus.sync()
        end_s = bus.transport.now() + duration_s
        axis.wait(self.stage.record_while_moving(self.name))
        trace = self.stage.traced(self.name)
        after = trace["time_s"] >= end_s
        true_nm = trace["true_nm"][after]
        final_nm = true_nm[-round(FINAL_S * RATE_HZ) :].mean()
        settled = metrology.settling_time(
            trace["time_s"][after], true_nm - final_nm, self.window_nm
        )
        if settled is not None:
            self.settled_s.append(settled)
        return target_nm - self.stage.true_nm(self.name)

    def step(self, from_nm: float, label: str = "measured") -> None:
        """Makes steps up and down that end all over a signal period, and reads the encoder after
        each.
        """
        axis, period_nm = self.stage.axes[self.name], float(self.stage.axes[self.name].period_nm)
        turns, errors = [], []
        self.stage.move(self.name, from_nm)
        for number in range(1, STEPS + 1):
            target_nm = from_nm + number % 2 * STEP_NM + number * period_nm / STEPS
            self.go(target_nm)
            readings = [
                float(axis.status().position_nm) - self.stage.true_nm(self.name)
                for _ in range(READINGS)
            ]
            turns.append(target_nm / period_nm)
            errors.append(float(np.mean(readings)))
        self.harmonics_nm[label] = metrology.harmonics(turns, errors, ORDERS)

    def run_iso_230_2(self, targets_nm: Sequence[float], runs: int) -> None:
        """Approaches these targets, in rising order, so many times from below and from above."""
        up, down = [], []
        for _ in range(runs):
            self.stage.move(self.name, targets_nm[0] - APPROACH_NM)
            up.append([self.go(target) for target in targets_nm])
            self.stage.move(self.name, targets_nm[-1] + APPROACH_NM)
            down.append([self.go(target) for target in reversed(targets_nm)][::-1])
        self.test = Positioning(np.array(targets_nm), np.array(up).T, np.array(down).T)

    @property
    def words(self) -> dict[str, str]:
        """The results, by what they are."""
        words = {}
        if self.still_nm is not None:
            seconds = len(self.still_nm) / RATE_HZ
            words["standstill, rms around its mean"] = (
                f"{self.still_nm.std():.2f} nm in {seconds:g} s"
            )
        if self.settled_s:
            words[f"settling to within \N{PLUS-MINUS SIGN}{self.window_nm:.0f} nm of the end"] = (
                f"median {1000 * np.median(self.settled_s):.1f} ms, "
                f"longest of {len(self.settled_s)} {1000 * max(self.settled_s):.1f} ms"
            )
        for label, amplitudes in self.harmonics_nm.items():
            worst = int(np.argmax(amplitudes))
            words[f"largest error within a signal period, {label}"] = (
                f"{amplitudes[worst]:.2f} nm, order {worst + 1}"
            )
        if self.test is not None:
            test = self.test
            words["ISO 230-2"] = (
                f"accuracy A {test.accuracy:.1f} nm, repeatability R {test.repeatability:.1f} nm, "
                f"systematic deviation E {test.systematic:.1f} nm, "
                f"reversal B {test.reversal:.1f} nm, both directions, "
                f"{len(test.target)} targets, {np.shape(test.up)[1]} runs"
            )
        return words

    def pictures(self) -> dict[str, tuple[str, bytes]]:
        """Pictures of what has been measured: name -> (caption, PNG)."""
        axis, made = f"{self.name} axis", {}
        if self.still_nm is not None:
            made["standstill"] = (
                f"Standstill of the {axis}: amplitude spectral density of the true error, and its "
                "rms up to each frequency, without what is slower than a segment",
                metrology_pictures.standstill(self.still_nm, RATE_HZ),
            )
            made["allan"] = (
                f"Standstill of the {axis}: Allan deviation of the true error",
                metrology_pictures.allan(self.still_nm, RATE_HZ),
            )
        if self.settled_s:
            made["settling"] = (
                f"Settling of the {axis} after {len(self.settled_s)} moves",
                metrology_pictures.settling({self.name: self.settled_s}, self.window_nm),
            )
        if self.harmonics_nm:
            made["harmonics"] = (
                f"Errors of the encoder of the {axis} within a signal period, by order",
                metrology_pictures.harmonic_bars(self.harmonics_nm),
            )
        if self.test is not None:
            made["iso_230_2"] = (
                "Test by ISO 230-2, which plots position \N{MINUS SIGN} target instead: each error "
                "from below and from above, the means, and two standard deviations on either side",
                metrology_pictures.positioning(self.test),
            )
        return made


def targets(low_nm: float, high_nm: float, seed: int, count: int = TARGETS) -> list[float]:
    """Targets at equal distances along a travel, each shifted at random within a quarter of that
    distance, so that a periodic error is sampled at different phases.
    """
    source, apart = random.Random(seed), (high_nm - low_nm) / count
    middles = (low_nm + (number + 0.5) * apart for number in range(count))
    return [round(middle + source.uniform(-0.25, 0.25) * apart) for middle in middles]
