# SPDX-License-Identifier: Apache-2.0
"""uart_tx: the waveform by hand, exact bit edges, the line driver, gaps, and our receiver and
sigrok as listeners.
"""

import random
from fractions import Fraction

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import clk_now, run, start
from tb.ports import Ports
from tb.serial.uart_rx import UartRx, character
from tb.serial.uart_tx import UartTx
from tools import sigrok

OFFERED = {"valid": 1, "data": 8, "ninth": 1}  # {port: bits}
BIT_TIMES = [128, 133, 256, 271, 555]  # 1/16 cycle: 8 cycles, …, 115 200 baud at 4 MHz


async def begin(dut, bit_time):
    await start(dut, valid=0, data=0, ninth=0, bit_time=bit_time)
    dut.rst.value = 1
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)
    dut.rst.value = 0


async def send(dut, queue, bit_time, clks=None, model=None, gaps=False):
    """Offer the characters; return (tx, driver_enable) of every cycle until the line is free again,
    or of `clks` cycles.
    """
    queue, waves, last, wait, taken = list(queue), [], None, 0, 0
    dut.bit_time.value = bit_time
    while len(waves) != clks and (clks or queue or not waves or waves[-1][1]):
        if taken and last[0]:
            queue.pop(0)
            wait = random.choice([0, 0, random.randrange(400)]) if gaps else 0
        wait = max(wait - 1, 0)
        offer = (1, *queue[0]) if queue and not wait else (0, 0, 0)
        if offer != last:
            dut.valid.value, dut.data.value, dut.ninth.value = last = offer
        taken = int(dut.ready.value)
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        ready, tx, enable = int(dut.ready.value), int(dut.tx.value), int(dut.driver_enable.value)
        waves.append((tx, enable))
        assert int(dut.busy.value) == enable
        if model:
            got, want = (ready, tx, enable), model.step(*offer, bit_time)
            assert got == want, (
                f"cycle {len(waves)}: (ready, tx, driver_enable) is {got}, the model has {want}"
            )
    return waves


def lengths(levels):
    """Runs of equal levels as (level, cycles)."""
    runs = []
    for level in levels:
        runs = (
            [*runs[:-1], (level, runs[-1][1] + 1)]
            if runs and runs[-1][0] == level
            else [*runs, (level, 1)]
        )
    return runs


@cocotb.test()
async def the_waveform_of_one_character_is_as_drawn_by_hand(dut):
    await begin(dut, 256)
    waves = await send(dut, [(0x12, 1)], 256)
    lead = [1] * 18
    bits = [0] + [0, 1, 0, 0, 1, 0, 0, 0] + [1] + [1]  # start, 0x12 LSB first, 9th, stop
    driven = [tx for tx, enable in waves if enable]
    assert driven[: 18 + 16 * 11] == lead + [b for b in bits for _ in range(16)]


@cocotb.test()
async def the_driver_leads_by_a_bit_and_trails_by_half_a_bit(dut):
    for bit_time in BIT_TIMES:
        await begin(dut, bit_time)
        waves = [tx for tx, enable in await send(dut, [(0xFF, 1)], bit_time) if enable]
        bit = Fraction(bit_time, 16)
        lead = waves.index(0)
        assert bit <= lead <= bit * 9 / 8 + 1
        assert bit / 2 <= len(waves) - lead - 11 * bit <= bit * 5 / 8 + 2


@cocotb.test()
async def latency_is_1_from_idle_to_driver_enable(dut):
    await begin(dut, 256)
    assert [enable for _, enable in await send(dut, [], 256, clks=3)] == [0, 0, 0]
    assert [enable for _, enable in await send(dut, [(0, 0)], 256, clks=2)] == [1, 1]


