# SPDX-License-Identifier: Apache-2.0
"""Runs LinuxCNC without a screen, in namespaces of its own: several can run at once, and none sees
the HAL of another. The component is built from its sources and installed in that namespace only.
Needs root, and what `make linuxcnc` installs.
"""

import fcntl
import json
import os
import shlex
import shutil
import socket
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from boards.toml_file import ROOT
from linuxcnc_config.generate import Configuration, write
from moire.errors import MoireError

SOURCES = ROOT / "sw" / "linuxcnc"
BUILD = ROOT / "build" / "linuxcnc"
OPERATOR = SOURCES / "operator_steps.py"
MODULES = Path("/usr/lib/linuxcnc/modules")
RULES = Path("/usr/share/linuxcnc/Makefile.modinc")
MESSAGES, USUAL_PORT = Path("/usr/share/linuxcnc/linuxcnc.nml"), 5005
PRIVATE = Path("/mnt")  # everything of a run, in its own namespace
# with processes of their own: the end of LinuxCNC ends all that have the names of its parts
PRIVATELY = ("unshare", "--ipc", "--mount", "--pid", "--fork", "--mount-proc")
PLAIN_USER = 65534  # nobody: LinuxCNC refuses to run as root
LONGEST_S = 3600


def missing() -> str | None:
    """What a run lacks on this computer, in a sentence; None if nothing."""
    for found, what in (
        (shutil.which("linuxcnc"), "LinuxCNC is not installed"),
        (RULES.exists(), "linuxcnc-uspace-dev is not installed"),
        (Path("/usr/include/zlib.h").exists(), "zlib1g-dev is not installed"),
    ):
        if not found:
            return f"{what}: make linuxcnc"
    if os.geteuid() != 0:
        return "LinuxCNC gets namespaces of its own only from root"
    private = subprocess.run([*PRIVATELY, "true"], capture_output=True)
    return None if private.returncode == 0 else "this computer gives no private namespaces"


def component() -> Path:
    """The folder with the built component moire.so."""
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # of another run that builds it
        build()
    return BUILD


def build() -> None:
    """Copies what has changed and runs make."""
    for path in [*SOURCES.glob("*.[ch]"), SOURCES / "Makefile", *SOURCES.glob("made/*.h")]:
        copy = BUILD / path.relative_to(SOURCES)
        copy.parent.mkdir(exist_ok=True)
        if not copy.exists() or copy.read_bytes() != path.read_bytes():
            shutil.copy(path, copy)
    subprocess.run(["make", "-s", "-C", str(BUILD)], check=True, capture_output=True, text=True)


@dataclass(frozen=True)
class Run:
    """How a LinuxCNC ran."""

    exit_code: int
    printed: str  # on its terminal
    report: list[dict[str, Any]]  # of the operator: operator_steps.py

    @property
    def done(self) -> bool:
        """Whether all steps were done."""
        return bool(self.report) and all(row["done"] for row in self.report)

    def finished(self) -> None:
        """MoireError if it did not come to the end."""
        if not self.done:
            raise MoireError(f"LinuxCNC did not run: {self.printed[-500:]} {self.report[-1:]}")


def with_own_port(ini: Path) -> None:
    """Gives the server of LinuxCNC's messages another TCP port than that of other runs."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    text = MESSAGES.read_text(encoding="utf-8").replace(f"={USUAL_PORT}", f"={port}")
    (ini.parent / MESSAGES.name).write_text(text, encoding="utf-8")
    head = f"[EMC]\nNML_FILE = {MESSAGES.name}\n"
    ini.write_text(ini.read_text(encoding="utf-8").replace("[EMC]\n", head), encoding="utf-8")


def run(
    found: Configuration,
    folder: Path,
    steps: Sequence[Sequence[Any]],
    programs: Mapping[str, str] | None = None,
    hal: str | None = None,
    within: Sequence[str] = (),
) -> Run:
    """Runs LinuxCNC with a configuration, which is written into the folder; `steps` of the operator
    and the G-code of the `programs` by file name. `hal` is the text of another HAL file than that
    of a node, and `within` are words before the command, such as those of another namespace."""
    ini = write(replace(found, display=f"./{OPERATOR.name}"), folder)
    if hal is not None:
        ini.with_suffix(".hal").write_text(hal, encoding="utf-8")
    shutil.copy(OPERATOR, folder)
    with_own_port(ini)
    for name, text in (programs or {}).items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "steps.json").write_text(json.dumps([list(step) for step in steps]))
    for path in (folder, *folder.iterdir()):
        os.chown(path, PLAIN_USER, PLAIN_USER)
    script = f"""
        set -e
        mount -t tmpfs tmpfs /dev/shm
        mount -t tmpfs -o mode=1777 tmpfs {PRIVATE}
        cd {PRIVATE}
        mkdir -m 1777 upper work tmp home machine
        mknod -m 666 null c 1 3
        mount --bind null /dev/null
        cp {shlex.quote(str(component() / "moire.so"))} upper
        mount -t overlay -o lowerdir={MODULES},upperdir=upper,workdir=work overlay {MODULES}
        mount --bind {shlex.quote(str(folder))} machine
        mount --bind tmp /tmp
        cd machine
        exec setpriv --reuid {PLAIN_USER} --regid {PLAIN_USER} --clear-groups \
            env -u DISPLAY HOME={PRIVATE}/home LANG=C linuxcnc -r {shlex.quote(ini.name)}
    """
    ran = subprocess.run(
        [*within, *PRIVATELY, "sh", "-c", script],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=LONGEST_S,
    )
    report = folder / "report.json"
    rows = json.loads(report.read_text(encoding="utf-8")) if report.exists() else []
    return Run(ran.returncode, ran.stdout, rows)
