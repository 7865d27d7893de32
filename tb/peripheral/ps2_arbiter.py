# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/peripheral/ps2_arbiter.sv. wires(...) returns the outputs for these inputs;
step(...) is one cycle.
The inputs are one tuple of Inputs, a byte is (value, damaged) or None."""

from typing import NamedTuple, Optional

EXCHANGE, LONGEST, RESEND = 20, 1000, 0xFE
ANSWERS = {0xFF: 2, 0xF2: 3}


class Inputs(NamedTuple):
    idle_ms: int = 0
    inject: Optional[tuple] = None  # (value, last)
    keyboard: Optional[tuple] = None
    keyboard_busy: int = 0
    keyboard_held: int = 0
    command_ready: int = 0
    command_sent: int = 0
    command_unsent: int = 0
    send_ready: int = 0
    host: Optional[tuple] = None


class Ps2Arbiter:
    def __init__(self, clk_hz):
        self.ms = clk_hz // 1000
        self.orders = [0, 0]
        self.injected = 0
        self.reset()

    def reset(self):
        self.part = self.quiet = self.left = self.awaited = self.ordered = self.waited = (
            self.injecting
        ) = self.own = self.again = 0

    def conditions(self, i):
        resend = int(i.host == (RESEND, 0) and self.own)
        active = bool(i.host or self.ordered or i.keyboard or i.keyboard_busy)
        is_open = active or self.awaited or self.quiet < EXCHANGE
        may = bool(
            i.inject
            and not self.injecting
            and not self.left
            and not is_open
            and self.quiet >= i.idle_ms
            and not self.again
        )
        return resend, active, is_open, may

    def arrived(self, i):
        """The byte of the keyboard that is new in this cycle, if it is undamaged."""
        return i.keyboard[0] if i.keyboard and not self.waited and not i.keyboard[1] else None

    def wires(self, i):
        """(keyboard_hold, command, host_ready, send, keyboard_ready, inject_ready, injecting,
        typed); a byte is None without its valid.
        """
        resend, _, is_open, may = self.conditions(i)
        send = (
            (self.injected, 0)
            if self.again
            else i.keyboard
            if i.keyboard
            else (i.inject[0], 0)
            if self.injecting and i.inject and not is_open
            else None
        )
        return (
            int(not self.awaited if self.injecting else may),
            i.host if i.host and not resend else None,
            int(resend or i.command_ready),
            send,
            int(i.send_ready and not self.again),
            int(i.send_ready and not self.again and not i.keyboard),
            self.injecting,
            int(self.arrived(i) is not None and not self.awaited),
        )

    def step(self, i, rst=0):
        resend, active, _, may = self.conditions(i)
        _, command, _, _, _, injected, *_ = self.wires(i)
        arrived = self.arrived(i)
        given_up = self.quiet >= LONGEST
        end = self.part == self.ms - 1
        self.waited = int(bool(i.keyboard))
        self.quiet = 0 if active else min(self.quiet + end, 0xFFFF)
        self.part = 0 if active or end else self.part + 1
        if i.command_sent:
            order, before = self.orders
            if order == RESEND:
                self.awaited = self.awaited or 1
            else:
                self.awaited = 2 if order == 0 and before == 0xF0 else ANSWERS.get(order, 1)
        elif arrived is not None:
            self.awaited = 0 if arrived in (RESEND, 0xFC) else max(self.awaited - 1, 0)
        elif given_up:
            self.awaited = 0
        if arrived is not None:
            if arrived in (0xE0, 0xF0):
                self.left = max(self.left, 1)
            elif arrived == 0xE1:
                self.left = 2
            elif arrived == 0xAA:
                self.left = 0
            elif arrived not in (0xFA, 0xFC, 0xEE, RESEND):
                self.left = max(self.left - 1, 0)
        elif given_up:
            self.left = 0
        if i.command_sent or i.command_unsent:
            self.ordered = 0
        elif command and i.command_ready:
            self.ordered = 1
        if command and i.command_ready:
            self.orders = [command[0], self.orders[0]]
        if may and i.keyboard_held:
            self.injecting = 1
        if injected:
            self.injected = i.inject[0]
            if i.inject[1]:
                self.injecting = 0
        if i.send_ready:
            self.own, self.again = int(bool(self.again or not i.keyboard)), 0
        elif resend:
            self.again = 1
        if rst:
            self.reset()
