# SPDX-License-Identifier: Apache-2.0
"""Every register of every made block, together with the register memory: access, first value,
neighbours, words of 64 bits, strobes, counters, sticky bits; and what the other made files say
about the same map.
"""

import random
import re
import zlib

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from moire.made import bus_tables
from moire.made import registers as host
from tables import registers as tables
from tb.bench import ROOT, rtl_only, run, start
from tb.ports import Ports
from tb.registers.register_block import WORD, RegisterBlock
from tb.simulator import BENCHES


def needs_of(block):
    """The parameters that the settings of a block need, also those that the engine has."""
    return sorted({f.needs for _, f in block.fields if f.needs})


class Bus:
    """One clk at a time, the model beside the block in every one of them."""

    def __init__(self, dut):
        self.dut, self.ports = dut, Ports(dut)
        self.block = next(b for b in tables.read() if f"{b.name}_bench" == dut._name)
        without = [
            parameter
            for parameter in needs_of(self.block)
            if not int(getattr(dut, parameter).value)
        ]
        self.model = RegisterBlock(self.block, tables.crc(), without)
        self.there = {f: f.needs not in without for _, f in self.block.fields}
        self.inputs = {
            f.port: 0 for r, f in self.block.fields if f.kind in ("input", "counter", "sticky")
        }
        self.wide = [
            r.word + 1 for r in self.block.registers if r.wide and r.fields[0].kind == "setting"
        ]
        self.shown = None  # word and wdata of the clk before
        self.stored = False  # a high word was written in it
        self.width = {f.port: f.width if f.kind == "input" else 1 for r, f in self.block.fields}

    async def begin(self):
        await start(self.dut, select=0, write=0, word=0, wdata=0, **self.pins(self.inputs))
        await self.ready()
        return self

    async def ready(self):
        """The memory takes its first values; the inputs are idle."""
        await RisingEdge(self.dut.ready)
        await FallingEdge(self.dut.clk)
        # so do the counts in a memory
        for _ in range(2 * self.block.counters + 1 if self.block.counted else 1):
            self.model.step(0, 0, 0, 0, self.inputs)

    def pins(self, inputs):
        """The levels of the ports; the bits of a vector are one port."""
        pins = dict(inputs)
        for r in (r for r in self.block.registers if r.vector):
            pins[r.name] = sum(pins.pop(f.port) << f.low for f in r.fields)
        return pins

    def of(self, *kinds):
        return [(r, f) for r, f in self.block.fields if f.kind in kinds and self.there[f]]

    async def clk(self, select=0, write=0, word=0, wdata=0, rst=0, **inputs):
        """Inputs named here stand for this clk only. The memory wants word and wdata one clk before
        an access, and a clk without one after the write of a high word.
        """
        if select and (self.shown != (word, wdata) or self.stored):
            await self.clk(word=word, wdata=wdata)
        self.shown, self.stored = (word, wdata), select and write and word in self.wide
        now = self.inputs | inputs
        bus = {"select": select, "write": write, "word": word, "wdata": wdata, "rst": rst}
        self.ports.drive(self.pins(now) | bus)
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        want = self.model.step(select, write, word, wdata, now, rst)
        got = {name: self.ports[name] for name in want}
        wrong = [
            f"{n} is {got[n]:#x}, the model has {want[n]:#x}" for n in want if got[n] != want[n]
        ]
        access = "write" if write else "read" if select else "idle"
        assert not wrong, f"word {word:#x} {access}: {'; '.join(wrong)}"
        if rst:
            self.ports.drive(self.pins(self.inputs) | {"rst": 0, "select": 0})
            await self.ready()
        return got

    async def read(self, word, **inputs):
        await self.clk(1, 0, word, **inputs)
        return (await self.clk(**inputs))["rdata"]

    async def write(self, word, wdata, **inputs):
        return await self.clk(1, 1, word, wdata, **inputs)

    async def count(self, port, times, pause):
        """So many events, each with the cycles that it takes."""
        for _ in range(times):
            await self.clk(**{port: 1})
            for _ in range(pause):
                await self.clk()

    def noise(self):
        return {name: random.getrandbits(self.width[name]) for name in self.inputs}


