# SPDX-License-Identifier: Apache-2.0
"""relay, from pins to pins: it passes the counts on, corrects them, sets its flags, loads sets over
the bus and from flash, and loses no count.
"""

import math
import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from moire.client.relay import (
    BEGIN_SET,
    CLEAR,
    FLASH,
    PIECE,
    SET,
    STATUS,
    Exchange,
    Status,
    identity_of,
)
from tb.bench import run, start, steady_only
from tb.compensate.harmonic_map import exact, term_of
from tb.relay.flash import Flash
from tb.relay.relay_set import image
from twin import crossings

K, FIRST, SECOND = 2, 4096, 8192
BAUD, BIT = 4_800_000, 10  # cycles of a bit: more than the fewest, which act where it is 0
COUNTS = 4000
# The edges of the ring's index come with those of A and B. Behind the synchronisers they may come a
# cycle before or after them, so without a gate the index may be found at the count next to it.
GATED = dict(gate_mask=3, gate=0)
IDLE = dict(encoder_a=0, encoder_b=0, encoder_z=0, rs485_rx=1, flash_sdi=1)
KNOWN, LOADED, CORRECTING, READING = 1, 2, 4, 8
ILLEGAL, WRONG_TURN, MISSING, REJECTED, BEHIND, REFUSED = 1, 2, 4, 8, 16, 32


def some_terms(largest=3.0):
    return [term_of(largest / k, k) for k in range(1, K + 1)]


