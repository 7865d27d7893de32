# SPDX-License-Identifier: Apache-2.0
"""tables/commands.py and the pages with commands: no made page is stale, and every command on a
page is valid.
"""

import re
import runpy
import shlex
from importlib import import_module
from pathlib import Path

import pytest

from moire.cli import command_line
from moire.cli.commands import MODULES
from tables import commands as generator

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = ROOT / "sw" / "host" / "moire" / "cli" / "commands"


def test_the_made_pages_are_fresh_and_there_is_one_for_each_command():
    assert generator.main(["--check"]) == 0
    names = set(MODULES)
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
    for name, command in generator.below(command_line.moire).items():
        text = (generator.PAGES / f"{name}.md").read_text()
        for part in [command, *generator.below(command).values()]:
            assert part.help in text and f"    {part.example}\n" in text
            for parameter in generator.own(part):
                assert f"| `{generator.name_of(parameter)}` | " in text
    move = (generator.PAGES / "move.md").read_text()
    assert "| `LENGTH` | " in move and "| `[--by]` | " in move
    assert "| `[--nodes N …]` | " in (generator.PAGES / "twin.md").read_text()
    assert "| `--counts N` | " in (generator.PAGES / "relay.md").read_text()


def every_command():
    for command in generator.below(command_line.moire).values():
        yield from [command, *generator.below(command).values()]


def test_every_help_text_is_a_full_sentence():
    for command in every_command():
        for text in [command.help, *(parameter.help for parameter in generator.own(command))]:
            assert text[0] in "0123456789" or text[0].isupper() or ":" in text, text
            assert text.endswith("."), text


@pytest.mark.parametrize("module", sorted(set(MODULES.values())))
def test_a_module_makes_the_commands_that_the_help_says(module, monkeypatch):
    for name in MODULES.values():  # what a module imports has made its own commands before
        import_module(f"moire.cli.commands.{name}")
    monkeypatch.setattr(command_line.moire, "commands", {})
    runpy.run_path(str(COMMANDS / f"{module}.py"))
    assert set(command_line.moire.commands) == {
        name for name, made_by in MODULES.items() if made_by == module
    }


def test_every_module_of_commands_is_in_the_help():
    assert {path.stem for path in COMMANDS.glob("*.py")} == set(MODULES.values()) | {"__init__"}


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
    assert command_line.parse_call(arguments, command_line.described(arguments))
