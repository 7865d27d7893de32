# SPDX-License-Identifier: Apache-2.0
"""Makes the Ethernet core of a board with LiteEth: ARP, ping, and UDP datagrams for the real-time
link of rtl/node.sv.

    PYTHONPATH=build/litex python -m boards.ethernet_core INTERFACE FAMILY CLK_HZ TX_NS RX_NS FILE

INTERFACE to the PHY: mii (100 Mbit/s), rgmii (1 Gbit/s), or wide_mii, which is mii with the data
path of rgmii. FAMILY: ecp5, xc7 or simulation. TX_NS and RX_NS: by how many nanoseconds the FPGA
delays the clock to the PHY and the data from it, with rgmii. The file is Verilog with one module,
`ethernet_core`; its port `udp` has the signals of the node's port as seen from the node.
`boards.ethernet` runs this; `make litex` fetches LiteX and LiteEth.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from liteeth import phy
from liteeth.common import eth_phy_description, eth_udp_user_description
from liteeth.core import LiteEthUDPIPCore
from liteeth.mac import crc, padding, preamble
from litex.build.generic_platform import GenericPlatform, Pins, Subsignal
from litex.build.lattice.platform import LatticePlatform
from litex.build.sim.common import sim_special_overrides
from litex.build.xilinx import Xilinx7SeriesPlatform
from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from litex.soc.interconnect.packet import PacketFIFO
from migen import ClockDomain, ClockDomainsRenamer, If, Signal

from boards.ethernet import NAME
from moire.made import link_tables as layout

LONGEST_FRAME = 2048  # bytes, rounded up
IO = [
    ("clk", 0, Pins(1)),
    ("rst", 0, Pins(1)),
    ("mac_address", 0, Pins(48)),
    ("ip_address", 0, Pins(32)),
    (
        "udp",
        0,
        *(
            Subsignal(name, Pins(width))
            for name, width in (
                *(("rx_valid", 1), ("rx_data", 8), ("rx_last", 1), ("rx_error", 1)),
                *(("rx_sender", 48), ("rx_ready", 1), ("tx_valid", 1), ("tx_data", 8)),
                *(("tx_last", 1), ("tx_receiver", 48), ("tx_length", 16), ("tx_ready", 1)),
            )
        ),
    ),
]
CLOCKS = ("clocks", 0, Subsignal("rx", Pins(1)), Subsignal("tx", Pins(1)))
MII = ("rx_dv 1", "rx_data 4", "tx_en 1", "tx_data 4")
PADS = {
    "mii": MII,
    "wide_mii": MII,
    "rgmii": ("rx_ctl 1", "rx_data 4", "tx_ctl 1", "tx_data 4"),
}
# bits of the data path, so that it is faster than the wire
WIDTHS = {"mii": 8, "wide_mii": 32, "rgmii": 32}


def pads(interface: str) -> tuple[Any, ...]:
    """The pads of the PHY as LiteX describes them."""
    rows = [row.split() for row in PADS[interface]]
    return ("pads", 0, *(Subsignal(name, Pins(int(width))) for name, width in rows))


class EthernetCore(LiteXModule):
    """LiteEth's core, with the datagrams of one UDP port as a stream of bytes."""

    def __init__(self, platform: Any, interface: str, clk_hz: int, delays: Sequence[float]) -> None:
        self.cd_sys = ClockDomain()
        self.comb += [
            self.cd_sys.clk.eq(platform.request("clk")),
            self.cd_sys.rst.eq(platform.request("rst")),
        ]
        kind, more = phy.LiteEthPHYMII, {}
        if interface == "rgmii":
            kind = phy.LiteEthECP5PHYRGMII
            more = dict(zip(("tx_delay", "rx_delay"), delays, strict=True))
        # the PHY itself is reset by the board; its clock domains are reset with the node
        self.phy = kind(
            platform.request("clocks"), platform.request("pads"), with_hw_init_reset=False, **more
        )
        self.comb += self.phy.crg._reset.storage.eq(self.cd_sys.rst)
        width = WIDTHS[interface]
        fast = width > 8
        # without it the check of the FCS never fails
        self.comb += self.phy.source.last_be.eq(self.phy.source.last)
        self.core = LiteEthUDPIPCore(
            self.phy,
            mac_address=platform.request("mac_address"),
            ip_address=platform.request("ip_address"),
            clk_freq=clk_hz,
            dw=width,
            with_ip_broadcast=False,  # else it takes packets for any address
            # the node takes a byte per cycle, which is slower than 1 Gbit/s
            rx_cdc_depth=LONGEST_FRAME * 8 // width if fast else 32,
            tx_cdc_depth=16,  # one cell of LUT RAM deep: its path is short
        )
        if fast:
            self.add_registers(width)
        self.connect(platform.request("udp"), width)

    def add_registers(self, width: int) -> None:
        """Registers between the stages that work with the clock of the PHY. LiteEth has none there,
        and paths through several stages took 9.4 ns of an ECP5, of which a cycle has 8.
        """
        core = self.core.mac.core
        tx, rx = core.tx_datapath.pipeline, core.rx_datapath.pipeline
        fifo = stream.ClockDomainCrossing
        for path, stage, after, bits, domain in (
            (tx, fifo, True, width, "eth_tx"),
            (tx, padding.LiteEthMACPaddingInserter, False, 8, "eth_tx"),
            (tx, crc.LiteEthMACCRC32Inserter, False, 8, "eth_tx"),
            (tx, preamble.LiteEthMACPreambleInserter, False, 8, "eth_tx"),
            (rx, crc.LiteEthMACCRC32Checker, False, 8, "eth_rx"),
            (rx, crc.LiteEthMACCRC32Checker, True, 8, "eth_rx"),
            (rx, fifo, False, width, "eth_rx"),
        ):
            register = stream.Buffer(eth_phy_description(bits), pipe_valid=True, pipe_ready=True)
            self.submodules += ClockDomainsRenamer(domain)(register)
            found = next(n for n, each in enumerate(path) if isinstance(each, stage))
            path.insert(found + after, register)

    def connect(self, udp: Any, width: int) -> None:
        """The port of the node, through converters of the width."""
        inner, outer = eth_udp_user_description(width), eth_udp_user_description(8)
        port = self.core.udp.crossbar.get_port(layout.UDP_PORT, dw=width)
        self.rx = rx = stream.StrideConverter(inner, outer)
        self.tx = tx = stream.StrideConverter(outer, inner)
        ended = Signal()  # the rest of the last word is no data
        self.comb += [
            port.source.connect(rx.sink),
            udp.rx_valid.eq(rx.source.valid & ~ended),
            udp.rx_data.eq(rx.source.data),
            udp.rx_last.eq(rx.source.last | rx.source.last_be),
            udp.rx_error.eq(rx.source.error),
            udp.rx_sender[16:].eq(rx.source.ip_address),
            udp.rx_sender[:16].eq(rx.source.src_port),
            rx.source.ready.eq(udp.rx_ready | ended),
        ]
        self.sync += If(
            rx.source.valid & rx.source.ready,
            ended.eq(~rx.source.last & (ended | rx.source.last_be)),
        )
        self.comb += [
            tx.sink.valid.eq(udp.tx_valid),
            tx.sink.data.eq(udp.tx_data),
            tx.sink.last.eq(udp.tx_last),
            tx.sink.last_be.eq(udp.tx_last),
            tx.sink.ip_address.eq(udp.tx_receiver[16:]),
            tx.sink.dst_port.eq(udp.tx_receiver[:16]),
            tx.sink.src_port.eq(layout.UDP_PORT),
            tx.sink.length.eq(udp.tx_length),
            udp.tx_ready.eq(tx.sink.ready),
        ]
        if width > 8:  # the node makes a reply slower than 1 Gbit/s: it is sent when it is whole
            self.whole = PacketFIFO(inner, payload_depth=layout.LONGEST_WORDS, param_depth=1)
            self.comb += [tx.source.connect(self.whole.sink), self.whole.source.connect(port.sink)]
        else:
            self.comb += tx.source.connect(port.sink)


def verilog(interface: str, family: str, clk_hz: int, delays: Sequence[float]) -> str:
    """The core as Verilog; the delays are in seconds."""
    io = [*IO, CLOCKS, pads(interface)]
    if family == "ecp5":
        platform: Any = LatticePlatform("LFE5U-25F-6BG381C", io, toolchain="trellis")
    elif family == "xc7":
        platform = Xilinx7SeriesPlatform("xc7a35ticsg324-1L", io, toolchain="vivado")
    else:
        platform = GenericPlatform("simulation", io)
    core = EthernetCore(platform, interface, clk_hz, delays)
    core.finalize()
    more = {} if family != "simulation" else {"special_overrides": sim_special_overrides}
    return str(platform.get_verilog(core, name=NAME, **more))


def main() -> int:
    if len(sys.argv) != 7:
        print(__doc__, file=sys.stderr)
        return 2
    interface, family, clk_hz, tx_ns, rx_ns, file = sys.argv[1:]
    delays = float(tx_ns) * 1e-9, float(rx_ns) * 1e-9
    Path(file).write_text(verilog(interface, family, int(clk_hz), delays), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
