# SPDX-License-Identifier: Apache-2.0
"""The machine without hardware: nodes as they ship (RTL and firmware), stages around them, a line with a host at its end.

Time is simulated: it passes in run, run_until_words and nowhere else, and the same seed gives the same run to the last bit.
An axis is counted through all nodes: axis = place of the node * axes a node + axis of the node.
"""
import ctypes
import time
from contextlib import contextmanager
from dataclasses import dataclass

import numpy

from . import build, parameters
from .stage import FAULTS, declare

CLK_HZ = 3_000_000
BAUD = 115200
TURNAROUND_CELLS = 2             # the host hears a word half a cell before its end; the node's driver lets go half a cell after it
CELLS = 11                       # of a character: start, eight data, 9th, stop
CUTS = {"none": 0, "idle": 1, "break": 2}
SWITCHES = {"limit_low": 0, "limit_high": 1, "drive_fault": 2, "motor_jam": 3}
SIGNALS = {"encoder_cut": "cable_cut", "a_stuck": "a_stuck", "b_stuck": "b_stuck", "converter_stuck": "converter_stuck"}
TRACE_COLUMNS = ("time_s", "position_m", "velocity_m_s", "nut_m", "current_a", "voltage_v")

HANDLE, REAL, WHOLE, LONG = ctypes.c_void_p, ctypes.c_double, ctypes.c_int, ctypes.c_uint64
FUNCTIONS = {
    "twin_axes": (WHOLE, []), "twin_parameter_count": (WHOLE, []), "twin_memory_words": (WHOLE, []),
    "twin_new": (HANDLE, [LONG, WHOLE, HANDLE, HANDLE, WHOLE, HANDLE, REAL]), "twin_delete": (None, [HANDLE]),
    "twin_now": (LONG, [HANDLE]), "twin_run": (None, [HANDLE, LONG]), "twin_run_until_words": (WHOLE, [HANDLE, WHOLE, LONG]),
    "twin_send_words": (None, [HANDLE, HANDLE, WHOLE, HANDLE, WHOLE, WHOLE]), "twin_send_levels": (None, [HANDLE, HANDLE, WHOLE, REAL]),
    "twin_receive_words": (WHOLE, [HANDLE, HANDLE, WHOLE]), "twin_host_bit_time": (None, [HANDLE, REAL]),
    "twin_flip_reply": (None, [HANDLE, HANDLE, WHOLE]), "twin_line_spikes": (None, [HANDLE, REAL, REAL, REAL]),
    "twin_cut": (None, [HANDLE, WHOLE, WHOLE]), "twin_line_state": (None, [HANDLE, HANDLE]),
    "twin_set": (WHOLE, [HANDLE, WHOLE, ctypes.c_char_p, REAL]), "twin_place": (None, [HANDLE, WHOLE, REAL]),
    "twin_push": (None, [HANDLE, WHOLE, REAL]), "twin_estop": (None, [HANDLE, WHOLE, WHOLE]),
    "twin_switch": (None, [HANDLE, WHOLE, WHOLE, WHOLE]), "twin_signal_fault": (None, [HANDLE, WHOLE, WHOLE, WHOLE]),
    "twin_truth": (None, [HANDLE, WHOLE, HANDLE]), "twin_trace": (None, [HANDLE, WHOLE, LONG]),
    "twin_trace_rows": (WHOLE, [HANDLE, WHOLE]), "twin_trace_take": (None, [HANDLE, WHOLE, HANDLE]),
    "frame_bench_new": (HANDLE, [WHOLE, HANDLE, WHOLE, REAL]), "frame_bench_delete": (None, [HANDLE]),
    "frame_bench_idle": (None, [HANDLE, LONG]), "frame_bench_now": (LONG, [HANDLE]),
    "frame_bench_exchange": (WHOLE, [HANDLE, HANDLE, WHOLE, WHOLE, WHOLE, WHOLE, HANDLE, WHOLE]),
}


