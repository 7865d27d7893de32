# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/registers/axi_lite_port.sv in integers."""

from tb.registers.register_access import RegisterAccess

ALL_BYTES = 15
OKAY, SLVERR = 0, 2


class AxiLitePort:
    """The outputs of a cycle are attributes, those of the register bus of `access`; `step` advances
    one cycle. awready is wready as well.
    """

    def __init__(self, latency=2):
        self.access = RegisterAccess(latency)
        self.bresp, self.rdata = OKAY, 0
        self.reset()

    def reset(self):
        self.awready = self.arready = self.bvalid = self.rvalid = 0
        self.refused = self.has_read = False

    def step(
        self,
        awvalid=0,
        awaddr=0,
        wvalid=0,
        wdata=0,
        wstrb=0,
        bready=0,
        arvalid=0,
        araddr=0,
        rready=0,
        ready=0,
        rdata=0,
        rst=0,
    ):
        access = self.access
        writes = bool(awvalid and wvalid)
        reads = bool(arvalid and not (writes and self.has_read))
        idle = access.free and not (self.awready or self.bvalid or self.rvalid)
        begins, whole = idle and (writes or reads), wstrb == ALL_BYTES
        done, refused, of_write = access.done, self.refused, access.write
        address = (araddr if reads else awaddr) & ~3
        access.step(begins and (reads or whole), int(not reads), address, wdata, ready, rst)
        if done:
            self.rdata = rdata
        if done or refused:
            self.bresp = SLVERR if refused else OKAY
        self.bvalid = int(bool(refused or (done and of_write) or (self.bvalid and not bready)))
        self.rvalid = int(bool((done and not of_write) or (self.rvalid and not rready)))
        self.arready, self.awready = int(begins and reads), int(begins and not reads)
        self.refused = begins and not reads and not whole
        if begins:
            self.has_read = reads
        if rst:
            self.reset()
