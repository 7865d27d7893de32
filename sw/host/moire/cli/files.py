# SPDX-License-Identifier: Apache-2.0
"""Files that commands read and write. BadFile says in one sentence what went wrong."""

import json
import sys
from pathlib import Path
from typing import Any, TypeGuard

from moire.errors import BadFile, MoireError


class OutputError(MoireError):
    """The standard output cannot be written."""

    exit_code = 2

    def __init__(self, error: OSError) -> None:
        super().__init__(f"the output cannot be written: {error.strerror}")


def read_text(file: str) -> str:
    """The text of a file; "-" is the standard input."""
    try:
        return sys.stdin.read() if file == "-" else Path(file).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise BadFile(f"the file {file} cannot be read: {reason}") from None
    except ValueError:  # a zero byte in the name
        raise BadFile(f"the file {file!r} cannot be read: this is no name of a file") from None


def read_json(file: str) -> Any:
    """The content of a JSON file."""
    try:
        return json.loads(read_text(file))
    except ValueError as error:
        raise BadFile(f"the file {file} is no JSON: {error}") from None


def are_texts(content: Any) -> TypeGuard[dict[str, str]]:
    """Whether this content of a JSON file is an object of names and texts."""
    return isinstance(content, dict) and all(isinstance(text, str) for text in content.values())


def write_text(file: str, text: str) -> None:
    """Replace the content of a file by a text."""
    write_bytes(file, text.encode())


def write_json(file: str, values: dict[str, Any]) -> None:
    """Replace the content of a file by JSON that a person can read and edit."""
    write_text(file, json.dumps(values, indent=4) + "\n")


def write_bytes(file: str, content: bytes) -> None:
    """Replace the content of a file by bytes."""
    try:
        Path(file).write_bytes(content)
    except OSError as error:
        raise BadFile(f"the file {file} cannot be written: {error.strerror}") from None
