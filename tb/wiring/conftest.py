# SPDX-License-Identifier: Apache-2.0
"""What the tests of the wiring take."""

import pytest

from tb.wiring.node import Node


@pytest.fixture
def node():
    """A node after its reset."""
    made = Node()
    yield made
    made.close()
