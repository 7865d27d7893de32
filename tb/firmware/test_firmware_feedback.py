# SPDX-License-Identifier: Apache-2.0
"""The calibration of the image `axis`: it gets its bursts, its values reach the hardware
together, and the host is refused what would disturb it.
"""

import math
import random

import pytest

from tb.bench import seed
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import CLK_HZ, DEFINES, PARAMETER, PERIOD, TABLE

BLOCK = DEFINES["FEEDBACK_BASE"]
REASON = {code: name for name, (code, _) in TABLE["calibration_reason"].items()}
ACTION = {name: code for name, (code, _) in TABLE["calibration_action"].items()}
IDENTITY = dict(sin_offset=0, cos_offset=0, gain=65536, quadrature_error=0)
VALUES = dict(sin_offset=-1000, cos_offset=1234, gain=70000, quadrature_error=-3000)


def address(name, axis=0):
    return BLOCK + axis * DEFINES["FEEDBACK_STRIDE"] + DEFINES["FEEDBACK_" + name]


def speed(periods_per_second):
    return round(periods_per_second * 65536 / 4000)


class Signal:
    """Bursts of a circle beside its middle, with a second harmonic of the phase; two speeds, turn
    by turn.
    """

    def __init__(self, offset=(1000, -600), error=0.002, periods=(20, 26)):
        self.offset, self.error, self.periods, self.count = offset, error, periods, 0

    def __call__(self, phases, every):
        self.count += 1
        periods = self.periods[self.count % len(self.periods)]
        if phases:
            position = [0.123 * self.count + periods * n / 2048 for n in range(2048)]
            seen = [
                round(65536 * (p + self.error * math.sin(2 * math.tau * p))) & 65535
                for p in position
            ]
            return [later << 16 | earlier for earlier, later in zip(seen[::2], seen[1::2])]
        turn = [math.tau * periods * n / 1024 for n in range(1024)]
        legs = [
            (
                round(25000 * math.cos(t)) + self.offset[1],
                round(25000 * math.sin(t)) + self.offset[0],
            )
            for t in turn
        ]
        return [(cos & 65535) << 16 | sin & 65535 for cos, sin in legs]


def calibration(machine, action="read", axis=0):
    reported = machine.ask("calibration", axis=axis, action=ACTION[action])
    return {**reported, "reason": REASON[reported["reason"]]}


def moving(signal=None, learning=True):
    """A machine that moves at 600 periods a second."""
    machine = CompiledNode()
    machine.feedback_channels[0].burst = signal or Signal()
    machine.axes[0].speed = speed(600)
    machine.poll(30)
    if learning:
        calibration(machine, "calibrate")
    return machine


def correction(machine):
    return machine.ask("get_correction", axis=0)


# ---- from power-up


def test_at_power_up_nothing_is_corrected_or_calibrated():
    machine = moving(learning=False)
    channel = machine.feedback_channels[0]
    machine.poll(100)
    assert (
        channel.correction == IDENTITY
        and set(channel.points.values()) == {0}
        and channel.loads == 1
        and channel.records == []
    )
    assert calibration(machine) == dict(
        reason="frozen", converged=0, frozen=1, accepted=0, refused=0, scatter=0
    )
    assert correction(machine) == IDENTITY and machine.ask(
        "get_harmonic", axis=0, order=10
    ) == dict(cosine=0, sine=0)


def test_the_parameters_of_the_user_reach_the_feedback_channel():
    machine = CompiledNode()
    word = machine.feedback_channels[0].word
    assert (
        word[DEFINES["FEEDBACK_VELOCITY_QUANTUM"]] == 128
        and word[DEFINES["FEEDBACK_SIGNAL_FAULT_MASK"]] == 0
    )
    assert (
        word[DEFINES["FEEDBACK_EDGE_FILTER"]] == 0 and word[DEFINES["FEEDBACK_DECODER_MODE"]] == 0
    )
    machine.set(
        signal_clip_level=100,
        signal_tolerance=7,
        signal_jump=8,
        signal_no_noise_samples=9,
        signal_span=10,
        signal_band=11,
        signal_sign_threshold=12,
        signal_offset=13,
        signal_balance=14,
        signal_quadrature_error=15,
        signal_fault_mask=32767,
        velocity_quantum=0,
        decoder_mode=2,
    )
    for name, low, high in (
        ("LISSAJOUS", 100, 7),
        ("JUMP", 8, 9),
        ("CHANNEL", 10, 11),
        ("DRIFT", 13, 14),
        ("QUADRATURE", 15, 12),
    ):
        assert word[DEFINES[f"FEEDBACK_{name}_LIMITS"]] == low | high << 16
    assert (
        word[DEFINES["FEEDBACK_SIGNAL_FAULT_MASK"]] == 32767
        and word[DEFINES["FEEDBACK_VELOCITY_QUANTUM"]] == 0
    )
    assert word[DEFINES["FEEDBACK_DECODER_MODE"]] == 2


