# SPDX-License-Identifier: Apache-2.0
"""The wires of the recorder of ticks in a node: settings, the signals of each axis, triggers, what
is read, and the excitation of a command.
"""

import pytest

from tb.wiring.node import COUNT
from tb.wiring.test_sine_wiring import SAMPLE, Scale
from twin.compiled.tables import TABLE

SIGNALS = {name: code for name, (code, _) in TABLE["tick_signal"].items()}
TRIGGERS = {name: code for name, (code, _) in TABLE["tick_trigger"].items()}
EMPTY, WAITING, RECORDING, FULL = range(4)
WORDS = 256  # of the memory


def other(axis):
    return 1 - axis


def begin(
    node, channels, length, every=1, earlier=0, delay=0, trigger=("target", 0), when="now", level=0
):
    """Begin a recording of these channels, (signal, axis) each."""
    codes = [SIGNALS[signal] | axis << 4 for signal, axis in channels]
    codes += [0] * (8 - len(codes))
    for first in (0, 4):
        word = sum(code << 8 * n for n, code in enumerate(codes[first : first + 4]))
        node.write(f"node.scope_channels_{first}", word)
    signal, axis = trigger
    node.write(
        "node.scope",
        node.word(
            "node.scope",
            axis=axis,
            last=len(channels) - 1,
            trigger=SIGNALS[signal],
            mode=TRIGGERS[when],
        ),
    )
    node.write("node.scope_samples", length=length, every=every)
    node.write("node.scope_place", earlier=earlier, delay=delay)
    node.write("node.scope_level", level)


def words(node, channels):
    """The samples that can be read, signed."""
    found = []
    for _ in range(node.read("node.scope_state", "available")):
        word = node.read("node.scope_word")
        found.append(word - (word >> 31 << 32))
    return [tuple(found[n : n + channels]) for n in range(0, len(found), channels)]


@pytest.mark.parametrize("axis", [0, 1])
def test_each_signal_of_an_axis_is_recorded_as_its_registers_show_it(node, axis):
    node.start()
    node.write("axis.kp", 1000, axis=axis)
    node.write("axis.ki", 1 << 16, axis=axis)
    node.write("axis.integral_limit", 0x7FFF, axis=axis)
    node.count(axis, 3)
    node.write("axis.strobes", set_target_to_position=1, axis=axis)
    node.enable(axis, closed_loop=1)
    node.ticks(2)
    node.count(axis, -4)
    channels = [(name, axis) for name in ("position", "error", "command", "integral", "target")]
    begin(node, channels, 6)
    assert node.read("node.scope_state", "phase") in (WAITING, RECORDING)
    node.ticks(8)
    assert node.read("node.scope_state", "phase") == FULL
    found = words(node, len(channels))
    assert len(found) == 6 and node.read("node.scope_state", "available") == 0
    for position, error, command, _, target in found:
        assert (position, error, target) == (-COUNT, 4 * COUNT, 3 * COUNT)
        assert command >= 1000
    integrals = [sample[3] for sample in found]
    assert integrals == sorted(integrals) and 0 < integrals[0] < integrals[-1]
    commands = [sample[2] for sample in found]
    assert commands == [1000 + (i >> 16) for i in integrals]
    begin(node, [("position", other(axis)), ("command", other(axis))], 2)
    node.ticks(4)
    assert words(node, 2) == [(0, 0)] * 2


@pytest.mark.parametrize("axis", [0, 1])
def test_velocities_and_faults_of_an_axis_are_recorded(node, axis):
    node.start()
    node.enable(axis)
    node.segment(axis, 3000, 40)
    node.write("axis.strobes", start=1, axis=axis)
    node.ticks(3)
    names = ("target_velocity", "velocity", "faults")
    begin(node, [(name, axis) for name in names] + [("target_velocity", other(axis))], 3)
    for _ in range(5):
        node.count(axis, 10, 155)
    found = words(node, 4)
    assert {sample[0] for sample in found} == {3000} and {sample[3] for sample in found} == {0}
    assert any(sample[1] > 0 for sample in found) and {sample[2] for sample in found} == {0}
    node.set_bit("drive_fault_n", axis, 0)
    node.ticks(2)
    begin(node, [("faults", axis), ("faults", other(axis))], 2)
    node.ticks(4)
    faults = sum(1 << n for n in range(13) if n == 1)
    [(mine, others)] = set(words(node, 2))
    assert mine & faults == node_faults(node, axis) & faults and mine and not others


def node_faults(node, axis):
    """The word of the faults of an axis."""
    return sum(value << n for n, value in enumerate(node.fields("axis.faults", axis).values()))


