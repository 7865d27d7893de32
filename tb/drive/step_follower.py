# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/step_follower.sv in integers: clk(...) advances one cycle and returns the
outputs after it.
"""

from tb.drive.step_scaler import StepScaler


def signed(value, bits):
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


class StepFollower:
    def __init__(self):
        self.scaler, self.wait, self.rebased, self.pending, self.done = StepScaler(), 0, 1, 1, 0

    def clk(self, rst=0, ratio=0, shift=0, enable=0, rebase=0, tick=0, target=0, trim=0):
        """Return go, restart and position after the cycle, for the levels of enable and rebase in
        this cycle.
        """
        take = self.wait == 1
        moved = int(rebase or not enable)
        required = signed(target + (trim << shift), 48)
        done, position = self.scaler.clk(rst=rst, ratio=ratio, valid=take, position=required)
        if rst:
            self.wait, self.rebased, self.pending = 0, 1, 1
        else:
            self.pending = int(take and self.rebased or self.pending and not self.done)
            self.rebased = int(moved or (self.rebased and not take))
            self.wait = 8 if tick else max(self.wait - 1, 0)
        self.done = done
        fresh = self.pending or self.rebased or moved
        return dict(
            go=int(done and not fresh), restart=int(done and bool(fresh)), position=position
        )
