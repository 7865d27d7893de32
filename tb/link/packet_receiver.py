# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/link/packet_receiver.sv in integers: outputs(...) gives the outputs of a cycle,
step(...) advances it.

It keeps the bytes of the packet and judges them at its end with zlib and struct.
"""

import struct
import zlib

from moire.made import link_tables as layout

NAMES = [name for name, _ in layout.CAUSES]
WHOLE = zlib.crc32(zlib.crc32(b"any").to_bytes(4, "little"), zlib.crc32(b"any"))


class PacketReceiver:
    def __init__(self):
        self.held = b""  # the last bytes, of any packet
        self.reset()

    def reset(self):
        self.bytes, self.lost, self.missed = bytearray(), 0, 0
        self.bank = self.last = 0
        self.counts = dict.fromkeys(NAMES, 0)
        self.verdict = None  # of the packet that ended in the cycle before: a cause, or "accepted"
        self.sequence = 0

    @property
    def refused(self):
        return sum(count << 8 * n for n, count in enumerate(self.counts.values()))

    def outputs(self, enable, valid=0, data=0, **_):
        """(accepted, bank, refused, put, put_at, word); the last two are None without put."""
        count = len(self.bytes)
        put = int(valid and enable and count < 4 * layout.LONGEST_WORDS and count % 4 == 3)
        word = int.from_bytes(self.held[-3:] + bytes([data]), "little") if put else None
        accepted = int(self.verdict == "accepted")
        return accepted, self.bank, self.refused, put, count // 4 if put else None, word

    def judge(self, enable, session, writes, time_window, now, broken, foreign, busy):
        content = bytes(self.bytes)
        if self.lost or broken or zlib.crc32(content) != WHOLE:
            return "damaged"
        identity = layout.KIND_REQUEST | session << 8
        ours = int.from_bytes(content[:4], "little") == identity
        if self.missed or not enable or foreign or not ours:
            return "foreign"
        if len(content) != 4 * (writes + layout.FRAME_WORDS):
            return "wrong_length"
        _, self.sequence, stamp = struct.unpack_from("<3I", content)
        if not 0 < (self.sequence - self.last) % 2**32 < 2**31:
            return "replayed"
        if time_window and abs((now - stamp + 2**31) % 2**32 - 2**31) > time_window:
            return "out_of_time"
        return "busy" if busy else "accepted"

    def step(self, valid, data, ends, broken, rst, enable, **others):
        if rst:
            return self.reset()
        if self.verdict == "accepted":
            self.bank, self.last = 1 - self.bank, self.sequence
        elif self.verdict:
            self.counts[self.verdict] = (self.counts[self.verdict] + 1) % 256
        if not enable:
            self.last = 0
        self.verdict = None
        if ends:
            if self.bytes or self.lost or broken:
                self.verdict = self.judge(enable, broken=broken, **others)
            self.bytes, self.lost, self.missed = bytearray(), 0, 0
            return None
        self.lost |= broken
        if valid:
            self.missed |= not enable
            self.held = (self.held + bytes([data]))[-3:]
            self.bytes.append(data)
        return None