@cocotb.test()
async def latency_is_1(dut):
    """clk() looks at the outputs right after the edge that took the access. The rdata of the bench
    is one cycle behind the rdata of the block.
    """
    bus = await Bus(dut).begin()
    own = [(r, f) for r, f in bus.of("setting") if r in bus.block.own and not r.wide]
    r, f = max(own, key=lambda setting: "r" in setting[1].access)  # the link has none to be read
    assert (await bus.write(r.word, 1 << f.low))[f.port] == 1
    assert await bus.read(r.word) >> f.low & 1 == int("r" in f.access)
    assert (await bus.clk())["rdata"] == 0
    r, f = next((r, f) for r, f in bus.of("input"))
    bus.inputs[f.port] = 1
    await bus.clk(1, 0, r.word)
    rtl_only("it reads rdata of the block, which is inside of the bench")
    assert int(dut.u_block.rdata.value) >> f.low & 1 == 1
    await bus.clk()
    assert int(dut.u_block.rdata.value) == 0


@cocotb.test()
async def reset_gives_the_first_values(dut):
    bus = await Bus(dut).begin()
    for _ in range(2):
        for r in bus.block.registers:
            first = sum(
                f.reset << f.low
                for f in r.fields
                if f.kind == "setting" and "r" in f.access and bus.there[f]
            )
            if all(f.kind == "setting" for f in r.fields):
                assert await bus.read(r.word) == first & WORD
                assert not r.wide or await bus.read(r.word + 1) == first >> 32
        for word in range(64):
            await bus.write(word, random.getrandbits(32))
        await bus.clk(1, 1, 0, WORD, rst=1)


@cocotb.test()
async def every_bit_of_every_register_is_its_own(dut):
    bus = await Bus(dut).begin()
    for r in bus.block.registers:
        for word in range(r.word, r.word + 1 + r.wide):
            for data in [0, WORD, 0x5555_5555, 0xAAAA_AAAA, *(1 << n for n in range(32))]:
                await bus.write(word, data)
                await bus.read(word)


@cocotb.test()
async def every_input_reads_back_at_both_ends_of_its_range(dut):
    bus = await Bus(dut).begin()
    for r, f in bus.of("input"):
        port = f.port
        for value in (1, (1 << f.width) - 1, 1 << f.width - 1, (1 << f.width - 1) - 1):
            bus.inputs[port] = value
            low, high = await bus.read(r.word), (await bus.read(r.word + 1) if r.wide else 0)
            whole = (high << 32 | low) >> f.low
            assert whole & (1 << f.width) - 1 == value
            if f.signed and len(r.fields) == 1 and value >> f.width - 1:
                assert whole == (1 << (64 if r.wide else 32)) - (1 << f.width) + value
        bus.inputs[port] = 0


@cocotb.test()
async def a_word_without_a_register_reads_zero(dut):
    bus = await Bus(dut).begin()
    bus.inputs = {
        name: (1 << bus.width[name]) - 1
        for name in bus.inputs
        if name not in [f.port for r, f in bus.of("counter")]
    } | {f.port: 0 for r, f in bus.of("counter")}
    known = {
        word
        for r in bus.block.registers
        for word in range(r.word, r.word + 1 + r.wide)
        if any("r" in f.access for f in r.fields)
    }
    for word in sorted(set(range(64)) - known):
        await bus.write(word, WORD)
        assert await bus.read(word) == 0


@cocotb.test()
async def a_wide_value_is_read_and_written_whole(dut):
    bus = await Bus(dut).begin()
    for r in (r for r in bus.block.own if r.wide and bus.there[r.fields[0]]):
        f = r.fields[0]
        ones, port = (1 << f.width) - 1, f.port
        if f.kind == "input":
            bus.inputs[port] = 0xFFFF_FFFF
            assert await bus.read(r.word) == WORD
            bus.inputs[port] = 0x1_0000_0000  # the carry comes between the two reads
            assert await bus.read(r.word + 1) == 0
        else:
            assert (await bus.write(r.word, 0x89AB_CDEF))[port] == f.reset & ones
            assert (await bus.write(r.word + 1, 0x0123_4567))[port] == 0x0123_4567_89AB_CDEF & ones


