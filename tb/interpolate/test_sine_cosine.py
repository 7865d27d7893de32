# SPDX-License-Identifier: Apache-2.0
"""Tests of the chain of feedback_channel.sv from ADC words to position, without any calibration,
with the signals of a grating.

Theory gives a bound on the position error for every disturbance, and every motion is checked
against it: the RTL on short motions, the models on long ones. One period is 0.8 um, as in S0.
"""

import math
from pathlib import Path

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, FallingEdge

from tables.arctan_quotient import bound as arctan_bound
from tb.bench import run, seed, start
from tb.interpolate import arctan_quotient
from tb.interpolate.fringe_tracker import FringeTracker
from tb.position.unwrap import Unwrap

PERIOD_NM = 800
LATENCY = 22  # cycles from an ADC word to its position
ARCTAN = arctan_bound()  # LSB of phase
INPUTS = dict(
    setting=0, setting_written=0, harmonic_enable=0, shift_periods=0, valid=0, sin=0, cos=0
)
OFFSETS, GAIN, LOAD, POINT, SWAP = 2, 3, 5, 6, 7  # strobes of interpolation_chain
AMPLITUDE = 0.84  # of full scale: leaves room for the disturbances
CLEAN = dict(offset=0.0, gain=0.0, phase=0.0, noise=0.0)
DISTURBED = {  # offset, gain: of the amplitude; phase: degrees; noise: of full scale
    "clean": CLEAN,
    "offset": CLEAN | dict(offset=0.01),
    "gain": CLEAN | dict(gain=0.01),
    "phase": CLEAN | dict(phase=1.0),
    "noise": CLEAN | dict(noise=0.01),
    "all": dict(offset=0.01, gain=0.01, phase=1.0, noise=0.01),
    "all the other way": dict(offset=-0.01, gain=-0.01, phase=-1.0, noise=0.01),
    "ten times all": dict(offset=0.1, gain=0.04, phase=10.0, noise=0.02),
}


def nm(radians):
    return radians / math.tau * PERIOD_NM


def offset_bound(offset, amplitude=1.0):
    """The largest rotation by a vector of this length added to one of this amplitude."""
    return math.asin(abs(offset) / amplitude)


def gain_bound(gain):
    """One channel is larger by `gain`: the error is largest near 45 degrees."""
    return math.asin(abs(gain) / (2 + gain))


def phase_bound(degrees):
    """Each channel is off by half of the phase error, one forward, one back."""
    return math.radians(abs(degrees)) / 2


def bound(w, offset, gain, phase, noise):
    """The bound in LSB of position. The disturbances act one after the other, so their bounds add;
    each one shortens the vector for the next.
    """
    full = 1 << w - 1
    length = AMPLITUDE * full * math.sqrt(1 - math.sin(math.radians(abs(phase)))) * min(1, 1 + gain)
    turn = phase_bound(phase) + gain_bound(gain)
    halved = math.sqrt(2) if w == 16 else 0  # an odd word loses its last bit in the correction
    for added in (
        AMPLITUDE * full * abs(offset),
        math.sqrt(2) * noise * full,
        math.sqrt(0.5),
        halved,
    ):  # from the third on: rounding
        turn += offset_bound(added, length)
        length -= added
    return turn / math.tau * 65536 + ARCTAN


def samples(where, w, draw, offset, gain, phase, noise):
    """ADC words at the positions `where`, in periods."""
    full = 1 << w - 1
    angle, half = math.tau * np.asarray(where), math.radians(phase) / 2
    sin = AMPLITUDE * full * (
        (1 + gain) * np.sin(angle + half) + offset
    ) + noise * full * draw.uniform(-1, 1, len(angle))
    cos = AMPLITUDE * full * np.cos(angle - half) + noise * full * draw.uniform(-1, 1, len(angle))
    words = [np.rint(channel).astype(int) for channel in (sin, cos)]
    assert all(-full <= channel.min() and channel.max() < full for channel in words)
    return list(zip(*(channel.tolist() for channel in words)))


def top_acceleration(error):
    """Largest change of speed, in periods per sample, if every phase may be wrong by `error` LSB:
    four such errors add up.
    """
    return (16384 - 4 * error - 1) / 65536


def ramp(change, most=0.99):
    """Accelerate from standstill to `most` periods per sample, brake, and return in the same
    manner.
    """
    up = np.arange(0, most, change)
    speeds = np.concatenate([up, up[::-1], -up, -up[::-1]])
    return 0.3 + np.concatenate([[0], np.cumsum(speeds)])


