# SPDX-License-Identifier: Apache-2.0
"""Chromium of the system, driven by Playwright: `make chromium` installs both where they are
missing. Nothing else of the project needs them.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

from figures.common import Absent

if TYPE_CHECKING:
    from playwright.sync_api import Browser

NAMES = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = ("--no-sandbox", "--disable-gpu")  # root has no sandbox, a server no GPU


def missing() -> str:
    """What is missing for a browser, in words; empty if nothing is."""
    for found, name in ((path(), "Chromium"), (find_spec("playwright"), "Playwright")):
        if found is None:
            return f"{name} is not installed: make chromium"
    return ""


def path() -> str | None:
    """The program of Chromium."""
    return next(filter(None, map(shutil.which, NAMES)), None)


@contextmanager
def opened() -> "Iterator[Browser]":
    """A browser without a window; raises Absent."""
    if reason := missing():
        raise Absent(reason)
    from playwright.sync_api import sync_playwright  # only where it is installed

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path(), args=ARGUMENTS)
        try:
            yield browser
        finally:
            browser.close()
