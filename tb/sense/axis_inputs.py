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
BITS = dict(
    encoder_a=0,
    encoder_b=1,
    encoder_z=2,
    limit_low_open=3,
    limit_high_open=4,
    drive_fault_n=5,
    probe=6,
)  # its first bit in the synchroniser
MASKS = dict(probe=3)  # of pins of more than one bit


class AxisInputs:
    def __init__(self):
        self.pins = Synchroniser(8, name="axis_inputs.u_pins")
        self.limits = {pin: SwitchFilter(1) for pin in PINS if pin.startswith("limit")}

    def clk(self, rst=0, limit_tick=0, **pins):
        out, seen = {}, self.pins.stages[-1]
        after = self.pins.step(sum(pins[pin] << bit for pin, bit in BITS.items()), rst)
        for pin, output in PINS.items():
            before, level = ((word >> BITS[pin]) & MASKS.get(pin, 1) for word in (seen, after))
            if pin in self.limits:
                level = self.limits[pin].step([before], limit_tick, rst)[0]
            out[output] = int(not level) if pin == "drive_fault_n" else level
        return out
