# SPDX-License-Identifier: Apache-2.0
"""The relay between a circular grating and its controller (S1): makes its correction set, brings it
into force, saves it, and reads the status.

    found = harmonic_fit.fit(harmonic_fit.read_readings("ring.csv"))
    with SerialBus("/dev/ttyUSB0") as port:
        relay = Relay(port)
        settings = Settings(counts_per_turn=32768)
        whole = make_set(terms_of(found, 32768), settings, relay.status().orders)
        relay.write(whole)                         # in force now
        relay.save(whole)                          # and at every power-up
        print(relay.status().words())

docs/relay.md defines the bytes. Exchange is the protocol without any input or output; only
transports wait.
"""

import math
import random
import struct
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self

from moire.bus.exchanges import step
from moire.bus.protocol import CRC_LENGTH, NINTH, READY, TO_NODE, Timing, command_byte, frame
from moire.bus.transport import Transport
from moire.errors import BusGarbled, MoireError, NoAnswer, OutOfRange

ADDRESS = 1
STATUS, CLEAR, BEGIN_SET, SET, FLASH = range(5)
LONGEST_BODY = 64
HEAD = 2  # bytes of sequence and kind
PIECE = LONGEST_BODY - HEAD

MARKER = 0x4D4F4900
MOST_ORDERS = 32
SEGMENTS = range(2, 65)  # of a table in place of the orders
SEGMENTS_MARK = 128  # in the marker of such a set, beside their number
LARGEST_POINT = (1 << 23) - 1  # of a table, as it is written
COUNTS = range(1609, (1 << 25) + 1)  # per turn
GAIN = math.prod(math.sqrt(1 + 4.0**-n) for n in range(22))  # of the rotations in the relay
LARGEST = (1 << 29) - 1  # sum of the amplitudes, as they are written
ARCSEC_PER_TURN = 1_296_000

FIRST, SECOND = 0x100000, 0x101000  # addresses of the two copies in flash
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
    """The relay answers, but it did not do what was requested."""


# ------------------------------------------------------------------ the set


@dataclass(frozen=True)
class Settings:
    """What a set holds beside the correction."""

    counts_per_turn: int
    minimum_edge_separation: int = 1  # shortest time between two output edges, in cycles
    hysteresis: float = 0.25  # counts
    filter_samples: int = 0
    index_low: bool = False
    index_gate_mask: int = 0  # signals that gate the index: b in bit 1, a in bit 0
    index_gate: int = 0  # the levels that these signals have during the index


class Harmonics(Protocol):
    """The harmonics of an error in arcsec, by order from 1, as harmonic_fit finds them."""

    @property
    def cosine(self) -> Iterable[float]:
        """The cosine terms."""

    @property
    def sine(self) -> Iterable[float]:
        """The sine terms."""


Terms = Sequence[tuple[float, float]]  # (amplitude in counts, phase in rad), by order from 1


def check_range(value: float, low: float, high: float, what: str) -> None:
    """Raises OutOfRange unless a value is inside its limits."""
    if not low <= value <= high:
        raise OutOfRange(f"{what} of {value:g} is outside {low:g} to {high:g}")


def terms_of(
    harmonics: Harmonics, counts_per_turn: int, index_at: float = 0.0
) -> list[tuple[float, float]]:
    """The terms of a set from the harmonics of an error.

    `index_at` is the angle of the table at the index, in degrees.
    """
    terms = []
    for order, (cosine, sine) in enumerate(
        zip(harmonics.cosine, harmonics.sine, strict=True), start=1
    ):
        phase = math.atan2(cosine, sine) + order * math.radians(index_at)
        terms.append((math.hypot(cosine, sine) * counts_per_turn / ARCSEC_PER_TURN, phase))
    return terms


def packed(marker: int, settings: Settings, words: Iterable[int]) -> bytes:
    """The bytes of a set with these words after the settings; raises OutOfRange."""
    counts = settings.counts_per_turn
    check_range(counts, COUNTS[0], COUNTS[-1], "a number of counts per turn")
    check_range(settings.minimum_edge_separation, 0, 0xFFFF, "a minimum_edge_separation")
    check_range(settings.hysteresis, 0, 0xFFFF / 65536, "a hysteresis")
    check_range(settings.filter_samples, 0, 255, "a number of filter samples")
    check_range(settings.index_gate_mask, 0, 3, "an index gate mask")
    check_range(settings.index_gate, 0, 3, "an index gate")
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
    written = [*head, *(word % 2**32 for word in words)]
    body = struct.pack(f"<{len(written)}I", *written)
    return body + zlib.crc32(body).to_bytes(CRC_LENGTH, "little")


def make_set(terms: Terms, settings: Settings, orders: int) -> bytes:
    """The bytes of a set for a relay of so many orders; raises OutOfRange.

    The relay sends the position less the sum of amplitude * sin(order * angle + phase).
    """
    check_range(orders, 1, MOST_ORDERS, "a number of orders")
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
            f"the amplitudes are {total * GAIN / 65536:.0f} counts together; at most "
            f"{LARGEST * GAIN / 65536:.0f} are taken"
        )
    return packed(
        MARKER + orders,
        settings,
        [word for term in written + [(0, 0)] * (orders - len(written)) for word in term],
    )


