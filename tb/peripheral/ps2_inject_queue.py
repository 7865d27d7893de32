# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/peripheral/ps2_inject_queue.sv: outputs(injecting) returns the outputs in a
cycle, step(…) is the cycle.
"""

from tb.serial.sync_fifo import SyncFifo


class Ps2InjectQueue:
    def __init__(self, depth=32):
        self.depth, self.queue, self.doomed = depth, SyncFifo(depth), 0

    def discards(self, injecting):
        return self.doomed > 0 and not injecting

    def outputs(self, injecting):
        """(valid, (code, last) or None, free)."""
        valid = int(self.queue.present and not self.discards(injecting))
        return valid, self.queue.words[0] if valid else None, self.depth - len(self.queue.words)

    def step(self, push=None, drop=0, ready=0, injecting=0, rst=0):
        """`push` is (code, last) or None."""
        popped = bool((ready or self.discards(injecting)) and self.queue.present)
        if rst:
            self.doomed = 0
        elif drop:
            self.doomed = len(self.queue.words) - popped
        elif popped and self.doomed:
            self.doomed -= 1
        self.queue.step(push is not None, push, popped, rst)
