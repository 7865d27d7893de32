# SPDX-License-Identifier: Apache-2.0
"""The wires of the relay: the tests of tb/system/test_relay.py, on the bench of the wiring."""

import random

import pytest

from tb.bench import seed
from tb.system import test_relay
from tb.wiring.relay import run

TESTS = [name for name, test in vars(test_relay).items() if hasattr(test, "generate_tests")]


@pytest.mark.parametrize("name", TESTS)
def test_of_the_system(relay, name):
    random.seed(seed())
    assert run(getattr(test_relay, name), relay)
