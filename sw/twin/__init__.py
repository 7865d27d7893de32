# SPDX-License-Identifier: Apache-2.0
"""The twin: the RTL and firmware of the nodes, closed around a model of the machine. See parameters.toml for the machine."""
from .build import BuildError
from .twin import FrameBench, LineState, Truth, Twin, TwinTransport, cells_of, realtime_factor

__all__ = ["BuildError", "FrameBench", "LineState", "Truth", "Twin", "TwinTransport", "cells_of", "realtime_factor"]
