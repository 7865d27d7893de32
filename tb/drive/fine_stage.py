# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/fine_stage.sv in integers: clk(...) is one cycle and returns (valid, command,
saturated) after it.
"""

from tb.drive.pid_loop import PidLoop

RETURN = 16  # command counts per tick


class FineStage:
    def __init__(self):
        self.loop = PidLoop()
        self.command = 0

    def clk(self, enable, hold, kp, ki, kd, limit, target, position, tick=0, **strobes):
        closer = max(abs(self.command) - RETURN, 0) * (1 if self.command > 0 else -1)
        valid, self.command = self.loop.clk(
            power=int(enable),
            closed_loop=int(hold and enable),
            kp=kp,
            ki=ki,
            kd=kd,
            limit=limit,
            tick=tick,
            target=target,
            position=position,
            open_command=closer if enable else 0,
            **strobes,
        )
        return valid, self.command, int(hold and self.loop.at_limit)
