# SPDX-License-Identifier: Apache-2.0
"""Figures of the learner: the firmware's own C and the models of the corrections, on the test
signal of the field's limits.

The sub-division error is the noiseless answer of the corrected interpolator over one period, its
mean taken off: 16-bit samples of
the undisturbed signal through the integers of signal_correction, the arc tangent and
harmonic_correction.
"""

import ctypes
import random
from pathlib import Path

import numpy as np

from figures.common import Figure, bar, console
from moire.client.axis import CORRECTION
from moire.client.bus import Bus
from twin import START_S, Twin, TwinTransport
from twin.compiled import calibration as compiled
from twin.compiled.calibration import PHASES, SAMPLES, CalibrationRun
from twin.parameters import tables as parameters

ROOT = Path(__file__).resolve().parents[2]

PERIOD_NM = 800
SAMPLE_HZ = 100_000
SPEED_HZ = 600  # periods a second, +-30 %: 0.5 mm/s
FRINGES = 610
AMPLITUDE = 0.88  # of full scale: the test signal just fits
ELLIPSE_AMPLITUDE = 0.9  # the same without harmonics
ELLIPSE_AMPLITUDES = (0.6, 0.75)  # shown beside it
HARMONICS = {3: 0.01, -3: 0.006, 2: 0.004, -5: 0.003}
VIBRATION_NM = 20
VIBRATIONS_HZ = (
    0,
    20,
    35,
    50,
    87,
    120,
    190,
    230,
    310,
    450,
    530,
    600,
    700,
    900,
    1200,
    1500,
    1800,
    2000,
)  # 0: none
AMPLITUDES = (0.6, 0.75, 0.88)  # of full scale


def signal(turn, harmonics=None, offset=(-0.04, 0.05), gain=1.06, phase=np.radians(4), twist=None):
    """(cos, sin) of an amplitude of 1 at `turn` radians; offset of sin and of cos."""
    wave = np.exp(1j * turn)
    for n, (k, size) in enumerate((HARMONICS if harmonics is None else harmonics).items()):
        wave = wave + size * np.exp(1j * (k * turn + (0 if twist is None else twist[n])))
    cos, sin = wave.real, wave.imag
    return cos + offset[1], gain * (sin * np.cos(phase) + cos * np.sin(phase)) + offset[0]


def converted(cos, sin, draw, bits=8, noise=0.5, amplitude=AMPLITUDE):
    """16-bit left-aligned words of a converter, its noise in its own LSB."""
    full = 1 << bits - 1
    exact = [
        leg * amplitude * full + (draw.normal(0, noise, len(leg)) if noise else 0)
        for leg in (cos, sin)
    ]
    return [np.clip(np.rint(leg), -full, full - 1).astype(np.int64) << 16 - bits for leg in exact]


def phase_of(cos, sin, values):
    """signal_correction and a correctly rounded arc tangent, as integers."""
    u, v = cos - values["cos_offset"], sin - values["sin_offset"]
    v = np.clip(v * values["gain"] + u * values["quadrature_error"] + 65536 >> 17, -32768, 32767)
    u = np.clip(u + 1 >> 1, -32768, 32767)
    return np.rint(np.arctan2(v, u) * 65536 / (2 * np.pi)).astype(np.int64) & 65535


def corrected(phase, table):
    """harmonic_correction."""
    table = np.asarray(table, dtype=np.int64)
    here, following = table[phase >> 8], table[(phase >> 8) + 1 & 255]
    return phase - (here * 256 + (following - here) * (phase & 255) + 2048 >> 12) & 65535


def words_of(cos, sin):
    return ((cos & 65535) << 16 | sin & 65535).tolist()


def remaining_nm(values, table, curve, amplitude=AMPLITUDE):
    """Largest sub-division error left; `curve` is the undisturbed signal as a function of the turn."""
    turn = np.arange(4096) / 4096 * 2 * np.pi
    words = converted(*curve(turn), None, bits=16, noise=0, amplitude=amplitude)
    away = (corrected(phase_of(*words, values), table) / 65536 - turn / (2 * np.pi) + 0.5) % 1 - 0.5
    away = away - np.angle(np.exp(2j * np.pi * away).mean()) / (2 * np.pi)
    return np.abs((away + 0.5) % 1 - 0.5).max() * PERIOD_NM


