# SPDX-License-Identifier: Apache-2.0
"""What a register block does together with register_memory, in integers: step(...) is one clk and
returns every output after it, by port name; rdata is the answer to the read of the clk before.
"""

from tb.registers.event_counters import EventCounters

WORD = (1 << 32) - 1


def extend(value, width, signed, to):
    """The value as `to` bits, with copies of its sign above it if it has one."""
    value &= (1 << width) - 1
    return (value - (1 << width)) & ((1 << to) - 1) if signed and value >> (width - 1) else value


class RegisterBlock:
    """`block` is a block of tables/registers.py, `constant` the CRC-32 that word 0 of the map
    shows. A setting that needs a parameter named in `without` has no bits.
    """

    def __init__(self, block, constant, without=()):
        self.block, self.constant, self.without = block, constant, without
        self.counted = {f.port: r.word for r, f in block.fields if f.in_memory}
        if self.counted:
            self.counters = EventCounters(block.counters)
        self.reset()

    def reset(self):
        self.value = {
            f.port: 0 if f.needs in self.without else f.reset & ((1 << f.width) - 1)
            for r, f in self.block.fields
            if f.kind in ("setting", "counter", "sticky")
        }
        if self.counted:
            self.counters.reset()
        self.pulse = {f.port: 0 for r, f in self.block.fields if f.kind == "pulse"} | {
            f"{r.name}_written": 0 for r in self.block.registers if r.on_write
        }
        self.upper = {
            r.name: 0 for r in self.block.registers if r.wide
        }  # latched by a read of the low word
        self.lower = 0  # waits for a write of its high word
        self.awaited, self.settings = None, 0  # word that is read, its settings
        self.rdata = 0

    def shown(self, register, inputs, settings):
        """The settings of a register, or its live bits, as software sees them, all its words in one
        number.
        """
        whole, size = 0, 64 if register.wide else 32
        for f in register.fields:
            port = f.port
            source = {"constant": {port: self.constant}, "input": inputs}.get(f.kind, self.value)
            if "r" in f.access and (f.kind == "setting") == settings:
                whole |= (
                    extend(
                        source[port], f.width, f.signed and len(register.fields) == 1, size - f.low
                    )
                    << f.low
                )
        return whole

    def step(self, select, write, word, wdata, inputs, rst=0):
        if rst:
            self.reset()
        else:
            self.answer(inputs)
            self.get(word if select and not write else None)
            self.count(select, write, word, inputs)
            self.put(word if select and write else None, wdata, inputs)
        read = {
            f"{r.name}_read": int(self.awaited == r.word) for r in self.block.registers if r.on_read
        }
        outputs = {
            f.port: 0 if f.momentary and not self.pulse[f"{r.name}_written"] else self.value[f.port]
            for r, f in self.block.own_fields
            if f.kind == "setting" and not f.passed
        }
        return {"rdata": self.rdata, **outputs, **self.pulse, **read}

    def count(self, select, write, word, inputs):
        """One cycle of the counters in a memory; their values are the answers to reads."""
        if not self.counted:
            return
        here = select and word in self.counted.values()
        events = {place for port, place in self.counted.items() if inputs[port]}
        number = word % self.counters.counters
        answer = self.counters.step(events, here and not write, here and write, number)
        for port, place in self.counted.items():
            if here and not write and place == word:
                self.value[port] = answer

    def get(self, word):
        self.awaited, self.settings = word, 0
        for r in self.block.registers:
            if word in range(r.word, r.word + 1 + r.wide):
                self.settings = self.shown(r, {}, True) >> 32 * (word - r.word) & WORD

    def answer(self, inputs):
        self.rdata = self.settings
        for r in self.block.registers:
            live = self.shown(r, inputs, False)
            if self.awaited == r.word:
                self.rdata |= live & WORD
                self.upper[r.name] = live >> 32
            elif r.wide and self.awaited == r.word + 1:
                self.rdata |= self.upper[r.name]

    def put(self, word, wdata, inputs):
        for r in self.block.registers:
            hit, commit = word == r.word, word == r.word + r.wide
            if r.on_write:
                self.pulse[f"{r.name}_written"] = int(commit)
            for f in r.fields:
                port, bits = f.port, wdata >> f.low & ((1 << f.width) - 1)
                if f.kind == "pulse":
                    self.pulse[port] = int(hit and bits)
                elif f.kind == "counter" and not f.in_memory:
                    self.value[port] = min(
                        (0 if hit else self.value[port]) + inputs[port], (1 << f.width) - 1
                    )
                elif f.kind == "sticky":
                    self.value[port] = int(
                        inputs[port] or (self.value[port] and not (hit and bits))
                    )
                elif f.kind == "setting" and commit and f.needs not in self.without:
                    self.value[port] = (
                        (wdata << 32 | self.lower) & ((1 << f.width) - 1) if r.wide else bits
                    )
            if r.wide and hit and r.fields[0].kind == "setting":
                self.lower = wdata
