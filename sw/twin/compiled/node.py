# SPDX-License-Identifier: Apache-2.0
"""A node without hardware: the compiled firmware, and in place of its registers a bus, a clock and
simple axes in Python (axis.py).
"""

import re
import zlib
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol

from twin.compiled.axis import Axis
from twin.compiled.feedback_channel import FeedbackChannel
from twin.compiled.firmware import READ, WRITE, power_up
from twin.compiled.tables import (
    CAUSE,
    CLK_HZ,
    DEFINES,
    END_OF_MAP,
    FLAG,
    LOW_WORDS,
    PARAMETER,
    PERIOD,
    SOFTWARE,
    STATE,
    TABLE,
    signed,
)
from twin.compiled.tick_scope import TickScope


def fields(declarations: Iterable[str], data: bytes) -> dict[str, int]:
    """The numbers in data by the declarations "name u16" of bus.toml, little endian."""
    values, at = {}, 0
    for declaration in declarations:
        name, kind = declaration.split()
        size = int(kind[1:]) // 8
        values[name] = int.from_bytes(data[at : at + size], "little", signed=kind[0] == "i")
        at += size
    assert at == len(data)
    return values


class FlashPort(Protocol):
    """The port of a serial core to its flash, behind the register map."""

    def read(self, offset: int) -> int:
        """A word of the port."""

    def write(self, offset: int, value: int) -> None:
        """Write a word of the port."""


class Peripherals(Protocol):
    """The devices behind the registers of the block `peripherals`."""

    def read(self, offset: int) -> int:
        """A register of the block."""

    def write(self, offset: int, value: int) -> None:
        """Write a register of the block."""

    def millisecond(self, machine: "CompiledNode") -> None:
        """A millisecond of the node has passed."""