def motions(n, error):
    """Positions in periods, of about n samples per motion; the first lies inside period 0."""
    time = np.arange(n)
    return {
        "creep through all phases": 0.5 + time * 1.37 / n,
        "S0 top speed, 6250 fringes a second at 100 000 samples": 0.25 - time / 16,
        "ramp to almost a period a sample": ramp(1.98 / (n / 2)),
        "the hardest ramp that is followed": ramp(top_acceleration(error)),
        "reversals inside a fringe": 0.6 + 0.3 * np.sin(time * 0.7) * np.cos(time * 0.013),
        "reversals across the phase zero": 0.02 + 0.05 * np.sin(time * 1.1 + 0.1),
    }


def counts(position, subdivision):
    """The readout of S0 with any subdivision."""
    return position * subdivision >> 16


def phase_of(w, sin, cos):
    """The phase of a word that the correction does not change: both channels leave it at half the
    size.
    """
    return arctan_quotient.phase_of(*((channel << 16 - w) + 1 >> 1 for channel in (sin, cos)))


class Chain:
    """The models in series; follow() processes one sample and returns position, overspeed."""

    def __init__(self, w):
        self.w, self.tracker, self.unwrap = w, FringeTracker(), Unwrap()

    def follow(self, sin, cos):
        phase = phase_of(self.w, sin, cos)
        step, overspeed = self.tracker.follow(phase)
        return self.unwrap.step(1, step, phase, 0)[1], overspeed


async def begin(dut):
    await start(dut, **INPUTS)
    await FallingEdge(dut.clk)


async def again(dut):
    dut.rst.value = 1
    await FallingEdge(dut.clk)
    dut.rst.value = 0


async def write(dut, strobe, value=0):
    """Write a setting of the chain: its value, and its strobe in the next cycle."""
    dut.setting.value = value
    await FallingEdge(dut.clk)
    dut.setting_written.value = 1 << strobe
    await FallingEdge(dut.clk)
    dut.setting_written.value = 0


async def follow(dut, sin, cos):
    """Send one sample through the RTL; returns the position."""
    dut.valid.value, dut.sin.value, dut.cos.value = 1, sin, cos
    await FallingEdge(dut.clk)
    dut.valid.value = 0
    await ClockCycles(
        dut.clk, LATENCY, FallingEdge
    )  # the first cycle loads it into the register of the bench
    assert dut.done.value == 1
    return dut.position.value.to_signed()


@cocotb.test()
async def latency_is_22_from_an_adc_word_to_position(dut):
    await begin(dut)
    dut.valid.value, dut.sin.value, dut.cos.value = 1, 50, 0
    for cycle in range(LATENCY + 4):  # after cycle 0 the word is in the register of the bench
        await FallingEdge(dut.clk)
        dut.valid.value = 0
        assert int(dut.done.value) == (cycle == LATENCY)
    assert dut.position.value == 16384


@cocotb.test()
async def latency_is_22_with_a_correction_and_harmonics_too(dut):
    await begin(dut)
    w = int(dut.W.value)
    await write(dut, OFFSETS, 10 << 16 - w)
    await write(dut, GAIN, 1 << 15)
    await write(dut, LOAD)
    for point in range(256):
        await write(dut, POINT, point << 18 | 160)
    await write(dut, SWAP)
    dut.harmonic_enable.value = 1
    await FallingEdge(dut.clk)  # sin (90 - 10) / 2 = 40 = cos: an eighth, less 160 / 2^20 period
    assert await follow(dut, 90, 40) == 8192 - 10


@cocotb.test()
async def a_sample_every_cycle_comes_out_every_cycle(dut):
    await begin(dut)
    w, draw = int(dut.W.value), np.random.default_rng(seed())
    words, chain, positions = samples(0.4 + np.arange(80) * 0.037, w, draw, **CLEAN), Chain(w), []
    for sin, cos in words + [(0, 0)] * LATENCY:
        dut.valid.value, dut.sin.value, dut.cos.value = int(len(positions) < len(words)), sin, cos
        await FallingEdge(dut.clk)
        positions.append(dut.position.value.to_signed())
    assert positions[LATENCY:] == [chain.follow(*word)[0] for word in words]


@cocotb.test()
async def reset_in_mid_flow_leaves_no_sample_behind(dut):
    await begin(dut)
    for _ in range(LATENCY - 3):
        dut.valid.value, dut.sin.value, dut.cos.value = 1, 50, 0
        await FallingEdge(dut.clk)
    dut.valid.value = 0
    await again(dut)
    for _ in range(LATENCY + 3):
        await FallingEdge(dut.clk)
        assert (int(dut.done.value), int(dut.position.value)) == (0, 0)


