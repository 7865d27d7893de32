# SPDX-License-Identifier: Apache-2.0
"""spi_dac: frames as a model of the AD5542A takes them, trim, both ends of the range, 0 V as soon
as the drive is off, refresh, and random commands against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import clk_now, run, start
from tb.drive.spi_dac import SpiDac

FULL = 1 << 15
IDLE = dict(half_period=1, refresh=65535, trim=0, enable=0, valid=0, command=0)


class Ad5542a:
    """An AD5542A with LDAC low: `codes` are those that it took from its pins."""

    def __init__(self):
        self.cs_n, self.sclk, self.bits, self.codes = 1, 0, [], []

    def pins(self, cs_n, sclk, sdi):
        if self.cs_n and not cs_n:
            self.bits = []
        if not cs_n and sclk and not self.sclk:
            self.bits.append(sdi)
        if cs_n and not self.cs_n:
            assert len(self.bits) == 16, f"a frame of {len(self.bits)} bits"
            self.codes.append(int("".join(map(str, self.bits)), 2))
        self.cs_n, self.sclk = cs_n, sclk


class Dac:
    """The design with the model beside it in every cycle, and the DAC on its pins."""

    def __init__(self, dut):
        self.dut, self.model, self.chip, self.inputs = dut, SpiDac(), Ad5542a(), dict(IDLE)

    async def reset(self, **inputs):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.inputs.update(inputs)
        return self

    async def clk(self, rst=0, **inputs):
        self.inputs.update(inputs)
        for name, level in dict(self.inputs, rst=rst).items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        want = self.model.clk(rst=rst, **self.inputs)
        got = tuple(int(getattr(self.dut, pin).value) for pin in ("cs_n", "sclk", "sdi", "sent"))
        assert got == want, f"cs_n, sclk, sdi, sent are {got}, the model has {want}"
        if not rst:
            self.chip.pins(*got[:3])
        self.inputs["valid"] = 0
        return got

    async def run(self, clk, **inputs):
        self.inputs.update(inputs)
        for _ in range(clk):
            await self.clk()

    async def give(self, command, **inputs):
        """Give a command, and return the code that the DAC has taken then."""
        await self.clk(valid=1, command=command, **inputs)
        await self.run(80 * max(1, self.inputs["half_period"]))
        return self.chip.codes[-1]


@cocotb.test()
async def the_codes_are_offset_binary(dut):
    dac = await Dac(dut).reset(enable=1)
    await dac.run(80)
    assert dac.chip.codes == [32768, 32768] or dac.chip.codes == [32768]
    for command, code in (
        (1, 32769),
        (-1, 32767),
        (0x1234, 0x9234),
        (FULL - 1, 65535),
        (-FULL, 0),
        (0, 32768),
    ):
        assert await dac.give(command) == code


@cocotb.test()
async def trim_is_added_and_the_sum_limited_to_16_bits(dut):
    dac = await Dac(dut).reset(enable=1)
    for trim, command, code in (
        (5, 0, 32773),
        (-7, 7, 32768),
        (100, FULL - 50, 65535),
        (-100, -FULL, 0),
        (FULL - 1, FULL - 1, 65535),
        (-FULL, -FULL, 0),
        (-FULL, FULL - 1, 32767),
    ):
        assert await dac.give(command, trim=trim) == code


@cocotb.test()
async def latency_is_half_period_times_33_plus_2(dut):
    dac = await Dac(dut).reset(enable=1)
    for half_period in (1, 2, 7):
        await dac.run(600, half_period=half_period)
        pins, latency = await dac.clk(valid=1, command=-3), 1
        while not pins[3]:
            pins = await dac.clk()
            latency += 1
        assert latency == 33 * half_period + 2 and dac.chip.codes[-1] == 32765


@cocotb.test()
async def a_frame_takes_half_period_times_36_plus_1_and_the_last_command_is_sent(dut):
    dac = await Dac(dut).reset(enable=1)
    await dac.run(200)
    dac.chip.codes.clear()
    for n in range(37 * 8):
        await dac.clk(valid=1, command=n)
    assert len(dac.chip.codes) == 8
    await dac.run(100)
    assert dac.chip.codes[-1] == 32768 + 37 * 8 - 1


@cocotb.test()
async def off_sends_0_v_after_the_running_frame_and_forgets_the_command(dut):
    dac = await Dac(dut).reset(trim=9)
    for wait in (0, 1, 2, 20, 35, 36, 37, 60):
        assert await dac.give(-20000, enable=1) == 12777
        await dac.clk(valid=1, command=20000)
        await dac.run(wait)
        dac.chip.codes.clear()
        await dac.run(75, enable=0)
        assert dac.chip.codes[-1] == 32777 and len(dac.chip.codes) <= 2
        assert await dac.give(5000) == 32777  # while off
        await dac.run(80, enable=1)
        assert dac.chip.codes[-1] == 32777  # and on again: until the next command
        assert await dac.give(1) == 32778


@cocotb.test()
async def the_same_code_is_sent_again_after_refresh(dut):
    dac = await Dac(dut).reset(enable=1)
    await dac.give(77)
    for refresh, period in ((0, 37), (1, 38), (200, 237)):
        await dac.run(300, refresh=refresh)
        dac.chip.codes.clear()
        await dac.run(10 * period)
        assert dac.chip.codes == [32768 + 77] * 10
    await dac.run(300, refresh=65535)
    dac.chip.codes.clear()
    await dac.run(1000, refresh=65535)
    assert dac.chip.codes == []


@cocotb.test()
async def any_bit_of_refresh_counts(dut):
    dac = await Dac(dut).reset(enable=1)
    await dac.give(77)
    for refresh in (0x5555, 0xAAAA):  # the model does not watch these cycles
        dut.refresh.value = refresh
        began = []
        for _ in range(2):
            await FallingEdge(dut.cs_n)
            began.append(clk_now())
        assert began[1] - began[0] == refresh + 37


@cocotb.test()
async def a_half_period_of_0_counts_as_1_and_255_is_the_longest(dut):
    dac = await Dac(dut).reset(enable=1)
    await dac.run(100)
    for half_period, length in ((0, 1), (1, 1), (255, 255)):
        dac.inputs["half_period"] = half_period
        await dac.clk(valid=1, command=-FULL)
        pins, high = await dac.clk(), 0
        while not pins[3]:
            pins = await dac.clk(half_period=3)  # taken with the frame
            high += pins[1]
        assert high == 16 * length and dac.chip.codes[-1] == 0
        await dac.run(4 * 255)


@cocotb.test()
async def reset_in_a_frame_ends_it_and_sends_0_v(dut):
    dac = await Dac(dut).reset(enable=1, half_period=2)
    for wait in (0, 1, 2, 3, 33, 66, 67, 68, 72):
        await dac.clk(valid=1, command=999)
        await dac.run(wait)
        assert await dac.clk(rst=1) == (1, 0, 0, 0)
        dac.chip.__init__()
        await dac.run(160)
        assert set(dac.chip.codes) == {32768}


@cocotb.test()
async def any_commands_match_the_model(dut):
    dac = await Dac(dut).reset(enable=1)
    for _ in range(9000):
        inputs = {}
        if random.randrange(40) == 0:
            inputs.update(
                valid=1, command=random.choice((0, -FULL, FULL - 1, random.randrange(-FULL, FULL)))
            )
        if random.randrange(200) == 0:
            inputs.update(
                half_period=random.choice((0, 1, 2, 3)),
                refresh=random.choice((0, 1, 50, 500)),
                trim=random.randrange(-FULL, FULL),
            )
        if random.randrange(150) == 0:
            inputs["enable"] = int(random.randrange(4) > 0)
        await dac.clk(**inputs)


def test_spi_dac():
    run("spi_dac", __file__)
