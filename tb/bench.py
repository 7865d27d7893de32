# SPDX-License-Identifier: Apache-2.0
"""The one way a test reaches the simulator, and the few gestures every test shares.

SIM=icarus|verilator   SEED=number|random   WAVES=1 (the wave file lies beside the results, under
                                            build/)
NETLIST=ecp5|ice40     the netlist that Yosys makes of the module, in place of its RTL
RTL_COVERAGE=folder    Verilator, which writes a file of coverage counts for each passed test there
MUTANTS=file           the netlist of a block with its mutants, for mutation.blocks
POWER_UP=number        Verilator, with flip-flops and memories that start in this random state, some
                       cycles before the reset, and a reset of random length
CROSSINGS=number       each change of an asynchronous input may arrive one cycle later, by chance

Each simulation imports its test file, and with it this module, into a Python of its own: what only
pytest's process needs is in tb/simulator.py.
"""

import os
import random
from pathlib import Path

import pytest
from cocotb.clock import Clock
from cocotb.triggers import RisingEdge
from cocotb.utils import get_sim_time

ROOT = Path(__file__).resolve().parent.parent
CLK_NS = 10  # a cycle of the clock that start() makes


def seed():
    """The seed of all tests: SEED of the environment, or 1 without it. `random` is replaced in the
    environment by the number that is
    drawn for it, so every later caller, the workers of pytest-xdist and the simulators all use the
    same number."""
    if os.environ.get("SEED") == "random":
        os.environ["SEED"] = str(random.SystemRandom().randrange(1, 2**31))
    return int(os.environ.get("SEED") or 1)


def run(top, test, **parameters):
    """Build module `top` with `parameters` and run the cocotb tests in the file `test`, as
    tb.simulator.run says.
    """
    __tracebackhide__ = True
    from tb import simulator

    simulator.run(top, test, seed(), parameters)


def on_netlist():
    """Whether a test runs on a netlist in place of the RTL."""
    return bool(os.environ.get("NETLIST"))


def with_mutants():
    """Whether a test runs on the netlist of its block with mutants."""
    return bool(os.environ.get("MUTANTS"))


def rtl_only(reason):
    """In a test: skip it on a netlist, for a reason such as what it reads inside."""
    if on_netlist():
        pytest.skip(reason)


def generated(dut, block, number, name):
    """A signal in a generate block of the design; in a netlist with mutants the block is a part of
    its name.
    """
    if with_mutants():
        return dut[f"\\{block}[{number}].{name} "]
    return getattr(getattr(dut, block)[number], name)


def steady_only(reason):
    """In a cocotb test: skip it if a change at a pin may arrive one cycle later, for a reason such
    as a latency to the cycle.
    """
    from twin import crossings

    if crossings.seed():
        pytest.skip(reason)


def needs(condition, reason):
    """In a test: skip it unless its condition is fulfilled, such as one of the parameters that the
    design was built with; a test that returns early would count as passed.
    """
    if not condition:
        pytest.skip(reason)


def clk_now():
    """Whole cycles of the clock of start() since the simulation began."""
    return round(get_sim_time("ps")) // (1000 * CLK_NS)


async def start(dut, period_ns=CLK_NS, **inputs):
    """Clock running, inputs at the given levels, two cycles of reset; returns just after reset
    falls. With POWER_UP in the environment, the reset takes two to nine cycles and comes up to 15
    cycles after the clock.
    """
    before, length = 0, 2
    if power_up := os.environ.get("POWER_UP"):
        chance = random.Random(f"{power_up} {dut._name}")
        before, length = chance.randrange(16), chance.randrange(2, 10)
    for name, level in inputs.items():
        getattr(dut, name).value = level
    dut.rst.value = int(before == 0)
    Clock(dut.clk, period_ns, "ns", impl="gpi").start(start_high=False)
    for _ in range(before):
        await RisingEdge(dut.clk)
    dut.rst.value = 1
    for _ in range(length):
        await RisingEdge(dut.clk)
    dut.rst.value = 0
