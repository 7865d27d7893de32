# SPDX-License-Identifier: Apache-2.0
"""Runs the command lines that README.md and docs/ print, as printed.

A command is a line of an indented or `sh` code block that begins with `moire`, `make`, `export`,
`pip` or a program of build/venv. Each page is one session in an empty folder of its own:

- commands for hardware (`--port /dev/ttyUSB0`, or no port at all) go to a served twin; a page says
  `<!-- machine: s4 -->` where this is not the X axis of S0;
- a code block with the info string `csv NAME` or `toml NAME` is written to the file NAME first;
- a `python` code block that begins with an import is run as a program;
- `moire twin` serves until the next one, an experiment or the end of the page, and what would run
  for ever is ended by Ctrl-C;
- targets of make that would call the tests again, or need tens of minutes, are only resolved
  (`make -n`); so are those of some minutes, and experiments are ended after LONGEST_S, unless
  --whole is given.

    python -m tools.docs_commands [--whole] [PAGE …]       exit code 1 when a command fails
"""

import argparse
import fcntl
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tools import ROOT, obey_signals
from twin.build import SHORT_RUNS

PROGRAMS = ROOT / "build" / "venv" / "bin"
COMMAND = re.compile(r"(moire|make|export|pip|build/venv/bin/\w+)\b")
HARDWARE = re.compile(r"/dev/ttyUSB0|COM3|socket://127\.0\.0\.1:2218")
RESOLVED_ONLY = re.compile(
    r"make (test$|check|figures|soak|board|litex|mutators|sigrok|gowin|chromium|ngspice|linuxcnc"
    r"|spice|load|flash|firmware BOARD)"
)
ENDLESS = re.compile(r"moire\b.* (watch|serve)\b|moire (watch|serve)\b")
SERVER = re.compile(r"moire\b.* serve$")  # any free ports: the served twin may have the usual ones
EXPERIMENT = re.compile(r"build/venv/bin/python -m experiments\.")
RESOLVED_IN_SHORT = re.compile(
    r"make (demo|format|test K|prove K|tables|lint|promises|docs)"
)  # unless the whole is asked for
LONGEST_S = 2  # of an experiment, unless the whole is asked for
ENDLESS_S = 4  # of a command that only Ctrl-C ends
PATIENCE_S = 600  # of every other command


@dataclass
class Page:
    """What a page asks to be run: commands in their order, files that they read, the machine."""

    path: Path
    commands: list[str] = field(default_factory=list)
    programs: list[str] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)
    machine: str = "s0 --nodes 1"  # with options of `moire twin`


def code_lines(text: str) -> Iterator[tuple[str, str]]:
    """(info string, line) of each line in a code block; indented blocks have no info string."""
    info: str | None = None
    for line in text.splitlines():
        fence = re.match(r"```(.*)", line)
        if fence:
            info = None if info is not None else fence.group(1).strip()
        elif info is not None:
            yield info, line
        elif line.startswith("    "):
            yield "", line[4:]


def read(path: Path) -> Page:
    """The page of a Markdown file."""
    text, page = path.read_text(encoding="utf-8"), Page(path)
    machine = re.search(r"<!-- machine: (\w+) -->", text)
    if machine:
        page.machine = machine.group(1)
    for block in re.findall(r"^```python\n((?:from|import) .*?)^```", text, re.M | re.S):
        page.programs.append(block)
    for info, line in code_lines(text):
        if info.startswith(("csv ", "toml ")):
            name = info.split()[1]
            page.files[name] = page.files.get(name, "") + line + "\n"
        elif info in ("", "sh") and COMMAND.match(line):
            page.commands.append(re.split(r"\s+#", line)[0].strip())
    return page


def pages() -> list[Page]:
    """The pages that print commands."""
    paths = [
        *(ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "sw" / "host" / "README.md"),
        *(ROOT / "docs").glob("*.md"),
    ]
    return [page for page in map(read, sorted(paths)) if page.commands]