def learn(
    seed,
    vibration_hz,
    vibration_nm=VIBRATION_NM,
    speeds=None,
    fringes=FRINGES,
    curve=None,
    spoiled=False,
    bits=8,
    amplitude=AMPLITUDE,
):
    """A machine from reset, driven back and forth until `fringes` have been recorded; (machine, nm
    left after the ellipse, fringes).
    """
    draw = np.random.default_rng(seed)
    curve = curve or (
        lambda turn, twist=draw.uniform(0, 2 * np.pi, len(HARMONICS)): signal(turn, twist=twist)
    )
    speeds = speeds or (lambda: SPEED_HZ * draw.uniform(0.7, 1.3) * draw.choice([-1, 1]))
    machine, gone, ellipse_nm = CalibrationRun(), 0.0, None
    machine.idle()
    while True:
        need, speed = machine.calibration.need, speeds()
        count = compiled.BURST if need == SAMPLES else compiled.PHASES_OF_BURST
        every = max(1, int(SAMPLE_HZ * compiled.PERIODS / count / max(abs(speed), 1)))
        time = np.arange(count) * every / SAMPLE_HZ
        push = speed * draw.uniform(-0.1, 0.1) / time[-1]  # speed changes by up to 10 % in a burst
        place = draw.uniform() + speed * time + push * time**2 / 2
        for hz in np.atleast_1d(vibration_hz):
            place += vibration_nm / PERIOD_NM * np.sin(2 * np.pi * (hz * time + draw.uniform()))
        if gone + abs(speed) * time[-1] > fringes or need not in (SAMPLES, PHASES):
            return machine, ellipse_nm, gone, curve
        gone += abs(speed) * time[-1]
        cos, sin = converted(*curve(2 * np.pi * place), draw, bits, amplitude=amplitude)
        if need == SAMPLES:
            machine.burst(words_of(cos, sin), spoiled, every)
        else:
            machine.phases(phase_of(cos, sin, machine.values).tolist(), spoiled, every)
        if ellipse_nm is None and machine.calibration.harmonics:
            ellipse_nm = remaining_nm(machine.values, machine.table, curve, amplitude)


def vector_noise_nm(bits, amplitude, noise=0.5):
    """Noise of one phase: that of a leg and of its quantisation, in the size of the circle."""
    return np.sqrt(noise**2 + 1 / 12) / (amplitude * (1 << bits - 1)) / (2 * np.pi) * PERIOD_NM


def largest_of_orders(sigma_nm, orders, share=50, trials=4000):
    """That percentile of the largest value on the circle, each order having cosine and sine of so
    much scatter.
    """
    draw, turn = np.random.default_rng(1), np.arange(256) / 256 * 2 * np.pi
    waves = np.exp(1j * np.outer(orders, turn))
    sizes = draw.normal(0, sigma_nm, (trials, len(orders))) + 1j * draw.normal(
        0, sigma_nm, (trials, len(orders))
    )
    return np.percentile(np.abs((sizes @ waves).real).max(axis=1), share)


def learning_bound_nm(amplitude):
    """Median of what the noise of the phases of a pass leaves at least (Cramer-Rao, ten orders, all
    phases of equal weight).
    """
    phases = compiled.PASS * compiled.PHASES_OF_BURST
    return largest_of_orders(
        vector_noise_nm(8, amplitude) * np.sqrt(2 / phases), np.arange(1, compiled.ORDERS + 1)
    )


def sde(settings, progress):
    """nm left by (vibration in Hz, amplitude, seed); a signal that was not learned counts with what
    the ellipse left.
    """
    left, ellipse, raw = [], [], []
    uncorrected = dict(cos_offset=0, sin_offset=0, gain=65536, quadrature_error=0)
    for hz, amplitude, seed in progress.track(settings):
        machine, ellipse_nm, _, curve = learn(
            1000 * hz + seed, hz, VIBRATION_NM if hz else 0, amplitude=amplitude
        )
        if not machine.calibration.complete:
            console.print(f"{hz} Hz, {amplitude:.0%}, seed {seed}: not learned, {machine.words()}")
        left.append(remaining_nm(machine.values, machine.table, curve, amplitude))
        ellipse.append(ellipse_nm)
        raw.append(remaining_nm(uncorrected, [0] * 256, curve, amplitude))
    return np.array(left), np.array(ellipse), np.array(raw)


