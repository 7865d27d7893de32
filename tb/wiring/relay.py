# SPDX-License-Identifier: Apache-2.0
"""The relay in a bench, and the handle by which the tests of tb/system/test_relay.py, written for
cocotb, reach it.
"""

from mutation.library import Bench, library
from tb.system import test_relay

TOP = "relay"
PARAMETERS = {
    "K": test_relay.K,
    "BAUD": 6_000_000,
    "FIRST": test_relay.FIRST,
    "SECOND": test_relay.SECOND,
}


class Relay(Bench):
    """The relay, before its reset."""

    def __init__(self, path=None, mutant=(0, 0, 0)):
        super().__init__(path or library(TOP, PARAMETERS), mutant)


class Pin:
    """A pin as cocotb shows it."""

    def __init__(self, bench, name):
        self._bench, self._name = bench, name

    @property
    def value(self):
        return self._bench.get(self._name)

    @value.setter
    def value(self, level):
        self._bench.set(**{self._name: int(level)})


class Handle:
    """The pins of a bench as attributes, and its clock as a sequence of edges."""

    def __init__(self, bench):
        self._bench, self._high = bench, False

    def __getattr__(self, name):
        return Pin(self._bench, name)

    def edge(self, rising):
        """A whole cycle for each rising edge, and for each falling one that follows no rising."""
        if rising or not self._high:
            self._bench.run(1)
        self._high = rising


class Edge:
    """Awaits an edge of the clock."""

    def __init__(self, handle, rising):
        self._handle, self._rising = handle, rising

    def __await__(self):
        self._handle.edge(self._rising)
        return
        yield  # the design has moved on: there is nothing to wait for


async def start(handle, **levels):
    """As tb.bench.start: two cycles of reset."""
    for name, level in levels.items():
        getattr(handle, name).value = level
    handle.rst.value = 1
    await Edge(handle, True)
    await Edge(handle, True)
    handle.rst.value = 0


def run(test, bench):
    """A test of tb/system/test_relay.py on a bench."""
    handle, names = Handle(bench), ("RisingEdge", "FallingEdge", "start")
    of_cocotb = {name: getattr(test_relay, name) for name in names}
    test_relay.RisingEdge = lambda clk: Edge(handle, True)
    test_relay.FallingEdge = lambda clk: Edge(handle, False)
    test_relay.start = start
    try:
        test.func(handle).send(None)
    except StopIteration:
        return True
    finally:
        vars(test_relay).update(of_cocotb)
    return False
