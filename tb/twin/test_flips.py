# SPDX-License-Identifier: Apache-2.0
"""Registers of a node by name, and bits of them that flip in the twin."""

import pytest

from firmware.build import MEMORY_BYTES
from moire.client.bus import Bus
from tb.bench import rtl_only
from twin import Twin, TwinTransport


@pytest.fixture
def twin():
    rtl_only("the cells of a netlist have no names")
    with Twin(nodes=(1,), seed=1) as made:
        made.run_until_ready()
        yield made


def register(twin, name):
    (found,) = (one for one in twin.registers() if one.name == name)
    return found


def test_registers_have_names_widths_and_words(twin):
    found = {one.name: (one.bits, one.words) for one in twin.registers()}
    assert found["now"] == (64, 1) and found["axis_faults"] == (13, 1)
    assert found["u_rs485.watchdog_time"] == (16, 1) and found["drive_enable"] == (1, 1)
    assert found["g_core.u_core.u_memory.memory"] == (32, MEMORY_BYTES // 4)
    assert found["u_motion.g_engine.u_engine.u_memory.words"] == (72, 128)
    assert 4000 < sum(bits for bits, words in found.values() if words == 1) < 12000
    assert not any("__Vdly" in name or "Trigger" in name for name in found)


def test_a_bit_flips_in_its_cycle_and_changes_what_follows(twin):
    axis = Bus(TwinTransport(twin)).axis(1)
    before = axis.node.read_named("node.time_stamp")["value"]
    twin.flip_after(0.001, register(twin, "now"), 31)
    twin.run(0.0009)
    assert not twin.flipped()
    twin.run(0.0002)
    assert twin.flipped()
    after = axis.node.read_named("node.time_stamp")["value"]
    assert after - before == pytest.approx(1 << 31, abs=twin.clk_hz)


def test_a_flip_wakes_what_rests(twin):
    """The settings of an axis at rest are not evaluated until something changes."""
    twin.run(0.01)
    twin.flip_after(0.0, register(twin, "g_axis[0].u_axis.control_enable"), 0)
    twin.run(0.001)
    assert twin.flipped() and not twin.truth().enabled, "a request needs both of its bits"
    twin.flip_after(0.0, register(twin, "g_axis[0].u_axis.control_enable"), 1)
    twin.run(0.0001)
    assert twin.truth().enabled


def test_a_bit_that_flips_twice_leaves_the_state_as_it_was():
    rtl_only("the cells of a netlist have no names")
    digests = []
    for flips in (0, 1, 2):
        with Twin(nodes=(1,), seed=1) as twin:
            twin.run_until_ready()
            for _ in range(2):
                if flips:
                    flips -= 1
                    memory = register(twin, "g_core.u_core.u_memory.memory")
                    twin.flip_after(0.0, memory, 7, memory.words - 3000)
                twin.run(1e-5)
            digests.append(twin.digest())
    assert digests[0] == digests[2] != digests[1]


def test_a_bit_that_is_not_there_is_refused(twin):
    now = register(twin, "now")
    for place in ({"bit": 64}, {"bit": 0, "word": 1}):
        with pytest.raises(IndexError, match="now has 1 words of 64 bits"):
            twin.flip_after(0.0, now, **place)
    with pytest.raises(IndexError, match="no node 1"):
        twin.flip_after(0.0, now, 0, node=1)
