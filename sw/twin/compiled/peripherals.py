# SPDX-License-Identifier: Apache-2.0
"""The devices of a station, behind the registers of the block `peripherals` as the firmware sees
them.
"""

import math
import random
from collections import deque
from collections.abc import Callable, Iterable
from typing import Protocol

from twin.compiled.node import CompiledNode
from twin.compiled.station_devices import Eeprom, I2cBus
from twin.compiled.tables import CLK_HZ, DEFINES, PERIOD

TURN_ARCSEC = 360 * 3600
CLK_MS = CLK_HZ // 1000


class Part(Protocol):
    """A device with its registers; `built` is the name of its bit in peripherals.built."""

    built: str

    def read(self, offset: int) -> int | None:
        """A register of the block, or None if it is not of this part."""

    def write(self, offset: int, value: int) -> None:
        """Write a register of the block, which may be one of another part."""

    def millisecond(self, machine: CompiledNode) -> None:
        """A millisecond of the node has passed."""


class PeripheralParts:
    """The block of registers; each part answers for its own."""

    def __init__(self, *parts: Part) -> None:
        self.parts = parts

    def read(self, offset: int) -> int:
        """A register of the block; 0 if no part has it."""
        if offset == DEFINES["PERIPHERALS_BUILT"]:
            return sum(DEFINES[f"PERIPHERALS_BUILT_{part.built}_MASK"] for part in self.parts)
        return next((value for part in self.parts if (value := part.read(offset)) is not None), 0)

    def write(self, offset: int, value: int) -> None:
        """Write a register of the block."""
        for part in self.parts:
            part.write(offset, value)

    def millisecond(self, machine: CompiledNode) -> None:
        """A millisecond of the node has passed."""
        for part in self.parts:
            part.millisecond(machine)


class Table:
    """A table that axis 0 turns by a worm: 0.18 arcsec a step, with the error of the worm, backlash
    and stiction. Angles are in arcsec and do not wrap.
    """

    def __init__(
        self,
        random_source: random.Random,
        angle: float = 0.0,
        backlash: float = 20.0,
        worm_error: float = 8.0,
        wheel_error: float = 15.0,
        stick: float = 1.0,
        sign: int = 1,
    ) -> None:
        """At an angle; errors, backlash and stiction in arcsec. With sign -1 steps turn it down."""
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

    def of_nut(self, nut: float) -> float:
        """The angle of the table without stiction, by the position of the nut, arcsec."""
        return (
            nut
            + self.worm_error * math.sin(2 * math.pi * nut / 7200 + self.phases[0])
            + self.wheel_error * math.sin(2 * math.pi * nut / TURN_ARCSEC + self.phases[1])
        )

    def millisecond(self, machine: CompiledNode) -> None:
        """A millisecond of the node has passed."""
        worm = self.sign * machine.axes[0].machine / PERIOD * 4 * 0.18
        self.nut = max(worm, min(self.nut, worm + self.backlash))
        free = self.offset + self.of_nut(self.nut)
        if abs(free - self.angle) > self.stick and not self.blocked:
            self.angle = free


class Sensor:
    """A sensor that sends the angle of the table, as it was 2 ms ago, in a frame each 10 ms, with
    the error of S4's sensor, 1 arcsec. Some frames are lost or damaged.
    """

    built = "SENSOR"

    def __init__(
        self,
        random_source: random.Random,
        table: Table,
        lost: float = 0.0,
        damaged: float = 0.0,
        noise: float = 0.4,
        wave: float = 0.6,
    ) -> None:
        """`lost` and `damaged` are the shares of the frames; noise and wave in arcsec."""
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
        self.counted = 0  # good frames, by the counter of the hardware
        self.dead = self.stuck = False

    def reading(self, angle: float) -> float:
        """What the sensor measures at an angle, arcsec."""
        return (
            angle
            + self.wave * math.sin(72 * 2 * math.pi * angle / TURN_ARCSEC)
            + self.random.uniform(-self.noise, self.noise)
        )

    def millisecond(self, machine: CompiledNode) -> None:
        """A millisecond of the node has passed."""
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
        self.counted = min(self.counted + 1, DEFINES["PERIPHERALS_SENSOR_FRAMES_MASK"])
        if not self.stuck:
            self.word = round(self.reading(self.before[0]) / TURN_ARCSEC * 2**32) % 2**32

    def read(self, offset: int) -> int | None:
        """A register of the block, or None if it is not of this part."""
        d = DEFINES
        if offset == d["PERIPHERALS_SENSOR_READING_LOW"]:
            self.latched = self.clk - self.sent_clk
            return self.word
        return {
            d["PERIPHERALS_SENSOR_FRAMES"]: self.counted,
            d["PERIPHERALS_SENSOR_READING_HIGH"]: self.latched,
            d["PERIPHERALS_SENSOR_ERRORS"]: min(self.wrong, 255)
            << d["PERIPHERALS_SENSOR_ERRORS_CRC_SHIFT"]
            | min(self.missed, 255) << d["PERIPHERALS_SENSOR_ERRORS_MISSED_SHIFT"],
        }.get(offset)

    def write(self, offset: int, value: int) -> None:
        """Write a register of the block."""
        if (
            offset == DEFINES["PERIPHERALS_SENSOR_ERRORS"]
            and value & DEFINES["PERIPHERALS_SENSOR_ERRORS_CLEAR_MASK"]
        ):
            self.missed = self.wrong = 0
        if offset == DEFINES["PERIPHERALS_SENSOR_FRAMES"]:
            self.counted = 0


