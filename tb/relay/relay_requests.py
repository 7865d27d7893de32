# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/relay/relay_requests.sv: clk(...) is one cycle, and the attributes are the
state after it. zlib computes the CRC-32.
"""

import zlib

CLEAR, BEGIN_SET, SET, FLASH = 1, 2, 3, 4
REPLY = 0x61


class RelayRequests:
    def __init__(self):
        self.sequence = self.set_data = None
        self.again = False
        self.reset()

    def reset(self):
        self.state, self.taken, self.has_sequence = (
            "receive",
            None,
            False,
        )  # taken: bytes after the command byte
        self.flags = 0
        self.set_start = self.set_valid = self.pass_select = self.pass_valid = False

    @property
    def answer_valid(self):
        return self.state == "send"

    @property
    def answer(self):
        """The byte at the output; the CRC-32 covers the bytes that were sent."""
        if self.at < len(self.row):
            return self.row[self.at]
        return zlib.crc32(bytes(self.row)) >> 8 * (self.at - len(self.row)) & 0xFF

    def clk(
        self,
        rst=0,
        valid=0,
        data=0,
        command=0,
        good=0,
        events=0,
        levels=0,
        source=0,
        orders=0,
        identity=0,
        position=0,
        correction=0,
        pass_ready=0,
        pass_done=0,
        pass_data=0,
        answer_ready=0,
    ):
        if rst:
            self.reset()
            return
        flags, self.flags = self.flags, self.flags | events
        self.set_start = self.set_valid = self.pass_valid = False
        if self.state == "receive":
            if valid and command:
                self.taken = b""
            elif valid and self.taken is not None:
                self.taken += bytes([data])
            if good and self.taken is not None:
                self.body, self.taken = list(self.taken[1 : 1 + self.taken[0]]), None
                self.state, self.at = "read", 0
        elif self.state == "read":
            self.state = "act"
        elif self.state == "act":
            self.act(flags, events, pass_ready)
        elif self.state == "wait":
            if pass_done:
                self.body[self.at] = pass_data
                self.done()
        elif self.state == "fetch":
            self.state, self.pass_select = "send", False
        elif answer_ready:
            if self.at == 0 and self.kind != FLASH:
                words = (identity, position, correction)
                self.row[4:] = (
                    flags,
                    levels,
                    orders << 2 | source,
                    *(word >> n & 0xFF for word in words for n in (0, 8, 16, 24)),
                )
            self.at += 1
            self.state = "fetch" if self.at < len(self.row) + 4 else "receive"

    def act(self, flags, events, pass_ready):
        byte, at = self.body[self.at], self.at
        if at >= 2 and self.kind == FLASH:
            if pass_ready:
                self.set_data, self.pass_valid, self.state = byte, True, "wait"
            return
        if at == 0:
            self.again, self.has_sequence = self.has_sequence and byte == self.sequence, True
            self.sequence = byte
        elif at == 1:
            self.kind = byte
            self.set_start = byte == BEGIN_SET and not self.again
            self.pass_select = byte == FLASH
        else:
            self.set_data = byte
            self.set_valid = self.kind in (BEGIN_SET, SET) and not self.again
            if self.kind == CLEAR and not self.again and at == 2:
                self.flags = flags & ~byte | events
        self.done()

    def done(self):
        """This byte of the body is done."""
        self.at += 1
        if self.at < len(self.body):
            self.state = "read"
        elif len(self.body) == 1 or self.kind > FLASH:
            self.state = "receive"
        else:
            self.state, self.at = "fetch", 0
            self.row = (
                [REPLY, len(self.body), *self.body]
                if self.kind == FLASH
                else [REPLY, 17, *self.body[:2], *[0] * 15]
            )
