# SPDX-License-Identifier: Apache-2.0
"""The twin: the RTL and firmware of the nodes, closed around a model of the machine. See parameters_*.toml for the machines."""
from .build import BuildError
from .machine import Machine
from .ring import RotaryRing
from .surroundings import EdmCut, PeerLineBench, Surroundings, SurroundingsBench
from .twin import START_S, WITH_SEGMENTS, Axis, FrameBench, LineState, Node, Twin, TwinTransport, cells_of, realtime_factor

__all__ = ["START_S", "Axis", "BuildError", "EdmCut", "FrameBench", "LineState", "Machine", "Node", "PeerLineBench", "RotaryRing",
           "Surroundings", "SurroundingsBench", "Twin", "TwinTransport", "WITH_SEGMENTS", "cells_of", "realtime_factor"]
