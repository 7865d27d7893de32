# SPDX-License-Identifier: Apache-2.0
"""A node with everything that can be built, in a bench: registers by name, pins by name.

Its axes differ: axis 0 has an interpolation chain of its own and a queue of captures, axis 1 uses
the chain that axes can share, and captures the index alone. Axis 2 only counts, without a drive.
"""

from moire.bus.protocol import NINTH, TO_NODE, command_byte, frame, sync_words
from moire.made.registers import FIELDS
from mutation.library import MAILBOX, PROGRAM, Bench, library
from tb.wiring.devices import Devices

CLK_HZ = 6_200_000  # for three axes with filters
TICK = 1550  # cycles, 4000 Hz
COUNT = 1 << 14  # of a position, in 2^-16 period
PARAMETERS = {
    "AXES": 3,
    "CLK_HZ": CLK_HZ,
    "SEGMENTS": 255,
    "HAS_SEGMENTS": 3,
    "HAS_SINE": 3,
    "HAS_OWN_CHAIN": 1,
    "HAS_CAPTURE": 1,
    "HAS_COMPARE": 3,
    "HAS_ENCODER_CHECK": 3,
    "HAS_VELOCITY": 3,
    "HAS_DRIVE": 3,
    "HAS_I2C": 1,
    "HAS_PS2": 1,
    "HAS_PEER": 1,
    "HAS_ANGLE_SENSOR": 1,
    "HAS_DISPLAY": 1,
    "HAS_STATUS_INPUTS": 1,
    "HAS_LINK": 1,
    "LINK_PLL": 1,
    "SCOPE_WORDS": 256,
    "HAS_SET_POINTS": 3,
    "HAS_BACKLASH": 3,
    "MEMORY_BYTES": 4096,
    "CODE_BYTES": 8192,
    "FIRMWARE": '""',
}
TOP = "node"
IDLE = dict(
    rs485_rx=1,
    drive_fault_n=7,
    peer_rx=1,
    sensor_rx=1,
    link_rx=1,
    link_cs_n=1,
    i2c_scl=1,
    i2c_sda=1,
    keyboard_clock=1,
    keyboard_data=1,
    edm_clock=1,
    edm_data=1,
)
REGISTERS = {}
for _field in FIELDS:
    REGISTERS.setdefault((_field.block, _field.register), []).append(_field)
GRAY = (0b00, 0b01, 0b11, 0b10)  # {b, a} of a scale that moves up
BIT = 16  # cycles of a bit of the bus in these tests


