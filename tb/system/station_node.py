# SPDX-License-Identifier: Apache-2.0
"""The nodes of S4 in the tests of whole stations: what they are built with, and the parameters of
the axis that turns the table.
"""

from twin.nodes.twin import drives

NODE = {**drives("HAS_STEPPER"), "FILTERS": 0, "HAS_SINE": 0}
AXIS = {
    "period": "1um",
    "drive": "steps",
    "position_source": "own_steps",
    "steps_per_period": 4,
    "counts_per_period": 4,
    "disagreement_limit": 0,
    "encoder_fault_mask": 0,
    "kp": 0,
    "ki": 0,
    "kd": 0,
    "kv": 0,
    "ka": 0,
    "following_limit": "10mm",
    "velocity": "20mm/s",
    "acceleration": "100mm/s2",
    "jerk": "1000mm/s3",
    "homing_latch_speed": "0.2mm/s",
    "settle_window": "1um",
    "settle_time": "5ms",
    "watchdog_time": "60s",
}
