# SPDX-License-Identifier: Apache-2.0
"""Nodes for an Rs485Bus: the compiled firmware, and what tests do to the registers around it."""

import zlib

from moire.bus.transport import BAUD
from moire.made.bus_tables import PARAMETERS
from tb.fakes.rs485_bus import Rs485Port, register
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import CAUSE, CLK_HZ, DEFINES, PERIOD, STATE, TABLE

START = 123456  # where an axis is at power-up, 2^-16 period
SWITCH = -10 * PERIOD  # where its switch at the low end closes
SAMPLE = -100 & 0xFFFF | 27 << 16  # sine and cosine, ADC counts
AMPLITUDE = 103  # of that sample, ADC counts


class BusNode(CompiledNode):
    """A node with axes as the S0 stage has them. Its drives follow at once, and sine and cosine
    always have one good sample.
    """

    def __init__(self, address=1, axes=1, **options):
        made = axes if isinstance(axes, list) else [Axis(START, SWITCH) for _ in range(axes)]
        for axis in made:
            axis.word[DEFINES["AXIS_SAMPLE"]] = SAMPLE
            axis.word[DEFINES["AXIS_PHASE"]] = AMPLITUDE << DEFINES["AXIS_PHASE_AMPLITUDE_SHIFT"]
        super().__init__(*made, address=address, **options)
        self.port = Rs485Port(self)

    @property
    def executed(self):
        """The names of the requests that came over the bus and were executed."""
        return self.port.executed

    def written(self, operation):
        """The fields of these requests of one operation."""
        return [fields for name, fields in self.port.requests if name == operation]

    @property
    def counters(self):
        """The counters that the node reports."""
        return self.ask("counters")

    def parameter(self, name, axis=0):
        """A parameter as the firmware has it, in its LSB."""
        return self.firmware.parameters_get(axis, PARAMETERS[name].id)

    def parameters(self, axis=0):
        """All parameters by their names, in their LSB."""
        return {name: self.parameter(name, axis) for name in PARAMETERS}

    def force(self, name, value, axis=0):
        """Give a parameter a value without any check."""
        self.firmware.parameters_set(axis, PARAMETERS[name].id, value)

    def state(self, axis=0):
        """The name of the state of an axis."""
        return STATE[self.firmware.axis_state(axis)]

    def ended(self, axis=0):
        """How the last motion of an axis ended."""
        return CAUSE[self.firmware.axis_ended(axis)]

    def homed(self, axis=0):
        """Whether an axis has its zero."""
        return bool(self.firmware.axis_homed(axis))

    def home(self, axis=0, on=False):
        """Home an axis where it is, which becomes its zero; its drive is `on` afterwards."""
        method = self.parameter("home_method", axis)
        self.set(axis, home_method=37)
        self.ask("enable", axis=axis, on=1)
        self.ask("home", axis=axis)
        assert self.run(1000, until=lambda: self.ended(axis) == "ok")
        self.set(axis, home_method=method)
        self.ask("enable", axis=axis, on=int(on))

    def feedback(self, name, axis=0):
        """A register of a feedback channel."""
        return self.feedback_channels[axis].word.get(DEFINES[f"FEEDBACK_{name}"], 0)

    def set_feedback(self, axis=0, **values):
        """Registers of a feedback channel by their names."""
        self.feedback_channels[axis].word.update(
            {DEFINES[f"FEEDBACK_{name}"]: value for name, value in values.items()}
        )

    def set_axis(self, axis=0, **values):
        """Registers of an axis by their names, those that nothing computes."""
        self.axes[axis].word.update(
            {DEFINES[f"AXIS_{name}"]: value & 0xFFFFFFFF for name, value in values.items()}
        )

    def set_actuator(self, axis=0, **values):
        """Registers of an actuator by their names."""
        self.actuators[axis].update(
            {DEFINES[f"ACTUATOR_{name}"]: value & 0xFFFFFFFF for name, value in values.items()}
        )

    def use_baud(self, baud):
        """Change the baud rate, as another host may have done it before."""
        self.ask("set_baud", baud=baud)
        self.poll()
        assert self.port.hears(baud)


class CannedNode:
    """In place of a firmware that nobody compiles: every request gets the body canned(body) as its
    reply.
    """

    axes = ()

    def __init__(self, canned, address=1):
        self.canned, self.address = canned, address
        self.word = {register("BIT_TIME"): 16 * CLK_HZ // BAUD}
        self.received, self.sent, self.crc_bytes = [], [], None
        self.body, self.reply = b"", bytes(3)

    def poll(self):
        """Take a word, and answer it as firmware does."""
        word = self.received.pop()
        if word & DEFINES["BUS_RECEIVE_COMMAND_MASK"]:
            self.body, answer = b"", bytes([0x40 | word & 0x3F])
            if word & 0x10:
                answer += bytes([len(self.reply)]) + self.reply
                answer += zlib.crc32(answer).to_bytes(4, "little")
            self.sent += answer
            return
        self.body += bytes([word & 0xFF])
        if word & DEFINES["BUS_RECEIVE_GOOD_MASK"]:
            self.reply = self.canned(self.body[1:-4])

    def run(self, ms):
        """Nothing changes in time."""


def other_protocol(protocol_crc):
    """A node that was made with another protocol table."""
    identity = {**BusNode().ask("identify"), "protocol_crc": protocol_crc}
    reply = b"".join(
        identity[name].to_bytes(int(kind[1:]) // 8, "little")
        for name, kind in (field.split() for field in TABLE["operation"]["identify"]["reply"])
    )
    return CannedNode(lambda body: body[:2] + bytes(1) + reply)
