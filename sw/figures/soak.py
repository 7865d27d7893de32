# SPDX-License-Identifier: Apache-2.0
"""The long forms of the figures, for a night and not for CI: the SOAK of every module of this
folder, one after the other.

python -m figures.soak [NAME …]       (make soak)
"""

import argparse
import sys
import time

from figures.common import collected, console


def main(arguments=None):
    known = collected("SOAK")
    parser = argparse.ArgumentParser(
        prog="python -m figures.soak", description=__doc__.partition("\n\n")[0]
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"which; all without one: {', '.join(known)}"
    )
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.names if name not in known]:
        parser.error(f"there is no campaign {unknown[0]}: there are {', '.join(known)}")
    failed = []
    for name in options.names or known:
        console.rule(name)
        began = time.perf_counter()
        value, good = known[name]()
        print(
            f"{name} {value} {'good' if good else 'BAD'} after {time.perf_counter() - began:.0f} s",
            flush=True,
        )
        if not good:
            failed.append(name)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
