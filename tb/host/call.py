# SPDX-License-Identifier: Apache-2.0
"""Calls of the program `moire` in tests, against nodes on a simulated bus."""

import io
import json

from moire.cli import command_line
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus


class Call:
    """One call of `moire` against nodes on a bus."""

    def __init__(self, text, *nodes, bus=None):
        self.bus = bus or Rs485Bus(*(nodes or [BusNode()]))
        self.options, out, err = None, io.StringIO(), io.StringIO()

        def open_transport(options):
            self.options = options
            return self.bus

        arguments = text.split() if isinstance(text, str) else text
        self.code = command_line.main(arguments, open_transport, out, err)
        self.out, self.err = out.getvalue(), err.getvalue()

    @property
    def results(self):
        return [json.loads(row) for row in self.out.splitlines()]


def sentence(call, code):
    """The one line of the error message."""
    assert call.code == code and call.err.count("\n") == 1 and call.err.startswith("moire: "), (
        call.err
    )
    return call.err
