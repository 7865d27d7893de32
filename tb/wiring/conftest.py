# SPDX-License-Identifier: Apache-2.0
"""What the tests of the wiring take."""

import pytest

from tb.wiring.axis_inputs import AxisInputs
from tb.wiring.display_port import DisplayPort
from tb.wiring.i2c_port import I2cPort
from tb.wiring.node import Node
from tb.wiring.peripherals import Peripherals
from tb.wiring.process_link import ProcessLink
from tb.wiring.relay import Relay


@pytest.fixture
def node():
    """A node after its reset."""
    made = Node()
    yield made
    made.close()


@pytest.fixture
def peripherals():
    """The peripherals after their reset."""
    made = Peripherals()
    yield made
    made.close()


@pytest.fixture
def relay():
    """The relay before its reset."""
    made = Relay()
    yield made
    made.close()


@pytest.fixture
def display_port():
    """The port of the display after its reset."""
    made = DisplayPort()
    yield made
    made.close()


@pytest.fixture
def process_link():
    """The real-time link before its reset."""
    made = ProcessLink()
    yield made
    made.close()


@pytest.fixture
def axis_inputs():
    """The inputs of an axis before their reset."""
    made = AxisInputs()
    yield made
    made.close()


@pytest.fixture
def i2c_port():
    """The I2C port before its reset."""
    made = I2cPort()
    yield made
    made.close()
