# SPDX-License-Identifier: Apache-2.0
"""Host package of Moire: talks to motion controllers on a multi-drop line."""
from .client import Axis, Line, Node, Status
from .errors import MoireError
from .transport import SerialLine, Transport

__all__ = ["Axis", "Line", "MoireError", "Node", "SerialLine", "Status", "Transport"]
