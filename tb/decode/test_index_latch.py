# SPDX-License-Identifier: Apache-2.0
"""Tests of index_latch alone: its latencies, clear in the cycle of the edge, the wrap of the check,
and random inputs against the model. Its work together with a decoder is tested in
test_incremental_encoder.py.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge

from tb.bench import needs, run, start
from tb.decode.index_latch import IndexLatch, Settings

PORTS = [
    "active_low",
    "gate_mask",
    "gate",
    "take_up",
    "take_down",
    "each",
    "clears",
    "counts_per_revolution",
]


async def begin(dut, levels=(0, 0, 0)):
    idle = dict.fromkeys([*PORTS, "arm", "probe", "ready", "direction", "stepping", "count"], 0)
    await start(dut, a=levels[0], b=levels[1], z=levels[2], **idle)
    model = IndexLatch(int(dut.W.value), int(dut.CHECK.value))
    for _ in range(2):
        model.step(Settings(each=0, take_up=0, take_down=0), levels, 0, 0, 0, 0, rst=1)
    return model


async def cycle(
    dut, model, settings, levels, direction=1, stepped=0, count=0, ready=1, arm=0, rst=0, probe=0
):
    """Advance design and model by one cycle; returns (clear in this cycle, then armed, found,
    index_count, revolution_wrong after it).
    """
    for name in PORTS:
        getattr(dut, name).value = getattr(settings, name)
    dut.a.value, dut.b.value, dut.z.value = levels
    dut.direction.value, dut.stepping.value, dut.count.value = direction, abs(stepped), count
    dut.ready.value, dut.arm.value, dut.probe.value, dut.rst.value = ready, arm, probe, rst
    await ReadOnly()
    clear, expected = int(dut.clear.value), model.clear(settings, direction)
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    want = (
        expected,
        *model.step(settings, levels, ready, direction, stepped, count, arm, rst, probe),
    )
    got = (
        clear,
        int(dut.armed.value),
        int(dut.found.value),
        dut.index_count.value.to_signed(),
        int(dut.revolution_wrong.value),
    )
    assert got == want, (
        f"{settings}: (clear, armed, found, index_count, revolution_wrong) is {got}, "
        f"the model has {want}"
    )
    assert (int(dut.a_later.value), int(dut.b_later.value)) == levels[:2]
    return got


@cocotb.test()
async def latency_is_1_from_a_and_b_to_a_later_and_b_later(dut):
    model = await begin(dut)
    for levels in ((0, 0), (1, 0), (1, 1), (0, 1), (1, 0)):
        await cycle(dut, model, Settings(), (*levels, 0))
        assert (int(dut.a_later.value), int(dut.b_later.value)) == levels


@cocotb.test()
async def latency_is_2_from_z_to_found_and_1_to_clear(dut):
    model = await begin(dut)
    settings = Settings(each=1, clears=1)
    await cycle(dut, model, settings, (0, 0, 0))
    rows = [
        await cycle(dut, model, settings, (1, 0, 1), stepped=int(n == 1), count=3 * (n == 1))
        for n in range(4)
    ]
    assert [row[0] for row in rows] == [0, 1, 0, 0]
    assert [row[2] for row in rows] == [0, 1, 0, 0]
    assert rows[1][3] == 4


@cocotb.test()
async def latency_is_4_from_z_to_revolution_wrong_and_distances_wrap(dut):
    needs(int(dut.CHECK.value), "built without the check of revolutions")
    top = 1 << int(dut.W.value) - 1
    for second, wrong in (
        (-top + 4, 0),
        (-top + 5, 1),
    ):  # from top - 1 on: 5 counts up through the wrap, then 6
        model = await begin(dut)
        settings = Settings(each=1, counts_per_revolution=5)
        rows = []
        for count in (top - 1, second):
            await cycle(dut, model, settings, (0, 0, 0))
            rows = [await cycle(dut, model, settings, (0, 0, 1), count=count) for _ in range(6)]
        assert [row[4] for row in rows] == [0, 0, 0, wrong, 0, 0]


@cocotb.test()
async def an_arm_in_the_cycle_of_an_index_is_kept_for_the_next(dut):
    model = await begin(dut)
    settings = Settings()
    await cycle(dut, model, settings, (0, 0, 0), arm=1)
    await cycle(dut, model, settings, (0, 0, 0))
    await cycle(dut, model, settings, (0, 0, 1))
    assert (await cycle(dut, model, settings, (0, 0, 1), arm=1))[1:3] == (1, 1)


@cocotb.test()
async def reset_in_the_middle_of_an_index_forgets_it(dut):
    model = await begin(dut)
    settings = Settings(each=1, clears=1)
    await cycle(dut, model, settings, (0, 0, 0))
    await cycle(dut, model, settings, (0, 0, 1), count=5)
    await cycle(dut, model, settings, (0, 0, 1), count=5, rst=1)
    assert [(await cycle(dut, model, settings, (0, 0, 1), count=5))[1:4] for _ in range(4)] == [
        (0, 0, 0)
    ] * 4


@cocotb.test()
async def latency_is_1_from_probe_to_index_count_with_the_step_of_its_cycle(dut):
    model = await begin(dut)
    for stepped, want in ((0, 5), (1, 6), (-1, 4)):
        row = await cycle(
            dut,
            model,
            Settings(clears=1),
            (0, 0, 0),
            direction=int(stepped >= 0),
            stepped=stepped,
            count=5,
            probe=1,
        )
        assert row[:4] == (0, 0, 0, want)
        assert (await cycle(dut, model, Settings(), (0, 0, 0), count=3))[3] == want


@cocotb.test()
async def a_probe_between_two_indexes_leaves_the_check_of_revolutions_alone(dut):
    needs(int(dut.CHECK.value), "built without the check of revolutions")
    for second, wrong in ((5, 0), (6, 1)):
        model, settings, rows = await begin(dut), Settings(each=1, counts_per_revolution=5), []
        for count in (0, second):
            await cycle(dut, model, settings, (0, 0, 0))
            rows = [await cycle(dut, model, settings, (0, 0, 1), count=count) for _ in range(3)]
            rows += [
                await cycle(dut, model, settings, (0, 0, 1), count=2, probe=1) for _ in range(3)
            ]
        assert sum(row[4] for row in rows) == wrong


@cocotb.test()
async def any_inputs_match_the_model(dut):
    model, top = await begin(dut), 1 << int(dut.W.value) - 1
    bits = random.getrandbits
    for _ in range(80):
        settings = Settings(
            bits(1),
            bits(2) & bits(2),
            bits(2),
            bits(1),
            bits(1),
            bits(1),
            bits(1),
            random.choice([0, 1, 5, top]),
        )
        change = random.choice([2, 4, 8])
        levels = [bits(1), bits(1), bits(1)]
        for _ in range(25):
            levels = [level ^ (random.randrange(change) == 0) for level in levels]
            await cycle(
                dut,
                model,
                settings,
                tuple(levels),
                bits(1),
                0,
                random.choice([0, 5, -1, -top, top - 1]),
                int(random.random() < 0.95),
                int(random.random() < 0.1),
                int(random.random() < 0.01),
                bits(1) & bits(1),
            )
        await cycle(dut, model, settings, tuple(levels), 1, 1, top - 1)
        await cycle(dut, model, settings, tuple(levels), 0, -1, -top)


@pytest.mark.parametrize("w, check", [(32, 1), (4, 1), (16, 0)])
def test_index_latch(w, check):
    run("index_latch", __file__, W=w, CHECK=check)
