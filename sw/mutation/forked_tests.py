# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of a source once for each mutant of it, in processes that fork off.

    python -m mutation.forked_tests REQUEST.json

The request has the language and the name of the source, its tests, a text of the source for each
mutant, the seed of the tests and the longest computing time of a run in s. The program loads what
the tests need from other packages, but nothing of this project that it mutates. For each text it
forks a process that runs the tests until one fails: a module of the host is imported from the text,
a source of the firmware is compiled from it. Each line of the output is JSON:
[number of the text, the test that failed, computing time in s]; the name of the test is empty for a
survivor. It is `(no end)` if the run takes longer than it may, and `(the process ends by itself)`
if no test has failed then.
"""

import importlib.abc
import importlib.machinery
import json
import os
import resource
import signal
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import CodeType, ModuleType

import hypothesis
import numpy as np
import pytest
import rich.console

from twin.build import ROOT
from twin.compiled import host_library

NO_END, ENDS = "(no end)", "(the process ends by itself)"
MEMORY = 4 << 30  # bytes that a run may have
WAITING = 10  # a run that waits takes no computing time: the clock may show so many times more
Request = Mapping[str, object]
LOADED = (hypothesis, np, rich.console)  # for all forks at once


class TextLoader(importlib.machinery.SourceFileLoader):
    """Loads a module from another text than that of its file."""

    def __init__(self, name: str, path: str, text: str):
        super().__init__(name, path)
        self.text = text

    def get_code(self, fullname: str) -> CodeType:
        """The code of the text, with the name of the file."""
        return compile(self.text, self.path, "exec", dont_inherit=True)


class TextFinder(importlib.abc.MetaPathFinder):
    """Finds one module, with another text."""

    def __init__(self, name: str, path: Path, text: str):
        self.name, self.path, self.text = name, str(path), text

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """The specification of the module; None for any other one."""
        if fullname != self.name:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path, target)
        assert spec
        spec.loader = TextLoader(fullname, self.path, self.text)
        return spec


class FirstFailure:
    """A plug-in of pytest that writes the name of the test that fails into a pipe."""

    def __init__(self, pipe: int):
        self.pipe = pipe

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Called after each phase of a test."""
        if report.failed:
            os.write(self.pipe, report.nodeid.encode())


def import_module(request: Request, text: str) -> None:
    """From now on the module is imported from the text."""
    finder = TextFinder(str(request["source"]), Path(str(request["path"])), text)
    sys.meta_path.insert(0, finder)


def compile_firmware(request: Request, text: str) -> None:
    """From now on the firmware is compiled with the text in place of the source."""
    source = Path(str(request["path"]))
    file = Path(tempfile.mkdtemp(dir=str(request["folder"]))) / source.name
    file.write_text(text)
    os.environ[host_library.MUTANT] = f"{source}={file}"


LANGUAGES = {"host": import_module, "firmware": compile_firmware}


def run(tests: Sequence[str], pipe: int) -> int:
    """Run the tests in a process of its own; the exit code is that of pytest."""
    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(null, stream)
    options = ["-x", "-q", "-p", "no:cacheprovider", "--rootdir", str(ROOT)]
    return int(pytest.main([*options, *tests], plugins=[FirstFailure(pipe)]))


def forked(mutate: Callable[[], None], tests: Sequence[str], longest_s: float) -> tuple[str, float]:
    """The test that failed with the source mutated, and the computing time of the run in s."""
    end, pipe = os.pipe()
    pid = os.fork()
    if not pid:
        resource.setrlimit(resource.RLIMIT_CPU, (int(longest_s) + 1, int(longest_s) + 2))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        signal.alarm(WAITING * (int(longest_s) + 1))
        mutate()
        os._exit(run(tests, pipe))
    os.close(pipe)
    with os.fdopen(end) as file:
        failed = file.read()
    _, status, used = os.wait4(pid, 0)
    seconds = used.ru_utime + used.ru_stime
    if status and os.WIFSIGNALED(status):
        stopped = os.WTERMSIG(status) in (signal.SIGALRM, signal.SIGXCPU, signal.SIGKILL)
        return NO_END if stopped else ENDS, seconds
    return failed or (ENDS if status else ""), seconds


def main(request: Path) -> None:
    asked = json.loads(request.read_text())
    os.environ["SEED"] = str(asked["seed"])
    mutate = LANGUAGES[asked["language"]]
    for number, text in enumerate(asked["texts"]):
        change = partial(mutate, asked, text)
        failed, seconds = forked(change, asked["tests"], asked["longest_s"])
        print(json.dumps([number, failed, seconds]), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
