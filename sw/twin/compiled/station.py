# SPDX-License-Identifier: Apache-2.0
"""A main node of S4 without hardware: what stands around it, byte by byte, behind the registers of
its peripherals.

On the I2C bus an EEPROM 24AA128, a key-pad controller TCA8418 and a character display HD44780
behind a PCF8574; on PS/2 the wire-EDM
machine and a person at its keyboard; on the peer port a sub-node. Time is the node's: i2c commands
take as long as the bus does.
"""

import random
import zlib
from collections import deque

from twin.compiled.node import CLK_HZ, DEFINES, TABLE, Axis, FakeNode

BYTE_CLK, EDGE_CLK = CLK_HZ * 9 // 100_000, CLK_HZ // 100_000  # at 100 kHz
STATE = {code: name for name, (code, _) in TABLE["job_state"].items()}
CAUSE = {code: name for name, (code, _) in TABLE["cause"].items()}
ACTION = {name: code for name, (code, _) in TABLE["job_action"].items()}
FLAG = {name: 1 << bit for name, (bit, _) in TABLE["job_flag"].items()}
SETTING = {name: setting["id"] for name, setting in TABLE["setting"].items()}
OPERATION = {name: operation["code"] for name, operation in TABLE["operation"].items()}
OK, NOT_ACKNOWLEDGED, NO_BUS = 0, 1, 3
KEYS = [
    "7",
    "8",
    "9",
    "START",
    "PAUSE",
    "RESUME",
    "STOP",
    "4",
    "5",
    "6",
    "AGAIN",
    "NEXT",
    "UP",
    "DOWN",
    "1",
    "2",
    "3",
    "DIVIDE",
    "LIST",
    "LIMIT",
    "SPEED",
    "0",
    ".",
    "ENTER",
    "CLEAR",
]
TURN = 129_600_000


def ms(time):
    return time * CLK_HZ // 1000


class Device:
    """What a device on the bus does with bytes; this one has neither any to give nor takes any."""

    def begun(self, now, reads):
        return True

    def written(self, now, byte):
        return True

    def read(self, now):
        return 0xFF

    def stopped(self, now):
        pass


class Eeprom(Device):
    """Microchip 24AA128. A power cut while a page is written leaves each of its bytes as it was, as
    it should be, or as anything.
    """

    BYTES, PAGE, WRITE = 16384, 64, ms(5)

    def __init__(self):
        self.memory = bytearray(b"\xff" * self.BYTES)
        self.worn = {}  # bytes that keep a value of their own
        self.busy_until, self.came, self.pointer, self.page, self.writes = 0, [], 0, None, 0

    def begun(self, now, reads):
        self.came = [] if not reads else self.came
        return now >= self.busy_until

    def written(self, now, byte):
        self.came.append(byte)
        if len(self.came) == 2:
            self.pointer = int.from_bytes(self.came, "big") % self.BYTES
        return True

    def read(self, now):
        self.pointer = (self.pointer + 1) % self.BYTES
        return self.memory[self.pointer - 1]

    def stopped(self, now):
        if len(self.came) > 2:
            start = self.pointer // self.PAGE * self.PAGE
            self.page = start, bytes(self.memory[start : start + self.PAGE])
            for n, byte in enumerate(self.came[2:]):
                self.memory[start + (self.pointer + n) % self.PAGE] = byte
            for place, byte in self.worn.items():
                self.memory[place] = byte
            self.busy_until, self.writes = now + self.WRITE, self.writes + 1
        self.came = []

    def power_cut(self, now, source):
        if now < self.busy_until:
            start, before = self.page
            for n, old in enumerate(before):
                self.memory[start + n] = source.choice(
                    (old, self.memory[start + n], source.randrange(256))
                )
        torn, self.busy_until, self.came = now < self.busy_until, 0, []
        return torn


