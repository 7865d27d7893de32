# SPDX-License-Identifier: Apache-2.0
"""Prints the parameters with which a design is built for the tests of its wiring, as TOML.

python -m tb.wiring.parameters TOP
"""

import sys
from importlib import import_module

if __name__ == "__main__":
    for name, value in import_module(f"tb.wiring.{sys.argv[1]}").PARAMETERS.items():
        print(f"{name} = {value!r}")
