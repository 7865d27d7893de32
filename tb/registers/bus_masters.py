# SPDX-License-Identifier: Apache-2.0
"""Masters that drive a bus port in tests. They change their signals at the falling edge of clk."""

from cocotb.triggers import FallingEdge

MOST_CYCLES = 10_000  # that an access may take: more than register_memory needs after a reset
ALL_BYTES = 15


class BusError(Exception):
    """The port has answered with an error."""


class WishboneMaster:
    """Classic cycles at the signals of a design whose names begin with the prefix."""

    INPUTS = ("cyc", "stb", "we", "adr", "sel", "dat_w")

    def __init__(self, dut, prefix="wb_"):
        self.clk = dut.clk
        self.pins = {
            name: getattr(dut, prefix + name) for name in (*self.INPUTS, "dat_r", "ack", "err")
        }
        for name in self.INPUTS:
            self.pins[name].value = 0

    def ended(self):
        """Whether this is the last cycle of an access."""
        return int(self.pins["ack"].value) or int(self.pins["err"].value)

    def begin(self, address, value=None, sel=ALL_BYTES):
        """Request the word at a byte address, or that `value` is written there."""
        pins = self.pins
        pins["cyc"].value = pins["stb"].value = 1
        pins["we"].value, pins["adr"].value = int(value is not None), address >> 2
        pins["sel"].value, pins["dat_w"].value = sel, value or 0

    async def access(self, address, value=None, sel=ALL_BYTES):
        """A whole access: (word read, cycles from its first one to its answer)."""
        self.begin(address, value, sel)
        await FallingEdge(self.clk)
        cycles = 1
        while not self.ended():
            assert cycles < MOST_CYCLES, f"no answer from {address:#x} in {MOST_CYCLES} cycles"
            await FallingEdge(self.clk)
            cycles += 1
        failed, word = int(self.pins["err"].value), self.pins["dat_r"].value
        await FallingEdge(self.clk)
        self.pins["cyc"].value = self.pins["stb"].value = 0
        if failed:
            raise BusError(f"the access to {address:#x} was refused")
        return (int(word) if value is None else None), cycles

    async def read(self, address):
        return (await self.access(address))[0]

    async def write(self, address, value):
        await self.access(address, value)


class AxiLiteMaster:
    """Reads and writes at the signals of a design whose names begin with the prefix."""

    CHANNELS = ("aw", "w", "ar")
    INPUTS = ("awvalid", "awaddr", "wvalid", "wdata", "wstrb", "bready")
    INPUTS += ("arvalid", "araddr", "rready")
    OUTPUTS = ("awready", "wready", "bvalid", "bresp", "arready", "rvalid", "rdata", "rresp")

    def __init__(self, dut, prefix="axi_"):
        self.clk = dut.clk
        self.pins = {name: getattr(dut, prefix + name) for name in (*self.INPUTS, *self.OUTPUTS)}
        for name in self.INPUTS:
            self.pins[name].value = 0

    async def transfer(self, *channels):
        """Hold the valid of these channels until each has been taken."""
        for channel in channels:
            self.pins[f"{channel}valid"].value = 1
        left = set(channels)
        for _ in range(MOST_CYCLES):
            await FallingEdge(self.clk)
            taken = {channel for channel in left if int(self.pins[f"{channel}ready"].value)}
            for channel in set(channels) - left:
                self.pins[f"{channel}valid"].value = 0
            left -= taken
            if not left:
                await FallingEdge(self.clk)
                for channel in channels:
                    self.pins[f"{channel}valid"].value = 0
                return
        raise AssertionError(f"{left} not taken in {MOST_CYCLES} cycles")

    async def response(self, channel, wait=0):
        """Take the response of a channel, `wait` cycles after it came."""
        pins = self.pins
        for _ in range(MOST_CYCLES):
            if int(pins[f"{channel}valid"].value):
                break
            await FallingEdge(self.clk)
        assert int(pins[f"{channel}valid"].value), f"no response in {MOST_CYCLES} cycles"
        for _ in range(wait):
            await FallingEdge(self.clk)
            assert int(pins[f"{channel}valid"].value), "the response stays until it is taken"
        failed = int(pins[f"{channel}resp"].value)
        word = int(pins["rdata"].value) if channel == "r" else None
        pins[f"{channel}ready"].value = 1
        await FallingEdge(self.clk)
        pins[f"{channel}ready"].value = 0
        if failed:
            raise BusError(f"response {failed}")
        return word

    async def read(self, address, wait=0):
        self.pins["araddr"].value = address
        await self.transfer("ar")
        return await self.response("r", wait)

    async def write(self, address, value, strobes=ALL_BYTES, wait=0):
        self.pins["awaddr"].value, self.pins["wdata"].value = address, value
        self.pins["wstrb"].value = strobes
        await self.transfer("aw", "w")
        await self.response("b", wait)


class Registers:
    """What is behind a port: words that can be written and read. `accesses` lists what was done, as
    (whether it writes, byte address, word to be written). Each access is checked to keep the rules
    of the register bus.
    """

    def __init__(self, dut, latency):
        self.dut, self.latency = dut, latency
        self.words, self.accesses = {}, []
        self.is_ready = lambda: 1
        self.before = None  # ready, address and wdata in the cycle before
        self.answers = []  # words that are read, the next one last
        dut.ready.value, dut.rdata.value = 1, 0

    def cycle(self):
        """To be called at each falling edge: rdata is there at the end of the cycle that is
        `latency` cycles after select.
        """
        dut = self.dut
        at_bus = (dut.address.value, dut.wdata.value)
        answer = 0xDEAD0000 | len(self.accesses)  # what is on the bus when nothing was read
        if int(dut.select.value):
            write, address, wdata = int(dut.write.value), int(at_bus[0]), int(at_bus[1])
            ready, *there = self.before
            assert ready and there == list(at_bus), "address and wdata are there 1 cycle before"
            self.accesses.append((write, address, wdata))
            if write:
                self.words[address] = wdata
            else:
                answer = self.words.get(address, 0)
        self.answers.insert(0, answer)
        ready = int(self.is_ready())
        self.before, dut.ready.value = (ready, *at_bus), ready
        if len(self.answers) > self.latency:
            dut.rdata.value = self.answers.pop()

    async def serve(self):
        while True:
            await FallingEdge(self.dut.clk)
            self.cycle()
