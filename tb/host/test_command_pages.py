# SPDX-License-Identifier: Apache-2.0
"""tables/commands.py and the pages with commands: no made page is stale, and every command on a
page is valid.
"""

import re
import shlex
from pathlib import Path

import pytest

from moire.cli import command_line
from moire.cli.parser import SECTIONS
from tables import commands as generator

ROOT = Path(__file__).resolve().parents[2]


def test_the_made_pages_are_fresh_and_there_is_one_for_each_command():
    assert generator.main(["--check"]) == 0
    names = set(command_line.moire.commands)
    assert {path.stem for path in generator.PAGES.glob("*.md")} == names | {"README"}
    assert names >= {
        "find",
        "status",
        "home",
        "move",
        "watch",
        "scope",
        "tune",
        "commission",
        "params",
        "fault",
        "reset",
        "selftest",
    }


def test_a_stale_page_and_one_of_no_command_are_found_and_put_right(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(generator, "PAGES", tmp_path / "commands")
    assert generator.main([]) == 0 and generator.main(["--check"]) == 0
    (tmp_path / "commands" / "move.md").write_text("edited")
    (tmp_path / "commands" / "fly.md").write_text("gone")
    capsys.readouterr()
    assert generator.main(["--check"]) == 1
    message = capsys.readouterr().err
    assert (
        "commands/move.md is stale" in message
        and "commands/fly.md is stale" in message
        and message.count("\n") == 2
    )
    assert (
        generator.main([]) == 0
        and generator.main(["--check"]) == 0
        and not (tmp_path / "commands" / "fly.md").exists()
    )


def test_every_argument_of_every_command_is_on_its_page():
    for name, command in command_line.moire.commands.items():
        text = (generator.PAGES / f"{name}.md").read_text()
        for part in [command, *generator.below(command).values()]:
            assert part.help in text and f"    {part.example}\n" in text
            for parameter in generator.own(part):
                assert f"| `{generator.name_of(parameter)}` | " in text
    move = (generator.PAGES / "move.md").read_text()
    assert "| `LENGTH` | " in move and "| `[--by]` | " in move
    assert "| `[--nodes N …]` | " in (generator.PAGES / "twin.md").read_text()
    assert "| `--bandwidth FREQUENCY` | " in (generator.PAGES / "tune.md").read_text()


def every_command():
    for command in command_line.moire.commands.values():
        yield from [command, *generator.below(command).values()]


def test_every_help_text_is_a_full_sentence():
    for command in every_command():
        for text in [command.help, *(parameter.help for parameter in generator.own(command))]:
            assert text[0] in "0123456789" or text[0].isupper() or ":" in text, text
            assert text.endswith("."), text


def test_the_sections_of_the_help_name_every_command_once():
    names = [name for names in SECTIONS.values() for name in names]
    assert sorted(names) == sorted(command_line.moire.commands)


def written_commands():
    pages = [
        ROOT / "README.md",
        ROOT / "docs" / "tutorial.md",
        *sorted((ROOT / "docs" / "commands").glob("*.md")),
    ]
    for path in pages:
        for line in re.findall(
            r"^ +(?:build/venv/bin/)?(moire (?!.*--help).*)$", path.read_text(), re.MULTILINE
        ):
            yield pytest.param(line, id=f"{path.stem}: {line}")


@pytest.mark.parametrize("line", list(written_commands()))
def test_every_command_on_a_page_is_understood(line):
    arguments = shlex.split(line, comments=True)[1:]
    assert command_line.parse_call(arguments)