def test_the_deglitcher_counts_samples_at_the_set_distance():
    machine = CompiledNode()
    machine.set(
        deglitch=10_000, filter_skip=1000, filter_tolerated=3
    )  # 40 clk of 4 MHz; 4 clk left out: 5 clk a sample
    assert machine.feedback_channels[0].word[DEFINES["FEEDBACK_EDGE_FILTER"]] == 4 | 3 << 16
    assert machine.axes[0].word[DEFINES["AXIS_SENSING"]] & 0xFFFF == (40 + 4) // 5


def test_a_long_deglitch_time_takes_samples_further_apart():
    machine = CompiledNode()
    for deglitch, skip, samples in (
        (15_750, 0, 63),  # 63 clk of 4 MHz: a sample in each
        (16_000, 1, 32),
        (1_000_000, 63, 63),  # the longest one, 4000 clk
    ):
        machine.set(deglitch=deglitch)
        assert machine.feedback_channels[0].word[DEFINES["FEEDBACK_EDGE_FILTER"]] == skip
        assert machine.axes[0].word[DEFINES["AXIS_SENSING"]] & 0xFFFF == samples


# ---- the calibration


def test_an_axis_is_calibrated_in_motion_and_its_values_are_loaded_at_once():
    machine = moving()
    channel = machine.feedback_channels[0]
    for _ in range(20000):
        machine.poll()
        if channel.loads == 3:
            break
    reported, values = calibration(machine), correction(machine)
    assert (
        reported["reason"],
        reported["converged"],
        reported["accepted"],
        reported["refused"],
    ) == ("calibrating", 1, 2, 0)
    assert values["sin_offset"] == pytest.approx(1000, abs=8) and values[
        "cos_offset"
    ] == pytest.approx(-600, abs=8)
    assert channel.correction == values
    second = machine.ask("get_harmonic", axis=0, order=2)
    assert second["sine"] == pytest.approx(0.002 * 2**24, rel=0.02) and abs(second["cosine"]) < 1000
    assert channel.points[32] == pytest.approx(0.002 * 2**20, rel=0.03) and channel.points[
        96
    ] == pytest.approx(-0.002 * 2**20, rel=0.03)
    both = (
        DEFINES["FEEDBACK_STROBES_LOAD_CORRECTION_MASK"]
        | DEFINES["FEEDBACK_STROBES_SWAP_HARMONICS_MASK"]
    )
    assert {strobes & both for strobes in channel.strobes} == {0, both}
    # 2048 phases of 100 kHz at 600 periods a second are 12 periods: every one is recorded. 1024
    # samples: every second
    assert channel.records[0] == (False, 2) and set(channel.records[2:]) == {(True, 1)}

    calibration(machine, "freeze")
    records = len(channel.records)
    machine.poll(200)
    assert (
        calibration(machine)["reason"] == "frozen"
        and correction(machine) == values
        and len(channel.records) == records
    )
    calibration(machine, "clear")
    machine.poll(50)
    assert (
        channel.correction == IDENTITY
        and set(channel.points.values()) == {0}
        and calibration(machine)["converged"] == 0
    )


def test_a_slow_axis_records_fewer_samples_and_one_at_standstill_none():
    for rate, every in ((30, 48), (150, 9), (6000, 1)):
        machine = moving(learning=False)
        machine.axes[0].speed = -speed(rate)
        calibration(machine, "calibrate")
        machine.poll(5)
        assert machine.feedback_channels[0].records[0] == (False, pytest.approx(every, abs=1))
    for standing in (0, speed(10), -speed(10)):
        machine = moving(learning=False)
        machine.axes[0].speed = standing
        calibration(machine, "calibrate")
        machine.poll(50)
        assert (
            machine.feedback_channels[0].records == []
            and calibration(machine)["reason"] == "standstill"
        )
    machine.axes[0].speed = speed(600)
    machine.poll(2)
    assert calibration(machine)["reason"] == "calibrating"


