# SPDX-License-Identifier: Apache-2.0
"""frame_check behind the address filter: whole frames, every flip of one or two bits,
interruptions, lengths, and noise.

The model stands in for the filter; test_address_filter holds it equal to the design in every cycle.
"""

import random
import zlib
from itertools import combinations

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.serial.address_filter import AddressFilter
from tb.serial.frame_check import CYCLES, FrameCheck, frame

NODE = 5
ERROR = "framing error"


class Bus:
    """The words of the bus go through the filter into the design, which has its model beside it in
    every cycle.
    """

    def __init__(self, dut):
        self.dut, self.filter, self.model, self.cycles, self.last = (
            dut,
            AddressFilter(),
            FrameCheck(),
            0,
            None,
        )

    async def clk(self, valid=0, data=0, command=0, framing_error=0, rst=0):
        """One cycle; returns (valid, data, command, good, frame_good, frame_bad, sync) after it."""
        dut, inputs = self.dut, (valid, data, command, framing_error, rst)
        if inputs != self.last:
            self.last = inputs
            (
                dut.valid_in.value,
                dut.data.value,
                dut.command.value,
                dut.framing_error.value,
                dut.rst.value,
            ) = inputs
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        self.cycles += 1
        want = self.model.step(*inputs)
        outputs = dut.valid, dut.good, dut.frame_good, dut.frame_bad, dut.sync
        got = [None if w is None else int(x.value) for x, w in zip(outputs, want, strict=True)]
        assert got == list(want), (
            f"cycle {self.cycles}: (valid, good, frame_good, frame_bad, sync) is {got}, "
            f"the model has {want}"
        )
        return got[0], data, command, *got[1:]

    async def word(self, data, ninth, gap=0):
        """A word through the filter, and the cycles that it takes. Returns whether it passed with
        its data, and the sums of the strobes.
        """
        valid = self.filter.step(NODE, 1, data, ninth)
        got = [await self.clk(valid, data, ninth)]
        got += [await self.clk(0, data, ninth) for _ in range(CYCLES + gap)]
        passed = [(data, ninth, g[3]) for g in got if g[0]]
        return passed, *(sum(g[n] for g in got) for n in (4, 5, 6))

    async def send(self, words):
        """Send the words; return those that passed, and how many frames were good and bad."""
        out, good, bad = [], 0, 0
        for word in words:
            if word == ERROR:
                bad += (await self.clk(framing_error=1))[5]
                continue
            passed, new_good, new_bad, _ = await self.word(*word)
            out, good, bad = out + passed, good + new_good, bad + new_bad
        return out, good, bad


async def begin(dut):
    await start(dut, valid_in=0, data=0, command=0, framing_error=0)
    bus = Bus(dut)
    await bus.clk(rst=1)
    return bus


@cocotb.test()
async def only_a_good_frame_for_all_nodes_is_a_sync(dut):
    bus = await begin(dut)
    for command, spoil, syncs in ((0x20, 0, 1), (0x20, 1, 0), (0x20 | NODE, 0, 0), (0x20, 0, 1)):
        words = frame(command, b"\x07")
        words[-1] = (words[-1][0] ^ spoil, 0)
        seen = [(await bus.word(*word))[3] for word in words]
        assert sum(seen) == syncs == seen[-1]


def passed(words, good=1):
    """The words of a frame as they leave the design: good comes with the last one."""
    return [
        (data, command, int(good and n == len(words) - 1))
        for n, (data, command) in enumerate(words)
    ]


@cocotb.test()
async def a_frame_written_by_hand_passes(dut):
    bus = await begin(dut)
    words = [(0x25, 1), (2, 0), (7, 0), (1, 0)] + [(b, 0) for b in (0x2F, 0xF2, 0x6A, 0x8D)]
    assert frame(0x25, [7, 1]) == words
    assert await bus.send(words) == (passed(words), 1, 0)


@cocotb.test()
async def latency_is_9_with_good_at_the_last_byte_and_10_to_sync(dut):
    bus = await begin(dut)
    *most, last = frame(0x20, [1, 2, 3])
    for word in most:
        assert await bus.word(*word) == ([(*word, 0)], 0, 0, 0)
    await bus.clk(1, *last)
    for _ in range(7):
        assert (await bus.clk(0, *last))[0] == 0
    assert await bus.clk(0, *last) == (1, *last, 1, 1, 0, 0)
    assert await bus.clk(0, *last) == (0, *last, None, 0, 0, 1)


@cocotb.test()
async def every_length_from_1_to_64_is_good_and_any_other_is_bad_at_once(dut):
    bus = await begin(dut)
    for length in (1, 2, 17, 63, 64):
        words = frame(0x25, random.randbytes(length))
        assert await bus.send(words) == (passed(words), 1, 0)
    for length in (0, 65, 69, 127, 128, 192, 255):
        words = [(0x25, 1), (length, 0)]
        assert await bus.send(words) == (passed(words, 0), 0, 1)
        assert await bus.send([(0, 0)] * 4) == ([], 0, 0)


@cocotb.test()
async def a_wrong_length_byte_is_never_a_good_frame(dut):
    bus = await begin(dut)
    body = random.randbytes(20)
    words = frame(0x25, body)
    for length in range(1, 65):
        if length != len(body):
            more = [(random.getrandbits(8), 0) for _ in range(max(length - len(body), 0))]
            assert (await bus.send([words[0], (length, 0), *words[2:], *more]))[1:] == (0, 1)


