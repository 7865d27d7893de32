# SPDX-License-Identifier: Apache-2.0
"""What rtl/control/axis_requests.sv does, in integers."""

REQUESTS = dict(
    check_following=("closed_loop", "fine"),
    play=("start", "common_start"),
)


def joined(**inputs):
    """Every output by its port name: high if one of its requests is."""
    return {out: max(inputs[name] for name in names) for out, names in REQUESTS.items()}
