# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/node_memory.sv in integers: step(...) advances one cycle and returns rdata after
it.
"""


class NodeMemory:
    def __init__(self, words):
        self.words, self.rdata = list(words), None

    def step(self, write, write_address, wdata, read_address):
        if write:
            mask = sum(0xFF << 8 * n for n in range(4) if write >> n & 1)
            self.words[write_address] = self.words[write_address] & ~mask | wdata & mask
        else:
            self.rdata = self.words[read_address]
        return self.rdata
