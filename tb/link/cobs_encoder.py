# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/link/cobs_encoder.sv in integers. What it does is written down as a coroutine: each
yield is a cycle, gives whether a byte would be taken, and returns the inputs of that cycle.
"""


class CobsEncoder:
    def __init__(self, a=9):
        self.size = 1 << a
        self.reset()

    def reset(self):
        self.line = []  # bytes that are complete and not yet taken by the line
        self.block = []  # bytes of the open block
        self.open = False  # a code will come before them
        self.active, self.fetched = False, False
        self.process = self.run()
        self.takes = next(self.process)

    @property
    def room(self):
        return len(self.line) + len(self.block) + self.open < self.size - 3

    def outputs(self, valid):
        """taken, sends, data_out, busy; data_out is None without sends."""
        taken = bool(valid and self.takes and self.room)
        byte = self.line[0] if self.fetched else None
        return taken, self.fetched, byte, self.active or bool(self.line)

    def close(self):
        self.new += [len(self.block) + 1, *self.block]
        self.block = []

    def run(self):
        while True:
            while not ((yield False)["valid"] and self.room):
                pass
            self.new += [0]
            self.open, self.active, ended = True, True, False
            while not ended:
                full = len(self.block) == 254
                inputs = yield not full
                if not (inputs["valid"] and self.room):
                    continue
                if full:
                    self.close()
                    continue
                if inputs["data"]:
                    self.block.append(inputs["data"])
                else:
                    self.close()
                ended = inputs["last"]
            yield False
            self.close()
            self.open = False
            yield False
            self.new += [0]
            self.active = False

    def step(self, valid, data, last, ready, rst=0):
        if rst:
            return self.reset()
        self.new = []
        sent = self.fetched and ready
        fetched = bool(self.line) and not sent
        self.takes = self.process.send({"valid": valid, "data": data, "last": last})
        if sent:
            self.line.pop(0)
        self.line += self.new
        self.fetched = fetched
        return None
