# SPDX-License-Identifier: Apache-2.0
"""i2c_master: the waveform by hand, its times, a 24AA128, stretching, a lost and a stuck bus,
sigrok, random against the model.
"""

import random
import re

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb import bench
from tb.peripheral.eeprom_24aa128 import Eeprom
from tb.peripheral.i2c_master import (
    LOST,
    NO_BUS,
    NOT_ACKNOWLEDGED,
    OK,
    READ,
    RECOVER,
    START,
    STOP,
    WRITE,
    I2cMaster,
)
from tools import sigrok

CLK_HZ, STRETCH_US = 4_000_000, 200


class Bus:
    """The design, its model and a device on two wires."""

    def __init__(self, dut, device=None):
        self.dut, self.device = dut, device
        self.bus_hz = int(dut.BUS_HZ.value)
        self.model, self.samples, self.foreign = (
            I2cMaster(CLK_HZ, self.bus_hz, STRETCH_US),
            bytearray(),
            (0, 0),
        )
        self.pulls, self.device_pulls = (0, 0), (0, 0)

    async def begin(self):
        await bench.start(
            self.dut, scl=1, sda=1, command_valid=0, command=0, write_data=0, acknowledge=0
        )
        self.dut.rst.value = 1
        await FallingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        self.dut.rst.value = 0
        return self

    async def clk(self, command=None, data=0, acknowledge=0, rst=0):
        d = self.dut
        scl, sda = (
            int(not any(pulls)) for pulls in zip(self.pulls, self.device_pulls, self.foreign)
        )
        d.scl.value, d.sda.value, d.rst.value = scl, sda, rst
        d.command_valid.value, d.command.value = command is not None, command or 0
        d.write_data.value, d.acknowledge.value = data, acknowledge
        self.samples.append(scl | sda << 1)
        await FallingEdge(d.clk)
        want = self.model.step(scl, sda, command, data, acknowledge, rst)
        done = int(d.done.value)
        got = (
            int(d.command_ready.value),
            done,
            int(d.result.value) if done else None,
            int(d.read_data.value) if want[3] is not None else None,
            int(d.owned.value),
            int(d.scl_low.value),
            int(d.sda_low.value),
        )
        assert got == want, f"{got} where the model has {want}"
        self.pulls = got[5:]
        self.device_pulls = self.device.step(scl, sda) if self.device else (0, 0)
        return got

    async def do(self, command, data=0, acknowledge=0):
        """One command; its result."""
        got = await self.clk(command, data, acknowledge)
        while not got[1]:
            got = await self.clk()
        return got[2]

    async def quiet(self, clks):
        for _ in range(clks):
            await self.clk()

    async def write(self, address, data):
        """A page of the EEPROM; ends with the stop that begins its write time."""
        assert await self.do(START) == OK
        for byte in (0xA0, address >> 8, address & 255, *data):
            assert await self.do(WRITE, byte) == OK
        assert await self.do(STOP) == OK

    async def poll(self):
        """Address the device until it acknowledges; returns how often it did not."""
        tries = 0
        while True:
            assert await self.do(START) == OK
            answer = await self.do(WRITE, 0xA0)
            if answer == OK:
                await self.do(STOP)
                return tries
            assert answer == NOT_ACKNOWLEDGED
            await self.do(STOP)
            tries += 1

    async def read(self, address, length):
        assert [
            await self.do(START),
            await self.do(WRITE, 0xA0),
            await self.do(WRITE, address >> 8),
            await self.do(WRITE, address & 255),
            await self.do(START),
            await self.do(WRITE, 0xA1),
        ] == [OK] * 6
        data = []
        for n in range(length):
            assert await self.do(READ, acknowledge=int(n < length - 1)) == OK
            data.append(int(self.dut.read_data.value))
        assert await self.do(STOP) == OK
        return bytes(data)


def edges(samples):
    """The bus as a list: S, P, or the level of data at each rise of the clock."""
    words = ""
    for before, now in zip(samples, samples[1:]):
        if before & now & 1 and (before ^ now) & 2:
            words += "P" if now & 2 else "S"
        elif now & ~before & 1:
            words += str(now >> 1)
    return words


