# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interlock/drive_interlock.sv in integers: clk(...) advances one cycle and returns
the outputs after it.
"""

from moire.made.registers import FIELDS

FAULTS = {f.field: 1 << f.low for f in FIELDS if (f.block, f.register) == ("axis", "faults")}
LIMIT_LOW, LIMIT_HIGH, ESTOP = (FAULTS[name] for name in ("limit_low", "limit_high", "estop"))
FOLLOWING_ERROR, ENCODER = FAULTS["following_error"], FAULTS["encoder"]
BUS_WATCHDOG, DRIVE, CPU = (FAULTS[name] for name in ("bus_watchdog", "drive", "cpu"))
PROFILE_UNDERRUN, STEP_OVERRUN = FAULTS["profile_underrun"], FAULTS["step_overrun"]
SERVO_OVERRUN, SAMPLE_OVERRUN = FAULTS["servo_overrun"], FAULTS["sample_overrun"]
LINK_WATCHDOG = FAULTS["link_watchdog"]
LATCH_ALWAYS = ESTOP | DRIVE | CPU

INPUTS = dict.fromkeys(
    """enable_request closed_loop homing reset_faults limit_low limit_high estop drive_fault
    encoder_fault watchdog_expired cpu_trap profile_underrun step_overrun servo_overrun
    sample_overrun link_expired error_valid error_too_far position valid_in command_in""".split(),
    0,
)


class DriveInterlock:
    def __init__(self):
        self.reset()

    def reset(self):
        self.too_far = self.error_counts = self.valid_out = self.command = self.enabled = 0
        self.faults = self.first_fault = self.fault_position = 0

    def causes(self, i):
        present = (
            i["limit_low"] and not i["homing"],
            i["limit_high"] and not i["homing"],
            i["estop"],
            self.too_far,
            i["encoder_fault"],
            i["watchdog_expired"],
            i["drive_fault"],
            i["cpu_trap"],
            i["profile_underrun"],
            i["step_overrun"],
            i["servo_overrun"],
            i["sample_overrun"],
            i["link_expired"],
        )
        return sum(1 << n for n, cause in enumerate(present) if cause)

    def clk(self, rst=0, **inputs):
        """Advance one cycle; missing inputs are 0. causes_now, block_up and block_down are those
        after the cycle, with its inputs.
        """
        i = INPUTS | inputs
        if rst:
            self.reset()
        else:
            self.step(i)
        return dict(
            valid_out=self.valid_out,
            command_out=self.command,
            enabled=self.enabled,
            faults=self.faults,
            causes_now=self.causes(i),
            first_fault=self.first_fault,
            fault_position=self.fault_position,
            block_up=int(i["limit_high"] or not self.enabled),
            block_down=int(i["limit_low"] or not self.enabled),
        )

    def step(self, i):
        causes = self.causes(i)
        arrived = causes if i["enable_request"] else causes & LATCH_ALWAYS
        held = (
            self.faults & causes if i["reset_faults"] and not i["enable_request"] else self.faults
        )
        if not held:
            self.first_fault = arrived & -arrived
            if arrived:
                self.fault_position = i["position"]
        self.faults = held | arrived

        if not self.enabled or not i["closed_loop"]:
            self.too_far = self.error_counts = 0
        elif i["error_valid"]:
            self.too_far = int(self.error_counts and i["error_too_far"])
            self.error_counts = 1
        self.enabled = int(i["enable_request"] and not self.faults)

        command = i["command_in"] if i["valid_in"] else self.command
        blocked = (
            not self.enabled
            or (i["limit_high"] and command > 0)
            or (i["limit_low"] and command < 0)
        )
        self.valid_out = int(i["valid_in"] or (blocked and self.command != 0))
        self.command = 0 if blocked else command
