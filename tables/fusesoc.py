# SPDX-License-Identifier: Apache-2.0
"""Makes the FuseSoC core files of rtl/, x.core beside x.sv, from the sources of the modules."""

import sys

from embed import fusesoc
from tables import made_files

if __name__ == "__main__":
    sys.exit(made_files.main(__doc__ or "", fusesoc.made))
