# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interlock/heartbeat_watchdog.sv in integers: clk(...) advances one cycle and returns
expired after it.
"""


class HeartbeatWatchdog:
    def __init__(self, clk_hz):
        self.clk_ms, self.silent, self.expired = clk_hz // 1000, 0, 0  # silent: in cycles

    def clk(self, rst=0, time_ms=0, kick=0, armed=0):
        if rst or kick or not armed:
            self.silent = self.expired = 0
        elif time_ms and self.silent >= time_ms * self.clk_ms:
            self.expired = 1
        elif self.silent < 65535 * self.clk_ms:
            self.silent += 1
        return self.expired
