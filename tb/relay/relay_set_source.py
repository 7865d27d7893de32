# SPDX-License-Identifier: Apache-2.0
"""What rtl/relay/relay_set_source.sv does, in integers."""


def source(reading, stored, sent):
    """(start, valid, data) out of those of the flash and those of the host."""
    return stored if reading else sent
