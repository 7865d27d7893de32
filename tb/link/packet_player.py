# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/link/packet_player.sv in integers: outputs() gives the outputs of a cycle, step(...)
advances it. What the player does is written down as a coroutine: each yield is a cycle, and returns
the inputs of that cycle.
"""

import zlib

from moire.made import link_tables as layout
from tb.registers.register_access import RegisterAccess

NAMES = (
    "busy",
    "capturing",
    "request",
    "select",
    "write",
    "address",
    "wdata",
    "valid",
    "data",
    "last",
    "read_at",
)


class PacketPlayer:
    def __init__(self, captures=0):
        self.requests, self.lists, self.access = {}, {}, RegisterAccess()
        self.captures, self.read_at = captures, None if captures else 0
        self.words = []  # that were read last
        self.reset()

    def reset(self):
        self.access.reset()
        self.busy, self.byte, self.last, self.taking = 0, None, 0, None
        self.capturing = self.captured = self.due = self.waiting = 0
        self.idle = True
        self.process = self.run()
        next(self.process)

    def outputs(self):
        """The outputs by NAMES; None where a value has no meaning in this cycle."""
        access = self.access
        written = access.wdata if access.write else None
        held = (access.write, access.address, written) if access.select else (None,) * 3
        sent = int(self.byte is not None)
        shown = self.busy, self.capturing, access.waits, access.select
        return *shown, *held, sent, self.byte, self.last, self.read_at

    def stored(self, place):
        """A word of the request that is played."""
        return self.requests[self.bank, place]

    def reach(self, put, at, value):
        """An access of the register bus; returns the word that the bus has then."""
        self.taking = {"put": put, "at": at, "value": value}
        yield
        while True:
            inputs = yield
            if inputs["done"]:
                return inputs["rdata"]

    def send(self, content):
        """The bytes of a word."""
        yield
        yield
        for n, byte in enumerate(content):
            self.byte, self.last = byte, int(n == self.last_at)
            while not (yield)["taken"]:
                pass
        self.byte, self.last = None, 0

    def read_list(self, reads):
        """The registers of the read list."""
        self.words = []
        for n in range(reads):
            inputs = yield
            if n == 0:
                self.stamp(inputs)
            yield
            self.words.append((yield from self.reach(0, self.lists[n] >> 16, None)))
        inputs = yield
        if not reads:
            self.stamp(inputs)

    def stamp(self, inputs):
        if self.captures:
            self.read_at = inputs["now"]

    def run(self):
        self.last_at = None
        while True:
            inputs = yield
            if inputs["captures"]:
                self.idle, self.capturing = False, 1
                yield from self.read_list(inputs["reads"])
                self.idle, self.capturing, self.captured = True, 0, 1
                continue
            if not inputs["plays"]:
                continue
            self.idle, self.busy = False, 1
            writes, reads = inputs["writes"], inputs["reads"]
            for n in range(writes):
                yield
                yield
                at = self.lists[n] & 0xFFFF
                yield from self.reach(1, at, self.stored(layout.REQUEST_WORDS + n))
            yield
            words = []
            for n in range(layout.REPLY_WORDS):
                yield
                inputs = yield
                counts = inputs["refused"] | inputs["expired"] << 48
                words.append(
                    {
                        layout.REPLY_IDENTITY: (self.stored(layout.REQUEST_IDENTITY) & ~0xFF)
                        | layout.KIND_REPLY,
                        layout.REPLY_SEQUENCE: self.stored(layout.REQUEST_SEQUENCE),
                        layout.REPLY_TIME: inputs["now"],
                        layout.REPLY_REFUSED: counts & 0xFFFFFFFF,
                        layout.REPLY_STATE: counts >> 32,
                    }[n]
                )
            yield
            captured, self.captured = self.captured, 0
            if not captured:
                yield from self.read_list(reads)
            words += self.words
            yield
            yield
            spare, value = (self.stored(layout.REQUEST_WORDS + writes + n) for n in (0, 1))
            words.append((yield from self.reach(spare >> 31, spare & 0xFFFF, value)))
            yield
            content = b"".join(word.to_bytes(4, "little") for word in words)
            for n in range(0, len(content), 4):
                yield from self.send(content[n : n + 4])
            yield
            self.last_at = 3
            yield from self.send(zlib.crc32(content).to_bytes(4, "little"))
            self.last_at = None
            yield
            self.idle, self.busy = True, 0

    def queue(self, capture, hold, start, bank):
        """What begins in this cycle if the player is idle, and what waits for that."""
        if start and not self.busy:
            self.bank = bank
        captures = self.captures and (capture or self.due)
        plays = (start or self.waiting) and not captures
        ignored = self.busy and not self.waiting
        self.due = int(bool(hold and captures and not self.idle))
        waits = (start and not ignored) or self.waiting
        self.waiting = int(bool(self.captures and waits and not (self.idle and plays)))
        return {"captures": captures, "plays": plays}

    def step(
        self,
        ready,
        rst,
        list_put,
        list_at,
        list_entry,
        put,
        bank,
        put_at,
        word,
        capture=0,
        hold=0,
        **inputs,
    ):
        stores_list = list_put and not inputs["enable"] and not self.busy and not self.capturing
        if stores_list:
            self.lists[list_at] = list_entry
        elif put:
            self.requests[bank, put_at] = word
        if rst:
            return self.reset()
        taking, self.taking = self.taking, None
        done = self.access.done
        begins = self.queue(capture, hold, inputs["start"], bank)
        self.process.send(inputs | begins | {"done": done})
        if not hold:
            self.captured = 0
        if self.capturing or self.idle:
            self.busy = self.waiting
        self.access.step(take=int(taking is not None), ready=ready, **(taking or {}))
        return None
