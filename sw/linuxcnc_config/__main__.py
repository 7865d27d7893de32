# SPDX-License-Identifier: Apache-2.0
"""Makes a configuration of LinuxCNC from a machine file: see linuxcnc_config.generate."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from linuxcnc_config.generate import Misfit, load, write


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m linuxcnc_config",
        description="Makes a configuration of LinuxCNC (INI, HAL, tool table) from a machine file.",
    )
    parser.add_argument("machine", help="a machine of constraints/machines, or a .toml file")
    parser.add_argument("--out", type=Path, required=True, help="the folder of the configuration")
    options = parser.parse_args(arguments)
    try:
        found = write(load(options.machine), options.out)
    except Misfit as why:
        print(why, file=sys.stderr)
        return 1
    print(f"made {found}: start it with `linuxcnc {found}`")
    return 0


if __name__ == "__main__":
    sys.exit(main())
