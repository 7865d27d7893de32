# SPDX-License-Identifier: Apache-2.0
"""relay_requests: each request by hand, repetitions, damaged and early requests, and random strobes
against the model.
"""

import random
from itertools import product

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.relay.relay_requests import BEGIN_SET, CLEAR, FLASH, SET, RelayRequests
from tb.serial.frame_check import FrameCheck, frame

STATUS = 0
INPUTS = (
    "valid",
    "data",
    "command",
    "good",
    "events",
    "levels",
    "source",
    "orders",
    "identity",
    "position",
    "correction",
    "pass_ready",
    "pass_done",
    "pass_data",
    "answer_ready",
)
IDLE = dict.fromkeys(INPUTS, 0)


class Requests:
    """The design, compared with the model in every cycle; its inputs are frames, its outputs a chip
    and a slow bus.
    """

    def __init__(self, dut):
        self.dut, self.model, self.last = dut, RelayRequests(), {}
        self.sent, self.set, self.chip, self.answers, self.waits = (
            bytearray(),
            [],
            bytearray(),
            3,
            None,
        )

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        return self

    async def clk(self, **inputs):
        dut, model = self.dut, self.model
        values = {
            **IDLE,
            "rst": 0,
            "answer_ready": int(random.randrange(self.answers) == 0),
            **inputs,
        }
        if "pass_ready" not in inputs:
            values["pass_ready"] = int(model.pass_select and self.waits is None)
        if self.waits == 0:
            values.update(pass_done=1, pass_data=self.chip[-1] ^ 0xFF)
        self.waits = self.waits - 1 if self.waits else None
        for name, level in values.items():
            if self.last.get(name) != level:
                getattr(dut, name).value = level
        self.last = values
        if model.answer_valid and values["answer_ready"]:
            self.sent.append(int(dut.answer.value))
        model.clk(**values)
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        for name in (
            "flags",
            "set_start",
            "set_valid",
            "pass_select",
            "pass_valid",
            "answer_valid",
        ):
            got, want = int(getattr(dut, name).value), int(getattr(model, name))
            assert got == want, f"{values}: {name} is {got}, the model has {want} in {model.state}"
        if model.answer_valid:
            assert int(dut.answer.value) == model.answer
        if model.set_start:
            self.set.append("start")
        if model.set_valid or model.pass_valid:
            assert int(dut.set_data.value) == model.set_data
            (self.set if model.set_valid else self.chip).append(model.set_data)
        if model.pass_valid:
            self.waits = 2

    async def send(self, words, gaps=0, **levels):
        check = FrameCheck()
        for data, command in words:
            passed, good, _, _ = check.word(1, data, command)
            await self.clk(valid=passed, data=data, command=command, good=good, **levels)
            for _ in range(gaps):
                await self.clk(data=random.getrandbits(8), **levels)

    async def request(self, *body, **levels):
        """Send a request; returns the body of the answer, or None if there is no answer."""
        self.sent = bytearray()
        await self.send(frame(0x21, body), **levels)
        for _ in range(4):
            await self.clk(**levels)
        clks = 0
        while self.model.state != "receive":
            await self.clk(**levels)
            clks += 1
            assert clks < 4000
        if not self.sent:
            return None
        words = frame(0x61, self.sent[2:-4])
        assert [byte for byte, _ in words] == list(self.sent)
        return bytes(self.sent[2:-4])


def checked(words):
    """(data, command, good) of each word of a frame, as frame_check passes them on."""
    check = FrameCheck()
    return [(*word, check.word(1, *word)[1]) for word in words]


@cocotb.test()
async def status_by_hand(dut):
    host = await Requests(dut).reset()
    await host.clk(events=0x05)
    answer = await host.request(
        9,
        STATUS,
        levels=0x0B,
        source=2,
        orders=32,
        identity=0x11223344,
        position=0x55667788,
        correction=-2 & 0xFFFFFFFF,
    )
    assert answer == bytes(
        [9, 0, 5, 0x0B, 130, 0x44, 0x33, 0x22, 0x11, 0x88, 0x77, 0x66, 0x55, 0xFE, 0xFF, 0xFF, 0xFF]
    )


@cocotb.test()
async def latency_is_2_for_each_byte_and_3_more_to_the_answer(dut):
    host = await Requests(dut).reset()
    for length in (2, 3, 10):
        await host.send(frame(0x21, [length, STATUS, *[0] * (length - 2)]), answer_ready=0)
        clks = 0
        while not dut.answer_valid.value:
            await host.clk(answer_ready=0)
            clks += 1
        assert clks == 2 * length + 1
        while host.model.state != "receive":
            await host.clk()


@cocotb.test()
async def flags_fall_that_are_named_and_no_others(dut):
    host = await Requests(dut).reset()
    await host.clk(events=0xFF)
    assert (await host.request(1, CLEAR, 0x0F))[2] == 0xF0
    assert (await host.request(2, CLEAR, 0xC0, events=0x40))[2] == 0x70
    assert (await host.request(3, CLEAR))[2] == 0x70


@cocotb.test()
async def a_set_passes_byte_by_byte(dut):
    host = await Requests(dut).reset()
    assert (await host.request(1, BEGIN_SET, 10, 20, 30))[:2] == bytes([1, BEGIN_SET])
    assert await host.request(2, SET, 40) and host.set == ["start", 10, 20, 30, 40]


