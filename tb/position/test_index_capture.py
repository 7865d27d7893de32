# SPDX-License-Identifier: Apache-2.0
"""index_capture: one index is held until it is read, a second one is reported, and random strobes
equal the model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.position.index_capture import IndexCapture

QUIET = dict(enabled=0, index=0, position=0, pop=0, clear=0)


class Bench:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, IndexCapture()

    async def begin(self):
        await start(self.dut, **QUIET)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, **inputs):
        """(present, position, overrun) after a cycle with these inputs."""
        inputs = QUIET | inputs
        for name, level in (inputs | dict(rst=rst)).items():
            getattr(self.dut, name).value = level
        await FallingEdge(self.dut.clk)
        got = (
            int(self.dut.present.value),
            self.dut.captured_position.value.to_signed(),
            int(self.dut.overrun.value),
        )
        assert got == self.model.step(rst=rst, **inputs)
        return got


@cocotb.test()
async def latency_is_1_cycle_and_the_index_is_held_until_it_is_read(dut):
    bench = await Bench(dut).begin()
    assert await bench.clk(index=1, position=5) == (0, 0, 0), "it is not enabled"
    assert await bench.clk(enabled=1, index=1, position=-7) == (1, -7, 0)
    assert await bench.clk(position=9) == (1, -7, 0)
    assert await bench.clk(enabled=1, index=1, position=11) == (1, -7, 1)
    assert (await bench.clk(pop=1))[0] == 0
    assert await bench.clk(enabled=1, index=1, position=2**47 - 1) == (1, 2**47 - 1, 0)
    assert (await bench.clk(clear=1))[0] == 0
    assert (await bench.clk(enabled=1, index=1, clear=1))[0] == 0


@cocotb.test()
async def random_strobes_match_the_model(dut):
    bench = await Bench(dut).begin()
    for _ in range(2000):
        strobes = {name: int(random.random() < 0.3) for name in ("index", "pop", "clear")}
        await bench.clk(
            rst=int(random.random() < 0.01),
            enabled=int(random.random() < 0.8),
            position=random.getrandbits(48) - 2**47,
            **strobes,
        )


def test_index_capture():
    run("index_capture", __file__)
