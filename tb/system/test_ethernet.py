# SPDX-License-Identifier: Apache-2.0
"""The real-time link over Ethernet: a Verilated node with LiteEth's core and frames of scapy at its
MII pins. Without LiteX (`make litex`) the tests are skipped.
"""

import logging
import random
import re
from importlib.util import find_spec

import pytest

from boards import ethernet
from boards.toml_file import Misfit
from embed.litex_parts import has_ethernet
from figures.ethernet import CLK_HZ, SHORTER, EthernetNode
from moire.client.link import ProcessData
from moire.made import link_tables as layout
from tb.bench import seed

SET_UP = has_ethernet() and find_spec("scapy") is not None
if SET_UP:
    logging.getLogger("scapy").setLevel(logging.ERROR)
    from scapy.layers.inet import ICMP, IP, UDP
    from scapy.layers.l2 import ARP, Ether
    from scapy.packet import Raw

needs_litex = pytest.mark.skipif(not SET_UP, reason="LiteEth or scapy is not set up: make litex")
NODE_IP, NODE_MAC = "192.168.1.50", "02:4d:c0:a8:01:32"
HOST_PORT = 4000
ARP_S = 1  # at least what LiteEth waits for an answer, with its repetitions
DATA = ProcessData(
    writes=["axis.output_limit", "axis.control"], reads=["axis.position", "axis.faults"]
)


class Host:
    """A computer at the other end of the cable, which answers ARP unless it is silent."""

    def __init__(self, node, number=1):
        self.node, self.silent = node, False
        self.ip, self.mac = f"192.168.1.{number}", f"02:00:00:00:00:{number:02x}"

    def ethernet(self, to=NODE_MAC, **fields):
        return Ether(src=self.mac, dst=to, **fields)

    def packet(self, upper, **fields):
        return self.ethernet() / IP(**{"src": self.ip, "dst": NODE_IP} | fields) / upper

    def ask(self, frame, **how):
        """The frames that answer a frame, without the requests of ARP."""
        self.node.send(bytes(frame), **how)
        found, left = [], True
        while left:
            frames = [Ether(one) for one in self.node.frames()]
            left = [one for one in frames if ARP in one and one[ARP].op == 1 and not self.silent]
            found += [one for one in frames if one not in left]
            for one in left:
                asked = self.ip == one[ARP].pdst
                fields = dict(hwsrc=self.mac, psrc=self.ip, hwdst=NODE_MAC, pdst=NODE_IP)
                if asked:
                    self.node.send(bytes(self.ethernet() / ARP(op=2, **fields)))
        return found

    def arp(self):
        query = ARP(op=1, hwsrc=self.mac, psrc=self.ip, pdst=NODE_IP)
        return self.ask(self.ethernet("ff:ff:ff:ff:ff:ff") / query)

    def datagram(self, request, port=HOST_PORT, **fields):
        return self.packet(UDP(**{"sport": port, "dport": layout.UDP_PORT} | fields) / Raw(request))

    def link(self, request, port=HOST_PORT):
        """The packet that answers a request; None without an answer."""
        answers = self.ask(self.datagram(request, port))
        assert len(answers) <= 1
        for one in answers:
            assert (one.dst, one[IP].src, one[IP].dst) == (self.mac, NODE_IP, self.ip)
            assert (one[UDP].sport, one[UDP].dport) == (layout.UDP_PORT, port)
            checked = IP(bytes(one[IP]))
            del checked.chksum
            assert IP(bytes(checked)).chksum == one[IP].chksum
            return bytes(one[UDP].payload)
        return None


@pytest.fixture(scope="module", params=["mii", "wide_mii"])
def started(request):
    """With the data path for 100 Mbit/s, and with that for 1 Gbit/s."""
    return EthernetNode(interface=request.param)


@pytest.fixture
def node(started):
    """The node with its drive off."""
    DATA.switch_off(started)
    started.write_named("axis.control")
    return started


def set_up(node):
    return DATA.set_up(node, watchdog_s=0)


@needs_litex
def test_arp_and_ping_are_answered(node):
    host = Host(node)
    (answer,) = host.arp()
    assert answer.dst == host.mac and answer[ARP].op == 2
    assert (answer[ARP].hwsrc, answer[ARP].psrc) == (NODE_MAC, NODE_IP)
    for size in (1, 56):
        content = bytes(range(size))
        (answer,) = host.ask(host.packet(ICMP(id=7, seq=size) / Raw(content)))
        assert (answer[ICMP].type, answer[ICMP].id, answer[ICMP].seq) == (0, 7, size)
        assert bytes(answer[ICMP].payload)[:size] == content
        checked = ICMP(bytes(answer[ICMP])[: 8 + size])
        del checked.chksum
        assert ICMP(bytes(checked)).chksum == answer[ICMP].chksum


@needs_litex
def test_requests_are_played_and_answered_to_any_port(node):
    host, link = Host(node), set_up(node)
    for n, port in enumerate((HOST_PORT, 1, 65535, HOST_PORT)):
        reply = link.reply(host.link(link.request(0, [100 + n, 0]), port))
        assert reply and not any(reply.refused.values())
        assert node.read_named("axis.output_limit") == {"value": 100 + n}


