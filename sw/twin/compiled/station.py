# SPDX-License-Identifier: Apache-2.0
"""A main node of S4 without hardware: the compiled firmware, and its devices byte by byte behind
the registers of the block `peripherals`.

The I2C bus has an EEPROM 24AA128, a key-pad controller TCA8418, and a character display HD44780
behind a PCF8574. On PS/2 are the wire-EDM machine and a person at its keyboard, on the peer port a
sub-node. Time is that of the node, in cycles of its clock; I2C commands take as long as on the bus.
"""

import random
import zlib
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import CLK_HZ, DEFINES, TABLE

BYTE_CLK, EDGE_CLK = CLK_HZ * 9 // 100_000, CLK_HZ // 100_000  # at 100 kHz
STATE: dict[int, str] = {code: name for name, (code, _) in TABLE["job_state"].items()}
CAUSE: dict[int, str] = {code: name for name, (code, _) in TABLE["cause"].items()}
ACTION = {name: code for name, (code, _) in TABLE["job_action"].items()}
FLAG = {name: 1 << bit for name, (bit, _) in TABLE["job_flag"].items()}
SETTING = {name: setting["id"] for name, setting in TABLE["setting"].items()}
OPERATION = {name: operation["code"] for name, operation in TABLE["operation"].items()}
OK, NOT_ACKNOWLEDGED, NO_BUS = 0, 1, 3
KEYS = (
    "7 8 9 START PAUSE RESUME STOP "
    "4 5 6 AGAIN NEXT UP DOWN "
    "1 2 3 DIVIDE LIST LIMIT SPEED "
    "0 . ENTER CLEAR"
).split()
TURN = 129_600_000  # 0.01 arcsec
WRITING = 2  # a store_state


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
            self.typed, self.quiet_since = self.typed + 1, now
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


