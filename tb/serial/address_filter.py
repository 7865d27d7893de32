# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/address_filter.sv in integers: step(...) advances one cycle and returns
valid after it.
"""


class AddressFilter:
    def __init__(self):
        self.open = 0

    def step(self, address, valid, data, ninth, rst=0):
        if rst:
            self.open = 0
            return 0
        own = data in (0x10 | address, 0x20 | address, 0x20)
        passed = int(bool(valid and (own if ninth else self.open)))
        if valid and ninth:
            self.open = int(own)
        return passed