def test_a_burst_is_begun_again_when_the_speed_changed_twofold():
    machine = moving(learning=False)
    channel = machine.feedback_channels[0]
    channel.delay = 10**6
    machine.axes[0].speed = speed(30)
    calibration(machine, "calibrate")
    machine.poll(3)
    machine.axes[0].speed = speed(100)
    machine.poll(3)
    assert len(channel.records) == 2 and channel.records[1][1] < channel.records[0][1] / 2
    for periods in (120, 40):  # samples may be from any speed
        machine.axes[0].speed = speed(periods)
        machine.poll(3)
        assert len(channel.records) == 2
    machine.axes[0].speed = 0
    machine.poll(3)
    assert len(channel.records) == 2 and calibration(machine)["reason"] == "standstill"


def test_a_burst_of_phases_is_begun_again_at_half_the_speed_too():
    machine = moving(learning=False)
    channel = machine.feedback_channels[0]
    machine.ask("set_correction", axis=0, apply=1, **VALUES)
    machine.poll(50)
    channel.delay = 10**6
    machine.axes[0].speed = speed(120)
    calibration(machine, "calibrate")
    machine.poll(3)
    machine.axes[0].speed = speed(40)
    machine.poll(3)
    assert [phases for phases, _ in channel.records[-2:]] == [True, True]
    assert channel.records[-1][1] > 2 * channel.records[-2][1]


def test_an_axis_that_follows_records_samples_and_leaves_the_rest_alone():
    machine = moving(learning=False)
    channel = machine.feedback_channels[0]
    machine.ask("set_correction", axis=0, apply=1, **VALUES)
    machine.poll(50)
    loads = channel.loads
    assert calibration(machine, "follow")["frozen"] == 0
    known = dict(axis=0, parameter=PARAMETER["auto_calibration"]["id"])
    assert machine.ask("get_parameter", **known)["value"] == 2
    machine.poll(400)
    assert channel.records and not any(phases for phases, _ in channel.records)
    assert calibration(machine)["reason"] == "calibrating"
    assert correction(machine) == VALUES and channel.loads >= loads
    assert calibration(machine)["converged"] == 1
    calibration(machine, "freeze")
    assert machine.ask("get_parameter", **known)["value"] == 0


def test_a_spoiled_burst_is_refused_with_its_reason():
    machine = moving(learning=False)
    machine.feedback_channels[0].spoiled = True
    calibration(machine, "calibrate")
    machine.poll(70)
    assert calibration(machine)["reason"] == "amplitude" and calibration(machine)["refused"] >= 1


def test_a_poll_takes_no_more_words_than_fit_its_time():
    machine = moving()
    machine.poll(3)
    channel = machine.feedback_channels[0]
    before = channel.taken
    machine.poll()
    assert channel.taken - before == 32
    plain = machine.read

    def read(offset):  # a word takes 0.4 ms
        machine.clk += CLK_HZ // 2500 * (offset == address("RECORDER_WORD"))
        return plain(offset)

    machine.answers = type(machine.answers[0])(read), machine.answers[1]
    machine.firmware.register_bridge(*machine.answers)
    before = channel.taken
    machine.poll()
    assert channel.taken - before == 3


def test_nothing_is_calibrated_while_an_axis_homes():
    machine = CompiledNode(Axis(low=-(10**7)), Axis())
    machine.feedback_channels[1].burst = Signal()
    machine.axes[1].speed = speed(600)
    machine.poll(100)
    machine.ask("enable", axis=0, on=1)
    machine.ask("home", axis=0)
    calibration(machine, "calibrate", axis=1)
    machine.poll(50)
    assert machine.status(0)["state"] == "homing" and machine.feedback_channels[1].records == []


# ---- values stored and restored


def test_stored_values_come_into_force_together():
    machine = moving(learning=False)
    channel = machine.feedback_channels[0]
    machine.ask("set_harmonic", axis=0, order=3, cosine=5008, sine=-7000)
    machine.ask("set_correction", axis=0, apply=0, **VALUES)
    machine.poll(50)
    assert channel.loads == 1 and correction(machine) == IDENTITY
    machine.ask("set_correction", axis=0, apply=1, **VALUES)
    machine.poll(50)
    assert channel.loads == 2 and channel.correction == VALUES == correction(machine)
    assert machine.ask("get_harmonic", axis=0, order=3) == dict(cosine=5008, sine=-7000)
    assert channel.points[0] == 313 and calibration(machine)["converged"] == 1
    machine.ask(
        "set_correction", axis=0, apply=1, **VALUES
    )  # harmonics are those set since the last time: none
    machine.poll(50)
    assert machine.ask("get_harmonic", axis=0, order=3) == dict(cosine=0, sine=0) and set(
        channel.points.values()
    ) == {0}


