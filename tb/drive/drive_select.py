# SPDX-License-Identifier: Apache-2.0
"""What rtl/drive/drive_select.sv does, in integers."""

BRIDGE, STEPPER, DAC = range(3)


def selected(kind, enable, valid, command, fine_valid, fine_command):
    """Every output by its port name."""
    dac_valid, dac_command = (valid, command) if kind == DAC else (fine_valid, fine_command)
    return dict(
        bridge_enable=int(enable and kind == BRIDGE),
        stepper_selected=int(kind == STEPPER),
        dac_valid=dac_valid,
        dac_command=dac_command,
    )
