# SPDX-License-Identifier: Apache-2.0
"""The record of the tests on netlists, docs/netlists.toml: which test of a block passed on what.

A netlist is named by what Yosys makes it from: RTL, parameters, family and version of Yosys. With
NETLIST_TESTS=new in the environment a test that has passed on this very netlist is skipped; with
NETLIST_TESTS=changed only a test that has passed on another one runs. Those that pass are collected
under build/netlist until keep() writes them into the record.
"""

import hashlib
import json
import os
import tomllib
from collections.abc import Mapping

from twin.netlist import BUILD, FAMILIES, ROOT

RECORD = ROOT / "docs" / "netlists.toml"
PASSED = BUILD / "passed"
CHOICE = "NETLIST_TESTS"  # of the environment
HEAD = """\
# SPDX-License-Identifier: Apache-2.0
# Which test of a block has passed on a netlist of each family, and on which: a hash of what Yosys
# makes it from. Written by `make figure NAME=netlist_failures` alone.
"""

Record = Mapping[str, Mapping[str, str]]  # family, test: netlist


def read() -> dict[str, dict[str, str]]:
    return tomllib.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}


def text_of(record: Record) -> str:
    lines = [HEAD]
    for family in FAMILIES:
        lines.append(f"[{family}]")
        lines += [f'"{test}" = "{name}"' for test, name in sorted(record.get(family, {}).items())]
        lines.append("")
    return "\n".join(lines)


def due(family: str, test: str, name: str) -> bool:
    """Whether a test is to run on the netlist of this name."""
    choice = os.environ.get(CHOICE)
    if not choice:
        return True
    known = read().get(family, {}).get(test)
    return known != name and (choice == "new" or known is not None)


def passed(family: str, test: str, name: str) -> None:
    """A test has passed on the netlist of this name: collected if there is a choice of tests."""
    if os.environ.get(CHOICE):
        PASSED.mkdir(parents=True, exist_ok=True)
        tag = hashlib.sha256(test.encode()).hexdigest()[:16]
        (PASSED / f"{family}-{tag}.json").write_text(json.dumps([family, test, name]))


def keep() -> int:
    """Writes what has been collected into the record; returns how many it was."""
    record, files = read(), sorted(PASSED.glob("*.json"))
    for file in files:
        family, test, name = json.loads(file.read_text())
        record.setdefault(family, {})[test] = name
    RECORD.write_text(text_of(record), encoding="utf-8")
    for file in files:
        file.unlink()
    return len(files)
