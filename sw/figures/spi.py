# SPDX-License-Identifier: Apache-2.0
"""A simulated node with its real-time link over SPI, and a host at its pins.

node = SpiNode(axes=2)
received = node.transfer(sent)
"""

from figures.node_bench import NodeBench
from mutation.library import library

CLK_HZ = 60_000_000
SCLK_CYCLES, HIGH_CYCLES = 5, 2  # of the clock of the SPI, the shortest period
SCLK_HZ = CLK_HZ // SCLK_CYCLES
GAP_CYCLES = 2  # before the clock and after it, and between two transfers
TICK_HZ = 4000
NODE = {"HAS_SET_POINTS": 255, "HAS_SINE": 0, "FILTERS": 0, "HAS_BRIDGE": 0, "HAS_DAC": 0}
LINK = {"HAS_LINK": 1, "LINK_CARRIER": 2, "MEMORY_BYTES": 4096}
HIGH = (
    *("rs485_rx", "link_rx", "link_cs_n", "i2c_scl", "i2c_sda", "peer_rx", "sensor_rx"),
    *("keyboard_clock", "keyboard_data", "edm_clock", "edm_data"),
)


class SpiNode(NodeBench):
    """The node, after its reset."""

    def __init__(self, axes: int = 1) -> None:
        parameters = {"AXES": axes, "CLK_HZ": CLK_HZ, "TICK_HZ": TICK_HZ, **NODE, **LINK}
        super().__init__(library("node", parameters))
        self.begin(axes, address=1, **dict.fromkeys(HIGH, 1))
        self.began_at = self.ended_at = 0  # of the last transfer: the cycle before it, and after it

    def bit(self, level: int) -> int:
        """A bit of the host; returns the one that it reads at the rise of the clock."""
        self.set(link_sclk=0, link_mosi=level)
        self.run(SCLK_CYCLES - HIGH_CYCLES)
        read = self.get("link_miso")
        self.set(link_sclk=1)
        self.run(HIGH_CYCLES)
        return read

    def transfer(self, sent: bytes, bits: int | None = None) -> bytes:
        """A transfer, or its first bits; returns the whole bytes that the host has read."""
        self.began_at = self.now
        self.set(link_cs_n=0)
        self.run(GAP_CYCLES)
        read, levels = bytearray(), [byte >> n & 1 for byte in sent for n in range(7, -1, -1)]
        word = 1
        for level in levels[:bits]:
            word = word << 1 | self.bit(level)
            if word >> 8:
                read.append(word & 0xFF)
                word = 1
        self.set(link_sclk=0)
        self.run(GAP_CYCLES)
        self.set(link_cs_n=1)
        self.run(GAP_CYCLES)
        self.ended_at = self.now
        return bytes(read)
