# SPDX-License-Identifier: Apache-2.0
"""Made by tables/linuxcnc.py from linuxcnc.toml: do not edit."""

# the registers that each packet carries, in their order
READS = (
    "node.tick_count",
    "link.pll_state",
    "link.read_time",
    "axis.state",
    "axis.faults",
    "axis.first_fault",
    "axis.position",
    "axis.target",
    "axis.velocity",
    "axis.following_error",
    "axis.stream_state",
    "axis.stream_counts",
    "axis.supervision",
    "feedback.capture_state",
)
WRITES = (
    "axis.set_point_position",
    "axis.set_point_velocity",
    "node.axis_requests",
    "node.set_point_tick",
    "node.set_point_commit",
)
