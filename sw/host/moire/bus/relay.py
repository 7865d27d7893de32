# SPDX-License-Identifier: Apache-2.0
"""The relay between a circular grating and its controller (S1): make its set, bring it into force,
save it, read what it tells.

    found = calibration.fit(calibration.read_readings("ring.csv"))
    with SerialBus("/dev/ttyUSB0") as port:
        relay = Relay(port)
        whole = make_set(terms_of(found, 32768), Settings(counts_per_turn=32768),
        relay.status().orders)
        relay.write(whole)                         # in force now
        relay.save(whole)                          # and at every power-up
        print(relay.status().words())

docs/relay.md says what the bytes mean. Exchange is the protocol without any input or output; only
transports wait.
"""

import math
import random
import struct
import zlib
from dataclasses import dataclass
from typing import NamedTuple

from moire.bus.protocol import CRC_LENGTH, NINTH, READY, TO_NODE, Timing, command_byte, frame
from moire.errors import BusGarbled, MoireError, NoAnswer, OutOfRange

ADDRESS = 1
STATUS, CLEAR, BEGIN_SET, SET, FLASH = range(5)
LONGEST_BODY = 64
HEAD = 2  # sequence and kind
PIECE = LONGEST_BODY - HEAD

MARKER = 0x4D4F4900
MOST_ORDERS = 32
COUNTS = range(1609, (1 << 25) + 1)  # per turn
GAIN = math.prod(math.sqrt(1 + 4.0**-n) for n in range(22))  # of the rotations in the relay
LARGEST = (1 << 29) - 1  # of the amplitudes, summed as they are written
ARCSEC_PER_TURN = 1_296_000

FIRST, SECOND = 0x100000, 0x101000  # where the copies lie in flash
SECTOR, PAGE = 4096, 256
READ, PROGRAM, READ_FLASH_STATUS, WRITE_ENABLE, ERASE = 0x03, 0x02, 0x05, 0x06, 0x20
FLASH_BUSY = 1

FLAGS = (
    "an illegal edge: counts are lost",
    "between two indexes there was not one turn",
    "a whole turn without its index",
    "the filter rejected a pulse",
    "the output was more than 4 counts behind",
    "a set was refused",
)
LEVELS = ("index seen", "a set is in force", "correcting", "reading flash")
SOURCES = ("no copy in flash was whole", "the first copy in flash", "the second copy in flash")
READING_FLASH = 8


class RelayRefused(MoireError):
    """The relay hears, but what was asked for did not come about."""


# ------------------------------------------------------------------ the set


@dataclass(frozen=True)
class Settings:
    counts_per_turn: int
    minimum_edge_separation: int = 1  # shortest distance of two edges that go out, clk
    hysteresis: float = 0.25  # counts
    filter_samples: int = 0
    index_low: bool = False
    index_gate_mask: int = 0  # b in bit 1, a in bit 0: those that gate the index
    index_gate: int = 0  # and their levels in it


def ranged(value, low, high, what):
    if not low <= value <= high:
        raise OutOfRange(f"{what} of {value:g} is outside {low:g} to {high:g}")
    return value


def terms_of(harmonics, counts_per_turn: int, index_at: float = 0.0) -> list:
    """[(amplitude in counts, phase in rad)] by order from 1. index_at: degrees of the table where
    the index stands.
    """
    terms = []
    for order, (cosine, sine) in enumerate(
        zip(harmonics.cosine, harmonics.sine, strict=True), start=1
    ):
        phase = math.atan2(cosine, sine) + order * math.radians(index_at)
        terms.append((math.hypot(cosine, sine) * counts_per_turn / ARCSEC_PER_TURN, phase))
    return terms


def packed(marker: int, settings: Settings, words) -> bytes:
    """The bytes of a set with these words after the settings."""
    counts = ranged(settings.counts_per_turn, COUNTS[0], COUNTS[-1], "a number of counts per turn")
    ranged(settings.minimum_edge_separation, 0, 0xFFFF, "a minimum_edge_separation")
    ranged(settings.hysteresis, 0, 0xFFFF / 65536, "a hysteresis")
    ranged(settings.filter_samples, 0, 255, "a number of filter samples")
    ranged(settings.index_gate_mask, 0, 3, "an index gate mask")
    ranged(settings.index_gate, 0, 3, "an index gate")
    angle = round(2**48 / counts)
    gate = settings.index_low << 4 | settings.index_gate_mask << 2 | settings.index_gate
    head = [
        marker,
        counts,
        angle % 2**32,
        angle >> 32 | settings.minimum_edge_separation << 16,
        round(math.tau * 2**40 / counts),
        round(settings.hysteresis * 65536) | settings.filter_samples << 16 | gate << 24,
    ]
    words = [*head, *(word % 2**32 for word in words)]
    body = struct.pack(f"<{len(words)}I", *words)
    return body + zlib.crc32(body).to_bytes(CRC_LENGTH, "little")


