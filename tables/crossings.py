# SPDX-License-Identifier: Apache-2.0
"""Make the tables of docs/crossings.md from the RTL: where each asynchronous input crosses into the
clock domain, and how long it takes on average until a crossing fails.

Yosys elaborates the node and the relay with everything built, and each top of a board. Every input
is followed through the logic to the first flip-flops. An input is asynchronous unless the comment
of its port says `static` or `synchronous to`; then it must reach nothing but the first stage of a
synchroniser. A pin of a board must be wired to a port of its own kind. Anything else is an error.
"""

import json
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from boards.build import fitting, write
from figures.synthesis import yosys
from tables import made_files
from tables.made_files import ROOT

PAGE = ROOT / "docs" / "crossings.md"
BEGIN, END = "<!-- crossings -->", "<!-- /crossings -->"
WHOLE: dict[str, dict[str, int | str]] = {  # the designs, with all that has pins
    "node": {
        **dict.fromkeys(("HAS_I2C", "HAS_PS2", "HAS_PEER", "HAS_ANGLE_SENSOR"), 1),
        **dict.fromkeys(("HAS_DISPLAY", "HAS_STATUS_INPUTS", "HAS_SERIAL_CORE", "HAS_LINK"), 1),
    },
    "node, SPI": {"HAS_LINK": 1, "LINK_CARRIER": 2},  # of which only what the first lacks is shown
    "relay": {},
}
BOX = ROOT / "sw" / "figures" / "counter_box_bench.sv"  # a top around a node, as those of boards
CLOCKS = {"clk", "clock"}
RESET = "rst"
FLAT = "proc; flatten; opt_clean; write_json {netlist}"
BOXES = "read_verilog -sv -lib -nowb rtl/node.sv rtl/relay.sv"  # of the tops
AROUND = "proc; opt_clean; write_json {netlist}"
BITWISE = {"$mux": "AB", "$and": "AB", "$or": "AB", "$xor": "AB", "$not": "A"}
FLIP_FLOP = re.compile(r"\$_?(s?dff|aldff|adff|dlatch|sr)")
YEAR_S = 365.25 * 24 * 3600
# Highest rates of change at a pin, 1/s. The encoder may change once a cycle: the decoder's limit.
EACH_CYCLE, BOUNCING = 0.0, 1e4
RATES: dict[str, float] = {
    "encoder_": EACH_CYCLE,
    "flash_sdi": EACH_CYCLE,
    "rs485_rx": 3e6,  # 3 Mbaud
    "link_rx": 12e6,  # 12 Mbaud
    "link_sclk": 24e6,  # both edges of 12 MHz
    "link_mosi": 12e6,
    "link_cs_n": 2e4,  # both edges of 10 kHz
    "peer_rx": 1e6,
    "sensor_rx": 1e6,
    "i2c_": 8e5,  # 400 kHz
    "keyboard_": 4e4,  # 16.7 kHz
    "edm_clock": 4e4,
    "edm_data": 4e4,
    "probe": BOUNCING,
    "limit_": BOUNCING,
    "drive_fault_n": BOUNCING,
    "estop_open": BOUNCING,
    "edm_status": BOUNCING,
}

Bit = int | str


@dataclass(frozen=True)
class FlipFlop:
    """How a metastable flip-flop of a family decides: its time constant, the window in which a
    change makes it metastable, and what the way to the next one takes of a cycle.
    """

    time_constant_s: float
    window_s: float
    path_s: float  # clock to output, routing and set-up between two stages, an upper bound


# Lattice publishes no numbers: docs/crossings.md says where these come from.
MEASURED = FlipFlop(1 / 9.148e9, 1.56e-11, 0.0)  # ProASIC Plus, 0.22 um: Actel AC312
CORNER = 2  # from a nominal chip to the slowest one
SLOWER = 2.6  # clock to output of an UP5K over that of an HX8K of the same process
FAMILIES = {  # name: flip-flop, highest shipped clock in Hz
    "ECP5, 60 MHz": (FlipFlop(CORNER / 9.148e9, 1.56e-11, 4e-9), 60e6),
    "UP5K, 24 MHz": (FlipFlop(CORNER * SLOWER / 9.148e9, SLOWER * 1.56e-11, 8e-9), 24e6),
}


@dataclass(frozen=True)
class Chain:
    """A synchroniser of a design and the inputs that it brings in."""

    design: str
    path: str  # of the instance
    width: int
    stages: int
    inputs: tuple[str, ...]  # ports; none: it is a delay of levels of the same clock


def mtbf_s(flip_flop: FlipFlop, stages: int, clock_hz: float, rate_hz: float) -> float:
    """Mean time in s until a bit leaves its chain metastable: each stage but the last one decides
    for a cycle, less the path to the next stage.
    """
    decides_s = (stages - 1) * (1 / clock_hz - flip_flop.path_s)
    try:
        gain = math.exp(decides_s / flip_flop.time_constant_s)
    except OverflowError:
        return math.inf
    return gain / (flip_flop.window_s * clock_hz * rate_hz)