class Keypad(Device):
    """TCA8418: registers, and the events of 5 rows of 7 keys."""

    CFG, EVENT, ROWS, COLUMNS = 0x01, 0x04, 0x1D, 0x1E

    def __init__(self):
        self.power_cut()

    def power_cut(self):
        self.registers, self.events, self.pointer = bytearray(0x30), deque(), None

    def begun(self, now, reads):
        self.pointer = self.pointer if reads else None
        return True

    def written(self, now, byte):
        if self.pointer is None:
            self.pointer = byte
        else:
            self.registers[self.pointer] = byte
        return True

    def read(self, now):
        if self.pointer == self.EVENT:
            return self.events.popleft() if self.events else 0
        return self.registers[self.pointer]

    def press(self, name):
        """Press and let go a key by what is written on it, or by its number."""
        row, column = divmod(name if isinstance(name, int) else KEYS.index(name), 7)
        if self.registers[self.ROWS] >> row & 1 and self.registers[self.COLUMNS] >> column & 1:
            for down in (0x80, 0):
                self.events.append(down | row * 10 + column + 1)


class Display(Device):
    """HD44780 in 4-bit mode behind a PCF8574."""

    CLK, CLEAR_CLK = CLK_HZ * 37 // 1_000_000 + 1, CLK_HZ * 152 // 100_000

    def __init__(self):
        self.power_cut(0)

    def power_cut(self, now):
        self.port, self.four_bits, self.half, self.memory, self.address, self.on = (
            0xFF,
            False,
            None,
            {},
            0,
            False,
        )
        self.busy_until, self.too_soon, self.rs_moved = now + ms(15), 0, 0

    def written(self, now, byte):
        if self.port & ~byte & 4 and not self.port & 2:  # E falls, RW is low
            self.strobe(now, self.port & 1, self.port >> 4)
        self.rs_moved += bool((self.port ^ byte) & 1 and byte & 4)  # RS must stand before E rises
        self.port = byte
        return True

    def strobe(self, now, data, nibble):
        if not self.four_bits:
            self.execute(now, data, nibble << 4)
        elif self.half is None:
            self.half = nibble
        else:
            byte, self.half = self.half << 4 | nibble, None
            self.execute(now, data, byte)

    def execute(self, now, data, byte):
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

    def lines(self):
        return [
            "".join(self.memory.get(start + n, " ") for n in range(20)) if self.on else ""
            for start in (0x00, 0x40, 0x14, 0x54)
        ]


class I2cBus:
    """The I2C master with its queues, and the devices by address."""

    def __init__(self):
        self.devices, self.stuck = {}, False
        self.power_cut()

    def power_cut(self):
        self.waiting, self.answers, self.end = deque(), deque(), 0  # (time when it ends, command)
        self.device, self.mode = None, "idle"

    def command(self, now, word):
        assert len(self.waiting) < 128, "a command was lost: the queue was full"
        code = word >> 8 & 7
        self.end = max(self.end, now) + (BYTE_CLK if code in (2, 3) else EDGE_CLK)
        self.waiting.append((self.end, code, word & 0xFF, word >> 11 & 1))

    def work(self, now):
        while self.waiting and self.waiting[0][0] <= now:
            self.answers.append(self.execute(*self.waiting.popleft()))

    def execute(self, now, code, data, acknowledge):
        if self.stuck:
            return NO_BUS << 8
        if code == 0:
            self.mode = "address"
        elif code == 1 or code == 4:
            if self.device:
                self.device.stopped(now)
            self.device, self.mode = None, "idle"
        elif self.mode == "address":
            self.device, reads = self.devices.get(data >> 1), data & 1
            self.mode = "read" if reads else "write"
            if self.device is None or not self.device.begun(now, reads):
                self.device = None
                return NOT_ACKNOWLEDGED << 8
        elif code == 2:
            if self.device is None or not self.device.written(now, data):
                return NOT_ACKNOWLEDGED << 8
        else:
            return self.device.read(now) if self.device else 0xFF
        return OK

    def take(self, now):
        self.work(now)
        return (
            self.answers.popleft() | DEFINES["PERIPHERALS_I2C_ANSWER_PRESENT_MASK"]
            if self.answers
            else 0
        )

    def state(self, now):
        self.work(now)
        return 128 - len(self.waiting) | DEFINES["PERIPHERALS_I2C_STATE_BUSY_MASK"] * bool(
            self.waiting
        )