class Station(CompiledNode):
    """The node, powered up. `absent` names the devices that are missing: eeprom, keypad, display.
    `peripherals_built` is the register peripherals.built, `seed` is that of the damage by power
    cuts.
    """

    CLK_HZ, POLL_CLK = CLK_HZ, CLK_HZ // 2000

    def __init__(
        self, absent: Sequence[str] = (), peripherals_built: int = 63, seed: int = 0
    ) -> None:
        self.source = random.Random(seed)
        self.eeprom, self.keypad, self.display, self.edm, self.bus = (
            Eeprom(),
            Keypad(),
            Display(),
            Edm(),
            I2cBus(),
        )
        self.sub_node: SubNode | None = None
        self.peripherals_built = peripherals_built
        self.peer_received: deque[int] = deque()
        self.bus.devices = {
            address: device
            for name, address, device in (
                ("eeprom", 0x50, self.eeprom),
                ("keypad", 0x34, self.keypad),
                ("display", 0x27, self.display),
            )
            if name not in absent
        }
        super().__init__(Axis(), image="station")

    def power_cut(self) -> bool:
        """Cut the power of the node and of what it supplies; it has power again at once. Returns
        whether a page of the EEPROM was being written.
        """
        self.bus.work(self.clk)
        writing = self.eeprom.power_cut(self.clk, self.source)
        self.keypad.power_cut()
        self.display.power_cut(self.clk)
        self.edm.power_cut()
        self.bus.power_cut()
        self.peer_received.clear()
        self.firmware.firmware_start()
        return writing

    def read(self, offset: int) -> int:
        """A register, as the firmware reads it."""
        d, at = DEFINES, offset - DEFINES["PERIPHERALS_BASE"]
        if not 0 <= at < 0x100:
            return super().read(offset)
        if at == d["PERIPHERALS_BUILT"]:
            return self.peripherals_built
        if at == d["PERIPHERALS_I2C_ANSWER"]:
            return self.bus.take(self.clk)
        if at == d["PERIPHERALS_I2C_STATE"]:
            return self.bus.state(self.clk)
        if at == d["PERIPHERALS_PS2_STATE"]:
            return (
                32 - len(self.edm.queue)
                | d["PERIPHERALS_PS2_STATE_INJECTING_MASK"] * self.edm.injecting
            )
        if at == d["PERIPHERALS_PS2_TYPED"]:
            return self.edm.typed
        if at == d["PERIPHERALS_EDM_STATUS"]:
            return self.edm.inputs | self.edm.edges
        if at == d["PERIPHERALS_PEER_RECEIVE"]:
            return (
                self.peer_received.popleft() | d["PERIPHERALS_PEER_RECEIVE_PRESENT_MASK"]
                if self.peer_received
                else 0
            )
        if at == d["PERIPHERALS_PEER_STATE"]:
            return 64
        return self.word.get(offset, 0)

    def write(self, offset: int, value: int) -> None:
        """Write a register, as the firmware does."""
        d, at = DEFINES, offset - DEFINES["PERIPHERALS_BASE"]
        if not 0 <= at < 0x100:
            super().write(offset, value)
        elif at == d["PERIPHERALS_I2C"]:
            self.bus.command(self.clk, value)
        elif at == d["PERIPHERALS_PS2_STATE"]:
            if value & d["PERIPHERALS_PS2_STATE_DROP_MASK"]:
                self.edm.take_back()
        elif at == d["PERIPHERALS_PS2_INJECT"]:
            self.edm.queue.append((value & 0xFF, value >> 8 & 1))
        elif at == d["PERIPHERALS_EDM_STATUS"]:
            self.edm.edges &= ~value
        elif at == d["PERIPHERALS_PEER_TRANSMIT"]:
            if self.sub_node:
                self.sub_node.receive(self.clk, value)
        else:
            self.word[offset] = value

    def run(self, ms: float, until: Callable[[], object] | None = None) -> bool:
        """Run for `ms`, with two polls of the firmware a millisecond. Stops early and returns True
        once `until` is true.
        """
        for _ in range(int(ms * 2)):
            self.clk += self.POLL_CLK
            self.edm.work(self.clk)
            if self.sub_node:
                self.peer_received.extend(self.sub_node.work(self.clk))
            self.poll()
            if until and until():
                return True
        return False

    def job(self) -> dict[str, Any]:
        """The reply to `job`, with the names of state, cause, actions, flags and faults."""
        reported = self.ask("job")
        return {
            **reported,
            "state": STATE[reported["state"]],
            "cause": CAUSE[reported["cause"]],
            "answers": {name for name, code in ACTION.items() if reported["answers"] >> code & 1},
            "flags": {name for name, bit in FLAG.items() if reported["flags"] & bit},
            "table_faults": {
                name
                for name, (bit, _) in TABLE["fault"].items()
                if reported["table_faults"] >> bit & 1
            },
        }

    def do(self, action: str) -> str:
        """Do a job_action; returns the cause."""
        return self.request("job_do", action=ACTION[action])[0]

    def setting(self, **values: int) -> None:
        """Set settings by their names, in their LSB."""
        for name, value in values.items():
            self.ask("set_setting", setting=SETTING[name], value=value)

    def until(self, *states: str, ms: float = 60_000) -> dict[str, Any]:
        """Run until the job is in one of the states; returns its report. Fails after `ms`."""
        codes = {code for code, name in STATE.items() if name in states}
        assert self.run(ms, until=lambda: self.firmware.job_state() in codes), (self.job(), states)
        return self.job()

    def ready(self) -> dict[str, Any]:
        """Run until the EEPROM is loaded; returns the report of the job."""
        return self.until("idle", "paused", "unsure", "finished")

    def load(self, angles: Iterable[int]) -> str:
        """Save a station list, in 0.01 arcsec; returns the cause with which that ended."""
        self.ask("job_begin")
        for station, angle in enumerate(angles):
            self.ask("job_add", station=station, angle=angle)
        self.ask("job_save")
        return self.saved()

    def saved(self) -> str:
        """Run until nothing is being written; returns the cause with which that ended."""
        assert self.run(60_000, until=lambda: self.firmware.store_state() != WRITING)
        return CAUSE[self.ask("job_stations")["ended"]]

    def save_settings(self, action: str = "save") -> str:
        """Do a save_action; returns the cause with which that ended."""
        self.ask("save_settings", action=TABLE["save_action"][action][0])
        assert self.run(60_000, until=lambda: self.firmware.store_state() != WRITING)
        return CAUSE[self.ask("saved_settings")["cause"]]

    def saved_settings(self) -> dict[str, Any]:
        """The reply to `saved_settings`, with the name of the cause."""
        reported = self.ask("saved_settings")
        return {**reported, "cause": CAUSE[reported["cause"]]}

    def station_list(self) -> list[int]:
        """The angles of the list in force, 0.01 arcsec."""
        return [
            self.ask("job_angle", station=n)["angle"]
            for n in range(self.ask("job_stations")["stations"])
        ]

    def press(self, *keys: str | int) -> None:
        """Press keys one after the other."""
        for key in keys:
            self.keypad.press(key)
            self.run(60)

    def shown(self) -> list[str]:
        """The lines of the display after a refresh."""
        self.run(400)
        return [line.rstrip() for line in self.display.lines()]