class CompiledNode:
    """The compiled firmware with its registers in Python; request() talks to it as a host does."""

    def __init__(
        self,
        *axes: Axis,
        map_crc: int = DEFINES["MAP_CRC"],
        address: int = 2,
        image: str = "axis",
        peripherals: Peripherals | None = None,
        absent: Sequence[str] = (),
        flash: FlashPort | None = None,
        scope_words: int = 0,
    ) -> None:
        """Power up. `absent` names what is not built, as in the register axis.built; a
        `map_crc` other than that of the firmware is a bitstream that does not fit it. A node with
        a `flash` has the serial core. `scope_words` is the memory of its recorder of ticks.
        """
        self.axes, self.address, self.map_crc, self.clk = (
            list(axes) or [Axis()],
            address,
            map_crc,
            0,
        )
        self.built = 2 << DEFINES["AXIS_BUILT_FILTERS_SHIFT"] | sum(
            mask
            for name, mask in DEFINES.items()
            if re.fullmatch(r"AXIS_BUILT_(?!FILTERS)\w+_MASK", name)
        )
        for name in absent:
            self.built &= ~DEFINES[f"AXIS_BUILT_{name.upper()}_MASK"]
        self.feedback_channels = [FeedbackChannel() for _ in self.axes]
        self.actuators: list[dict[int, int]] = [{} for _ in self.axes]  # words by their offset
        self.peripherals, self.flash, self.scope = peripherals, flash, TickScope(scope_words)
        self.received: deque[int] = deque()
        self.sent: list[int] = []
        self.word: dict[int, int] = {}
        self.low_word = 0  # the low word that was written last, of whichever register
        self.link: dict[int, int] = {}  # registers of the real-time link by their offsets
        self.crc_bytes = b""
        self.sequence = 0
        self.answers = (
            READ(self.read),
            WRITE(self.write),
        )  # kept alive as long as the firmware may call
        self.firmware = power_up(image, self, update=bool(flash))
        self.firmware.register_bridge(*self.answers)
        self.firmware.firmware_start()

    def read(self, offset: int) -> int:
        """A register, as the firmware reads it."""
        d = DEFINES
        if offset >= END_OF_MAP:
            return self.flash.read(offset - END_OF_MAP) if self.flash else 0
        if offset >= d["ACTUATOR_BASE"]:
            return self.actuators[(offset - d["ACTUATOR_BASE"]) // d["ACTUATOR_STRIDE"]].get(
                offset % d["ACTUATOR_STRIDE"], 0
            )
        if offset >= d["FEEDBACK_BASE"]:
            return self.feedback_channels[
                (offset - d["FEEDBACK_BASE"]) // d["FEEDBACK_STRIDE"]
            ].read(offset % d["FEEDBACK_STRIDE"])
        if offset >= d["AXIS_BASE"]:
            axis = (offset - d["AXIS_BASE"]) // d["AXIS_STRIDE"]
            if offset % d["AXIS_STRIDE"] == d["AXIS_BUILT"]:
                return self.built
            return self.axes[axis].read(offset % d["AXIS_STRIDE"])
        if offset >= d["LINK_BASE"]:
            return self.link.get(offset - d["LINK_BASE"], 0)
        if offset >= d["PERIPHERALS_BASE"]:
            return self.peripherals.read(offset - d["PERIPHERALS_BASE"]) if self.peripherals else 0
        if offset >= d["BUS_BASE"]:
            offset -= d["BUS_BASE"]
            if offset == d["BUS_RECEIVE"]:
                return (
                    self.received.popleft() | d["BUS_RECEIVE_PRESENT_MASK"] if self.received else 0
                )
            if offset == d["BUS_STATE"]:
                return 128
            if offset == d["BUS_CRC"]:
                return zlib.crc32(self.crc_bytes)
            return self.word.get(d["BUS_BASE"] + offset, 0)
        live = self.scope.read(offset)
        if live is not None:
            return live
        build = (
            len(self.axes)
            | self.address << 4
            | 64 << 8
            | self.scope.size // 256 << d["NODE_BUILD_SCOPE_SHIFT"]
        )
        return {
            d["NODE_MAP_CRC"]: self.map_crc,
            d["NODE_CLK_HZ"]: CLK_HZ,
            d["NODE_BUILD"]: build,
            d["NODE_TIME_STAMP_LOW"]: self.clk & 0xFFFFFFFF,
            d["NODE_TIME_STAMP_HIGH"]: self.clk >> 32,
        }.get(offset, self.word.get(offset, 0))

    def write(self, offset: int, value: int) -> None:
        """Write a register, as the firmware does. A low word waits for the next high one."""
        if offset in LOW_WORDS:
            self.low_word = value
            return
        if offset - 4 in LOW_WORDS:
            self.store(offset - 4, self.low_word)
        self.store(offset, value)

    def store(self, offset: int, value: int) -> None:
        """Write a word of a register."""
        d = DEFINES
        if offset >= END_OF_MAP:
            if self.flash:
                self.flash.write(offset - END_OF_MAP, value)
        elif offset >= d["ACTUATOR_BASE"]:
            self.actuators[(offset - d["ACTUATOR_BASE"]) // d["ACTUATOR_STRIDE"]][
                offset % d["ACTUATOR_STRIDE"]
            ] = value
        elif offset >= d["FEEDBACK_BASE"]:
            axis = (offset - d["FEEDBACK_BASE"]) // d["FEEDBACK_STRIDE"]
            offset %= d["FEEDBACK_STRIDE"]
            self.feedback_channels[axis].write(offset, value)
            if offset == d["FEEDBACK_ALIGN"]:
                self.axes[axis].origin += signed(value & 7, 3) * (PERIOD // 4)
            if offset == d["FEEDBACK_STROBES"] and value & d["FEEDBACK_STROBES_CAPTURE_NOW_MASK"]:
                self.feedback_channels[axis].capture(SOFTWARE, self.clk, self.axes[axis].position)
        elif offset >= d["AXIS_BASE"]:
            self.axes[(offset - d["AXIS_BASE"]) // d["AXIS_STRIDE"]].write(
                offset % d["AXIS_STRIDE"], value
            )
        elif offset >= d["LINK_BASE"]:
            self.link[offset - d["LINK_BASE"]] = value
        elif offset >= d["PERIPHERALS_BASE"]:
            if self.peripherals:
                self.peripherals.write(offset - d["PERIPHERALS_BASE"], value)
        elif offset == d["BUS_BASE"] + d["BUS_TRANSMIT"]:
            self.sent.append(value)
        elif offset == d["BUS_BASE"] + d["BUS_CRC_START"]:
            self.crc_bytes = b""
        elif offset == d["BUS_BASE"] + d["BUS_CRC_BYTE"]:
            self.crc_bytes += bytes([value])
        else:
            self.word[offset] = value
            self.scope.write(offset, value)
            if offset == d["NODE_START_AXES"]:
                self.start_axes(value)

    def start_axes(self, mask: int) -> None:
        """Start the segments that wait in the players of these axes (bit n: axis n)."""
        for n, axis in enumerate(self.axes):
            axis.player.moving |= bool(mask >> n & 1 and axis.player.queue)

    def sync(self) -> None:
        """The sync pulse of the bus: prepared axes start, positions are captured."""
        d = DEFINES
        self.word[d["BUS_BASE"] + d["BUS_SYNCS"]] = 1 + self.word.get(
            d["BUS_BASE"] + d["BUS_SYNCS"], 0
        )
        self.start_axes(self.word.get(d["BUS_BASE"] + d["BUS_SYNC_AXES"], 0))
        for axis, channel in zip(self.axes, self.feedback_channels, strict=True):
            channel.capture(SOFTWARE, self.clk, axis.position)

    def poll(self, times: int = 1) -> None:
        """Poll the firmware so often, without time passing."""
        for _ in range(times):
            self.firmware.firmware_poll()

    def run(self, ms: float, until: Callable[[], object] | None = None) -> bool:
        """Run for `ms`: a poll of the firmware each millisecond, after four servo ticks. Stops
        early and returns True once `until` is true.
        """
        for _ in range(int(ms)):
            for _ in range(4):
                for axis, channel in zip(self.axes, self.feedback_channels, strict=True):
                    axis.tick()
                    if axis.passed is not None:
                        channel.index(self.clk, axis.passed)
                self.scope.tick(self.axes)
            self.clk += CLK_HZ // 1000
            if self.peripherals:
                self.peripherals.millisecond(self)
            self.poll()
            if until and until():
                return True
        return False

    def receive(self, words: Sequence[int]) -> bytes:
        """Put words on the bus; returns what the node sends."""
        self.sent.clear()
        for n in range(0, len(words), 8):
            self.received.extend(words[n : n + 8])
            self.poll()
        return bytes(self.sent)

    def frame(self, body: bytes, command: int | None = None) -> list[int]:
        """The words of a good frame, as the hardware passes them to the firmware."""
        command = 0x20 | self.address if command is None else command
        payload = bytes([len(body)]) + body
        payload += zlib.crc32(bytes([command]) + payload).to_bytes(4, "little")
        words = [command | DEFINES["BUS_RECEIVE_COMMAND_MASK"], *payload]
        words[-1] |= DEFINES["BUS_RECEIVE_GOOD_MASK"]
        return words

    def send(self, body: bytes) -> None:
        """Send a request, which the node must acknowledge."""
        assert self.receive(self.frame(body)) == bytes([0x60 | self.address])

    def reply(self) -> bytes:
        """The body that the node sends when it is asked for its reply."""
        ready = 0x50 | self.address
        sent = self.receive([0x10 | self.address | DEFINES["BUS_RECEIVE_COMMAND_MASK"]])
        assert sent[0] == ready and len(sent) == sent[1] + 6
        assert zlib.crc32(sent[:-4]) == int.from_bytes(sent[-4:], "little")
        return sent[2:-4]

    def request(self, name: str, **values: int) -> tuple[str, dict[str, int]]:
        """Do an operation of bus.toml; returns its cause and, if ok, the fields of the reply."""
        operation = TABLE["operation"][name]
        self.sequence = (self.sequence + 1) % 256
        body = bytes([self.sequence, operation["code"]])
        for declaration in operation["request"]:
            field, kind = declaration.split()
            body += values.pop(field).to_bytes(int(kind[1:]) // 8, "little", signed=kind[0] == "i")
        assert not values
        self.send(body)
        answer = self.reply()
        assert answer[:2] == body[:2]
        cause = CAUSE[answer[2]]
        if cause != "ok":
            assert len(answer) == 3, "a refusal has no fields"
            return cause, {}
        return cause, fields(operation["reply"], answer[3:])

    def ask(self, name: str, **values: int) -> dict[str, int]:
        """The same; the cause must be ok. Returns the fields."""
        cause, answer = self.request(name, **values)
        assert cause == "ok", cause
        return answer

    def status(self, axis: int = 0) -> dict[str, Any]:
        """The reply to `status`, with the names of state, cause and flags."""
        answer = self.ask("status", axis=axis)
        return {
            **answer,
            "state": STATE[answer["state"]],
            "ended": CAUSE[answer["ended"]],
            "flags": {name for name, bit in FLAG.items() if answer["flags"] & bit},
        }

    def set(self, axis: int = 0, **values: int) -> None:
        """Set parameters of an axis by their names, in their LSB."""
        for name, value in values.items():
            self.ask("set_parameter", axis=axis, parameter=PARAMETER[name]["id"], value=value)