@cocotb.test()
async def characters_follow_without_a_gap_and_edges_never_drift(dut):
    for bit_time in BIT_TIMES:
        await begin(dut, bit_time)
        sent = [(random.getrandbits(8), random.getrandbits(1)) for _ in range(8)]
        waves = [tx for tx, enable in await send(dut, sent, bit_time) if enable]
        levels = [b for c in sent for b in character(*c)]
        lead = waves.index(0)
        # the start bit began at a time between lead and lead + 31/16 cycle; all later edges must
        # agree with one such time
        assert any(
            all(
                waves[lead + (n * bit_time + part) // 16] == level for n, level in enumerate(levels)
            )
            and all(
                waves[lead + ((n + 1) * bit_time + part) // 16 - 1] == level
                for n, level in enumerate(levels)
            )
            for part in range(32)
        )


@cocotb.test()
async def a_character_offered_while_the_driver_is_still_on_needs_no_lead(dut):
    await begin(dut, 256)
    first = await send(dut, [(0x00, 0)], 256, clks=1 + 18 + 16 * 11 + 4)
    assert first[-1] == (1, 1)
    assert (await send(dut, [(0x00, 0)], 256, clks=1))[0] == (0, 1)


@cocotb.test()
async def a_withdrawn_offer_sends_nothing(dut):
    await begin(dut, 128)
    await send(dut, [(0x00, 0)], 128, clks=3)
    assert all(tx for tx, _ in await send(dut, [], 128))


@cocotb.test()
async def reset_releases_the_line(dut):
    await begin(dut, 256)
    assert (await send(dut, [(0x00, 0)], 256, clks=60))[-1] == (0, 1)
    dut.rst.value, dut.valid.value = 1, 0
    await FallingEdge(dut.clk)
    assert (int(dut.tx.value), int(dut.driver_enable.value)) == (1, 0)
    dut.rst.value = 0
    waves = await send(dut, [(0x5A, 0)], 256)
    assert waves[0] == (1, 1) and [tx for tx, _ in waves[1 + 18 :: 16]][:11] == character(0x5A, 0)


@cocotb.test()
async def less_than_8_cycles_count_as_8_more_and_the_longest_bit_does_not_overflow(dut):
    for bit_time, cycles in ((0, 8), (64, 12)):
        await begin(dut, bit_time)
        assert lengths(tx for tx, _ in await send(dut, [(0x55, 0)], bit_time))[1:9] == [
            (n & 1, cycles) for n in range(8)
        ]
    await begin(dut, (1 << 20) - 1)
    assert set(await send(dut, [(0, 0)], (1 << 20) - 1, clks=300)) == {(1, 1)}
    for bit_time in (0x55555, 0xAAAAA):  # any bit of bit_time counts
        await begin(dut, bit_time)
        dut.bit_time.value, dut.valid.value, dut.data.value = bit_time, 1, 1
        await FallingEdge(dut.tx)
        began = clk_now()
        await RisingEdge(dut.tx)
        assert abs(clk_now() - began - bit_time / 16) <= 1
        dut.valid.value = 0


@cocotb.test()
async def our_receiver_receives_what_was_sent(dut):
    for bit_time in BIT_TIMES:
        await begin(dut, bit_time)
        sent, model = [(random.getrandbits(8), random.getrandbits(1)) for _ in range(6)], UartRx()
        heard = [model.step(tx, bit_time) for tx, _ in await send(dut, sent, bit_time, gaps=True)]
        assert [h[1:3] for h in heard if h[0]] == sent and not any(h[3] or h[4] for h in heard)


@cocotb.test()
async def any_offer_matches_the_model(dut):
    for bit_time in BIT_TIMES:
        await begin(dut, bit_time)
        sent = [(random.getrandbits(8), random.getrandbits(1)) for _ in range(12)]
        await send(dut, sent, bit_time, model=UartTx(), gaps=True)


@cocotb.test()
async def any_levels_match_the_model(dut):
    """Offers that are withdrawn, or come while the driver is still on; and resets."""
    ports = Ports(dut)
    for bit_time in (133, 200):
        await begin(dut, bit_time)
        model, holds = UartTx(), 0
        for n in range(4000):
            if holds == 0:
                inputs = {name: random.getrandbits(bits) for name, bits in OFFERED.items()}
                holds = random.randrange(1, random.choice([6, 6, 6, 250]))
            holds -= 1
            inputs["rst"] = int(random.random() < 0.002)
            ports.drive(inputs)
            await RisingEdge(dut.clk)
            await FallingEdge(dut.clk)
            levels = model.step(**inputs, bit_time=bit_time)
            ports.check(dict(zip(("ready", "tx", "driver_enable"), levels)), n)


def heard(waves, options):
    return sigrok.uart(bytes(waves), 4_000_000, f"baudrate=115200:{options}")


@cocotb.test(skip=not sigrok.installed())
async def sigrok_reads_nine_bits_and_the_ninth_as_odd_parity(dut):
    """At 115 200 baud and 4 MHz. The command bytes of S0 have an odd parity bit of 1, so that a PC
    without a 9-bit mode can send them.
    """
    await begin(dut, 555)
    sent = [(0x00, 0), (0xFF, 1), (0x55, 1), (0xAA, 0)] + [
        (random.getrandbits(8), random.getrandbits(1)) for _ in range(20)
    ]
    waves = [tx for tx, _ in await send(dut, sent, 555)]
    assert heard(waves, "data_bits=9:parity=none") == [
        f"{ninth << 8 | data:03X}" for data, ninth in sent
    ]
    commands = [d54 << 4 | address for d54 in (1, 2) for address in (1, 2, 4, 7, 8, 11, 13, 14)]
    waves = [tx for tx, _ in await send(dut, [(c, 1) for c in commands], 555)]
    assert heard(waves, "data_bits=8:parity=odd") == [f"{c:02X}" for c in commands]
    waves = [
        tx for tx, _ in await send(dut, [(0x13, 1)], 555)
    ]  # 3 has an even number of ones: no odd parity
    assert "13" in (found := heard(waves, "data_bits=8:parity=odd")) and len(found) == 2


def test_uart_tx():
    run("uart_tx", __file__)
