# SPDX-License-Identifier: Apache-2.0
"""The lines that a person types into 'moire shell' at a terminal: with editing, history, proposals
from it, and a list of what may follow.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

from prompt_toolkit import PromptSession
from prompt_toolkit.auto_suggest import AutoSuggestFromHistory
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.history import FileHistory
from prompt_toolkit.input import Input
from prompt_toolkit.output import Output

from moire.cli.completion import candidates

TOOLBAR = " Tab: what may follow   help move: one command   help: all   Ctrl-C: stop   quit "


class SavedHistory(FileHistory):
    """Lines of earlier shells. A shell without history is better than none."""

    def load_history_strings(self) -> Iterable[str]:
        """The lines, the newest first."""
        try:
            return list(super().load_history_strings())
        except OSError:
            return []

    def store_string(self, string: str) -> None:
        """Appends a line to the file."""
        try:
            Path(str(self.filename)).parent.mkdir(parents=True, exist_ok=True)
            super().store_string(string)
        except OSError:
            pass


class Words(Completer):
    """The commands, options and names that may follow, with what they mean."""

    def get_completions(self, document: Document, _: CompleteEvent) -> Iterator[Completion]:
        """Called by prompt_toolkit."""
        line = document.text_before_cursor
        typed = len(line.split(" ")[-1])
        for word, meaning in candidates(line).items():
            yield Completion(f"{word} ", -typed, display=word, display_meta=meaning)


class Terminal:
    """A terminal and the file of its history. `reader` and `writer` replace the terminal."""

    def __init__(
        self, history: Path, reader: Input | None = None, writer: Output | None = None
    ) -> None:
        self.session: PromptSession[str] = PromptSession(
            history=SavedHistory(str(history)),
            completer=Words(),
            complete_while_typing=False,  # the Tab key decides
            enable_history_search=True,  # lines that begin like this one
            auto_suggest=AutoSuggestFromHistory(),
            bottom_toolbar=TOOLBAR,
            input=reader,
            output=writer,
        )

    def line(self, prompt: str) -> str | None:
        """The next line; None at Ctrl-D. Ctrl-C is a KeyboardInterrupt."""
        try:
            return self.session.prompt(prompt)
        except EOFError:
            return None
