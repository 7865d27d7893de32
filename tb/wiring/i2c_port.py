# SPDX-License-Identifier: Apache-2.0
"""The I2C port in a bench of its own, with a clock at which its filters have something to do, and
an EEPROM that stretches the clock of the bus.
"""

from mutation.library import Bench, library
from tb.peripheral.eeprom_24aa128 import Eeprom

TOP = "i2c_port"
CLK_HZ = 40_000_000
SPIKE = CLK_HZ // 20_000_000  # cycles that a level must last: 50 ns
BIT = CLK_HZ // 100_000  # cycles of a bit, about
STEP = 8  # cycles in which the EEPROM looks at the lines once
PARAMETERS = {"CLK_HZ": CLK_HZ}


class I2cPort(Bench):
    """The port before its reset, its lines high."""

    def __init__(self, path=None, mutant=(0, 0, 0)):
        super().__init__(path or library(TOP, PARAMETERS), mutant)
        self.eeprom = Eeprom(write_clk=20 * BIT // STEP, stretch=2 * BIT // STEP)
        self.set(scl_pin=1, sda_pin=1)

    def reset(self, cycles=20):
        """A reset, and so many cycles after it."""
        self.set(rst=1)
        self.run(4)
        self.set(rst=0)
        self.run(cycles)

    def clk(self, cycles):
        """So many cycles with the EEPROM on the bus."""
        for _ in range(-(-cycles // STEP)):
            self.run(STEP)
            scl = 1 - (self.get("scl_low") | int(self.eeprom.scl_low > 0))
            sda = 1 - (self.get("sda_low") | self.eeprom.sda_low)
            self.eeprom.step(scl, sda)
            self.set(scl_pin=scl, sda_pin=sda)

    def push(self, command, data=0, acknowledge=0):
        """Queue a command."""
        self.set(push=1, command=command, data=data, acknowledge=acknowledge)
        self.run(1)
        self.set(push=0, command=0, data=0, acknowledge=0)

    def state(self):
        """The outputs that say how it is."""
        names = ("free", "busy", "owned", "scl", "sda", "result_present")
        return {name: self.get(name) for name in names}

    def end(self, cycles=1000 * BIT):
        """Run until no command is in work."""
        for _ in range(cycles // BIT):
            if not self.get("busy"):
                return
            self.clk(BIT)
        raise AssertionError("the commands do not end")

    def results(self):
        """Take all results: [(result, data)]."""
        found = []
        while self.get("result_present"):
            found.append((self.get("result"), self.get("result_data")))
            self.set(result_pop=1)
            self.run(1)
            self.set(result_pop=0)
            self.run(1)
            assert len(found) <= 128, "the queue of results does not become empty"
        return found
