# SPDX-License-Identifier: Apache-2.0
"""Fetches uPlot, which draws the plots of the live page, as npm's own lock pins it in
sw/host/moire/web/package-lock.json. Neither node nor npm is needed.

The files that the page uses, and the licence, get into sw/host/moire/web/uplot, all of them or
none. Nothing is done if the version of the lock is there already. The environment variable
npm_config_registry names another registry, as it does for npm.

    python -m tools.page [--try]      exit code 1 when uPlot cannot be had; --try only says so
"""

import argparse
import base64
import hashlib
import http.client
import io
import json
import os
import sys
import tarfile
import tempfile
import urllib.request
from pathlib import Path

from tools import ROOT

WEB = ROOT / "sw" / "host" / "moire" / "web"
LOCK = WEB / "package-lock.json"
PACKAGE = "uplot"
FILES = ("dist/uPlot.esm.js", "dist/uPlot.min.css", "LICENSE")  # of the package
MARK = "integrity"  # the file that says which package was unpacked
REGISTRY = "https://registry.npmjs.org"  # in locks; npm replaces it by that of its settings, too
CONNECT_S = 10
LARGEST = 10_000_000  # bytes of a package


class FetchError(Exception):
    """uPlot cannot be had; the text says why."""


def fetch(lock: Path, folder: Path, registry: str) -> bool:
    """Puts the files of the package that the lock pins into the folder; returns whether they were
    not there yet. Raises FetchError, and then the folder is as it was.
    """
    entry = json.loads(lock.read_text())["packages"][f"node_modules/{PACKAGE}"]
    url, integrity = entry["resolved"].replace(REGISTRY, registry.rstrip("/")), entry["integrity"]
    mark = folder / MARK
    if mark.is_file() and mark.read_text() == integrity:
        mark.touch()  # for make, which compares it with the lock
        return False
    contents = unpacked(downloaded(url), url, integrity)
    with tempfile.TemporaryDirectory(prefix=f"{folder.name}-", dir=folder.parent) as made:
        new, old = Path(made) / "new", Path(made) / "old"
        new.mkdir()
        for name, content in contents.items():
            (new / name).write_bytes(content)
        (new / MARK).write_text(integrity)
        if folder.exists():
            folder.rename(old)
        new.rename(folder)
    return True


def downloaded(url: str) -> bytes:
    """The bytes at the URL; raises FetchError."""
    try:
        with urllib.request.urlopen(url, timeout=CONNECT_S) as response:
            return bytes(response.read(LARGEST))
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise FetchError(f"{url} cannot be fetched: {error}") from None


def unpacked(package: bytes, url: str, integrity: str) -> dict[str, bytes]:
    """The files by their names, without folders; raises FetchError."""
    kind, _, expected = integrity.partition("-")
    if kind != "sha512" or base64.b64encode(hashlib.sha512(package).digest()).decode() != expected:
        raise FetchError(
            f"{url} is not what the lock pins ({integrity[:20]}…): nothing was unpacked"
        )
    found = {}
    with tarfile.open(fileobj=io.BytesIO(package)) as archive:
        for name in FILES:
            try:
                file = archive.extractfile(f"package/{name}")
            except KeyError:
                file = None
            if file is None:
                raise FetchError(f"the package at {url} has no file {name}")
            found[Path(name).name] = file.read()
    return found


def main() -> int:
    """The exit code."""
    parser = argparse.ArgumentParser(description="Fetches uPlot for the live page.")
    parser.add_argument("--try", action="store_true", help="only say so when it cannot be had")
    is_try = getattr(parser.parse_args(), "try")
    registry = os.environ.get("npm_config_registry") or REGISTRY
    try:
        if fetch(LOCK, WEB / PACKAGE, registry):
            print(f"page: uPlot is in {(WEB / PACKAGE).relative_to(ROOT)}")
        return 0
    except FetchError as error:
        then = " The live page has no plots until `make page` has fetched uPlot." if is_try else ""
        print(f"page: {error}.{then}", file=sys.stderr)
        return 0 if is_try else 1


if __name__ == "__main__":
    sys.exit(main())
