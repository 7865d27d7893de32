# SPDX-License-Identifier: Apache-2.0
"""The test of one small block of each directory of rtl/ on a netlist of it: what of `make soak
K=netlist` is part of every check.
"""

from importlib import import_module

import pytest

from tb.bench import ROOT

BLOCKS = {  # of each directory: the family, the block, the arguments of its test
    "common": ("ecp5", "axis_memory", {"axes": 5}),
    "compensate": ("ice40", "harmonic_rotation_rom", {}),
    "control": ("ecp5", "engine_multiplier", {}),
    "cpu": ("ecp5", "node_memory", {}),
    "decode": ("ice40", "index_latch", {"w": 4, "check": 1}),
    "drive": ("ecp5", "drive_select", {}),
    "interlock": ("ice40", "core_watchdog", {}),
    "interpolate": ("ecp5", "sample_hold", {"w": 8}),
    "peripheral": ("ice40", "spi_word_sender", {}),
    "position": ("ecp5", "shift_delay", {}),
    "registers": ("ice40", "register_layout", {"axes": 1, "masks": {}}),
    "relay": ("ecp5", "relay_status", {}),
    "sense": ("ice40", "encoder_events", {}),
    "link": ("ecp5", "packet_receiver", {}),
    "serial": ("ecp5", "half_duplex", {}),
}


def test_each_directory_has_a_block():
    assert set(BLOCKS) == {path.name for path in (ROOT / "rtl").iterdir() if path.is_dir()}


@pytest.mark.parametrize("room", BLOCKS)
def test_room(room, monkeypatch):
    family, block, arguments = BLOCKS[room]
    monkeypatch.setenv("NETLIST", family)
    module = import_module(f"tb.{room}.test_{block.removesuffix('_rom')}")
    assert getattr(module, f"test_{block}")(**arguments) is None, "a failure is an exception"
