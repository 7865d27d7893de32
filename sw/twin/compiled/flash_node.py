# SPDX-License-Identifier: Apache-2.0
"""A node whose firmware comes out of a serial flash, without hardware: a model of the flash that
may lose its power at any moment, the loader, and the compiled firmware, on a bus of its own.

The compiled firmware runs whatever lies in the flash; `runs` are the bytes that a real node would
run, which a test compares with those that it has written.
"""

import random
import zlib
from collections.abc import Sequence

from moire.bus.transport import Transport
from twin.compiled.node import CompiledNode
from twin.compiled.tables import CLK_HZ, DEFINES

START = 0x20000  # FLASH_START of rtl/node.sv
SPACING = 0x10000  # bytes from image to image
PROGRAM_BYTES = 0x8000  # that the loader copies
SECTOR, PAGE = 4096, 256
PROGRAM, READ, STATUS, WRITE_ENABLE, ERASE = 0x02, 0x03, 0x05, 0x06, 0x20
IMAGE = "steps"  # of the firmware: the one whose nodes have drives, which must be off
GOOD = 0x2144DF1C  # CRC-32 of a frame together with its own CRC-32
MOST_POLLS = 4  # of the status while a sector is erased or a page is programmed
TRIAL_MS = (1 << 28) * 1000 // CLK_HZ  # TRIAL_BITS of rtl/cpu/serial_core.sv


class SerialFlash:
    """The flash, byte by byte. A sector or a page that is being erased or programmed when the power
    is cut has random bits: those of a page anything between before and after, those of a sector
    anything at all.
    """

    def __init__(self, source: random.Random, content: bytes = b"") -> None:
        self.source = source
        self.content = bytearray(content.ljust(START + 3 * SPACING, b"\xff"))
        self.command: list[int] = []
        self.enabled = False
        self.work: dict[int, int] = {}  # bytes that are being written, by their address
        self.polls = 0  # until they are written
        self.exchanges = 0
        self.works = 0  # erasures and programmings so far
        self.cut_at: int | None = None  # number of exchanges after which the power is cut
        self.cut_in: int | None = None  # or number of the work in the midst of which it is cut
        self.powered = True

    def power_up(self, cut_at: int | None = None, cut_in: int | None = None) -> None:
        """The power returns, to be cut after so many exchanges, or in the midst of this erasure or
        programming, if a number is given.
        """
        self.command, self.work, self.works = [], {}, 0
        self.enabled, self.powered, self.exchanges = False, True, 0
        self.cut_at, self.cut_in = cut_at, cut_in

    def exchange(self, byte: int, ends: bool) -> int:
        """A byte to the flash and one back; `ends`: the command ends with it."""
        self.exchanges += 1
        if self.exchanges == self.cut_at:
            self.cut()
        if not self.powered:
            return 0
        self.command.append(byte)
        answer = self.answer()
        if ends:
            self.execute()
            self.command = []
        return answer

    def answer(self) -> int:
        """The byte that the flash sends meanwhile."""
        code, count = self.command[0], len(self.command)
        if code == STATUS and count > 1:
            if self.work:
                self.polls -= 1
                if self.polls == 0:
                    self.finish()
            return int(bool(self.work))
        if code == READ and count > 4 and not self.work:
            return self.content[(self.address() + count - 5) % len(self.content)]
        return 0xFF

    def address(self) -> int:
        """Of the command."""
        return int.from_bytes(bytes(self.command[1:4]), "big")

    def execute(self) -> None:
        """The command has ended; while the flash works it takes none."""
        code = self.command[0]
        if self.work:
            return
        if code == WRITE_ENABLE:
            self.enabled = True
        elif self.enabled and code in (ERASE, PROGRAM):
            self.enabled = False
            self.works += 1
            self.polls = self.source.randint(1, MOST_POLLS)
            if self.works == self.cut_in:  # a poll of the status has two bytes
                self.cut_at = self.exchanges + self.source.randint(1, 2 * self.polls - 1)
            first = self.address()
            if code == ERASE:
                first -= first % SECTOR
                self.work = dict.fromkeys(range(first, first + SECTOR), 0xFF)
            else:
                page = first - first % PAGE
                for n, byte in enumerate(self.command[4:]):
                    at = page + (first + n) % PAGE
                    self.work[at] = self.content[at] & byte

    def finish(self) -> None:
        """All bytes are written."""
        for at, byte in self.work.items():
            self.content[at] = byte
        self.work = {}

    def cut(self) -> None:
        """The power fails."""
        erasing = len(self.work) == SECTOR
        for at, byte in self.work.items():
            bits = self.source.getrandbits(8)
            before = self.content[at]
            self.content[at] = bits if erasing else before & (byte | bits)
        self.work, self.powered = {}, False


