# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/fine_stage.sv in integers: clk(...) is one cycle and returns (valid, command,
saturated) after it.
"""

from tb.control.pid_servo import PidServo

RETURN = 16  # command counts per tick


class FineStage:
    def __init__(self):
        self.loop = PidServo(terms=2, biquads=0)
        self.command = 0

    def clk(self, enable, hold, kp, ki, limit, target, position, moving=0, tick=0, **strobes):
        closer = max(abs(self.command) - RETURN, 0) * (1 if self.command > 0 else -1)
        valid, self.command, _, _ = self.loop.clk(
            closed_loop=int(hold and enable),
            kp=kp,
            ki=ki,
            output_limit=limit,
            integral_limit=limit,
            tick=tick,
            target=target,
            position=position,
            moving=moving,
            open_command=closer if enable else 0,
            block_up=int(not enable),
            block_down=int(not enable),
            **strobes,
        )
        return valid, self.command, int(hold and abs(self.command) == limit)