class Session:
    """One page being run: its folder, its environment, its served twin."""

    def __init__(self, page: Page, folder: Path, whole: bool = False) -> None:
        self.page, self.folder, self.whole = page, folder, whole
        self.environment = os.environ | {"PATH": f"{PROGRAMS}{os.pathsep}{os.environ['PATH']}"}
        self.environment.pop("MOIRE_PORT", None)
        if not whole:
            self.environment[SHORT_RUNS] = "1"
        self.server: subprocess.Popen[str] | None = None
        self.usual_ports = open(ROOT / "build" / "docs_commands.lock", "w")
        self.port = ""
        for name, text in page.files.items():
            (folder / name).write_text(text, encoding="utf-8")

    def serve(self, arguments: str) -> None:
        """Start the served twin; its TCP port becomes the port of the page."""
        self.close()
        if "--tcp" not in arguments:  # the usual ports: one page at a time may have them
            fcntl.flock(self.usual_ports, fcntl.LOCK_EX)
        command = [str(PROGRAMS / "moire"), *shlex.split(arguments), "--json"]
        self.server = subprocess.Popen(
            command,
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=obey_signals,
        )
        assert self.server.stdout
        answer = json.loads(self.server.stdout.readline() or "{}")
        if "tcp" not in answer:
            raise RuntimeError(f"`moire {arguments}` serves nothing: {answer.get('message', '')}")
        self.port = answer["tcp"]
        self.environment["MOIRE_PORT"] = self.port

    def run(self, command: str) -> str | None:
        """None when the command did what is printed, else why not in one line."""
        words = command.removeprefix("build/venv/bin/")
        if words.startswith("moire twin"):
            self.serve(words.removeprefix("moire "))
            return None
        if command.startswith("export "):
            name, _, value = command.removeprefix("export ").partition("=")
            self.environment[name] = HARDWARE.sub(self.port, value) if self.port else value
            return None
        if words.startswith("moire ") and not re.search(r"--port twin|--help|^moire study", words):
            self.need_port()
        if words.startswith("pip install"):
            words = words.replace("install", "install --dry-run --no-deps --no-build-isolation")
        if RESOLVED_ONLY.match(words) or not self.whole and RESOLVED_IN_SHORT.match(words):
            words = words.replace("make", "make -n", 1)
        if SERVER.match(words):
            words += " --http 0 --rfc2217 0 --tcp 0"
        limit, may_be_stopped = PATIENCE_S, False
        if ENDLESS.match(words):
            limit, may_be_stopped = ENDLESS_S, True
        elif EXPERIMENT.match(command):
            self.close()  # it has a twin of its own
            limit = 2 * 3600 if self.whole else LONGEST_S
            may_be_stopped = not self.whole
        here = self.folder if words.startswith("moire") else ROOT
        return execute(
            HARDWARE.sub(self.port, words), here, self.environment, limit, may_be_stopped
        )

    def need_port(self) -> None:
        """Serve the machine of the page unless something is served already."""
        if not self.server:
            self.serve(f"twin --machine {self.page.machine} --http 0 --rfc2217 0 --tcp 0")

    def run_program(self, program: str) -> str | None:
        """Run a Python program of the page against the served twin."""
        self.need_port()
        file = self.folder / "program.py"
        file.write_text(HARDWARE.sub(self.port, program), encoding="utf-8")
        words = shlex.join([str(PROGRAMS / "python"), str(file)])
        return execute(words, self.folder, self.environment, PATIENCE_S, may_be_stopped=False)

    def close(self) -> None:
        """End the served twin as a person would."""
        if self.server:
            self.server.send_signal(signal.SIGINT)
            try:
                self.server.communicate(timeout=30)
            except subprocess.TimeoutExpired:
                self.server.kill()
                self.server.communicate()
            self.server = None
            fcntl.flock(self.usual_ports, fcntl.LOCK_UN)


def execute(
    words: str, here: Path, environment: dict[str, str], limit_s: float, may_be_stopped: bool
) -> str | None:
    """Run one command line; None when it ends with 0, or is stopped where it may be."""
    with subprocess.Popen(
        shlex.split(words),
        cwd=here,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        preexec_fn=obey_signals,
    ) as process:
        try:
            output, _ = process.communicate(timeout=limit_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGINT)
            try:
                output, _ = process.communicate(timeout=30)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                output, _ = process.communicate()
                return f"did not end on Ctrl-C: {last_line(output)}"
            return None if may_be_stopped else f"did not end within {limit_s:.0f} s"
    return None if process.returncode == 0 else f"exit {process.returncode}: {last_line(output)}"


def last_line(output: str) -> str:
    """The last line of an output that says something."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    return lines[-1][:300] if lines else "no output"


def failures(page: Page, whole: bool = False) -> list[str]:
    """`page: command: reason` for each command of a page that does not do what is printed."""
    found = []
    with tempfile.TemporaryDirectory(prefix="moire-docs-") as folder:
        session = Session(page, Path(folder), whole)
        try:
            for command in page.commands:
                try:
                    reason = session.run(command)
                except RuntimeError as error:
                    reason = str(error)
                if reason:
                    found.append(f"{page.path.relative_to(ROOT)}: `{command}`: {reason}")
            for program in page.programs:
                reason = session.run_program(program)
                if reason:
                    found.append(f"{page.path.relative_to(ROOT)}: Python program: {reason}")
        finally:
            session.close()
    return found


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pages", nargs="*", metavar="PAGE", help="a Markdown file; all without one")
    parser.add_argument("--whole", action="store_true", help="run what takes minutes, too")
    options = parser.parse_args()
    chosen = [read(Path(name).resolve()) for name in options.pages] or pages()
    count = 0
    for page in chosen:
        wrong = failures(page, options.whole)
        count += len(wrong)
        print(f"{page.path.relative_to(ROOT)}: {len(page.commands)} commands, {len(wrong)} failed")
        for row in wrong:
            print(f"  {row}", flush=True)
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
