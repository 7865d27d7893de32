# SPDX-License-Identifier: Apache-2.0
"""Records a session as it happens on the bus, and replays it on the same or another bus.

A record is a text of JSON objects, one in each line. The first says what the file is; the others
are the calls of the transport with their time in seconds. The words have 9 bits:

    {"at": 0.31, "send": [289]}
    {"at": 0.32, "receive": [97], "expected": 1, "timeout_s": 0.1}
    {"at": 0.4, "break": true}
    {"at": 0.41, "baud": 1000000}
"""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TextIO

from moire.bus.protocol import (
    CRC_LENGTH,
    FROM_NODE,
    NAMES,
    NINTH,
    REQUESTS,
    TO_NODE,
    frame,
    parse_reply,
    ready_byte,
)
from moire.bus.transport import Transport
from moire.errors import BadFile, MoireError
from moire.made.bus_tables import CAUSES, OPERATIONS, PROTOCOL_CRC

Call = dict[str, Any]  # one of KEYS

KIND = {"record": "moire bus", "version": 2}
LONGEST_S = 1e9  # of a session
FASTEST_BAUD = 1e9
KEYS = (
    {"at", "send"},
    {"at", "receive", "expected", "timeout_s"},
    {"at", "break"},
    {"at", "baud"},
)  # of each kind of call


class Recorder(Transport):
    """Passes every call on to a transport, and writes it to a file that is open for text.

    The first line that cannot be written ends the record. All calls still reach the transport, so
    that what moves can be stopped, and close() then raises BadFile.
    """

    def __init__(self, transport: Transport, file: TextIO):
        self.transport, self.file = transport, file
        self.failure: BadFile | None = None
        self.character_s, self.handshake = transport.character_s, transport.handshake
        self.time_is_stopped = transport.time_is_stopped
        self.began = transport.now()
        self.write({**KIND, "protocol_crc": PROTOCOL_CRC})

    def write(self, entry: dict[str, Any]) -> None:
        """Writes one line, unless an earlier one could not be written."""
        if self.failure is None:
            with self.failing_once():
                self.file.write(json.dumps(entry) + "\n")

    @contextmanager
    def failing_once(self) -> Iterator[None]:
        """For a block that uses the file; keeps its first error."""
        try:
            yield
        except OSError as error:
            self.failure = self.failure or BadFile(
                f"the record {self.file.name} ends at {self.now() - self.began:.3f} s, since it "
                f"cannot be written: {error.strerror}"
            )

    def send(self, words: Sequence[int]) -> None:
        self.write({"at": self.now() - self.began, "send": list(words)})
        self.transport.send(words)

    def receive(self, count: int, timeout_s: float) -> list[int]:
        at, words = self.now() - self.began, self.transport.receive(count, timeout_s)
        self.write({"at": at, "receive": list(words), "expected": count, "timeout_s": timeout_s})
        return words

    def now(self) -> float:
        return self.transport.now()

    def wait(self, seconds: float) -> None:
        self.transport.wait(seconds)

    def reaches(self, address: int) -> bool:
        return self.transport.reaches(address)

    def send_break(self) -> None:
        self.write({"at": self.now() - self.began, "break": True})
        self.transport.send_break()

    def set_baud(self, baud: int) -> None:
        self.write({"at": self.now() - self.began, "baud": baud})
        self.transport.set_baud(baud)
        self.character_s = self.transport.character_s

    def close(self) -> None:
        with self.failing_once():
            self.file.close()
        self.transport.close()
        if self.failure is not None:
            raise self.failure


def read(text: str, name: str = "text") -> list[Call]:
    """The calls of a record.

    Raises BadFile unless it is a record of this version, made with this protocol table.
    """
    try:
        head, *calls = [json.loads(row) for row in text.splitlines()]
        right = head.items() >= KIND.items() and "protocol_crc" in head and all(map(is_call, calls))
    except (ValueError, AttributeError):
        right = False
    if not right:
        raise BadFile(
            f"the file {name} is no record of a bus: make one with 'moire --record {name} …'"
        )
    if head["protocol_crc"] != PROTOCOL_CRC:
        raise BadFile(f"the file {name} was recorded with another protocol table (bus.toml)")
    return calls


def is_call(call: object) -> bool:
    """Whether this has the keys of one kind of call, and each value the type that it must have."""
    if not isinstance(call, dict) or set(call) not in KEYS:
        return False
    words, numbers = (
        call.get("send", call.get("receive", [])),
        [call[name] for name in ("at", "expected", "timeout_s") if name in call],
    )
    return (
        isinstance(words, list)
        and all(type(word) is int and 0 <= word < 512 for word in words)
        and all(type(number) in (int, float) and 0 <= number < LONGEST_S for number in numbers)
        and type(call.get("expected", 0)) is int
        and type(call.get("baud", 1)) is int
        and 0 < call.get("baud", 1) < FASTEST_BAUD
        and call.get("break", True) is True
    )