class Node(Devices, Bench):
    """The node after its reset."""

    def __init__(self, path=None, mutant=(0, 0, 0)):
        super().__init__(path or library(TOP, PARAMETERS), mutant)
        self.counts = [0, 0, 0]
        self.connect(CLK_HZ)
        self.load([*PROGRAM, *[0] * (MAILBOX + 4 - len(PROGRAM))])
        self.set(address=5, **IDLE)
        self.reset()

    def reset(self):
        """A reset, and the cycles in which it has ended everywhere."""
        self.set(rst=1)
        self.run(16)
        self.set(rst=0)
        self.run(40)

    def reset_with_low(self, pin):
        """A reset during which a serial input is low; it stays low for more than a character."""
        self.set(**{pin: 0})
        self.reset()
        self.run(2000)
        self.set(**{pin: 1})

    # ---- registers

    @staticmethod
    def word(register, /, **fields):
        """The word of a register with these fields, others 0."""
        value = 0
        for name, number in fields.items():
            field = next(f for f in REGISTERS[tuple(register.split("."))] if f.field == name)
            value |= (number & (1 << field.width) - 1) << field.low
        return value

    def write(self, register, value=None, /, axis=0, **fields):
        """Write a register, `block.name`: its value, or the values of its fields, others 0."""
        known = REGISTERS[tuple(register.split("."))]
        if value is None:
            value = self.word(register, **fields)
        address = known[0].address(axis)
        self.access(address, value & 0xFFFFFFFF)
        if known[0].width > 32:
            self.access(address + 4, value >> 32 & 0xFFFFFFFF)

    def read(self, register, field="value", axis=0):
        """A field of a register."""
        known = REGISTERS[tuple(register.split("."))]
        found = next(f for f in known if f.field == field)
        word = self.access(found.address(axis))
        if found.width > 32:
            word |= self.access(found.address(axis) + 4) << 32
        return found.value(word)

    def fields(self, register, axis=0):
        """All fields of a register, {name: value}."""
        known = REGISTERS[tuple(register.split("."))]
        word = self.access(known[0].address(axis))
        return {f.field: f.value(word) for f in known}

    def bits(self, register, axis=0):
        """The names of the bits that are set."""
        return {name for name, value in self.fields(register, axis).items() if value}

    # ---- pins

    def count(self, axis, steps, cycles=12):
        """Move the scale of an axis by so many counts, one in so many cycles."""
        for _ in range(abs(steps)):
            self.counts[axis] += 1 if steps > 0 else -1
            level = GRAY[self.counts[axis] % 4]
            self.set_bit("encoder_a", axis, level & 1)
            self.set_bit("encoder_b", axis, level >> 1)
            self.run(cycles)

    def pulse(self, pin, bit=0, cycles=20, idle=0):
        """A pulse on an input, and as long after it."""
        self.set_bit(pin, bit, 1 - idle)
        self.run(cycles)
        self.set_bit(pin, bit, idle)
        self.run(cycles)

    def levels(self, *names):
        """Levels of some pins."""
        return tuple(self.get(name) for name in names)

    # ---- serial lines

    def character(self, pin, data, ninth=None, stop=1, bit=BIT):
        """A character on a serial input; with a ninth bit for the bus."""
        bits = [0, *(data >> n & 1 for n in range(8)), *([] if ninth is None else [ninth]), stop]
        for level in bits:
            self.set(**{pin: level})
            self.run(bit)
        self.set(**{pin: 1})

    def send_words(self, words):
        """Words on the bus, bit 8 the ninth bit, with an idle line before and after them."""
        self.run(3 * BIT)
        for word in words:
            self.character("rs485_rx", word & 0xFF, word >> 8)
        self.run(3 * BIT)

    def send_frame(self, body=b"\x01\x02\x03", address=5, spoil=0):
        """A frame to a node."""
        first = command_byte(address, TO_NODE)
        words = [first | NINTH, *frame(first, body)]
        words[-1] ^= spoil
        self.send_words(words)

    def send_sync(self):
        """The sync pulse of the bus."""
        self.send_words(sync_words(1))

    def watch_words(self, *pins):
        """Watch the pins of a serial output from their levels now on."""
        self.last = {name: self.get(name) for name in pins}
        self.watch(*pins)

    def characters(self, pin, changes, bit=BIT, bits=10, idle=1):
        """The characters, without start and stop bits, in the changes of a serial output."""
        level, found, edges = idle, [], [c for c in changes if c.pin == pin]
        at = 0  # first cycle in which a start bit may begin
        for change in edges:
            if change.cycle < at or change.value:
                continue
            word = 0
            for n in range(1, bits - 1):
                middle = change.cycle + n * bit + bit // 2
                level = [c.value for c in edges if c.cycle <= middle][-1]
                word |= level << n - 1
            found.append(word)
            at = change.cycle + (bits - 1) * bit + bit // 2
        return found

    def crash(self):
        """Stop the soft core by an illegal instruction in its loop."""
        self.load([*PROGRAM[:3], 0, *PROGRAM[4:]])

    # ---- what most tests begin with

    def start(self, counts=True):
        """Ticks, samples, and scales that count."""
        self.write("node.tick_period", TICK)
        self.write("node.sample_period", 40)
        self.write("bus.watchdog_time", 0)
        self.write("axis.sensing", deglitch=2, axis=2)
        for axis in (0, 1):
            self.write("axis.sensing", deglitch=2, axis=axis)
            self.write("axis.disagreement_limit", 0, axis=axis)
            if counts:
                self.write("feedback.position_source", counts=1, axis=axis)
            self.write("axis.output_limit", 0x7FFF, axis=axis)
            self.write("actuator.pwm_period", 200, axis=axis)
            self.write("actuator.dac", half_period=1, refresh=500, axis=axis)
            self.write("actuator.step_pulse", high=10, low=10, axis=axis)
            self.write("actuator.step_direction", setup=10, hold=10, axis=axis)
        self.run(2 * TICK)
        for axis in (0, 1):  # the emergency stop counts as pressed during the reset
            self.reset_faults(axis)
        return self

    def enable(self, axis, **control):
        """Request the drive of an axis."""
        self.write("axis.control", enable=3, axis=axis, **control)
        self.run(4)

    def reset_faults(self, axis):
        """As a person does: enable off, then the reset."""
        self.write("axis.control", 0, axis=axis)
        self.write("axis.strobes", reset_faults=1, axis=axis)
        self.run(4)

    def segment(self, axis, velocity, ticks, last=True, acceleration=0, jerk=0):
        """Queue a segment: velocity in 2^-16 period per tick."""
        self.write("axis.segment_velocity", velocity << 24, axis=axis)
        self.write("axis.segment_acceleration", acceleration, axis=axis)
        self.write("axis.segment_jerk", jerk, axis=axis)
        self.write("axis.segment_ticks", axis=axis, value=ticks, last=int(last))

    def ticks(self, number):
        """So many servo ticks."""
        self.run(number * TICK)
