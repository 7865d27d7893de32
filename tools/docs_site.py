# SPDX-License-Identifier: Apache-2.0
"""Builds the site of the project in build/docs/site: its pages, and the reference of the host
package from its docstrings. Every link must lead to a file, and every anchor to a heading.

    python -m tools.docs_site [--links]     exit code 1 when a link is wrong; --links: nothing more
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from tools import ROOT

OUT = ROOT / "build" / "docs"
SOURCE, SITE = OUT / "source", OUT / "site"
TOOLS = ROOT / "build" / "docs_tools"  # of tools/docs.lock
PAGES = ("*.md", "docs/*.md", "docs/**/*.md", "rtl/README.md", "sw/*/README.md")
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCE = re.compile(r"^```.*?^```", re.M | re.S)
REFERENCE = {  # pages of the reference, and their modules
    "connect": ("moire.machine", "moire.aio", "moire.description"),
    "axis": ("moire.client.axis", "moire.client.parameters", "moire.client.capture"),
    "bus": ("moire.client.bus", "moire.client.node", "moire.bus.transport"),
    "records": ("moire.client.records", "moire.client.values"),
    "calibration": (
        "moire.client.calibration",
        "moire.client.index_survey",
        "moire.client.segments",
    ),
    "stations": ("moire.client.indexing_table", "moire.client.job", "moire.client.relay"),
    "errors": ("moire.errors", "moire.units"),
    "web": ("moire.web.client",),
}


def pages() -> list[Path]:
    """The pages of the project, relative to its root."""
    return sorted({path.relative_to(ROOT) for pattern in PAGES for path in ROOT.glob(pattern)})


def links(text: str) -> Iterator[str]:
    """What the links of a page lead to, outside code; those to other sites are left out."""
    for line in FENCE.sub("", text).splitlines():
        if line.startswith("    "):
            continue
        for target in LINK.findall(re.sub(r"`[^`]*`", "``", line)):
            if not re.match(r"[a-z]+:", target):
                yield target


def anchors(text: str) -> set[str]:
    """The anchors of the headings of a page, as GitHub makes them."""
    found: set[str] = set()
    for heading in re.findall(r"^#+ +(.*)", FENCE.sub("", text), re.M):
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower()
        anchor, number = re.sub(r"[^\w\- ]", "", plain).strip().replace(" ", "-"), 0
        name = anchor
        while name in found:
            number += 1
            name = f"{anchor}-{number}"
        found.add(name)
    return found


def wrong_links(root: Path, paths: Iterable[Path]) -> list[str]:
    """`page: link` for each link of these pages that leads nowhere."""
    wrong = []
    for page in paths:
        for link in links((root / page).read_text(encoding="utf-8")):
            name, _, anchor = link.partition("#")
            target = root / page if not name else root / page.parent / name
            if not target.exists():
                wrong.append(f"{page}: there is no {link}")
            elif anchor and anchor not in anchors(target.read_text(encoding="utf-8")):
                wrong.append(f"{page}: there is no heading for {link}")
    return wrong


def reference(name: str, modules: Iterable[str]) -> str:
    """A page of the reference."""
    return "\n\n".join([f"# Reference: {name}", *(f"::: {module}" for module in modules), ""])


def copy_pages() -> None:
    """All pages, what they link to, and the pages of the reference, into the folder of sources."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    found = pages()
    for page in found:
        text = (ROOT / page).read_text(encoding="utf-8")
        put(page, text)
        for link in links(text):
            name = link.partition("#")[0]
            target = Path(os.path.normpath(page.parent / name)) if name else page
            if target in found or not name:
                continue
            if (ROOT / target).is_dir():  # of the repository, not of the site
                put(target / "index.md", f"# {target}\n\nA folder of the repository.\n")
            elif not (SOURCE / target).exists():
                (SOURCE / target).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(ROOT / target, SOURCE / target)
    for name, modules in REFERENCE.items():
        put(Path("reference") / f"{name}.md", reference(name, modules))


def put(path: Path, text: str) -> None:
    """Writes a file of the sources."""
    (SOURCE / path).parent.mkdir(parents=True, exist_ok=True)
    (SOURCE / path).write_text(text, encoding="utf-8")


def build() -> int:
    """The exit code of MkDocs, which is not 0 if any link is wrong."""
    copy_pages()
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet"]
    variables = {**os.environ, "PYTHONPATH": str(TOOLS)}
    config = ["--config-file", str(ROOT / "tools" / "mkdocs.yml")]
    return subprocess.run([*command, *config], env=variables).returncode


def main(arguments: list[str] | None = None) -> int:
    """The exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--links", action="store_true", help="check the links, build nothing")
    options = parser.parse_args(arguments)
    wrong = wrong_links(ROOT, pages())
    print("".join(f"{line}\n" for line in wrong), end="", file=sys.stderr)
    if wrong or options.links:
        return int(bool(wrong))
    code = build()
    if code == 0:
        print(f"{SITE.relative_to(ROOT)}/index.html")
    return code


if __name__ == "__main__":
    sys.exit(main())
