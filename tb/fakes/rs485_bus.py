# SPDX-License-Identifier: Apache-2.0
"""An RS-485 bus of words, with the compiled firmware of its nodes at the other end.

The port of a node is rtl/rs485_port.sv word by word: its address filter, frame check and watchdog
are the models that are compared with the RTL in every cycle. Time passes only on the bus.
"""

import random
from functools import reduce
from itertools import zip_longest
from operator import and_

from moire.bus.transport import BAUD, Transport
from moire.made.bus_tables import OPERATIONS
from tb.interlock.heartbeat_watchdog import HeartbeatWatchdog
from tb.serial.address_filter import AddressFilter
from tb.serial.frame_check import FrameCheck
from twin.compiled.node import fields
from twin.compiled.tables import CLK_HZ, DEFINES, FAULT, TABLE

SILENT = 0x1FF  # what a node that does not drive the bus adds to it
CLOCKS_DIFFER = 0.04  # the largest difference of two baud rates at which words arrive
NAME = {operation.code: name for name, operation in OPERATIONS.items()}


def register(name):
    """The address of a register of the bus port."""
    return DEFINES["BUS_BASE"] + DEFINES[f"BUS_{name}"]


class Rs485Port:
    """The port of a node to the bus. `requests` has the name and the fields of each request that
    the firmware has executed; on_request(name, fields) is called before it gets the request.
    """

    def __init__(self, node):
        self.node = node
        self.filter, self.check = AddressFilter(), FrameCheck()
        self.watchdog, self.kick = HeartbeatWatchdog(1000), 0  # steps of a millisecond
        self.requests, self.frame = [], b""
        self.on_request = lambda name, fields: None

    @property
    def executed(self):
        """The names of the requests."""
        return [name for name, _ in self.requests]

    def count(self, name, more=1):
        """Add to a counter of events."""
        self.node.word[register(name)] = self.node.word.get(register(name), 0) + more

    def hears(self, baud):
        """Whether words of this baud rate are received."""
        bit_time = self.node.word.get(register("BIT_TIME"), 0)
        return abs(bit_time * baud / (16 * CLK_HZ) - 1) <= CLOCKS_DIFFER

    def receive(self, word):
        """The words with which the node answers this one."""
        data, command = word & 0xFF, word >> 8
        own = self.filter.step(self.node.address, 1, data, command)
        passed, good, bad, sync = self.check.word(own, data, command)
        self.count("FRAMES_BAD", bad)
        if not passed:
            return []
        self.frame = bytes([data]) if command else self.frame + bytes([data])
        if good:
            self.kick = 1
            self.count("FRAMES_GOOD")
        if sync:
            self.node.sync()
        request = good and not sync and request_of(self.frame)
        if request:
            self.on_request(*request)
        self.node.received.append(
            data
            | DEFINES["BUS_RECEIVE_COMMAND_MASK"] * command
            | DEFINES["BUS_RECEIVE_GOOD_MASK"] * good
        )
        self.node.sent.clear()
        self.node.crc_bytes = None  # stays so unless the firmware makes a reply
        self.node.poll()
        if request and self.node.crc_bytes is not None:
            self.requests.append(request)
        return [sent & 0xFF for sent in self.node.sent]

    def line_break(self):
        """The bus was low for longer than a character."""
        self.count("BREAKS")
        self.count("FRAMING_ERRORS")
        self.count("FRAMES_BAD", self.check.step(0, 0, 0, 1)[3])

    def millisecond(self):
        """A millisecond passes for the node, its firmware and the watchdog of the bus."""
        self.node.run(1)
        expired = self.watchdog.clk(
            time_ms=self.node.word.get(register("WATCHDOG_TIME"), 0),
            kick=self.kick,
            armed=any(axis.enabled for axis in self.node.axes),
        )
        self.kick = 0
        for axis in self.node.axes:
            axis.causes = axis.causes & ~FAULT["bus_watchdog"] | FAULT["bus_watchdog"] * expired


def request_of(frame):
    """Name and fields of the request in a good frame; its code, without fields, if it is none."""
    code, inside = frame[3] if len(frame) > 7 else None, frame[4:-4]
    try:
        return NAME[code], fields(TABLE["operation"][NAME[code]]["request"], inside)
    except (KeyError, AssertionError):
        return code, {}


def port_of(node):
    """The port of a node, which it gets when it is put on a bus for the first time."""
    if not hasattr(node, "port"):
        node.port = Rs485Port(node)
    return node.port


class Rs485Bus(Transport):
    """Nodes on one bus. `to_nodes` and `from_nodes` change a word into a list of words, and so may
    damage, lose or double it. `at` has (time in s, action) that happen at their times.
    """

    time_is_stopped = True

    def __init__(self, *nodes):
        self.nodes, self.arrived, self.at = nodes, [], []
        self.clock, self.ms = 0.0, 0
        self.to_nodes = self.from_nodes = lambda word: [word]
        self.baud, self.closed = BAUD, False

    @property
    def ports(self):
        return [port_of(node) for node in self.nodes]

    def pass_time(self, seconds):
        self.clock += seconds
        while self.ms + 1 <= self.clock * 1000:
            self.ms += 1
            for port in self.ports:
                port.millisecond()
            for due in [entry for entry in self.at if entry[0] * 1000 <= self.ms]:
                self.at.remove(due)
                due[1]()

    def send(self, words):
        for word in words:
            self.pass_time(self.character_s)
            for received in self.to_nodes(word):
                answers = [port.receive(received) for port in self.ports if port.hears(self.baud)]
                for driven in zip_longest(*answers, fillvalue=SILENT):
                    self.arrived += self.from_nodes(reduce(and_, driven))

    def receive(self, count, timeout_s):
        taken, self.arrived = self.arrived[:count], self.arrived[count:]
        self.pass_time(len(taken) * self.character_s if len(taken) == count else timeout_s)
        return taken

    def now(self):
        return self.clock

    def wait(self, seconds):
        self.pass_time(seconds)

    def set_baud(self, baud):
        super().set_baud(baud)
        self.baud = baud

    def send_break(self):
        for port in self.ports:
            port.line_break()

    def close(self):
        self.closed = True


def spoil(source: random.Random, share: float):
    """Makes a function that loses, damages or doubles this share of the words."""

    def change(word):
        if source.random() >= share:
            return [word]
        return source.choice(
            [[], [word ^ 1 << source.randrange(9)], [word, word], [source.randrange(512)]]
        )

    return change
