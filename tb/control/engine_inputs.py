# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_inputs.sv in integers: clk(...) advances one cycle and returns the
outputs after it.
"""

GAINS = 6  # bit of gains_changed in request
ALL = 0x7F


class EngineInputs:
    def __init__(self):
        self.reset()

    def reset(self):
        self.live = self.seen = self.levels = self.seen_position = 0
        self.step_live, self.lost_live, self.lost_off_live = 0, 1, 1
        self.last = getattr(self, "last", None)  # (cycles, down) of the last step
        self.seen_elapsed = getattr(self, "seen_elapsed", None)

    def clk(
        self,
        rst=0,
        tick=0,
        sample=0,
        elapsed=0,
        position=0,
        stepped=0,
        downward=0,
        block_up=0,
        block_down=0,
        closed_loop=0,
        request=0,
        done=0,
    ):
        off = block_up & block_down
        powerless = int(off or not closed_loop)
        taken = ALL if tick else ALL ^ 1 << GAINS if sample else 0
        self.seen = self.seen & ~done | self.live & taken
        self.live = self.live & ~taken | request
        if tick or sample:
            self.seen_position = position
        if tick:
            down = self.last[1] if self.last else 0
            self.seen_elapsed = self.last[0] if self.last else None
            self.levels = (
                self.step_live
                | down << 1
                | block_up << 2
                | block_down << 3
                | closed_loop << 4
                | (self.lost_live | powerless) << 5
                | (self.lost_off_live | off) << 6
            )
        self.step_live = int(stepped or self.step_live and not tick)
        self.lost_live = 0 if tick else self.lost_live | powerless
        self.lost_off_live = 0 if tick else self.lost_off_live | off
        if stepped:
            self.last = 0 if tick else elapsed, downward
        if rst:
            self.reset()
        both = self.live | self.seen
        return (
            self.seen_position,
            self.seen_elapsed,
            self.seen,
            self.levels,
            int(both & ~(1 << GAINS) != 0),
            both >> GAINS & 1,
        )
