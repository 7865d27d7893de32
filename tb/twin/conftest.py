# SPDX-License-Identifier: Apache-2.0
"""Each test of the twin begins from the same random numbers."""

import random

import pytest


@pytest.fixture(autouse=True)
def seeded():
    random.seed(1)
