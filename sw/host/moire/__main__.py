# SPDX-License-Identifier: Apache-2.0
"""`python -m moire` is the command `moire`."""

import sys

from moire.cli.command_line import main

if __name__ == "__main__":
    sys.exit(main())
