# SPDX-License-Identifier: Apache-2.0
"""The ports of a design, for a bench that drives and reads many of them in every cycle.

`int(getattr(dut, name).value)` looks a handle up and makes an array of four-state bits of the text
that the simulator gives, only to make a number of it; over a million cycles this takes longer than
the design and its model. Here each handle is looked up once, the text becomes the number, and a
level that stays is not driven again.
"""


class Ports:
    """The ports of a design. `ports["valid"]` is the level of one as an unsigned integer; it is a
    ValueError if a bit of it is X or Z. No one else may drive what is driven here.
    """

    def __init__(self, dut):
        self.dut, self.driven, self.ask = dut, {}, {}

    def __getitem__(self, name):
        ask = self.ask.get(name)
        if ask is None:
            ask = self.ask[name] = getattr(self.dut, name)._handle.get_signal_val_binstr
        return int(ask(), 2)

    def signed(self, name):
        """The level of a port in two's complement."""
        level, text = self[name], self.ask[name]()
        return level - (1 << len(text) if text[0] == "1" else 0)

    def drive(self, inputs):
        """Gives inputs their levels, {name: level}."""
        for name, level in inputs.items():
            if self.driven.get(name) != level:
                getattr(self.dut, name).value = self.driven[name] = level

    def check(self, want, cycle):
        """Compares outputs with {name: level}; None: the level does not matter."""
        for name, level in want.items():
            if level is not None:
                got = self[name]
                assert got == level, f"cycle {cycle}: {name} is {got:#x}, not {level:#x}"
