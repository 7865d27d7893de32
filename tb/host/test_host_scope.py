# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.scope: the requests to the node, and its samples as times, lengths and fractions;
test_firmware_scope has the side of the node.
"""

import math

import pytest

from moire.analysis.scope import NoRecord, Scope, excite, lsb
from moire.client.bus import Bus
from moire.errors import OutOfRange, Refused
from tb.fakes.bus_node import START, BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.call import Call, sentence
from twin.compiled.axis import Axis
from twin.compiled.tables import DEFINES, PERIOD, signed


def axis_of(node):
    return Bus(Rs485Bus(node)).axis()


class Ramp(Axis):
    """An axis that moves by itself, by the same distance in each tick, and records where it was."""

    def __init__(self, position=START, step=PERIOD // 16):
        super().__init__(position)
        self.step, self.ticks = step, 0

    def tick(self):
        self.machine += self.step
        self.ticks += 1
        self.word[DEFINES["AXIS_COMMAND"]] = -16384 + self.ticks & 0xFFFF

    @property
    def error(self):
        return 3 * self.ticks


def test_scope_settings_are_sent_in_counts():
    node = BusNode()
    Scope(axis_of(node)).arm("error", before=7, every="2.5ms", level="1.6um")
    assert node.written("arm_scope") == [
        dict(axis=0, trigger=3, before=7, every=10, level=2 * PERIOD, amplitude=0)
    ]


@pytest.mark.parametrize(
    "wrong, message",
    [
        (dict(trigger="noon"), "no trigger 'noon': there are now, motion, settling, error, fault"),
        (dict(before=128), "0 to 127"),
        (dict(before=-1), "0 to 127"),
        (dict(every="100us"), "250us to 50ms"),
        (dict(every="51ms"), "250us to 50ms"),
    ],
)
def test_wrong_scope_settings_are_not_sent(wrong, message):
    node = BusNode()
    with pytest.raises(OutOfRange, match=message):
        Scope(axis_of(node)).arm(**wrong)
    assert "arm_scope" not in node.executed


def test_samples_are_read_in_seconds_and_nm():
    node = BusNode(axes=[Ramp()])
    scope = Scope(axis_of(node))
    scope.arm("error", before=4, level="100nm")  # 8192 / 65536 period
    record = scope.wait()
    assert record.before == 4 and record.time_s[4] == 0 and len(record.time_s) == 128
    # every 4000 cycles, in steps of 64
    assert record.time_s[5] == pytest.approx(0.001, abs=64 / 4e6)
    assert record.time_s[127] == pytest.approx(0.123, abs=64 / 4e6)
    assert record.time_s[0] == pytest.approx(-0.004, abs=64 / 4e6)
    assert record.error_nm[3] < 100 <= record.error_nm[4]
    for position, error, command in zip(record.position_nm, record.error_nm, record.command):
        ticks = round(error / 800 * PERIOD / 3)
        assert ticks % 4 == 0 and error == pytest.approx(3 * ticks / PERIOD * 800)
        assert position == pytest.approx((START + ticks * PERIOD // 16) / PERIOD * 800)
        assert command == (-16384 + ticks) / 32768


def test_positions_are_complete_where_the_low_word_wraps():
    start = 5 * 2**32 - 300 * PERIOD
    node = BusNode(axes=[Ramp(start, step=2 * PERIOD)])
    scope = Scope(axis_of(node))
    scope.arm()
    positions = scope.wait().position_nm
    first, last = 5 * 65536 - 300, positions[-1] / 800
    assert first <= positions[0] / 800 < first + 200 < 5 * 65536 < last
    assert {b - a for a, b in zip(positions, positions[1:])} == {8 * 800}


def test_fewer_samples_are_read_as_far_as_asked_for_with_progress():
    scope, done = Scope(axis_of(BusNode(axes=[Ramp()]))), []
    scope.arm("error", before=40, level="500nm")
    record = scope.wait()
    assert scope.read(52, done.append).time_s == record.time_s[:52]
    assert done == list(range(0, 52, 5))
    assert len(scope.read(16).time_s) == record.before + 1 > 16  # the trigger is among them


def test_a_missing_trigger_and_a_scope_that_is_not_armed_are_one_sentence():
    scope = Scope(axis_of(BusNode()))
    with pytest.raises(NoRecord, match="the scope of node 1 has no record: arm it first"):
        scope.wait()
    with pytest.raises(NoRecord, match="arm it first"):
        scope.read()
    scope.arm("motion")
    assert scope.state() == "waiting"
    with pytest.raises(NoRecord, match="no record after 1s: waiting for the trigger"):
        scope.wait("1s")


def test_commands_arm_move_and_read_in_one_call(tmp_path):
    node = BusNode()
    file, picture = tmp_path / "move.csv", tmp_path / "move.png"
    call = Call(
        [
            "home",
            "--",
            "scope",
            "arm",
            "--trigger",
            "motion",
            "--",
            "move",
            "1mm",
            "--no-wait",
            "--",
            "scope",
            "read",
            str(file),
            "--picture",
            str(picture),
        ],
        node,
    )
    assert call.code == 0, call.err
    rows = file.read_text().splitlines()
    assert (
        rows[0] == "time_s,position_nm,error_nm,command"
        and len(rows) == 129
        and picture.read_bytes().startswith(b"\x89PNG")
    )
    reported = Call(["scope", "arm", "--", "scope", "read", str(file), "--json"], node).results[1]
    assert reported["before"] == 0 and len(reported["position_nm"]) == 128
    assert (reported["command"], reported["action"]) == ("scope", "read") and len(
        reported["drive_command"]
    ) == 128


def test_a_scope_without_a_record_is_exit_code_1(tmp_path):
    assert "arm it first" in sentence(Call(["scope", "read", str(tmp_path / "no.csv")]), 1)


# ------------------------------------------------------------------ open loop


class OpenLoop(Axis):
    """An axis whose velocity follows the open-loop command with a time constant: `gain` is its
    velocity in 2^-16 period/s per 1/1000 of the command.
    """

    TIME_CONSTANT_S, GAIN, TICK_S = 0.008, 50_000.0, 1 / 4000

    def __init__(self):
        super().__init__(START)
        self.exact, self.velocity = 0.0, 0.0
        self.commands = []  # in each tick of the excitation

    @property
    def excited(self):
        loop = DEFINES["AXIS_CONTROL_CLOSED_LOOP_MASK"]
        return self.enabled and not self.control & loop

    def tick(self):
        if not self.excited:
            self.word[DEFINES["AXIS_COMMAND"]] = 0
            return super().tick()
        command = signed(self.word.get(DEFINES["AXIS_OPEN_COMMAND"], 0) & 0xFFFF, 16)
        self.word[DEFINES["AXIS_COMMAND"]] = command & 0xFFFF
        self.commands.append(command)
        decay = math.exp(-self.TICK_S / self.TIME_CONSTANT_S)
        expected = self.GAIN * command / 1000
        self.exact += expected * self.TICK_S + (self.velocity - expected) * (
            self.TIME_CONSTANT_S * (1 - decay)
        )
        self.velocity = expected + (self.velocity - expected) * decay
        self.machine = START + round(self.exact)
        self.interlock()


def test_the_open_loop_needs_the_drive_and_sends_amplitude_and_reach():
    node = BusNode(axes=[OpenLoop()])
    axis = axis_of(node)
    with pytest.raises(Refused, match="enable it first"):
        excite(axis)
    axis.enable()
    times, commands, positions = lsb(excite(axis, "25%", "2ms", "10mm"))
    assert node.written("arm_scope")[-1] == dict(
        axis=0, trigger=0, before=0, every=8, level=12500 * PERIOD, amplitude=8192
    )
    assert len(times) == 128 and times[1] - times[0] == pytest.approx(0.002, abs=64 / 4e6)
    assert set(commands[:-1]) == {8192, -8192}
    driven = node.axes[0].commands  # 8 ticks in a sample
    first = next(n for n, command in enumerate(driven) if command)
    assert commands[:-1] == driven[first::8][:127]
    assert positions[0] == START and node.state() == "holding"


def test_the_open_loop_ends_where_the_axis_has_moved_as_far_as_it_may():
    node = BusNode(axes=[OpenLoop()])
    axis = axis_of(node)
    axis.enable()
    record = excite(axis, "25%", "2ms", "100nm")
    assert len(record.time_s) < 128
    assert abs(record.position_nm[-1] - record.position_nm[0]) > 100
    assert abs(record.position_nm[-2] - record.position_nm[0]) <= 100


def test_tune_without_a_file_drives_and_proposes():
    node = BusNode(axes=[OpenLoop()])
    call = Call("tune --bandwidth 40Hz --json", node)
    assert call.code == 0, call.err
    plant = call.results[0]["plant"]
    assert (
        plant["a"] == pytest.approx(math.exp(-0.25 / 8), abs=1e-4)
        and plant["delay"] == 0
        and plant["tick_s"] == 1 / 4000
    )
    assert plant["b"] / (1 - plant["a"]) == pytest.approx(50 / 4000, rel=0.001)
    assert "enable" in node.executed and not node.axes[0].enabled and not call.results[0]["written"]
