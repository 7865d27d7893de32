# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/link/cobs_decoder.sv in integers."""


class CobsDecoder:
    def __init__(self):
        self.reset()

    def reset(self):
        self.left, self.zero, self.inside = 0, False, False

    def outputs(self, valid, data, lost):
        """valid_out, data_out, ends, broken; data_out is None without valid_out."""
        ends = bool(valid and data == 0)
        inner = bool(valid and data and self.left)
        implied = bool(valid and data and not self.left and self.inside and self.zero)
        byte = data if inner else 0 if implied else None
        return inner or implied, byte, ends, bool(lost or ends and self.left)

    def step(self, valid, data, rst=0):
        if rst or valid and data == 0:
            return self.reset()
        if valid and self.left:
            self.left -= 1
        elif valid:
            self.left, self.zero, self.inside = data - 1, data != 0xFF, True
        return None
