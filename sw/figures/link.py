# SPDX-License-Identifier: Apache-2.0
"""Figures of the real-time link: is a bad packet ever acted upon, how large is the hardware, and
how fast is it with eight axes.

The bad packets go into the Verilated process_link (link_run.cpp). A packet counts as acted upon
when it causes an access of the register bus or a reply, or when it is not counted as refused
exactly once. The times are those of a whole simulated node of 60 MHz, with its firmware; those over
Ethernet of one of 50 MHz with LiteEth (`make litex`), those over SPI of one of 60 MHz without
firmware.
"""

from functools import cache
from pathlib import Path
from typing import cast

from embed.litex_parts import has_ethernet
from figures.common import Absent, Figure, Quick, bar, console, shares
from figures.ethernet import BYTE_S, GAP_BYTES, EthernetHost, EthernetNode, frame_bytes
from figures.ethernet import CLK_HZ as ETHERNET_CLK_HZ
from figures.spi import CLK_HZ as SPI_CLK_HZ
from figures.spi import GAP_CYCLES, SCLK_CYCLES, SCLK_HZ, SpiNode
from figures.synthesis import ELABORATED, elaborated, lut4s, netlist_of, source_of
from moire.bus.cobs import PacketReader, sealed
from moire.bus.link_gateway import LONGEST_STUFFED
from moire.bus.link_spi import reply_in, transfer_of
from moire.client.bus import Bus
from moire.client.link import ProcessData
from moire.client.node import Node as ClientNode
from moire.errors import MoireError
from twin import Axis, Node, Twin, TwinTransport
from twin.build import ROOT, run, simulation
from twin.nodes.twin import drives

TOP = "process_link"
RTL = ROOT / "rtl" / "link" / f"{TOP}.sv"
DRIVER = Path(__file__).with_name("link_run.cpp")
DATAGRAM_BENCH = DRIVER.with_name("datagram_bench.sv")
PACKETS = 10**6
SHARE = 10**5  # of one run, each with a seed of its own


CLK_HZ = 60_000_000
NODE = {"FILTERS": 0, "HAS_SINE": 0, "HAS_LINK": 1}
USB_CYCLES, RS485_CYCLES = 5, 20  # of a bit: 12 and 3 Mbaud
AXES = 8
DATA = ProcessData(
    writes=[
        "axis.set_point_position",
        "axis.set_point_velocity",
        "node.set_point_tick",
        "node.set_point_commit",
    ],
    reads=["axis.position", "axis.faults"],
)
TURNAROUND = 2  # bits from a reply to the next request
BUS_BAUD = 1_000_000
STEP_S = 4 / CLK_HZ  # resolution of a time
LONGEST_S = 0.005  # a cycle


@cache
def cycle_times(bit_cycles: int, cycles: int, axes: int, seed: int) -> tuple[float, float]:
    """Longest of some cycles in seconds: from the end of a reply to that of the next one, and that
    without the bits on the line.
    """
    with Twin(
        [Node(1, [Axis("stepper_stage")] * axes)],
        seed=seed,
        clk_hz=CLK_HZ,
        node_parameters={**drives("HAS_STEPPER"), **NODE},
    ) as twin:
        bus = Bus(TwinTransport(twin))
        twin.run_until_ready()
        bus.set_baud(BUS_BAUD, [1])
        line, reader = twin.link(bit_cycles=bit_cycles), PacketReader(LONGEST_STUFFED)
        link = DATA.set_up(bus.node(1), bit_time=line.bit_time, watchdog_s=0)
        whole, inside = [], []
        for _ in range(cycles):
            request = sealed(link.request(0, [0] * link.writes))
            begin, packets = twin.time(), list[bytes]()
            twin.run(TURNAROUND * bit_cycles / CLK_HZ)
            line.send(request)
            while not packets and twin.time() - begin < LONGEST_S:
                twin.run(STEP_S)
                packets = reader.feed(line.take())
            reply = link.reply(packets[0]) if packets else None
            if reply is None or any(reply.refused.values()):
                raise MoireError(f"no good reply within {LONGEST_S} s: {reply}")
            took = twin.time() - begin
            bits = TURNAROUND + 10 * (len(request) + len(sealed(packets[0])))
            whole.append(took)
            inside.append(took - bits * bit_cycles / CLK_HZ)
        console.print(
            f"{axes} axes, {len(request)} and {len(sealed(packets[0]))} bytes of "
            f"{10 * bit_cycles} cycles: {1e6 * max(whole):.1f} us, "
            f"{1e6 * max(inside):.1f} us without the line"
        )
        return max(whole), max(inside)