def make_segment_set(points: Sequence[float], settings: Settings) -> bytes:
    """The bytes of a set for a relay that was built with as many segments as there are points;
    raises OutOfRange.

    `points` are the errors of the encoder in counts (encoder minus reference) at the beginnings of
    the segments, which divide the turn from the index on; the relay sends the position less the
    error, on straight lines between two points.
    """
    check_range(len(points), SEGMENTS[0], SEGMENTS[-1], "a number of segments")
    if not all(math.isfinite(point) for point in points):
        raise OutOfRange("an error of the table is no number")
    words = [round(point * 65536) for point in points]
    for word in words:
        if abs(word) > LARGEST_POINT:
            raise OutOfRange(f"an error of {word / 65536:g} counts is not below 128")
    padding = [0] * (len(words) % 2)
    return packed(MARKER + SEGMENTS_MARK + len(points), settings, words + padding)


def identity_of(whole: bytes) -> int:
    """The identity that a relay reports for this set while it is in force."""
    return int.from_bytes(whole[-CRC_LENGTH:], "little")


# ------------------------------------------------------------------ bodies


class Status(NamedTuple):
    """The state of a relay."""

    flags: int
    levels: int
    source: int  # of the set at power-up
    orders: int  # how many the relay evaluates; 0: it has a table of segments instead
    identity: int  # of the set in force
    position: int  # counts
    correction: float  # counts

    @classmethod
    def of(cls, fields: bytes) -> Self:
        """From the fields of an answer."""
        flags, levels, source, identity, position, correction = struct.unpack("<BBBIii", fields)
        return cls(flags, levels, source & 3, source >> 2, identity, position, correction / 65536)

    @property
    def corrects_by(self) -> str:
        """What a set of this relay holds."""
        return f"{self.orders} orders" if self.orders else "a table of segments"

    def words(self) -> str:
        """The state in words, in several lines."""
        levels = [name for bit, name in enumerate(LEVELS) if self.levels >> bit & 1]
        lines = [
            f"{', '.join(levels) or 'passing the encoder uncorrected'}; {self.corrects_by}, "
            f"set {self.identity:08X}, at power-up from {SOURCES[self.source]}",
            f"position {self.position} counts, correction {self.correction:+.3f}",
        ]
        return "\n".join(
            lines + [f"flag: {name}" for bit, name in enumerate(FLAGS) if self.flags >> bit & 1]
        )


class Exchange:
    """One request and its answer, repeated with the same sequence number until it is whole.

    It is used like protocol.Exchange.
    """

    def __init__(
        self, body: bytes, address: int = ADDRESS, tries: int = 5, timing: Timing = Timing()
    ):
        if not HEAD <= len(body) <= LONGEST_BODY:
            raise OutOfRange(f"a request has {HEAD} to {LONGEST_BODY} bytes, not {len(body)}")
        self.body, self.address, self.tries, self.timing = bytes(body), address, tries, timing
        self.attempts, self.any_word, self.quiet, self.reason = 0, False, False, ""
        self.answer: bytes | None = None
        self.received: list[int] = []
        self.outgoing: list[int] = []
        self.first = READY | command_byte(address, TO_NODE)
        command = command_byte(address, TO_NODE)
        self.request = [command | NINTH, *frame(command, self.body)]
        self.begin()

    def begin(self) -> None:
        """Begins an attempt."""
        self.attempts += 1
        self.quiet, self.received, self.outgoing = False, [], self.request

    def words_to_send(self) -> list[int]:
        """The words to send now; each is given once."""
        words, self.outgoing = self.outgoing, []
        return words

    @property
    def finished(self) -> bool:
        """Whether the exchange has succeeded or failed."""
        return self.answer is not None or (self.quiet and self.attempts >= self.tries)

    @property
    def expected(self) -> int:
        """How many words to receive next at most."""
        if self.finished:
            return 0
        if self.quiet or len(self.received) < 2:
            return 1
        return self.received[1] + HEAD + CRC_LENGTH - len(self.received)

    @property
    def timeout_s(self) -> float:
        """How long to wait for them, in seconds."""
        if self.quiet:
            return self.timing.quiet
        return self.timing.answer + self.expected * self.timing.character

    def feed(self, words: Iterable[int]) -> None:
        """Takes the words that arrived."""
        for word in words:
            self.any_word = True
            if self.quiet or self.finished:
                continue
            self.received.append(word & 0xFF)
            if len(self.received) == 1 and word & 0xFF != self.first:
                self.fail(f"{word & 0xFF:02X} came instead of {self.first:02X}")
            elif len(self.received) == 2 and not HEAD <= self.received[1] <= LONGEST_BODY:
                self.fail(f"a length of {self.received[1]} was announced")
            elif len(self.received) > 2 and self.expected == 0:
                self.check_answer()

    def silence(self) -> None:
        """Fewer words than expected arrived in time."""
        if self.finished:
            return
        if not self.quiet:
            self.fail("the answer broke off" if self.received else "no answer")
        if not self.finished:
            self.begin()

    def check_answer(self) -> None:
        """The answer is complete: accepts it, or lets the attempt fail."""
        first, body = self.received[0], bytes(self.received[2:-CRC_LENGTH])
        if list(frame(first, body)) != self.received[1:]:
            self.fail("the answer has a wrong CRC-32")
        elif body[:HEAD] != self.body[:HEAD]:
            self.fail("the answer is to another request")
        else:
            self.answer = body[HEAD:]

    def fail(self, reason: str) -> None:
        """The attempt failed: the bus must be silent before the next one."""
        self.reason, self.quiet = reason, True

    def result(self) -> bytes:
        """The answer without sequence and kind; raises BusGarbled or NoAnswer."""
        if self.answer is not None:
            return self.answer
        if self.any_word:
            raise BusGarbled(self.address, self.reason, self.attempts)
        raise NoAnswer(self.address, self.attempts)


