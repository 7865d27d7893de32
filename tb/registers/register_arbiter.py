# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/registers/register_arbiter.sv in integers."""

from tb.registers.register_width import low_words

LOW = low_words()


def bit(mask, n):
    return mask >> n & 1


class RegisterArbiter:
    """`ready`, `shown` and `bus_select` give the outputs of a cycle, `step` advances one."""

    def __init__(self, masters=2, hold=63):
        self.masters, self.hold, self.left = masters, hold, 0
        self.reset()

    def reset(self):
        self.owner, self.reserved = 0, False
        self.since = 9  # cycles since the last access

    def idle(self, select):
        return not select and self.since > 2

    def alone(self, address):
        """The bus is reserved, but what the owner requests is no high word."""
        return self.reserved and not address[self.owner] & 4

    def ready(self, waits, select, address, bus_ready):
        """Levels, one bit for each master."""
        if self.masters == 1:
            return int(bus_ready and not waits)
        open_ = bus_ready and self.idle(select) and not self.alone(address)
        return 1 << self.owner if open_ and not bit(waits, self.owner) else 0

    def shown(self, values):
        return values[self.owner]

    def step(self, request, waits, select, address, bus_ready, rst):
        if rst:
            self.reset()
            return
        asks = {n for n in range(self.masters) if bit(request & ~waits, n)}
        asked, alone = self.owner in asks, self.alone(address)
        take = asked and self.idle(select) and bus_ready and not alone
        ends = alone if asked else self.left == 0
        low = address[self.owner] >> 2 in LOW
        passes = ends if self.reserved else self.since == 2 or not asked
        if not select and self.since > 1 and passes:
            above = {n for n in asks if n > self.owner}
            self.owner = min(above or asks, default=0)
        if not select and self.since == 1:
            self.reserved = low
        elif take or ends:
            self.reserved = False
        self.left = self.hold if select else max(0, self.left - 1)
        self.since = 1 if select else self.since + 1
