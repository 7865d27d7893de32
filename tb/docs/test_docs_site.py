# SPDX-License-Identifier: Apache-2.0
"""tools/docs_site.py: every link and anchor of the pages, the paths that the guides name, and the
modules of the reference.
"""

import re
from importlib import import_module

import pytest

from tools import ROOT, docs_site

GUIDES = ("docs/add_a_module.md", "docs/add_a_machine_model.md", "CONTRIBUTING.md")


def test_every_link_of_every_page_leads_to_a_file_and_a_heading():
    assert docs_site.wrong_links(ROOT, docs_site.pages()) == []
    assert docs_site.main(["--links"]) == 0


def test_the_pages_are_those_of_the_project():
    names = {str(page) for page in docs_site.pages()}
    assert names >= {"README.md", "docs/tutorial.md", "docs/commands/move.md", *GUIDES}
    assert not any(name.startswith("build") for name in names)


@pytest.mark.parametrize(
    "text, wrong",
    [
        ("[a](other.md) [b](other.md#two-words) [c](#here) [d](https://x.y/z.md)\n# Here", []),
        ("[a](none.md)", ["page.md: there is no none.md"]),
        ("[a](other.md#three)", ["page.md: there is no heading for other.md#three"]),
        ("[a](#there)\n# Here", ["page.md: there is no heading for #there"]),
        ("```\n[a](none.md)\n```\n    [a](none.md)\n`[a](none.md)`", []),
        ("[a](other.md#again-1)", []),
        ("[a](other.md#again-2)", ["page.md: there is no heading for other.md#again-2"]),
        ("[a](other.md#a-link-and-code)", []),
    ],
)
def test_a_link_that_leads_nowhere_is_named(tmp_path, text, wrong):
    (tmp_path / "page.md").write_text(text)
    (tmp_path / "other.md").write_text(
        "# Two words\n# Again\n# Again\n## A [link](x.md), and `code`\n```\n# Three\n```\n"
    )
    assert docs_site.wrong_links(tmp_path, [docs_site.Path("page.md")]) == wrong


def test_a_wrong_link_is_exit_code_1(monkeypatch, capsys):
    monkeypatch.setattr(docs_site, "wrong_links", lambda *_: ["page.md: there is no x.md"])
    assert docs_site.main([]) == 1 and "there is no x.md" in capsys.readouterr().err


def test_the_sources_of_the_site_have_all_pages_and_what_they_link_to(tmp_path, monkeypatch):
    monkeypatch.setattr(docs_site, "SOURCE", tmp_path)
    docs_site.copy_pages()
    copied = [path.relative_to(tmp_path) for path in tmp_path.rglob("*.md")]
    assert set(docs_site.pages()) <= set(copied) and (tmp_path / "docs" / "page.png").exists()
    assert docs_site.wrong_links(tmp_path, copied) == []
    assert "::: moire.aio" in (tmp_path / "reference" / "connect.md").read_text()


def test_every_module_of_the_reference_exists_and_has_a_docstring():
    for modules in docs_site.REFERENCE.values():
        for module in modules:
            assert import_module(module).__doc__


def test_what_the_guides_name_exists():
    for guide in GUIDES:
        for name in re.findall(r"`([a-z_]+(?:/[\w.]+)+)`", (ROOT / guide).read_text()):
            assert name.startswith("build/") or (ROOT / name).exists(), f"{guide}: {name}"