@pytest.mark.parametrize(
    "name, values",
    [
        ("set_correction", {**VALUES, "gain": 0, "apply": 1}),
        ("set_correction", {**VALUES, "quadrature_error": 65537, "apply": 1}),
        ("set_correction", {**VALUES, "cos_offset": -32768, "apply": 0}),
        ("set_correction", {**VALUES, "apply": 2}),
        ("set_harmonic", dict(order=0, cosine=0, sine=0)),
        ("set_harmonic", dict(order=11, cosine=0, sine=0)),
        ("set_harmonic", dict(order=1, cosine=2**31 - 1, sine=0)),
        ("set_harmonic", dict(order=1, cosine=0, sine=-(2**31))),
        ("get_harmonic", dict(order=0)),
        ("get_harmonic", dict(order=11)),
        ("calibration", dict(action=5)),
    ],
)
def test_values_out_of_range_are_refused_and_change_nothing(name, values):
    machine = moving(learning=False)
    assert machine.request(name, axis=0, **values) == ("out_of_range", {})
    assert machine.request(name, axis=1, **values) == ("no_such_axis", {})
    machine.poll(50)
    assert correction(machine) == IDENTITY and machine.feedback_channels[0].loads == 1


def test_the_operation_and_the_parameter_are_one_switch():
    machine = moving()
    known = dict(axis=0, parameter=PARAMETER["auto_calibration"]["id"])
    assert (
        machine.ask("get_parameter", **known)["value"] == 1 and calibration(machine)["frozen"] == 0
    )
    machine.set(auto_calibration=0)
    machine.poll()
    assert calibration(machine)["frozen"] == 1


# ---- signal faults and registers


def test_signal_faults_are_reported_and_cleared_with_the_faults():
    machine = CompiledNode()
    channel = machine.feedback_channels[0]
    channel.word.update(
        {DEFINES["FEEDBACK_SIGNAL_FAULTS"]: 0x4001, DEFINES["FEEDBACK_FIRST_SIGNAL_FAULTS"]: 0x10}
    )
    assert machine.ask("signal", axis=0) == dict(faults=0x4001, first=0x10)
    channel.strobes.clear()
    machine.ask("reset_faults", axis=0)
    assert channel.strobes == [DEFINES["FEEDBACK_STROBES_CLEAR_SIGNAL_FAULTS_MASK"]]


def test_only_index_capture_and_compare_may_be_written():
    machine = CompiledNode(Axis(), Axis())
    for axis in (0, 1):
        machine.ask("write_register", address=address("COMPARE_STEP_LOW", axis), value=0xDEADBEEF)
        assert (
            machine.feedback_channels[axis].word[DEFINES["FEEDBACK_COMPARE_STEP_LOW"]] == 0xDEADBEEF
        )
        assert (
            machine.ask("read_register", address=address("COMPARE_STEP_LOW", axis))["value"]
            == 0xDEADBEEF
        )
    machine.ask(
        "write_register",
        address=address("STROBES"),
        value=DEFINES["FEEDBACK_STROBES_CAPTURE_NEXT_MASK"],
    )
    for strobe in ("LOAD_CORRECTION", "SWAP_HARMONICS", "RECORD", "CLEAR_SIGNAL_FAULTS"):
        value = DEFINES[f"FEEDBACK_STROBES_{strobe}_MASK"]
        assert (
            machine.request("write_register", address=address("STROBES"), value=value)[0]
            == "out_of_range"
        )
    allowed = {
        "STROBES",
        "INDEX",
        "COUNTS_PER_REVOLUTION",
        "INDEX_EVENTS",
        "CAPTURE_SOURCES",
        "CAPTURE_STATE",
        "COMPARE_START_LOW",
        "COMPARE_START_HIGH",
        "COMPARE_STEP_LOW",
        "COMPARE_STEP_HIGH",
        "COMPARE_COUNT",
        "COMPARE_PULSE",
        "COMPARE_GAP",
        "COMPARE_STATE",
    }
    addresses = {address(name, axis) for name in allowed for axis in (0, 1)}
    answers = dict.fromkeys(addresses, "ok")
    link = DEFINES["LINK_BASE"]
    answers |= dict.fromkeys(range(link, link + 0x100, 4), "not_built")  # this node has no link
    for offset in range(0, 0x1000, 4):
        cause = machine.request("write_register", address=offset, value=0)[0]
        assert cause == answers.get(offset, "no_such_register"), hex(offset)
    assert (
        machine.request("write_register", address=address("INDEX") + 1, value=0)[0]
        == "no_such_register"
    )