@cocotb.test()
async def strobes_last_one_clk(dut):
    bus = await Bus(dut).begin()
    for r, f in bus.of("pulse"):
        assert (await bus.write(r.word, 1 << f.low))[f.port] == 1
        assert (await bus.clk())[f.port] == 0
        assert (await bus.write(r.word, WORD ^ 1 << f.low))[f.port] == 0
    for r in (r for r in bus.block.registers if r.on_write):
        out = await bus.write(r.word + r.wide, 5 << min(f.low for f in r.fields))
        held = 0 if r.fields[0].passed else 5 << 32 * r.wide
        assert (
            out[f"{r.name}_written"] == 1
            and out.get(r.fields[0].port, 0) == held * bus.there[r.fields[0]]
        )
        after = await bus.clk()
        assert after[f"{r.name}_written"] == 0
        assert all(after[f.port] == 0 for f in r.fields if f.momentary)
    for r in (r for r in bus.block.registers if r.on_read):
        got = await bus.clk(1, 0, r.word)
        assert got[f"{r.name}_read"] == 1, "the strobe is in the cycle in which rdata has the word"
        assert (await bus.clk())[f"{r.name}_read"] == 0


@cocotb.test()
async def counters_count_clear_and_stop_at_the_end(dut):
    """A counter in a memory needs some cycles for each event."""
    rtl_only("it sets counters inside, since they are too long to be counted to their end")
    bus = await Bus(dut).begin()
    for r, f in bus.of("counter"):
        port, pause = f.port, 4 * bus.block.counters if f.in_memory else 0
        await bus.count(port, 3, pause)
        assert await bus.read(r.word) == 3 << f.low
        await bus.write(r.word, WORD, **{port: 1})
        for _ in range(pause):
            await bus.clk()
        assert await bus.read(r.word) == 1 << f.low, "an event in the clk of the write is counted"
        if f.in_memory:
            dut.u_block.u_counters.memory[r.word].value = (1 << f.width) - 2
            bus.model.counters.counts[r.word] = (1 << f.width) - 2
        else:
            getattr(dut.u_block, f"{port}_count").value = bus.model.value[port] = (1 << f.width) - 2
        await FallingEdge(dut.clk)
        await bus.count(port, 3, pause)
        assert await bus.read(r.word) == (1 << f.width) - 1 << f.low
        await bus.write(r.word, 0)
        await bus.clk()
        assert await bus.read(r.word) == 0


@cocotb.test()
async def a_sticky_bit_stands_until_one_is_written_to_it(dut):
    bus = await Bus(dut).begin()
    for r, f in bus.of("sticky"):
        port = f.port
        await bus.clk(**{port: 1})
        await bus.write(r.word, WORD ^ 1 << f.low)
        assert await bus.read(r.word) == 1 << f.low
        await bus.write(r.word, 1 << f.low, **{port: 1})
        assert await bus.read(r.word) == 1 << f.low, "an event in the clk of the write is held"
        await bus.write(r.word, 1 << f.low)
        assert await bus.read(r.word) == 0


@cocotb.test()
async def any_access_matches_the_model(dut):
    bus = await Bus(dut).begin()
    used = [word for r in bus.block.registers for word in range(r.word, r.word + 1 + r.wide)]
    for n in range(600):
        word = random.choice(used) if random.random() < 0.9 else random.randrange(64)
        await bus.clk(
            random.random() < 0.8,
            random.getrandbits(1),
            word,
            random.getrandbits(32),
            random.random() < 0.005,
            **(bus.noise() if n % 3 == 0 else {}),
        )


@cocotb.test()
async def a_setting_whose_need_was_not_built_reads_zero_whatever_is_written(dut):
    bus = await Bus(dut).begin()
    for r, f in ((r, f) for r, f in bus.block.fields if not bus.there[f]):
        got = await bus.write(r.word, WORD)
        assert not got.get(f.port)
        assert await bus.read(r.word) >> f.low & (1 << f.width) - 1 == 0


def bench(name):
    """Write the top that joins a block with the register memory, as the soft core reads them."""
    block = next(b for b in tables.read() if b.name == name)
    ports = [(kind, shape, port) for kind, shape, port, _, _ in block.ports]
    low = [".wdata_low"] if block.wide_settings else []
    passed = ", ".join(f".{p}({p})" for p in block.parameters)
    masks = ", ".join(f".{p}({p})" for p in needs_of(block))
    parameters = ", ".join(f"parameter int {p} = 1" for p in needs_of(block))
    lines = [
        f"module {name}_bench {f'#({parameters})' if parameters else ''}",
        "(input wire clk, input wire rst, input wire select, input wire write,",
        "input wire [5:0] word, input wire [31:0] wdata,",
        "output logic ready, output logic [31:0] rdata,",
        ",\n".join(" ".join(port) for port in ports),
        "); wire [31:0] live, settings, wdata_low, stored_value; wire [13:0] stored_at;",
        "wire stores; logic got;",
        f"register_memory #({masks}) u_memory (.clk, .rst, .hold(1'b0), .select, .write,",
        f".address({{8'd{block.base // 256}, word}}), .wdata, .ready, .rdata(settings),",
        ".wdata_low, .stores, .stored_at, .stored_value);",
        f"{name}_registers #({passed}) u_block (",
        ", ".join([".clk, .rst, .select, .write, .word, .wdata, .rdata(live)", *low]),
        "".join(f", .{port}" for _, _, port in ports),
        "); always_ff @(posedge clk) begin",
        "got <= select && !write && !rst;",
        "rdata <= rst ? '0 : live | (got ? settings : '0);",
        "end",
        "wire unused = &{1'b0, wdata_low, stores, stored_at, stored_value};",
        "endmodule",
    ]
    BENCHES.mkdir(parents=True, exist_ok=True)
    (BENCHES / f"{name}_bench.sv").write_text("\n".join(lines) + "\n")
    return f"{name}_bench"