@dataclass(frozen=True)
class Truth:
    """An axis as it really is now; positions of the table, 0 = start of the working travel."""
    time_s: float
    position_m: float
    velocity_m_s: float
    nut_m: float                 # where the nut is, from the motor's angle
    motor_rad_s: float
    current_a: float
    voltage_v: float             # mean of the last plant step
    screw_n: float               # on the table
    limit_low: bool              # pressed
    limit_high: bool
    a: bool                      # levels at the node's pins
    b: bool
    enabled: bool                # the node's drive_enable
    code_sin: int                # last conversion, straight binary
    code_cos: int

    @property
    def position_nm(self):
        return self.position_m * 1e9


@dataclass(frozen=True)
class LineState:
    level: bool                  # as the nodes hear it
    host_drives: bool
    nodes_drive: int             # bit mask over the nodes
    collisions: int              # times that two drove at once
    framing_errors: int          # of the host's receiver
    start_glitches: int
    edges: int
    last_driven_s: float
    words_waiting: int


def library(clk_hz, axes):
    found = ctypes.CDLL(str(build.twin_library(clk_hz, axes)))
    declare(found, FUNCTIONS)
    return found


def array(values, dtype):
    return numpy.ascontiguousarray(values, dtype=dtype)


def memory_image(found, words):
    image = array(words, numpy.uint32)
    if len(image) > found.twin_memory_words():
        raise build.BuildError(f"the firmware has {len(image)} words, the node's memory {found.twin_memory_words()}")
    return image


