# SPDX-License-Identifier: Apache-2.0
"""What rtl/sense/axis_inputs.sv does, in integers: clk(...) is one cycle and returns every output
after it, by port name.
"""

from tb.common.synchroniser import Synchroniser
from tb.sense.switch_filter import SwitchFilter

PINS = dict(
    encoder_a="a",
    encoder_b="b",
    encoder_z="z",
    probe="probe_level",
    limit_low_open="limit_low",
    limit_high_open="limit_high",
    drive_fault_n="drive_fault",
)  # the output of each pin


class AxisInputs:
    def __init__(self):
        self.pins = {pin: Synchroniser() for pin in PINS}
        self.limits = {pin: SwitchFilter(1) for pin in PINS if pin.startswith("limit")}

    def clk(self, rst=0, limit_tick=0, **pins):
        out = {}
        for pin, output in PINS.items():
            before = self.pins[pin].stages[-1]
            level = self.pins[pin].step(pins[pin], rst)
            if pin in self.limits:
                level = self.limits[pin].step([before], limit_tick, rst)[0]
            out[output] = int(not level) if pin == "drive_fault_n" else level
        return out