def sde_nm_max():
    """From reset, 610 fringes: without vibration and with 20 nm at each frequency, three signals
    and amplitudes each.
    """
    settings = [
        (hz, amplitude, seed) for hz in VIBRATIONS_HZ for seed, amplitude in enumerate(AMPLITUDES)
    ]
    with bar("learning") as progress:
        left, ellipse, raw = sde(settings, progress)
    console.print(
        f"uncorrected {raw.max():.2f} nm, ellipse alone {ellipse.max():.2f} nm (median {np.median(ellipse):.2f}), "
        f"learned {left.max():.3f} nm (median {np.median(left):.3f})"
    )
    for n, amplitude in enumerate(AMPLITUDES):
        here = left[n :: len(AMPLITUDES)]
        console.print(
            f"amplitude {amplitude:.0%}: worst {here.max():.3f} nm, median {np.median(here):.3f}; "
            f"Cramer-Rao for the noise alone: median {learning_bound_nm(amplitude):.3f}"
        )
    by_hz = ", ".join(
        f"{hz} Hz {left[len(AMPLITUDES) * n : len(AMPLITUDES) * (n + 1)].max():.3f}"
        for n, hz in enumerate(VIBRATIONS_HZ)
    )
    console.print(f"worst by vibration: {by_hz}")
    return left.max()


def sde_soak():
    """Every 20 Hz from 20 to 2000 Hz, each amplitude."""
    settings = [
        (hz, amplitude, 100 + n)
        for hz in range(20, 2001, 20)
        for n, amplitude in enumerate(AMPLITUDES)
    ]
    with bar("learning") as progress:
        left, *_ = sde(settings, progress)
    console.print(
        f"{len(left)} signals: worst {left.max():.3f} nm at {settings[left.argmax()]}, median {np.median(left):.3f}, "
        f"above 0.1 nm: {(left > 0.1).sum()}"
    )
    return f"{left.max():.3f} nm, {(left > 0.1).sum()} of {len(left)} above 0.1", (
        left > 0.1
    ).mean() <= 0.01


HARMONICS_OF_TWIN = {
    f"harmonic_{'plus' if k > 0 else 'minus'}_{abs(k)}": size for k, size in HARMONICS.items()
}


def curve_of_twin():
    """(cos, sin) of an amplitude of 1 of the twin's interferometer, harmonics and all, as a
    function of the turn.
    """
    told = parameters.values()
    skew = np.radians(told["signal_phase_error"])

    def curve(turn):
        wave = np.exp(1j * turn) + sum(
            size * np.exp(1j * k * turn) for k, size in HARMONICS.items()
        )
        cos = (
            told["signal_gain_cos"] * (wave.real * np.cos(skew) - wave.imag * np.sin(skew))
            + told["signal_offset_cos"]
        )
        return cos, wave.imag + told["signal_offset_sin"]

    return curve


def left_in_twin_nm(correction):
    """Sub-division error of the interferometer of the twin with these values in force."""
    values, machine = (
        compiled.Values(**{name: correction[name] for name in CORRECTION}),
        CalibrationRun(),
    )
    values.cosine[:], values.sine[:] = correction["cosine"], correction["sine"]
    if not machine.call("restore", ctypes.byref(values)):
        raise ValueError(f"no correction of this firmware: {correction}")
    machine.idle()
    return remaining_nm(
        machine.values, machine.table, curve_of_twin(), parameters.values()["signal_amplitude"]
    )


def twin_sde_nm():
    """The firmware on its soft core learns the interferometer of the twin to and fro, from nothing
    to the harmonics.
    """
    left = {}  # nm by how much was accepted: nothing, the ellipse, the harmonics
    with Twin(nodes=(1,), plant=HARMONICS_OF_TWIN) as twin:
        bus = Bus(TwinTransport(twin), random_source=random.Random(1))
        bus.transport.wait(START_S)
        axis = bus.axis(1)
        axis.enable()
        axis.home()
        began = bus.transport.now()

        def look(learner):
            if learner.accepted not in left:
                left[learner.accepted] = left_in_twin_nm(axis.correction())
                console.print(
                    f"{bus.transport.now() - began:.1f} s: {learner.words}, {learner.accepted} accepted, {learner.refused} "
                    f"refused, {left[learner.accepted]:.3f} nm left"
                )

        look(axis.calibration())
        told = axis.calibrate(look)
        console.print(
            f"complete after {bus.transport.now() - began:.1f} s, known to {told.scatter_nm:.3f} nm"
        )
    return left[told.accepted]


