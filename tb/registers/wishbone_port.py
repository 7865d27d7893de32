# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/registers/wishbone_port.sv in integers."""

from tb.registers.register_access import RegisterAccess

ALL_BYTES = 15


class WishbonePort:
    """The outputs of a cycle are attributes, those of the register bus of `access`; `step` advances
    one cycle.
    """

    def __init__(self, latency=2):
        self.access = RegisterAccess(latency)
        self.dat_r = self.ack = self.err = 0
        self.held = False

    def step(self, cyc=0, stb=0, we=0, adr=0, sel=0, dat_w=0, ready=0, rdata=0, rst=0):
        access, active = self.access, cyc and stb
        begins = active and access.free and not self.ack and not self.err
        whole = not we or sel == ALL_BYTES
        take = int(begins and whole)
        self.ack = int(bool(access.done and self.held and active and not rst))
        self.err = int(bool(begins and not whole and not rst))
        if access.done:
            self.dat_r = rdata
        self.held = bool((take or (self.held and active)) and not rst)
        access.step(take, we, adr << 2, dat_w, ready, rst)
