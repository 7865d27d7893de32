# SPDX-License-Identifier: Apache-2.0
"""From a netlist to the bitstream of a board: packing, placements, clocks of PLLs, and sizes."""

import re
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import pytest

from boards import board, build, clocks, generate, machine, packing, placements, size
from boards.fit import fit
from figures import synthesis
from figures.boards import boards_failed
from figures.synthesis import SynthesisError
from tb.bench import ROOT
from tb.system.board_files import DESIGNS, MILL, TOO_LARGE, edited, over_ethernet, packer, refusal


@pytest.fixture
def packed(monkeypatch):
    """pack() of the counter box with a packer that writes these bytes."""
    design = fit(board.named("icebreaker"), machine.named("counter_box"))
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as name:
        folder = Path(name)
        (folder / "counter_serial.bin").write_bytes(b"firmware")

        def pack(bits):
            write = lambda words, step, log: (ROOT / words[-1]).write_bytes(bits)
            monkeypatch.setattr(packing, "run", write)
            return packing.pack(design, folder).read_bytes()

        yield pack


def test_the_flash_has_the_firmware_where_the_node_reads_it(packed):
    found = packed(b"bitstream")
    assert found == b"bitstream" + b"\xff" * (0x20000 - 9) + b"firmware"


def test_updates_of_the_firmware_are_built_on_request_and_need_the_serial_core(tmp_path):
    more = ("memory_kib = 64", "memory_kib = 64\nupdate = true")
    box = edited(tmp_path, "constraints/machines/counter_box.toml", more)
    design = fit(board.named("icebreaker"), machine.load(box))
    assert design.parameters["HAS_UPDATE"] == 1
    path = edited(tmp_path, MILL, ("[node]", "[node]\nupdate = true"))
    assert refusal(lambda: machine.load(path)) == (
        f"{path}: [node] update needs core 'serial': the firmware of the other comes out of RAM"
    )


def test_a_bitstream_that_reaches_into_the_firmware_is_refused(packed):
    with pytest.raises(SynthesisError, match="the bitstream has 131073 bytes, the firmware is at"):
        packed(b"x" * 131073)


def test_a_router_that_does_not_end_is_reported(monkeypatch):
    monkeypatch.setattr(synthesis, "LONGEST_S", 0.1)
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as name:
        log = Path(name) / "place_and_route.log"
        sleeps = [sys.executable, "-c", "import time; time.sleep(60)"]
        with pytest.raises(SynthesisError) as why:
            synthesis.run(sleeps, "place and route", log)
        assert str(why.value) == (
            "place and route has not ended after 0.0 minutes: try another seed "
            f"(log: {log.relative_to(ROOT)})"
        )


def test_the_log_of_a_tool_that_fails_is_named_with_its_error():
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as name:
        log = Path(name) / "synthesis.log"
        words = "import sys; print('ERROR: no way'); sys.stderr.write('bye'); sys.exit(1)"
        with pytest.raises(SynthesisError) as why:
            synthesis.run([sys.executable, "-c", words], "synthesis", log)
        assert str(why.value).startswith("synthesis failed: ERROR: no way (log: build/")


def no_way(*_):
    raise SynthesisError("no way")


def no_more(*_):
    raise AssertionError("it is placed again")


@pytest.mark.parametrize(
    "place, failed",
    [
        (lambda design, *_: (design.board.node_hz / 1e6, {}), 0),
        (lambda design, folder, netlist, seed: (17.9 + seed, {}), 2),  # 18.9 MHz at the worst
        (no_way, 3),
    ],
)
def test_the_figure_counts_builds_that_miss_their_clock_or_have_no_bitstream(
    place, failed, monkeypatch, tmp_path
):
    """Of four builds: one reaches 18 MHz but not 48 or 27, one needs no placement."""
    names = ("icebreaker", "ice40_hx8k_evn", "tang_nano_9k", "arty_a7_35t")
    designs = [next(one for one in DESIGNS if one.board.name == name) for name in names]
    monkeypatch.setattr(build, "fitting", lambda: (designs, []))
    for name in ("check_tools", "write", "make_firmware", "synthesise"):
        monkeypatch.setattr(build, name, lambda *_: tmp_path)
    monkeypatch.setattr(placements, "pack", packer(tmp_path))
    (tmp_path / packing.PLACED).write_text("placed")
    monkeypatch.setattr(build, "cells", lambda _: "1 LUT")
    monkeypatch.setattr(build, "place", place)
    monkeypatch.setattr(build, "netlist_state", lambda design, _: design.name)
    monkeypatch.setattr(placements, "RECORD", tmp_path / "placements.toml")
    assert boards_failed() == failed
    monkeypatch.setattr(build, "place", no_more)  # each placement was kept
    assert boards_failed() == failed
    monkeypatch.setattr(build, "state", lambda design: design.name)  # other sources, same netlist
    assert boards_failed() == failed
    monkeypatch.setattr(build, "state", lambda design: f"again-{design.name}")
    monkeypatch.setattr(build, "netlist_state", lambda *_: "another netlist")
    with pytest.raises(AssertionError):
        boards_failed()


# Clocks and sizes


