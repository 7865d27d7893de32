# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/node_memory.sv in integers: step(...) advances one cycle and returns rdata after
it.
"""


class NodeMemory:
    def __init__(self, words):
        self.words, self.rdata = list(words), None

    def step(self, read, write, address, wdata):
        if write:
            mask = sum(0xFF << 8 * n for n in range(4) if write >> n & 1)
            self.words[address] = self.words[address] & ~mask | wdata & mask
        elif read:
            self.rdata = self.words[address]
        return self.rdata
