# SPDX-License-Identifier: Apache-2.0
"""What rtl/drive/bridge_gates.sv does, in integers: clk(...) is one clk and returns what is on the pins after it."""

OFF, HIGH, LOW = (0, 0), (1, 0), (0, 1)


class BridgeGates:
    def __init__(self):
        self.reset()

    def reset(self):
        self.legs, self.since = [OFF, OFF], [0, 0]
        return 0, 0, 0, 0

    def clk(self, rst=0, dead_time=0, minimum_pulse=0, fast_decay=0, brake=0, bridge_a=0, bridge_b=0):
        """gate_a_high, gate_a_low, gate_b_high, gate_b_low."""
        if rst:
            return self.reset()
        if brake or bridge_a and bridge_b:
            wanted = [LOW, LOW] if brake or not fast_decay else [OFF, OFF]
        else:
            wanted = [HIGH, LOW] if bridge_a else [LOW, HIGH] if bridge_b else [OFF, OFF]
        at_once = not (brake or bridge_a or bridge_b)
        for leg, (gates, wish) in enumerate(zip(self.legs, wanted)):
            elapsed = self.since[leg] + 1 >= (dead_time if gates == OFF else minimum_pulse)
            if gates != wish and (elapsed or gates != OFF and at_once):
                self.legs[leg], self.since[leg] = wish if gates == OFF else OFF, 0
            else:
                self.since[leg] = min(255, self.since[leg] + 1)
        return *self.legs[0], *self.legs[1]
