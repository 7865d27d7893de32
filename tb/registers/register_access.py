# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/registers/register_access.sv in integers."""


class RegisterAccess:
    """The outputs of a cycle are attributes; `step` advances one cycle."""

    def __init__(self, latency=2):
        self.latency = latency
        self.write = self.address = self.wdata = 0
        self.reset()

    def reset(self):
        self.left = None  # cycles until done, None without an access; all of them until ready
        self.select = 0

    @property
    def free(self):
        return int(self.left is None)

    @property
    def waits(self):
        return int(self.left == self.latency + 1)

    @property
    def done(self):
        return int(self.left == 0)

    def step(self, take=0, put=0, at=0, value=0, ready=0, rst=0):
        free, waits = self.free, self.waits
        self.select = int(waits and ready)
        if self.left is not None and (ready or not waits):
            self.left = self.left - 1 if self.left else None
        if take and free:
            self.left = self.latency + 1
            self.write, self.address, self.wdata = put, at, value
        if rst:
            self.reset()