@pytest.mark.parametrize("words", [("LOW", "HIGH"), ("HIGH", "LOW")])
def test_each_word_of_a_compare_position_is_written_by_itself_also_while_an_axis_moves(words):
    """The node writes the wide registers of its segments between the two requests."""
    source, machine = random.Random(seed()), CompiledNode(Axis(), Axis())
    machine.set(home_method=35, travel_high=10**9)
    machine.ask("enable", axis=0, on=1)
    machine.ask("home", axis=0)
    assert machine.run(3000, until=lambda: machine.status()["ended"] == "ok")
    machine.ask("move", axis=0, target=10_000 * PERIOD)
    registers = [(f"COMPARE_{name}", axis) for name in ("START", "STEP") for axis in (0, 1)]
    wanted = {register: source.getrandbits(48) for register in registers}
    for word in words:
        for (name, axis), value in wanted.items():
            shift = 32 if word == "HIGH" else 0
            part = value >> shift & 0xFFFFFFFF
            machine.ask("write_register", address=address(f"{name}_{word}", axis), value=part)
        pushed = len(machine.axes[0].pushed)
        machine.run(40)
        assert len(machine.axes[0].pushed) > pushed
    for (name, axis), value in wanted.items():
        channel = machine.feedback_channels[axis]
        assert channel.wide(f"FEEDBACK_{name}", 48) % 2**48 == value, (name, axis)


def test_the_burst_of_the_calibration_cannot_be_read_by_the_host():
    machine = CompiledNode()
    assert (
        machine.request("read_register", address=address("RECORDER_WORD"))[0] == "no_such_register"
    )
    assert (
        machine.request("read_register", address=address("SIGNAL_FAULTS", 1))[0]
        == "no_such_register"
    )
    assert machine.ask("read_register", address=address("CAPTURE_STATE"))["value"] == 0


NEEDS = {  # (register, value): what is not built without it
    ("STROBES", "STROBES_COMPARE_ARM_MASK"): "compare",
    ("STROBES", "STROBES_COMPARE_DISARM_MASK"): "compare",
    ("STROBES", "STROBES_CAPTURE_NOW_MASK"): "capture",
    ("STROBES", "STROBES_ARM_INDEX_MASK"): None,
    ("CAPTURE_SOURCES", 1): None,  # the index
    ("CAPTURE_SOURCES", 2): "capture",
    ("CAPTURE_SOURCES", 3): "capture",
    ("INDEX", 1): None,
    ("CAPTURE_STATE", 0): None,
    ("COUNTS_PER_REVOLUTION", 7): "encoder_check",
    ("COMPARE_START_LOW", 7): "compare",
    ("COMPARE_STATE", 0): "compare",
}


@pytest.mark.parametrize("absent", ["compare", "capture", "encoder_check"])
def test_a_register_of_what_is_not_built_is_refused_and_all_others_are_written(absent):
    machine = CompiledNode(absent=[absent])
    channel = machine.feedback_channels[0]
    for (name, value), feature in NEEDS.items():
        number = DEFINES[f"FEEDBACK_{value}"] if isinstance(value, str) else value
        channel.strobes.clear()
        channel.word[DEFINES[f"FEEDBACK_{name}"]] = 0
        cause = machine.request("write_register", address=address(name), value=number)[0]
        assert cause == ("not_built" if feature == absent else "ok"), (name, value)
        if name == "STROBES":
            assert (number in channel.strobes) == (feature != absent), value
        elif name != "CAPTURE_STATE" and name != "COMPARE_STATE":  # writing 1 clears a bit of these
            assert channel.word[DEFINES[f"FEEDBACK_{name}"]] == number * (feature != absent)


def test_a_strobe_that_needs_two_features_is_refused_without_either():
    strobes = sum(
        DEFINES[f"FEEDBACK_STROBES_{name}_MASK"] for name in ("COMPARE_ARM", "CAPTURE_NOW")
    )
    for absent in ("compare", "capture"):
        machine = CompiledNode(absent=[absent])
        entry = dict(address=address("STROBES"), value=strobes)
        assert machine.request("write_register", **entry)[0] == "not_built"