def rate_of(port: str, clock_hz: float) -> float:
    """Highest rate of change of an input in 1/s."""
    found = [rate for name, rate in RATES.items() if port.startswith(name)]
    if len(found) != 1:
        raise ValueError(f"tables/crossings.py has {len(found)} rates of the input {port}, not one")
    return found[0] or clock_hz


def kind_of(comment: str) -> str:
    """What the comment of an input says of its timing."""
    if re.search(r"\bstatic\b", comment):
        return "static"
    return "synchronous" if re.search(r"\bsynchronous to\b", comment) else "asynchronous"


def inputs_of(source: Path) -> dict[str, str]:
    """{input: comment} of the module of a file, clock and reset left out."""
    lines = re.findall(
        r"^ *input +wire +(?:signed +)?(?:\[[^\]]*\] *)?(\w+),? *(?://(.*))?$",
        source.read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    return {name: words.strip() for name, words in lines if name not in CLOCKS | {RESET}}


def is_module(kind: str) -> bool:
    """Whether a cell is a module, not one of Yosys's own cells."""
    return kind[0] != "$" or kind.startswith("$paramod")


@dataclass
class Netlist:
    """A module as Yosys has elaborated it, with what each bit leads to."""

    module: Mapping[str, Any]

    def __post_init__(self) -> None:
        self.readers: dict[Bit, list[tuple[str, str, int]]] = {}
        for name, cell in self.module["cells"].items():
            for port, bits in cell["connections"].items():
                if cell["port_directions"][port] == "input":
                    for index, bit in enumerate(bits):
                        self.readers.setdefault(bit, []).append((name, port, index))

    def bits(self, port: str) -> list[Bit]:
        return list(self.module["ports"][port]["bits"])

    def passed(self, cell: Mapping[str, Any], port: str, index: int) -> Iterable[Bit]:
        """The outputs of logic that depend on one bit of an input."""
        wires = cell["connections"]
        if port in BITWISE.get(cell["type"], "") and index < len(wires["Y"]):
            return [wires["Y"][index]]
        directions = cell["port_directions"]
        return [bit for name in wires if directions[name] == "output" for bit in wires[name]]

    def sinks(self, start: Bit) -> Iterator[tuple[str, str, Bit]]:
        """(cell, its port, the bit that the cell holds) of the first cells behind a bit that are no
        logic: flip-flops, memories, modules that are not elaborated.
        """
        seen: set[Bit] = {start}
        left = [start]
        while left:
            for name, port, index in self.readers.get(left.pop(), []):
                cell = self.module["cells"][name]
                if FLIP_FLOP.match(cell["type"]) and port == "D":
                    yield name, port, cell["connections"]["Q"][index]
                elif is_module(cell["type"]) or FLIP_FLOP.match(cell["type"]):
                    yield name, port, 0
                elif cell["type"].startswith("$mem"):
                    yield name, port, 0
                else:
                    found = set(self.passed(cell, port, index)) - seen
                    seen |= found
                    left += found

    def chains(self) -> dict[str, list[Bit]]:
        """{instance: bits of its stages} of the synchronisers."""
        return {
            name.rpartition(".")[0]: list(net["bits"])
            for name, net in self.module["netnames"].items()
            if "async_reg" in net["attributes"]
        }


def width_of(netlist: Netlist, path: str, stages: list[Bit]) -> int:
    """Bits of a synchroniser: how far the first bit moves from one stage to the next."""
    places = [stages.index(bit) for _, _, bit in netlist.sinks(stages[0]) if bit in stages]
    if not places:
        raise ValueError(f"{path} is no chain of flip-flops")
    return min(places)


def crossings_of(design: str, netlist: Netlist, comments: Mapping[str, str]) -> list[Chain]:
    """The synchronisers of a design, in the order of their first inputs. A ValueError names each
    asynchronous input that goes another way.
    """
    chains = netlist.chains()
    widths = {path: width_of(netlist, path, bits) for path, bits in chains.items()}
    first = {bit: path for path, bits in chains.items() for bit in bits[: widths[path]]}
    inputs: dict[str, list[str]] = {path: [] for path in chains}
    wrong = []
    for port, comment in comments.items():
        for start in netlist.bits(port):
            for cell, at, bit in netlist.sinks(start):
                if kind_of(comment) != "asynchronous":
                    if bit in first:
                        wrong.append(f"{design}.{port} is {kind_of(comment)} and synchronised")
                elif bit not in first:
                    wrong.append(f"{design}.{port} reaches {cell} ({at}) without a synchroniser")
                elif port not in inputs[first[bit]]:
                    inputs[first[bit]].append(port)
    if wrong:
        raise ValueError("\n".join(sorted(set(wrong))))
    found = [
        Chain(design, path, widths[path], len(bits) // widths[path], tuple(inputs[path]))
        for path, bits in chains.items()
    ]
    order = [port for ports in inputs.values() for port in ports]
    return sorted(found, key=lambda one: order.index(one.inputs[0]) if one.inputs else len(order))


def elaborated(
    source: Path, parameters: Mapping[str, int | str], passes: str, first: str = ""
) -> Netlist:
    """A module with everything below it but the modules that the pass `first` has read."""
    file = yosys(source, parameters, passes, "crossings", first)
    return Netlist(json.loads(file.read_text())["modules"][source.stem])


def wrong_pins(top: Path, cells: str, inside: Mapping[str, str]) -> Iterator[str]:
    """The asynchronous inputs of a top that do not go to asynchronous ports of its node or relay,
    and those that flip-flops of the top take. `cells` is the file of the part's primitives.
    """
    netlist = elaborated(top, {}, AROUND, f"{BOXES} {cells}")
    for port, comment in inputs_of(top).items():
        for start in netlist.bits(port):
            for name, at, _ in netlist.sinks(start):
                cell = netlist.module["cells"][name]
                kind = kind_of(inside.get(at, "")) if is_module(cell["type"]) else "stored"
                if kind != kind_of(comment):
                    yield f"{top.parent.name}/{top.name}: {port} reaches {at} of {name}"


def designs() -> dict[str, Path]:
    """The designs with their sources; the name of a design begins with its module."""
    return {name: ROOT / "rtl" / f"{name.partition(',')[0]}.sv" for name in WHOLE}


def tops() -> list[tuple[Path, str]]:
    """The tops of boards and boxes, and the files of the primitives of their parts."""
    of_boards = (
        (write(one) / "top.sv", f"+/{one.board.part.family.cells}") for one in fitting()[0]
    )
    return [(BOX, ""), *of_boards]


def years(seconds: float) -> str:
    """A time as a power of ten of years."""
    return f"10^{math.floor(math.log10(seconds / YEAR_S))}" if seconds < math.inf else "over 10^300"


def row(chain: Chain) -> list[str]:
    """The row of a crossing; the MTBF is that of all its inputs together."""
    cells = [chain.design, f"`{chain.path}`", ", ".join(f"`{one}`" for one in chain.inputs)]
    rates, times = [], []
    for flip_flop, clock_hz in FAMILIES.values():
        of_inputs = [rate_of(port, clock_hz) for port in chain.inputs]
        rates.append(max(of_inputs))
        each = [mtbf_s(flip_flop, chain.stages, clock_hz, rate) for rate in of_inputs]
        times.append(years(1 / sum(1 / one for one in each)))
    every = {rate_of(port, 0.0) for port in chain.inputs} == {0.0}
    rate = "each cycle" if every or 0.0 in {rate_of(p, 0.0) for p in chain.inputs} else ""
    return [*cells, rate or f"{max(rates):.0e}", str(chain.stages), *times]


def lines(found: Iterable[Chain], plain: Iterable[list[str]], delays: Iterable[str]) -> list[str]:
    """The made part of the page."""
    heads = ["design", "synchroniser", "inputs", "fastest, 1/s", "stages"]
    heads += [f"MTBF, years: {name}" for name in FAMILIES]
    tables: list[list[str]] = [heads, ["---"] * len(heads), *(row(chain) for chain in found)]
    second = [["design", "input", "why it needs no synchroniser"], ["---"] * 3, *plain]
    shown = [*tables, [], *second]
    text = ["| " + " | ".join(cells) + " |" if cells else "" for cells in shown]
    return ["", *text, "", *delays, ""]


def generate() -> dict[Path, str | None]:
    """The page, with its tables made from the RTL; a ValueError names what crosses elsewhere."""
    chains: list[Chain] = []
    plain = []
    for name, source in designs().items():
        comments = inputs_of(source)
        known = {(one.inputs, one.path) for one in chains}
        chains += [
            one
            for one in crossings_of(name, elaborated(source, WHOLE[name], FLAT), comments)
            if (one.inputs, one.path) not in known
        ]
        plain += [
            [name, f"`{port}`", words]
            for port, words in comments.items()
            if kind_of(words) != "asynchronous" and name == source.stem
        ]
    inside = {port: words for one in designs().values() for port, words in inputs_of(one).items()}
    if wrong := [one for top, cells in tops() for one in wrong_pins(top, cells, inside)]:
        raise ValueError("\n".join(wrong))
    delays = [
        f"`{one.path}` of the {one.design} is no crossing: it delays levels of `clk`."
        for one in chains
        if not one.inputs
    ]
    made = lines([one for one in chains if one.inputs], plain, delays)
    return {PAGE: made_files.filled(PAGE, BEGIN, END, made)}


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__ or "", generate))
