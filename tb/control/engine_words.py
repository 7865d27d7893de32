# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_words.sv: facts(kind, word) are all its outputs."""

from tables.engine_words import FILTER_ADDRESS, FILTER_VALUE, GAINS, PUSH, SEGMENT, words

FOUND = {(w.kind, w.at): w for w in words()}


def facts(kind, word):
    w = FOUND.get((kind, word))
    name = w.name if w else ""
    return dict(
        places=w.places if w else 16,
        of_engine=int(bool(w) and name != FILTER_ADDRESS),
        wide=int(bool(w) and w.wide),
        has_sign=int(bool(w) and w.signed and not w.wide),
        gain=int(name in GAINS),
        push=int(name == PUSH),
        segment=int(name.startswith(SEGMENT)),
        filter_address=int(name == FILTER_ADDRESS),
        filter_value=int(name == FILTER_VALUE),
    )
