# SPDX-License-Identifier: Apache-2.0
"""The line protocol without any input or output: bodies, frames, 9-bit words, and the exchange as a
state machine.

Words are integers 0…511; bit 8 is the 9th bit. docs/protocol.md says what they mean.
"""

import enum
import struct
import zlib
from typing import NamedTuple

from moire.errors import BusGarbled, NoAnswer, OutOfRange
from moire.made.bus_tables import LONGEST_BODY, OPERATIONS

NINTH = 0x100  # marks a command byte
TO_NODE, FROM_NODE = 2, 1  # D5 D4
READY = 0x40  # D7 D6 = 01
ADDRESSES = range(1, 16)
ODD_ADDRESSES = (1, 2, 4, 7, 8, 11, 13, 14)  # those that odd parity can reach
CRC_LENGTH = 4

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


def layout(fields) -> struct.Struct:
    return struct.Struct("<" + "".join(FORMATS[kind] for _, kind in fields))


REQUESTS = {name: layout(operation.request) for name, operation in OPERATIONS.items()}
REPLIES = {name: layout(operation.reply) for name, operation in OPERATIONS.items()}
NAMES = {operation.code: name for name, operation in OPERATIONS.items()}


def request_body(operation: str, sequence: int, /, **values) -> bytes:
    """Raises OutOfRange when a value does not fit its field."""
    known = OPERATIONS[operation]
    try:
        fields = REQUESTS[operation].pack(*(values.pop(name) for name, _ in known.request))
    except struct.error:
        declared = ", ".join(" ".join(field) for field in known.request)
        raise OutOfRange(f"a value of '{operation}' does not fit on the line: {declared}") from None
    if values:
        raise TypeError(f"'{operation}' has no {', '.join(values)}")
    return bytes([sequence & 0xFF, known.code]) + fields


class Reply(NamedTuple):
    sequence: int
    operation: int  # code
    cause: int  # code
    fields: dict  # empty unless the cause is ok


def parse_reply(body: bytes) -> Reply | None:
    """None when the body has not the length that its operation and cause demand."""
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


def command_byte(address: int, way: int) -> int:
    if address not in ADDRESSES:
        raise OutOfRange(
            f"there is no address {address}: allowed are {ADDRESSES[0]} to {ADDRESSES[-1]}"
        )
    return way << 4 | address


def frame(first: int, body: bytes) -> bytes:
    """length · body · CRC-32; the CRC is over `first`, the byte that went before, too."""
    if not 1 <= len(body) <= LONGEST_BODY:
        raise OutOfRange(f"a body has 1 to {LONGEST_BODY} bytes, not {len(body)}")
    inside = bytes([len(body)]) + body
    return inside + zlib.crc32(bytes([first]) + inside).to_bytes(CRC_LENGTH, "little")


def write_words(address: int) -> list:
    return [command_byte(address, TO_NODE) | NINTH]


def read_words(address: int) -> list:
    return [command_byte(address, FROM_NODE) | NINTH]


def sync_words(number: int) -> list:
    """A frame for all nodes, which nobody answers: its end is the same moment for all of them."""
    return [TO_NODE << 4 | NINTH, *frame(TO_NODE << 4, bytes([number % 256]))]


def ready_byte(address: int, way: int) -> int:
    return READY | command_byte(address, way)


# ------------------------------------------------------------------ exchange


class State(enum.Enum):
    AWAIT_READY = enum.auto()  # write command sent
    AWAIT_READING = enum.auto()  # payload and read command sent
    AWAIT_LENGTH = enum.auto()
    AWAIT_REST = enum.auto()  # body and CRC
    QUIET = enum.auto()  # something went wrong: let the line fall silent before the next try
    DONE = enum.auto()
    FAILED = enum.auto()


class Timing(NamedTuple):
    """In seconds. `answer` is the patience with the node, `quiet` the silence that ends a garbled
    answer.
    """

    character: float = 11 / 115200
    answer: float = 0.1
    quiet: float = 0.02


