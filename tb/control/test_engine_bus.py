# SPDX-License-Identifier: Apache-2.0
"""engine_bus: settings in the units of the engine, the push of a segment, pieces of a stream, what
the soft core waits for, and random words against the model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from moire.made.registers import FIELDS
from tables.microcode.numbers import OPERANDS
from tb.bench import run, start
from tb.control.engine_bus import EngineBus
from tb.control.engine_words import FOUND
from tb.registers.register_layout import RegisterLayout

IDLE = dict(stores=0, address=0, value=0, value_low=0, setting_waits=0, pending=0, moves=0, moved=0)
MOST = 17  # cycles from stores to setting_write
LEVELS = ("setting_waits", "pending", "moves", "moved", "stores")
PIECE = ("piece_axis", "piece_part", "piece_word")


def address_of(block, register, axis=0):
    field = next(f for f in FIELDS if (f.block, f.register) == (block, register))
    return field.address(axis) // 4


class Bus:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.axes = dut, int(dut.AXES.value)
        self.model = EngineBus(self.axes, int(dut.FILTERS.value))

    async def reset(self):
        no_piece = dict.fromkeys((*PIECE, "piece_valid", "streamed"), 0)
        await start(self.dut, **IDLE, **no_piece, ready=1, moved_by=0)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, ready=1, moved_by=None, streamed=0, piece=None, **inputs):
        """Advance one cycle; returns (hold, waits) in it. piece: (axis, part, word) or None."""
        dut, model = self.dut, self.model
        inputs, moved_by = IDLE | inputs, moved_by or [0] * self.axes
        for name, level in inputs.items():
            getattr(dut, name).value = level
        dut.rst.value, dut.ready.value, dut.streamed.value = rst, ready, streamed
        dut.piece_valid.value = int(piece is not None)
        for name, level in zip(PIECE, piece or ()):
            getattr(dut, name).value = level
        dut.moved_by.value = sum((by & (1 << 48) - 1) << 48 * n for n, by in enumerate(moved_by))
        await Timer(1, "ns")
        levels = model.waits(ready, piece=piece, **{name: inputs[name] for name in LEVELS})
        names = ("hold", "waits", "settled", "piece_taken")
        assert tuple(int(getattr(dut, name).value) for name in names) == levels
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        left = {k: v for k, v in inputs.items() if k not in ("pending", "moves")}
        model.clk(rst=rst, moved_by=moved_by, streamed=streamed, piece=piece, **left)
        assert int(dut.setting_write.value) == int(model.setting is not None)
        assert int(dut.gains_changed.value) == model.gains
        assert int(dut.push.value) == model.push
        if model.setting:
            expected = model.setting
            filter = self.setting()[2] if expected[2] is None else expected[2]
            assert self.setting() == (*expected[:2], filter, expected[3])
        if model.shift_by is not None:
            assert dut.shift_by.value.to_signed() == model.shift_by
        return levels[:2]

    def setting(self):
        """(axis, number, filter, value) on the pins."""
        dut = self.dut
        names = ("setting_axis", "setting_word", "setting_filter")
        return (*(int(getattr(dut, n).value) for n in names), dut.setting.value.to_signed())

    async def write(self, block, register, value, axis=0, value_low=0):
        address = address_of(block, register, axis)
        if value_low or register in ("segment_velocity", "step_ratio"):
            address += 1
        await self.clk(stores=1, address=address, value=value, value_low=value_low)
        for self.latency in range(1, MOST + 1):
            if self.latency > 1:
                await self.clk()
            if int(self.dut.setting_write.value):
                found = self.setting()
                await self.clk()
                return found[1], found[3]
        return None


@cocotb.test()
async def latency_is_17_at_most_and_1_for_a_value_of_64_bits(dut):
    bus = await Bus(dut).reset()
    for register, latency in (("kp", 17), ("integral_limit", 5), ("step_ratio", 1)):
        await bus.write("actuator" if register == "step_ratio" else "axis", register, 1)
        assert bus.latency == latency


@cocotb.test()
async def settings_have_the_units_of_the_engine(dut):
    bus = await Bus(dut).reset()
    for block, register, value, name, expected in (
        ("axis", "kp", 77, "kp", 77),
        ("axis", "ka", 3, "ka", 3 << 8),
        ("axis", "output_limit", 0x7FFF, "output_limit", 0x7FFF << 16),
        ("axis", "integral_limit", 0x7FFF, "integral_limit", 0x7FFF << 24),
        ("axis", "stop_deceleration", 0xFFFF_FFFF, "stop_deceleration", 0xFFFF_FFFF << 8),
        ("axis", "feed_override", 65536, "override", 1 << 32),
        ("axis", "feed_override", 65537, "override", 1 << 32),
        ("axis", "feed_override", 65535, "override", 65535 << 16),
        ("axis", "open_command", 0xFFFF_FFFF, "open_command", -1),
        ("axis", "following_limit", 0xFFFF_FFFF, "following_limit", 0xFFFF_FFFF),
        ("feedback", "velocity_quantum", 9, "quantum", 9),
        ("actuator", "step_trim", 8, "trim_scale", 8),
    ):
        assert await bus.write(block, register, value) == (OPERANDS[name], expected)
    found = await bus.write("axis", "segment_velocity", 0xFFFF_FFFE, value_low=5)
    assert found == (OPERANDS["segment_velocity"], 5 - (2 << 32))
    assert await bus.write("axis", "control", 1) is None
    assert await bus.write("axis", "position", 1) is None


@cocotb.test()
async def the_values_of_a_filter_have_one_register(dut):
    bus = await Bus(dut).reset()
    for number, value in ((0, 1), (13, -5 & 0xFFFF_FFFF), (31, 7)):
        assert await bus.write("axis", "filter_address", number) is None
        found = await bus.write("axis", "filter_value", value)
        there = number >> 3 < bus.model.filters
        value -= (value >> 31) << 32
        assert found == ((0x50 + number % 8, value << 2) if there else None)
        assert not there or bus.setting()[2] == number >> 3


@cocotb.test()
async def an_axis_that_is_not_built_is_left_out(dut):
    bus = await Bus(dut).reset()
    for axis in range(8):
        assert (await bus.write("axis", "kp", 1, axis) is not None) == (axis < bus.axes)


@cocotb.test()
async def a_segment_is_pushed_when_its_last_word_is_written(dut):
    bus = await Bus(dut).reset()
    await bus.clk(stores=1, address=address_of("axis", "segment_ticks"), value=5)
    while not int(dut.setting_write.value):
        assert await bus.clk() == (1, 1) and not int(dut.push.value)
    assert await bus.clk() == (1, 1) and not int(dut.push.value)
    for _ in range(4):
        assert await bus.clk(setting_waits=1) == (1, 1) and not int(dut.push.value)
    assert await bus.clk() == (1, 1) and int(dut.push.value) == 1
    assert await bus.clk() == (0, 1) and not int(dut.push.value)
    assert await bus.clk() == (0, 0)


@cocotb.test()
async def latency_of_a_piece_is_3_and_no_access_comes_between(dut):
    bus = await Bus(dut).reset()
    for part, word in enumerate((-5, 1 << 46, -(1 << 31), 1 << 24 | 7)):
        piece = (bus.axes - 1, part, word)
        for _ in range(2):
            assert await bus.clk(piece=piece) == (0, 1)
            assert not int(dut.setting_write.value)
        await bus.clk(piece=piece)
        assert bus.model.taken and bus.setting()[3] == word
        await bus.clk()
    await bus.clk()
    assert int(dut.push.value) == 1 << bus.axes - 1
    await bus.clk()
    # what was begun before comes first
    await bus.clk(piece=piece, stores=1, address=address_of("axis", "kp"), value=1)
    while not bus.model.taken:
        await bus.clk(piece=piece)
    assert bus.setting()[3] == word


@cocotb.test()
async def a_segment_of_an_axis_that_is_streamed_is_left_out(dut):
    bus = await Bus(dut).reset()
    for register in ("segment_velocity", "segment_acceleration", "segment_jerk", "segment_ticks"):
        address = address_of("axis", register) + (register.endswith(("velocity", "acceleration")))
        for streamed in (1, 0):
            await bus.clk(stores=1, address=address, value=1, streamed=streamed)
            assert (await bus.clk())[0] == 1 - streamed
            while (await bus.clk())[1]:
                pass
    assert await bus.write("axis", "kp", 1) is not None


@cocotb.test()
async def the_soft_core_waits_for_everything_that_was_requested(dut):
    bus = await Bus(dut).reset()
    assert await bus.clk() == (0, 0)
    assert await bus.clk(ready=0) == (1, 1)
    assert await bus.clk(setting_waits=1) == (1, 1)
    for name in ("pending", "moves", "moved"):
        assert await bus.clk(**{name: 1 << bus.axes - 1}) == (0, 1)


@cocotb.test()
async def random_words_match_the_model(dut):
    bus = await Bus(dut).reset()
    known = [4 + 8 * kind + axis << 6 | word for kind, word in FOUND for axis in range(bus.axes)]
    layout = RegisterLayout(bus.axes)  # values are as the register memory stores them
    left = 0  # cycles for which the last setting waits
    piece, streamed = None, 0
    for _ in range(20_000):
        stores = 0
        model = bus.model
        if not piece and random.random() < 0.05:
            piece = random.randrange(bus.axes), random.randrange(4), random.getrandbits(64) - 2**63
            streamed = random.getrandbits(bus.axes)
        if not left and not (model.scaled or model.setting or model.pushes):
            stores = int(random.random() < 0.6)
        address = random.choice((random.choice(known), random.getrandbits(14)))
        value = random.choice((random.getrandbits(32), random.getrandbits(17), 65536))
        await bus.clk(
            rst=int(random.random() < 0.005),
            stores=stores,
            address=address,
            value=layout.stored_bits(address, value),
            value_low=random.getrandbits(32),
            setting_waits=int(left > 0),
            moved=random.getrandbits(bus.axes) if random.random() < 0.1 else 0,
            moved_by=[random.getrandbits(48) - (1 << 47) for _ in range(bus.axes)],
            pending=int(random.random() < 0.1),
            streamed=streamed,
            piece=piece,
        )
        if bus.model.taken or random.random() < 0.005:
            piece = None
        left = random.randrange(4) if bus.model.setting else max(0, left - 1)


@pytest.mark.parametrize("axes, filters", [(1, 0), (3, 2), (8, 4)])
def test_engine_bus(axes, filters):
    run("engine_bus", __file__, AXES=axes, FILTERS=filters)
