# SPDX-License-Identifier: Apache-2.0
"""The real-time link over SPI: transfers between a Verilated node and the SPI devices of the Python
client and of the driver for LinuxCNC, both in place of the kernel's.
"""

import ctypes
import errno
import os
import random

import pytest

from figures.spi import SCLK_HZ, SpiNode
from linuxcnc_config.set_up import set_up
from moire.bus import link_spi
from moire.bus.link import Link
from moire.bus.link_spi import SpiDevice, reply_bytes, reply_in, transfer_of, turnround_bytes
from moire.client.link import ProcessData
from moire.errors import OutOfRange, PortError
from moire.made import link_tables as layout
from tb.bench import seed
from tb.linuxcnc.compiled import Node, Transfer, driver

AXES = 2
TICK = 15_000
SESSION = 0x4D01
DEVICE = "/dev/spidev0.0"
DATA = ProcessData(
    writes=["axis.output_limit"], reads=["axis.position", "axis.faults", "node.time_stamp"]
)


@pytest.fixture(scope="module")
def started():
    return SpiNode(AXES)


@pytest.fixture
def node(started):
    """The node with its link off and no errors."""
    DATA.switch_off(started)
    started.write_named("link.framing_errors")
    return started


def test_requests_of_any_values_are_answered_in_their_own_transfer(node):
    dice = random.Random(seed())
    link = DATA.set_up(node, watchdog_s=0)
    refused = sum(link.reply(exchange(node, link, [0, 0])).refused.values())
    for _ in range(5):
        values = [dice.randrange(1 << 15) for _ in range(AXES)]
        reply = link.reply(exchange(node, link, values))
        assert reply and sum(reply.refused.values()) == refused
        assert [node.read_named("axis.output_limit", axis=n)["value"] for n in (0, 1)] == values
    assert node.read_named("link.framing_errors") == {"value": 0}


def exchange(node, link, values):
    return reply_in(node.transfer(transfer_of(link, link.request(0, values), SCLK_HZ)), link)


def test_a_transfer_that_ends_anywhere_is_counted_and_the_next_one_is_whole(node):
    dice = random.Random(seed())
    link = DATA.set_up(node, watchdog_s=0)
    damaged = link.reply(exchange(node, link, [1, 1])).refused["damaged"]
    cut = 0
    for n in range(20):
        request = link.request(0, [n, n])
        sent = transfer_of(link, request, SCLK_HZ)
        bits = dice.randrange(1, 8 * (len(request) + 4))
        node.transfer(sent, bits)
        cut += 1
        damaged += bits < 8 * len(request)
        reply = link.reply(exchange(node, link, [n, 100 + n]))
        assert reply and reply.refused["damaged"] == damaged % 256
        assert node.read_named("axis.output_limit", axis=1) == {"value": 100 + n}
    assert node.read_named("link.framing_errors") == {"value": cut}