@cocotb.test()
async def no_flip_of_one_or_two_bits_is_ever_good_and_the_next_frame_is(dut):
    """Flips of the 9th bits included."""
    bus = await begin(dut)
    words = frame(0x25, [0x12, 0x00])
    bits = [(n, bit) for n in range(len(words)) for bit in range(9)]
    pairs = list(combinations(bits, 2))
    flips = [(b,) for b in bits] + random.sample(pairs, len(pairs) // 8)
    for k, flip in enumerate(flips):
        bent = [word[0] | word[1] << 8 for word in words]
        for n, bit in flip:
            bent[n] ^= 1 << bit
        assert (await bus.send([(b & 255, b >> 8) for b in bent]))[1] == 0, (
            f"flipped (word, bit): {flip}"
        )
        if len(flip) == 1 or k % 10 == 0:
            assert (await bus.send(words))[1] == 1, (
                f"the frame after the flipped (word, bit): {flip}"
            )


def with_remainder_off(words, bit):
    """The words with a CRC that leaves a remainder with only this bit wrong. The remainder is
    linear in the flips of the four CRC bytes, so those flips are found by elimination.
    """
    data = bytes(word[0] for word in words)
    remainder = lambda flips: zlib.crc32(
        data[:-4] + (int.from_bytes(data[-4:], "little") ^ flips).to_bytes(4, "little")
    )
    base, rows = (
        remainder(0),
        {},
    )  # rows: {highest bit of a change of the remainder: (change, flips)}
    for n in range(32):
        change, flips = remainder(1 << n) ^ base, 1 << n
        while change.bit_length() in rows:
            row = rows[change.bit_length()]
            change, flips = change ^ row[0], flips ^ row[1]
        rows[change.bit_length()] = change, flips
    change, flips = 1 << bit, 0
    while change:
        row = rows[change.bit_length()]
        change, flips = change ^ row[0], flips ^ row[1]
    assert remainder(flips) ^ base == 1 << bit
    return words[:-4] + [
        (byte, 0) for byte in (int.from_bytes(data[-4:], "little") ^ flips).to_bytes(4, "little")
    ]


def with_crc_off(words, bit):
    """The words with one bit of the CRC flipped."""
    data, command = words[bit // 8 - 4]
    words = list(words)
    words[bit // 8 - 4] = data ^ 1 << bit % 8, command
    return words


@cocotb.test()
async def each_of_the_32_bits_of_the_crc_and_of_the_remainder_is_compared(dut):
    bus = await begin(dut)
    for bit in range(32):
        words = frame(0x25, random.randbytes(random.choice((1, 5, 64))))
        for wrong in (with_crc_off(words, bit), with_remainder_off(words, bit)):
            assert (await bus.send(wrong))[1:] == (0, 1), f"bit {bit}"
        assert (await bus.send(words))[1:] == (1, 0)


@cocotb.test()
async def an_interrupted_frame_is_bad_once_and_the_next_frame_is_good(dut):
    bus = await begin(dut)
    words = frame(0x25, [1, 2, 3, 4])
    for n in range(1, len(words)):
        assert await bus.send(words[:n]) == (passed(words[:n], 0), 0, 0)
        assert await bus.send(words) == (passed(words), 1, 1)  # by a command byte
        assert (await bus.send([*words[:n], ERROR]))[1:] == (0, 1)  # by a lost character
        assert await bus.send(words[n:]) == ([], 0, 0)  # the words that are left are dropped
        assert await bus.send([*words[:n], (0x15, 1)]) == (
            passed([*words[:n], (0x15, 1)], 0),
            0,
            1,
        )
        assert await bus.send(words) == (passed(words), 1, 0)


@cocotb.test()
async def a_framing_error_outside_a_frame_is_no_bad_frame(dut):
    bus = await begin(dut)
    words = frame(0x25, [9])
    assert (await bus.send([ERROR, *words, ERROR, (0x15, 1), ERROR]))[1:] == (1, 0)


@cocotb.test()
async def a_read_command_has_no_frame_and_words_outside_a_frame_are_dropped(dut):
    bus = await begin(dut)
    assert await bus.send([(0x15, 1), (1, 0), (2, 0)]) == ([(0x15, 1, 0)], 0, 0)
    words = frame(0x25, [1])
    assert await bus.send([*words, (1, 0), (2, 0)]) == (passed(words), 1, 0)


@cocotb.test()
async def frames_for_other_nodes_change_nothing(dut):
    bus = await begin(dut)
    for address in range(1, 16):
        if address != NODE:
            assert await bus.send([*frame(0x20 | address, [1, 2, 3]), (0x10 | address, 1)]) == (
                [],
                0,
                0,
            )
    assert (await bus.send(frame(0x25, [1, 2, 3])))[1:] == (1, 0)


@cocotb.test()
async def reset_in_a_frame_drops_it(dut):
    bus = await begin(dut)
    words = frame(0x25, [1, 2, 3])
    await bus.send(words[:4])
    await bus.clk(rst=1)
    assert await bus.send(words[4:]) == ([], 0, 0)
    assert (await bus.send(words))[1:] == (1, 0)


@cocotb.test()
async def any_word_matches_the_model(dut):
    bus = await begin(dut)
    for _ in range(150):
        words = frame(
            random.choice([0x25, 0x25, 0x15, 0x24]), random.randbytes(random.choice([1, 2, 5, 64]))
        )
        if random.getrandbits(1):
            words[random.randrange(len(words))] = (random.getrandbits(8), random.getrandbits(1))
        for word in words[: random.choice([len(words), random.randrange(len(words) + 1)])]:
            while random.random() < 0.1:
                await bus.clk(
                    0,
                    random.getrandbits(8),
                    random.getrandbits(1),
                    int(random.random() < 0.1),
                    int(random.random() < 0.02),
                )
            await bus.word(*word, gap=random.choice([0, 0, random.randrange(9)]))


def test_frame_check():
    run("frame_check", __file__)
