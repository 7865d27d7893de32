# SPDX-License-Identifier: Apache-2.0
"""A transport of the host package to fake_machine.FakeNode: host and firmware together, without
hardware and without the twin.
"""

from moire.bus.transport import Transport
from twin.compiled.node import DEFINES


class FakeNodeBus(Transport):
    """The bus of one node, in the time of its firmware."""

    time_is_stopped = True

    def __init__(self, machine):
        self.machine, self.sent, self.ms = machine, [], 0

    def send(self, words):
        passed = []
        for word, after in zip(words, [*words[1:], 0x100], strict=True):
            complete = (
                not word >> 8 and after >> 8
            )  # the hardware marks the last word of a right frame
            passed.append(
                word & 0xFF
                | DEFINES["BUS_RECEIVE_COMMAND_MASK"] * (word >> 8)
                | DEFINES["BUS_RECEIVE_GOOD_MASK"] * complete
            )
        self.sent += self.machine.receive(passed)
        self.wait(0.001)

    def receive(self, count, timeout_s):
        taken, self.sent = self.sent[:count], self.sent[count:]
        return taken

    def now(self):
        return self.ms / 1000

    def wait(self, seconds):
        self.ms += max(1, round(seconds * 1000))
        self.machine.run(max(1, round(seconds * 1000)))