class Relay:
    """The relay with a ring at its input, a counter at its output, a host and a flash."""

    def __init__(self, dut, chip=None):
        self.dut, self.chip = dut, chip or Flash(1 << 14)
        self.count = 0  # counts of the ring from its index, which is one count wide
        self.counted, self.levels, self.edges = 0, None, []
        self.clks, self.index_at = 0, []
        self.with_index, self.index_low = True, 0
        self.index_counts = (0,)  # of the ring, at which its index is
        self.sequence = 0

    async def power_up(self, count=0):
        self.count = count
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.show()
        self.dut.rst.value = 1
        await self.clk(4)
        self.dut.rst.value = 0
        self.counted, self.levels = count, None
        await self.clk(16)
        return self

    def show(self):
        b = self.count >> 1 & 1
        self.dut.encoder_a.value, self.dut.encoder_b.value = b ^ self.count & 1, b
        index = self.count % COUNTS in self.index_counts and self.with_index
        self.dut.encoder_z.value = int(index) ^ self.index_low

    async def clk(self, count=1):
        dut = self.dut
        for _ in range(count):
            await RisingEdge(dut.clk)
            await FallingEdge(dut.clk)
            self.clks += 1
            dut.flash_sdi.value = self.chip.pins(
                int(dut.flash_chip_n.value), int(dut.flash_sclk.value), int(dut.flash_sdo.value)
            )
            a, b = int(dut.relay_a.value), int(dut.relay_b.value)
            if self.levels is not None and (a, b) != self.levels:
                assert (a != self.levels[0]) != (b != self.levels[1]), "two edges in one clk"
                self.counted += 1 if a ^ self.levels[1] else -1
                self.edges.append(self.clks)
            self.levels = a, b
            if dut.relay_z.value:
                self.index_at.append(self.counted)

    async def go(self, steps, clk_each=2):
        for _ in range(abs(steps)):
            self.count += 1 if steps > 0 else -1
            self.show()
            await self.clk(clk_each)

    async def latencies(self):
        """Cycles from an edge at the input to the edge at the output, four times."""
        await self.go(8, clk_each=30)
        self.edges.clear()
        took = []
        for _ in range(4):
            begin = self.clks
            await self.go(1, clk_each=30)
            took.append(self.edges.pop() - begin)
        return took

    async def booted(self):
        while not int(self.dut.flash_chip_n.value) or self.clks < 2 * 2048 + 2 * 65 * 60:
            await self.clk(50)

    async def send(self, words, stop=1):
        for word in words:
            for level in (0, *(word >> n & 1 for n in range(9)), stop):
                self.dut.rs485_rx.value = level
                await self.clk(BIT)
            self.dut.rs485_rx.value = 1

    async def receive(self, timeout_clk=6000):
        """The words that the relay sends until it switches its driver off."""
        words, waited = [], 0
        while not int(self.dut.rs485_driver_enable.value):
            await self.clk()
            waited += 1
            if waited > timeout_clk:
                return words
        while int(self.dut.rs485_driver_enable.value):
            if int(self.dut.rs485_tx.value):
                await self.clk()
                continue
            await self.clk(BIT // 2)
            bits = []
            for _ in range(10):
                await self.clk(BIT)
                bits.append(int(self.dut.rs485_tx.value))
            words.append(sum(bit << n for n, bit in enumerate(bits[:8])))
            assert bits[8:] == [0, 1], "the ninth bit marks what the host sends"
        return words

    async def request(self, kind, payload=b"", repeat=False):
        """Send a request; returns the answer without sequence and kind, or None if there is no
        answer.
        """
        self.sequence = (self.sequence + (not repeat)) % 256
        exchange = Exchange(bytes([self.sequence, kind]) + payload, tries=1)
        await self.send(exchange.words_to_send())
        words = await self.receive()
        if not words:
            return None
        exchange.feed(words)
        return exchange.result()

    async def status(self):
        return Status.of(await self.request(STATUS))

    async def clear(self, flags=0xFF):
        return Status.of(await self.request(CLEAR, bytes([flags])))

    async def send_set(self, relay_set):
        """Send a set in pieces; returns the status of the last answer."""
        for n in range(0, len(relay_set), PIECE):
            answer = await self.request(SET if n else BEGIN_SET, bytes(relay_set[n : n + PIECE]))
        return Status.of(answer)

    async def with_set(self, relay_set, count=0):
        """Power-up at a count of the ring, and a set."""
        await self.power_up(count)
        await self.booted()
        await self.send_set(relay_set)
        return self

    async def save(self, relay_set, address):
        """Save one copy into an erased sector."""
        for command, at, more in (
            (0x20, address, b""),
            *((0x02, address + n, relay_set[n : n + 32]) for n in range(0, len(relay_set), 32)),
        ):
            await self.request(FLASH, b"\x06")
            await self.request(FLASH, bytes([command]) + at.to_bytes(3, "big") + more)


def corrected(count, terms):
    """The corrected position, counts."""
    return count - exact(terms, count / COUNTS)


@cocotb.test()
async def until_the_index_it_passes_and_says_so_then_it_corrects(dut):
    terms = some_terms()
    relay = await Relay(dut).with_set(image(terms, COUNTS, **GATED), count=COUNTS - 60)
    assert not int(dut.correcting.value)
    await relay.go(50, clk_each=4)
    await relay.clk(40)
    assert relay.counted == relay.count and not int(dut.correcting.value)
    assert (await relay.status()).levels == LOADED
    await relay.go(100, clk_each=4)
    await relay.clk(400)
    assert int(dut.correcting.value) and not int(dut.fault.value)
    for steps in (0, 700, -1500, 333):
        await relay.go(steps)
        await relay.clk(400)
        assert abs(relay.counted - corrected(relay.count, terms)) <= 0.76, (
            relay.count,
            relay.counted,
        )
    status = await relay.status()
    assert (
        status.levels == KNOWN | LOADED | CORRECTING
        and status.flags == 0
        and status.position == relay.count - COUNTS + 60
    )
    found = status.correction, relay.count - corrected(relay.count, terms)
    assert abs(found[0] - found[1]) < 0.05, found


@cocotb.test()
async def it_follows_a_steep_correction_while_the_ring_turns(dut):
    terms = [term_of(300.0, 0.0), (0, 0)]
    relay = await Relay(dut).with_set(image(terms, COUNTS, **GATED), count=-8)
    await relay.go(20, clk_each=4)
    await relay.clk(400)
    for _ in range(500):
        await relay.go(1, clk_each=4)
        behind = relay.counted - corrected(relay.count, terms)
        assert abs(behind) < 6, relay.count  # some cycles late, by up to 3/2 counts in 4 cycles


@cocotb.test()
async def latency_is_10(dut):
    steady_only("a latency to the cycle")
    assert await (await Relay(dut).power_up()).latencies() == [10] * 4


@cocotb.test()
async def z_comes_once_a_turn_where_the_corrected_position_is_zero(dut):
    terms = [term_of(4.0, math.pi / 2), (0, 0)]
    relay = await Relay(dut).with_set(image(terms, COUNTS, hysteresis=0, **GATED), count=-20)
    await relay.go(100, clk_each=4)
    relay.index_at.clear()
    for steps in (-200, 200):
        await relay.go(steps, clk_each=4)
        await relay.clk(30)
    assert set(relay.index_at) == {0}


@cocotb.test()
async def the_outputs_have_the_levels_of_the_ring_before_its_first_edge(dut):
    for count in (1, 3):
        relay = await Relay(dut).power_up(count)
        inputs = int(dut.encoder_a.value), int(dut.encoder_b.value)
        assert relay.levels == inputs and len(relay.edges) == 1, "at once"
        relay.counted = count
        await relay.go(3, clk_each=30)
        assert relay.counted == count + 3


@cocotb.test()
async def a_wide_index_is_taken_where_its_gate_says_whatever_its_level(dut):
    relay = Relay(dut)
    relay.index_counts = COUNTS - 1, 0, 1, 2
    await relay.power_up(count=-8)
    await relay.booted()
    for low, mask, gate, at in ((0, 3, 0, 0), (0, 3, 3, 2), (1, 2, 3, -1), (1, 1, 1, 1)):
        relay.index_low = low
        relay.show()
        await relay.send_set(image([(0, 0)] * K, COUNTS, index_low=low, gate_mask=mask, gate=gate))
        relay.index_at.clear()
        await relay.go(16, clk_each=20)
        assert relay.index_at[-1] == at, (low, mask, gate)
        await relay.go(-16)


@cocotb.test()
async def an_index_on_the_way_down_is_taken_too(dut):
    relay = await Relay(dut).with_set(image(some_terms(), COUNTS, **GATED), count=20)
    await relay.go(-40, clk_each=4)
    assert (await relay.status()).levels == KNOWN | LOADED | CORRECTING


@cocotb.test()
async def a_turn_with_another_number_of_counts_is_flagged(dut):
    relay = await Relay(dut).with_set(image(some_terms(), COUNTS, **GATED), count=-4)
    await relay.go(20)
    await relay.go(COUNTS)
    assert (await relay.status()).flags == 0
    relay.count += 4  # without their edges
    await relay.go(COUNTS)
    assert (await relay.status()).flags == WRONG_TURN
    assert (await relay.clear()).flags == 0


@cocotb.test()
async def the_output_keeps_its_hysteresis_and_its_time_between_two_edges(dut):
    apart = 20  # cycles
    relay = await Relay(dut).power_up(count=-8)
    await relay.booted()
    settings = dict(minimum_edge_separation=apart, hysteresis=0xFFFF, **GATED)
    await relay.send_set(image([(0, 0)] * K, COUNTS, **settings))
    await relay.go(20)
    await relay.clk(20 * apart)
    assert relay.counted == relay.count - 1
    relay.edges.clear()
    await relay.go(-20)
    await relay.clk(20 * apart)
    assert relay.counted == relay.count + 1
    assert {b - a for a, b in zip(relay.edges, relay.edges[1:])} == {apart}
    assert (await relay.status()).flags == BEHIND


@cocotb.test()
async def the_filter_asks_for_samples_in_a_row(dut):
    steady_only("a pattern to the cycle")
    relay = await Relay(dut).with_set(
        image(some_terms(0.001), COUNTS, filter_required=4, **GATED), count=-4
    )
    await relay.go(20, clk_each=8)
    await relay.clk(30)
    relay.edges.clear()
    level = int(dut.encoder_a.value)
    for other in (1, 1, 1, 0, 1):
        dut.encoder_a.value = level ^ other
        await relay.clk()
    relay.show()
    await relay.clk(30)
    assert not relay.edges


@cocotb.test()
async def the_line_counts_as_idle_during_a_reset(dut):
    relay = await Relay(dut).power_up()
    dut.rs485_rx.value, dut.rst.value = 0, 1  # a start bit, once the reset is over
    await relay.clk(8)
    dut.rst.value = 0
    await relay.send(Exchange(bytes([9, STATUS]), tries=1).words_to_send())
    assert await relay.receive()


@cocotb.test()
async def a_missing_index_and_illegal_edges_are_flagged_until_they_are_cleared(dut):
    relay = await Relay(dut).with_set(image(some_terms(), COUNTS, **GATED), count=-4)
    await relay.go(20)
    relay.with_index = False
    relay.index_at.clear()
    await relay.go(COUNTS + 10)
    assert set(relay.index_at) == {COUNTS}, "where it is missing"
    assert int(dut.fault.value) and (await relay.status()).flags == MISSING
    assert (await relay.clear(~MISSING & 0xFF)).flags == MISSING and (
        await relay.clear(MISSING)
    ).flags == 0
    for _ in range(16 if crossings.seed() else 1):  # where A and B may arrive apart, some do not
        relay.count += 2
        relay.show()
        await relay.clk(30)
    assert (await relay.status()).flags & ILLEGAL
    assert not (await relay.clear()).flags & ILLEGAL


@cocotb.test()
async def a_glitch_is_rejected_and_flagged(dut):
    relay = await Relay(dut).with_set(
        image(some_terms(0.001), COUNTS, filter_required=4, **GATED), count=-4
    )
    await relay.go(20, clk_each=8)
    dut.encoder_a.value = 1 - int(dut.encoder_a.value)
    await relay.clk(2)
    relay.show()
    await relay.clk(30)
    assert relay.counted == relay.count and (await relay.status()).flags == REJECTED


@cocotb.test()
async def a_broken_set_is_refused_and_the_one_in_force_stays(dut):
    relay = await Relay(dut).power_up()
    await relay.booted()
    relay_set = image(some_terms(), COUNTS)
    await relay.send_set(relay_set)
    for _ in range(3):
        broken = bytearray(image(some_terms(9.0), COUNTS))
        broken[random.randrange(len(broken))] ^= 1 << random.randrange(8)
        answer = await relay.send_set(broken)
        assert answer.flags == REFUSED and answer.identity == identity_of(relay_set)
        assert (await relay.clear()).flags == 0


@cocotb.test()
async def a_set_whose_pieces_are_asked_for_twice_is_taken_all_the_same(dut):
    relay = await Relay(dut).power_up()
    await relay.booted()
    relay_set = image(some_terms(), COUNTS)
    for n in range(0, len(relay_set), 20):
        for repeat in (False, True, True):
            answer = await relay.request(
                SET if n else BEGIN_SET, relay_set[n : n + 20], repeat=repeat
            )
    assert Status.of(answer).identity == identity_of(relay_set) and Status.of(answer).flags == 0


@cocotb.test()
async def status_tells_the_number_of_orders(dut):
    relay = await Relay(dut).power_up()
    assert (await relay.status()).orders == K


@cocotb.test()
async def flash_bytes_asked_for_while_it_boots_wait_their_turn(dut):
    relay = await Relay(dut).power_up()
    relay.chip.memory[0x3000:0x3002] = b"ok"
    assert (await relay.status()).levels == READING
    exchange = Exchange(bytes([77, FLASH, 0x03, 0x00, 0x30, 0x00, 0, 0]), tries=1)
    await relay.send(exchange.words_to_send())
    exchange.feed(await relay.receive(timeout_clk=20_000))
    assert exchange.result()[4:] == b"ok"


@cocotb.test()
async def a_broken_request_has_no_answer_and_the_next_one_has(dut):
    relay = await Relay(dut).power_up()
    await relay.booted()
    words = Exchange(bytes([9, STATUS])).words_to_send()
    for n in range(len(words)):
        broken = list(words)
        broken[n] ^= 1 << random.randrange(9)
        await relay.send(broken)
        assert await relay.receive(timeout_clk=400) == []
    assert await relay.status()
    assert await relay.request(99) is None


@cocotb.test()
async def a_character_without_a_stop_bit_spoils_a_request_and_a_glitch_does_not(dut):
    relay = await Relay(dut).power_up()
    words = Exchange(bytes([9, STATUS])).words_to_send()
    await relay.send(words[:3])
    await relay.send([0x55], stop=0)
    await relay.clk(2 * BIT)
    await relay.send(words[3:])
    assert await relay.receive(timeout_clk=400) == []
    await relay.send(words[:3])
    dut.rs485_rx.value = 0
    await relay.clk(BIT // 4)
    dut.rs485_rx.value = 1
    await relay.clk(2 * BIT)
    await relay.send(words[3:])
    assert await relay.receive(timeout_clk=400)


@cocotb.test()
async def a_saved_set_comes_back_at_power_up_whenever_power_failed(dut):
    old, new = (image(some_terms(size), COUNTS) for size in (1.0, 2.0))
    chip = Flash(1 << 14)
    for second, power, source in (
        (old, 4096 + 10, 1),
        (new, 4096 + 30, 2),
    ):  # the power failed while the second or the first copy was written
        for address in (FIRST, SECOND):
            chip.memory[address : address + len(old)] = old
        chip.power, chip.asleep = None, True
        relay = await Relay(dut, chip).power_up()
        await relay.booted()
        if second is new:
            chip.memory[SECOND : SECOND + len(new)] = new  # the second copy is written already
        chip.power = power
        await relay.save(new, SECOND if second is old else FIRST)
        chip.power, chip.asleep = None, True
        relay = await Relay(dut, chip).power_up()
        await relay.booted()
        status = await relay.status()
        assert status.source == source and status.levels == LOADED
        assert status.identity == identity_of(new if source == 2 else old)


@cocotb.test()
async def flash_bytes_come_back(dut):
    relay = await Relay(dut).power_up()
    await relay.booted()
    relay.chip.memory[0x3000:0x3004] = b"ring"
    assert (await relay.request(FLASH, bytes([0x03, 0x00, 0x30, 0x00]) + bytes(4)))[4:] == b"ring"


@cocotb.test()
async def reset_in_mid_flow(dut):
    relay = await Relay(dut).with_set(image(some_terms(), COUNTS, **GATED), count=-4)
    await relay.go(30)
    await relay.send(Exchange(bytes([1, BEGIN_SET, 1, 2])).words_to_send()[:4])
    dut.rs485_rx.value = 0  # a start bit
    await relay.clk(2 * BIT)
    dut.rst.value, dut.rs485_rx.value = 1, 1
    for n in range(24):  # the outputs return to the levels of the ring
        dut.rst.value, relay.levels = int(n < 3), None
        await relay.clk()
    assert not int(dut.correcting.value) and not int(dut.fault.value)
    assert (await relay.status()).levels == READING, "also in the middle of a character"
    relay.clks = 0
    await relay.booted()
    assert (await relay.status()).levels == 0


def test_relay():
    run("relay", __file__, K=K, BAUD=BAUD, FIRST=FIRST, SECOND=SECOND)
