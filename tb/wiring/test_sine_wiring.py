# SPDX-License-Identifier: Apache-2.0
"""The wires of sine and cosine in a node: converters, interpolation of the axis that has its own
chain and of the one that uses the shared one, correction, recorder and signal monitor.
"""

import math

import pytest

from tb.wiring.node import COUNT

AMPLITUDE = 100
SAMPLE = 40  # cycles
PERIOD = 1 << 16
OFF = 0xFFFF


def other(axis):
    return 1 - axis


class Scale:
    """The signals of both axes, which a test turns by phases."""

    def __init__(self, node):
        self.node, self.phase = node.start(counts=False), [0.0, 0.0]
        self.gain, self.offset = [1.0, 1.0], [(0, 0), (0, 0)]
        self.phase_error = [0.0, 0.0]  # periods by which the sine is ahead
        self.comparators = True
        for axis in (0, 1):
            node.write("feedback.harmonic_enable", 0, axis=axis)
            self.show(axis)
        node.run(20 * SAMPLE)
        for axis in (0, 1):
            node.write("axis.encoder_events", 63, axis=axis)

    def show(self, axis):
        """Signals and comparators of the phase."""
        angle = 2 * math.pi * self.phase[axis]
        ahead = angle + 2 * math.pi * self.phase_error[axis]
        sin, cos = AMPLITUDE * self.gain[axis] * math.sin(ahead), AMPLITUDE * math.cos(angle)
        x, y = self.offset[axis]
        self.node.convert(axis, *(max(min(round(v), 127), -128) for v in (sin + x, cos + y)))
        if self.comparators:
            self.node.set_bit("encoder_a", axis, int(math.cos(angle) > 0))
            self.node.set_bit("encoder_b", axis, int(math.sin(angle) > 0))

    def turn(self, axis, periods, steps=None):
        """Move by so many periods, a sample at each step."""
        steps = steps or max(round(abs(periods) * 32), 1)
        for _ in range(steps):
            self.phase[axis] += periods / steps
            self.show(axis)
            self.node.run(SAMPLE)
        self.node.run(4 * SAMPLE)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_signals_of_an_axis_move_its_position(node, axis):
    scale = Scale(node)
    begun = [node.read("axis.position", axis=n) for n in (0, 1)]
    for periods in (0.3, 1.5, -2.3):
        scale.turn(axis, periods)
        moved = node.read("axis.position", axis=axis) - begun[axis]
        assert abs(moved - scale.phase[axis] * PERIOD) < 700
        assert node.read("axis.position", axis=other(axis)) == begun[other(axis)]
        phase = node.read("axis.phase", "phase", axis)
        assert (phase - round(scale.phase[axis] * PERIOD) + 700) % PERIOD < 1400
        assert (phase - node.read("axis.position", axis=axis)) % PERIOD == 0
        assert abs(node.read("axis.phase", "amplitude", axis) - AMPLITUDE) < 8
        angle = 2 * math.pi * scale.phase[axis]
        sample = node.fields("axis.sample", axis)
        assert sample == {
            "sin": round(AMPLITUDE * math.sin(angle)),
            "cos": round(AMPLITUDE * math.cos(angle)),
        }
    assert not node.bits("axis.encoder_events", axis)
    assert not node.read("feedback.signal_faults", axis=axis)


def test_samples_come_with_their_period(node):
    scale = Scale(node)
    for axis in (0, 1):
        node.watch("adc_cs_n")
        node.run(20 * SAMPLE)
        falls = [c.cycle for c in node.changes() if not c.value >> axis & 1]
        assert {b - a for a, b in zip(falls, falls[1:])} <= {SAMPLE}
    node.write("node.sample_period", 100)
    node.run(200)
    node.watch("adc_cs_n")
    node.run(1000)
    falls = [c.cycle for c in node.changes() if c.value == 4]
    assert {b - a for a, b in zip(falls, falls[1:])} == {100}, "axis 2 has no converter"
    node.watch("adc_sclk")
    node.run(100)
    assert len(node.changes()) == 28
    assert scale.phase == [0, 0]


