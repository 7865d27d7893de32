# SPDX-License-Identifier: Apache-2.0
"""The bus protocol without any input or output: bodies, frames, 9-bit words, and the exchange as a
state machine.

A word is an integer from 0 to 511; bit 8 is the 9th bit. docs/protocol.md defines the bytes.
"""

import enum
import struct
import zlib
from collections.abc import Iterable
from typing import NamedTuple

from moire.errors import BusGarbled, NoAnswer, OutOfRange
from moire.made.bus_tables import LONGEST_BODY, OPERATIONS

NINTH = 0x100  # marks a command byte
TO_NODE, FROM_NODE = 2, 1  # the directions, bits 5 and 4 of a command byte
IN_MOTION = ("homing", "moving", "settling", "stopping")  # states of an axis that moves
READY = 0x40  # bits 7 and 6 of a ready byte are 01
ADDRESSES = range(1, 16)
ODD_ADDRESSES = (1, 2, 4, 7, 8, 11, 13, 14)  # those that odd parity can reach
CRC_LENGTH = 4
MOST_AXES = 8  # of a node: the bits of a mask of axes

FORMATS = {
    "u8": "B",
    "u16": "H",
    "u32": "I",
    "u64": "Q",
    "i8": "b",
    "i16": "h",
    "i32": "i",
    "i64": "q",
}


# ------------------------------------------------------------------ bodies


def layout(fields: Iterable[tuple[str, str]]) -> struct.Struct:
    """The bytes of fields that are given as (name, type)."""
    return struct.Struct("<" + "".join(FORMATS[kind] for _, kind in fields))


REQUESTS = {name: layout(operation.request) for name, operation in OPERATIONS.items()}
REPLIES = {name: layout(operation.reply) for name, operation in OPERATIONS.items()}
NAMES = {operation.code: name for name, operation in OPERATIONS.items()}


def request_body(operation: str, sequence: int, /, **values: int) -> bytes:
    """The body of a request; raises OutOfRange when a value does not fit its field."""
    known = OPERATIONS[operation]
    try:
        fields = REQUESTS[operation].pack(*(values.pop(name) for name, _ in known.request))
    except struct.error:
        declared = ", ".join(" ".join(field) for field in known.request)
        raise OutOfRange(f"a value of '{operation}' does not fit on the bus: {declared}") from None
    if values:
        raise TypeError(f"'{operation}' has no {', '.join(values)}")
    return bytes([sequence & 0xFF, known.code]) + fields


class Reply(NamedTuple):
    """The content of a reply."""

    sequence: int
    operation: int  # code
    cause: int  # code
    fields: dict[str, int]  # empty unless the cause is ok


def parse_reply(body: bytes) -> Reply | None:
    """The content of a body; None when its length does not fit its operation and cause."""
    if len(body) < 3:
        return None
    sequence, code, cause = body[:3]
    fields = {}
    if cause == 0 and code in NAMES:
        name = NAMES[code]
        if len(body) != 3 + REPLIES[name].size:
            return None
        fields = dict(
            zip((field for field, _ in OPERATIONS[name].reply), REPLIES[name].unpack(body[3:]))
        )
    elif len(body) != 3:
        return None
    return Reply(sequence, code, cause, fields)


# ------------------------------------------------------------------ frames


def command_byte(address: int, direction: int) -> int:
    """The byte with the 9th bit set that begins a transfer; raises OutOfRange."""
    if address not in ADDRESSES:
        raise OutOfRange(
            f"there is no address {address}: allowed are {ADDRESSES[0]} to {ADDRESSES[-1]}"
        )
    return direction << 4 | address


def frame(first: int, body: bytes) -> bytes:
    """Length, body and CRC-32; the CRC also covers `first`, the byte that precedes them."""
    if not 1 <= len(body) <= LONGEST_BODY:
        raise OutOfRange(f"a body has 1 to {LONGEST_BODY} bytes, not {len(body)}")
    inside = bytes([len(body)]) + body
    return inside + zlib.crc32(bytes([first]) + inside).to_bytes(CRC_LENGTH, "little")


def write_words(address: int) -> list[int]:
    """The words that begin a request."""
    return [command_byte(address, TO_NODE) | NINTH]


def read_words(address: int) -> list[int]:
    """The words that ask for the reply."""
    return [command_byte(address, FROM_NODE) | NINTH]


def sync_words(number: int) -> list[int]:
    """A frame for all nodes, which no node answers; its end is the same moment for all of them."""
    return [TO_NODE << 4 | NINTH, *frame(TO_NODE << 4, bytes([number % 256]))]


def ready_byte(address: int, direction: int) -> int:
    """The byte with which a node acknowledges a command byte."""
    return READY | command_byte(address, direction)


# ------------------------------------------------------------------ exchange


class State(enum.Enum):
    """What an exchange waits for."""

    AWAIT_READY = enum.auto()  # write command sent
    AWAIT_READING = enum.auto()  # payload and read command sent
    AWAIT_LENGTH = enum.auto()
    AWAIT_BODY = enum.auto()  # body and CRC
    QUIET = enum.auto()  # something went wrong: the bus must be silent before the next try
    DONE = enum.auto()
    FAILED = enum.auto()


class Timing(NamedTuple):
    """Times in seconds: of one character, of the longest wait for a reply, and of the silence that
    ends a garbled reply.
    """

    character: float = 11 / 115200
    answer: float = 0.1
    quiet: float = 0.02


