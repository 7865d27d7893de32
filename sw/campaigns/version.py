# SPDX-License-Identifier: Apache-2.0
"""Which version of the project a result belongs to: the commit, and the content as it is on the
disk.

The content decides what a part computes, so every worker compares its own with the campaign's. The
commit is there for people; without git (in a container) MOIRE_COMMIT in the environment names it.
"""

import hashlib
import os
import subprocess
from collections.abc import Sequence
from fnmatch import fnmatch
from functools import cache
from pathlib import Path, PurePath

from twin.build import ROOT

FOLDERS = ("rtl", "sw", "tables", "tb")
FILES = ("requirements.lock",)
IGNORED = ".gitignore"
COMMIT = "MOIRE_COMMIT"
UNKNOWN = "unknown"


def made_here(path: PurePath, patterns: Sequence[str]) -> bool:
    """Whether a file is made or fetched in a checkout: a pattern of .gitignore that begins with /
    is one of a path or of a folder above it, another one that of a name.
    """
    paths = [str(PurePath(*path.parts[: n + 1])) for n in range(len(path.parts))]
    return any(
        fnmatch(each, pattern.strip("/"))
        for pattern in patterns
        for each in (paths if pattern.startswith("/") else path.parts)
    )


def sources(root: Path = ROOT) -> list[Path]:
    """Every file that a result may depend on."""
    rows = (root / IGNORED).read_text(encoding="utf-8").splitlines()
    patterns = [row for row in rows if row and not row.startswith("#")]
    found = [root / name for name in FILES]
    for folder in FOLDERS:
        for path in (root / folder).rglob("*"):
            inside = path.relative_to(root)
            hidden = any(part.startswith(".") for part in inside.parts)
            if path.is_file() and not hidden and not made_here(inside, patterns):
                found.append(path)
    return sorted(found)


@cache
def content(root: Path = ROOT) -> str:
    """A short name for the content of the sources; computed once in each process."""
    whole = hashlib.sha256()
    for path in sources(root):
        data = path.read_bytes()
        whole.update(f"{path.relative_to(root)}\0{len(data)}\0".encode() + data)
    return whole.hexdigest()[:10]


@cache
def commit(root: Path = ROOT) -> str:
    """The first letters of the commit, or what MOIRE_COMMIT says."""
    if named := os.environ.get(COMMIT):
        return named[:10]
    command = ["git", "-C", str(root), "rev-parse", "--short=10", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError:
        return UNKNOWN
    return done.stdout.strip() or UNKNOWN


def version(root: Path = ROOT) -> str:
    return f"{commit(root)}-{content(root)}"