class Twin:
    """`nodes` are their addresses on the line. `plant` overrides parameters.toml for all axes, `plant_of` {axis: {…}} for
    one; `firmware` is a list of words or None for the one in sw/firmware; `host_baud_error` 0.02 makes the host 2 % fast."""

    def __init__(self, seed=1, nodes=(1, 2), clk_hz=CLK_HZ, baud=BAUD, host_baud_error=0.0, axes=1, plant=None, plant_of=None,
                 firmware=None):
        self.handle = None
        self.library, self.clk_hz, self.baud, self.addresses = library(clk_hz, axes), clk_hz, baud, tuple(nodes)
        self.node_axes, self.axes = axes, axes * len(self.addresses)
        plants = [parameters.values({**(plant or {}), **(plant_of or {}).get(n, {})}) for n in range(self.axes)]
        if any(n not in range(self.axes) for n in plant_of or {}):
            raise IndexError(f"plant_of names an axis that is not there: there are {self.axes}")
        packed = array([list(values.values()) for values in plants], numpy.float64)
        assert packed.shape[1] == self.library.twin_parameter_count()
        image = memory_image(self.library, build.firmware() if firmware is None else firmware)
        addresses = array(self.addresses, numpy.uint8)
        self.handle = self.library.twin_new(seed, len(addresses), addresses.ctypes.data, image.ctypes.data, len(image), packed.ctypes.data,
                                            clk_hz / baud)
        if host_baud_error:
            self.set_host_baud(baud * (1 + host_baud_error))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __del__(self):
        self.close()

    def close(self):
        if self.handle:
            self.library.twin_delete(self.handle)
        self.handle = None

    # time

    def time(self):
        """Simulated seconds since reset."""
        return self.library.twin_now(self.handle) / self.clk_hz

    def run(self, seconds):
        self.library.twin_run(self.handle, max(0, round(seconds * self.clk_hz)))

    def run_until_words(self, count, timeout_s):
        """Run until the host has `count` words waiting, at most timeout_s; returns how many wait."""
        return self.library.twin_run_until_words(self.handle, count, max(0, round(timeout_s * self.clk_hz)))

    # line

    def send_words(self, words, flip_cells=(), gap_cells=0):
        """Put words (0…511) behind what the host is sending. flip_cells: bit cells to turn over, counted from the first start
        bit, 11 a word (and gap_cells more between two)."""
        words, flips = array(words, numpy.uint16), array(flip_cells, numpy.uint32)
        self.library.twin_send_words(self.handle, words.ctypes.data, len(words), flips.ctypes.data, len(flips), gap_cells)

    def send_levels(self, levels, cell_s=0.0):
        """The host's driver as it is told, cell by cell (0: of one bit time): breaks, nonsense, half characters."""
        levels = array(levels, numpy.uint8)
        self.library.twin_send_levels(self.handle, levels.ctypes.data, len(levels), cell_s * self.clk_hz)

    def send_nonsense(self, cells, seed=1):
        """Random levels, each of 0.1 to 3 bit times."""
        random = numpy.random.default_rng(seed)
        fine = 10
        runs = random.integers(1, 3 * fine, size=cells)
        levels = numpy.repeat(numpy.arange(cells) & 1, runs)[:cells * fine]
        self.send_levels(levels, 1 / self.baud / fine)

    def receive_words(self, most=4096):
        """Words that the host has received and not yet taken; those with a framing error are only counted."""
        out = numpy.empty(most, dtype=numpy.uint16)
        return out[:self.library.twin_receive_words(self.handle, out.ctypes.data, most)].tolist()

    def set_host_baud(self, baud):
        self.library.twin_host_bit_time(self.handle, self.clk_hz / baud)

    def flip_reply_cells(self, cells):
        """Turn over bit cells of what the host hears next, counted from the first start bit of the next reply."""
        cells = array(cells, numpy.uint32)
        self.library.twin_flip_reply(self.handle, cells.ctypes.data, len(cells))

    def line_spikes(self, rate_hz, shortest_s=0.2e-6, longest_s=2e-6):
        """Short wrong levels on the line, at random times; rate 0 ends them."""
        self.library.twin_line_spikes(self.handle, rate_hz, shortest_s, longest_s)

    def line(self):
        out = (ctypes.c_uint64 * 9)()
        self.library.twin_line_state(self.handle, out)
        return LineState(bool(out[0]), bool(out[1]), *out[2:7], out[7] / self.clk_hz, out[8])

    def line_stays_idle(self, seconds):
        """Run; true if nobody drove the line and no edge was on it."""
        before = self.line()
        self.run(seconds)
        after = self.line()
        return after.edges == before.edges and after.level and not after.host_drives and not after.nodes_drive

    # machine

    def check_axis(self, axis):
        if axis not in range(self.axes):
            raise IndexError(f"there is no axis {axis}: there are {self.axes}")
        return axis

    def check_node(self, node):
        if node not in range(len(self.addresses)):
            raise IndexError(f"there is no node {node}: there are {len(self.addresses)}")
        return node

    def truth(self, axis=0):
        out = (ctypes.c_double * 15)()
        self.library.twin_truth(self.handle, self.check_axis(axis), out)
        return Truth(*out[:8], *(bool(x) for x in out[8:13]), int(out[13]), int(out[14]))

    def true_position_nm(self, axis=0):
        return self.truth(axis).position_nm

    def place(self, axis, position_m):
        """Carry the table here by hand: at rest, nothing wound up. The node sees a jump."""
        self.library.twin_place(self.handle, self.check_axis(axis), position_m)

    def push(self, axis, newton):
        """An outside force on the table, from now on."""
        self.library.twin_push(self.handle, self.check_axis(axis), newton)

    def set_plant(self, axis, **plant):
        """Change parameters of a running machine."""
        for name, value in plant.items():
            if not self.library.twin_set(self.handle, self.check_axis(axis), name.encode(), value):
                raise KeyError(f"the plant has no parameter {name}")

    # faults: estop of a node; limit_low, limit_high (pressed or wire cut), drive_fault, motor_jam, encoder_cut, a_stuck,
    # b_stuck, converter_stuck of an axis; line_cut of a node or of "host"

    def inject(self, fault, where=0, level=False):
        """`where` is the axis, for estop and line_cut the node; `level` is that of a stuck A or B, and of a cut line: true
        if the cut end hears ones, false for a break."""
        self._fault(fault, where, True, level)

    def clear(self, fault, where=0):
        self._fault(fault, where, False, False)

    @contextmanager
    def fault(self, fault, where=0, level=False):
        self.inject(fault, where, level)
        try:
            yield self
        finally:
            self.clear(fault, where)

    def _fault(self, fault, where, on, level):
        if fault == "estop":
            self.library.twin_estop(self.handle, self.check_node(where), on)
        elif fault == "line_cut":
            node = -1 if where == "host" else self.check_node(where)
            self.library.twin_cut(self.handle, node, CUTS["none" if not on else "idle" if level else "break"])
        elif fault in SWITCHES:
            self.library.twin_switch(self.handle, self.check_axis(where), SWITCHES[fault], on)
        elif fault in SIGNALS:
            self.library.twin_signal_fault(self.handle, self.check_axis(where), FAULTS[SIGNALS[fault]] if on else 0, level)
        else:
            raise KeyError(f"there is no fault {fault}: there are estop, line_cut, {', '.join([*SWITCHES, *SIGNALS])}")

    # traces

    def trace(self, axis=0, rate_hz=10_000):
        """Record from now on; the rate is rounded to whole plant steps (100 kHz at most); 0 ends it."""
        self.library.twin_trace(self.handle, self.check_axis(axis), round(self.clk_hz / rate_hz) if rate_hz else 0)

    def take_trace(self, axis=0):
        """{column: array} of what was recorded since the last take."""
        rows = numpy.empty((self.library.twin_trace_rows(self.handle, self.check_axis(axis)), len(TRACE_COLUMNS)))
        self.library.twin_trace_take(self.handle, axis, rows.ctypes.data)
        return {name: rows[:, n].copy() for n, name in enumerate(TRACE_COLUMNS)}


