# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/decode/encoder_counter.sv: step(...) advances one cycle and returns rdata."""

from tb.decode.index_latch import IndexLatch, Settings
from tb.decode.quadrature_decoder import QuadratureDecoder
from tb.sense.event_filter import EventFilter

ARM, FOUND, PROBED, ILLEGAL = 16, 32, 64, 128  # bits of word 1


class EncoderCounter:
    def __init__(self, filter_w=4, tolerated_w=0, skip_w=0):
        self.there = (
            (1 << filter_w) - 1
            | 0xFFF0
            | ((1 << tolerated_w) - 1) << 16
            | ((1 << skip_w) - 1) << 20
        )
        self.filter, self.decoder, self.index = (
            EventFilter(3, settle=3),
            QuadratureDecoder(16, settle=7),
            IndexLatch(16, 0),
        )
        self.clean, self.edge_time, self.probe = [0, 0, 0], None, (0, 0)
        self.reset()

    def reset(self):
        self.settings = self.found = self.illegal = self.seen = self.probing = 0

    def bit(self, n, width=1):
        return self.settings >> n & (1 << width) - 1

    def read(self, word):
        """The word as it reads now; None while it is undefined."""
        if word == 0:
            return (
                None
                if self.edge_time is None
                else self.edge_time << 16 | self.decoder.count & 0xFFFF
            )
        if word == 1:
            levels = self.clean[0] | self.clean[1] << 1 | self.clean[2] << 2 | self.probe[0] << 3
            return (
                (self.index.index_count & 0xFFFF) << 16
                | self.seen
                | self.index.armed * ARM
                | levels
            )
        return self.settings if word == 2 else 0

    def step(self, a, b, z, probe=0, now=0, select=0, write=0, word=0, wdata=0, rst=0):
        rdata = self.read(word) if select and not rst else 0
        written = wdata if select and write and word == 1 else 0
        index = Settings(
            active_low=self.bit(6),
            gate_mask=3 * self.bit(7),
            gate=self.bit(8, 2),
            take_up=self.bit(10),
            take_down=self.bit(11),
            each=self.bit(12),
            clears=self.bit(13),
        )
        mode, later, decoder = self.bit(4, 2), self.index.later, self.decoder
        direction, moves, _ = decoder.classify(later[0], later[1], mode)
        clear = self.index.clear(index, direction)
        if moves:
            self.edge_time = now
        ready, count = decoder.ready, decoder.count
        self.seen = (
            self.seen & ~written
            | self.found * FOUND
            | self.probing * PROBED
            | self.illegal * ILLEGAL
        )
        _, _, self.illegal = decoder.step(later[0], later[1], mode, clear, rst)
        _, self.found, _, _ = self.index.step(
            index,
            self.clean,
            ready,
            direction,
            moves if ready else 0,
            count,
            int(bool(written & ARM)),
            rst,
            self.probing,
        )
        self.clean, _ = self.filter.step(
            self.bit(20, 12), self.bit(0, 4), self.bit(16, 4), [a, b, z], rst
        )
        self.probing = int(
            self.bit(14) and self.probe[0] != self.probe[1] and self.probe[0] != self.bit(15)
        )
        self.probe = probe, self.probe[0]
        if select and write and word == 2:
            self.settings = wdata & self.there
        if rst:
            self.reset()
        return rdata
