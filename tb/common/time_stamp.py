# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/common/time_stamp.sv."""


def time_stamp(cycles, w=64):
    """The count after this many cycles without reset."""
    return cycles % (1 << w)