# ------------------------------------------------------------------ replay


class ReplayDiffers(MoireError):
    """A bus answered differently from the record."""


@dataclass
class Comparison:
    """How many answers are the same in every byte, have the same operation and cause but other
    values, or differ in anything else.
    """

    same: int = 0
    other_values: int = 0
    different: int = 0
    first: str = ""  # the first difference, in words

    @property
    def words(self) -> str:
        """The counts in words."""
        total = self.same + self.other_values + self.different
        return (
            f"{total} answers: {self.same} the same, {self.other_values} with other values, "
            f"{self.different} different"
        )


def last_baud(calls: list[Call]) -> int | None:
    """The baud rate at the end of a record; None where it never changes."""
    return next((call["baud"] for call in reversed(calls) if "baud" in call), None)


def replay(calls: list[Call], transport: Transport) -> Comparison:
    """Sends what was sent, at the same times, and compares what comes back."""
    result, began = Comparison(), transport.now()
    old: list[int] = []
    new: list[int] = []
    for call in calls:
        transport.wait(call["at"] - (transport.now() - began))
        if "send" in call:
            compare(result, old, new, call["at"])
            old, new = [], []
            transport.send(call["send"])
        elif "break" in call:
            transport.send_break()
        elif "baud" in call:
            transport.set_baud(call["baud"])
        else:
            old += call["receive"]
            new += transport.receive(call["expected"], call["timeout_s"])
    compare(result, old, new, calls[-1]["at"] if calls else 0.0)
    return result


def compare(result: Comparison, old: list[int], new: list[int], at: float) -> None:
    """Counts one answer: the recorded words, and the words that came."""
    if old == new:
        result.same += bool(old)
    elif outcome(old) is not None and outcome(old) == outcome(new):
        result.other_values += 1
    else:
        result.different += 1
        result.first = (
            result.first or f"at {at:.3f} s {hexadecimal(new)} came instead of {hexadecimal(old)}"
        )


def outcome(words: list[int]) -> list[int] | None:
    """Sequence, operation and cause of a complete reply, else None."""
    if len(words) < 2 + CRC_LENGTH or words[1:] != list(
        frame(words[0] & 0xFF, bytes(word & 0xFF for word in words[2:-CRC_LENGTH]))
    ):
        return None
    return words[2:5]


def hexadecimal(words: list[int]) -> str:
    """Words as text; a star marks the 9th bit."""
    return (
        " ".join(f"{word & 0xFF:02X}" + ("*" if word & NINTH else "") for word in words)
        or "nothing"
    )


# ------------------------------------------------------------------ in words


def listing(calls: list[Call]) -> list[str]:
    """Requests and replies in the order of the bus, one in each row, by name and value."""
    rows: list[str] = []
    answer: list[int] = []
    address = 0
    for call in calls:
        if "receive" in call:
            answer += call["receive"]
            continue
        rows += answer_text(answer)
        answer = []
        request: list[int] = []
        if "break" in call:
            rows.append(f"{call['at']:9.4f} s  break")
        if "baud" in call:
            rows.append(f"{call['at']:9.4f} s  {call['baud']} baud from here on")
        for word in call.get("send", ()):
            if word & NINTH:
                address = word & 0xF
            else:
                request.append(word)
        if request:
            rows.append(f"{call['at']:9.4f} s  node {address}: {request_text(bytes(request))}")
    return rows + answer_text(answer)


def request_text(payload: bytes) -> str:
    """A request in words."""
    body = payload[1:-CRC_LENGTH]
    name = NAMES.get(body[1]) if len(body) > 1 else None
    if name is None or len(body) != 2 + REQUESTS[name].size:
        return f"unknown request {body.hex(' ')}"
    fields = zip((field for field, _ in OPERATIONS[name].request), REQUESTS[name].unpack(body[2:]))
    return f"{name} " + " ".join(f"{field}={value}" for field, value in fields)


def answer_text(words: list[int]) -> list[str]:
    """A reply in words, as rows; none for the handshake."""
    if outcome(words) is None:
        ready = len(words) == 1 and words[0] == ready_byte(words[0] & 0xF or 1, TO_NODE)
        return [] if not words or ready else [f"{'':12}no right reply: {hexadecimal(words)}"]
    reply = parse_reply(bytes(words[2:-CRC_LENGTH]))
    if reply is None or words[0] != ready_byte(words[0] & 0xF or 1, FROM_NODE):
        return [f"{'':12}no right reply: {hexadecimal(words)}"]
    cause = CAUSES.get(reply.cause, (str(reply.cause),))[0]
    return [
        f"{'':12}{cause} " + " ".join(f"{field}={value}" for field, value in reply.fields.items())
    ]