@cocotb.test()
async def one_byte_by_hand(dut):
    bus = await Bus(dut).begin()
    assert [await bus.do(START), await bus.do(WRITE, 0xA1), await bus.do(STOP)] == [
        OK,
        NOT_ACKNOWLEDGED,
        OK,
    ]
    assert (
        edges(bus.samples) == "S" + "10100001" + "1" + "0" + "P"
    )  # the clock rises once more, with data low, for the stop


@cocotb.test()
async def latency_is_about_1_bit_for_start_and_stop_and_9_bits_for_a_byte(dut):
    bus = await Bus(dut).begin()
    for command, bits in ((START, 1), (WRITE, 9), (STOP, 1)):
        before = len(bus.samples)
        await bus.do(command, 0xA5)
        took = (len(bus.samples) - before) * bus.bus_hz / CLK_HZ
        assert bits - 0.7 < took < 1.25 * bits + 1, (command, took)


@cocotb.test()
async def the_times_of_the_bus_are_observed(dut):
    """UM10204, table 10, in us: low, high, set-up and hold of a start, set-up of a stop, free
    before a start, set-up of data.
    """
    bus = await Bus(dut, Eeprom()).begin()
    await bus.write(0, b"\x5a\xc3")
    await bus.poll()
    least = (
        dict(low=4.7, high=4.0, su_sta=4.7, hd_sta=4.0, su_sto=4.0, buf=4.7, su_dat=0.25)
        if bus.bus_hz <= 100_000
        else dict(low=1.3, high=0.6, su_sta=0.6, hd_sta=0.6, su_sto=0.6, buf=1.3, su_dat=0.1)
    )
    least = {name: us * CLK_HZ / 1e6 for name, us in least.items()}
    rose = fell = moved = begun = ended = -(10**6)
    for now, (before, after) in enumerate(zip(bus.samples, bus.samples[1:])):
        if (before ^ after) & 2:
            if before & after & 1:
                if after & 2:
                    assert now - rose >= least["su_sto"]
                    ended = now
                else:
                    assert now - rose >= least["su_sta"] and now - ended >= least["buf"]
                    begun = now
            moved = now
        if after & ~before & 1:
            assert now - fell >= least["low"] and now - moved >= least["su_dat"]
            rose = now
        elif before & ~after & 1:
            assert now - rose >= least["high"] and now - begun >= least["hd_sta"]
            fell = now


