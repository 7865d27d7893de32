# SPDX-License-Identifier: Apache-2.0
"""Settings and idle inputs of feedback_channel for its tests: no filters, no monitor, no motion."""

SETTINGS = dict(
    deglitch=0,
    outlier_step=0,
    outlier_hold=0,
    amplitude_low=0,
    amplitude_high=65535,
    disagreement_limit=0,
    encoder_fault_mask=0,
)
INPUTS = dict(
    tick=0,
    sample_tick=0,
    sync=0,
    now=0,
    select=0,
    write=0,
    word=0,
    wdata=0,
    shift=0,
    shift_periods=0,
    a=0,
    b=0,
    z=0,
    probe=0,
    own_step=0,
    own_downward=1,
    adc_sin=1,
    adc_cos=1,
)
