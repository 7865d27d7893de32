# SPDX-License-Identifier: Apache-2.0
"""What rtl/control/common_start.sv does, in integers."""


def started(axes, request, request_axes, sync, sync_axes):
    """(start, restart_tick)"""
    starting = request * request_axes | sync * sync_axes
    return starting & (1 << axes) - 1, int(sync and sync_axes > 0)
