# SPDX-License-Identifier: Apache-2.0
"""Tests of arctan_table: by hand, all 8-bit pairs against math.atan2 within the bound of the table,
and every cycle against the model.

The model is compared with atan2 for all 65 535 pairs. The RTL is compared with the model for all
pairs under SIM=verilator, and under Icarus for all 8 385 pairs of one octant, each turned into one
of the octants in rotation.
"""

import math
import random
import shutil
import subprocess
import sys
from itertools import product

import cocotb
import pytest
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from tb.bench import run, start
from tb.interpolate.arctan_table import LATENCY, ArctanTable, arctan, phase_of
from tb.simulator import source_of

IDLE = dict(valid=0, sin=0, cos=0)


def error(sin, cos):
    """LSB between the model and the true phase."""
    away = phase_of(sin, cos) - math.atan2(sin, cos) / math.tau * 65536
    return away - round(away / 65536) * 65536


async def ask(dut, sin, cos):
    """Send one sample after the last one is done; return when its phase is ready."""
    dut.valid.value, dut.sin.value, dut.cos.value = 1, sin, cos
    await FallingEdge(dut.clk)
    dut.valid.value = 0
    await ClockCycles(dut.clk, LATENCY - 1, FallingEdge)
    assert dut.done.value == 1
    return dut.phase.value.to_unsigned()


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)


@cocotb.test()
async def the_octant_borders_are_exact(dut):
    await begin(dut)
    full, half = (1 << int(dut.W.value) - 1) - 1, 1 << int(dut.W.value) - 2
    for size in (1, 3, half, full):
        for eighth, (sin, cos) in enumerate(
            [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
        ):
            assert await ask(dut, sin * size, cos * size) == eighth * 8192


@cocotb.test()
async def known_angles_are_right(dut):
    await begin(dut)
    assert await ask(dut, 3, 4) == 6712  # atan 0.75 = 36.8699 deg = 6711.96 of 65 536
    assert await ask(dut, 4, 3) == 16384 - 6712
    assert await ask(dut, 1, 100) == 104  # 0.572939 deg = 104.30
    assert await ask(dut, -1, 100) == 65536 - 104
    assert await ask(dut, 0, 0) == 0


@cocotb.test()
async def the_ends_of_the_range_match_the_model(dut):
    await begin(dut)
    low, high = -(1 << int(dut.W.value) - 1), (1 << int(dut.W.value) - 1) - 1
    for sin, cos in product((low, low + 1, -1, 0, 1, high - 1, high), repeat=2):
        assert await ask(dut, sin, cos) == phase_of(sin, cos), (sin, cos)


@cocotb.test()
async def latency_is_23(dut):
    await start(dut, **IDLE)
    dut.valid.value, dut.cos.value = 1, -5
    cycle = 0
    while not cycle or not int(dut.done.value):
        await RisingEdge(dut.clk)
        cycle += 1
        await FallingEdge(dut.clk)
        dut.valid.value = 0
        assert cycle <= 23
    assert cycle == 23 and dut.phase.value == 32768


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    await begin(dut)
    w, model, rst = int(dut.W.value), ArctanTable(), 0
    for cycle in range(4000):
        rst = int(random.random() < 0.005)
        valid, sin, cos = (
            random.choice((0, 0, 1)),
            random.randrange(-1 << w - 1, 1 << w - 1),
            random.randrange(-1 << w - 1, 1 << w - 1),
        )
        dut.rst.value, dut.valid.value, dut.sin.value, dut.cos.value = rst, valid, sin, cos
        await FallingEdge(dut.clk)
        want = model.step(valid, sin, cos)
        if rst:
            model, want = ArctanTable(), (0, 0)
        assert (int(dut.done.value), dut.phase.value.to_unsigned()) == want, f"cycle {cycle}"


@cocotb.test()
async def pairs_match_the_model(dut):
    await begin(dut)
    if int(dut.W.value) == 8:
        pairs = list(product(range(-128, 128), repeat=2))
        if cocotb.SIM_NAME.startswith("Icarus"):
            octant = [(smaller, larger) for larger in range(129) for smaller in range(larger + 1)]
            pairs = [turned(*pair, number % 8) for number, pair in enumerate(octant)]
    else:
        pairs = [
            (random.randrange(-1 << 15, 1 << 15), random.randrange(-1 << 15, 1 << 15))
            for _ in range(1000)
        ]
    for sin, cos in pairs:
        assert await ask(dut, sin, cos) == phase_of(sin, cos), (sin, cos)


def turned(smaller, larger, octant):
    """The pair in another octant: the channels are exchanged and negated by the bits of `octant`;
    128 exists only with a minus sign.
    """
    first, second = (
        -channel if channel == 128 or octant >> bit & 1 else channel
        for bit, channel in enumerate((smaller, larger))
    )
    return (second, first) if octant & 4 else (first, second)


def test_all_pairs_are_within_the_bound_of_the_table():
    errors = [error(s, c) for s, c in product(range(-128, 128), repeat=2) if s or c]
    assert len(errors) == 65535
    assert max(map(abs, errors)) <= arctan.BOUND <= 4
    assert max(map(abs, errors)) > 0.9 * arctan.BOUND  # the bound is close to the real error


def test_any_wider_pair_is_within_the_bound():
    draw = random.Random(1)
    for w in range(9, 17):
        full = 1 << w - 1
        assert (
            max(
                abs(error(draw.randrange(-full, full), draw.randrange(-full, full) or 1))
                for _ in range(20_000)
            )
            <= arctan.BOUND
        )
    edge = [32767, -32768, 32766, 1, 2, 255, 256, 257]
    assert max(abs(error(s, c)) for s, c in product(edge, repeat=2)) <= arctan.BOUND


def test_the_committed_table_is_fresh():
    subprocess.run([sys.executable, "-m", "tables.arctan", "--check"], check=True)


@pytest.mark.parametrize(
    "name, old, new",
    [("arctan_rom", "19'd19,", "19'd20,"), ("arctan_table", "FRACTION = 9", "FRACTION = 8")],
)
def test_a_changed_file_is_detected_and_made_again(tmp_path, monkeypatch, name, old, new):
    shutil.copy(source_of("arctan_table"), tmp_path)
    monkeypatch.setattr(arctan, "FOLDER", tmp_path)
    monkeypatch.setattr(arctan, "MADE", tmp_path / "arctan_rom.sv")
    assert arctan.main(["--check"]) == 1 and arctan.main([]) == arctan.main(["--check"]) == 0
    path = tmp_path / f"{name}.sv"
    text = path.read_text()
    path.write_text(text.replace(old, new))
    assert path.read_text() != text
    assert arctan.main(["--check"]) == 1 and arctan.main([]) == 0
    assert path.read_text() == text


def test_the_header_has_the_bound_of_the_table():
    assert f"{arctan.BOUND:.3f} LSB" in source_of("arctan_table").read_text()


@pytest.mark.parametrize("w", [8, 16])
def test_arctan_table(w):
    run("arctan_table", __file__, W=w)
