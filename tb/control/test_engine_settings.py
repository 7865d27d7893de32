# SPDX-License-Identifier: Apache-2.0
"""engine_settings: settings between the words of the engine, by hand and at random, against the
model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tables.engine_microcode import (
    ADDRESS,
    BANK,
    FILTER,
    OPERANDS,
    RAMP,
    STOP,
)
from tb.bench import run, start
from tb.control.engine_settings import EngineSettings, address_of

IDLE = dict.fromkeys(
    ("setting_write", "setting_axis", "setting_word", "setting_filter", "setting")
    + ("operand", "write", "write_at", "word"),
    0,
)
NONE = 0x70  # an operand that is not in memory


class Settings:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, EngineSettings(int(dut.WORD_W.value))

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, setting=None, rst=0, operand=NONE, write=0, write_at=0, word=0):
        dut = self.dut
        dut.rst.value = rst
        dut.operand.value, dut.write.value = operand, write
        dut.write_at.value, dut.word.value = write_at, word
        dut.setting_write.value = int(setting is not None)
        if setting:
            dut.setting_axis.value, dut.setting_word.value = setting[0], setting[1]
            dut.setting_filter.value, dut.setting.value = setting[2], setting[3] % (1 << 64)
        engine = dict(operand=operand, write=write, write_at=write_at, word=word)
        await Timer(1, "ns")
        got = (
            (int(dut.write_out_at.value), int(dut.word_out.value))
            if int(dut.write_out.value)
            else None
        )
        want = self.model.write_out(**engine)
        assert got == want, f"{engine}: writes {got}, the model {want}"
        waits = self.model.clk(setting, rst, **engine)
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        assert int(dut.waits.value) == waits
        return got


@cocotb.test()
async def latency_is_1_when_the_engine_neither_writes_nor_reads_the_word(dut):
    settings = await Settings(dut).reset()
    assert await settings.clk(setting=(0, 5, 0, -7)) is None
    assert await settings.clk() == (5, (1 << 72) - 7)
    assert await settings.clk() is None


@cocotb.test()
async def a_setting_waits_while_the_engine_writes_or_reads_its_word(dut):
    settings = await Settings(dut).reset()
    await settings.clk(setting=(2, 5, 0, 9))
    assert await settings.clk(write=1, write_at=3, word=1) == (3, 1)
    assert await settings.clk(operand=5) is None
    assert await settings.clk(operand=0x6D) is None  # the same word in a bank
    at = 2 << settings.model.word_w | 5
    assert await settings.clk(operand=6) == (at, 9)


@cocotb.test()
async def random_cycles_match_the_model(dut):
    settings = await Settings(dut).reset()
    word_w = settings.model.word_w
    numbers = [*range(0x50), *(range(0x50, 0x56) if word_w == 8 else ())]
    for _ in range(4000):
        setting = None
        if settings.model.waiting is None and random.random() < 0.3:
            setting = (
                random.randrange(8),
                random.choice(numbers),
                random.randrange(4),
                random.getrandbits(64) - (1 << 63),
            )
        await settings.clk(
            setting,
            rst=int(random.random() < 0.01),
            operand=random.choice((NONE, random.choice(numbers), 0x68 + random.randrange(8))),
            write=random.getrandbits(1),
            write_at=random.getrandbits(word_w + 3),
            word=random.getrandbits(72),
        )


@pytest.mark.parametrize("word_w", [7, 8])
def test_engine_settings(word_w):
    run("engine_settings", __file__, WORD_W=word_w)


def test_the_addresses_are_those_of_the_microcode():
    for name, at in ADDRESS.items():
        if name in OPERANDS and OPERANDS[name] < 0x50:
            assert address_of(OPERANDS[name], 0) == at
    for n, name in enumerate(BANK):  # a word and its shared name end with the same three bits
        assert OPERANDS[name] % 8 == OPERANDS[RAMP[n]] % 8 == OPERANDS[STOP[n]] % 8
    for name, n in FILTER.items():
        assert address_of(OPERANDS[name], 3) == 128 + 48 + n