class Exchange:
    """One request and its reply, repeated with the same sequence number until it is whole.

    The owner sends what `words_to_send()` gives, then receives at most `wanted` words for at most
    `timeout_s`, tells
    them with `feed(words)`, and tells with `silence()` when fewer came; until `finished`. Then
    `result()` has the reply
    or raises. `events` tells what went wrong on the way: "no answer", "garbled", "old reply".
    Without `handshake` the request
    does not wait for the node's ready byte.
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
        self.address, self.body, self.tries, self.timing, self.handshake = (
            address,
            body,
            tries,
            timing,
            handshake,
        )
        self.payload = list(frame(command_byte(address, TO_NODE), body))
        self.events = []
        self.attempts = 0
        self.heard = False  # any word at all came back
        self.reason = ""
        self.reply = None
        self.outgoing, self.received, self.noise = [], [], 0
        self.begin()

    # what the owner has to do

    def words_to_send(self) -> list:
        words, self.outgoing = self.outgoing, []
        return words

    @property
    def finished(self) -> bool:
        return self.state in (State.DONE, State.FAILED)

    @property
    def wanted(self) -> int:
        if self.finished:
            return 0
        if self.state == State.AWAIT_REST:
            return self.received[1] + CRC_LENGTH - (len(self.received) - 2)
        return 1

    @property
    def timeout_s(self) -> float:
        if self.state == State.QUIET:
            return self.timing.quiet
        return self.timing.answer + self.wanted * self.timing.character

    def result(self) -> Reply:
        if self.state == State.DONE:
            return self.reply
        if self.heard:
            raise BusGarbled(self.address, self.reason, self.attempts)
        raise NoAnswer(self.address, self.attempts)

    # what happened

    def feed(self, words):
        for word in words:
            self.heard = True
            self.take(word)

    def silence(self):
        """Nothing more came in time."""
        if self.state == State.QUIET:
            self.begin()
        elif not self.finished:
            self.fail("no answer", "no answer" if not self.received else "the answer broke off")

    # the machine

    def begin(self):
        self.attempts += 1
        self.state, self.received, self.noise = State.AWAIT_READY, [], 0
        self.outgoing = write_words(self.address)
        if not self.handshake:
            self.send_request()

    def send_request(self):
        self.outgoing += self.payload + read_words(self.address)
        self.state = State.AWAIT_READING

    def take(self, word: int):
        if self.state == State.QUIET:
            self.noise += 1
            if self.noise >= self.LONGEST_NOISE:
                self.begin()
        elif self.finished:
            return
        elif word & NINTH:
            self.fail("garbled", "a byte with the 9th bit set came back")
        elif self.state == State.AWAIT_READY:
            if self.expect(word, TO_NODE):
                self.send_request()
        elif self.state == State.AWAIT_READING:
            if self.expect(word, FROM_NODE):
                self.received, self.state = [word], State.AWAIT_LENGTH
        elif self.state == State.AWAIT_LENGTH:
            if not 1 <= word <= LONGEST_BODY:
                self.fail("garbled", f"a length of {word} was announced")
            else:
                self.received.append(word)
                self.state = State.AWAIT_REST
        else:
            self.received.append(word)
            if self.wanted == 0:
                self.judge()

    def expect(self, word: int, way: int) -> bool:
        ready = ready_byte(self.address, way)
        if word != ready:
            self.fail("garbled", f"{word:02X} came instead of {ready:02X}")
        return word == ready

    def judge(self):
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
            # the node did not hear this request: the line is in order, so repeat at once
            self.fail(
                "old reply",
                "the node hears, but it never received the request whole",
                State.AWAIT_READY,
            )
        else:
            self.reply, self.state = reply, State.DONE

    def fail(self, event: str, reason: str, afterwards: State = State.QUIET):
        self.events.append(event)
        self.reason, self.outgoing = reason, []
        if self.attempts >= self.tries:
            self.state = State.FAILED
        elif afterwards == State.QUIET:
            self.state, self.noise = State.QUIET, 0
        else:
            self.begin()
