# SPDX-License-Identifier: Apache-2.0
"""A session written down as it happens on the line, and given again to the same or another line.

A record is a text of JSON objects, one a line: first what it is, then each call of the transport
with its time in seconds:
{"at": 0.31, "send": [289]} and {"at": 0.32, "receive": [97], "wanted": 1, "timeout_s": 0.1}, words
being 9-bit; {"at": 0.4, "break": true}
and {"at": 0.41, "baud": 1000000}, from then on.
"""

import json
from dataclasses import dataclass

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

KIND = {"record": "moire bus", "version": 1}
LONGEST_S = 1e9  # of a session
FASTEST_BAUD = 1e9
KEYS = (
    {"at", "send"},
    {"at", "receive", "wanted", "timeout_s"},
    {"at", "break"},
    {"at", "baud"},
)  # of a call


class Recorder(Transport):
    """Passes everything on to a transport, and writes it to a file that is open for text."""

    def __init__(self, transport: Transport, file):
        self.transport, self.file = transport, file
        self.character_s, self.time_is_stopped, self.handshake = (
            transport.character_s,
            transport.time_is_stopped,
            transport.handshake,
        )
        self.began = transport.now()
        self.write({**KIND, "protocol_crc": PROTOCOL_CRC})

    def write(self, told: dict):
        self.file.write(json.dumps(told) + "\n")

    def send(self, words):
        self.write({"at": self.now() - self.began, "send": list(words)})
        self.transport.send(words)

    def receive(self, count, timeout_s):
        at, words = self.now() - self.began, self.transport.receive(count, timeout_s)
        self.write({"at": at, "receive": list(words), "wanted": count, "timeout_s": timeout_s})
        return words

    def now(self):
        return self.transport.now()

    def wait(self, seconds):
        self.transport.wait(seconds)

    def reaches(self, address):
        return self.transport.reaches(address)

    def send_break(self):
        self.write({"at": self.now() - self.began, "break": True})
        self.transport.send_break()

    def set_baud(self, baud):
        self.write({"at": self.now() - self.began, "baud": baud})
        self.transport.set_baud(baud)
        self.character_s = self.transport.character_s

    def close(self):
        self.file.close()
        self.transport.close()


def read(text: str, name: str = "text") -> list:
    """The calls of a record; BadFile unless it is one of this version, made with this protocol
    table.
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


def is_call(call) -> bool:
    """Whether this is one of KEYS, each value of its type."""
    if not isinstance(call, dict) or set(call) not in KEYS:
        return False
    words, numbers = (
        call.get("send", call.get("receive", [])),
        [call[name] for name in ("at", "wanted", "timeout_s") if name in call],
    )
    return (
        isinstance(words, list)
        and all(type(word) is int and 0 <= word < 512 for word in words)
        and all(type(number) in (int, float) and 0 <= number < LONGEST_S for number in numbers)
        and type(call.get("wanted", 0)) is int
        and type(call.get("baud", 1)) is int
        and 0 < call.get("baud", 1) < FASTEST_BAUD
        and call.get("break", True) is True
    )


# ------------------------------------------------------------------ replay


class ReplayDiffers(MoireError):
    """A line answered otherwise than the record has it."""


@dataclass
class Comparison:
    """Answers, counted: the very same bytes; the same operation and cause, but other values;
    anything else.
    """

    same: int = 0
    other_values: int = 0
    different: int = 0
    first: str = ""  # difference, in words

    @property
    def words(self) -> str:
        total = self.same + self.other_values + self.different
        return f"{total} answers: {self.same} the same, {self.other_values} with other values, {self.different} different"


def last_baud(calls: list) -> int | None:
    """The rate at which a record leaves the line; None where it never changes."""
    return next((call["baud"] for call in reversed(calls) if "baud" in call), None)


def replay(calls: list, transport: Transport) -> Comparison:
    """Sends what was sent, at the same times, and compares what comes back."""
    result, began, old, new = Comparison(), transport.now(), [], []
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
            new += transport.receive(call["wanted"], call["timeout_s"])
    compare(result, old, new, calls[-1]["at"] if calls else 0.0)
    return result


def compare(result: Comparison, old: list, new: list, at: float):
    if old == new:
        result.same += bool(old)
    elif outcome(old) is not None and outcome(old) == outcome(new):
        result.other_values += 1
    else:
        result.different += 1
        result.first = (
            result.first or f"at {at:.3f} s {hexadecimal(new)} came instead of {hexadecimal(old)}"
        )


def outcome(words: list):
    """Sequence, operation and cause of a whole reply, else None."""
    if len(words) < 2 + CRC_LENGTH or words[1:] != list(
        frame(words[0] & 0xFF, bytes(word & 0xFF for word in words[2:-CRC_LENGTH]))
    ):
        return None
    return words[2:5]


def hexadecimal(words: list) -> str:
    return (
        " ".join(f"{word & 0xFF:02X}" + ("*" if word & NINTH else "") for word in words)
        or "nothing"
    )


# ------------------------------------------------------------------ in words


def listing(calls: list) -> list:
    """Requests and replies in the order of the line, one a row, by name and value."""
    rows, answer, address = [], [], 0
    for call in calls:
        if "receive" in call:
            answer += call["receive"]
            continue
        rows += answer_text(answer)
        answer, request = [], []
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
    body = payload[1:-CRC_LENGTH]
    name = NAMES.get(body[1]) if len(body) > 1 else None
    if name is None or len(body) != 2 + REQUESTS[name].size:
        return f"unknown request {body.hex(' ')}"
    fields = zip((field for field, _ in OPERATIONS[name].request), REQUESTS[name].unpack(body[2:]))
    return f"{name} " + " ".join(f"{field}={value}" for field, value in fields)


def answer_text(words: list) -> list:
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