class TwinTransport:
    """The transport that the host package asks for, over a twin; time passes only as far as needed."""

    time_stands = True

    def __init__(self, twin):
        self.twin, self.character_s = twin, CELLS / twin.baud

    def send(self, words):
        self.twin.run(TURNAROUND_CELLS / self.twin.baud)
        self.twin.send_words(list(words))
        self.twin.run(len(words) * self.character_s)

    def receive(self, count, timeout_s):
        """At most `count` words; fewer when timeout_s of simulated time has passed."""
        self.twin.run_until_words(count, timeout_s)
        return self.twin.receive_words(count) if count else []

    def now(self):
        return self.twin.time()

    def wait(self, seconds):
        self.twin.run(seconds)

    def reaches(self, address):
        return True

    def close(self):
        self.twin.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def cells_of(words, gap_cells=0):
    """Levels of 9-bit words on the line, one a bit cell."""
    levels = []
    for n, word in enumerate(words):
        levels += [1] * (gap_cells if n else 0) + [0, *(word >> bit & 1 for bit in range(9)), 1]
    return levels


class FrameBench:
    """One node without a machine at a low clk (16 clk a bit: the firmware keeps its baud): for 10^5 damaged frames.
    One made with another clk_hz (whole kHz) is another build.

    exchange(levels) puts bit cells on the line as they are and returns the words that the node answered."""

    def __init__(self, address=1, clk_hz=1_840_000, baud=BAUD, firmware=None):
        self.handle = None
        self.library, self.clk_hz = library(clk_hz, 1), clk_hz
        image = memory_image(self.library, build.firmware() if firmware is None else firmware)
        self.handle = self.library.frame_bench_new(address, image.ctypes.data, len(image), clk_hz / baud)
        self.words = numpy.empty(256, dtype=numpy.uint16)

    def __del__(self):
        if self.handle:
            self.library.frame_bench_delete(self.handle)
        self.handle = None

    def exchange(self, levels, enough=256, quiet_cells=100, most_cells=2000):
        """Returns when `enough` words are there, or the line was quiet for quiet_cells after the last level or the answer; at
        the latest after most_cells. A node takes up to 60 cells to answer a request, at a low clk."""
        levels = array(levels, numpy.uint8)
        count = self.library.frame_bench_exchange(self.handle, levels.ctypes.data, len(levels), enough, quiet_cells, most_cells,
                                                  self.words.ctypes.data, len(self.words))
        return self.words[:count].tolist()

    def idle(self, cells, baud=BAUD):
        self.library.frame_bench_idle(self.handle, round(cells * self.clk_hz / baud))

    def time(self):
        return self.library.frame_bench_now(self.handle) / self.clk_hz


def realtime_factor(simulated_s=0.1, tries=5, nodes=(1, 2), **arguments):
    """Simulated seconds per second of one processor, nodes and machines running; the best of the tries."""
    with Twin(nodes=nodes, **arguments) as twin:
        twin.run(0.06)                                        # the firmware starts
        took = []
        for _ in range(tries):
            start = time.process_time()
            twin.run(simulated_s)
            took.append(time.process_time() - start)
    return simulated_s / min(took)
