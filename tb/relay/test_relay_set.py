# SPDX-License-Identifier: Apache-2.0
"""relay_set: a complete set by hand, each wrong bit is refused, and rows that end anywhere are
compared with the model in every cycle.
"""

import random
import zlib

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import needs, run, start
from tb.relay.relay_set import RelaySet, image

SETTINGS = (
    "counts_per_turn",
    "angle_per_count",
    "minimum_edge_separation",
    "radians_per_count",
    "hysteresis",
    "filter_required",
    "index_gate",
    "index_gate_mask",
    "index_low",
)
WIDTHS = 32, 48, 16, 32, 16, 8, 2, 2, 1


class Bytes:
    """The design, compared with the model in every cycle."""

    def __init__(self, dut):
        self.dut, self.k = dut, int(dut.K.value)
        self.segments = int(dut.SEGMENTS.value)
        self.model, self.written = RelaySet(self.k, self.segments), []

    async def reset(self):
        await start(self.dut, start=0, valid=0, data=0)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        return self

    async def clk(self, **inputs):
        dut = self.dut
        for name in ("rst", "start", "valid", "data"):
            getattr(dut, name).value = inputs.get(name, 0)
        self.model.clk(**inputs)
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        model = self.model
        got = [
            int(x.value) for x in (dut.good, dut.swap, dut.bad, dut.loaded, dut.identity, dut.write)
        ]
        want = [
            int(x)
            for x in (
                model.good,
                model.good,
                model.bad,
                model.loaded,
                model.identity,
                model.write is not None,
            )
        ]
        assert got == want, (
            f"{inputs}: good, swap, bad, loaded, identity, write are {got}, the model has {want}"
        )
        if model.write:
            got = tuple(int(x.value) for x in (dut.term, dut.amplitude, dut.phase))
            assert got == model.write
            self.written.append(got)
        packed, offset = 0, 0
        for name, width in zip(SETTINGS, WIDTHS):
            packed, offset = packed | int(getattr(dut, name).value) << offset, offset + width
        assert packed == model.settings % 2**157

    async def send(self, row, gaps=False):
        """Returns +1 if the set was good, -1 if it was bad, otherwise 0."""
        await self.clk(start=1)
        verdict = 0
        for byte in [*row, None, None, None]:
            await self.clk(**({} if byte is None else dict(valid=1, data=byte)))
            verdict += self.model.good - self.model.bad
            while gaps and random.getrandbits(1):
                await self.clk(data=random.getrandbits(8))
                verdict += self.model.good - self.model.bad
        return verdict


def any_terms(row):
    k = row.k
    if row.segments:
        return [
            (random.randrange(-(2**23), 2**23) % 2**32, random.randrange(-(2**23), 2**23) % 2**32)
            for _ in range(k)
        ]
    reach = 2**29 // k
    return [(random.randrange(1 - reach, reach) % 2**32, random.getrandbits(32)) for _ in range(k)]


@cocotb.test()
async def by_hand(dut):
    row = await Bytes(dut).reset()
    terms = any_terms(row)
    good_set = image(
        terms,
        1 << 15,
        minimum_edge_separation=3,
        hysteresis=0x1234,
        filter_required=4,
        index_low=1,
        gate_mask=3,
        gate=2,
        segments=row.segments,
    )
    assert await row.send(good_set) == 1
    assert row.written == [(n, a, p) for n, (a, p) in enumerate(terms)]
    assert (
        int(dut.counts_per_turn.value) == 32768
        and int(dut.angle_per_count.value) == 1 << 33
        and int(dut.minimum_edge_separation.value) == 3
    )
    assert (
        int(dut.hysteresis.value) == 0x1234
        and int(dut.filter_required.value) == 4
        and int(dut.radians_per_count.value) == 210828714
    )
    assert (
        int(dut.index_low.value),
        int(dut.index_gate_mask.value),
        int(dut.index_gate.value),
    ) == (1, 3, 2)


@cocotb.test()
async def latency_is_2(dut):
    row = await Bytes(dut).reset()
    await row.clk(start=1)
    for byte in image(any_terms(row), 5000, segments=row.segments):
        await row.clk(valid=1, data=byte)
    assert not row.model.good
    await row.clk()
    assert row.model.good


@cocotb.test()
async def no_broken_bit_comes_into_force(dut):
    row = await Bytes(dut).reset()
    good_set = image(any_terms(row), 32768, segments=row.segments)
    assert await row.send(good_set) == 1
    for _ in range(24):
        broken = bytearray(image(any_terms(row), 4000, segments=row.segments))
        for _ in range(random.choice((1, 1, 2, 3))):
            broken[random.randrange(len(broken))] ^= 1 << random.randrange(8)
        assert await row.send(broken, gaps=True) == -1 or bytes(broken) == good_set
    assert int(dut.counts_per_turn.value) == 32768


