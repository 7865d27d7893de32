# SPDX-License-Identifier: Apache-2.0
"""The devices of a main node of S4, byte by byte: on the I2C bus an EEPROM 24AA128, a key-pad
controller TCA8418, and a character display HD44780 behind a PCF8574; on PS/2 the wire-EDM machine.
Time is that of the node, in cycles of its clock; I2C commands take as long as on the bus.
"""

import random
from collections import deque

from twin.compiled.tables import CLK_HZ, DEFINES

BYTE_CLK, EDGE_CLK = CLK_HZ * 9 // 100_000, CLK_HZ // 100_000  # at 100 kHz
OK, NOT_ACKNOWLEDGED, NO_BUS = 0, 1, 3
MOST_TYPED = DEFINES["PERIPHERALS_PS2_TYPED_MASK"]
KEYS = (
    "7 8 9 START PAUSE RESUME STOP "
    "4 5 6 AGAIN NEXT UP DOWN "
    "1 2 3 DIVIDE LIST LIMIT SPEED "
    "0 . ENTER CLEAR"
).split()


def ms(time: float) -> int:
    """Clock cycles of so many ms."""
    return int(time * CLK_HZ // 1000)


class Device:
    """A device on the I2C bus; this one acknowledges everything and has no data."""

    def begun(self, now: int, reads: int) -> bool:
        """Its address came, for reading or writing; returns whether the device acknowledges."""
        return True

    def written(self, now: int, byte: int) -> bool:
        """A byte came; returns whether the device acknowledges."""
        return True

    def read(self, now: int) -> int:
        """The byte that the device sends."""
        return 0xFF

    def stopped(self, now: int) -> None:
        """The transfer has ended."""
        pass


class Eeprom(Device):
    """Microchip 24AA128. A power cut while a page is being written leaves in each of its bytes the
    old value, the new one, or any other.
    """

    BYTES, PAGE, WRITE = 16384, 64, ms(5)

    def __init__(self) -> None:
        self.memory = bytearray(b"\xff" * self.BYTES)
        self.worn: dict[int, int] = {}  # bytes that cannot be written, and their values
        self.came: list[int] = []  # bytes of this transfer
        self.busy_until = self.pointer = self.writes = 0
        self.page = 0, b""  # that is being written: its address, and what it held before

    def begun(self, now: int, reads: int) -> bool:
        """Not acknowledged while a page is being written."""
        self.came = [] if not reads else self.came
        return now >= self.busy_until

    def written(self, now: int, byte: int) -> bool:
        """Two bytes of address, then data."""
        self.came.append(byte)
        if len(self.came) == 2:
            self.pointer = int.from_bytes(self.came, "big") % self.BYTES
        return True

    def read(self, now: int) -> int:
        """The byte at the pointer, which advances."""
        self.pointer = (self.pointer + 1) % self.BYTES
        return self.memory[self.pointer - 1]

    def stopped(self, now: int) -> None:
        """Begin to write the page."""
        if len(self.came) > 2:
            start = self.pointer // self.PAGE * self.PAGE
            self.page = start, bytes(self.memory[start : start + self.PAGE])
            for n, byte in enumerate(self.came[2:]):
                self.memory[start + (self.pointer + n) % self.PAGE] = byte
            for address, byte in self.worn.items():
                self.memory[address] = byte
            self.busy_until, self.writes = now + self.WRITE, self.writes + 1
        self.came = []

    def power_cut(self, now: int, source: random.Random) -> bool:
        """Cut the power; returns whether a page was being written."""
        if now < self.busy_until:
            start, before = self.page
            for n, old in enumerate(before):
                self.memory[start + n] = source.choice(
                    (old, self.memory[start + n], source.randrange(256))
                )
        writing, self.busy_until, self.came = now < self.busy_until, 0, []
        return writing


class Keypad(Device):
    """TCA8418: registers, and the events of 5 rows of 7 keys."""

    CFG, EVENT, ROWS, COLUMNS = 0x01, 0x04, 0x1D, 0x1E

    def __init__(self) -> None:
        self.power_cut()

    def power_cut(self) -> None:
        """All registers lose what was written."""
        self.registers = bytearray(0x30)
        self.events: deque[int] = deque()
        self.pointer: int | None = None

    def begun(self, now: int, reads: int) -> bool:
        """Always acknowledged."""
        self.pointer = self.pointer if reads else None
        return True

    def written(self, now: int, byte: int) -> bool:
        """The number of a register, then its value."""
        if self.pointer is None:
            self.pointer = byte
        else:
            self.registers[self.pointer] = byte
        return True

    def read(self, now: int) -> int:
        """The register; of EVENT the oldest event, or 0."""
        if self.pointer == self.EVENT:
            return self.events.popleft() if self.events else 0
        return self.registers[self.pointer or 0]

    def press(self, name: str | int) -> None:
        """Press and release a key, by its label or its number."""
        row, column = divmod(name if isinstance(name, int) else KEYS.index(name), 7)
        if self.registers[self.ROWS] >> row & 1 and self.registers[self.COLUMNS] >> column & 1:
            for down in (0x80, 0):
                self.events.append(down | row * 10 + column + 1)


class Display(Device):
    """HD44780 in 4-bit mode behind a PCF8574."""

    CLK, CLEAR_CLK = CLK_HZ * 37 // 1_000_000 + 1, CLK_HZ * 152 // 100_000

    def __init__(self) -> None:
        self.power_cut(0)

    def power_cut(self, now: int) -> None:
        """Cut the power; it takes 15 ms to start again."""
        self.port, self.address = 0xFF, 0
        self.four_bits = self.on = False
        self.half: int | None = None  # the first nibble of a byte
        self.memory: dict[int, str] = {}
        self.busy_until, self.too_soon, self.rs_moved = now + ms(15), 0, 0

    def written(self, now: int, byte: int) -> bool:
        """A level of the port."""
        if self.port & ~byte & 4 and not self.port & 2:  # E falls, RW is low
            self.strobe(now, self.port & 1, self.port >> 4)
        self.rs_moved += bool((self.port ^ byte) & 1 and byte & 4)  # RS must be set before E rises
        self.port = byte
        return True

    def strobe(self, now: int, data: int, nibble: int) -> None:
        """E has fallen."""
        if not self.four_bits:
            self.execute(now, data, nibble << 4)
        elif self.half is None:
            self.half = nibble
        else:
            byte, self.half = self.half << 4 | nibble, None
            self.execute(now, data, byte)

    def execute(self, now: int, data: int, byte: int) -> None:
        """An instruction, or a character if `data`."""
        self.too_soon += now < self.busy_until
        self.busy_until = now + (self.CLEAR_CLK if not data and byte < 4 else self.CLK)
        if data:
            self.memory[self.address] = chr(byte)
            self.address += 1
        elif byte & 0x80:
            self.address = byte & 0x7F
        elif byte & 0x20:
            self.four_bits = not byte & 0x10
        elif byte & 0x08:
            self.on = bool(byte & 4)
        elif byte == 1:
            self.memory, self.address = {}, 0

    def lines(self) -> list[str]:
        """The four lines as they are shown; empty while the display is off."""
        return [
            "".join(self.memory.get(start + n, " ") for n in range(20)) if self.on else ""
            for start in (0x00, 0x40, 0x14, 0x54)
        ]


class I2cBus:
    """The I2C master with its queues, and the devices by address."""

    def __init__(self) -> None:
        self.devices: dict[int, Device] = {}  # by address
        self.stuck = False  # a line of the bus stays low
        self.power_cut()

    def power_cut(self) -> None:
        """The master loses its queues."""
        # Commands: when each ends, code, data, acknowledge.
        self.waiting: deque[tuple[int, int, int, int]] = deque()
        self.answers: deque[int] = deque()
        self.end = 0
        self.device: Device | None = None
        self.mode = "idle"

    def command(self, now: int, word: int) -> None:
        """The firmware puts a command into the queue."""
        assert len(self.waiting) < 128, "a command was lost: the queue was full"
        code = word >> 8 & 7
        self.end = max(self.end, now) + (BYTE_CLK if code in (2, 3) else EDGE_CLK)
        self.waiting.append((self.end, code, word & 0xFF, word >> 11 & 1))

    def work(self, now: int) -> None:
        """Execute the commands whose time has come."""
        while self.waiting and self.waiting[0][0] <= now:
            self.answers.append(self.execute(*self.waiting.popleft()))

    def execute(self, now: int, code: int, data: int, acknowledge: int) -> int:
        """Execute a command; returns its answer."""
        if self.stuck:
            return NO_BUS << 8
        if code == 0:
            self.mode = "address"
        elif code == 1 or code == 4:
            if self.device:
                self.device.stopped(now)
            self.device, self.mode = None, "idle"
        elif self.mode == "address":
            self.device = self.devices.get(data >> 1)
            self.mode = "read" if data & 1 else "write"
            if self.device is None or not self.device.begun(now, data & 1):
                self.device = None
                return NOT_ACKNOWLEDGED << 8
        elif code == 2:
            if self.device is None or not self.device.written(now, data):
                return NOT_ACKNOWLEDGED << 8
        else:
            return self.device.read(now) if self.device else 0xFF
        return OK

    def take(self, now: int) -> int:
        """The register with the oldest answer."""
        self.work(now)
        return (
            self.answers.popleft() | DEFINES["PERIPHERALS_I2C_ANSWER_PRESENT_MASK"]
            if self.answers
            else 0
        )

    def state(self, now: int) -> int:
        """The register with the room in the queue."""
        self.work(now)
        return 128 - len(self.waiting) | DEFINES["PERIPHERALS_I2C_STATE_BUSY_MASK"] * bool(
            self.waiting
        )


class Edm:
    """The machine at the end of the keyboard cable, and a person who types."""

    START = bytes([0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14])
    IDLE, KEY = ms(300), ms(1)

    def __init__(self) -> None:
        self.received = b""  # scan codes
        self.cuts: list[int] = []  # when they began
        self.cut_ms, self.reaction_ms = 400, 50
        self.deaf = self.endless = self.takes_nothing = False
        self.types_until = self.quiet_since = self.typed = 0
        self.start_at: int | None = None
        self.end_at: int | None = None
        self.inputs = 0
        self.power_cut()

    def power_cut(self) -> None:
        """The node loses its power: what it had queued is gone."""
        self.queue: deque[tuple[int, int]] = deque()  # scan code, and whether it is the last one
        self.injecting, self.edges, self.next_key = False, 0, 0

    def take_back(self) -> None:
        """Drop the queued keys; a sequence that is being sent is finished."""
        under_way = (
            next(n for n, (_, last) in enumerate(self.queue, 1) if last) if self.injecting else 0
        )
        self.queue = deque(list(self.queue)[:under_way])

    def set(self, inputs: int) -> None:
        """Set the status inputs, bits 0 (cutting) and 1 (alarm)."""
        self.edges |= (inputs & ~self.inputs) << 2 | (self.inputs & ~inputs) << 4
        self.inputs = inputs

    def alarm(self, on: bool = True) -> None:
        """Raise an alarm, which ends a cut, or clear it."""
        if on and self.inputs & 1:
            self.end_at = None
        self.set(2 if on else 0)

    def work(self, now: int) -> None:
        """What has happened until now."""
        if now < self.types_until:
            self.typed, self.quiet_since = min(self.typed + 1, MOST_TYPED), now
        free = now - self.quiet_since > self.IDLE and not self.takes_nothing
        if self.queue and (free or self.injecting) and now >= self.next_key:
            byte, last = self.queue.popleft()
            self.injecting, self.next_key, self.received = (
                not last,
                now + self.KEY,
                self.received + bytes([byte]),
            )
            if self.received.endswith(self.START) and not self.deaf and not self.inputs:
                self.start_at = now + ms(self.reaction_ms)
        if self.start_at is not None and now >= self.start_at:
            self.start_at, self.end_at = None, now + ms(self.cut_ms)
            self.cuts.append(now)
            self.set(1)
        if self.end_at is not None and now >= self.end_at and not self.endless:
            self.end_at = None
            self.set(0)
