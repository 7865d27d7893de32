# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.scope: the requests to the node, and its samples as times, lengths and fractions;
test_firmware_scope has the side of the node.
"""

import math
import random

import pytest

from moire.analysis.scope import NoRecord, Scope, excite, lsb
from moire.client.bus import Bus
from moire.errors import OutOfRange, Refused
from tb.fakes.fake_node import FakeBus, FakeNode
from tb.host.test_host_command_line import Call, sentence

PERIOD = 65536


def axis_of(node):
    return Bus(FakeBus(node)).axis()


def low(position):
    return (position + 2**31) % 2**32 - 2**31


def ramp(node, count=12, step=PERIOD // 4):
    """Samples that end where the axis is: 62 or 63 units of 64 cycles apart."""
    end = node.axes[0].position
    node.samples = [
        (low(end - (count - 1 - n) * step), 3 * n, -16384 + n, 62 + n % 2) for n in range(count)
    ]


def test_scope_settings_are_sent_in_counts():
    node = FakeNode()
    Scope(axis_of(node)).arm("error", before=7, every="2.5ms", level="1.6um")
    assert node.armed == dict(trigger=3, before=7, every=10, level=2 * PERIOD, amplitude=0)


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
    node = FakeNode()
    with pytest.raises(OutOfRange, match=message):
        Scope(axis_of(node)).arm(**wrong)
    assert node.armed is None


def test_samples_are_read_in_seconds_and_nm():
    node = FakeNode()
    ramp(node)
    scope = Scope(axis_of(node))
    scope.arm("now", before=4)
    record = scope.wait()
    assert record.before == 4 and record.time_s[4] == 0 and len(record.time_s) == 12
    assert record.time_s[5] - record.time_s[4] == pytest.approx(63 * 64 / 4e6) and record.time_s[
        0
    ] == pytest.approx(-250 * 64 / 4e6)
    assert (
        record.position_nm[-1] == pytest.approx(123456 / PERIOD * 800)
        and record.position_nm[1] - record.position_nm[0] == 200
    )
    assert record.error_nm[2] == pytest.approx(6 / PERIOD * 800) and record.command[0] == -0.5


def test_positions_are_complete_where_the_low_word_wraps():
    node = FakeNode()
    node.axes[0].position = node.axes[0].target = 5 * 2**32 + 40 * PERIOD
    ramp(node, count=20, step=10 * PERIOD)
    scope = Scope(axis_of(node))
    scope.arm()
    record = scope.read()
    assert (
        record.position_nm[-1] == (5 * 65536 + 40) * 800
        and record.position_nm[0] == (5 * 65536 + 40 - 190) * 800
    )


def test_a_missing_trigger_and_a_scope_that_is_not_armed_are_one_sentence():
    node = FakeNode()
    scope = Scope(axis_of(node))
    with pytest.raises(NoRecord, match="the scope of node 1 has no record: arm it first"):
        scope.wait()
    scope.arm("motion")
    assert scope.state() == "waiting"
    with pytest.raises(NoRecord, match="no record after 1s: waiting for the trigger"):
        scope.wait("1s")


def test_commands_arm_move_and_read_in_one_call(tmp_path):
    node = FakeNode()
    ramp(node)
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
        and len(rows) == 13
        and picture.read_bytes().startswith(b"\x89PNG")
    )
    reported = Call(["scope", "arm", "--", "scope", "read", str(file), "--json"], node).results[1]
    assert reported["before"] == 0 and len(reported["position_nm"]) == 12
    assert (reported["command"], reported["action"]) == ("scope", "read") and len(
        reported["drive_command"]
    ) == 12


def test_a_scope_without_a_record_is_exit_code_1(tmp_path):
    assert "arm it first" in sentence(Call(["scope", "read", str(tmp_path / "no.csv")]), 1)


# ------------------------------------------------------------------ open loop


def answering(node, time_constant_s=0.008, gain=50_000.0):
    """Samples for identify_samples() every 2 ms, of an axis with a first-order velocity in LSB/s
    per command.
    """
    draw, position, velocity, sign, left = random.Random(1), 0.0, 0.0, 1, 0
    decay, commands, positions = math.exp(-0.002 / time_constant_s), [0], []
    for _ in range(128):
        if left == 0:
            sign, left = -sign, draw.randrange(1, 9)
        left -= 1
        positions.append(round(position))
        commands.append(3000 * sign)
        expected = gain * commands[-1] / 1000
        position += expected * 0.002 + (velocity - expected) * time_constant_s * (1 - decay)
        velocity = expected + (velocity - expected) * decay
    node.samples = [
        (position, 0, command, 125 * (n > 0))
        for n, (position, command) in enumerate(zip(positions, commands))
    ]
    node.axes[0].position = node.axes[0].target = positions[-1]


def test_the_open_loop_needs_the_drive_and_sends_amplitude_and_reach():
    node = FakeNode()
    answering(node)
    axis = axis_of(node)
    with pytest.raises(Refused, match="enable it first"):
        excite(axis)
    axis.enable()
    times, commands, positions = lsb(excite(axis, "25%", "2ms", "80um"))
    assert node.armed == dict(trigger=0, before=0, every=8, level=100 * PERIOD, amplitude=8192)
    assert commands[:-1] == [command for _, _, command, _ in node.samples[1:]] and times[
        1
    ] == pytest.approx(0.002)
    assert positions[:2] == [0, node.samples[1][0]]


def test_tune_without_a_file_drives_and_proposes():
    node = FakeNode()
    answering(node)
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