def test_the_pll_makes_the_clock_of_the_node_exactly():
    ecp5 = clocks.pll(clocks.ecp5, 25_000_000, 50_000_000, "")
    assert ecp5.settings == {"CLKI_DIV": 1, "CLKFB_DIV": 2, "CLKOP_DIV": 12}  # 600 MHz
    ice40 = clocks.pll(clocks.ice40, 12_000_000, 18_000_000, "")
    assert ice40.settings == {"DIVR": 0, "DIVF": 47, "DIVQ": 5, "FILTER_RANGE": 1}  # 576 MHz
    xc7 = clocks.pll(clocks.xc7, 100_000_000, 50_000_000, "")
    assert xc7.settings == {"DIVCLK_DIVIDE": 1, "CLKFBOUT_MULT": 10, "CLKOUT0_DIVIDE": 20}
    assert clocks.pll(clocks.ecp5, 25_000_000, 25_000_000, "") is None


@pytest.mark.parametrize(
    "input_hz, output_hz",
    [
        (12_000_000, 50_000_000),  # the phase detector would run at 2 MHz
        (100_000_000, 500_000_000),  # more than the output can do
        (100_000_000, 3_000_000),
    ],
)
def test_a_clock_beyond_the_limits_of_an_ecp5_is_refused(input_hz, output_hz):
    found = refusal(lambda: clocks.pll(clocks.ecp5, input_hz, output_hz, "board.toml"))
    assert found == f"board.toml: [clock] the PLL makes no {output_hz} Hz of {input_hz} Hz"


def test_the_memory_of_an_ice40_without_large_rams_is_in_block_rams():
    box = machine.named("counter_box")
    soft = replace(box, core="soft")
    more = (
        size.estimate("ice40", soft).block_ram - size.estimate("ice40", soft, spram=True).block_ram
    )
    assert more == 2 * soft.memory_kib == 128
    assert size.estimate("ice40", box) == size.estimate("ice40", box, spram=True)


def test_the_pll_of_an_ice40_is_at_its_pad_where_the_clock_comes_in_there():
    """Pin J3 of the HX8K is no pin of a PLL."""
    tops = {
        name: generate.top(fit(board.named(name), machine.named("relay")))
        for name in ("icebreaker", "ice40_hx8k_evn")
    }
    assert "SB_PLL40_PAD #(" in tops["icebreaker"] and ".PACKAGEPIN(clock)" in tops["icebreaker"]
    of_hx8k = tops["ice40_hx8k_evn"]
    assert "SB_PLL40_CORE #(" in of_hx8k and ".REFERENCECLK(clock)" in of_hx8k


def test_the_size_of_the_peripherals_is_the_one_of_their_page():
    assert f"take {size.PERIPHERALS} LUT4" in (ROOT / "docs" / "peripherals.md").read_text()


def test_the_block_rams_are_those_of_netlists(tmp_path):
    """Of nodes that were synthesised for an ECP5: 48 + 8 of the S0 node without its segment table,
    32 + 10 of eight axes.
    """
    assert size.estimate("ecp5", machine.named("s0")).block_ram == 56 + 1
    assert size.estimate("ecp5", machine.named("eight_axes")).block_ram == 42
    assert size.estimate("ecp5", machine.named("mill")).block_ram == 38
    assert size.estimate("xc7", machine.named("mill")).block_ram == 19  # of 36 kbit
    assert TOO_LARGE == [
        "constraints/machines/s0.toml: 1 axis with 96 KiB need about 57 block RAM, but "
        "LFE5U-25F-6BG381C of constraints/ulx3s_25f/board.toml has 56"
    ]


def test_the_estimate_of_block_rams_is_what_nextpnr_counts_in_each_placed_build():
    """All of an ECP5 in docs/placements.toml."""
    counted = {
        name: int(found[1])
        for name, one in placements.read().items()
        if (found := re.search(r"(\d+) of \d+ block RAM", one.used))
    }
    estimated = {
        one.name: one.estimate.block_ram
        for one in DESIGNS
        if one.name in counted and one.board.part.family.name == "ecp5"
    }
    assert len(estimated) > 15
    assert estimated == {name: counted[name] for name in estimated}


def test_the_size_of_the_link_over_ethernet_is_that_of_the_interface(tmp_path):
    """The core for MII is smaller: 3377 LUT4 against 4921 for RGMII, synthesised."""
    mill = machine.load(over_ethernet(tmp_path))
    arty, plain = (
        fit(board.named("arty_a7_35t"), mill),
        fit(board.named("arty_a7_35t"), machine.named("mill")),
    )
    assert arty.estimate.lut - plain.estimate.lut == size.LINK + 3377
    i5 = fit(board.named("colorlight_i5"), mill).estimate.lut
    assert i5 - arty.estimate.lut == 4921 - 3377


def test_a_node_with_set_points_and_the_real_time_link_has_their_size():
    """Three axes, synthesised: 13 996 LUT4 with the set-points, 9464 without."""
    plain, stream = (
        size.estimate("ecp5", machine.named(name)) for name in ("mill", "mill_linuxcnc")
    )
    more = size.LINK + 3 * (size.FEATURES["backlash"] + size.FEATURES["capture"])
    assert stream.lut - plain.lut - more == 13_996 - 9464 + 1
    assert stream.block_ram - plain.block_ram == 3 + 2


def test_a_part_that_is_too_small_for_set_points_is_refused(tmp_path):
    needed = size.estimate("ecp5", machine.named("mill_linuxcnc")).lut
    change = ("lut = 24288", f"lut = {needed - 1}")
    path = edited(tmp_path, "constraints/colorlight_i5/board.toml", change)
    assert fit(board.load(path), machine.named("mill"))
    found = refusal(lambda: fit(board.load(path), machine.named("mill_linuxcnc")))
    assert f"3 axes with 64 KiB need about {needed} LUT, but" in found