class Exchange:
    """One request and its reply, repeated with the same sequence number until it is whole.

    Until it is `finished`, the owner sends `words_to_send()`, receives at most `expected` words
    for at most `timeout_s`, passes them to `feed()`, and calls `silence()` when fewer came (see
    exchanges.step). Then `result()` returns the reply or raises. `events` lists what went wrong:
    "no answer", "garbled", "old reply". Without `handshake` the request does not wait for the
    ready byte of the node.
    """

    LONGEST_NOISE = 1000  # words thrown away in one QUIET

    def __init__(
        self,
        address: int,
        body: bytes,
        tries: int = 5,
        timing: Timing = Timing(),
        handshake: bool = True,
    ):
        self.address, self.body, self.tries = address, body, tries
        self.timing, self.handshake = timing, handshake
        self.payload = list(frame(command_byte(address, TO_NODE), body))
        self.events: list[str] = []
        self.attempts = 0
        self.any_word = False  # whether any word at all came back
        self.reason = ""  # why the last attempt failed
        self.reply: Reply | None = None
        self.outgoing: list[int] = []
        self.received: list[int] = []
        self.noise = 0  # words thrown away in this QUIET
        self.begin()

    # for the owner

    def words_to_send(self) -> list[int]:
        """The words to send now; each is given once."""
        words, self.outgoing = self.outgoing, []
        return words

    @property
    def finished(self) -> bool:
        """Whether the exchange has succeeded or failed."""
        return self.state in (State.DONE, State.FAILED)

    @property
    def expected(self) -> int:
        """How many words to receive next at most."""
        if self.finished:
            return 0
        if self.state == State.AWAIT_BODY:
            return self.received[1] + CRC_LENGTH - (len(self.received) - 2)
        return 1

    @property
    def timeout_s(self) -> float:
        """How long to wait for them, in seconds."""
        if self.state == State.QUIET:
            return self.timing.quiet
        return self.timing.answer + self.expected * self.timing.character

    def result(self) -> Reply:
        """The reply; raises BusGarbled or NoAnswer when the exchange failed."""
        if self.reply is not None:
            return self.reply
        if self.any_word:
            raise BusGarbled(self.address, self.reason, self.attempts)
        raise NoAnswer(self.address, self.attempts)

    def feed(self, words: Iterable[int]) -> None:
        """Takes the words that arrived."""
        for word in words:
            self.any_word = True
            self.receive_word(word)

    def silence(self) -> None:
        """Fewer words than expected arrived in time."""
        if self.state == State.QUIET:
            self.begin()
        elif not self.finished:
            self.fail("no answer", "no answer" if not self.received else "the answer broke off")

    # the state machine

    def begin(self) -> None:
        """Begins an attempt."""
        self.attempts += 1
        self.state, self.received = State.AWAIT_READY, []
        self.outgoing = write_words(self.address)
        if not self.handshake:
            self.send_request()

    def send_request(self) -> None:
        """The node is ready: sends the request, and asks for the reply."""
        self.outgoing += self.payload + read_words(self.address)
        self.state = State.AWAIT_READING

    def receive_word(self, word: int) -> None:
        """Takes one word, by state."""
        if self.state == State.QUIET:
            self.noise += 1
            if self.noise >= self.LONGEST_NOISE:
                self.begin()
        elif self.finished:
            return
        elif word & NINTH:
            self.fail("garbled", "a byte with the 9th bit set came back")
        elif self.state == State.AWAIT_READY:
            if self.is_ready(word, TO_NODE):
                self.send_request()
        elif self.state == State.AWAIT_READING:
            if self.is_ready(word, FROM_NODE):
                self.received, self.state = [word], State.AWAIT_LENGTH
        elif self.state == State.AWAIT_LENGTH:
            if not 1 <= word <= LONGEST_BODY:
                self.fail("garbled", f"a length of {word} was announced")
            else:
                self.received.append(word)
                self.state = State.AWAIT_BODY
        else:
            self.received.append(word)
            if self.expected == 0:
                self.check_reply()

    def is_ready(self, word: int, direction: int) -> bool:
        """Whether this is the ready byte; the attempt fails for any other."""
        ready = ready_byte(self.address, direction)
        if word != ready:
            self.fail("garbled", f"{word:02X} came instead of {ready:02X}")
        return word == ready

    def check_reply(self) -> None:
        """The reply is complete: accepts it, or lets the attempt fail."""
        first, body = self.received[0], bytes(self.received[2:-CRC_LENGTH])
        reply = parse_reply(body)
        if list(frame(first, body)) != self.received[1:]:
            self.fail("garbled", "the reply has a wrong CRC-32")
        elif reply is None:
            self.fail("garbled", "the reply has a wrong length")
        elif (reply.sequence, reply.operation) != (
            self.body[0],
            self.body[1] if len(self.body) > 1 else 0,
        ):
            # the node did not receive this request: the bus is in order, so repeat at once
            self.fail(
                "old reply",
                "the node answers, but it never received the whole request",
                State.AWAIT_READY,
            )
        else:
            self.reply, self.state = reply, State.DONE

    def fail(self, event: str, reason: str, afterwards: State = State.QUIET) -> None:
        """The attempt failed: begins the next one after a silence, or at once, or gives up."""
        self.events.append(event)
        self.reason, self.outgoing = reason, []
        if self.attempts >= self.tries:
            self.state = State.FAILED
        elif afterwards == State.QUIET:
            self.state, self.noise = State.QUIET, 0
        else:
            self.begin()
