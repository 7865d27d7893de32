# SPDX-License-Identifier: Apache-2.0
"""What rtl/common/time_stamp.sv does, in integers."""


def time_stamp(clks, w=64):
    """The count after `clks` clk without reset."""
    return clks % (1 << w)
