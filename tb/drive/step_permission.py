# SPDX-License-Identifier: Apache-2.0
"""What rtl/drive/step_permission.sv does, in integers."""


def permission(enable, by_steps, block_up, block_down, target_velocity):
    """(driven, allowed): the drive is on and steps are its kind; its target may be followed."""
    driven = enable and by_steps
    blocked = target_velocity > 0 and block_up or target_velocity < 0 and block_down
    return int(driven), int(driven and not blocked)
