# SPDX-License-Identifier: Apache-2.0
"""The twin and the host package are imported as packages of sw/ and sw/host/."""
import sys
from pathlib import Path

SOFTWARE = Path(__file__).resolve().parents[2] / "sw"
sys.path[:0] = [str(SOFTWARE), str(SOFTWARE / "host")]