class Edm:
    """The machine at the end of the PS/2 line, and a person who types."""

    START = bytes([0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14])
    IDLE, KEY = ms(300), ms(1)

    def __init__(self):
        self.heard, self.cuts = b"", []  # cuts: when they began
        self.cut_ms, self.reaction_ms = 400, 50
        self.deaf = self.endless = self.takes_nothing = False
        self.types_until = self.quiet_since = self.typed = 0
        self.start_at = self.end_at = None
        self.inputs = 0
        self.power_cut()

    def power_cut(self):  # of the node
        self.queue, self.injecting, self.edges, self.next_key = deque(), False, 0, 0

    def take_back(self):
        """What is queued; a sequence that is under way is finished."""
        under_way = (
            next(n for n, (_, last) in enumerate(self.queue, 1) if last) if self.injecting else 0
        )
        self.queue = deque(list(self.queue)[:under_way])

    def set(self, inputs):
        self.edges |= (inputs & ~self.inputs) << 2 | (self.inputs & ~inputs) << 4
        self.inputs = inputs

    def alarm(self, on=True):
        if on and self.inputs & 1:
            self.end_at = None
        self.set(2 if on else 0)

    def work(self, now):
        if now < self.types_until:
            self.typed, self.quiet_since = self.typed + 1, now
        free = now - self.quiet_since > self.IDLE and not self.takes_nothing
        if self.queue and (free or self.injecting) and now >= self.next_key:
            byte, last = self.queue.popleft()
            self.injecting, self.next_key, self.heard = (
                not last,
                now + self.KEY,
                self.heard + bytes([byte]),
            )
            if self.heard.endswith(self.START) and not self.deaf and not self.inputs:
                self.start_at = now + ms(self.reaction_ms)
        if self.start_at is not None and now >= self.start_at:
            self.start_at, self.end_at = None, now + ms(self.cut_ms)
            self.cuts.append(now)
            self.set(1)
        if self.end_at is not None and now >= self.end_at and not self.endless:
            self.end_at = None
            self.set(0)


