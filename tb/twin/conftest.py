# SPDX-License-Identifier: Apache-2.0
"""The twin and the host package are imported as packages of sw/ and sw/host/."""
import random
import sys
from pathlib import Path

import pytest

SOFTWARE = Path(__file__).resolve().parents[2] / "sw"
sys.path[:0] = [str(SOFTWARE), str(SOFTWARE / "host")]


@pytest.fixture(autouse=True)
def seeded():
    random.seed(1)