def acquire(count, amplitude, trials):
    """nm left by an ellipse of `count` samples in each of many trials; random start, 1 to 5 turns,
    random errors.
    """
    draw, library, left = np.random.default_rng(count), compiled.library(), []
    learner = CalibrationRun().calibration
    identity = [0] * 256
    for _ in range(trials):
        setting = dict(
            harmonics={},
            offset=draw.uniform(-0.05, 0.05, 2),
            gain=1 + draw.uniform(-0.06, 0.06),
            phase=np.radians(draw.uniform(-4, 4)),
        )
        turn = 2 * np.pi * (draw.uniform() + np.arange(count) / count * draw.uniform(1, 5))
        sums, values = compiled.Ellipse(), compiled.Values.from_buffer_copy(learner.values)
        library.calibration_ellipse_start(ctypes.byref(sums))
        for word in words_of(*converted(*signal(turn, **setting), draw, amplitude=amplitude)):
            library.calibration_ellipse_take(
                ctypes.byref(sums), ctypes.byref(learner), ctypes.c_uint32(word)
            )
        reason = library.calibration_ellipse_fit(ctypes.byref(sums), ctypes.byref(values))
        left.append(
            np.inf
            if reason
            else remaining_nm(
                values.as_dict(),
                identity,
                lambda t, setting=setting: signal(t, **setting),
                amplitude,
            )
        )
    return np.array(left)


def acquired_nm_p95(count):
    """At the amplitude of the figure 1000 trials; at the others 300, to show that the error goes as
    the noise does.
    """
    told = None
    for amplitude in (ELLIPSE_AMPLITUDE, *ELLIPSE_AMPLITUDES):
        left = acquire(count, amplitude, 300 if told else 1000)
        bound = largest_of_orders(
            vector_noise_nm(8, amplitude) * np.sqrt(2 / count), np.array([1, 2]), 95
        )
        console.print(
            f"{count} samples, amplitude {amplitude:.0%}: median {np.median(left):.3f} nm, p95 {np.percentile(left, 95):.3f} nm "
            f"(Cramer-Rao {bound:.3f}), refused {np.isinf(left).sum()}"
        )
        told = told or float(np.percentile(left, 95))
    return told


def acquire_nm_p95_64():
    return acquired_nm_p95(64)


def acquire_nm_p95_1024():
    return acquired_nm_p95(1024)


FIGURES = {
    "sde_nm_max": Figure(
        sde_nm_max,
        "nm",
        "largest sub-division error of the test signal, 8-bit converter + 0.5 LSB noise, after 610 "
        "fringes with 20 nm of vibration at 20 to 2000 Hz, amplitude 60, 75 and 88 % of full scale",
        "at most 0.1 (ellipse correction alone 3.9; as printed 9)",
        lambda v: v <= 0.1,
    ),
    "acquire_nm_p95_64": Figure(
        acquire_nm_p95_64,
        "nm",
        "sub-division error after 64 samples, ellipse part, 95 of 100 trials",
        "at most 0.5",
        lambda v: v <= 0.5,
    ),
    "acquire_nm_p95_1024": Figure(
        acquire_nm_p95_1024,
        "nm",
        "sub-division error after 1024 samples, ellipse part, 95 of 100 trials",
        "at most 0.12",
        lambda v: v <= 0.12,
    ),
    "twin_sde_nm": Figure(
        twin_sde_nm,
        "nm",
        "largest sub-division error of the simulated machine (harmonics +3 1 %, -3 0.6 %, +2 0.4 %, "
        "-5 0.3 %) after its node learned it in motion, RTL and firmware",
        "at most 0.3",
        lambda v: v <= 0.3,
    ),
}

SOAK = {"sde_nm_max": sde_soak}
