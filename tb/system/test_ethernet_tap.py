# SPDX-License-Identifier: Apache-2.0
"""A simulated node behind a TAP device: the kernel of Linux resolves its address, pings it, and
carries the datagrams of the link. Skipped without LiteX, and where the machine does not allow it.
"""

import os
import subprocess
import sys

import pytest

from embed.litex_parts import has_ethernet

ALLOWED = """
import fcntl, struct
fcntl.ioctl(open("/dev/net/tun", "r+b", buffering=0), 0x400454CA, struct.pack("16sH", b"", 0x1002))
"""
PROGRAM = """
import socket, struct
from figures.ethernet import EthernetNode
from figures.ethernet_tap import NodeBehindTap
from moire.client.link import ProcessData
from moire.made.link_tables import UDP_PORT

NODE, WAIT_S = "192.168.1.50", 20
data = ProcessData(writes=["axis.output_limit"], reads=["axis.output_limit"])
node = EthernetNode()
link = data.set_up(node, watchdog_s=0)
with NodeBehindTap(node):
    ping = socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP)
    ping.settimeout(WAIT_S)
    echo = struct.pack(">BBHHH", 8, 0, 0xF7F7, 0x0500, 0x0307)
    total = sum(struct.unpack(">4H", echo)) - 0xF7F7
    ping.sendto(struct.pack(">BBHHH", 8, 0, 0xFFFF - total, 0x0500, 0x0307), (NODE, 0))
    answer = ping.recv(100)
    assert answer[20] == 0 and answer[24:28] == echo[4:], answer
    host = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    host.settimeout(WAIT_S)
    host.connect((NODE, UDP_PORT))
    for value in (5, 6):
        host.send(link.request(0, [value]))
        assert link.reply(host.recv(1000)).values == (value,)
"""


def in_namespace(program):
    """Run a Python program in a network namespace of its own."""
    return subprocess.run(
        ["unshare", "--net", sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
    )


def test_the_kernel_pings_the_node_and_carries_its_datagrams():
    if not has_ethernet():
        pytest.skip("LiteEth is not set up: make litex")
    try:
        allowed = in_namespace(ALLOWED)
    except FileNotFoundError as missing:
        pytest.skip(f"no network namespaces: {missing}")
    if allowed.returncode:
        pytest.skip(f"the machine does not allow a TAP device: {allowed.stderr.splitlines()[-1]}")
    done = in_namespace(PROGRAM)
    assert done.returncode == 0, done.stderr[-2000:]