@cocotb.test()
async def an_eeprom_takes_a_page_and_is_polled_until_it_is_written(dut):
    device = Eeprom(write_clk=CLK_HZ // 1000)
    bus = await Bus(dut, device).begin()
    data = bytes(random.getrandbits(8) for _ in range(10))
    await bus.write(0x0FC0 + 58, data)  # rolls over at the end of its page, as the device does
    assert device.writes == 1 and await bus.poll() > 0
    assert (
        device.memory[0x0FC0 + 58 : 0x1000] == data[:6] and device.memory[0x0FC0:0x0FC4] == data[6:]
    )
    assert await bus.read(0x0FC0 + 58, 6) == data[:6]
    assert await bus.read(0x3FFF, 2) == b"\xff\xff"
    assert (
        await bus.do(START) == OK
        and await bus.do(WRITE, 0xA2) == NOT_ACKNOWLEDGED
        and await bus.do(STOP) == OK
    )  # no device has this address


@cocotb.test()
async def a_device_may_stretch_the_clock_until_the_time_is_out(dut):
    for us, result in ((STRETCH_US - 50, OK), (STRETCH_US + 20, NO_BUS)):
        bus = await Bus(dut, Eeprom(stretch=us * CLK_HZ // 1_000_000)).begin()
        assert await bus.do(START) == OK
        assert await bus.do(WRITE, 0xA0) == result
        assert bool(bus.pulls[0]) == (result == OK) and int(dut.owned.value) == (result == OK)


@cocotb.test()
async def what_is_not_ours_is_refused(dut):
    bus = await Bus(dut).begin()
    for command in (STOP, WRITE, READ):
        assert await bus.do(command) == LOST
    assert edges(bus.samples) == ""


@cocotb.test()
async def another_master_takes_the_bus(dut):
    bus = await Bus(dut).begin()
    assert await bus.do(START) == OK
    await bus.clk(WRITE, 0xFF)
    bus.foreign = (0, 1)
    while not (got := await bus.clk())[1]:
        pass
    assert got[2] == LOST and bus.pulls == (0, 0) and not got[4]
    assert await bus.do(START) == NO_BUS  # and holds it
    bus.foreign = (0, 0)
    assert await bus.do(START) == OK


@cocotb.test()
async def a_stuck_device_is_clocked_free(dut):
    for clocks in (1, 5, 8, 9):
        bus = await Bus(dut).begin()
        bus.foreign = (0, 1)
        assert await bus.do(START) == NO_BUS
        await bus.clk(RECOVER)
        falls, before, got = 0, 1, (0, 0)
        while not got[1]:
            falls += before & ~bus.samples[-1] & 1
            before = bus.samples[-1] & 1
            if falls > clocks:
                bus.foreign = (0, 0)
            got = await bus.clk()
        assert got[2] == OK, clocks
        assert await bus.do(START) == OK and await bus.do(STOP) == OK
    bus.foreign = (0, 1)
    assert await bus.do(RECOVER) == NO_BUS


@cocotb.test()
async def reset_lets_go_of_both_lines(dut):
    bus = await Bus(dut).begin()
    assert await bus.do(START) == OK
    await bus.clk(WRITE, 0)
    await bus.quiet(30)
    await bus.clk(rst=1)
    assert bus.pulls == (0, 0) and not int(dut.owned.value)


@cocotb.test()
async def any_commands_on_any_wires_match_the_model(dut):
    for device in (None, Eeprom(), Eeprom(stretch=60)):
        bus = await Bus(dut, device).begin()
        for _ in range(60):
            bus.foreign = (random.random() < 0.03, random.random() < 0.1)
            await bus.clk(
                random.choice([START, STOP, WRITE, WRITE, READ, RECOVER, 7]),
                random.choice([0xA0, 0xA1, random.getrandbits(8)]),
                random.randrange(2),
                int(random.random() < 0.02),
            )
            await bus.quiet(random.randrange(900 if random.random() < 0.5 else 30))


@cocotb.test(skip=not sigrok.installed())
async def sigrok_reads_the_same_bytes_and_the_eeprom_operations(dut):
    bus = await Bus(dut, Eeprom(write_clk=400)).begin()
    data = bytes(random.getrandbits(8) for _ in range(5))
    await bus.write(0x1234, data)
    await bus.poll()
    assert await bus.read(0x1234, 5) == data

    def decoded(decoders, words):
        return sigrok.decoded(bus.samples, 2, CLK_HZ, decoders, words)

    wire = decoded("i2c:scl=0:sda=1", "i2c=data-write:data-read:warnings")
    assert [int(b, 16) for b in re.findall(r"Data write: (\w\w)", wire)] == [
        0x12,
        0x34,
        *data,
        0x12,
        0x34,
    ]
    assert (
        bytes(int(b, 16) for b in re.findall(r"Data read: (\w\w)", wire)) == data
        and "warning" not in wire.lower()
    )
    # the 24AA64 is its nearest: the same commands, half the size and page
    operations = decoded(
        "i2c:scl=0:sda=1,eeprom24xx:chip=microchip_24aa64", "eeprom24xx=page-write:seq-random-read"
    )
    words = data.hex(" ").upper()
    assert re.findall(r"eeprom24xx-1: (.*)", operations) == [
        f"Page write (addr=1234, 5 bytes): {words}",
        f"Sequential random read (addr=1234, 5 bytes): {words}",
    ]


@pytest.mark.parametrize("bus_hz", [100_000, 400_000])
def test_i2c_master(bus_hz):
    bench.run("i2c_master", __file__, CLK_HZ=CLK_HZ, BUS_HZ=bus_hz, STRETCH_US=STRETCH_US)
