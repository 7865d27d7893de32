# SPDX-License-Identifier: Apache-2.0
"""What stands around a station: the link registers as the firmware sees them, behind each link a
part.

A part has `built` (its bit of peripherals.built), `read(offset)` (None: not its register),
`write(offset, value)` and `millisecond(machine)`.
"""

import math
from collections import deque

from twin.compiled.node import CLK_HZ, DEFINES, PERIOD
from twin.compiled.station import Eeprom, I2cBus

TURN_ARCSEC = 360 * 3600
CLK_MS = CLK_HZ // 1000


class FakePeripherals:
    def __init__(self, *parts):
        self.parts = parts

    def read(self, offset):
        if offset == DEFINES["PERIPHERALS_BUILT"]:
            return sum(DEFINES[f"PERIPHERALS_BUILT_{part.built}_MASK"] for part in self.parts)
        return next((value for part in self.parts if (value := part.read(offset)) is not None), 0)

    def write(self, offset, value):
        for part in self.parts:
            part.write(offset, value)

    def millisecond(self, machine):
        for part in self.parts:
            part.millisecond(machine)


class Table:
    """Axis 0 turns it by a worm: 0.18 arcsec a step, with the worm's error, backlash and stiction.
    Angles in arcsec, endless.
    """

    def __init__(
        self,
        random_source,
        angle=0.0,
        backlash=20.0,
        worm_error=8.0,
        wheel_error=15.0,
        stick=1.0,
        sign=1,
    ):
        self.phases = [random_source.uniform(0, 2 * math.pi) for _ in range(2)]
        self.backlash, self.worm_error, self.wheel_error, self.stick, self.sign = (
            backlash,
            worm_error,
            wheel_error,
            stick,
            sign,
        )
        self.blocked = False
        self.nut = 0.0
        self.angle = angle
        self.offset = angle - self.of_nut(0.0)

    def of_nut(self, nut):
        return (
            nut
            + self.worm_error * math.sin(2 * math.pi * nut / 7200 + self.phases[0])
            + self.wheel_error * math.sin(2 * math.pi * nut / TURN_ARCSEC + self.phases[1])
        )

    def millisecond(self, machine):
        worm = self.sign * machine.axes[0].machine / PERIOD * 4 * 0.18
        self.nut = max(worm, min(self.nut, worm + self.backlash))
        wanted = self.offset + self.of_nut(self.nut)
        if abs(wanted - self.angle) > self.stick and not self.blocked:
            self.angle = wanted


class Sensor:
    """Frames of the table's angle, one each 10 ms, of 2 ms ago, with S4's 1 arcsec; some are lost
    or damaged on their way.
    """

    built = "SENSOR"

    def __init__(self, random_source, table, lost=0.0, damaged=0.0, noise=0.4, wave=0.6):
        self.random, self.table, self.lost, self.damaged, self.noise, self.wave = (
            random_source,
            table,
            lost,
            damaged,
            noise,
            wave,
        )
        self.ms, self.before = 0, deque([table.angle] * 3, maxlen=3)
        self.word, self.sent_clk, self.clk, self.latched = 0, 0, 0, 0
        self.frames, self.missed, self.wrong = 0, 0, 0
        self.dead = self.stuck = False

    def reading(self, angle):
        return (
            angle
            + self.wave * math.sin(72 * 2 * math.pi * angle / TURN_ARCSEC)
            + self.random.uniform(-self.noise, self.noise)
        )

    def millisecond(self, machine):
        self.table.millisecond(machine)
        self.before.append(self.table.angle)
        self.ms, self.clk = self.ms + 1, machine.clk
        if self.ms % 10 or self.dead:
            return
        chance = self.random.random()
        if chance < self.lost + self.damaged:
            self.missed += 1
            self.wrong += chance >= self.lost
            return
        self.frames, self.sent_clk = self.frames + 1, machine.clk - CLK_MS
        if not self.stuck:
            self.word = round(self.reading(self.before[0]) / TURN_ARCSEC * 2**32) % 2**32

    def read(self, offset):
        d = DEFINES
        if offset == d["PERIPHERALS_SENSOR_READING_LOW"]:
            self.latched = self.clk - self.sent_clk
            return self.word
        return {
            d["PERIPHERALS_SENSOR_FRAMES"]: self.frames,
            d["PERIPHERALS_SENSOR_READING_HIGH"]: self.latched,
            d["PERIPHERALS_SENSOR_ERRORS"]: min(self.wrong, 255)
            << d["PERIPHERALS_SENSOR_ERRORS_CRC_SHIFT"]
            | min(self.missed, 255) << d["PERIPHERALS_SENSOR_ERRORS_MISSED_SHIFT"],
        }.get(offset)

    def write(self, offset, value):
        if (
            offset == DEFINES["PERIPHERALS_SENSOR_ERRORS"]
            and value & DEFINES["PERIPHERALS_SENSOR_ERRORS_CLEAR_MASK"]
        ):
            self.missed = self.wrong = 0


