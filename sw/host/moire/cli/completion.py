# SPDX-License-Identifier: Apache-2.0
"""Completion of commands, options and names by the Tab key, in the shells that click knows and in
`moire shell`.
"""

import os

from click.shell_completion import (
    BashComplete,
    FishComplete,
    ShellComplete,
    ZshComplete,
    add_completion_class,
)

from moire.cli.parser import moire

VARIABLE = "_MOIRE_COMPLETE"


def last_command(arguments: list[str]) -> list[str]:
    """The arguments after the last `--` of a chain."""
    for at in range(len(arguments), 0, -1):
        if arguments[at - 1] == "--":
            return arguments[at:]
    return arguments


class OfAChain(ShellComplete):
    """Completes the last command of a chain."""

    def get_completion_args(self) -> tuple[list[str], str]:
        """The arguments of the last command, and the word that is being typed."""
        arguments, incomplete = super().get_completion_args()
        return last_command(arguments), incomplete


class Bash(OfAChain, BashComplete):
    """The same in bash."""


class Zsh(OfAChain, ZshComplete):
    """The same in zsh."""


class Fish(OfAChain, FishComplete):
    """The same in fish."""


for shell in (Bash, Zsh, Fish):
    add_completion_class(shell)


def answer_shell() -> None:
    """Where a shell asks for completions, print them and end the program."""
    if VARIABLE in os.environ:
        moire.main([], prog_name="moire", complete_var=VARIABLE)


def candidates(line: str) -> dict[str, str]:
    """The words that may follow in a line of `moire shell`, the last of which is incomplete, and
    what they mean.
    """
    *words, incomplete = line.split(" ")
    arguments = last_command([word for word in words if word])
    found = ShellComplete(moire, {}, "moire", VARIABLE).get_completions(arguments, incomplete)
    return {item.value: item.help or "" for item in found if item.type == "plain"}
