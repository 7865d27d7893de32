# SPDX-License-Identifier: Apache-2.0
"""What rtl/sense/encoder_events.sv does, in integers."""

from moire.made.registers import FIELDS

EVENTS = {
    f.field: 1 << f.low for f in FIELDS if (f.block, f.register) == ("axis", "encoder_events")
}
ILLEGAL_EDGE, OVERSPEED = EVENTS["illegal_edge"], EVENTS["overspeed"]
AMPLITUDE_LOW, AMPLITUDE_HIGH = EVENTS["amplitude_low"], EVENTS["amplitude_high"]
DISAGREEMENT, PULSE_TOO_SHORT = EVENTS["disagreement"], EVENTS["pulse_too_short"]
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
        | (signal_faults & 1) * AMPLITUDE_LOW
        | (signal_faults >> 1 & 1) * AMPLITUDE_HIGH
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
