# SPDX-License-Identifier: Apache-2.0
"""What rtl/position/position_source.sv does, in integers."""


def source(has_sine, use_counts, sample_tick, tracked, counted):
    """Every output by its port name; `tracked` and `counted` are (strobe, step, phase)."""
    by_counts = int(use_counts or not has_sine)
    valid, step, phase = counted if by_counts else tracked
    return dict(
        by_counts=by_counts,
        convert=int(sample_tick and not by_counts),
        valid=valid,
        step=step,
        phase=phase,
    )