@cocotb.test()
async def every_motion_stays_within_the_bound_of_every_disturbance(dut):
    await begin(dut)
    w, draw = int(dut.W.value), np.random.default_rng(seed())
    for disturbance, amounts in DISTURBED.items():
        limit = bound(w, **amounts)
        for motion, where in motions(60, limit).items():
            await again(dut)
            chain, worst = Chain(w), 0
            for true, (sin, cos) in zip(where, samples(where, w, draw, **amounts)):
                position = await follow(dut, sin, cos)
                assert (position, 0) == chain.follow(sin, cos), (disturbance, motion)
                worst = max(worst, abs(position - true * 65536))
            assert worst <= limit, f"{disturbance}, {motion}: {worst:.1f} LSB of {limit:.1f}"


@cocotb.test()
async def the_centre_of_every_count_reads_exactly(dut):
    await begin(dut)
    w, draw = int(dut.W.value), np.random.default_rng(seed())
    for subdivision in (1, 7, 160):
        await again(dut)
        steps = max(subdivision, 16)  # one sample per count, or enough for the tracker
        where = (
            np.concatenate([np.arange(steps), np.arange(steps)[::-1], -1 - np.arange(steps)]) + 0.5
        ) / steps
        for true, (sin, cos) in zip(where, samples(where, w, draw, **CLEAN)):
            assert counts(await follow(dut, sin, cos), subdivision) == math.floor(
                true * subdivision
            )


@cocotb.test()
async def a_jerk_above_the_limit_is_an_overspeed(dut):
    await begin(dut)
    w, draw = int(dut.W.value), np.random.default_rng(seed())
    limit = bound(w, **CLEAN)
    for direction in (1, -1):
        await again(dut)
        where = 0.3 + direction * np.array([0, 0, 0.25 + 4 * (limit + 1) / 65536])
        seen = []
        for sin, cos in samples(where, w, draw, **CLEAN):
            dut.valid.value, dut.sin.value, dut.cos.value = 1, sin, cos
            await FallingEdge(dut.clk)
            dut.valid.value = 0
            await ClockCycles(dut.clk, LATENCY - 1, FallingEdge)
            seen.append(int(dut.overspeed.value))
            await FallingEdge(dut.clk)
        assert seen == [0, 0, 1]


def test_the_bounds_are_those_of_theory():
    assert nm(offset_bound(0.01)) == pytest.approx(1.27, abs=0.005)
    assert nm(gain_bound(0.01)) == pytest.approx(0.63, abs=0.005)
    assert nm(phase_bound(1)) == pytest.approx(1.11, abs=0.005)


def test_eight_bits_cost_no_more_than_0_683_nm():
    angle = np.linspace(0, math.tau, 200_000, endpoint=False)
    away = [
        phase_of(8, round(127 * s), round(127 * c)) - a / math.tau * 65536
        for s, c, a in zip(np.sin(angle).tolist(), np.cos(angle).tolist(), angle.tolist())
    ]
    worst = max(abs((e + 32768) % 65536 - 32768) for e in away) / 65536 * PERIOD_NM
    assert 0.6 < worst <= 0.683
    assert worst <= nm(offset_bound(math.sqrt(0.5), 127)) + ARCTAN / 65536 * PERIOD_NM


@pytest.mark.parametrize("disturbance", DISTURBED)
def test_long_motions_stay_within_the_bound_and_come_near_to_it(disturbance):
    draw, amounts = np.random.default_rng(1), DISTURBED[disturbance]
    limit, worst = bound(8, **amounts), 0
    for motion, where in motions(4000, limit).items():
        chain = Chain(8)
        for true, (sin, cos) in zip(where, samples(where, 8, draw, **amounts)):
            position, overspeed = chain.follow(sin, cos)
            worst = max(worst, abs(position - true * 65536))
            assert not overspeed and worst <= limit, f"{motion}: {worst:.1f} LSB of {limit:.1f}"
    assert worst > 0.6 * limit


@pytest.mark.parametrize("subdivision", [1, 7, 160, 1000, 65536])
def test_the_readout_is_the_floor_of_the_true_position(subdivision):
    draw, chain, w = np.random.default_rng(1), Chain(16), 16
    where = np.concatenate([np.linspace(0.5, 3, 1500), np.linspace(3, -3, 3500)])
    away = bound(w, **CLEAN) / 65536
    for true, (sin, cos) in zip(where, samples(where, w, draw, **CLEAN)):
        read = counts(chain.follow(sin, cos)[0], subdivision)
        assert (
            math.floor((true - away) * subdivision)
            <= read
            <= math.floor((true + away) * subdivision)
        )


@pytest.mark.parametrize("w", [8, 12])
def test_sine_cosine(w, monkeypatch):
    monkeypatch.setattr(
        "tb.simulator.source_of", lambda top: Path(__file__).with_name(f"{top}.sv")
    )  # a bench top is not under rtl/
    run("interpolator_bench", __file__, W=w)
