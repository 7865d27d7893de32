# SPDX-License-Identifier: Apache-2.0
"""Figures of S0's interpolation as its paper describes it, beside ours on the same samples: both
are RTL, in one bench.

The paper's: outlier filter 1, offsets from the peaks, arctan by table, 160 counts per period,
outlier filter 2. Ours: the values found by the firmware's own calibration, and the path of
feedback_channel.sv. A table moves over 1000 periods near S0's highest speed, which suits the
peak detection best: at low speed noise makes peaks of its own, and so does every reversal. Each
reading is compared with the true position, the mean of the difference taken off.
"""

import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from figures.calibration import (
    AMPLITUDE,
    PERIOD_NM,
    SAMPLE_HZ,
    VIBRATION_NM,
    Array,
    calibrated,
    converted,
    reason_of,
    signal,
)
from figures.common import Figure, Quick, console
from twin.build import run, simulation

BENCH = Path(__file__).with_name("legacy_bench.sv")
DRIVER = Path(__file__).with_name("legacy_run.cpp")
SEED = 1
SUBDIVISION = 160
PERIODS = 1000
SETTLE = 4  # periods until the peak detection and the outlier filters have begun
FAST_HZ, SLOW_HZ = 5800, 600  # periods a second; S0's highest speed is 6250
LARGEST_MOVE = 64  # counts of the ADC per sample, outlier filter 1; the signal moves by up to 50
VIBRATION_HZ = 87
IDENTITY = ({"sin_offset": 0, "cos_offset": 0, "gain": 65536, "quadrature_error": 0}, [0] * 256)


def motion(
    speed_hz: float = FAST_HZ,
    there_and_back: bool = False,
    vibration_nm: float = VIBRATION_NM,
    periods: int = PERIODS,
) -> Array:
    """True position in periods at each sample; there and back takes half of the distance each."""
    time = np.arange(int(periods / speed_hz * SAMPLE_HZ)) / SAMPLE_HZ
    moved = time[-1] / 2 - np.abs(time - time[-1] / 2) if there_and_back else time
    return speed_hz * moved + vibration_nm / PERIOD_NM * np.sin(2 * np.pi * VIBRATION_HZ * time)


def readings(
    words: Sequence[Array], learned: tuple[Mapping[str, int], Sequence[int]], filters: bool = True
) -> tuple[Array, Array]:
    """nm of the paper's path and of ours at each sample; words (cos, sin) of 16 bits, left-aligned,
    of an 8-bit ADC.
    """
    values, table = learned
    head = [
        LARGEST_MOVE * filters,
        int(filters),
        *(values[name] for name in ("sin_offset", "cos_offset", "gain", "quadrature_error")),
        *table,
    ]
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        file.write(" ".join(map(str, head)) + "\n")
        np.savetxt(file, np.column_stack([words[1] >> 8, words[0] >> 8]), fmt="%d")
        file.flush()
        printed = run([simulation(DRIVER, BENCH), file.name], "legacy_run").split()
    counts, positions = np.array(printed, dtype=np.int64).reshape(-1, 2).T
    return (counts + 0.5) / SUBDIVISION * PERIOD_NM, positions / 65536 * PERIOD_NM


def errors(reading: Array, position: Array) -> tuple[float, float]:
    """nm, the mean taken off: largest and rms."""
    away = (reading - position * PERIOD_NM)[int(SETTLE / SLOW_HZ * SAMPLE_HZ) :]
    away = away - away.mean()
    return np.abs(away).max(), np.sqrt((away**2).mean())


def show(what: str, path: str, error: tuple[float, float]) -> None:
    console.print(f"{what:44} {path:10} largest {error[0]:6.2f} nm, rms {error[1]:5.2f} nm")


@cache
def compared(periods: int = PERIODS, seed: int = SEED) -> tuple[float, ...]:
    """(the paper's, ours): largest error in nm on the test signal. Prints what the paper's path
    reaches on easier signals, too.
    """
    for what, noise, phase, filters in (
        ("8 bits, a pure signal, no filters", 0, 0, False),
        ("and 0.5 LSB of noise", 0.5, 0, False),
        ("and 4 degrees of phase error", 0.5, 4, False),
        ("and both outlier filters", 0.5, 4, True),
    ):
        position = motion(vibration_nm=0, periods=periods)
        pure: dict[str, Any] = dict(harmonics={}, offset=(0, 0), gain=1, phase=np.radians(phase))
        words = converted(
            *signal(2 * np.pi * position, **pure),
            np.random.default_rng(seed),
            noise=noise,
            amplitude=1,
        )
        show(what, "the paper's", errors(readings(words, IDENTITY, filters)[0], position))
    machine, _, _, curve = calibrated(seed, VIBRATION_HZ)
    if not machine.calibration.complete:
        console.print(f"not calibrated: {reason_of(machine)}")
    found = []
    for what, course in (
        ("the test signal, vibration, there and back", dict(there_and_back=True)),
        ("the test signal, vibration, slow", dict(speed_hz=SLOW_HZ)),
        ("the test signal, vibration, fast", {}),
    ):
        position = motion(periods=periods, **course)
        words = converted(
            *curve(2 * np.pi * position), np.random.default_rng(seed), amplitude=AMPLITUDE
        )
        both = readings(words, (machine.values, machine.table))
        found = [errors(reading, position) for reading in both]
        for path, error in zip(("the paper's", "ours"), found):
            show(what, path, error)
    return tuple(float(error[0]) for error in found)


def printed_nm_max(periods: int = PERIODS, seed: int = SEED) -> float:
    return compared(periods, seed)[0]


def corrected_nm_max(periods: int = PERIODS, seed: int = SEED) -> float:
    return compared(periods, seed)[1]


FEW = Quick({"periods": 100}, "100 periods")


FIGURES = {
    "printed_nm_max": Figure(
        printed_nm_max,
        "nm",
        "largest error of one reading by S0's path as its paper describes it, on the test signal, "
        "fast, with one tone of 20 nm of vibration, 8 bits + 0.5 LSB of noise, both paths as RTL",
        "> 3",
        FEW,
        2,
        "the bound of ours",
    ),
    "corrected_nm_max": Figure(
        corrected_nm_max,
        "nm",
        "largest error of one reading by our path on the same samples",
        "<= 3",
        FEW,
        2,
        "the paper's path without any noise or error",
    ),
}