class SubNode:
    """A node on the peer port whose table takes `move_ms` for each turn; in mode frames or legacy.
    Faults come from outside, by latch().
    """

    def __init__(self, frames: bool = True, move_ms: float = 200) -> None:
        self.frames, self.move_ms = frames, move_ms
        self.angles: list[int | None] = []  # where the table has been
        self.came, self.heads = bytearray(), 0
        self.to_send: deque[int] = deque()
        self.target: int | None = 0
        self.there_at: int | None = None  # when the turn ends
        self.ended = CAUSE_CODE["no_motion_yet"]
        self.fault: str | None = None  # the cause with which a turn fails, or "never"
        self.dead = False
        self.requests = 0  # turns that were ordered
        self.last_request = self.last_reply = b""
        self.speeds: list[int] = []  # feed override that came before each order
        self.faults: tuple[str, ...] = ()  # latched ones, the first one first
        self.cause_persists = False  # a reset does not help
        self.resets = 0

    def receive(self, now: int, byte: int) -> None:
        """A byte from the main node."""
        if self.dead:
            return
        if not self.frames:
            if byte == 0xFF:
                self.heads = min(self.heads + 1, 2)
            else:
                if self.heads == 2 and byte == 0xAA:
                    self.begin(now, None)
                self.heads = 0
        elif byte:
            self.came.append(byte)
        elif self.came:
            body = uncobs(bytes(self.came))
            self.came.clear()
            if len(body) > 4 and zlib.crc32(body[:-4]).to_bytes(4, "little") == body[-4:]:
                if body != self.last_request:
                    self.last_request, self.last_reply = body, self.do(now, body[:-4])
                self.send(self.last_reply)

    def begin(self, now: int, angle: int | None) -> None:
        """Begin to turn; in mode legacy without an angle."""
        self.target, self.there_at, self.ended = (
            angle,
            now + ms(self.move_ms),
            CAUSE_CODE["running"],
        )
        self.requests += 1

    def do(self, now: int, body: bytes) -> bytes:
        """Do a request; returns the reply."""
        operation, cause = body[1], "ok"
        if operation == OPERATION["turn_to"] and self.faults:
            cause = "faulted"
        elif operation == OPERATION["reset_faults"]:
            cause, self.resets = "fault_persists" if self.cause_persists else "ok", self.resets + 1
            self.faults = self.faults if self.cause_persists else ()
        elif operation == OPERATION["turn_to"]:
            self.begin(now, int.from_bytes(body[2:6], "little"))
        elif operation == OPERATION["set_parameter"]:
            self.speeds.append(int.from_bytes(body[4:], "little"))
        elif operation == OPERATION["stop"]:
            self.there_at, self.ended = None, CAUSE_CODE["stopped"]
        latched = [1 << TABLE["fault"][name][0] for name in self.faults]
        values = {
            "phase": self.there_at is not None,
            "ended": self.ended,
            "target": self.target,
            "faults": sum(latched),
            "first_fault": latched[0] if latched else 0,
        }
        reply = bytes([body[0], operation, CAUSE_CODE[cause]])
        if operation in (OPERATION["turn_state"], OPERATION["status"]):
            name = next(name for name, code in OPERATION.items() if code == operation)
            for field in TABLE["operation"][name]["reply"]:
                name, kind = field.split()
                reply += int(values.get(name, 0)).to_bytes(int(kind[1:]) // 8, "little")
        return reply

    def latch(self, *faults: str) -> None:
        """Latch faults by their names, in the order in which they came; a turning table stops."""
        self.faults = faults
        if self.there_at is not None:
            self.there_at, self.ended = None, CAUSE_CODE["ended_by_fault"]

    def send(self, body: bytes) -> None:
        """Send a frame."""
        self.to_send.extend(b"\0" + cobs(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0")

    def work(self, now: int) -> bytes:
        """Turn the table; returns what the sub-node sends now."""
        if self.there_at is not None and now >= self.there_at and self.fault != "never":
            self.there_at, self.ended = None, CAUSE_CODE[self.fault or "ok"]
            if self.fault is None:
                self.angles.append(self.target)
                if not self.frames:
                    self.to_send.extend(b"\xff\xff\x55")
        sent = bytes(self.to_send) if not self.dead else b""
        self.to_send.clear()
        return sent


CAUSE_CODE = {name: code for code, name in CAUSE.items()}


def cobs(data: bytes) -> bytes:
    """Encode data, below 254 bytes between zeros, without the delimiters."""
    return b"".join(bytes([len(part) + 1]) + part for part in data.split(b"\0"))


def uncobs(data: bytes) -> bytes:
    """Decode what cobs has encoded."""
    parts, at = [], 0
    while at < len(data):
        parts.append(data[at + 1 : at + data[at]])
        at += data[at]
    return b"\0".join(parts)
