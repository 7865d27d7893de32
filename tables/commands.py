# SPDX-License-Identifier: Apache-2.0
"""Makes docs/commands, one page a command of `moire`, of the parser of the command line."""

import argparse
import sys
from pathlib import Path

from moire.cli.command_line import EXAMPLES, common_options, make_parser
from tables import made_files

ROOT = Path(__file__).resolve().parent.parent
PAGES = ROOT / "docs" / "commands"

HEAD = [
    "<!-- SPDX-License-Identifier: Apache-2.0 -->",
    "<!-- Made by tables/commands.py of the parser in sw/host/moire: do not edit. -->",
]
COMMON = {option for action in common_options()._actions for option in action.option_strings}


def below(parser) -> dict:
    """Parsers of the commands, or of the actions of a command, by name."""
    found = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    return found[0].choices if found else {}


def words(text: str) -> str:
    return text.replace("%%", "%").replace("|", "\\|")


def name_of(action) -> str:
    value = action.metavar or (
        ",".join(map(str, action.choices)) if action.choices else action.dest.upper()
    )
    if not action.option_strings:
        return value + {"*": " …", "+": " …"}.get(action.nargs, "")
    return action.option_strings[-1] + (
        "" if action.nargs == 0 else f" {value}" + (" …" if action.nargs == "+" else "")
    )


def arguments(actions) -> list:
    """A table of them; what is in brackets may be left out."""
    rows = []
    for action in actions:
        may_miss = action.option_strings and not action.required or action.nargs in ("?", "*")
        rows.append(
            f"| `{f'[{name_of(action)}]' if may_miss else name_of(action)}` | {words(action.help or '')} |"
        )
    return ["", "| argument | |", "| --- | --- |", *rows] if rows else []


def own(parser) -> list:
    return [
        action
        for action in parser._actions
        if not isinstance(action, argparse._SubParsersAction)
        and not COMMON & set(action.option_strings)
        and action.dest != "help"
    ]


def section(parser) -> list:
    out = [parser.description]
    if parser.epilog:
        out += ["", "    " + words(parser.epilog).removeprefix("example: ")]
    return out + arguments(own(parser))


def page(name: str, parser) -> str:
    out = [*HEAD, f"# moire {name}", "", *section(parser)]
    for action, part in below(parser).items():
        out += ["", f"## {name} {action}", "", *section(part)]
    return "\n".join([*out, ""])


def first_page(parser) -> str:
    rows = [
        f"| [`{name}`]({name}.md) | {words(made.description)} |"
        for name, made in below(parser).items()
    ]
    common = [action for action in common_options()._actions if action.option_strings]
    return "\n".join(
        [
            *HEAD,
            "# The commands of moire",
            "",
            parser.description,
            "",
            "| command | |",
            "| --- | --- |",
            *rows,
            "",
            "## With every command",
            *arguments(common),
            "",
            "## How they go together",
            "",
            "```",
            EXAMPLES.strip(),
            "```",
            "",
        ]
    )


def pages() -> dict:
    parser = make_parser()
    return {
        PAGES / "README.md": first_page(parser),
        **{PAGES / f"{name}.md": page(name, made) for name, made in below(parser).items()},
    }


def made() -> dict:
    """{path: text}, None of a page whose command is gone."""
    wanted = pages()
    return wanted | dict.fromkeys(set(PAGES.glob("*.md")) - set(wanted))


def main(arguments=None) -> int:
    return made_files.main(__doc__, made, arguments)


if __name__ == "__main__":
    sys.exit(main())