class Station(FakeNode):
    """The node, powered up. `absent` names what is not there: eeprom, keypad, display. `built`: a
    mask of the peripherals.
    """

    CLK_HZ, POLL_CLK = CLK_HZ, CLK_HZ // 2000

    def __init__(self, absent=(), built=63, seed=0):
        self.source = random.Random(seed)
        self.eeprom, self.keypad, self.display, self.edm, self.bus = (
            Eeprom(),
            Keypad(),
            Display(),
            Edm(),
            I2cBus(),
        )
        self.sub_node = None
        self.built, self.peer_received = built, deque()
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

    def power_cut(self):
        """Of the node and what it feeds, just now; it has power again at once. Whether a page of
        the EEPROM was being written.
        """
        self.bus.work(self.clk)
        torn = self.eeprom.power_cut(self.clk, self.source)
        self.keypad.power_cut()
        self.display.power_cut(self.clk)
        self.edm.power_cut()
        self.bus.power_cut()
        self.peer_received.clear()
        self.firmware.firmware_start()
        return torn

    def read(self, offset):
        d, at = DEFINES, offset - DEFINES["PERIPHERALS_BASE"]
        if not 0 <= at < 0x100:
            return super().read(offset)
        if at == d["PERIPHERALS_BUILT"]:
            return self.built
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

    def write(self, offset, value):
        d, at = DEFINES, offset - DEFINES["PERIPHERALS_BASE"]
        if not 0 <= at < 0x100:
            return super().write(offset, value)
        if at == d["PERIPHERALS_I2C"]:
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
                self.sub_node.hear(self.clk, value)
        else:
            self.word[offset] = value
        return None

    def run(self, ms, until=None):
        """Two polls of the firmware a millisecond; True when `until` came."""
        for _ in range(int(ms * 2)):
            self.clk += self.POLL_CLK
            self.edm.work(self.clk)
            if self.sub_node:
                self.peer_received.extend(self.sub_node.work(self.clk))
            self.poll()
            if until and until():
                return True
        return False

    def job(self):
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

    def do(self, action):
        return self.request("job_do", action=ACTION[action])[0]

    def setting(self, **values):
        for name, value in values.items():
            self.ask("set_setting", setting=SETTING[name], value=value)

    def until(self, *states, ms=60_000):
        """Runs until the job is in one of the states; what it tells then."""
        codes = {code for code, name in STATE.items() if name in states}
        assert self.run(ms, until=lambda: self.firmware.job_state() in codes), (self.job(), states)
        return self.job()

    def ready(self):
        return self.until("idle", "paused", "unsure", "finished")

    def load(self, angles):
        """Writes a program; how that ended."""
        self.ask("job_begin")
        for station, angle in enumerate(angles):
            self.ask("job_add", station=station, angle=angle)
        self.ask("job_save")
        return self.saved()

    def saved(self):
        assert self.run(60_000, until=lambda: self.firmware.store_state() != 2)
        return CAUSE[self.ask("job_stations")["ended"]]

    def save_settings(self, action="save"):
        """How that ended."""
        cause, _ = self.request("save_settings", action=TABLE["save_action"][action][0])
        assert cause == "ok" and self.run(60_000, until=lambda: self.firmware.store_state() != 2), (
            cause
        )
        return self.saved_settings()["cause"]

    def saved_settings(self):
        reported = self.ask("saved_settings")
        return {**reported, "cause": CAUSE[reported["cause"]]}

    def program(self):
        """The angles that are in force."""
        return [
            self.ask("job_angle", station=n)["angle"]
            for n in range(self.ask("job_stations")["stations"])
        ]

    def press(self, *keys):
        for key in keys:
            self.keypad.press(key)
            self.run(60)

    def shown(self):
        self.run(400)
        return [line.rstrip() for line in self.display.lines()]


class SubNode:
    """A node that indexes, on the peer port: in `move_ms` it is there. `frames` or as printed;
    faults from outside.
    """

    def __init__(self, frames=True, move_ms=200):
        self.frames, self.move_ms = frames, move_ms
        self.angles, self.came, self.to_send, self.heads = [], bytearray(), deque(), 0
        self.target, self.there_at, self.ended, self.fault, self.dead, self.requests = (
            0,
            None,
            CAUSE_CODE["no_motion_yet"],
            None,
            False,
            0,
        )
        self.last_request = self.last_reply = None
        self.speeds = []  # override that came before each order
        self.faults, self.cause_stands, self.resets = (
            (),
            False,
            0,
        )  # latched ones, the first one first

    def hear(self, now, byte):
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

    def begin(self, now, angle):
        self.target, self.there_at, self.ended = (
            angle,
            now + ms(self.move_ms),
            CAUSE_CODE["running"],
        )
        self.requests += 1

    def do(self, now, body):
        operation, cause = body[1], "ok"
        if operation == OPERATION["turn_to"] and self.faults:
            cause = "faulted"
        elif operation == OPERATION["reset_faults"]:
            cause, self.resets = "fault_persists" if self.cause_stands else "ok", self.resets + 1
            self.faults = self.faults if self.cause_stands else ()
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

    def latch(self, *faults):
        """By their names, in the order in which they came; a turning table stops."""
        self.faults = faults
        if self.there_at is not None:
            self.there_at, self.ended = None, CAUSE_CODE["ended_by_fault"]

    def send(self, body):
        self.to_send.extend(b"\0" + cobs(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0")

    def work(self, now):
        """What it sends just now."""
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


def cobs(data):
    return b"".join(bytes([len(part) + 1]) + part for part in data.split(b"\0"))


def uncobs(data):
    parts, at = [], 0
    while at < len(data):
        parts.append(data[at + 1 : at + data[at]])
        at += data[at]
    return b"\0".join(parts)
