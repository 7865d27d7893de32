# SPDX-License-Identifier: Apache-2.0
"""A simulated node behind Ethernet: the Verilated node with LiteEth's core, and frames at the MII
pins of its PHY. It needs LiteX (`make litex`).

    node = EthernetNode(axes=1)
    node.send(frame)
    replies = node.frames()
"""

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

from boards import ethernet
from figures.node_bench import NodeBench
from moire.made import link_tables as layout
from mutation.library import library

TOP = "ethernet_bench"
CLK_HZ = 50_000_000
NIBBLE_CYCLES = 2  # of the clock of the node: 100 Mbit/s
PREAMBLE = bytes([0x55] * 7 + [0xD5])
FCS_BYTES = 4
GAP_BYTES = 12
SHORTEST = 60  # bytes of a frame without its FCS; a sender fills it up
SHORTER = 100  # the times of ARP are so much shorter than in a board
MAC, IP = 0x024D_C0A8_0132, 0xC0A8_0132  # 192.168.1.50
HOST_MAC, HOST_IP, HOST_PORT = 0x0200_0000_0001, 0xC0A8_0101, 4000
BYTE_S = 2 * NIBBLE_CYCLES / CLK_HZ


class EthernetNode(NodeBench):
    """The node, after its reset."""

    def __init__(self, axes: int = 1, interface: str = "mii") -> None:
        files = [
            Path(__file__).with_name(f"{TOP}.sv"),
            ethernet.core(interface, "simulation", CLK_HZ // SHORTER),
        ]
        super().__init__(library(TOP, {"AXES": axes}, more=files))
        self.begin(axes, mac_address=MAC, ip_address=IP)
        self.sent_at = 0  # cycle after the last nibble of the last frame sent
        self.nibbles: list[int] = []  # of the frame that the node is sending
        self.began = 0  # cycle in which it began
        self.began_at = 0  # cycle before the first nibble of the last frame sent
        self.reply_at = self.replied_at = 0  # of the last frame of the node: first and last cycle
        self.received: list[bytes] = []  # frames with preamble and FCS

    # ---- frames

    def cycles(self, number: int) -> None:
        """So many cycles of the PHY, each of which may bring a nibble of the node."""
        for _ in range(number):
            self.run(NIBBLE_CYCLES)
            if self.get("mii_tx_en"):
                if not self.nibbles:
                    self.began = self.now
                self.nibbles.append(self.get("mii_tx_data"))
            elif self.nibbles:
                low, high = self.nibbles[::2], self.nibbles[1::2]
                data = bytes(a | b << 4 for a, b in zip(low, high, strict=True))
                self.reply_at, self.replied_at = self.began, self.now
                self.received.append(data)
                self.nibbles = []

    def nibble(self, value: int) -> None:
        """A nibble to the node."""
        self.set(mii_rx_dv=1, mii_rx_data=value)
        self.cycles(1)

    def send(self, frame: bytes, spoil: int = 0, filled: bool = True) -> None:
        """A frame to the node, from its addresses to its data; preamble, filling and FCS are added.
        `spoil` is added to the FCS, bit by bit.
        """
        if filled:
            frame = frame.ljust(SHORTEST, b"\0")
        fcs = (zlib.crc32(frame) ^ spoil).to_bytes(FCS_BYTES, "little")
        self.began_at = self.now
        for byte in PREAMBLE + frame + fcs:
            self.nibble(byte & 0xF)
            self.nibble(byte >> 4)
        self.sent_at = self.now
        self.set(mii_rx_dv=0)
        self.cycles(2 * GAP_BYTES)

    def frames(self, cycles: int = 3000) -> Sequence[bytes]:
        """The frames that the node sends within some cycles of its PHY, without preamble and FCS.
        An AssertionError says that one of them is not whole.
        """
        self.cycles(cycles)
        found = []
        for data in self.received:
            assert data.startswith(PREAMBLE), f"no preamble: {data.hex()}"
            body, fcs = data[len(PREAMBLE) : -FCS_BYTES], data[-FCS_BYTES:]
            assert zlib.crc32(body).to_bytes(FCS_BYTES, "little") == fcs, "the FCS is wrong"
            found.append(body)
        self.received.clear()
        return found


def frame_bytes(packet: bytes) -> int:
    """Bytes on the wire of a packet: headers, preamble, FCS and the gap after the frame."""
    headers = len(datagram(b""))
    return len(PREAMBLE) + max(SHORTEST, headers + len(packet)) + FCS_BYTES + GAP_BYTES


def header(to_mac: int, kind: int) -> bytes:
    """The header of a frame of the host."""
    return struct.pack(">6s6sH", to_mac.to_bytes(6, "big"), HOST_MAC.to_bytes(6, "big"), kind)


def datagram(packet: bytes) -> bytes:
    """The frame of a request from the host, without preamble and FCS."""
    lengths = 28 + len(packet), 8 + len(packet)
    ip = struct.pack(">BBHHHBBHII", 0x45, 0, lengths[0], 0, 0, 64, 17, 0, HOST_IP, IP)
    total = sum(struct.unpack(">10H", ip))
    total = (total & 0xFFFF) + (total >> 16)
    checksum = ~((total & 0xFFFF) + (total >> 16)) & 0xFFFF
    udp = struct.pack(">HHHH", HOST_PORT, layout.UDP_PORT, lengths[1], 0)
    return header(MAC, 0x0800) + ip[:10] + struct.pack(">H", checksum) + ip[12:] + udp + packet


class EthernetHost:
    """A host that exchanges packets of the real-time link with the node, and answers its ARP. Tests
    use frames of another source.
    """

    def __init__(self, node: EthernetNode) -> None:
        self.node = node

    def exchange(self, request: bytes, cycles: int = 3000) -> bytes:
        """The reply to a request; empty if none comes within some cycles of the PHY."""
        self.node.send(datagram(request))
        for frame in self.node.frames(cycles):
            if frame[12:14] == b"\x08\x06":
                address = struct.pack(">6sI6sI", *(HOST_MAC.to_bytes(6, "big"), HOST_IP), b"", IP)
                arp = bytes.fromhex("0001080006040002") + address
                self.node.send(header(MAC, 0x0806) + arp)
                return self.packet(self.node.frames(cycles))
            return self.packet([frame])
        return b""

    @staticmethod
    def packet(frames: Sequence[bytes]) -> bytes:
        """The packet in the first of some frames."""
        return frames[0][42:] if frames else b""