def link_serial_us(cycles: int = 20, axes: int = AXES, seed: int = 1) -> float:
    return 1e6 * cycle_times(USB_CYCLES, cycles, axes, seed)[1]


def link_usb_khz(cycles: int = 20, axes: int = AXES, seed: int = 1) -> float:
    return 1e-3 / cycle_times(USB_CYCLES, cycles, axes, seed)[0]


def link_rs485_khz(cycles: int = 20, axes: int = AXES, seed: int = 1) -> float:
    return 1e-3 / cycle_times(RS485_CYCLES, cycles, axes, seed)[0]


@cache
def ethernet_times(cycles: int, axes: int) -> tuple[float, float]:
    """As `cycle_times`, over Ethernet at 100 Mbit/s: from the first nibble of a request to that of
    the next one, and from the last nibble of a request to the first one of its reply. Meanwhile the
    soft core does nothing but read registers, one after the other.
    """
    if not has_ethernet():
        raise Absent("LiteEth, which makes the Ethernet core, is not set up: make litex")
    node = EthernetNode(axes)
    host = EthernetHost(node)
    link = DATA.set_up(cast(ClientNode, node), watchdog_s=0)
    if link.reply(host.exchange(link.request(0, [0] * link.writes))) is None:
        raise MoireError("the first request has no good reply")
    node.occupy_bus()
    whole, inside = [], []
    for _ in range(cycles):
        request = link.request(0, [0] * link.writes)
        packet = host.exchange(request)
        reply = link.reply(packet)
        if reply is None or any(reply.refused.values()):
            raise MoireError(f"no good reply over Ethernet: {reply}")
        took = node.reply_at - node.sent_at
        on_wire = frame_bytes(request) + frame_bytes(packet)
        inside.append(took / ETHERNET_CLK_HZ)
        whole.append(inside[-1] + on_wire * BYTE_S)
        measured = (node.replied_at - node.began_at) / ETHERNET_CLK_HZ + 2 * GAP_BYTES * BYTE_S
        if abs(measured - whole[-1]) > 1e-6:
            raise MoireError(f"a cycle took {measured} s, calculated from bytes {whole[-1]} s")
    console.print(
        f"{axes} axes over Ethernet, {on_wire} bytes on the wire: {1e6 * max(whole):.1f} us, "
        f"{1e6 * max(inside):.1f} us without the wire"
    )
    return max(whole), max(inside)


def link_udp_us(cycles: int = 20, axes: int = AXES) -> float:
    return 1e6 * ethernet_times(cycles, axes)[1]


def link_udp_khz(cycles: int = 20, axes: int = AXES) -> float:
    return 1e-3 / ethernet_times(cycles, axes)[0]


@cache
def spi_times(cycles: int, axes: int) -> tuple[float, float]:
    """As `cycle_times`, over SPI: a whole transfer with the gap after it, and from the end of the
    request to the begin of the reply in it. Meanwhile the soft core does nothing but read
    registers.
    """
    node = SpiNode(axes)
    link = DATA.set_up(cast(ClientNode, node), watchdog_s=0)
    node.occupy_bus()
    whole, inside = [], []
    for _ in range(cycles):
        request = link.request(0, [0] * link.writes)
        sent = transfer_of(link, request, SCLK_HZ)
        received = node.transfer(sent)
        packet = reply_in(received, link)
        reply = link.reply(packet)
        if reply is None or any(reply.refused.values()):
            raise MoireError(f"no good reply over SPI: {reply}")
        begin = len(received) - len(received.lstrip(b"\0"))
        inside.append((begin - len(request)) * 8 / SCLK_HZ)
        took = node.ended_at - node.began_at
        if took != 8 * SCLK_CYCLES * len(sent) + 3 * GAP_CYCLES:
            raise MoireError(f"a transfer of {len(sent)} bytes took {took} cycles")
        whole.append(took / SPI_CLK_HZ)
    console.print(
        f"{axes} axes over SPI, {len(request)} and {len(packet)} bytes, {len(sent)} in a transfer: "
        f"{1e6 * max(whole):.1f} us, {1e6 * max(inside):.1f} us from the request to the reply"
    )
    return max(whole), max(inside)