def test_the_longest_lists_fit_into_the_time_that_a_host_leaves(node):
    reads = layout.MOST_VALUES
    writes = ["axis.set_point_velocity"] * (layout.MOST_VALUES // AXES)
    data = ProcessData(writes=writes, reads=["node.build"] * reads)
    link = data.set_up(node, watchdog_s=0)
    received = node.transfer(transfer_of(link, link.request(0, [0] * link.writes), SCLK_HZ))
    assert link.reply(reply_in(received, link))


def test_without_the_link_no_byte_comes(node):
    link = Link(SESSION, 2, 5)
    assert exchange(node, link, [0, 0]) == b""
    assert link.reply(b"") is None


# ---- the client's device


class Kernel:
    """The kernel's side of the client's SPI device."""

    def __init__(self, node, monkeypatch, tmp_path):
        self.node, self.asked, self.file = node, [], tmp_path / "spidev"
        self.file.touch()
        monkeypatch.setattr(link_spi.os, "open", lambda path, flags: self.open(path, flags))
        monkeypatch.setattr(link_spi.fcntl, "ioctl", self.ioctl)
        self.fails = False

    open_file = staticmethod(os.open)

    def open(self, path, flags):
        assert path == DEVICE
        return self.open_file(self.file, flags)

    def ioctl(self, file, request, argument):
        self.asked.append((request, argument))
        if self.fails:
            raise OSError(errno.EIO, "Input/output error")
        if request == link_spi.MESSAGE:
            out, back, length, hz, _, bits, *_ = link_spi.TRANSFER.unpack(argument)
            assert (hz, bits) == (SCLK_HZ, 8)
            ctypes.memmove(back, self.node.transfer(ctypes.string_at(out, length)), length)


def test_the_client_exchanges_packets_at_an_spi_device(node, monkeypatch, tmp_path):
    kernel = Kernel(node, monkeypatch, tmp_path)
    link = DATA.set_up(node, watchdog_s=0)
    with SpiDevice(DEVICE, SCLK_HZ) as device:
        assert kernel.asked == [(link_spi.WRITE_MODE, b"\0"), (link_spi.WRITE_BITS, b"\x08")]
        for value in (1, 2):
            reply = link.reply(device.exchange(link, link.request(0, [value, 7])))
            assert reply and node.read_named("axis.output_limit") == {"value": value}
        kernel.fails = True
        with pytest.raises(PortError, match="has made no transfer: Input/output error"):
            device.exchange(link, link.request(0, [3, 3]))


def test_a_device_that_cannot_be_used_is_refused_in_a_sentence(tmp_path):
    for hz in (0, 10**9):
        with pytest.raises(OutOfRange, match="choose from 1000 to 50000000"):
            SpiDevice(DEVICE, hz)
    with pytest.raises(PortError, match="switch the SPI of this computer on"):
        SpiDevice(str(tmp_path / "spidev0.0"), SCLK_HZ)
    with pytest.raises(PortError, match="cannot be opened: Is a directory"):
        SpiDevice(str(tmp_path), SCLK_HZ)
    with pytest.raises(PortError, match="is no SPI device"):
        SpiDevice("/dev/null", SCLK_HZ)


def test_the_time_for_the_node_is_rounded_up_to_bytes():
    assert [turnround_bytes(100, hz) for hz in (10**6, 10_000_000, 12_000_000)] == [2, 19, 23]
    link = Link(SESSION, 2, 5)
    assert reply_bytes(link) == 4 * 12
    assert reply_in(bytes(9) + bytes([layout.KIND_REPLY]) + bytes(60), link)[0] == 0xA2
    assert len(reply_in(bytes(9) + bytes([layout.KIND_REPLY]) + bytes(60), link)) == 48


# ---- the driver for LinuxCNC


@pytest.fixture
def spidev(node, tmp_path):
    """The node at the driver's SPI device: (bytes, clock in Hz) of each transfer."""
    file = tmp_path / "spidev"
    file.touch()
    calls = []

    @Transfer
    def transfer(sent, received, length, hz):
        calls.append((length, hz))
        got = node.transfer(ctypes.string_at(sent, length))
        ctypes.memmove(received, got, length)
        return True

    driver().spidev_set(str(file).encode(), transfer)
    yield calls
    driver().spidev_set(b"", Transfer())


def opened(axes=AXES, where=f"spi:{DEVICE}:{SCLK_HZ}"):
    """The node as the driver has it after its check, and whether it fits."""
    found = Node()
    patience = ctypes.c_int64(0)
    fits = driver().node_open(ctypes.byref(found), where.encode(), axes, SESSION, patience)
    return found, fits


def test_the_driver_checks_a_node_at_an_spi_device(node, spidev):
    node.write_named("node.tick_period", value=TICK)
    set_up(node, AXES, SESSION)
    found, fits = opened()
    try:
        assert fits, found.why
        assert (found.drives, found.clk_hz, found.tick) == (AXES, 60_000_000, TICK)
        assert {hz for _, hz in spidev} == {SCLK_HZ}
        (length,) = {length for length, _ in spidev}
        words = found.link.writes + layout.FRAME_WORDS
        words += found.link.reads + layout.REPLY_FRAME_WORDS
        assert length == 4 * words + turnround_bytes(4 * words, SCLK_HZ)
        again, fits = opened()
        assert not fits and again.why == b"another program uses the SPI device"
    finally:
        driver().carrier_close(ctypes.byref(found.carrier))
    other, fits = opened(axes=AXES + 1)
    assert not fits and other.why.startswith(b"the node does not answer: it is off, not set up")


@pytest.mark.parametrize(
    "where, why",
    [
        ("spi:/dev/no_such:10000000", "there is no such SPI device: switch the SPI of this"),
        ("spi:/dev/null:10000000", "the device is no SPI device, or it has no mode 0"),
        ("spi:/dev:10000000", "the SPI device cannot be opened"),
        ("spi:/dev/spidev0.0:0", "the clock of the SPI must be 1000 to 50000000 Hz"),
        ("spi:/dev/spidev0.0:60000000", "the clock of the SPI must be 1000 to 50000000 Hz"),
    ],
)
def test_a_place_that_the_driver_cannot_open_is_refused_in_a_sentence(where, why):
    found, fits = opened(where=where)
    assert not fits and found.why.decode().startswith(why)
