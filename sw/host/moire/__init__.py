# SPDX-License-Identifier: Apache-2.0
"""Host package of Moire: controls motion controllers on an RS-485 bus."""

from moire.bus.transport import SerialBus, Transport, open_bus
from moire.client.axis import Axis
from moire.client.bus import Bus
from moire.client.indexing_table import IndexingTable
from moire.client.node import Node
from moire.client.records import Sample, Status
from moire.errors import MoireError
from moire.machine import Machine, connect

__all__ = [
    "Axis",
    "Bus",
    "IndexingTable",
    "Machine",
    "MoireError",
    "Node",
    "Sample",
    "SerialBus",
    "Status",
    "Transport",
    "connect",
    "open_bus",
]
