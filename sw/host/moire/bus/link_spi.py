# SPDX-License-Identifier: Apache-2.0
"""The packets of the real-time link over SPI, at a device of Linux such as those of a Raspberry Pi:
docs/link.md has the wiring and the framing.

    with SpiDevice("/dev/spidev0.0", 10_000_000) as device:
        packet = device.exchange(link, link.request(time=0, values=[0]))
        reply = link.reply(packet)
"""

import ctypes
import fcntl
import os
import struct

from moire.bus.link import Link
from moire.closing import Closing
from moire.errors import OutOfRange, PortError
from moire.made import link_tables as layout

# linux/spi/spidev.h: the requests of ioctl, and struct spi_ioc_transfer
WRITE_MODE, WRITE_BITS, MESSAGE = 0x40016B01, 0x40016B03, 0x40206B00
TRANSFER = struct.Struct("=QQIIHBBBBBB")
MODE, BITS = 0, 8
LEAST_HZ, MOST_HZ = 1000, 50_000_000


def turnround_bytes(packets: int, hz: int) -> int:
    """Bytes between request and reply, for which the node plays the request: for so many bytes of
    both.
    """
    duration_ns = layout.SPI_TURNROUND_NS + layout.SPI_TURNROUND_BYTE_NS * packets
    return -(-hz * duration_ns // 8_000_000_000)


def reply_bytes(link: Link) -> int:
    """Bytes of a reply."""
    return 4 * (link.reads + layout.REPLY_FRAME_WORDS)


def transfer_of(link: Link, request: bytes, hz: int) -> bytes:
    """The bytes that the host sends in a transfer: a request, and zeros while the reply comes."""
    reply = reply_bytes(link)
    return request + bytes(turnround_bytes(len(request) + reply, hz) + reply)


def reply_in(received: bytes, link: Link) -> bytes:
    """The packet among the bytes of a transfer, which begins with the first one that is not 0;
    empty if the node has not answered, and shorter if the transfer ended before.
    """
    return received.lstrip(b"\0")[: reply_bytes(link)]


class SpiDevice(Closing):
    """An SPI device of Linux. PortError says why it cannot be used."""

    def __init__(self, device: str, hz: int) -> None:
        if not LEAST_HZ <= hz <= MOST_HZ:
            raise OutOfRange(f"the SPI clock is {hz} Hz: choose from {LEAST_HZ} to {MOST_HZ}")
        self.device, self.hz = device, hz
        try:
            self.file = os.open(device, os.O_RDWR | os.O_CLOEXEC)
        except FileNotFoundError:
            raise PortError(
                f"there is no {device}: switch the SPI of this computer on, on a Raspberry Pi "
                "with dtparam=spi=on in config.txt"
            ) from None
        except OSError as error:
            raise PortError(f"{device} cannot be opened: {error.strerror}") from None
        try:
            fcntl.ioctl(self.file, WRITE_MODE, bytes([MODE]))
            fcntl.ioctl(self.file, WRITE_BITS, bytes([BITS]))
        except OSError:
            self.close()
            raise PortError(f"{device} is no SPI device, or it has no mode {MODE}") from None

    def close(self) -> None:
        """Closes the device."""
        os.close(self.file)

    def transfer(self, sent: bytes) -> bytes:
        """One transfer: as many bytes come as are sent."""
        out = ctypes.create_string_buffer(sent, len(sent))
        back = ctypes.create_string_buffer(len(sent))
        places = ctypes.addressof(out), ctypes.addressof(back)
        message = TRANSFER.pack(*places, len(sent), self.hz, 0, BITS, *[0] * 5)
        try:
            fcntl.ioctl(self.file, MESSAGE, message)
        except OSError as error:
            raise PortError(f"{self.device} has made no transfer: {error.strerror}") from None
        return back.raw

    def exchange(self, link: Link, request: bytes) -> bytes:
        """The packet that answers a request, for `link.reply`; empty without one."""
        return reply_in(self.transfer(transfer_of(link, request, self.hz)), link)
