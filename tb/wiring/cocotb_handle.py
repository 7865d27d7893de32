# SPDX-License-Identifier: Apache-2.0
"""Runs tests that are written for cocotb on a bench: a handle that looks like cocotb's, and edges
of the clock that need no simulator.
"""

import pytest


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

    @property
    def _handle(self):
        """Behind it in cocotb is the simulator, which tb.ports asks."""
        return self

    def get_signal_val_binstr(self):
        """The level as the text of an unsigned number, without its leading zeros."""
        return f"{int(self.value):b}"


class Parameter:
    """A parameter of a design as cocotb shows it."""

    def __init__(self, value):
        self.value = value


class Handle:
    """The pins of a bench as attributes, its parameters too if it has some in a table, and its
    clock as a sequence of edges.
    """

    def __init__(self, bench):
        self._bench, self._high = bench, False

    def __getattr__(self, name):
        parameters = getattr(self._bench, "parameters", {})
        return Parameter(parameters[name]) if name in parameters else Pin(self._bench, name)

    def edge(self, rising):
        """A whole cycle for each rising edge, and for each falling one that follows no rising."""
        if rising or not self._high:
            self._bench.run(1)
        self._high = rising


class Now:
    """A trigger for which there is nothing to wait: the design has moved on, or need not."""

    def __await__(self):
        return
        yield


class Edge(Now):
    """Awaits an edge of the clock."""

    def __init__(self, handle, rising):
        self._handle, self._rising = handle, rising

    def __await__(self):
        self._handle.edge(self._rising)
        return super().__await__()


async def start(handle, **levels):
    """As tb.bench.start: two cycles of reset."""
    for name, level in levels.items():
        getattr(handle, name).value = level
    handle.rst.value = 1
    await Edge(handle, True)
    await Edge(handle, True)
    handle.rst.value = 0


def cases_of(module):
    """The names of the cocotb tests of a module, as cases of a test."""
    names = [name for name, test in vars(module).items() if hasattr(test, "generate_tests")]
    return pytest.mark.parametrize("name", names)


def run(module, name, bench):
    """Run a cocotb test of a module on a bench; whether it came to its end."""
    handle = Handle(bench)
    ours = {
        "RisingEdge": lambda clk: Edge(handle, True),
        "FallingEdge": lambda clk: Edge(handle, False),
        "ReadOnly": Now,
        "start": start,
    }
    of_cocotb = {word: value for word, value in vars(module).items() if word in ours}
    vars(module).update((word, ours[word]) for word in of_cocotb)
    try:
        getattr(module, name).func(handle).send(None)
    except StopIteration:
        return True
    finally:
        vars(module).update(of_cocotb)
    return False
