# SPDX-License-Identifier: Apache-2.0
"""The system without hardware: nodes as they ship (RTL and firmware), a machine at each axis, a bus
with a host.

Time is simulated: it passes in run, run_until_words and nowhere else, and the same seed gives the
same run to the last bit. An axis is counted through all nodes: axis = index of the node * axes per
node + axis of the node.

    Twin(nodes=(1, 2))                                       two nodes of one axis each, each on a
                                                             stage of S0
    Twin([Node(1, [Axis("stepper_stage", {"scale_count": 1e-7})] * 3)])      one node with three
    axes of S2
    Twin([Node(1, [], Devices(eeprom=True, keypad=True, display=True, keyboard=True, edm=True,
    table=1)),
          Node(2, [Axis("worm_table")])], peers=(0, 1))               S4: two nodes, a serial line
                                                                      between them
"""

import ctypes
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy
import numpy.typing

from twin import build
from twin.devices.devices import Devices, DevicesHandle, PeerLineHandle
from twin.devices.devices import pack as pack_devices
from twin.machines.machine import MachineHandle, Trace, pack
from twin.nodes.library import array, library, memory_image

CLK_HZ = 2_400_000
START_S = 0.05  # until the soft core of a node with one axis listens, with a margin of 30 ms
DRIVES = ("HAS_BRIDGE", "HAS_STEPPER", "HAS_DAC", "HAS_FINE_STAGE")  # of rtl/node.sv
ALL_AXES = 255  # a mask of axes of rtl/node.sv: bit n is axis n
PERIPHERALS = (  # in the order of the register peripherals.built
    "HAS_I2C",
    "HAS_PS2",
    "HAS_PEER",
    "HAS_ANGLE_SENSOR",
    "HAS_DISPLAY",
    "HAS_STATUS_INPUTS",
)


def drives(*built: str) -> dict[str, int]:
    """Parameters of rtl/node.sv that build these drives of each axis and no other."""
    return {name: ALL_AXES * (name in built) for name in DRIVES}


NODE = {**drives("HAS_BRIDGE"), "FILTERS": 0}  # what the stage of S0 needs of rtl/node.sv
WITH_SEGMENTS = {
    **NODE,
    "SEGMENTS": 255,
}  # and with its segment table, which takes a fifteenth of the speed
WITH_SCOPE = {**WITH_SEGMENTS, "FILTERS": 2, "SCOPE_WORDS": 16384}  # and with all to tune its servo
BAUD = 115200
CELLS = 11  # of a character: start, eight data, 9th, stop
PEER_BAUD = 9600  # between nodes
LINK_BIT_CYCLES = 5  # of the real-time link: 12 Mbaud at 60 MHz
ALL_PERIPHERALS = dict.fromkeys(PERIPHERALS, 1)
CUTS = {"none": 0, "idle": 1, "break": 2}


@dataclass(frozen=True)
class Axis:
    """A machine by the name of its parameters/<machine>.toml; `parameters` override that table."""

    machine: str = "stage"
    parameters: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Node:
    """A node by its address on the bus, with a machine at each of its axes, and its devices."""

    address: int
    axes: list[Axis] = field(default_factory=lambda: [Axis()])
    devices: Devices | None = None


@dataclass(frozen=True)
class Register:
    """A register of a node, a flip-flop or more, or a memory."""

    number: int  # in the library
    name: str  # the path of its instance and its own name, with dots, from the node downwards
    bits: int  # of a word
    words: int  # 1 unless it is a memory


@dataclass(frozen=True)
class BusState:
    """The RS-485 bus now."""

    level: bool  # at the nodes
    host_drives: bool
    nodes_drive: int  # bit mask over the nodes
    collisions: int  # times that two drove at once
    framing_errors: int  # of the host's receiver
    start_glitches: int
    edges: int
    last_driven_s: float
    words_waiting: int


