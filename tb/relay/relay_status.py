# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/relay/relay_status.sv."""

ILLEGAL, REVOLUTION_WRONG, MISSING, REJECTED, BEHIND, SET_REFUSED = (1 << n for n in range(6))
KNOWN, LOADED, CORRECTING, READING = (1 << n for n in range(4))


def status(
    known,
    loaded,
    reading,
    moved,
    illegal,
    revolution_wrong,
    missing,
    rejected,
    behind,
    set_bad,
    flags,
):
    """Every output by its port name."""
    correcting = known and loaded
    happened = {
        ILLEGAL: illegal,
        REVOLUTION_WRONG: revolution_wrong,
        MISSING: missing,
        REJECTED: rejected,
        BEHIND: behind,
        SET_REFUSED: set_bad and not reading,
    }
    present = {KNOWN: known, LOADED: loaded, CORRECTING: correcting, READING: reading}
    return dict(
        correcting=int(correcting),
        fault=int(flags > 0),
        follow=int(not moved),
        events=sum(bit for bit, seen in happened.items() if seen),
        levels=sum(bit for bit, level in present.items() if level),
    )
