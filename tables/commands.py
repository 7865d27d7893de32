# SPDX-License-Identifier: Apache-2.0
"""Makes docs/commands, one page per command of `moire`, from the commands themselves."""

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import cast

import click

from moire.cli.command_line import moire
from moire.cli.commands import SECTIONS
from moire.cli.options import COMMON, Common
from moire.cli.parser import EXAMPLES, Command, Group, Several
from tables import made_files
from tables.made_files import ROOT

PAGES = ROOT / "docs" / "commands"

Shown = Command | Group

HEAD = [
    "<!-- SPDX-License-Identifier: Apache-2.0 -->",
    "<!-- Made by tables/commands.py from sw/host/moire/cli: do not edit. -->",
]


def below(command: Shown) -> Mapping[str, Shown]:
    """The commands of a group by name; none if the command is no group."""
    if not isinstance(command, Group):
        return {}
    context = click.Context(command)
    names = command.list_commands(context)
    return {name: cast(Shown, command.get_command(context, name)) for name in names}


def help_of(one: click.Command | click.Parameter) -> str:
    """Its help, which every command and every parameter has."""
    return cast(str, one.help)


def words(text: str) -> str:
    return text.replace("|", "\\|")


def name_of(parameter: click.Parameter) -> str:
    """A parameter as a user writes it; what may be left out is in brackets."""
    value = parameter.metavar or parameter.human_readable_name
    if isinstance(parameter, click.Option):
        value = parameter.opts[-1] + ("" if parameter.is_flag else f" {value}")
    more = " …" if parameter.nargs == -1 or isinstance(parameter, Several) else ""
    return value + more if parameter.required else f"[{value}{more}]"


def table(parameters: Iterable[click.Parameter]) -> list[str]:
    rows = [f"| `{name_of(each)}` | {words(help_of(each))} |" for each in parameters]
    return ["", "| argument | |", "| --- | --- |", *rows] if rows else []


def own(command: Shown) -> list[click.Parameter]:
    """The parameters of a command without the options of every command."""
    return [each for each in command.params if not isinstance(each, Common)]


def section(command: Shown) -> list[str]:
    return [help_of(command), "", f"    {command.example}", *table(own(command))]


def page(name: str, command: Shown) -> str:
    out = [*HEAD, f"# moire {name}", "", *section(command)]
    for action, part in below(command).items():
        out += ["", f"## {name} {action}", "", *section(part)]
    return "\n".join([*out, ""])


def first_page() -> str:
    out = [*HEAD, "# The commands of moire", "", help_of(moire)]
    made = below(moire)
    for title, names in SECTIONS.items():
        out += ["", f"## {title}", "", "| command | |", "| --- | --- |"]
        out += [f"| [`{name}`]({name}.md) | {words(help_of(made[name]))} |" for name in names]
    out += ["", "## Options of every command", *table(COMMON)]
    out += ["", "## How they go together", "", "```", EXAMPLES.strip(), "```", ""]
    return "\n".join(out)


def pages() -> dict[Path, str]:
    return {
        PAGES / "README.md": first_page(),
        **{PAGES / f"{name}.md": page(name, command) for name, command in below(moire).items()},
    }


def made() -> dict[Path, str | None]:
    """{path: text}; the text is None for the page of a command that no longer exists."""
    fresh = pages()
    return fresh | dict.fromkeys(set(PAGES.glob("*.md")) - set(fresh))


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__, made, arguments)


if __name__ == "__main__":
    sys.exit(main())