def make_set(terms, settings: Settings, orders: int) -> bytes:
    """The bytes of a set for a relay of so many orders: corrected = position - sum of amplitude
    sin(order angle + phase).
    """
    ranged(orders, 1, MOST_ORDERS, "a number of orders")
    if len(terms) > orders:
        raise OutOfRange(f"the relay has {orders} orders, the correction {len(terms)}")
    if not all(math.isfinite(value) for term in terms for value in term):
        raise OutOfRange("a term of the correction is no number")
    written = [
        (round(amplitude * 65536 / GAIN), round(phase / math.tau * 2**32) % 2**32)
        for amplitude, phase in terms
    ]
    if (total := sum(abs(amplitude) for amplitude, _ in written)) > LARGEST:
        raise OutOfRange(
            f"the amplitudes are {total * GAIN / 65536:.0f} counts together; at most {LARGEST * GAIN / 65536:.0f} are taken"
        )
    return packed(
        MARKER + orders,
        settings,
        [word for term in written + [(0, 0)] * (orders - len(written)) for word in term],
    )


def identity_of(whole: bytes) -> int:
    """What a relay tells as the identity of this set while it is in force."""
    return int.from_bytes(whole[-CRC_LENGTH:], "little")


# ------------------------------------------------------------------ bodies


class Status(NamedTuple):
    flags: int
    levels: int
    source: int  # of the set at power-up
    orders: int  # that the relay evaluates
    identity: int  # of the set in force
    position: int  # counts
    correction: float  # counts

    @classmethod
    def of(cls, fields: bytes):
        flags, levels, source, identity, position, correction = struct.unpack("<BBBIii", fields)
        return cls(flags, levels, source & 3, source >> 2, identity, position, correction / 65536)

    def words(self) -> str:
        named = [name for bit, name in enumerate(LEVELS) if self.levels >> bit & 1]
        lines = [
            f"{', '.join(named) or 'passing the encoder uncorrected'}; {self.orders} orders, set {self.identity:08X}, "
            f"at power-up from {SOURCES[self.source]}",
            f"position {self.position} counts, correction {self.correction:+.3f}",
        ]
        return "\n".join(
            lines + [f"flag: {name}" for bit, name in enumerate(FLAGS) if self.flags >> bit & 1]
        )


class Exchange:
    """One request and its answer, repeated with the same sequence number until it is whole; used as
    protocol.Exchange is.
    """

    def __init__(
        self, body: bytes, address: int = ADDRESS, tries: int = 5, timing: Timing = Timing()
    ):
        if not HEAD <= len(body) <= LONGEST_BODY:
            raise OutOfRange(f"a request has {HEAD} to {LONGEST_BODY} bytes, not {len(body)}")
        self.body, self.address, self.tries, self.timing = bytes(body), address, tries, timing
        self.first = READY | command_byte(address, TO_NODE)
        command = command_byte(address, TO_NODE)
        self.request = [command | NINTH, *frame(command, self.body)]
        self.attempts, self.heard, self.answer, self.quiet, self.reason = 0, False, None, False, ""
        self.begin()

    def begin(self):
        self.attempts, self.quiet, self.received, self.outgoing = (
            self.attempts + 1,
            False,
            [],
            self.request,
        )

    def words_to_send(self) -> list:
        words, self.outgoing = self.outgoing, []
        return words

    @property
    def finished(self) -> bool:
        return self.answer is not None or (self.quiet and self.attempts >= self.tries)

    @property
    def wanted(self) -> int:
        if self.finished:
            return 0
        if self.quiet or len(self.received) < 2:
            return 1
        return self.received[1] + HEAD + CRC_LENGTH - len(self.received)

    @property
    def timeout_s(self) -> float:
        return (
            self.timing.quiet
            if self.quiet
            else self.timing.answer + self.wanted * self.timing.character
        )

    def feed(self, words):
        for word in words:
            self.heard = True
            if self.quiet or self.finished:
                continue
            self.received.append(word & 0xFF)
            if len(self.received) == 1 and word & 0xFF != self.first:
                self.fail(f"{word & 0xFF:02X} came instead of {self.first:02X}")
            elif len(self.received) == 2 and not HEAD <= self.received[1] <= LONGEST_BODY:
                self.fail(f"a length of {self.received[1]} was announced")
            elif len(self.received) > 2 and self.wanted == 0:
                self.judge()

    def silence(self):
        """Nothing more came in time."""
        if self.finished:
            return
        if not self.quiet:
            self.fail("the answer broke off" if self.received else "no answer")
        if not self.finished:
            self.begin()

    def judge(self):
        first, body = self.received[0], bytes(self.received[2:-CRC_LENGTH])
        if list(frame(first, body)) != self.received[1:]:
            self.fail("the answer has a wrong CRC-32")
        elif body[:HEAD] != self.body[:HEAD]:
            self.fail("the answer is to another request")
        else:
            self.answer = body[HEAD:]

    def fail(self, reason):
        self.reason, self.quiet = reason, True

    def result(self) -> bytes:
        """The answer without sequence and kind."""
        if self.answer is not None:
            return self.answer
        if self.heard:
            raise BusGarbled(self.address, self.reason, self.attempts)
        raise NoAnswer(self.address, self.attempts)


