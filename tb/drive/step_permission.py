# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/step_permission.sv."""


def permission(enable, by_steps, block_up, block_down, target_up, target_down):
    """Whether the target may be followed."""
    blocked = target_up and block_up or target_down and block_down
    return int(enable and by_steps and not blocked)
