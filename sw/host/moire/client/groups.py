# SPDX-License-Identifier: Apache-2.0
"""The groups in which the parameters of an axis are shown, by how their names begin."""

GROUPS = {
    "encoder": "period counts_per_period position_source velocity_quantum deglitch decoder_mode "
    "filter_skip filter_tolerated index_gate encoder_fault_mask",
    "sine and cosine": "signal_ amplitude_ outlier_ disagreement_limit auto_calibration",
    "travel and homing": "travel_ home_ homing_",
    "motion": "velocity acceleration jerk settle_ feed_override profile stepped_",
    "servo": "kp ki kd kv ka output_limit integral_limit dead_band filters filter_1_ filter_2_",
    "faults": "following_limit watchdog_time",
    "drive": "drive pwm_frequency dac_ step_ steps_per_period",
    "fine stage": "fine_",
    "segment table": "segment",
}
BEGINNINGS = {text: group for group, texts in GROUPS.items() for text in texts.split()}
OTHERS = "others"


def group_of(name: str) -> str:
    """The group of a parameter: that of the longest beginning that fits."""
    fitting = [text for text in BEGINNINGS if name.startswith(text)]
    return BEGINNINGS[max(fitting, key=len)] if fitting else OTHERS