@pytest.mark.parametrize("axis", [0, 1])
def test_samples_and_phases_of_an_axis_are_recorded(node, axis):
    scale = Scale(node)
    scale.turn(axis, 0.2)
    begin(node, [("sine_cosine", axis), ("phase", axis), ("sine_cosine", other(axis))], 2)
    node.run(20 * SAMPLE + 6 * 1550)
    shown = node.fields("axis.sample", axis), node.fields("axis.sample", other(axis))
    for mine, phase, others in words(node, 3):
        for word, sample in ((mine, shown[0]), (others, shown[1])):
            assert word & 0xFFFF == sample["sin"] & 0xFFFF
            assert word >> 16 & 0xFFFF == sample["cos"] & 0xFFFF
        assert abs(phase - 0.2 * 65536) < 2000


def test_the_command_of_the_fine_stage_is_recorded(node):
    node.start()
    for axis in (0, 1):
        node.write("actuator.fine_kp", 1000, axis=axis)
        node.write("actuator.fine_limit", 20000 - axis, axis=axis)
        node.write("axis.strobes", set_target_to_position=1, axis=axis)
        node.enable(axis, fine=1)
    node.count(1, -4)
    node.ticks(2)
    begin(node, [("fine_command", 0), ("fine_command", 1)], 2)
    node.ticks(4)
    shown = [node.read("actuator.fine_command", axis=axis) for axis in (0, 1)]
    assert words(node, 2)[-1] == tuple(shown) and shown[0] == 0 < shown[1]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_trigger_waits_for_its_signal_and_keeps_samples_from_before(node, axis):
    node.start()
    begin(
        node,
        [("position", axis)],
        8,
        every=2,
        earlier=3,
        trigger=("position", axis),
        when="rises",
        level=3 * COUNT,
    )
    for another in {0, 1, 2} - {axis}:
        node.count(another, 9)
    node.ticks(10)
    assert node.read("node.scope_state", "phase") == WAITING, "the position of another axis"
    node.count(axis, 5)
    node.ticks(30)
    found = [sample for (sample,) in words(node, 1)]
    assert found == [0] * 3 + [5 * COUNT] * 5


def test_a_recording_after_a_delay_and_one_of_some_ticks(node):
    node.start()
    node.segment(0, 1000, 200)
    node.enable(0)
    node.write("axis.strobes", start=1)
    node.ticks(3)
    begin(node, [("target", 0)], 4, every=3, delay=7)
    at = node.read("axis.target")
    node.ticks(25)
    found = [sample for (sample,) in words(node, 1)]
    assert [b - a for a, b in zip(found, found[1:])] == [3000] * 3
    assert found[0] - at >= 6000


def test_what_does_not_fit_into_the_memory_ends_a_recording_without_end(node):
    node.start()
    begin(node, [("target", 0)], 0)
    node.ticks(10)
    assert node.read("node.scope_state", "phase") == RECORDING
    assert len(words(node, 1)) >= 8
    node.ticks(WORDS + 8)
    assert node.read("node.scope_state", "phase") == FULL
    assert node.read("node.scope_state", "available") == WORDS


@pytest.mark.parametrize("axis, delay", [(0, 1), (1, 3)])
def test_an_excitation_adds_its_waveform_to_the_commands_of_its_axis(node, axis, delay):
    """The recording begins with its first value, so after a delay of 3 ticks it waits."""
    node.start()
    wave = [1000, -2000, 3000, 0]
    for at, value in enumerate(wave):
        node.write("node.excitation_value", value=value, at=at)
    for n in (0, 1):
        node.write("axis.open_command", 500, axis=n)
        node.enable(n)
    node.ticks(3)
    node.write("node.excitation", node.word("node.excitation", axis=axis, period=4, limit=3000))
    channels = [("command", axis), ("command", other(axis))]
    begin(node, channels, 9, delay=delay)
    node.ticks(18)
    found = words(node, 2)
    assert [sample[0] for sample in found[:8]] == [1500, -1500, 3000, 500] * 2
    assert {sample[1] for sample in found} == {500}
    node.ticks(2)
    assert node.read("axis.command", axis=axis) == 500, "it ends with the recording"


def test_a_reset_ends_recording_and_excitation(node):
    node.start()
    node.write("node.excitation", node.word("node.excitation", axis=0, period=1, limit=3000))
    begin(node, [("target", 0)], 0)
    node.ticks(4)
    node.set(rst=1)
    node.run(16)
    node.set(rst=0)
    node.run(4000)
    assert node.read("node.scope_state", "phase") == EMPTY
    assert node.read("node.scope_state", "available") == 0
