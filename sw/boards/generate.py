# SPDX-License-Identifier: Apache-2.0
"""What is made of a machine on a board: its top, its constraints, its wiring page and drawing."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from boards import block_ram
from boards.board import FLASH, LEDS, OF_THE_TOP, Pad
from boards.fit import PLACEHOLDER, Connection, Design
from boards.machine import AXIS_SIGNALS, NODE_SIGNALS, PERIPHERALS, RELAY_SIGNALS
from moire.analysis.loopback import GROUND, PLUG

TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).with_name("templates")),
    undefined=StrictUndefined,
    autoescape=lambda name: bool(name and (".html" in name or ".svg" in name)),
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)
NODE_OUTPUTS = (  # besides those of the axes
    *("rs485_tx", "rs485_driver_enable", "flash_cs_n", "flash_sclk", "flash_mosi"),
    *("link_tx", "link_driver_enable", "link_miso"),
    *("udp_rx_ready", "udp_tx_valid", "udp_tx_last"),
    *("i2c_scl_low", "i2c_sda_low", "keyboard_clock_low", "keyboard_data_low", "edm_clock_low"),
    *("edm_data_low", "peer_tx", "display_cs_n", "display_sclk", "display_data"),
)
UDP_OUTPUTS = {"udp_tx_data": 8, "udp_tx_receiver": 48, "udp_tx_length": 16}
UDP_INPUTS = {  # from the Ethernet core, and their bits
    **{"udp_rx_valid": 1, "udp_rx_data": 8, "udp_rx_last": 1, "udp_rx_error": 1},
    **{"udp_rx_sender": 48, "udp_tx_ready": 1},
}
RELAY_OUTPUTS = (
    *("relay_a", "relay_b", "relay_z", "correcting", "fault", "rs485_tx", "rs485_driver_enable"),
    *("flash_chip_n", "flash_sclk", "flash_sdo"),
)
RELAY_FLASH = {"flash_cs_n": "flash_chip_n", "flash_sclk": "flash_sclk", "flash_mosi": "flash_sdo"}
EDM_STATUS = ("edm_alarm", "edm_cutting")  # the bits of edm_status, the highest first
FRONT_ENDS = "../../../docs/front_ends.md"  # from the folder of a wiring page
ROW, HEAD, PARTS_LEFT, LETTER = 26, 30, 420, 8  # of the drawing, in its units


@dataclass(frozen=True)
class Pin:
    """A port of the top at its pin."""

    port: str
    direction: str
    pad: Pad
    comment: str

    @property
    def declared(self) -> str:
        words = {"in": "input  wire ", "out": "output logic", "both": "inout  wire "}
        return f"{words[self.direction]} {self.port}"


def has_usb(design: Design) -> bool:
    return {"usb_rx", "usb_tx"} <= set(design.board.on_board)


def pins(design: Design) -> list[Pin]:
    """All pins of the top."""
    board = design.board
    found = [Pin("clock", "in", board.clock, f"{board.clock_hz / 1e6} MHz")]
    for name, pad in board.on_board.items():
        if design.machine.has_flash or name not in FLASH:
            # the relay synchronises what comes from its flash
            timed = name == "flash_miso" and not design.machine.orders
            timing = ", synchronous to flash_sclk" if timed else ""
            found.append(Pin(name, pad.direction, pad, f"pin {pad.ball}{timing}"))
    if design.ethernet:
        of_phy = f", synchronous to {' and '.join(design.ethernet.clocks)}"
        for port, pad in design.ethernet.pads.items():
            timing = "" if port.removeprefix("eth_") in OF_THE_TOP else of_phy
            found.append(Pin(port, pad.direction, pad, f"pin {pad.ball}, {pad.place}{timing}"))
    found += [
        Pin(f"address_{n}", "in", pad, f"static: switch, bit {n} of the address on the bus")
        for n, pad in enumerate([] if design.machine.orders else board.address)
    ]
    found += [
        Pin(f"led_{name}", "out", pad, f"{'0' if board.leds_low else '1'}: on")
        for name, pad in board.leds.items()
    ]
    found += [
        Pin(one.port, one.signal.direction, one.pad, f"{one.pad.place}: {one.signal.meaning}")
        for one in design.connections
    ]
    return found


def outputs(design: Design) -> dict[str, int]:
    """{output of the node or relay: its bits}"""
    if design.machine.orders:
        return dict.fromkeys(RELAY_OUTPUTS, 1)
    axes = len(design.machine.axes)
    found = {name: axes for name, signal in AXIS_SIGNALS.items() if signal.direction == "out"}
    return found | dict.fromkeys(NODE_OUTPUTS, 1) | UDP_OUTPUTS


def inputs(design: Design) -> dict[str, str]:
    """{input of the node or relay: what it is connected to}"""
    ports = {one.name: one.port for one in design.connections}
    heard = ["usb_rx"] * has_usb(design) + ["rs485_rx"] * ("rs485_rx" in ports)
    if design.machine.orders:
        encoder = {name: ports.get(name, "1'b0") for name in RELAY_SIGNALS if "encoder" in name}
        return {**encoder, "rs485_rx": " & ".join(heard), "flash_sdi": "flash_miso"}

    def bits(*names: str) -> str:
        """An input with these bits of each axis, the highest first."""
        each = [
            ports.get(f"{axis.name}.{name}", f"1'b{AXIS_SIGNALS[name].idle}")
            for axis in reversed(design.machine.axes)
            for name in names
        ]
        return "{" + ", ".join(each) + "}"

    switches = [f"address_{n}" for n in reversed(range(len(design.board.address)))]
    return {
        "address": f"{{{', '.join(switches)}}}" if switches else f"4'd{design.machine.address}",
        "rs485_rx": " & ".join(heard),
        "estop_open": ports.get("estop_open", "1'b0"),
        **{
            name: bits(name)
            for name, signal in AXIS_SIGNALS.items()
            if signal.direction == "in" and not name.startswith("probe")
        },
        "probe": bits("probe_1", "probe_0"),
        "flash_miso": "flash_miso" if design.machine.has_flash else "1'b0",
        **{
            name: ports.get(name, f"1'b{signal.idle}")
            for name, signal in NODE_SIGNALS.items()
            if signal.needs in PERIPHERALS and signal.direction != "out" and name not in EDM_STATUS
        },
        **{
            name: f"ethernet_{name}" if design.ethernet else f"{bits}'d0"
            for name, bits in UDP_INPUTS.items()
        },
        "edm_status": "{" + ", ".join(ports.get(name, "1'b0") for name in EDM_STATUS) + "}",
    }


def shown(design: Design) -> dict[str, str]:
    """{what a LED may show: the expression}"""
    given = inputs(design)
    of_all = {"running": "locked && !rst", "sending": "node_rs485_driver_enable"}
    if design.machine.orders:
        return {**dict.fromkeys(LEDS, "1'b0"), **of_all, "drive_fault": "node_fault"}
    return {
        **of_all,
        "estop": given["estop_open"],
        "limit_high": f"|{given['limit_high_open']}",
        "limit_low": f"|{given['limit_low_open']}",
        "drive_fault": f"!(&{given['drive_fault_n']})",
        "step": "|node_step",
        "drive_on": "|node_drive_enable",
    }


def assigned(design: Design) -> dict[str, str]:
    """{port that the top drives: the expression}"""
    board = design.board
    on = "!" if board.leds_low else ""
    found = {f"led_{name}": f"{on}({shown(design)[name]})" for name in board.leds}
    if has_usb(design):
        found["usb_tx"] = "node_rs485_tx"
    if design.machine.orders:
        found |= {name: f"node_{output}" for name, output in RELAY_FLASH.items()}
    elif design.machine.has_flash:
        found |= {name: f"node_{name}" for name in NODE_OUTPUTS if name.startswith("flash")}
    if design.ethernet and design.ethernet.has_reference:
        found |= {"eth_reference": "reference", "eth_reset_n": "!rst"}
    number = {axis.name: n for n, axis in enumerate(design.machine.axes)}
    for one in design.connections:
        if one.signal.direction == "out":
            axis, _, name = one.name.rpartition(".")
            index = f"[{number[axis]}]" if axis and len(number) > 1 else ""
            found[one.port] = f"node_{name}{index}"
        elif one.signal.direction == "both":
            found[one.port] = f"node_{one.name}_low ? 1'b0 : 1'bz"
    return found


def literal(value: int | str) -> str:
    """A value as a parameter of SystemVerilog."""
    return f'"{value}"' if isinstance(value, str) else str(value)


def level(one: Connection) -> float:
    """Volts at a pin while it is high."""
    return one.pad.volts if one.signal.direction == "out" else max(one.between.volts)


def boxes(design: Design) -> list[dict[str, Any]]:
    """The connectors of the drawing with their rows, from top to bottom; only pins in use."""
    found: list[dict[str, Any]] = []
    top = 40
    for name, its_pins in design.board.connectors.items():
        used = {one.pad.place: one for one in design.connections}
        rows: list[dict[str, Any]] = []
        for pin in its_pins:
            one = used.get(f"{name} {pin}")
            if one is None:
                continue
            y = top + HEAD + ROW * len(rows) + 8
            left, right = (411, 420) if one.signal.direction == "out" else (150, 141)
            arrow = f"M{right} {y} L{left} {y - 5} L{left} {y + 5} Z"
            if one.signal.direction == "both":
                arrow += f" M420 {y} L411 {y - 5} L411 {y + 5} Z"
            rows.append(
                {
                    "pin": pin,
                    "ball": one.pad.ball,
                    "signal": one.name,
                    "direction": one.signal.direction,
                    "volts": level(one),
                    "part": one.between.part,
                    "y": y,
                    "arrow": arrow,
                }
            )
        if rows:
            height = HEAD + ROW * len(rows)
            found.append({"name": name, "top": top, "height": height, "rows": rows})
            top += height + 16
    return found


def svg(design: Design) -> str:
    """The drawing: connector, pin, signal, level, and what is between."""
    drawn = boxes(design)
    height = drawn[-1]["top"] + drawn[-1]["height"] + 10 if drawn else 60
    longest = max((len(one.between.part) for one in design.connections), default=0)
    return TEMPLATES.get_template("wiring.svg.jinja").render(
        d=design,
        boxes=drawn,
        width=PARTS_LEFT + 20 + LETTER * longest,
        height=height,
        parts_left=PARTS_LEFT,
    )


def unconnected(design: Design) -> list[str]:
    """Signals of the machine that are listed as not connected."""
    machine = design.machine
    of_axes = [f"{axis.name}.{name}" for axis in machine.axes for name in axis.unused]
    return [*machine.unused, *machine.wiring[design.board.layout].unused, *of_axes]


def plug(design: Design) -> list[tuple[str, str]]:
    """(from, to) of the wires of the loop-back plug, at pins of the board; none without drives."""
    places = {one.name: one.pad.place for one in design.connections}
    found = [(GROUND, places["estop_open"])] if "estop_open" in places else []
    for axis in design.machine.axes:
        for name, source in PLUG.items():
            start = source if source == GROUND else places.get(f"{axis.name}.{source}")
            end = places.get(f"{axis.name}.{name}")
            if axis.drives and start and end:
                found.append((start, end))
    return found


def page(design: Design) -> str:
    """The wiring page."""
    return TEMPLATES.get_template("wiring.html.jinja").render(
        d=design,
        svg=Markup(svg(design)),
        connections=design.connections,
        unconnected=unconnected(design),
        plug=plug(design),
        front_ends=FRONT_ENDS,
        level=level,
    )


def top(design: Design) -> str:
    """The top as SystemVerilog."""
    return TEMPLATES.get_template("top.sv.jinja").render(
        d=design,
        ports=pins(design),
        outputs=outputs(design),
        inputs=inputs(design),
        assigned=assigned(design),
        udp_inputs=UDP_INPUTS,
        udp_outputs=[name for name in outputs(design) if name.startswith("udp")],
        literal=literal,
    )


def placeholder(design: Design) -> list[int]:
    """The words that a design is placed with in place of its firmware."""
    return block_ram.placeholder(256 * design.machine.memory_kib)


def hex_text(words: Iterable[int]) -> str:
    """Words of 32 bits as a file for $readmemh."""
    return "".join(f"{word:08x}\n" for word in words)


def files(design: Design) -> dict[str, str]:
    """{name: text} of all that is made before any tool runs."""
    family = design.board.part.family
    constraints, script = family.constraints, family.script
    more = {}
    if script:
        template = TEMPLATES.get_template(f"{script}.jinja")
        more[script] = template.render(d=design, bitstream=design.board.part.family.bitstream)
    if design.in_block_ram:
        more[f"{PLACEHOLDER}.hex"] = hex_text(placeholder(design))
    return {
        **more,
        "top.sv": top(design),
        constraints: TEMPLATES.get_template(f"{constraints}.jinja").render(
            d=design, pins=pins(design)
        ),
        "wiring.svg": svg(design),
        "wiring.html": page(design),
    }
