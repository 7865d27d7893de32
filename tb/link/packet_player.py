# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/link/packet_player.sv in integers: outputs() gives the outputs of a cycle, step(...)
advances it. What the player does is written down as a coroutine: each yield is a cycle, and returns
the inputs of that cycle.
"""

import zlib

from moire.made import link_tables as layout
from tb.registers.register_access import RegisterAccess

NAMES = ("busy", "request", "select", "write", "address", "wdata", "valid", "data", "last")


class PacketPlayer:
    def __init__(self):
        self.requests, self.lists, self.access = {}, {}, RegisterAccess()
        self.reset()

    def reset(self):
        self.access.reset()
        self.busy, self.byte, self.last, self.taking = 0, None, 0, None
        self.process = self.run()
        next(self.process)

    def outputs(self):
        """The outputs by NAMES; None where a value has no meaning in this cycle."""
        access = self.access
        written = access.wdata if access.write else None
        held = (access.write, access.address, written) if access.select else (None,) * 3
        sent = int(self.byte is not None)
        return self.busy, access.waits, access.select, *held, sent, self.byte, self.last

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

    def run(self):
        self.last_at = None
        while True:
            inputs = yield
            if not inputs["start"]:
                continue
            self.busy, self.bank = 1, inputs["bank"]
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
            for n in range(reads):
                yield
                yield
                words.append((yield from self.reach(0, self.lists[n] >> 16, None)))
            yield
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
            self.busy = 0

    def step(self, ready, rst, list_put, list_at, list_entry, put, bank, put_at, word, **inputs):
        stores_list = list_put and not inputs["enable"] and not self.busy
        if stores_list:
            self.lists[list_at] = list_entry
        elif put:
            self.requests[bank, put_at] = word
        if rst:
            return self.reset()
        taking, self.taking = self.taking, None
        done = self.access.done
        self.process.send(inputs | {"done": done, "bank": bank})
        self.access.step(take=int(taking is not None), ready=ready, **(taking or {}))
        return None
