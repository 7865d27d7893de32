# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_words.sv: facts(kind, word) are all its outputs."""

from tables.engine_words import FILTER_ADDRESS, FILTER_VALUE, GAINS, PUSH, SHIFTS, words

FOUND = {(w.kind, w.at): w for w in words()}


def facts(kind, word):
    w = FOUND.get((kind, word))
    name = w.name if w else ""
    return dict(
        number=w.number if w else 0,
        scale=SHIFTS.index(w.shift) if w else 0,
        of_engine=int(bool(w) and name != FILTER_ADDRESS),
        wide=int(bool(w) and w.wide),
        has_sign=int(bool(w) and w.signed),
        gain=int(name in GAINS),
        push=int(name == PUSH),
        filter_address=int(name == FILTER_ADDRESS),
        filter_value=int(name == FILTER_VALUE),
    )