@cocotb.test()
async def a_set_for_another_number_of_orders_is_refused(dut):
    row = await Bytes(dut).reset()
    other = bytearray(image(any_terms(row), 4000, segments=row.segments)[:-4])
    other[0] ^= 1
    assert await row.send(other + zlib.crc32(other).to_bytes(4, "little")) == -1


@cocotb.test()
async def counts_per_turn_outside_their_range_are_refused(dut):
    row = await Bytes(dut).reset()
    for counts, verdict in (
        (1609, 1),
        (1608, -1),
        (2**25, 1),
        (2**25 + 1, -1),
        (0, -1),
        (2**32 - 1, -1),
    ):
        assert await row.send(image(any_terms(row), counts, segments=row.segments)) == verdict


@cocotb.test()
async def amplitudes_that_may_overflow_the_map_are_refused(dut):
    row = await Bytes(dut).reset()
    needs(not row.segments, "a table has no amplitudes")
    for sign in (1, -1):
        share, remainder = divmod(2**29 - 1, row.k)
        sizes = [share] * (row.k - 1) + [share + remainder]
        words = [size if sign > 0 else ~size % 2**32 for size in sizes]
        assert await row.send(image([(word, 0) for word in words], 32768)) == 1
        for n in {0, row.k - 1}:
            more = list(words)
            more[n] = (more[n] + sign) % 2**32
            assert await row.send(image([(word, 0) for word in more], 32768)) == -1
    for word in (2**31, 2**31 - 1, 2**29):
        assert await row.send(image([(word, 0)] * row.k, 32768)) == -1


@cocotb.test()
async def points_of_128_counts_are_refused(dut):
    row = await Bytes(dut).reset()
    needs(row.segments, "a map of harmonics has no points")
    for value, verdict in (
        (2**23 - 1, 1),
        (2**23, -1),
        (-(2**23), 1),
        (-(2**23) - 1, -1),
        (2**31 - 1, -1),
        (-(2**31), -1),
    ):
        for index in (0, 2 * row.k - 1):
            words = [0] * (2 * row.k)
            words[index] = value
            assert (
                await row.send(
                    image(list(zip(words[::2], words[1::2])), 32768, segments=row.segments)
                )
                == verdict
            )


@cocotb.test()
async def a_set_of_harmonics_for_segments_and_the_other_way_round_is_refused(dut):
    row = await Bytes(dut).reset()
    terms = [(0, 0)] * row.k
    assert await row.send(image(terms, 4000, segments=0 if row.segments else 2 * row.k)) == -1
    assert await row.send(image(terms, 4000, segments=row.segments)) == 1


@cocotb.test()
async def a_row_cut_short_changes_nothing_and_the_next_is_whole(dut):
    row = await Bytes(dut).reset()
    for _ in range(20):
        good_set = image(any_terms(row), random.getrandbits(25) | 4096, segments=row.segments)
        assert await row.send(good_set[: random.randrange(len(good_set))]) == 0
        assert await row.send(good_set) == 1
        assert await row.send(b"") == 0


@cocotb.test()
async def reset_in_mid_flow(dut):
    row = await Bytes(dut).reset()
    good_set = image(any_terms(row), 7777, segments=row.segments)
    for _ in range(10):
        await row.send(good_set)
        await row.send(good_set[: random.randrange(len(good_set))])
        await row.clk(rst=1)
        for byte in good_set:
            await row.clk(valid=1, data=byte)  # without a start nothing is taken
        assert not row.model.loaded and int(dut.counts_per_turn.value) == 0


@cocotb.test()
async def any_strobes_match_the_model(dut):
    row = await Bytes(dut).reset()
    left = []
    for _ in range(3000):
        left = left or list(
            image(
                any_terms(row),
                random.getrandbits(random.choice((25, 32))) | 4096,
                segments=row.segments,
            )
        )
        send = random.randrange(5) > 0
        begin = row.model.row is None and random.randrange(8) == 0 or random.randrange(1500) == 0
        if begin:
            left = list(
                image(
                    any_terms(row),
                    random.getrandbits(random.choice((25, 32))) | 4096,
                    segments=row.segments,
                )
            )
        await row.clk(
            start=int(begin),
            valid=int(send),
            data=left.pop(0) if send and row.model.row is not None and not begin else 7,
            rst=int(random.randrange(3000) == 0),
        )


@pytest.mark.parametrize("k, segments", [(1, 0), (16, 0), (32, 0), (1, 2), (18, 36), (32, 64)])
def test_relay_set(k, segments):
    run("relay_set", __file__, K=k, SEGMENTS=segments)
