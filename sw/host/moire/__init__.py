# SPDX-License-Identifier: Apache-2.0
"""Host package of Moire: talks to motion controllers on a multi-drop line."""

from moire.bus.client import Axis, Bus, Node, Status
from moire.bus.transport import SerialBus, Transport

from .errors import MoireError

__all__ = ["Axis", "Bus", "MoireError", "Node", "SerialBus", "Status", "Transport"]
