# SPDX-License-Identifier: Apache-2.0
"""Run the long campaigns, for a night and not for CI: the SOAK of every module of this directory,
one after the other.

python -m figures.soak [NAME …]       (make soak K=NAME)
"""

import argparse
import sys
import time
from collections.abc import Sequence

from figures.common import collected, console


def main(arguments: Sequence[str] | None = None) -> int:
    known = collected("SOAK")
    parser = argparse.ArgumentParser(
        prog="python -m figures.soak", description=(__doc__ or "").partition("\n\n")[0]
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"default: all, which are {', '.join(known)}"
    )
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.names if name not in known]:
        parser.error(f"there is no campaign {unknown[0]}: there are {', '.join(known)}")
    failed = []
    for name in options.names or known:
        console.rule(name)
        began = time.perf_counter()
        value, good = known[name]()
        took = time.perf_counter() - began
        print(f"{name} {value} {'good' if good else 'BAD'} after {took:.0f} s", flush=True)
        if not good:
            failed.append(name)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