class FlashNode:
    """A node with its flash; the port of the serial core is read and write."""

    def __init__(self, flash: SerialFlash, address: int = 1) -> None:
        self.flash, self.address = flash, address
        self.hangs: bytes | None = None  # firmware that does not answer, if it is loaded
        self.power_up()

    def power_up(self, cut_at: int | None = None) -> None:
        """The power returns, and the factory image is loaded; see SerialFlash."""
        self.flash.power_up(cut_at)
        self.load(0, trial=False)

    def load(self, image: int, trial: bool) -> None:
        """Copy an image and start it, and so on while the firmware starts another one."""
        self.next: tuple[int, bool] | None = (image, trial)
        while self.next and self.flash.powered:
            (self.image, trial), self.next = self.next, None
            self.left_ms = TRIAL_MS if trial else None
            start = START + SPACING * self.image
            self.runs = bytes(self.flash.content[start : start + PROGRAM_BYTES])
            self.last = 0
            self.core = CompiledNode(address=self.address, image=IMAGE, flash=self)

    def read(self, offset: int) -> int:
        """A word of the port."""
        return START if offset else self.image << 8 | self.last

    def write(self, offset: int, value: int) -> None:
        """Write a word of the port. A core that is restarted reaches the flash no more."""
        if self.next or not self.flash.powered:
            return
        if not offset:
            self.last = self.flash.exchange(value & 0xFF, bool(value & 0x100))
        elif value & 4:
            self.next = value & 3, bool(value & 8)
        elif not value & 8:
            self.left_ms = None

    @property
    def answers(self) -> bool:
        """Whether its firmware runs at all."""
        return self.flash.powered and not (self.hangs and self.runs.startswith(self.hangs))

    def receive(self, words: Sequence[int]) -> bytes:
        """Put words on the bus; returns what the node sends."""
        if not self.answers:
            return b""
        sent = self.core.receive(words)
        return sent if self.answers else b""

    def millisecond(self) -> None:
        """A millisecond passes; a trial may end with it."""
        if self.left_ms is not None:
            self.left_ms -= 1
        if self.left_ms == 0:
            self.load(0, trial=False)
        if self.answers:
            self.core.run(1)
        if self.next:
            self.load(*self.next)


class FlashBus(Transport):
    """The bus of one such node. Time passes only on the bus."""

    time_is_stopped = True

    def __init__(self, node: FlashNode) -> None:
        self.node, self.frame, self.arrived = node, b"", list[int]()
        self.clock, self.ms = 0.0, 0

    def pass_time(self, seconds: float) -> None:
        """So much time passes for the node."""
        self.clock += seconds
        while self.ms + 1 <= self.clock * 1000:
            self.ms += 1
            self.node.millisecond()

    def send(self, words: Sequence[int]) -> None:
        """A word passes the port if it is for the node; the last one of a whole frame is marked."""
        marked = []
        for word in words:
            data, command = word & 0xFF, word >> 8
            self.frame = bytes([data]) if command else self.frame + bytes([data])
            if self.frame[0] & 0x4F != self.node.address:
                continue
            good = len(self.frame) > 6 and zlib.crc32(self.frame) == GOOD
            marked.append(
                data
                | DEFINES["BUS_RECEIVE_COMMAND_MASK"] * command
                | DEFINES["BUS_RECEIVE_GOOD_MASK"] * good
            )
        self.pass_time(len(words) * self.character_s)
        self.arrived += self.node.receive(marked)

    def receive(self, count: int, timeout_s: float) -> list[int]:
        """At most `count` words."""
        taken, self.arrived = self.arrived[:count], self.arrived[count:]
        self.pass_time(len(taken) * self.character_s if len(taken) == count else timeout_s)
        return taken

    def now(self) -> float:
        """Seconds of the node."""
        return self.clock

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        self.pass_time(seconds)

    def close(self) -> None:
        """Nothing is to be closed."""
