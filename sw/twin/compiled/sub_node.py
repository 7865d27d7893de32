# SPDX-License-Identifier: Apache-2.0
"""A sub-node of S4 without firmware, as a main node meets it on its peer port."""

import zlib
from collections import deque

from moire.bus.cobs import sealed, unstuff
from twin.compiled.station_devices import ms
from twin.compiled.tables import CAUSE, TABLE

OPERATION = {name: operation["code"] for name, operation in TABLE["operation"].items()}
CAUSE_CODE = {name: code for code, name in CAUSE.items()}


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
            body = unstuff(bytes(self.came)) or b""
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
        self.to_send.extend(sealed(body + zlib.crc32(body).to_bytes(4, "little")))

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
