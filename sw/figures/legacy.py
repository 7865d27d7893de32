# SPDX-License-Identifier: Apache-2.0
"""S0's interpolation as its paper printed it, beside ours on the same samples: both are RTL, in one
bench.

As printed: limit filter 1, offsets by turning points, arctan by table, 160 counts a period, limit
filter 2. Ours: the values learned
by the firmware's own learner, and the path of feedback_channel.sv. A table moves over 1000 periods
near S0's top speed, which suits the
turning points best: when slow, noise makes turning points of its own, and so does every reversal.
Each reading is held against the
true place, the mean of the difference taken off.
"""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from figures.calibration import (
    AMPLITUDE,
    PERIOD_NM,
    SAMPLE_HZ,
    VIBRATION_NM,
    converted,
    learn,
    signal,
)
from figures.common import Figure, console
from twin.build import run, simulation

ROOT = Path(__file__).resolve().parents[2]
BENCH = Path(__file__).with_name("legacy_bench.sv")
DRIVER = Path(__file__).with_name("legacy_run.cpp")
SEED = 1
SUBDIVISION = 160
PERIODS = 1000
SETTLE = 4  # periods until the turning points and the limit filters have begun
FAST_HZ, SLOW_HZ = 5800, 600  # periods a second; S0's top speed is 6250
LARGEST_MOVE = (
    64  # counts of the converter in a sample, limit filter 1; the signal moves by up to 50
)
VIBRATION_HZ = 87
IDENTITY = ({"sin_offset": 0, "cos_offset": 0, "gain": 65536, "quadrature_error": 0}, [0] * 256)


def motion(speed_hz=FAST_HZ, there_and_back=False, vibration_nm=VIBRATION_NM):
    """True place in periods at each sample; there and back takes half of the way each."""
    time = np.arange(int(PERIODS / speed_hz * SAMPLE_HZ)) / SAMPLE_HZ
    way = time[-1] / 2 - np.abs(time - time[-1] / 2) if there_and_back else time
    return speed_hz * way + vibration_nm / PERIOD_NM * np.sin(2 * np.pi * VIBRATION_HZ * time)


def readings(words, learned, filters=True):
    """nm of the printed path and of ours at each sample; words (cos, sin) of 16 bits, left-aligned,
    of an 8-bit converter.
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
        told = np.array(
            run([simulation(DRIVER, BENCH), file.name], "legacy_run").split(), dtype=np.int64
        ).reshape(-1, 2)
    return (told[:, 0] + 0.5) / SUBDIVISION * PERIOD_NM, told[:, 1] / 65536 * PERIOD_NM


def errors(reading, place):
    """nm, the mean taken off: largest and rms."""
    away = (reading - place * PERIOD_NM)[int(SETTLE / SLOW_HZ * SAMPLE_HZ) :]
    away = away - away.mean()
    return np.abs(away).max(), np.sqrt((away**2).mean())


def told(what, path, error):
    console.print(f"{what:44} {path:10} largest {error[0]:6.2f} nm, rms {error[1]:5.2f} nm")


@cache
def compared():
    """(as printed, ours): largest error in nm on the test signal. Says what the printed path does
    with less and more against it.
    """
    for what, noise, phase, filters in (
        ("8 bits, a pure signal, no filters", 0, 0, False),
        ("and 0.5 LSB of noise", 0.5, 0, False),
        ("and 4 degrees of phase error", 0.5, 4, False),
        ("and both limit filters", 0.5, 4, True),
    ):
        place, pure = (
            motion(vibration_nm=0),
            dict(harmonics={}, offset=(0, 0), gain=1, phase=np.radians(phase)),
        )
        words = converted(
            *signal(2 * np.pi * place, **pure),
            np.random.default_rng(SEED),
            noise=noise,
            amplitude=1,
        )
        told(what, "as printed", errors(readings(words, IDENTITY, filters)[0], place))
    machine, _, _, curve = learn(SEED, VIBRATION_HZ)
    if not machine.calibration.complete:
        console.print(f"not learned: {machine.words()}")
    found = []
    for what, course in (
        ("the test signal, vibration, there and back", dict(there_and_back=True)),
        ("the test signal, vibration, slow", dict(speed_hz=SLOW_HZ)),
        ("the test signal, vibration, fast", {}),
    ):
        place = motion(**course)
        words = converted(
            *curve(2 * np.pi * place), np.random.default_rng(SEED), amplitude=AMPLITUDE
        )
        found = [
            errors(reading, place) for reading in readings(words, (machine.values, machine.table))
        ]
        for path, error in zip(("as printed", "ours"), found):
            told(what, path, error)
    return tuple(float(error[0]) for error in found)


def printed_nm_max():
    return compared()[0]


def corrected_nm_max():
    return compared()[1]


FIGURES = {
    "printed_nm_max": Figure(
        printed_nm_max,
        "nm",
        "largest error of one reading by S0's path as printed, test signal, 8 bits + 0.5 LSB noise",
        "more than ours",
        lambda v: v > compared()[1],
        2,
    ),
    "corrected_nm_max": Figure(
        corrected_nm_max,
        "nm",
        "ours on the same samples, both as RTL: largest error of one reading",
        "at most 3.0 (as printed, without any noise or error)",
        lambda v: v <= 3.0,
        2,
    ),
}