# ------------------------------------------------------------------ the relay


class Relay:
    """A relay at the end of a transport."""

    PATIENCE_S = 5.0  # with its boot and with the flash chip
    POLL_S = 0.005

    def __init__(
        self,
        transport: Transport,
        tries: int = 5,
        random_source: random.Random | None = None,
    ):
        self.transport, self.tries = transport, tries
        self.timing = Timing(
            character=transport.character_s, quiet=max(Timing().quiet, 3 * transport.character_s)
        )
        self.sequence = (random_source or random.Random()).randrange(256)
        self.ask(STATUS)  # so that no later request looks like a repeated one

    def ask(self, kind: int, payload: bytes = b"") -> bytes:
        """Carries out one exchange; returns the answer."""
        self.sequence = (self.sequence + 1) % 256
        exchange = Exchange(
            bytes([self.sequence, kind]) + payload, tries=self.tries, timing=self.timing
        )
        while not exchange.finished:
            step(self.transport, exchange)
        return exchange.result()

    def status(self) -> Status:
        """The state of the relay."""
        return Status.of(self.ask(STATUS))

    def clear(self, flags: int = 0xFF) -> Status:
        """Clears flags; those whose cause is still there are set again."""
        return Status.of(self.ask(CLEAR, bytes([flags])))

    def wait_until(self, done: Callable[[], bool], what: str) -> None:
        """Waits until `done` is true; raises RelayRefused with `what` after PATIENCE_S."""
        end = self.transport.now() + self.PATIENCE_S
        while not done():
            if self.transport.now() > end:
                raise RelayRefused(what)
            self.transport.wait(self.POLL_S)

    def write(self, whole: bytes) -> Status:
        """Brings a set into force; raises RelayRefused if the relay does not take it."""
        self.wait_until(
            lambda: self.status().levels & READING_FLASH == 0,
            "the relay does not finish with its flash",
        )
        for begin in range(0, len(whole), PIECE):
            piece = whole[begin : begin + PIECE]
            status = Status.of(self.ask(SET if begin else BEGIN_SET, piece))
        if status.identity != identity_of(whole):
            raise RelayRefused(
                f"the relay refused the set {identity_of(whole):08X}; {status.identity:08X} stays "
                f"in force: is it one for {status.corrects_by}?"
            )
        return status

    # flash

    def flash(self, command: int, address: int | None = None, more: bytes = b"") -> bytes:
        """Sends a command to the flash chip; returns what came back for `more`."""
        row = bytes([command]) + (b"" if address is None else address.to_bytes(3, "big"))
        return self.ask(FLASH, row + more)[len(row) :]

    def change_flash(self, command: int, address: int, more: bytes = b"") -> None:
        """Erases or programs, and waits until the chip has finished; raises RelayRefused."""
        self.flash(WRITE_ENABLE)
        self.flash(command, address, more)
        self.wait_until(
            lambda: self.flash(READ_FLASH_STATUS, more=b"\0")[0] & FLASH_BUSY == 0,
            "the flash does not finish",
        )

    def read_copy(self, address: int, length: int) -> bytes:
        """Reads bytes of the flash."""
        block = PIECE - 4
        return b"".join(
            self.flash(READ, address + n, bytes(min(block, length - n)))
            for n in range(0, length, block)
        )

    def write_copy(self, whole: bytes, address: int) -> None:
        """Erases, programs and reads back one copy; raises RelayRefused if it differs."""
        block = 32  # divides a page
        self.change_flash(ERASE, address)
        for n in range(0, len(whole), block):
            self.change_flash(PROGRAM, address + n, whole[n : n + block])
        if self.read_copy(address, len(whole)) != whole:
            raise RelayRefused(
                f"the flash at {address:06X} does not hold what was written: is it protected?"
            )

    def save(self, whole: bytes, first: int = FIRST, second: int = SECOND) -> None:
        """Saves a set for every power-up.

        The second copy is written first: whenever the power fails, one of the two is complete.
        """
        for address in (second, first):
            if self.read_copy(address, len(whole)) != whole:
                self.write_copy(whole, address)