@pytest.mark.parametrize("block", [block.name for block in tables.read()])
def test_registers(block):
    run(bench(block), __file__)


@pytest.mark.parametrize("block", ["axis", "feedback", "actuator"])
def test_registers_without_what_they_need(block):
    needs = next(needs_of(b) for b in tables.read() if b.name == block)
    run(bench(block), __file__, **dict.fromkeys(needs, 0))


@pytest.mark.parametrize(
    "block, parameter", [("feedback", "HAS_COMPARE"), ("axis", "FILTERS"), ("actuator", "HAS_DAC")]
)
def test_registers_without_one_feature(block, parameter):
    run(bench(block), __file__, **{parameter: 0})


def test_all_made_files_carry_the_crc_of_the_source():
    source = (ROOT / "tables" / "registers.rdl").read_bytes().replace(b"\r\n", b"\n")
    made = {
        "rtl/registers/node_registers.sv": r"get_map_crc\}\} & 32'h(\w{8})\)",
        "sw/firmware/made/registers.h": r"MAP_CRC 0x(\w{8})u",
        "sw/host/moire/made/registers.py": r"MAP_CRC = 0x(\w{8})",
        "docs/registers.md": r"CRC-32 `0x(\w{8})`",
    }
    for name, place in made.items():
        assert (
            re.search(place, (ROOT / name).read_text(), re.IGNORECASE).group(1).upper()
            == f"{zlib.crc32(source):08X}"
        ), name


@pytest.mark.parametrize(
    "register, protocol",
    [("faults", bus_tables.FAULTS), ("encoder_events", bus_tables.ENCODER_EVENTS)],
)
def test_the_bus_protocol_has_the_bits_of_the_register(register, protocol):
    fields = [f for f in host.FIELDS if (f.block, f.register) == ("axis", register)]
    assert {bit: name for bit, (name, _) in protocol.items()} == {f.low: f.field for f in fields}


@pytest.mark.parametrize("axes", [1, 2, 4, 8])
def test_host_and_firmware_find_every_register_at_every_axis_count(axes):
    header = dict(
        re.findall(
            r"#define (\w+) +(0x[0-9a-fA-F]+)u",
            (ROOT / "sw" / "firmware" / "made" / "registers.h").read_text(),
        )
    )
    taken = {}
    for block in tables.read(axes):
        assert block.count == (axes if block.name in ("axis", "feedback", "actuator") else 1)
        for n in range(block.count):
            for r in block.registers:
                address = block.base + n * block.stride + r.offset
                base, stride, offset = (
                    int(header.get(f"{block.name}_{x}".upper(), "0"), 16)
                    for x in ("BASE", "STRIDE", r.name)
                )
                assert base + n * stride + offset == address
                for f in r.fields:
                    entry = host.BY_NAME[block.name, r.name, f.name]
                    assert (entry.address(n), entry.low, entry.width, entry.signed) == (
                        address,
                        f.low,
                        f.width,
                        f.signed,
                    )
                for word in range(address, address + (8 if r.wide else 4), 4):
                    assert (
                        taken.setdefault(word, (block.name, n, r.name)) == (block.name, n, r.name)
                        and word < 1 << 16
                    )


def test_host_reads_a_field_out_of_a_word():
    cos = host.BY_NAME["axis", "sample", "cos"]
    assert cos.value(0xFFFE_1234) == -2 and cos.value(0x7FFF_0000) == 32767
    velocity = host.BY_NAME["axis", "segment_velocity", "value"]
    assert velocity.value((1 << 64) - 3) == -3 and velocity.lsb == 2**-40
