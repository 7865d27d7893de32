# SPDX-License-Identifier: Apache-2.0
"""The peripherals of a node in a bench of their own, with a device at each pin."""

from moire.made.registers import FIELDS
from mutation.library import Bench, library
from tb.wiring.devices import Devices

TOP = "peripherals"
CLK_HZ = 2_000_000  # so that a pulse of one cycle is a glitch
MS = CLK_HZ // 1000
BIT = 16  # cycles, of both serial ports
PARAMETERS = {"CLK_HZ": CLK_HZ}
REGISTERS = {}
for _field in FIELDS:
    if _field.block == "peripherals":
        REGISTERS.setdefault(_field.register, {})[_field.field] = _field
LINES = ("i2c_scl", "i2c_sda", "keyboard_clock", "keyboard_data", "edm_clock", "edm_data")


class Peripherals(Devices, Bench):
    """The block after its reset."""

    def __init__(self, path=None, mutant=(0, 0, 0)):
        super().__init__(path or library(TOP, PARAMETERS), mutant)
        self.connect(CLK_HZ)
        self.set(**dict.fromkeys(LINES, 1))
        self.reset()
        self.run(10)
        self.write("peer_bit_time", value=16 * BIT)
        self.write("sensor_bit_time", value=16 * BIT)

    def reset(self, level=1):
        """A reset, with this level on both serial inputs."""
        self.set(rst=1, peer_rx=level, sensor_rx=level)
        self.run(4)
        self.set(rst=0)

    def until(self, condition, cycles=150 * MS):
        """Run until a condition holds."""
        for _ in range(cycles // 40):
            if condition():
                return
            self.clk(40)
        raise AssertionError("waited for nothing")

    def access(self, write, offset, value=0):
        self.set(select=1, write=write, word=offset // 4, wdata=value)
        self.clk()
        self.set(select=0, write=0)
        return self.get("rdata")

    def write(self, register, **values):
        fields = REGISTERS[register]
        word = sum(value << fields[name].low for name, value in values.items())
        self.access(1, next(iter(fields.values())).offset, word)

    def read(self, register):
        """The fields of a register by name; the value alone, if there is only one."""
        fields = REGISTERS[register]
        offset = next(iter(fields.values())).offset
        word = self.access(0, offset)
        if any(f.width > 32 for f in fields.values()):
            word |= self.access(0, offset + 4) << 32
        values = {name: f.value(word) for name, f in fields.items() if "r" in f.access}
        return values["value"] if list(values) == ["value"] else values

    def i2c(self, *commands, read=3):
        """Queue (command, data or acknowledge) and wait for their results: [(result, data)]."""
        for command, value in commands:
            named = {"acknowledge": value} if command == read else {"data": value}
            self.write("i2c", command=command, **named)
        self.until(lambda: not self.read("i2c_state")["busy"])
        answers = []
        for _ in range(200):
            if not (answer := self.read("i2c_answer"))["present"]:
                return answers
            answers.append((answer["result"], answer["data"]))
            self.clk(2)
        raise AssertionError("the queue of results does not become empty")

    def send(self, pin, data, stop=1, bit=BIT):
        """Characters on a serial input."""
        for byte in data:
            for level in (0, *(byte >> n & 1 for n in range(8)), stop):
                self.set(**{pin: level})
                self.clk(bit)
            self.set(**{pin: 1})
