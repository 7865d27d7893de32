# SPDX-License-Identifier: Apache-2.0
"""What rtl/position/index_capture.sv does, in integers: step(...) is one cycle and returns
(present, captured_position, overrun) after it.
"""


class IndexCapture:
    def __init__(self):
        self.position, self.present = 0, 0

    def step(self, enabled=0, index=0, position=0, pop=0, clear=0, rst=0):
        if rst:
            self.__init__()
            return 0, 0, 0
        event = enabled and index and not clear
        overrun = int(event and self.present)
        if event and not self.present:
            self.present, self.position = 1, position
        elif pop or clear:
            self.present = 0
        return self.present, self.position, overrun