def link_spi_us(cycles: int = 20, axes: int = AXES) -> float:
    return 1e6 * spi_times(cycles, axes)[1]


def link_spi_khz(cycles: int = 20, axes: int = AXES) -> float:
    return 1e-3 / spi_times(cycles, axes)[0]


@cache
def program(top: Path) -> Path:
    return simulation(DRIVER, top)


def link_wrong_accepted(count: int = PACKETS, seed: int = 1) -> float:
    tried = wrong = missed = 0
    with bar(f"{count:.0e} packets, and as many datagrams") as progress:
        task = progress.add_task("", total=2 * count)
        for top in (RTL, DATAGRAM_BENCH):
            for size, number in shares(count, SHARE, seed):
                words = run([program(top), size, number], "link_run").split()
                found = [int(word) for word in words]
                tried, wrong, missed = tried + found[0], wrong + found[1], missed + found[2]
                progress.advance(task, size)
    console.print(
        f"{tried} bad packets, {wrong} acted upon or not counted; "
        f"of the good ones between them {missed} refused"
    )
    if missed:
        raise MoireError(
            f"{missed} good packets were refused: the count of wrong ones means nothing"
        )
    return wrong


def link_lut(place: bool = True, seed: int = 1) -> float:
    """Without `place`, the word-level cells of the module."""
    if not place:
        return elaborated(source_of(TOP))
    return lut4s(netlist_of(source_of(TOP), {}, "ecp5", seed), TOP)


SHORT = Quick({"cycles": 2, "axes": 2}, "2 cycles of 2 axes")
FIGURES = {
    "link_wrong_accepted": Figure(
        link_wrong_accepted,
        "packets",
        "of 10^6 damaged, foreign, replayed, truncated or hostile packets to the real-time link, "
        "and of as many UDP datagrams: acted upon",
        "0",
        Quick({"count": 2000}, "2000 packets"),
        0,
    ),
    "link_lut": Figure(
        link_lut,
        "LUT4",
        "hardware of the real-time link without its carrier and its registers, from Yosys for the "
        "ECP5",
        "<= 900",
        ELABORATED,
        0,
    ),
    "link_serial_us": Figure(
        link_serial_us,
        "us",
        "packet in to packet out: time of a cycle without that of the bytes on the line, 8 axes "
        "(a set-point of 26 words written, 24 words read) at 60 MHz, the longest of 20 cycles of a "
        "simulated node",
        "<= 20",
        SHORT,
        0,
    ),
    "link_udp_us": Figure(
        link_udp_us,
        "us",
        "the same over Ethernet: from the end of a frame in to the begin of the frame out, at "
        "50 MHz, while the soft core does nothing but read registers; LiteEth included",
        "<= 10",
        SHORT,
        0,
    ),
    "link_udp_khz": Figure(
        link_udp_khz,
        "kHz",
        "cycles for these 8 axes over UDP at 100 Mbit/s, one after the other, with all bytes of "
        "the frames and the gaps between them",
        ">= 8",
        SHORT,
        2,
    ),
    "link_spi_us": Figure(
        link_spi_us,
        "us",
        "the same over SPI at 12 MHz: from the last bit of the request to the first one of the "
        "reply, in the same transfer, at 60 MHz, while the soft core does nothing but read "
        "registers",
        "<= 20",
        SHORT,
        1,
    ),
    "link_spi_khz": Figure(
        link_spi_khz,
        "kHz",
        "cycles for these 8 axes over SPI at 12 MHz, one transfer after the other, with the time "
        "that a host leaves for the node",
        ">= 4",
        SHORT,
        2,
    ),
    "link_usb_khz": Figure(
        link_usb_khz,
        "kHz",
        "cycles for these 8 axes over USB-serial at 12 Mbaud, one after the other; the delays of "
        "USB and of the host are not included",
        ">= 2",
        SHORT,
        2,
    ),
    "link_rs485_khz": Figure(
        link_rs485_khz,
        "kHz",
        "cycles for these 8 axes over RS-485 at 3 Mbaud, one after the other",
        ">= 1",
        SHORT,
        2,
    ),
}
