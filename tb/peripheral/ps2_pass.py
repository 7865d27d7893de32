# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/peripheral/ps2_pass.sv: the models of its parts, connected as the parts are.
step(...) is one cycle and returns the pulls after it,
(keyboard clock, keyboard data, host clock, host data)."""

from tb.common.synchroniser import Synchroniser
from tb.peripheral.ps2_arbiter import Inputs, Ps2Arbiter
from tb.peripheral.ps2_device import Ps2Device
from tb.peripheral.ps2_host import Ps2Host
from tb.sense.deglitcher import Deglitcher


class Ps2Pass:
    def __init__(self, clk_hz):
        self.synchroniser = Synchroniser(4, reset=15, name="ps2_pass.u_synchroniser")
        self.deglitchers = [Deglitcher() for _ in range(4)]
        self.stable = clk_hz // 1_000_000
        self.levels, self.lines = [1] * 4, [1] * 4
        self.host, self.device, self.arbiter = (
            Ps2Host(clk_hz),
            Ps2Device(clk_hz),
            Ps2Arbiter(clk_hz),
        )

    def inputs(self, idle_ms, inject):
        """The inputs of the arbiter, and its answers."""
        _, valid, byte, damaged, sent, unsent, _, busy, _, _ = self.host.pins()
        send_ready, host_valid, order, order_damaged, *_ = self.device.pins(self.lines[2])
        seen = Inputs(
            idle_ms,
            inject,
            (byte, damaged) if valid else None,
            busy,
            0,
            self.host.rested(),
            sent,
            unsent,
            send_ready,
            (order, order_damaged) if host_valid else None,
        )
        command = self.arbiter.wires(seen)[1]
        return seen._replace(keyboard_held=int(self.host.rested() and command is None))

    def typed(self):
        """Whether a byte of the keyboard that answers no command came in the last cycle."""
        return self.arbiter.wires(self.inputs(0, None))[7]

    def step(self, lines, idle_ms, inject, rst=0):
        """lines: keyboard clock and data, host clock and data."""
        seen = self.inputs(idle_ms, inject)
        hold, command, host_ready, send, keyboard_ready, injected, *_ = self.arbiter.wires(seen)
        self.host.step(*self.lines[:2], hold, keyboard_ready, *(command or (None, 0)), rst)
        self.device.step(*self.lines[2:], *(send or (None, 0)), host_ready, rst)
        self.arbiter.step(seen, rst)
        self.lines = [
            d.step(self.stable, level, rst)[0] for d, level in zip(self.deglitchers, self.levels)
        ]
        word = self.synchroniser.step(sum(level << 3 - n for n, level in enumerate(lines)), rst)
        self.levels = [word >> 3 - n & 1 for n in range(4)]
        return *self.host.pins()[-2:], *self.device.pins(1)[-2:]
