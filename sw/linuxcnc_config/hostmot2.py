# SPDX-License-Identifier: Apache-2.0
"""A simulated card with HostMot2, and a machine at it: what LinuxCNC's own drivers hostmot2 and
hm2_eth find behind an Ethernet cable. It has step generators, encoder counters and digital pins
(twin/machines/step_card.h), and answers the packets of its protocol, LBP16.

In lockstep: each packet that reads the counters lets a servo period of the machine's time pass, as
soon as the driver has written rates for the first time. The counters are read at the end of the
period and the new rates hold from then on: the card and its cable cost no time, and there is no
jitter.
"""

import ctypes
import os
import select
import struct
import subprocess
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Self

import numpy

from linuxcnc_config.generate import Configuration, rendered
from linuxcnc_config.programs import REST, Points
from linuxcnc_config.twin_machine import PARTS, Plant
from moire.errors import MoireError
from twin import Machine
from twin.devices.tap import open_tap
from twin.machines.machine import StepCard

CLOCK_HZ = 100_000_000  # of step generators and counters
PULSE_S = 2e-6  # and its pause, and a new direction before the next pulse
PERIOD_S = 1e-3  # of the servo thread
TIMESTAMP_HZ = 2_000_000  # until the driver sets another divisor

# the register map, byte addresses
COOKIE, CONFIGURATION, IDROM_AT, IDROM = 0x0100, 0x0104, 0x010C, 0x0400
MODULES, PINS = 0x40, 0x200  # from the beginning of the IDROM
IO_DATA, IO_DIRECTION = 0x1000, 0x1100
STEP_RATE, STEP_ACCUMULATOR = 0x2000, 0x2100
COUNTER, COUNTER_CONTROL, STAMP_DIVISOR, STAMP_COUNT = 0x3000, 0x3100, 0x3200, 0x3300
LATCH_ON_INDEX = 1 << 4
TAG_IO, TAG_COUNTER, TAG_STEPS = 3, 4, 5
OUTPUT = 0x80  # of a pin of a module
PORTS, PORT_PINS = 2, 17
MOST_AXES = 3  # for the pins of this card
ENABLE_PIN = 6  # digital pin that enables the driver of the first axis; the others follow

# LBP16: a command word, an address, and the data of a write
WRITE, WITH_ADDRESS, INCREMENT, COUNT = 0x8000, 0x4000, 0x0080, 0x007F
SPACE_REGISTERS, SPACE_EEPROM, SPACE_TIMER, SPACE_STATUS, SPACE_BOARD = 0, 2, 4, 6, 7
SPACE_BYTES = 0x80  # of a space that is no register map
RECEIVED = 0x0A  # count of packets in SPACE_STATUS

# the cable: a TAP device in a network namespace of its own
DEVICE, HOST, CARD = "mesa0", "192.168.1.1", "192.168.1.121"
CARD_MAC = bytes.fromhex("020000000121")
CLONE_NEWNET = 0x40000000
ETHERNET, IP, UDP = struct.Struct("!6s6sH"), struct.Struct("!BBHHHBBH4s4s"), struct.Struct("!HHHH")
TYPE_IP, PROTOCOL_UDP, LONGEST = 0x0800, 17, 2048
POLL_S = 0.1


