# SPDX-License-Identifier: Apache-2.0
"""peripherals: each peripheral end to end, from its registers to the device at its pins: an EEPROM,
a keyboard and its machine, a peer, an angle sensor, a numeric display, two lamps.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge

from moire.made.registers import FIELDS
from tb import bench
from tb.peripheral.angle_frame import frame
from tb.peripheral.eeprom_24aa128 import Eeprom
from tb.peripheral.i2c_master import NO_BUS, NOT_ACKNOWLEDGED, OK, READ, START, STOP, WRITE
from tb.peripheral.ps2_lines import Host, Keyboard
from tb.peripheral.test_i2c_master import edges
from tb.ports import Ports

CLK_HZ = 1_000_000
MS = CLK_HZ // 1000
BIT = 16  # cycles, of both serial ports
CUT = [0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14]  # S4: left Ctrl + W
REGISTERS = {}
for field in FIELDS:
    if field.block == "peripherals":
        REGISTERS.setdefault(field.register, {})[field.field] = field


class SerialPort:
    """Sends and receives 8N1 characters on two pins."""

    def __init__(self):
        self.levels, self.received, self.sample, self.shifted = [], [], None, 0

    def send(self, data, stop=1):
        for byte in data:
            self.levels += [
                level
                for bit in (0, *(byte >> n & 1 for n in range(8)), stop)
                for level in [bit] * BIT
            ]

    def level(self):
        return self.levels.pop(0) if self.levels else 1

    def receive(self, level):
        if self.sample is None:
            self.sample = 0 if not level else None
        else:
            self.sample += 1
            if self.sample % BIT == BIT // 2:
                self.shifted = self.shifted >> 1 | level << 9
            if self.sample == 9 * BIT + BIT // 2:
                assert self.shifted & 1 == 0 and self.shifted >> 9, "no start or stop bit"
                self.received.append(self.shifted >> 1 & 0xFF)
                self.sample = None


class Peripherals:
    """The block with everything around it, one cycle at a time; registers by their names."""

    def __init__(self, dut):
        self.ports = Ports(dut)
        self.dut, self.eeprom, self.keyboard, self.machine = (
            dut,
            Eeprom(write_clk=5 * MS),
            Keyboard(CLK_HZ),
            Host(CLK_HZ),
        )
        self.stuck, self.wires = (
            (0, 0),
            bytearray(),
        )  # I2C: lines that something holds low, samples of both
        self.peer, self.sensor, self.lamps, self.display, self.shown = (
            SerialPort(),
            SerialPort(),
            0,
            (1, 0),
            [],
        )
        self.bits = []

    async def begin(self):
        ones = (
            "i2c_scl",
            "i2c_sda",
            "keyboard_clock",
            "keyboard_data",
            "edm_clock",
            "edm_data",
            "peer_rx",
            "sensor_rx",
        )
        await bench.start(
            self.dut, select=0, write=0, word=0, wdata=0, edm_status=0, **dict.fromkeys(ones, 1)
        )
        self.dut.rst.value = 1
        await self.clk(3)
        self.dut.rst.value = 0
        await self.clk(10)
        await self.write("peer_bit_time", value=16 * BIT)
        await self.write("sensor_bit_time", value=16 * BIT)
        return self

    async def clk(self, n=1):
        for _ in range(n):
            await FallingEdge(self.dut.clk)
            self.step_devices()

    def step_devices(self):
        ports, k, m, e = self.ports, self.keyboard, self.machine, self.eeprom
        pulls = ports["i2c_scl_low"], ports["i2c_sda_low"]
        lines = [
            int(not (own or device or stuck))
            for own, device, stuck in zip(pulls, (e.scl_low > 0, e.sda_low), self.stuck)
        ]
        e.step(*lines)
        self.wires.append(lines[0] | lines[1] << 1)
        k.step(
            1 - (ports["keyboard_clock_low"] | k.clock_low),
            1 - (ports["keyboard_data_low"] | k.data_low),
        )
        m.step(
            1 - (ports["edm_clock_low"] | m.clock_low),
            1 - (ports["edm_data_low"] | m.data_low),
        )
        self.peer.receive(ports["peer_tx"])
        self.read_display(ports["display_cs_n"], ports["display_sclk"])
        inputs = dict(
            i2c_scl=lines[0],
            i2c_sda=lines[1],
            keyboard_clock=k.clock,
            keyboard_data=k.data,
            edm_clock=m.clock,
            edm_data=m.data,
            peer_rx=self.peer.level(),
            sensor_rx=self.sensor.level(),
            edm_status=self.lamps,
        )
        ports.drive(inputs)

    def read_display(self, cs_n, sclk):
        """Read the pins as a MAX7219 does: a bit at each rise of sclk, the word at the rise of
        cs_n.
        """
        before, self.display = self.display, (cs_n, sclk)
        if sclk and not before[1]:
            self.bits.append(self.ports["display_data"])
        if cs_n and not before[0]:
            self.shown.append(self.bits[-16:])
            self.bits = []

    async def access(self, write, offset, wdata=0):
        d = self.dut
        d.select.value, d.write.value, d.word.value, d.wdata.value = 1, write, offset // 4, wdata
        await self.clk()
        d.select.value = 0
        return int(d.rdata.value.resolve("zeros"))  # a value that never came is undefined

    async def write(self, register, **values):
        fields = REGISTERS[register]
        await self.access(
            1,
            next(iter(fields.values())).offset,
            sum(value << fields[name].low for name, value in values.items()),
        )

    async def read(self, register):
        """The fields of a register by name; the value alone, if there is only one."""
        fields = REGISTERS[register]
        offset = next(iter(fields.values())).offset
        word = await self.access(0, offset)
        if any(f.width > 32 for f in fields.values()):
            word |= await self.access(0, offset + 4) << 32
        values = {name: f.value(word) for name, f in fields.items() if "r" in f.access}
        return values["value"] if list(values) == ["value"] else values

    async def until(self, condition, limit=400 * MS):
        for _ in range(limit // 10):
            if condition():
                return
            await self.clk(10)
        raise AssertionError("waited for nothing")

    async def i2c(self, *commands):
        """Queue (command, data or acknowledge) and wait for their results: [(result, data)]."""
        for command, value in commands:
            await self.write(
                "i2c",
                command=command,
                **({"acknowledge": value} if command == READ else {"data": value}),
            )
        while (await self.read("i2c_state"))["busy"]:
            await self.clk(50)
        answers = []
        while (answer := await self.read("i2c_answer"))["present"]:
            answers.append((answer["result"], answer["data"]))
            await self.clk(2)
        return answers


@cocotb.test()
async def the_build_register_names_them_all(dut):
    peripherals = await Peripherals(dut).begin()
    assert await peripherals.read("built") == dict(i2c=1, ps2=1, peer=1, sensor=1, display=1, edm=1)


@cocotb.test()
async def a_page_goes_into_the_eeprom_with_one_queue_of_commands_and_comes_back(dut):
    peripherals = await Peripherals(dut).begin()
    data = [random.getrandbits(8) for _ in range(64)]
    head = [(START, 0), (WRITE, 0xA0), (WRITE, 0x12), (WRITE, 0x40)]
    assert (await peripherals.read("i2c_state"))["free"] == 128
    answers = await peripherals.i2c(*head, *((WRITE, byte) for byte in data), (STOP, 0))
    assert [result for result, _ in answers] == [OK] * 69 and peripherals.eeprom.memory[
        0x1240:0x1280
    ] == bytes(data)
    tries = 0
    while (await peripherals.i2c((START, 0), (WRITE, 0xA0), (STOP, 0)))[1][0] == NOT_ACKNOWLEDGED:
        tries += 1
    assert tries > 0  # it writes for 5 ms
    answers = await peripherals.i2c(
        *head, (START, 0), (WRITE, 0xA1), *((READ, int(n < 63)) for n in range(64)), (STOP, 0)
    )
    assert {result for result, _ in answers} == {OK} and [byte for _, byte in answers[6:70]] == data
    assert await peripherals.read("i2c_state") == dict(free=128, busy=0, owned=0, scl=1, sda=1)
    assert (
        edges(peripherals.wires).count("S") == edges(peripherals.wires).count("P") + 1
    )  # a repeated start


@cocotb.test()
async def a_stuck_i2c_bus_is_reported(dut):
    peripherals = await Peripherals(dut).begin()
    peripherals.stuck = (0, 1)
    await peripherals.clk(10)
    assert (await peripherals.read("i2c_state"))["sda"] == 0
    assert [result for result, _ in await peripherals.i2c((START, 0))] == [NO_BUS]
    peripherals.stuck = (0, 0)
    await peripherals.clk(10)
    assert [result for result, _ in await peripherals.i2c((START, 0), (STOP, 0))] == [OK, OK]


@cocotb.test()
async def a_person_types_and_a_cut_is_started_after_it(dut):
    peripherals = await Peripherals(dut).begin()
    await peripherals.write("ps2_idle", value=25)
    peripherals.keyboard.outbox = [0x1C, 0xF0, 0x1C]
    for n, byte in enumerate(CUT):
        await peripherals.write("ps2_inject", data=byte, last=int(n == len(CUT) - 1))
    await peripherals.clk(MS)
    assert (await peripherals.read("ps2_state"))["free"] == 32 - len(CUT)
    await peripherals.until(lambda: len(peripherals.machine.received) == 4)
    assert (await peripherals.read("ps2_state"))["injecting"] == 1
    await peripherals.until(lambda: len(peripherals.machine.received) == 9)
    await peripherals.clk(MS)
    assert peripherals.machine.received == [0x1C, 0xF0, 0x1C, *CUT]
    assert await peripherals.read("ps2_state") == dict(free=32, injecting=0, busy=0)
    assert await peripherals.read("ps2_typed") == 3
    assert (
        not any((await peripherals.read("ps2_errors")).values())
        and await peripherals.read("ps2_glitches") == 0
    )


@cocotb.test()
async def keys_are_taken_back_but_for_the_sequence_that_is_under_way(dut):
    peripherals = await Peripherals(dut).begin()
    await peripherals.write("ps2_idle", value=25)
    for _ in range(3):
        for n, byte in enumerate(CUT):
            await peripherals.write("ps2_inject", data=byte, last=int(n == len(CUT) - 1))
    await peripherals.until(lambda: len(peripherals.machine.received) == 2)
    await peripherals.write("ps2_state", drop=1)
    await peripherals.clk(4)
    assert (await peripherals.read("ps2_state"))["free"] <= 32 - 3 * len(CUT) + 3
    await peripherals.until(lambda: len(peripherals.machine.received) == len(CUT))
    await peripherals.clk(60 * MS)
    assert peripherals.machine.received == CUT and await peripherals.read("ps2_state") == dict(
        free=32, injecting=0, busy=0
    )


@cocotb.test()
async def errors_of_the_keyboard_are_counted_and_cleared(dut):
    peripherals = Peripherals(dut)
    peripherals.keyboard = Keyboard(CLK_HZ, damage=1.0)
    await peripherals.begin()
    peripherals.keyboard.outbox = [0x1C]
    await peripherals.until(lambda: peripherals.machine.damaged == 2)
    assert (await peripherals.read("ps2_errors"))[
        "keyboard_damaged"
    ] >= 2 and await peripherals.read("ps2_typed") == 0
    peripherals.keyboard.damage = 0.0
    await peripherals.until(lambda: peripherals.machine.received == [0x1C])
    await peripherals.write("ps2_errors")
    assert not any((await peripherals.read("ps2_errors")).values())


@cocotb.test()
async def bytes_pass_to_and_from_the_peer(dut):
    peripherals = await Peripherals(dut).begin()
    there, back = [bytes(random.getrandbits(8) for _ in range(n)) for n in (64, 40)]
    for byte in there:
        await peripherals.write("peer_transmit", value=byte)
    assert (await peripherals.read("peer_state"))["sending"] == 1
    peripherals.peer.send(back)
    await peripherals.until(lambda: len(peripherals.peer.received) == 64)
    await peripherals.clk(2 * BIT)
    assert bytes(peripherals.peer.received) == there and await peripherals.read(
        "peer_state"
    ) == dict(transmit_free=64, sending=0)
    received = []
    while (word := await peripherals.read("peer_receive"))["present"]:
        received.append(word["data"])
        await peripherals.clk(2)
    assert bytes(received) == back
    assert await peripherals.read("peer_errors") == dict(framing=0, overruns=0)


@cocotb.test()
async def the_peer_port_counts_what_it_lost(dut):
    peripherals = await Peripherals(dut).begin()
    peripherals.peer.send(range(67))
    peripherals.peer.send([0x00], stop=0)
    await peripherals.until(lambda: not peripherals.peer.levels)
    await peripherals.clk(3 * BIT)
    assert await peripherals.read("peer_errors") == dict(framing=1, overruns=3)
    for n in range(64):
        assert await peripherals.read("peer_receive") == dict(data=n, present=1)
        await peripherals.clk(2)
    assert (await peripherals.read("peer_receive"))["present"] == 0
    await peripherals.write("peer_errors")
    assert await peripherals.read("peer_errors") == dict(framing=0, overruns=0)


@cocotb.test()
async def an_angle_its_age_and_its_number_are_read(dut):
    peripherals = await Peripherals(dut).begin()
    await peripherals.write("sensor_stale_after", value=20 * MS)
    assert (await peripherals.read("sensor_state"))["stale"] == 1
    peripherals.sensor.send(frame(7, 0x89ABCDEF))
    await peripherals.until(lambda: not peripherals.sensor.levels)
    await peripherals.clk(5)
    assert await peripherals.read("sensor_state") == dict(sequence_number=7, stale=0)
    reading = await peripherals.read("sensor_reading")
    assert reading & 0xFFFFFFFF == 0x89ABCDEF
    assert (
        70 * BIT <= reading >> 32 <= 70 * BIT + 4 * BIT
    )  # seven characters since the first had come
    peripherals.sensor.send(frame(8, 1))
    low = await peripherals.access(0, REGISTERS["sensor_reading"]["value"].offset)
    await peripherals.until(lambda: not peripherals.sensor.levels)
    await peripherals.clk(5)
    high = await peripherals.access(0, REGISTERS["sensor_reading"]["value"].offset + 4)
    assert low == 0x89ABCDEF and reading >> 32 <= high <= (reading >> 32) + 20, (
        "the age is that of the angle read"
    )
    peripherals.sensor.send(frame(11, 2))
    peripherals.sensor.send(frame(12, 3)[:7] + b"\x00")
    await peripherals.until(lambda: not peripherals.sensor.levels)
    await peripherals.clk(5)
    assert await peripherals.read("sensor_errors") == dict(crc=1, broken=0, missed=2)
    assert await peripherals.read("sensor_frames") == 3
    await peripherals.write("sensor_errors", clear=1)
    await peripherals.clk(2)
    assert not any((await peripherals.read("sensor_errors")).values())
    await peripherals.clk(21 * MS)
    assert (await peripherals.read("sensor_state"))["stale"] == 1


@cocotb.test()
async def words_reach_the_display_in_order(dut):
    peripherals = await Peripherals(dut).begin()
    words = [0x0C01, 0x0900, *(random.getrandbits(16) for _ in range(14))]
    for word in words:
        await peripherals.write("display", value=word)
    state = await peripherals.read("display_state")
    assert state["sending"] == 1 and state["free"] < 8
    await peripherals.until(lambda: len(peripherals.shown) == 16)
    await peripherals.clk(10)
    assert [int("".join(map(str, bits)), 2) for bits in peripherals.shown] == words
    assert await peripherals.read("display_state") == dict(free=16, sending=0)


@cocotb.test()
async def no_change_of_a_lamp_is_missed(dut):
    peripherals = await Peripherals(dut).begin()
    await peripherals.write("edm_filter", value=2)
    for _ in range(20):
        peripherals.lamps ^= 1
        await peripherals.clk(random.randrange(1, MS))
    peripherals.lamps = 1
    await peripherals.clk(4 * MS)
    assert await peripherals.read("edm_status") == dict(
        inputs=1, rose_0=1, rose_1=0, fell_0=0, fell_1=0
    )
    peripherals.lamps = 2
    await peripherals.clk(4 * MS)
    peripherals.lamps = 0
    await peripherals.clk(4 * MS)
    assert await peripherals.read("edm_status") == dict(
        inputs=0, rose_0=1, rose_1=1, fell_0=1, fell_1=1
    )
    await peripherals.write("edm_status", rose_0=1, fell_1=1)
    assert await peripherals.read("edm_status") == dict(
        inputs=0, rose_0=0, rose_1=1, fell_0=1, fell_1=0
    )


def test_peripherals():
    bench.run("peripherals", __file__, CLK_HZ=CLK_HZ)
