# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/count_outlier_filter.sv for the counts since reset: follow(enable, count)
returns the filtered count.
"""


class CountOutlierFilter:
    def __init__(self, w=32):
        self.w, self.out = w, None

    def wrapped(self, count):
        return (count + (1 << self.w - 1)) % (1 << self.w) - (1 << self.w - 1)

    def follow(self, enable, count):
        if not enable or self.out is None:
            self.out = count
        else:
            difference = self.wrapped(count - self.out)
            if abs(difference) > 1:
                self.out = self.wrapped(self.out + (difference >> 1))  # (Dn + Dn-1) / 2
        return self.out
