# SPDX-License-Identifier: Apache-2.0
"""moire.cli: help, version, and completion by the shells."""

import importlib.metadata
import os
import re
import subprocess
import sys

import pytest

from moire.cli import command_line, completion


def test_help_names_every_command_and_gives_examples(capsys):
    for arguments, message in (
        (["--help"], "moire --port twin home -- move 1mm -- status"),
        (["move", "--help"], "example: moire"),
        (["params", "set", "--help"], "velocity 5mm/s"),
    ):
        with pytest.raises(SystemExit) as left:
            command_line.main(arguments)
        assert left.value.code == 0 and message in capsys.readouterr().out


def test_the_version_is_the_one_of_the_package(capsys):
    with pytest.raises(SystemExit) as left:
        command_line.main(["--version"])
    assert left.value.code == 0
    assert capsys.readouterr().out == f"moire {importlib.metadata.version('moire')}\n"


def test_help_loads_neither_numpy_nor_matplotlib():
    program = (
        "import sys; from moire.cli import command_line\n"
        "try: command_line.main(['tune', '--help'])\n"
        "finally: print({'numpy', 'matplotlib', 'serial'} & set(sys.modules))"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert ended.returncode == 0 and ended.stdout.splitlines()[-1] == "set()"


@pytest.mark.parametrize(
    "typed, offered",
    [
        ("moire mov", {"move"}),
        ("moire home -- move 1mm -- stat", {"status"}),
        ("moire home -- move 1mm --b", {"--by", "--baud"}),
        ("moire --port twin params get veloc", {"velocity", "velocity_quantum"}),
        ("moire params re", {"restore-defaults"}),
        ("moire status --parity m", {"mark"}),
    ],
)
def test_bash_completes_the_last_command_of_a_chain(typed, offered):
    words = {"COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    ended = subprocess.run(
        [sys.executable, "-m", "moire"],
        env={**os.environ, **words, "_MOIRE_COMPLETE": "bash_complete"},
        capture_output=True,
        text=True,
    )
    assert {row.removeprefix("plain,") for row in ended.stdout.split()} == offered
    assert set(completion.candidates(typed.removeprefix("moire "))) == offered


@pytest.mark.parametrize(
    "shell_name, words, offered",
    [
        ("zsh", {"COMP_WORDS": "moire home -- stat", "COMP_CWORD": "3"}, "status"),
        ("fish", {"COMP_WORDS": "moire home -- stat", "COMP_CWORD": "stat"}, "status"),
    ],
)
def test_zsh_and_fish_complete_the_last_command_too(shell_name, words, offered):
    def ask(what):
        return subprocess.run(
            [sys.executable, "-m", "moire"],
            env={**os.environ, **words, "_MOIRE_COMPLETE": f"{shell_name}_{what}"},
            capture_output=True,
            text=True,
        ).stdout

    assert offered in re.split(r"[\s,]", ask("complete"))
    assert f"_MOIRE_COMPLETE={shell_name}_complete" in ask("source")
