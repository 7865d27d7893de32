# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/relay/relay_set_source.sv."""


def source(reading, stored, sent):
    """(start, valid, data), selected from the flash and the host."""
    return stored if reading else sent