class PeerPort:
    """Bytes to and from another node; `spoil(bytes)` may change what this one sends."""

    built = "PEER"
    CHARACTERS = 11  # a millisecond

    def __init__(self):
        self.received, self.sent, self.other, self.spoil = deque(), deque(), None, list

    def millisecond(self, machine):
        told = [self.sent.popleft() for _ in range(min(self.CHARACTERS, len(self.sent)))]
        if self.other:
            self.other.received.extend(self.spoil(told))
        while len(self.received) > 64:
            self.received.pop()

    def read(self, offset):
        if offset == DEFINES["PERIPHERALS_PEER_RECEIVE"]:
            return (
                self.received.popleft() | DEFINES["PERIPHERALS_PEER_RECEIVE_PRESENT_MASK"]
                if self.received
                else 0
            )
        return 64 - len(self.sent) if offset == DEFINES["PERIPHERALS_PEER_STATE"] else None

    def write(self, offset, value):
        if offset == DEFINES["PERIPHERALS_PEER_TRANSMIT"]:
            assert len(self.sent) < 64, "a byte was lost: the queue was full"
            self.sent.append(value)


class I2c:
    """The bus with an EEPROM, of station.py."""

    built = "I2C"

    def __init__(self):
        self.bus, self.eeprom, self.clk = I2cBus(), Eeprom(), 0
        self.bus.devices = {0x50: self.eeprom}

    def power_cut(self, random_source):
        self.bus.power_cut()
        return self.eeprom.power_cut(self.clk, random_source)

    def millisecond(self, machine):
        self.clk = machine.clk

    def read(self, offset):
        if offset == DEFINES["PERIPHERALS_I2C_ANSWER"]:
            return self.bus.take(self.clk)
        return self.bus.state(self.clk) if offset == DEFINES["PERIPHERALS_I2C_STATE"] else None

    def write(self, offset, value):
        if offset == DEFINES["PERIPHERALS_I2C"]:
            self.bus.command(self.clk, value)


class NumericDisplay:
    """A MAX7219 with eight digits in code B."""

    built = "DISPLAY"
    SIGNS = "0123456789-EHLP "

    def __init__(self):
        self.registers, self.written = {}, 0

    def text(self):
        r = self.registers
        assert r[0x9] == 0xFF and r[0xB] == 7 and r[0xC] == 1 and r[0xF] == 0, (
            "the display is not set up"
        )
        return "".join(
            self.SIGNS[r[digit] & 15] + "." * (r[digit] >> 7) for digit in range(8, 0, -1)
        ).strip()

    def millisecond(self, machine):
        pass

    def read(self, offset):
        return 16 if offset == DEFINES["PERIPHERALS_DISPLAY_STATE"] else None

    def write(self, offset, value):
        if offset == DEFINES["PERIPHERALS_DISPLAY"]:
            self.registers[value >> 8] = value & 0xFF
            self.written += 1
