# SPDX-License-Identifier: Apache-2.0
"""The twin: the RTL and firmware of the nodes, closed around a model of the machine. The machines
are in parameters/.
"""

from twin.devices.devices import Devices, DevicesBench, EdmCut, PeerLineBench
from twin.machines.machine import Machine
from twin.machines.ring import RotaryRing
from twin.nodes.frame_bench import FrameBench, cells_of
from twin.nodes.transport import TwinTransport
from twin.nodes.twin import (
    START_S,
    WITH_SCOPE,
    WITH_SEGMENTS,
    Axis,
    BusState,
    Node,
    Twin,
    realtime_factor,
)

from .build import BuildError

__all__ = [
    "START_S",
    "Axis",
    "BuildError",
    "EdmCut",
    "FrameBench",
    "BusState",
    "Machine",
    "Node",
    "PeerLineBench",
    "RotaryRing",
    "Devices",
    "DevicesBench",
    "Twin",
    "TwinTransport",
    "WITH_SCOPE",
    "WITH_SEGMENTS",
    "cells_of",
    "realtime_factor",
]
