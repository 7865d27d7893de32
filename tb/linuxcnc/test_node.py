# SPDX-License-Identifier: Apache-2.0
"""The check of a node before anything moves, by the registers of a node of ideal axes."""

import ctypes

import pytest

from linuxcnc_config.lists import READS
from linuxcnc_config.set_up import set_up
from tb.linuxcnc.compiled import Node, Reply, driver
from tb.linuxcnc.ideal_node import CLK_HZ, TICK, IdealAxis, IdealNode, Served, address, placed

SESSION, PATIENCE_NS = 0x4D01, 10**9


def opened(ideal, axes):
    """The node as the driver has it after its check, and whether it fits."""
    set_up(ideal, len(ideal.axes), SESSION)
    node = Node()
    with Served(ideal) as served:
        where = f"udp:127.0.0.1:{served.port}".encode()
        patience = ctypes.c_int64(PATIENCE_NS)
        fits = driver().node_open(ctypes.byref(node), where, axes, SESSION, patience)
    driver().carrier_close(ctypes.byref(node.carrier))
    return node, fits


def built(ideal, axis, **features):
    """Gives an axis of a node other features."""
    ideal.names[address("axis", "built", axis)] = lambda: placed("axis", "built", **features)
    return ideal


def test_axes_with_drives_and_the_encoder_after_them_are_found():
    node, fits = opened(IdealNode(2, spindle=IdealAxis(turn=100)), 3)
    assert fits and (node.drives, node.axes, node.probes) == (2, 3, True)
    assert (node.clk_hz, node.tick) == (CLK_HZ, TICK)


def test_a_node_with_an_axis_without_captures_has_no_probe():
    node, fits = opened(built(IdealNode(2), 1, drive=1, set_points=1), 2)
    assert fits and not node.probes


@pytest.mark.parametrize(
    "ideal, words",
    [
        (lambda: IdealNode(2, map_crc=1), "the node is of another build: its register map"),
        (lambda: built(IdealNode(2), 1, drive=1), "axis 1 of the node has no set-points"),
        (
            lambda: built(IdealNode(2), 0, capture=1),
            "axis 1 of the node has a drive, the one before it has none",
        ),
    ],
)
def test_a_node_that_does_not_fit_is_refused_in_a_sentence(ideal, words):
    node, fits = opened(ideal(), 2)
    assert not fits and node.why.decode().startswith(words)


def replied(node, time, **pll):
    """A reply with this time, and registers of the PLL, has come."""
    reply = Reply(time=time)
    state = {name: value for name, value in pll.items() if name != "read_time"}
    reply.values[READS.index("link.pll_state")] = placed("link", "pll_state", **state)
    reply.values[READS.index("link.read_time")] = pll.get("read_time", 0)
    driver().node_take_time(ctypes.byref(node), ctypes.byref(reply))
    return node.read_time, node.locked, node.captured, node.phase_error


def test_a_reply_says_when_its_values_were_read_and_whether_before_the_request():
    node = Node()
    assert replied(node, 1000) == (1000, False, False, 0), "a node without a PLL"
    assert replied(node, 2000, built=1, read_time=2030) == (2030, False, False, 0)
    at = dict(built=1, locked=1)
    assert replied(node, 3000, **at, read_time=3030) == (3030, True, False, 0)
    late = dict(captured=1, read_time=3700, phase_error=5)
    assert replied(node, 4000, **at, **late) == (3700, True, True, 5)
    early = dict(captured=1, read_time=4700, phase_error=(1 << 24) - 7)
    assert replied(node, 4993, **at, **early) == (4700, True, True, -7)