class Card:
    """The registers of the card, with a machine at each axis."""

    def __init__(self, machines: Sequence[Machine]) -> None:
        if len(machines) > MOST_AXES:
            raise ValueError(f"{len(machines)} axes: the card has pins for {MOST_AXES}")
        self.machines = machines
        self.axes = [StepCard(high=round(PULSE_S * CLOCK_HZ)) for _ in machines]
        self.registers: dict[int, int] = {}  # what was written, and the constants
        self.spaces = {
            space: bytearray(SPACE_BYTES)
            for space in (SPACE_EEPROM, SPACE_TIMER, SPACE_STATUS, SPACE_BOARD)
        }
        self.spaces[SPACE_BOARD][:16] = b"7I92".ljust(16, b"\0")
        self.spaces[SPACE_EEPROM][2:8] = CARD_MAC[::-1]
        self.describe()
        self.passed: Callable[[], None] = lambda: None  # called after each part of a period
        self.cycles = 0

    def describe(self) -> None:
        """The IDROM: which modules there are, and which pin belongs to which."""
        texts = (b"HOSTMOT2", b"MESA7I92")
        names = [struct.unpack("<II", text) for text in texts]
        self.fill(COOKIE, [0x55AACAFE, *names[0], IDROM])
        pins = PORTS * PORT_PINS
        strides = [4, 0x40, 0x100, 4]
        head = [2, MODULES, PINS, *names[1], 9, 144, PORTS, pins, PORT_PINS]
        self.fill(IDROM, [*head, CLOCK_HZ, 2 * CLOCK_HZ, *strides])
        axes, modules = len(self.axes), IDROM + MODULES
        for tag, version, count, base, registers, multiple in (
            (TAG_IO, 0, PORTS, IO_DATA, 5, 0x1F),
            (TAG_COUNTER, 2, axes, COUNTER, 5, 0x03),
            (TAG_STEPS, 2, axes, STEP_RATE, 10, 0x1FF),
        ):
            word = tag | version << 8 | 1 << 16 | count << 24
            self.fill(modules, [word, base | registers << 16, multiple])
            modules += 12
        self.fill(modules, [0])
        named: dict[int, tuple[int, int, int]] = {}
        for n in range(axes):
            named |= {2 * n + pin: (OUTPUT | 1 + pin, TAG_STEPS, n) for pin in range(2)}
            named |= {PORT_PINS + 3 * n + pin: (1 + pin, TAG_COUNTER, n) for pin in range(3)}
        for n in range(pins):
            pin, tag, unit = named.get(n, (0, 0, 0))
            self.fill(IDROM + PINS + 4 * n, [pin | tag << 8 | unit << 16 | TAG_IO << 24])

    def fill(self, address: int, words: Sequence[int]) -> None:
        """Words of the register map, from an address on."""
        for n, word in enumerate(words):
            self.registers[address + 4 * n] = word

    @property
    def stamp_cycles(self) -> int:
        """Cycles of a unit of the time stamps."""
        return self.registers.get(STAMP_DIVISOR, CLOCK_HZ // TIMESTAMP_HZ - 2) + 2

    def stamp(self, cycle: int) -> int:
        return cycle // self.stamp_cycles & 0xFFFF

    def read(self, address: int) -> int:
        """A register of 32 bits."""
        base, number = address & ~0xFF, (address & 0xFF) // 4
        if base == STAMP_COUNT:
            return self.stamp(self.cycles)
        if number < len(self.axes):
            axis = self.axes[number]
            if base == STEP_ACCUMULATOR:
                return axis.accumulator >> 16 & 0xFFFFFFFF
            if base == COUNTER:
                return axis.count & 0xFFFF | self.stamp(axis.changed_at) << 16
            if base == COUNTER_CONTROL:
                armed = self.registers.get(address, 0) & 0xFFFF & ~LATCH_ON_INDEX
                return armed | LATCH_ON_INDEX * axis.armed | (axis.latched & 0xFFFF) << 16
        return self.registers.get(address, 0)

    def write(self, address: int, word: int) -> None:
        """A register of 32 bits."""
        self.registers[address] = word
        base, number = address & ~0xFF, (address & 0xFF) // 4
        if base in (IO_DATA, IO_DIRECTION):
            high = self.registers.get(IO_DATA, 0) & self.registers.get(IO_DIRECTION, 0)
            for n, axis in enumerate(self.axes):
                axis.enabled = high >> ENABLE_PIN + n & 1
        elif base == STEP_RATE and number < len(self.axes):
            self.axes[number].rate = word
        elif base == COUNTER_CONTROL and number < len(self.axes):
            self.axes[number].armed = bool(word & LATCH_ON_INDEX)

    def period(self) -> None:
        """A servo period passes."""
        for _ in range(PARTS):
            for axis, machine in zip(self.axes, self.machines):
                machine.with_card(PERIOD_S / PARTS, axis)
            self.passed()
        self.cycles += round(PERIOD_S * CLOCK_HZ)

    def answer(self, packet: bytes) -> bytes:
        """Obeys the commands of a packet; the answers to its reads, nothing if it has none."""
        count = struct.unpack_from("<H", self.spaces[SPACE_STATUS], RECEIVED)[0] + 1
        struct.pack_into("<H", self.spaces[SPACE_STATUS], RECEIVED, count & 0xFFFF)
        answers, at = b"", 0
        while at + 4 <= len(packet):
            command, address = struct.unpack_from("<HH", packet, at)
            if not command & WITH_ADDRESS:
                raise MoireError(f"the card does not know the command {command:#06x}")
            at += 4
            space, size, number = command >> 10 & 7, 1 << (command >> 8 & 3), command & COUNT
            step = size if command & INCREMENT else 0
            reads = space == SPACE_REGISTERS and not command & WRITE
            if reads and address == STAMP_COUNT and STEP_RATE in self.registers:
                self.period()
            for n in range(number):
                place = address + n * step
                if command & WRITE:
                    self.write_space(space, place, packet[at : at + size])
                    at += size
                else:
                    answers += self.read_space(space, place, size)
        return answers

    def read_space(self, space: int, address: int, size: int) -> bytes:
        if space == SPACE_REGISTERS:
            return struct.pack("<I", self.read(address))
        return bytes(self.spaces[space][address : address + size])

    def write_space(self, space: int, address: int, data: bytes) -> None:
        if space == SPACE_REGISTERS:
            self.write(address, int.from_bytes(data, "little"))
        else:
            self.spaces[space][address : address + len(data)] = data


def checksum(header: bytes) -> int:
    """Of an IP header without one."""
    total: int = sum(struct.unpack(f"!{len(header) // 2}H", header))
    total = (total & 0xFFFF) + (total >> 16)
    return ~((total & 0xFFFF) + (total >> 16)) & 0xFFFF


def reply_frame(frame: bytes, answer: Callable[[bytes], bytes]) -> bytes:
    """The Ethernet frame that answers one with a UDP packet; nothing if there is no answer."""
    if len(frame) < ETHERNET.size + IP.size + UDP.size:
        return b""
    _, sender, kind = ETHERNET.unpack_from(frame)
    header = IP.unpack_from(frame, ETHERNET.size)
    if kind != TYPE_IP or header[0] != 0x45 or header[6] != PROTOCOL_UDP:
        return b""
    start = ETHERNET.size + IP.size
    source, target, length, _ = UDP.unpack_from(frame, start)
    data = answer(frame[start + UDP.size : start + length])
    if not data:
        return b""
    whole = IP.size + UDP.size + len(data)
    words = [0x45, 0, whole, 0, 0, 64, PROTOCOL_UDP, 0, header[9], header[8]]
    words[7] = checksum(IP.pack(*words))
    udp = UDP.pack(target, source, UDP.size + len(data), 0)
    return ETHERNET.pack(sender, CARD_MAC, TYPE_IP) + IP.pack(*words) + udp + data


class Cable:
    """Answers the frames at a TAP device, in a network namespace of its own, from a thread."""

    def __init__(self, answer: Callable[[bytes], bytes]) -> None:
        self.answer, self.stopped = answer, threading.Event()
        self.ready, self.place, self.failed = threading.Event(), "", ""
        self.thread = threading.Thread(target=self.serve, daemon=True)

    def __enter__(self) -> Self:
        self.thread.start()
        self.ready.wait()
        if self.failed:
            raise MoireError(self.failed)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stopped.set()
        self.thread.join()

    def plug(self) -> int:
        """The TAP device, in a namespace of this thread."""
        if ctypes.CDLL(None, use_errno=True).unshare(CLONE_NEWNET):
            raise OSError(ctypes.get_errno(), "no network namespace")
        frames = open_tap(DEVICE)
        for words in (
            ("address", "add", f"{HOST}/24", "dev", DEVICE),
            ("link", "set", DEVICE, "up"),
            ("link", "set", "lo", "up"),
            ("neighbour", "replace", CARD, "lladdr", CARD_MAC.hex(":"), "dev", DEVICE),
        ):
            subprocess.run(["ip", *words], check=True)
        return frames

    def serve(self) -> None:
        """Until the context ends."""
        try:
            frames = self.plug()
        except (OSError, subprocess.CalledProcessError) as error:
            self.failed = f"this computer gives no network of its own: {error}"
            self.ready.set()
            return
        self.place = f"/proc/{os.getpid()}/task/{threading.get_native_id()}/ns/net"
        self.ready.set()
        while not self.stopped.is_set():
            if select.select([frames], [], [], POLL_S)[0]:
                reply = reply_frame(os.read(frames, LONGEST), self.answer)
                if reply:
                    os.write(frames, reply)
        os.close(frames)

    @property
    def within(self) -> list[str]:
        """The words that run a command in this namespace."""
        return ["nsenter", f"--net={self.place}"]


@dataclass(frozen=True)
class Gains:
    """Of LinuxCNC's pid of each axis; positions in mm, velocities in mm/s."""

    p: float  # 1/s
    i: float  # 1/s2
    d: float = 0.0
    ff1: float = 1.0
    ff2: float = 0.0  # s
    deadband_um: float = 0.0

    def pins(self, axis: str) -> Mapping[str, float]:
        """{pin: value} of the pid of an axis."""
        values = {
            "Pgain": self.p,
            "Igain": self.i,
            "Dgain": self.d,
            "FF1": self.ff1,
            "FF2": self.ff2,
            "deadband": self.deadband_um * 1e-3,
        }
        return {f"pid.{axis}.{name}": value for name, value in values.items()}


class Hostmot2Machine:
    """The machine of a plant at a card, driven by step and direction; LinuxCNC closes the loop over
    the scales.
    """

    LATCH_MM_S = -2.0  # to the index, from above

    def __init__(self, plant: Plant, gains: Gains, seed: int = 1) -> None:
        self.plant, self.gains = plant, gains
        self.axes = len(plant.configuration.axes)
        kind, values = plant.axis.machine, plant.axis.parameters
        self.machines = [
            Machine(kind, seed=seed + n, clk_hz=CLOCK_HZ, **values) for n in range(self.axes)
        ]
        self.path: list[tuple[float, ...]] = []  # mm of each axis at each part
        self.card = Card(self.machines)
        self.card.passed = self.record
        self.cable = Cable(self.card.answer)

    def record(self) -> None:
        self.path.append(tuple(one.state.position_m * 1e3 for one in self.machines))

    def configuration(self) -> Configuration:
        """That of LinuxCNC, whose axes home at the same time."""
        axes = [
            replace(axis, following=1.0, sequence=0, latch=self.LATCH_MM_S)
            for axis in self.plant.configuration.axes
        ]
        return replace(self.plant.configuration, period_ns=round(PERIOD_S * 1e9), axes=axes)

    def hal(self) -> str:
        """The HAL file in place of the one for a node."""
        found = self.configuration()
        step_um = 1000 * self.step_mm
        values = {
            "card": CARD,
            "axes": found.axes,
            "gains": [self.gains.pins(axis.name) for axis in found.axes],
            "steps_per_mm": 1000 / step_um,
            "pulse_ns": round(PULSE_S * 1e9),
            "enable_pin": ENABLE_PIN,
            "counts_per_period": 4,
        }
        return rendered("hostmot2.hal", values)

    @property
    def step_mm(self) -> float:
        """A microstep."""
        machine = self.machines[0]
        turn = machine.get("stepper_full_steps") * machine.get("stepper_microsteps")
        return machine.get("screw_lead") * 1e3 / turn

    def true_path(self) -> Points:
        """Rows of X, Y, Z in mm, true positions of the tables, from the zeros, after the end of
        LinuxCNC. A count is an interval: its middle is the position.
        """
        for axis in self.card.axes:
            axis.rate = 0
        for _ in range(2 * REST // PARTS):
            self.card.period()
        found: Points = numpy.array(self.path)
        for n, (axis, machine) in enumerate(zip(self.card.axes, self.machines)):
            if axis.errors or machine.state.step_timing_errors or machine.state.lost_steps:
                raise MoireError(f"axis {n}: lost counts or steps, or pulses too short")
            shift = machine.state.scale_counts - axis.count
            count_mm = machine.get("scale_count") * 1e3
            found[:, n] -= (axis.latched + shift + 0.5) * count_mm
        return found

    def __enter__(self) -> Self:
        self.cable.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.cable.__exit__(kind, error, trace)