@cocotb.test()
async def a_repeated_request_is_answered_and_not_acted_on(dut):
    host = await Requests(dut).reset()
    for _ in range(3):
        assert (await host.request(0, BEGIN_SET, 1, 2))[:2] == bytes([0, BEGIN_SET])
    for _ in range(3):
        assert (await host.request(1, SET, 3))[:2] == bytes([1, SET])
    assert host.set == ["start", 1, 2, 3]
    await host.clk(events=0x03)
    assert (await host.request(2, CLEAR, 0x01))[2] == 0x02
    await host.clk(events=0x01)
    assert (await host.request(2, CLEAR, 0x01))[2] == 0x03
    assert (await host.request(3, CLEAR, 0x01))[2] == 0x02


@cocotb.test()
async def the_first_request_after_reset_repeats_nothing(dut):
    for _ in range(2):
        host = await Requests(dut).reset()
        assert await host.request(7, BEGIN_SET, 5) and host.set == ["start", 5]


@cocotb.test()
async def flash_bytes_go_out_and_back_and_wait_until_the_chip_is_free(dut):
    host = await Requests(dut).reset()
    assert await host.request(5, FLASH, 0x9F, 0, 1) == bytes([5, FLASH, 0x60, 0xFF, 0xFE])
    assert bytes(host.chip) == bytes([0x9F, 0, 1])
    await host.send(frame(0x21, [6, FLASH, 3]))
    for _ in range(50):
        await host.clk(pass_ready=0)
    assert len(host.chip) == 3 and host.model.pass_select
    while host.model.state != "receive":
        await host.clk()
    assert host.chip[3:] == b"\x03"
    longest = bytes(range(62))
    assert await host.request(8, FLASH, *longest) == bytes([8, FLASH]) + bytes(
        byte ^ 0xFF for byte in longest
    )


@cocotb.test()
async def neither_unknown_kinds_nor_empty_requests_have_an_answer(dut):
    host = await Requests(dut).reset()
    for body in ([1, 5], [2, 255, 1, 2], [3]):
        assert await host.request(*body) is None
    assert await host.request(4, STATUS) and not host.set and not host.chip


@cocotb.test()
async def a_kind_that_differs_from_a_known_one_by_a_high_bit_is_unknown(dut):
    host = await Requests(dut).reset()
    await host.clk(events=0xFF)
    kinds = product((CLEAR, BEGIN_SET, SET, FLASH), range(3, 8))
    for sequence, (kind, bit) in enumerate(kinds):
        assert await host.request(sequence, kind | 1 << bit, 0xFF) is None
    assert (await host.request(99, STATUS))[2] == 0xFF and not host.set and not host.chip


@cocotb.test()
async def the_first_byte_of_the_flags_to_clear_counts_and_no_later_one(dut):
    host = await Requests(dut).reset()
    await host.clk(events=0xFF)
    assert (await host.request(1, CLEAR, 0x01, *[0xFF] * 60))[2] == 0xFE


@cocotb.test()
async def a_frame_that_begins_before_the_answer_is_out_is_dropped_whole(dut):
    host = await Requests(dut).reset()
    for early in range(1, 9):
        await host.send(frame(0x21, [early, STATUS]))
        words = frame(0x21, [100 + early, BEGIN_SET, 1])
        await host.send(words[:early])
        while host.model.state != "receive":
            await host.clk(answer_ready=1)
        for data, command, good in checked(words)[early:]:
            await host.clk(valid=1, data=data, command=command, good=good)
        for _ in range(20):
            await host.clk()
    assert not host.set and await host.request(50, STATUS)


@cocotb.test()
async def a_broken_frame_moves_nothing(dut):
    host = await Requests(dut).reset()
    complete = frame(0x21, [1, BEGIN_SET, 1, 2])
    for n in range(1, len(complete)):
        broken = list(complete)
        broken[n] = broken[n][0] ^ 1 << random.randrange(8), 0
        await host.send(broken)
        for _ in range(20):
            await host.clk()
    assert not host.set and not host.sent


@cocotb.test()
async def reset_in_mid_flow(dut):
    host = await Requests(dut).reset()
    for wait, kind in product(range(60), (STATUS, BEGIN_SET, FLASH)):
        await host.clk(events=1)
        await host.send(frame(0x21, [2, kind, 2, 3]))  # no repetition
        for _ in range(wait):
            await host.clk()
        host.waits = None
        await host.clk(rst=1)
        assert host.model.flags == 0 and not dut.answer_valid.value
        assert (await host.request(1, STATUS))[2] == 0


@cocotb.test()
async def reset_forgets_the_frame_that_has_begun(dut):
    host = await Requests(dut).reset()
    for n, (data, command, good) in enumerate(checked(frame(0x21, [1, STATUS]))):
        await host.clk(rst=int(n == 3))
        await host.clk(valid=1, data=data, command=command, good=good)
    for _ in range(20):
        await host.clk(answer_ready=1)
    assert not host.sent


@cocotb.test()
async def any_strobes_match_the_model(dut):
    host = await Requests(dut).reset()
    for _ in range(120):
        host.answers = random.choice((1, 2, 9))
        body = [
            random.choice((0, 1, 0x7E, 0x81, 0xFF)),
            random.choice((0, 1, 2, 3, 4, 9)),
            *random.randbytes(random.randrange(12)),
        ]
        levels = dict(
            events=random.choice((0, 0, random.getrandbits(8))),
            levels=random.getrandbits(8),
            source=random.randrange(3),
            orders=random.getrandbits(6),
            identity=random.getrandbits(32),
            position=random.getrandbits(32),
            correction=random.getrandbits(32),
        )
        words = frame(random.choice((0x21, 0x21, 0x11)), body)
        await host.send(
            words[: random.choice((len(words), len(words), random.randrange(1, len(words))))],
            random.randrange(2),
            **levels,
        )
        for _ in range(random.choice((0, 5, 400))):
            await host.clk(**levels)


def test_relay_requests():
    run("relay_requests", __file__)
