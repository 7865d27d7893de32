# SPDX-License-Identifier: Apache-2.0
"""Tests of legacy_bench: both of its paths, sample by sample, against their models in series; the
comparison of sw/figures/legacy.py depends on it.
"""

import math
import random

import cocotb
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.interpolate import arctan_table, harmonic_correction, signal_correction
from tb.interpolate.arctan_pipelined import sample
from tb.interpolate.fringe_tracker import FringeTracker
from tb.position.unwrap import Unwrap
from tb.sense.count_outlier_filter import CountOutlierFilter
from tb.sense.outlier_filter import OutlierFilter
from tb.sense.peak_offset_tracker import PeakOffsetTracker

APART, LARGEST_MOVE, SUBDIVISION = (
    30,
    40,
    160,
)  # cycles from sample to sample; counts; counts per period
IDLE = dict(
    valid=0,
    sin=0,
    cos=0,
    largest_move=LARGEST_MOVE,
    limit_counts=1,
    load=0,
    sin_offset=0,
    cos_offset=0,
    gain=0,
    quadrature_error=0,
    write=0,
    point=0,
    value=0,
    swap=0,
)


class Follower:
    """Model of the path from phases to position."""

    def __init__(self):
        self.tracker, self.unwrap = FringeTracker(), Unwrap()

    def follow(self, phase):
        step, _ = self.tracker.follow(phase)
        return self.unwrap.step(1, step, phase, 0)[1]


async def strobe(dut, **levels):
    for name, level in levels.items():
        getattr(dut, name).value = level
    await FallingEdge(dut.clk)


async def load_calibration(dut, values, table):
    await strobe(dut, load=1, **values._asdict())
    dut.load.value = 0
    for point, value in enumerate(table):
        await strobe(dut, write=1, point=point, value=value)
    await strobe(dut, write=0, swap=1)
    await strobe(dut, swap=0)


async def send(dut, sin, cos):
    """(count of S0, position) of one sample; each must appear exactly once before the next."""
    await strobe(dut, valid=1, sin=sin, cos=cos)
    dut.valid.value, found = 0, ([], [])
    for _ in range(APART - 1):
        if int(dut.legacy_done.value):
            found[0].append(dut.legacy_count.value.to_signed())
        if int(dut.done.value):
            found[1].append(dut.position.value.to_signed())
        await FallingEdge(dut.clk)
    return found


@cocotb.test()
async def both_paths_equal_their_models_in_series(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    values = signal_correction.Settings(300, -500, 63000, -2000)
    table = [round(3000 * math.sin(2 * math.tau * n / 256)) for n in range(256)]
    await load_calibration(dut, values, table)
    spikes, offset, counts = OutlierFilter(), PeakOffsetTracker(8), CountOutlierFilter(32)
    legacy, ours, where, errors = Follower(), Follower(), random.random(), []
    for n in range(600):
        where += 0.06 if n < 400 else -0.06
        sin, cos = (
            round(100 * channel(math.tau * where) + 3 + random.gauss(0, 0.7))
            for channel in (math.sin, math.cos)
        )
        if random.random() < 0.02:
            sin = random.randrange(-128, 128)  # a spike
        held = spikes.sample(sin, cos, LARGEST_MOVE, 255)[:2]
        centred = offset.sample(*held, 1)[:2]
        count = counts.follow(1, legacy.follow(arctan_table.phase_of(*centred)) * SUBDIVISION >> 16)
        phase = sample(16, *signal_correction.corrected(sin, cos, values, 8))[0]
        position = ours.follow(harmonic_correction.corrected(phase, table))
        assert await send(dut, sin, cos) == ([count], [position]), f"sample {n}: {sin}, {cos}"
        errors.append(position / 65536 - where)
    assert max(errors) - min(errors) < 1.2  # our path has stayed on its fringe


def test_legacy_bench():
    run("legacy_bench", __file__)
