# SPDX-License-Identifier: Apache-2.0
"""What rtl/common/time_stamp.sv does, in integers."""


def time_stamp(cycles, w=64):
    """The count after `cycles` cycles without reset."""
    return cycles % (1 << w)