@needs_litex
def test_a_reply_of_any_length_is_one_whole_frame(node):
    host = Host(node)
    for words in (1, 2, layout.MOST_VALUES):
        data = ProcessData(writes=[], reads=["axis.faults"] * words)
        link = data.set_up(node, watchdog_s=0)
        assert link.reply(host.link(link.request(0, [])))


@needs_litex
def test_frames_that_are_not_for_the_node_or_are_malformed_change_nothing(node):
    host, link = Host(node), set_up(node)
    before = sum(link.reply(host.link(link.request(0, [1, 0]))).refused.values())
    request = link.request(0, [2, 0])
    good = bytes(host.datagram(request))
    datagram = UDP(sport=HOST_PORT, dport=layout.UDP_PORT) / Raw(request)
    frames = [
        host.packet(datagram, dst="192.168.1.51"),
        host.packet(datagram, version=6),
        host.packet(datagram, chksum=1),
        host.packet(datagram, proto=6),
        host.datagram(request, dport=layout.UDP_PORT + 1),
        host.datagram(request, len=8 + len(request) - 4),
        host.datagram(request + b"\0"),
        host.datagram(request[:-1]),
        host.datagram(b""),
        host.packet(Raw(b"")),
        good[:14],
        good[:38],
        b"",
    ]
    for n, frame in enumerate(frames):
        assert not host.ask(frame), f"frame {n}"
        assert node.read_named("axis.output_limit") == {"value": 1}, f"frame {n}"
    assert not host.ask(good, spoil=1 << random.Random(seed()).randrange(32)), "a wrong FCS"
    assert node.read_named("axis.output_limit") == {"value": 1}
    reply = link.reply(host.link(request))
    assert reply and node.read_named("axis.output_limit") == {"value": 2}
    after = sum(reply.refused.values())
    # of a cut one, a longer one, a shorter one, an empty one, one without its data, a wrong FCS
    assert after - before == 6


@needs_litex
def test_while_a_drive_is_on_only_its_host_is_heard(node):
    host, other, link = Host(node), Host(node, 2), set_up(node)
    node.write_named("bus.watchdog_time")
    node.write_named("axis.strobes", reset_faults=1)
    enable = 3
    before = link.reply(host.link(link.request(0, [1, enable]))).refused["foreign"]
    node.cycles(10)
    assert node.get("drive_enable")
    request = link.request(0, [2, enable])
    assert other.link(request) is None and host.link(request, HOST_PORT + 1) is None
    assert node.read_named("axis.output_limit") == {"value": 1}
    reply = link.reply(host.link(request))
    assert reply and reply.refused["foreign"] - before == 2
    assert link.reply(host.link(link.request(0, [3, 0])))
    node.cycles(10)
    assert not node.get("drive_enable")
    assert link.reply(other.link(link.request(0, [4, 0])))


@needs_litex
def test_a_host_that_does_not_answer_arp_stops_the_link_only_for_a_while(node):
    silent, host, link = Host(node, 9), Host(node), set_up(node)
    silent.silent = True
    assert link.reply(host.link(link.request(0, [3, 0]))), "from now on its MAC address is known"
    assert not [one for one in silent.ask(silent.datagram(link.request(0, [1, 0]))) if UDP in one]
    assert host.link(link.request(0, [2, 0])) is None
    node.run(ARP_S * CLK_HZ // SHORTER)
    # the IP checksum of LiteEth's next packet is wrong, so that a stock host ignores it
    host.ask(host.datagram(link.request(0, [3, 0])))
    assert link.reply(host.link(link.request(0, [4, 0])))
    assert node.read_named("axis.output_limit") == {"value": 4}


@needs_litex
def test_the_pins_of_rgmii_are_delayed_in_steps_of_25_ps():
    """The clock to the PHY, five levels to it, and five levels from it."""
    text = ethernet.core("rgmii", "ecp5", 50_000_000, (0.5, 2)).read_text()
    delays = re.findall(r"DEL_VALUE \(\d+'d(\d+)\)", text)
    assert sorted(map(int, delays)) == [0] * 5 + [20] + [80] * 5


@needs_litex
def test_the_core_for_the_arty_is_made_of_its_flip_flops():
    """The resets of both clocks of the PHY are synchronised by flip-flops with a set."""
    text = ethernet.core("mii", "xc7", 50_000_000).read_text()
    assert len(re.findall(r"^FDPE ", text, re.M)) >= 4 and "TRELLIS" not in text


@needs_litex
def test_a_core_that_cannot_be_made_is_refused():
    with pytest.raises(Misfit, match="(?s)LiteEth has not made the Ethernet core: .*sgmii"):
        ethernet.core("sgmii", "simulation", 50_000_000)


def test_without_litex_the_core_says_what_is_missing(monkeypatch):
    monkeypatch.setattr(ethernet, "has_ethernet", lambda: False)
    with pytest.raises(Misfit, match="make litex"):
        ethernet.core("mii", "simulation", 50_000_000)
