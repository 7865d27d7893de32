# SPDX-License-Identifier: Apache-2.0
"""TAP devices of Linux, through which programs of this computer reach what is simulated."""

import fcntl
import os
import struct

TUNSETIFF, TAP, WITHOUT_HEADER = 0x400454CA, 0x0002, 0x1000  # of linux/if_tun.h


def open_tap(name: str) -> int:
    """The file of a new TAP device of this name, in the network namespace of this thread: each read
    and each write is an Ethernet frame. OSError if this computer does not allow it.
    """
    frames = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(frames, TUNSETIFF, struct.pack("16sH", name.encode(), TAP | WITHOUT_HEADER))
    return frames
