# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/sync_fifo.sv: step(push, word, pop) advances one cycle and returns (present,
out, free, overrun) after it.
"""

from collections import deque


class SyncFifo:
    def __init__(self, depth=64):
        self.depth, self.words, self.present = depth, deque(), 0

    def step(self, push, word, pop, rst=0):
        if rst:
            self.words.clear()
            self.present = 0
            return 0, None, self.depth, 0
        full = len(self.words) == self.depth
        drop = pop and self.present
        # neither a word pushed in this cycle nor the one after a popped word is at the output yet
        self.present = int(len(self.words) > 0 and not drop)
        if drop:
            self.words.popleft()
        if push and not full:
            self.words.append(word)
        return (
            self.present,
            self.words[0] if self.present else None,
            self.depth - len(self.words),
            int(bool(push and full)),
        )
