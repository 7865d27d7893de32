# SPDX-License-Identifier: Apache-2.0
"""What rtl/interlock/core_watchdog.sv does, in integers: clk(...) is one cycle and returns (armed,
stopped) after it, while the inputs keep their levels.
"""

from tb.interlock.heartbeat_watchdog import HeartbeatWatchdog


class CoreWatchdog:
    def __init__(self, clk_hz, silence_ms):
        self.heartbeat, self.silence_ms = HeartbeatWatchdog(clk_hz), silence_ms

    def clk(self, trap=0, kick=0, drive_enable=0, rst=0):
        armed = int(drive_enable > 0)
        silent = self.heartbeat.clk(rst=rst, time_ms=self.silence_ms, kick=kick, armed=armed)
        return armed, int(trap or silent)
