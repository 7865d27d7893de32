# SPDX-License-Identifier: Apache-2.0
"""README.md and docs/: each command line does what is printed; and tools/docs_commands finds one
that does not."""

import pytest

from tools import docs_commands

PAGES = docs_commands.pages()


@pytest.mark.parametrize(
    "page", PAGES, ids=[str(page.path.relative_to(docs_commands.ROOT)) for page in PAGES]
)
def test_every_command_of_the_page_does_what_is_printed(page):
    assert docs_commands.failures(page) == []


def page_of(tmp_path, text):
    path = tmp_path / "page.md"
    path.write_text(text)
    return docs_commands.read(path)


def test_commands_files_and_the_machine_are_read_from_a_page(tmp_path):
    page = page_of(
        tmp_path,
        "<!-- machine: s4 -->\n# Title\n\n    moire find     # who is there\n    not a command\n\n"
        "```csv angles.csv\n0deg\n90deg\n```\n```toml a.toml\nb = 1\n```\n```toml\nc = 2\n```\n"
        "\n```sh\nmake help\n```\n"
        "```python\nfrom moire import Bus\n```\n```python\nbus.sync()\n```\n",
    )
    assert page.commands == ["moire find", "make help"] and page.machine == "s4"
    assert page.files == {"angles.csv": "0deg\n90deg\n", "a.toml": "b = 1\n"}
    assert page.programs == ["from moire import Bus\n"]


@pytest.mark.parametrize(
    "words, limit, reason",
    [
        ("false", 5, "exit 1"),
        ("python3 -c 'print(\"so\"); raise SystemExit(3)'", 5, "exit 3: so"),
        ("sleep 60", 0.2, "did not end within 0 s"),
    ],
)
def test_a_command_that_fails_is_found(tmp_path, words, limit, reason):
    said = docs_commands.execute(words, tmp_path, {"PATH": "/usr/bin:/bin"}, limit, False)
    assert said is not None and reason in said


def test_a_command_without_an_end_may_be_stopped_where_the_page_means_it(tmp_path):
    environment = {"PATH": "/usr/bin:/bin"}
    assert docs_commands.execute("sleep 60", tmp_path, environment, 0.2, True) is None