@pytest.mark.parametrize("axis", [0, 1])
def test_the_clock_of_a_converter_rests_high_and_a_reset_ends_a_frame(node, axis):
    Scale(node)
    node.write("node.sample_period", 100)
    node.run(300)
    node.watch("adc_cs_n", "adc_sclk")
    node.run(200)
    changes = [(c.pin, c.cycle, c.value >> axis & 1) for c in node.changes()]
    began = next(cycle for pin, cycle, level in changes if pin == "adc_cs_n" and not level)
    frame = [c for c in changes if began <= c[1] < began + 100]
    clock = [(cycle - began, level) for pin, cycle, level in frame if pin == "adc_sclk"]
    assert clock[:3] == [(1, 0), (2, 1), (3, 0)]
    assert clock[-1][1] == 1 and len(clock) == 28
    while node.get("adc_cs_n") >> axis & 1:
        node.run(1)
    node.run(3)
    node.set(rst=1)
    node.run(2)
    assert node.get("adc_cs_n") >> axis & node.get("adc_sclk") >> axis & 1


@pytest.mark.parametrize("axis", [0, 1])
def test_a_position_is_that_of_the_last_sample(node, axis):
    """Not that of the one before, which only a moving scale shows."""
    scale = Scale(node)
    period = 4000
    node.write("node.sample_period", period)
    node.run(2 * period)
    begun = node.read("axis.position", axis=axis)
    for phase in (0.1, 0.25, 0.15):
        scale.phase[axis] = phase
        scale.show(axis)
        assert node.reaches("adc_cs_n", 0, 2 * period, 1 << axis)
        node.run(100)
        moved = node.read("axis.position", axis=axis) - begun
        assert abs(moved - phase * PERIOD) < 700
        node.run(period // 2)


def test_the_age_of_a_captured_position_counts_from_its_sample(node):
    Scale(node)
    period = 500
    node.write("node.sample_period", period)
    node.write("feedback.capture_sources", 4)
    node.run(3 * period)
    ages, samples = [], []
    for _ in range(6):
        node.write("feedback.strobes", capture_now=1)
        node.run(70)
        ages.append(node.read("feedback.captured", "age"))
        samples.append((node.read("feedback.captured_time") - ages[-1]) % period)
        node.write("feedback.strobes", capture_next=1)
    assert len(set(samples)) == 1
    assert max(ages) < period and len(set(ages)) > 3


@pytest.mark.parametrize("axis", [0, 1])
def test_the_correction_of_an_axis_is_loaded_as_a_whole(node, axis):
    scale = Scale(node)
    scale.turn(axis, 0.125)
    before = node.read("axis.phase", "phase", axis)
    assert abs(before - PERIOD // 8) < 400
    sin, cos = node.read("axis.sample", "sin", axis), node.read("axis.sample", "cos", axis)
    full = 256  # offsets have 16 bits, the samples 8
    node.write("feedback.correction_offset", sin=30 * full, cos=-12 * full, axis=axis)
    node.write("feedback.correction_gain", 0x10000 * 3 // 4, axis=axis)
    node.write("feedback.correction_quadrature_error", 0x10000 // 8, axis=axis)
    node.run(4 * SAMPLE)
    assert node.read("axis.phase", "phase", axis) == before, "not loaded yet"
    node.write("feedback.strobes", load_correction=1, axis=axis)
    node.run(4 * SAMPLE)
    corrected = cos + 12, 3 / 4 * (sin - 30) + (cos + 12) / 8
    expected = math.atan2(corrected[1], corrected[0]) / (2 * math.pi) * PERIOD
    assert abs(node.read("axis.phase", "phase", axis) - expected) < 40
    assert node.read("axis.phase", "phase", other(axis)) in (0, PERIOD - 1)
    for offset, gain, error in (
        ((0, 0), 0x8000, 0),
        ((30 * full, 0), 0x10000, 0),
        ((0, 0), 0x10000, 0x2000),
    ):
        node.write("feedback.correction_offset", sin=offset[0], cos=offset[1], axis=axis)
        node.write("feedback.correction_gain", gain, axis=axis)
        node.write("feedback.correction_quadrature_error", error, axis=axis)
        node.write("feedback.strobes", load_correction=1, axis=axis)
        node.run(4 * SAMPLE)
        y = gain / 0x10000 * (sin - offset[0] / full) + error / 0x10000 * cos
        expected = math.atan2(y, cos) / (2 * math.pi) * PERIOD
        assert abs(node.read("axis.phase", "phase", axis) - expected) < 40


@pytest.mark.parametrize("axis", [0, 1])
def test_a_harmonic_table_is_used_after_the_swap_while_it_is_enabled(node, axis):
    scale = Scale(node)
    scale.turn(axis, 1 / 512)  # between the points 0 and 1: other writes have the number 0
    before = node.read("axis.phase", "phase", axis)
    for point in range(65):
        node.write("feedback.harmonic_point", value=-16 * 1000, point=point, axis=axis)
    node.write("feedback.harmonic_enable", 1, axis=axis)
    node.run(4 * SAMPLE)
    assert node.read("axis.phase", "phase", axis) == before
    node.write("feedback.strobes", swap_harmonics=1, axis=axis)
    node.run(6 * SAMPLE)
    assert abs(node.read("axis.phase", "phase", axis) - (before + 1000)) <= 1
    assert node.read("axis.position", axis=axis) % PERIOD == node.read("axis.phase", "phase", axis)
    node.write("feedback.harmonic_enable", 0, axis=axis)
    node.run(6 * SAMPLE)
    assert node.read("axis.phase", "phase", axis) == before


@pytest.mark.parametrize("axis", [0, 1])
def test_a_position_that_leaves_its_count_is_a_disagreement(node, axis):
    scale = Scale(node)
    scale.turn(axis, 1)
    node.write("axis.disagreement_limit", PERIOD // 2, axis=axis)
    node.run(4 * SAMPLE)
    scale.turn(axis, 2)
    scale.turn(other(axis), 1)
    assert not node.bits("axis.encoder_events", axis)
    scale.comparators = False
    scale.turn(axis, 2)
    assert node.bits("axis.encoder_events", axis) == {"disagreement"}
    assert not node.bits("axis.encoder_events", other(axis))
    assert node.read("feedback.signal_faults", axis=axis) >> 14 & 1
    node.write("axis.shift_origin", 0, axis=axis)
    node.write("axis.encoder_events", 63, axis=axis)
    node.run(4 * SAMPLE)
    assert not node.bits("axis.encoder_events", axis), "it has learned the count again"


@pytest.mark.parametrize("axis", [0, 1])
def test_a_jump_of_the_phase_is_an_event(node, axis):
    scale = Scale(node)
    scale.turn(axis, 0.4, steps=1)
    assert "overspeed" in node.bits("axis.encoder_events", axis)
    assert "overspeed" not in node.bits("axis.encoder_events", other(axis))
    assert node.read("feedback.first_signal_faults", axis=axis) >> 13 & 1


@pytest.mark.parametrize("axis", [0, 1])
def test_the_outlier_filter_holds_samples_back_and_counts_them(node, axis):
    scale = Scale(node)
    node.write("axis.sensing", deglitch=2, outlier_step=20, outlier_hold=2, axis=axis)
    node.write("axis.rejected_samples", 0, axis=axis)
    node.run(4 * SAMPLE)
    node.convert(axis, 60, 100)
    node.run(SAMPLE)
    scale.show(axis)
    node.run(6 * SAMPLE)
    assert node.read("axis.rejected_samples", axis=axis) == 1
    assert node.read("axis.rejected_samples", axis=other(axis)) == 0
    node.convert(axis, 60, 100)
    node.run(8 * SAMPLE)
    assert node.read("axis.rejected_samples", axis=axis) == 3
    assert node.read("axis.sample", "sin", axis) == 60, "it lasts"


@pytest.mark.parametrize("axis", [0, 1])
def test_the_recorder_stores_samples_or_phases(node, axis):
    scale = Scale(node)
    scale.turn(axis, 0.1)
    sample = node.fields("axis.sample", axis)
    phase = node.read("axis.phase", "phase", axis)
    for point in range(65):  # the phases are taken before the harmonics
        node.write("feedback.harmonic_point", value=16 * 1000, point=point, axis=axis)
    node.write("feedback.harmonic_enable", 1, axis=axis)
    node.write("feedback.strobes", swap_harmonics=1, axis=axis)
    assert not node.bits("feedback.recorder_state", axis)
    words = {}
    for phases in (0, 1):
        node.write("feedback.recorder", decimation=1, phases=phases, axis=axis)
        node.write("feedback.strobes", record=1, axis=axis)
        took = 0
        while not node.read("feedback.recorder_state", "full", axis):
            node.run(10 * SAMPLE)
            took += 10
            assert took < 3000
        assert node.bits("feedback.recorder_state", axis) == {"full"}
        assert not node.bits("feedback.recorder_state", other(axis))
        words[phases] = {node.read("feedback.recorder_word", axis=axis) for _ in range(5)}
        words[phases, "took"] = took
    assert words[0] == {(sample["sin"] & 0xFF) << 8 | (sample["cos"] & 0xFF) << 24}
    assert words[1] == {phase << 16 | phase}
    assert words[1, "took"] > 1.5 * words[0, "took"]


@pytest.mark.parametrize("axis", [0, 1])
def test_a_burst_begins_with_the_phase_of_the_next_sample(node, axis):
    scale = Scale(node)
    period = 400
    node.write("node.sample_period", period)
    node.write("feedback.recorder", decimation=1, phases=1, axis=axis)
    node.run(3 * period)
    node.watch("adc_cs_n")
    node.run(2 * period)
    converted = [c.cycle for c in node.changes() if c.value >> axis & 1][-1]
    node.run(converted + period + period // 2 - node.now)  # between two samples
    node.write("feedback.strobes", record=1, axis=axis)
    phases = []
    for _ in range(2):
        scale.phase[axis] += 0.1
        scale.show(axis)
        node.run(period)
        phases.append(node.read("axis.phase", "phase", axis))
    node.write("node.sample_period", SAMPLE)
    node.run(2100 * SAMPLE)
    assert node.read("feedback.recorder_state", "full", axis)
    assert node.read("feedback.recorder_word", axis=axis) == phases[1] << 16 | phases[0]


def test_a_burst_has_its_decimation_advances_with_each_read_and_reports_a_disturbance(node):
    scale = Scale(node)
    for axis in (0, 1):
        node.write("feedback.recorder", decimation=2, axis=axis)
        node.write("feedback.strobes", record=1, axis=axis)
        node.run(20)
        scale.turn(axis, 1.0, 64)
        scale.turn(axis, 0.4, 1)
        scale.turn(axis, 1.0, 64)
        took = 0
        while not node.read("feedback.recorder_state", "full", axis):
            node.run(10 * SAMPLE)
            took += 10
            assert took < 4000
        assert "invalid" in node.bits("feedback.recorder_state", axis)
        first = [node.read("feedback.recorder_word", axis=axis) for _ in range(20)]
        assert len(set(first)) > 15, "each read gives the next one"
        sines = [((word >> 8 & 0xFF) ^ 128) - 128 for word in first]
        step = max(abs(b - a) for a, b in zip(sines, sines[1:]))
        assert step > 1.5 * AMPLITUDE * 2 * math.pi / 64, "one sample out of two"


FAULTS = dict(
    too_low=0, too_high=1, clipped=2, off_circle=3, jump=4, channel_stuck=5, no_noise=6,
    comparator_mismatch=7, comparator_stuck=8, channel_missing=9, offset_drift=10, unbalanced=11,
    not_in_quadrature=12,
)  # fmt: skip


def limits(node, axis, **values):
    """The limits of the monitor, all others off."""
    defaults = dict(
        clip_level=OFF, tolerance=OFF, jump=OFF, no_noise=0, span=OFF, band=0, offset=OFF,
        balance=OFF, quadrature=OFF, sign=OFF, low=0, high=OFF,
    )  # fmt: skip
    v = defaults | values
    node.write("axis.amplitude_window", low=v["low"], high=v["high"], axis=axis)
    pairs = {
        "lissajous_limits": dict(clip_level=v["clip_level"], tolerance=v["tolerance"]),
        "jump_limits": dict(jump=v["jump"], no_noise_samples=v["no_noise"]),
        "channel_limits": dict(span=v["span"], band=v["band"]),
        "drift_limits": dict(offset=v["offset"], balance=v["balance"]),
        "quadrature_limits": dict(quadrature_error=v["quadrature"], sign_threshold=v["sign"]),
    }
    for name, fields in pairs.items():
        node.write(f"feedback.{name}", axis=axis, **fields)


def settle(node, axis):
    """No fault is left of what was before."""
    node.run(40 * SAMPLE)
    node.write("feedback.strobes", clear_signal_faults=1, axis=axis)
    node.run(10)
    assert node.read("feedback.first_signal_faults", axis=axis) == 0


def first(node, axis):
    """The signal faults that came first, by name."""
    value = node.read("feedback.first_signal_faults", axis=axis)
    return {name for name, bit in FAULTS.items() if value >> bit & 1}


@pytest.mark.parametrize("axis", [0, 1])
def test_the_limits_of_amplitude_clipping_and_jumps(node, axis):
    scale = Scale(node)
    scale.turn(axis, 0.1)
    for name, values, good in (
        ("too_low", dict(low=AMPLITUDE + 20), dict(low=AMPLITUDE - 20)),
        ("too_high", dict(high=AMPLITUDE - 20), dict(high=AMPLITUDE + 20)),
        ("clipped", dict(clip_level=70), dict(clip_level=90)),
        ("no_noise", dict(no_noise=8), dict(no_noise=0)),
    ):
        limits(node, axis, **good)
        settle(node, axis)
        node.run(20 * SAMPLE)
        assert first(node, axis) == set(), name
        limits(node, axis, **values)
        node.run(30 * SAMPLE)
        assert first(node, axis) == {name}
        assert first(node, other(axis)) == set()
        expected = {"too_low": {"amplitude_low"}, "too_high": {"amplitude_high"}}.get(name, set())
        assert node.bits("axis.encoder_events", axis) >= expected
        node.write("axis.encoder_events", 63, axis=axis)
        limits(node, axis)
    for jump, seen in ((60, set()), (20, {"jump"})):
        limits(node, axis, jump=jump)
        settle(node, axis)
        node.convert(axis, 59 + 40, 81)
        node.run(SAMPLE)
        scale.show(axis)
        node.run(8 * SAMPLE)
        assert first(node, axis) == seen


@pytest.mark.parametrize("axis", [0, 1])
def test_a_signal_fault_of_the_mask_stops_the_drive(node, axis):
    scale = Scale(node)
    scale.turn(axis, 0.1)
    settle(node, axis)
    node.enable(axis)
    node.write("feedback.signal_fault_mask", 1 << FAULTS["clipped"], axis=axis)
    limits(node, axis, low=AMPLITUDE + 20)
    node.run(30 * SAMPLE)
    assert node.get("drive_enable") == 1 << axis, "this one is not in the mask"
    limits(node, axis, clip_level=70)
    node.run(30 * SAMPLE)
    assert node.bits("axis.faults", axis) == {"encoder"}


@pytest.mark.parametrize("axis", [0, 1])
def test_the_limits_of_stuck_channels_and_comparators(node, axis):
    scale = Scale(node)
    limits(node, axis, sign=20)
    settle(node, axis)
    scale.turn(axis, 2)
    assert first(node, axis) == set()
    scale.comparators = False
    scale.turn(axis, 3)
    assert first(node, axis) & {"comparator_stuck", "comparator_mismatch"}
    node.set_bit("encoder_a", axis, 1)
    scale.comparators = True
    scale.turn(axis, 2)
    settle(node, axis)
    scale.comparators = False
    limits(node, axis)
    settle(node, axis)
    scale.turn(axis, 3)
    assert not first(node, axis), "the limit is off"
    for pin in ("encoder_a", "encoder_b") * 4:  # the comparators go on, the channels do not
        node.set_bit(pin, axis, 1 - (node.get(pin) >> axis & 1))
        node.run(6 * SAMPLE)
    assert first(node, axis) == {"channel_missing"}
    scale.comparators = True
    scale.turn(axis, 1)
    for span, band, seen in ((80, 3, True), (200, 3, False), (80, 0, False)):
        limits(node, axis, span=span, band=band)
        node.run(8 * SAMPLE)
        for n in range(12):
            node.convert(axis, 5 + n % 2 * 2, 50 - n % 2 * 100)
            node.run(SAMPLE)
        faults = node.read("feedback.signal_faults", axis=axis)
        assert bool(faults >> FAULTS["channel_stuck"] & 1) == seen, (span, band)
        scale.turn(axis, 1)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_limits_of_the_shape_of_the_signals(node, axis):
    """Offset, gain error and phase error are each reported by the limit of their name."""
    scale = Scale(node)
    scale.turn(axis, 4)
    none = dict(offset=15, balance=20, quadrature=20, tolerance=25)
    limits(node, axis, **none)
    settle(node, axis)
    scale.turn(axis, 3)
    assert first(node, axis) == set()
    for name, what, good, bad, only in (
        ("offset_drift", scale.offset, (0, 0), (25, 0), dict(offset=15)),
        ("unbalanced", scale.gain, 1.0, 0.6, dict(balance=20)),
        ("not_in_quadrature", scale.phase_error, 0.0, 0.08, dict(quadrature=20)),
    ):
        limits(node, axis)
        settle(node, axis)
        what[axis] = bad
        scale.turn(axis, 6)
        settle(node, axis)
        limits(node, axis, **only)
        scale.turn(axis, 2)
        assert first(node, axis) == {name}
        what[axis] = good
        limits(node, axis)
        scale.turn(axis, 6)
    settle(node, axis)
    limits(node, axis, tolerance=15)
    scale.gain[axis] = 0.94
    scale.turn(axis, 1)
    assert first(node, axis) == set(), "6 counts are allowed"
    scale.gain[axis] = 0.6
    scale.turn(axis, 1)
    assert "off_circle" in first(node, axis)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_position_made_of_counts_ends_the_faults_of_sine_and_cosine(node, axis):
    scale = Scale(node)
    settle(node, axis)
    limits(node, axis, low=50)
    node.write("axis.disagreement_limit", PERIOD // 2, axis=axis)
    scale.gain[axis] = 0.1
    scale.comparators = False
    scale.turn(axis, 2)
    found = node.read("feedback.signal_faults", axis=axis)
    assert found & 1 and found >> 14 & 1
    node.write("feedback.position_source", counts=1, axis=axis)
    node.run(4)
    assert not node.read("feedback.signal_faults", axis=axis)
    node.write("axis.encoder_events", 63, axis=axis)
    node.run(4)
    assert not node.bits("axis.encoder_events", axis)


def test_sine_and_counts_change_places_by_the_source_of_the_position(node):
    scale = Scale(node)
    for axis in (0, 1):
        node.write("feedback.position_source", counts=1, axis=axis)
        node.run(4 * SAMPLE)
        scale.turn(axis, 1)
        assert node.read("axis.position", axis=axis) % COUNT == 0
        node.write("feedback.position_source", counts=0, axis=axis)
        node.run(8 * SAMPLE)
        scale.turn(axis, 0.11)
        assert node.read("axis.position", axis=axis) % COUNT
