# SPDX-License-Identifier: Apache-2.0
"""What rtl/sense/encoder_events.sv does, in integers."""

ILLEGAL_EDGE, OVERSPEED, AMPLITUDE_LOW, AMPLITUDE_HIGH, DISAGREEMENT, PULSE_TOO_SHORT = (
    1 << n for n in range(6)
)
PULSES = 3  # decoder_mode


def collected(
    event_mask,
    signal_fault_mask,
    decoder_mode,
    own_steps,
    illegal_edge,
    overspeed,
    disagreement,
    signal_faults,
    edge_rejected,
):
    """Every output by its port name."""
    events = (
        illegal_edge * ILLEGAL_EDGE
        | overspeed * OVERSPEED
        | (signal_faults & 3) * AMPLITUDE_LOW
        | disagreement * DISAGREEMENT
    )
    if decoder_mode == PULSES and not own_steps and edge_rejected & 1:
        events |= PULSE_TOO_SHORT
    return dict(
        events=events,
        pulse_rejected=int(edge_rejected > 0),
        disturbed=int(events & (OVERSPEED | AMPLITUDE_LOW | AMPLITUDE_HIGH) > 0),
        fault=int(events & event_mask > 0 or signal_faults & signal_fault_mask > 0),
    )
