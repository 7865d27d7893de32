# SPDX-License-Identifier: Apache-2.0
"""Made by tables/linuxcnc.py from linuxcnc.toml: do not edit."""

# the registers that each packet carries, in their order; a wide one has two words
NODE_READS = ("tick_count",)
AXIS_READS = (
    "state",
    "faults",
    "first_fault",
    "position_low",
    "position_high",
    "target_low",
    "target_high",
    "velocity",
    "following_error",
    "stream_state",
    "stream_counts",
    "supervision",
)
AXIS_WRITES = (
    "set_point_position_low",
    "set_point_position_high",
    "set_point_velocity",
)
NODE_WRITES = (
    "axis_requests",
    "set_point_tick",
    "set_point_commit",
)
