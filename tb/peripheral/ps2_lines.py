# SPDX-License-Identifier: Apache-2.0
"""A PS/2 keyboard and a PS/2 host as the description of the interface defines them. Each checks the
other side.

Both are stepped once a cycle with the levels of their lines, and pull them by clock_low and
data_low."""

import random

from tb.peripheral.ps2_host import frame


class Party:
    def __init__(self, clk_hz):
        self.us = clk_hz / 1e6
        self.clock = self.data = 1
        self.clock_low = self.data_low = 0
        self.life = self.live()

    def step(self, clock, data):
        self.clock, self.data = clock, data
        next(self.life)

    def wait(self, us):
        for _ in range(max(round(us * self.us), 1)):
            yield


class Keyboard(Party):
    """Sends the bytes of `outbox` and answers commands. `half` is half a bit in us, `damage` the
    fraction of its frames that it damages.
    """

    def __init__(self, clk_hz, half=40, damage=0.0):
        super().__init__(clk_hz)
        self.half, self.damage = half, damage
        self.outbox, self.answers, self.commands, self.last, self.aborts = [], [], [], 0, 0

    def live(self):
        free = 0
        while True:
            free = free + 1 if self.clock else 0
            if free > 50 * self.us and not self.data:
                yield from self.receive()
                free = 0
            elif free > 50 * self.us and (self.answers or self.outbox):
                queue = self.answers or self.outbox
                if (yield from self.send(queue[0])):
                    self.last = queue.pop(0)
                free = 0
            yield

    def pulse(self):
        """One clock pulse, from the middle of high to the middle of high; False if the host holds
        the clock.
        """
        yield from self.wait(self.half / 2)
        if not self.clock:
            return False
        self.clock_low = 1
        yield from self.wait(self.half)
        self.clock_low = 0
        yield from self.wait(self.half / 2)
        return True

    def send(self, byte):
        for bit in frame(byte, random.random() < self.damage):
            self.data_low = 1 - bit
            if not (yield from self.pulse()):
                self.data_low, self.aborts = 0, self.aborts + 1
                return False
        return True

    def receive(self):
        bits = []
        for bit in range(11):
            self.data_low = int(bit == 10 and bits[9])
            if not (yield from self.pulse()):
                self.data_low = 0
                return
            bits.append(self.data)
        self.data_low = 0
        byte = sum(b << n for n, b in enumerate(bits[:8]))
        self.answer(byte if bits[:10] == frame(byte)[1:] else None)

    def answer(self, byte):
        if byte is None:
            self.answers = [0xFE]
        elif byte == 0xFE:
            self.answers = [self.last]
        else:
            self.commands.append(byte)
            self.answers = {0xEE: [0xEE], 0xFF: [0xFA, 0xAA], 0xF2: [0xFA, 0xAB, 0x83]}.get(
                byte, [0xFA]
            )


class Host(Party):
    """Collects the bytes in `received`, sends those of `orders`, and requests damaged bytes again.
    `cut` is the fraction of bits after which it pulls the clock; with `pause` it pulls the clock
    for this time in us after each byte."""

    def __init__(self, clk_hz, cut=0.0, pause=0):
        super().__init__(clk_hz)
        self.cut, self.pause = cut, pause
        self.received, self.at, self.orders, self.damaged, self.unanswered, self.now = (
            [],
            [],
            [],
            0,
            0,
            0,
        )

    def live(self):
        bits, before, still = [], 1, 0
        while True:
            self.now += 1
            fall, before, still = before and not self.clock, self.clock, still + 1
            if fall:
                bits, still = [*bits, self.data], 0
                if len(bits) == 11:
                    yield from self.judge(bits)
                    bits = []
                elif random.random() < self.cut:
                    yield from self.wait(
                        random.uniform(1, 75 if len(bits) < 10 else 60)
                    )  # a device cannot detect a cut at its last edge
                    yield from self.pull(random.uniform(100, 400))
                    bits = []
                before = self.clock
            elif bits and still > 300 * self.us:
                bits = []
            elif self.orders and not bits:
                yield from self.order(self.orders.pop(0))
                before = self.clock
            yield

    def pull(self, us):
        self.clock_low = 1
        yield from self.wait(us)
        self.clock_low = 0
        yield from self.wait(4)

    def judge(self, bits):
        byte = sum(b << n for n, b in enumerate(bits[1:9]))
        if bits == frame(byte):
            self.received.append(byte)
            self.at.append(self.now)
            if self.pause:
                yield from self.wait(60)
                yield from self.pull(self.pause)
        else:
            self.damaged += 1
            self.orders.insert(0, 0xFE)

    def order(self, byte, damaged=0):
        self.clock_low = 1
        yield from self.wait(110)
        self.data_low, self.clock_low = 1, 0
        yield from self.wait(4)
        for bit in [*frame(byte, damaged)[1:], 1]:
            for _ in range(round(15_000 * self.us)):
                if not self.clock:
                    break
                yield
            acknowledged = not self.data
            yield from self.wait(5)
            self.data_low = 1 - bit
            while not self.clock:
                yield
        self.unanswered += not acknowledged
