# SPDX-License-Identifier: Apache-2.0
"""Makes docs/commands, one page per command of `moire`, from the commands themselves."""

import sys
from pathlib import Path

import click

from moire.cli.command_line import moire
from moire.cli.options import COMMON, Common
from moire.cli.parser import EXAMPLES, SECTIONS, Several
from tables import made_files

ROOT = Path(__file__).resolve().parent.parent
PAGES = ROOT / "docs" / "commands"

HEAD = [
    "<!-- SPDX-License-Identifier: Apache-2.0 -->",
    "<!-- Made by tables/commands.py from sw/host/moire/cli: do not edit. -->",
]


def below(command: click.Command) -> dict:
    """The commands of a group by name; none if the command is no group."""
    return command.commands if isinstance(command, click.Group) else {}


def words(text: str) -> str:
    return text.replace("|", "\\|")


def name_of(parameter: click.Parameter) -> str:
    """A parameter as a user writes it; what may be left out is in brackets."""
    value = parameter.metavar or parameter.human_readable_name
    if isinstance(parameter, click.Option):
        value = parameter.opts[-1] + ("" if parameter.is_flag else f" {value}")
    more = " …" if parameter.nargs == -1 or isinstance(parameter, Several) else ""
    return value + more if parameter.required else f"[{value}{more}]"


def table(parameters) -> list:
    rows = [f"| `{name_of(each)}` | {words(each.help)} |" for each in parameters]
    return ["", "| argument | |", "| --- | --- |", *rows] if rows else []


def own(command: click.Command) -> list:
    """The parameters of a command without the options of every command."""
    return [each for each in command.params if not isinstance(each, Common)]


def section(command: click.Command) -> list:
    return [command.help, "", f"    {command.example}", *table(own(command))]


def page(name: str, command: click.Command) -> str:
    out = [*HEAD, f"# moire {name}", "", *section(command)]
    for action, part in below(command).items():
        out += ["", f"## {name} {action}", "", *section(part)]
    return "\n".join([*out, ""])


def first_page() -> str:
    out = [*HEAD, "# The commands of moire", "", moire.help]
    for title, names in SECTIONS.items():
        out += ["", f"## {title}", "", "| command | |", "| --- | --- |"]
        out += [f"| [`{name}`]({name}.md) | {words(moire.commands[name].help)} |" for name in names]
    out += ["", "## Options of every command", *table(COMMON)]
    out += ["", "## How they go together", "", "```", EXAMPLES.strip(), "```", ""]
    return "\n".join(out)


def pages() -> dict:
    return {
        PAGES / "README.md": first_page(),
        **{PAGES / f"{name}.md": page(name, command) for name, command in below(moire).items()},
    }


def made() -> dict:
    """{path: text}; the text is None for the page of a command that no longer exists."""
    fresh = pages()
    return fresh | dict.fromkeys(set(PAGES.glob("*.md")) - set(fresh))


def main(arguments=None) -> int:
    return made_files.main(__doc__, made, arguments)


if __name__ == "__main__":
    sys.exit(main())