class PeerPort:
    """Bytes to and from the port of another node; `spoil(bytes)` may change what this one sends."""

    built = "PEER"
    CHARACTERS = 11  # in a millisecond

    def __init__(self) -> None:
        self.received: deque[int] = deque()
        self.sent: deque[int] = deque()
        self.other: PeerPort | None = None
        self.spoil: Callable[[list[int]], Iterable[int]] = list

    def millisecond(self, machine: CompiledNode) -> None:
        """A millisecond of the node has passed."""
        passed = [self.sent.popleft() for _ in range(min(self.CHARACTERS, len(self.sent)))]
        if self.other:
            self.other.received.extend(self.spoil(passed))
        while len(self.received) > 64:
            self.received.pop()

    def read(self, offset: int) -> int | None:
        """A register of the block, or None if it is not of this part."""
        if offset == DEFINES["PERIPHERALS_PEER_RECEIVE"]:
            return (
                self.received.popleft() | DEFINES["PERIPHERALS_PEER_RECEIVE_PRESENT_MASK"]
                if self.received
                else 0
            )
        return 64 - len(self.sent) if offset == DEFINES["PERIPHERALS_PEER_STATE"] else None

    def write(self, offset: int, value: int) -> None:
        """Write a register of the block."""
        if offset == DEFINES["PERIPHERALS_PEER_TRANSMIT"]:
            assert len(self.sent) < 64, "a byte was lost: the queue was full"
            self.sent.append(value)


class I2c:
    """The I2C bus with an EEPROM."""

    built = "I2C"

    def __init__(self) -> None:
        self.bus, self.eeprom, self.clk = I2cBus(), Eeprom(), 0
        self.bus.devices = {0x50: self.eeprom}

    def power_cut(self, random_source: random.Random) -> bool:
        """Cut the power; returns whether a page of the EEPROM was being written."""
        self.bus.power_cut()
        return self.eeprom.power_cut(self.clk, random_source)

    def millisecond(self, machine: CompiledNode) -> None:
        """A millisecond of the node has passed."""
        self.clk = machine.clk

    def read(self, offset: int) -> int | None:
        """A register of the block, or None if it is not of this part."""
        if offset == DEFINES["PERIPHERALS_I2C_ANSWER"]:
            return self.bus.take(self.clk)
        return self.bus.state(self.clk) if offset == DEFINES["PERIPHERALS_I2C_STATE"] else None

    def write(self, offset: int, value: int) -> None:
        """Write a register of the block."""
        if offset == DEFINES["PERIPHERALS_I2C"]:
            self.bus.command(self.clk, value)


class NumericDisplay:
    """A MAX7219 with eight digits in code B."""

    built = "DISPLAY"
    SIGNS = "0123456789-EHLP "

    def __init__(self) -> None:
        self.registers: dict[int, int] = {}
        self.written = 0

    def text(self) -> str:
        """What is shown, without leading blanks; the display must be set up."""
        r = self.registers
        assert r[0x9] == 0xFF and r[0xB] == 7 and r[0xC] == 1 and r[0xF] == 0, (
            "the display is not set up"
        )
        return "".join(
            self.SIGNS[r[digit] & 15] + "." * (r[digit] >> 7) for digit in range(8, 0, -1)
        ).strip()

    def millisecond(self, machine: CompiledNode) -> None:
        """A millisecond of the node has passed."""
        pass

    def read(self, offset: int) -> int | None:
        """A register of the block, or None if it is not of this part."""
        return 16 if offset == DEFINES["PERIPHERALS_DISPLAY_STATE"] else None

    def write(self, offset: int, value: int) -> None:
        """Write a register of the block."""
        if offset == DEFINES["PERIPHERALS_DISPLAY"]:
            self.registers[value >> 8] = value & 0xFF
            self.written += 1
