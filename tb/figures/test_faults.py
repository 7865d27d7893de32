# SPDX-License-Identifier: Apache-2.0
"""faults_run, which the figures of the signal faults are measured with, gives the faults that the
model of signal_monitor gives, whatever the length of the blocks.
"""

import numpy as np

from figures import faults, signal_faults
from tb.bench import seed
from tb.sense.signal_monitor import Settings, SignalMonitor

LANES, SAMPLES = 5, 400
SETTINGS = faults.advised(signal_faults.AMPLITUDE, no_noise_samples=20)


def course(source):
    """(sin, cos, a, b) of each sample: circles of various sizes and speeds, at rest in the end."""
    size, speed = source.uniform(30, 127, LANES), source.uniform(-1.5, 1.5, LANES)
    for n in range(SAMPLES):
        angle = speed * min(n, SAMPLES - 60)
        cos, sin = (
            np.rint(size * wave).astype(np.int64) for wave in (np.cos(angle), np.sin(angle))
        )
        sin[0] = 5 if n > 100 else sin[0]
        yield sin, cos, (cos > 0).astype(np.int64), (sin > 0) & (n % 90 < 80)


def test_the_driver_gives_the_faults_of_the_model():
    samples = list(course(np.random.default_rng(seed())))
    model = SignalMonitor(LANES)
    settings = Settings(**SETTINGS)
    right = np.array([model.sample(*map(np.asarray, sample), settings) for sample in samples])
    assert len(np.unique(right)) > 10
    for length in (1, 64, SAMPLES):
        with faults.Monitors(LANES, SETTINGS) as monitors:
            blocks = [samples[n : n + length] for n in range(0, SAMPLES, length)]
            found = np.concatenate([monitors.judge(block) for block in blocks])
        assert np.array_equal(found, right)


def test_the_length_of_a_block_changes_no_result(monkeypatch):
    short = {"speeds": (0.245, 0.15), "positions": 1}
    found = []
    for length in (64, 7):
        monkeypatch.setattr(faults, "BLOCK", length)
        found.append(faults.fault_detect_moving_pct(1, **short))
    assert found[0] == found[1]
