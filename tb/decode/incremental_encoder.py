# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/decode/incremental_encoder.sv: the models of its three blocks in series, the flags,
and the time of the last edge.
"""

from dataclasses import dataclass, field

from tb.decode.index_latch import IndexLatch, Settings
from tb.decode.quadrature_decoder import QuadratureDecoder
from tb.sense.event_filter import EventFilter


@dataclass(frozen=True)
class Setup:
    skip: int = 0
    required: int = 0
    tolerated: int = 0
    mode: int = 0
    illegal_enable: int = 0
    own: int = 0
    index: Settings = field(default_factory=Settings)


class IncrementalEncoder:
    def __init__(self, w=32, check=1):
        self.filter, self.decoder, self.index = (
            EventFilter(3),
            QuadratureDecoder(w),
            IndexLatch(w, check),
        )
        self.clean, self.own, self.edge_time, self.illegal, self.wrong = (
            [0, 0, 0],
            [0, 0],
            None,
            0,
            0,
        )
        self.seen = self.fault = self.revolution = 0

    def step(self, setup, a, b, z, now, arm=0, clear_flags=0, rst=0, own_a=0, own_b=0):
        """Advance one cycle; return the outputs after it by name. edge_time is None while it is
        undefined.
        """
        later, decoder = self.index.later, self.decoder
        direction, moves, _ = decoder.classify(later[0], later[1], setup.mode)
        clear = self.index.clear(setup.index, direction)
        if moves:
            self.edge_time = now
        ready = decoder.ready
        self.seen = int(self.illegal or (self.seen and not clear_flags))
        self.fault = int(
            setup.illegal_enable and (self.illegal or (self.fault and not clear_flags))
        )
        self.revolution = int(self.wrong or (self.revolution and not clear_flags))
        count_before = decoder.count
        levels = [*self.own, self.clean[2]] if setup.own else self.clean
        self.own = [own_a, own_b]
        count, step, self.illegal = decoder.step(later[0], later[1], setup.mode, clear, rst)
        armed, found, index_count, self.wrong = self.index.step(
            setup.index, levels, ready, direction, moves if ready else 0, count_before, arm, rst
        )
        self.clean, rejected = self.filter.step(
            setup.skip, setup.required, setup.tolerated, [a, b, z], rst
        )
        if rst:
            self.seen = self.fault = self.revolution = 0
        return {
            "count": count,
            "step": step,
            "edge_time": self.edge_time,
            "index_found": found,
            "index_armed": armed,
            "index_count": index_count,
            "filtered": self.clean[0] | self.clean[1] << 1 | self.clean[2] << 2,
            "rejected": rejected[0] | rejected[1] << 1 | rejected[2] << 2,
            "illegal": self.illegal,
            "illegal_seen": self.seen,
            "illegal_fault": self.fault,
            "revolution_wrong": self.wrong,
            "revolution_fault": self.revolution,
        }