# ------------------------------------------------------------------ the relay


class Relay:
    """A relay at the end of a transport."""

    PATIENCE_S = 5.0  # with its boot and with the flash chip
    POLL_S = 0.005

    def __init__(self, transport, tries: int = 5, random_source=random):
        self.transport, self.tries = transport, tries
        self.timing = Timing(
            character=transport.character_s, quiet=max(Timing().quiet, 3 * transport.character_s)
        )
        self.sequence = random_source.randrange(256)
        self.ask(STATUS)  # so that no later request looks like a repeated one

    def ask(self, kind: int, payload: bytes = b"") -> bytes:
        self.sequence = (self.sequence + 1) % 256
        exchange = Exchange(
            bytes([self.sequence, kind]) + payload, tries=self.tries, timing=self.timing
        )
        while not exchange.finished:
            if sending := exchange.words_to_send():
                self.transport.send(sending)
            wanted = exchange.wanted
            received = self.transport.receive(wanted, exchange.timeout_s)
            exchange.feed(received)
            if len(received) < wanted:
                exchange.silence()
        return exchange.result()

    def status(self) -> Status:
        return Status.of(self.ask(STATUS))

    def clear(self, flags: int = 0xFF) -> Status:
        """Let flags fall; those whose cause stands rise again."""
        return Status.of(self.ask(CLEAR, bytes([flags])))

    def until(self, done, what: str):
        end = self.transport.now() + self.PATIENCE_S
        while not done():
            if self.transport.now() > end:
                raise RelayRefused(what)
            self.transport.wait(self.POLL_S)

    def write(self, whole: bytes) -> Status:
        """Bring a set into force, and see that it is."""
        self.until(
            lambda: not self.status().levels & READING_FLASH,
            "the relay does not come to an end with its flash",
        )
        for begin in range(0, len(whole), PIECE):
            told = Status.of(self.ask(SET if begin else BEGIN_SET, whole[begin : begin + PIECE]))
        if told.identity != identity_of(whole):
            raise RelayRefused(
                f"the relay refused the set {identity_of(whole):08X}; {told.identity:08X} stays in force: "
                f"is it one for {told.orders} orders?"
            )
        return told

    # flash

    def flash(self, command: int, address: int | None = None, more: bytes = b"") -> bytes:
        """One row of bytes to the chip; what came back for `more`."""
        row = bytes([command]) + (b"" if address is None else address.to_bytes(3, "big"))
        return self.ask(FLASH, row + more)[len(row) :]

    def change_flash(self, command: int, address: int, more: bytes = b""):
        self.flash(WRITE_ENABLE)
        self.flash(command, address, more)
        self.until(
            lambda: not self.flash(READ_FLASH_STATUS, more=b"\0")[0] & FLASH_BUSY,
            "the flash does not come to an end",
        )

    def read_copy(self, address: int, length: int) -> bytes:
        step = PIECE - 4
        return b"".join(
            self.flash(READ, address + n, bytes(min(step, length - n)))
            for n in range(0, length, step)
        )

    def write_copy(self, whole: bytes, address: int):
        """Erase, program and read back one copy."""
        step = 32  # divides a page
        self.change_flash(ERASE, address)
        for n in range(0, len(whole), step):
            self.change_flash(PROGRAM, address + n, whole[n : n + step])
        if self.read_copy(address, len(whole)) != whole:
            raise RelayRefused(
                f"the flash at {address:06X} does not hold what was written: is it protected?"
            )

    def save(self, whole: bytes, first: int = FIRST, second: int = SECOND):
        """Keep a set for every power-up. The second copy first: whenever power fails, one of the
        two is whole.
        """
        for address in (second, first):
            if self.read_copy(address, len(whole)) != whole:
                self.write_copy(whole, address)