class LinkLine:
    """The host's end of the serial line of a real-time link: bytes, in the time of the machine."""

    def __init__(
        self, twin: "Twin", bit_cycles: int, to_node: PeerLineHandle, to_host: PeerLineHandle
    ) -> None:
        self.twin, self.to_node, self.to_host = twin, to_node, to_host
        self.bit_time = 16 * bit_cycles  # for the register link.bit_time, in 1/16 cycle

    def send(self, data: bytes) -> None:
        """Begins to send bytes to the node; no time passes."""
        self.to_node.put(data)

    def take(self) -> bytes:
        """The bytes that have come from the node since the last call; no time passes."""
        return self.to_host.take_received()

    def exchange(self, data: bytes, seconds: float) -> bytes:
        """Sends bytes, lets so much time pass, and returns what came from the node until then."""
        self.send(data)
        self.twin.run(seconds)
        return self.take()


class Twin:
    """Nodes, their machines and the bus between them and a host.

    `nodes` are Nodes, or addresses of nodes with `axes` stages each. All nodes are of one build; a
    node with fewer axes than another has unconnected ones. `plant` overrides parameters of all
    machines, `plant_of` {axis: {…}} those of one. `firmware` is a list of words, or None for the
    one in sw/firmware. `host_baud_error` 0.02 makes the host 2 % fast. `node_parameters` {"W": 12}
    are parameters of rtl/node.sv, drives(*DRIVES) builds all actuators, WITH_SEGMENTS a segment
    table. All nodes have all peripherals if one of them has devices or peers; `peers` are the
    numbers of two nodes that a serial line connects. `netlist` is a family of FPGAs (ecp5, ice40,
    gowin), perhaps with options of its synthesis: the nodes are then the netlists of it.
    """

    def __init__(
        self,
        nodes: Iterable[Node | int] = (1, 2),
        seed: int = 1,
        clk_hz: int = CLK_HZ,
        baud: float = BAUD,
        host_baud_error: float = 0.0,
        axes: int = 1,
        plant: Mapping[str, float] | None = None,
        plant_of: Mapping[int, Mapping[str, float]] | None = None,
        firmware: Sequence[int] | None = None,
        node_parameters: Mapping[str, int | str] = NODE,
        peers: tuple[int, int] | None = None,
        peer_baud: float = PEER_BAUD,
        netlist: str | None = None,
    ) -> None:
        self.handle: int | None = None
        built = [node if isinstance(node, Node) else Node(node, [Axis()] * axes) for node in nodes]
        self.addresses = tuple(node.address for node in built)
        self.node_axes = max(len(node.axes) for node in built)
        self.axes = self.node_axes * len(built)
        if any(n not in range(self.axes) for n in plant_of or {}):
            raise IndexError(f"plant_of names an axis that is not there: there are {self.axes}")
        if peers or any(node.devices for node in built):
            node_parameters = ALL_PERIPHERALS | dict(node_parameters)
        fitted = [
            axis
            for node in built
            for axis in [*node.axes, *[Axis("unconnected")] * (self.node_axes - len(node.axes))]
        ]
        words = build.firmware(axes=self.node_axes) if firmware is None else firmware
        self.library, self.clk_hz, self.baud = (
            library(clk_hz, self.node_axes, words, node_parameters, netlist),
            clk_hz,
            baud,
        )
        packed = [
            pack(
                axis.machine,
                {**(plant or {}), **axis.parameters, **(plant_of or {}).get(n, {})},
                self.library,
            )
            for n, axis in enumerate(fitted)
        ]
        image = memory_image(self.library, words)
        addresses = array(self.addresses, numpy.uint8)
        kinds = (ctypes.c_char_p * self.axes)(*(axis.machine.encode() for axis in fitted))
        tables = (ctypes.c_void_p * self.axes)(*(ctypes.addressof(table) for table in packed))
        self.handle = self.library.twin_new(
            seed,
            len(addresses),
            addresses.ctypes.data,
            image.ctypes.data,
            len(image),
            kinds,
            tables,
            clk_hz / baud,
        )
        now = partial(self.library.twin_now, self.handle)
        self.machines = [
            MachineHandle(
                self.library, self.library.twin_machine(self.handle, n), axis.machine, clk_hz, now
            )
            for n, axis in enumerate(fitted)
        ]
        self.node_devices = [
            self._attach_devices(n, node.devices or Devices(), seed, now)
            for n, node in enumerate(built)
            if any(node_parameters.get(name) for name in PERIPHERALS)
        ]
        pairs = (
            [(self.check_node(peers[0]), self.check_node(peers[1])), (peers[1], peers[0])]
            if peers
            else []
        )
        self.peer_lines = {
            pair: PeerLineHandle(
                self.library, self.library.twin_join_peers(self.handle, *pair, seed, peer_baud), now
            )
            for pair in pairs
        }
        self.seed, self.now, self.links = seed, now, dict[int, LinkLine]()
        if host_baud_error:
            self.set_host_baud(baud * (1 + host_baud_error))

    def __enter__(self) -> "Twin":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        """Free the simulation."""
        if self.handle:
            self.library.twin_delete(self.handle)
        self.handle = None

    def _attach_devices(
        self, node: int, devices: Devices, seed: int, now: Callable[[], int]
    ) -> DevicesHandle:
        if devices.table is not None and devices.table not in range(self.axes):
            raise IndexError(
                f"there is no axis {devices.table} to be the table: there are {self.axes}"
            )
        packed = pack_devices(devices.parameters, self.library)
        handle = self.library.twin_attach_devices(
            self.handle,
            node,
            ctypes.addressof(packed),
            devices.fitted,
            seed,
            -1 if devices.table is None else devices.table,
        )
        return DevicesHandle(self.library, handle, self.clk_hz, now)

    # time

    def time(self) -> float:
        """Simulated seconds since reset."""
        return float(self.library.twin_now(self.handle) / self.clk_hz)

    def run(self, seconds: float) -> None:
        """Let time pass."""
        self.library.twin_run(self.handle, max(0, round(seconds * self.clk_hz)))

    def run_until_ready(self) -> None:
        """Run until the firmware of all nodes has started, so that they answer on the bus."""
        self.run(START_S)

    def run_until_words(self, count: int, timeout_s: float) -> int:
        """Run until the host has received `count` words, at most timeout_s; returns their count."""
        longest = max(0, round(timeout_s * self.clk_hz))
        return int(self.library.twin_run_until_words(self.handle, count, longest))

    # bus

    def send_words(
        self, words: Sequence[int], flip_cells: Sequence[int] = (), gap_cells: int = 0
    ) -> None:
        """Queue words (0…511) that the host sends. flip_cells: bit cells to invert, counted from
        the first start bit, 11 a word (and gap_cells more between two).
        """
        sent, flips = array(words, numpy.uint16), array(flip_cells, numpy.uint32)
        self.library.twin_send_words(
            self.handle, sent.ctypes.data, len(sent), flips.ctypes.data, len(flips), gap_cells
        )

    def send_levels(self, levels: Any, cell_s: float = 0.0) -> None:
        """Drive levels from the host, each for cell_s (0: one bit time): breaks, noise, half
        characters.
        """
        sent = array(levels, numpy.uint8)
        self.library.twin_send_levels(
            self.handle, sent.ctypes.data, len(sent), cell_s * self.clk_hz
        )

    def send_nonsense(self, cells: int, seed: int = 1) -> None:
        """Random levels, each of 0.1 to 3 bit times."""
        random = numpy.random.default_rng(seed)
        fine = 10
        runs = random.integers(1, 3 * fine, size=cells)
        levels = numpy.repeat(numpy.arange(cells) & 1, runs)[: cells * fine]
        self.send_levels(levels, 1 / self.baud / fine)

    def receive_words(self, most: int = 4096) -> list[int]:
        """Words that the host has received since the previous call, as from the port of a PC: also
        those without a stop bit, but no break.
        """
        out = numpy.empty(most, dtype=numpy.uint16)
        count = self.library.twin_receive_words(self.handle, out.ctypes.data, most)
        return [int(word) for word in out[:count]]

    def set_host_baud(self, baud: float) -> None:
        """Change the baud rate of the host."""
        self.library.twin_host_bit_time(self.handle, self.clk_hz / baud)

    def flip_reply_cells(self, cells: Sequence[int]) -> None:
        """Invert bit cells of the next reply at the host, counted from its first start bit."""
        flips = array(cells, numpy.uint32)
        self.library.twin_flip_reply(self.handle, flips.ctypes.data, len(flips))

    def bus_spikes(
        self, rate_hz: float, shortest_s: float = 0.2e-6, longest_s: float = 2e-6
    ) -> None:
        """Short wrong levels on the bus at random times; rate 0 ends them."""
        self.library.twin_bus_spikes(self.handle, rate_hz, shortest_s, longest_s)

    def bus(self) -> BusState:
        """The state of the bus."""
        out = (ctypes.c_uint64 * 9)()
        self.library.twin_bus_state(self.handle, out)
        level, host_drives, *counts, last_driven, words = (int(value) for value in out)
        nodes_drive, collisions, framing_errors, start_glitches, edges = counts
        return BusState(
            bool(level),
            bool(host_drives),
            nodes_drive,
            collisions,
            framing_errors,
            start_glitches,
            edges,
            last_driven / self.clk_hz,
            words,
        )

    def bus_stays_idle(self, seconds: float) -> bool:
        """Run; true if nobody drove the bus and there was no edge on it."""
        before = self.bus()
        self.run(seconds)
        after = self.bus()
        return (
            after.edges == before.edges
            and after.level
            and not after.host_drives
            and not after.nodes_drive
        )

    # machines

    def machine(self, axis: int = 0) -> MachineHandle:
        """The machine of an axis: its state, parameters, faults and traces; see
        machine.MachineHandle.
        """
        if axis not in range(self.axes):
            raise IndexError(f"there is no axis {axis}: there are {self.axes}")
        return self.machines[axis]

    def check_node(self, node: int) -> int:
        """The number of a node; IndexError if it does not exist."""
        if node not in range(len(self.addresses)):
            raise IndexError(f"there is no node {node}: there are {len(self.addresses)}")
        return node

    def truth(self, axis: int = 0) -> Any:
        """The true state of the machine of an axis, see machine.State."""
        return self.machine(axis).state

    def true_position_nm(self, axis: int = 0) -> float:
        """The true position of an axis in nm."""
        return float(self.truth(axis).position_nm)

    def set_position(self, axis: int, position_m: float) -> None:
        """Move the table there by hand, without tension. The node sees a jump."""
        self.machine(axis).set_position(position_m)

    def push(self, axis: int, newton: float) -> None:
        """An outside force on the table, from now on."""
        self.machine(axis).push(newton)

    def set_plant(self, axis: int, **plant: float) -> None:
        """Change parameters of a running machine."""
        self.machine(axis).set(**plant)

    def fit_probe(self, slopes: Sequence[float], offset_m: float, node: int = 0) -> None:
        """Fits a touch probe at the pins probe_0 of all axes of a node. It touches a surface: where
        the sum of slope times true position, of all axes of the node, is below `offset_m`.
        """
        if len(slopes) != self.node_axes:
            raise ValueError(f"{len(slopes)} slopes for a node of {self.node_axes} axes")
        each = array(slopes, numpy.float64)
        self.library.twin_fit_probe(self.handle, self.check_node(node), each.ctypes.data, offset_m)

    # peripherals

    def devices(self, node: int = 0) -> DevicesHandle:
        """The devices of a node, see devices.DevicesHandle."""
        if not self.node_devices:
            raise LookupError("no node has devices: give a Node some, or build with PERIPHERALS")
        return self.node_devices[self.check_node(node)]

    def peer_line(self, sender: int, receiver: int) -> PeerLineHandle:
        """One direction of the serial line between two nodes; see devices.PeerLineHandle."""
        if (sender, receiver) not in self.peer_lines:
            raise LookupError(f"no serial line leads from node {sender} to node {receiver}")
        return self.peer_lines[sender, receiver]

    # real-time link

    def link(self, node: int = 0, bit_cycles: int = LINK_BIT_CYCLES) -> "LinkLine":
        """The host's end of the real-time link of a node that was built with HAS_LINK. A bit takes
        `bit_cycles` cycles of the node, as the first call for it says.
        """
        if self.check_node(node) not in self.links:
            lines = (ctypes.c_void_p * 2)()
            baud = self.clk_hz / bit_cycles
            self.library.twin_join_link(self.handle, node, self.seed, baud, ctypes.addressof(lines))
            ends = [PeerLineHandle(self.library, int(line or 0), self.now) for line in lines]
            self.links[node] = LinkLine(self, bit_cycles, *ends)
        return self.links[node]

    # power

    def power_cut(self, node: int = 0) -> None:
        """A node loses its power, its panel, the enable of its drives and its memory. The machines
        keep their state, and the EEPROM keeps every completed write.
        """
        self.library.twin_power(self.handle, self.check_node(node), False)

    def power_on(self, node: int = 0) -> None:
        """The power of a node returns."""
        self.library.twin_power(self.handle, self.check_node(node), True)

    # registers of a node

    def registers(self) -> list[Register]:
        """All registers and memories of the RTL of a node; none of a netlist, whose cells have no
        names.
        """
        found: list[Register] = []
        shape = (ctypes.c_int * 2)()
        while name := self.library.twin_register(len(found), shape):
            path = name.decode().replace("__BRA__", "[").replace("__KET__", "]")
            path = path.replace("__DOT__", ".").removeprefix("node.")
            found.append(Register(len(found), path, *shape))
        return found

    def flip_after(
        self, seconds: float, register: Register, bit: int, word: int = 0, node: int = 0
    ) -> None:
        """Let a bit of a register of a node change by itself once this time has passed."""
        if bit not in range(register.bits) or word not in range(register.words):
            raise IndexError(f"{register.name} has {register.words} words of {register.bits} bits")
        at = self.library.twin_now(self.handle) + max(1, round(seconds * self.clk_hz))
        self.library.twin_flip_at(
            self.handle, at, self.check_node(node), register.number, word, bit
        )

    def flipped(self) -> bool:
        """Whether the bit of flip_after has changed: not yet, or never if it is no flip-flop but
        logic that has its level from others.
        """
        return bool(self.library.twin_flipped(self.handle))

    def digest(self, node: int = 0) -> int:
        """A number of 64 bits that two equal states of all registers and memories share."""
        return int(self.library.twin_digest(self.handle, self.check_node(node)))

    # faults: estop of a node, line_cut of a node or of "host"; all others are of the machine of an
    # axis

    def inject(self, fault: str, where: int | str = 0, level: bool = False) -> None:
        """Begin a fault. `where` is the axis, for estop and line_cut the node; `level` is the level
        of a stuck pin, and of a cut line: true if the cut end reads ones, false for a break.
        """
        self._fault(fault, where, True, level)

    def clear(self, fault: str, where: int | str = 0) -> None:
        """End a fault."""
        self._fault(fault, where, False, False)

    @contextmanager
    def fault(self, fault: str, where: int | str = 0, level: bool = False) -> "Iterator[Twin]":
        """A fault as long as the block lasts."""
        self.inject(fault, where, level)
        try:
            yield self
        finally:
            self.clear(fault, where)

    def _fault(self, fault: str, where: int | str, on: bool, level: bool) -> None:
        index = -1 if isinstance(where, str) else where
        if fault == "estop":
            self.library.twin_estop(self.handle, self.check_node(index), on)
        elif fault == "line_cut":
            node = -1 if where == "host" else self.check_node(index)
            self.library.twin_cut(
                self.handle, node, CUTS["none" if not on else "idle" if level else "break"]
            )
        elif on:
            self.machine(index).inject(fault, level)
        else:
            self.machine(index).clear(fault)

    # traces

    def trace(self, axis: int = 0, rate_hz: float = 10_000) -> None:
        """Record from now on, at a rate rounded to whole time steps of the machine (100 kHz at
        most); 0 ends the recording.
        """
        self.machine(axis).trace(rate_hz)

    def take_trace(self, axis: int = 0) -> Trace:
        """{name: array} of what was recorded since the previous call."""
        return self.machine(axis).take_trace()


def realtime_factor(
    simulated_s: float = 0.1,
    tries: int = 5,
    nodes: Iterable[Node | int] = (1, 2),
    **arguments: Any,
) -> float:
    """Simulated seconds per second of one processor, nodes and machines running; the best of the
    tries.
    """
    with Twin(nodes=nodes, **arguments) as twin:
        twin.run(0.1)  # the firmware starts
        took = []
        for _ in range(tries):
            start = time.process_time()
            twin.run(simulated_s)
            took.append(time.process_time() - start)
    return simulated_s / min(took)
