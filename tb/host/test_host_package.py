# SPDX-License-Identifier: Apache-2.0
"""The wheel of sw/host alone, installed outside the checkout: `moire` works there, and reports in
one line that the twin needs a checkout.
"""

import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import click
import cobs
import prompt_toolkit
import pytest
import serial
import wcwidth

HOST = Path(__file__).resolve().parents[2] / "sw" / "host"
# NumPy and Matplotlib are loaded only where they are needed
DEPENDENCIES = (click, cobs, prompt_toolkit, serial, wcwidth)


def run(*command, **settings):
    return subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, **settings
    )


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A function that runs a program of a fresh environment in which only the wheel and what it
    depends on are installed.
    """
    folder = tmp_path_factory.mktemp("installed")
    source, wheels, dependencies = folder / "source", folder / "wheels", folder / "dependencies"
    shutil.copytree(HOST, source, ignore=shutil.ignore_patterns("build", "*.egg-info"))
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    made = run(*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", wheels, source)
    assert made.returncode == 0, made.stderr
    (wheel,) = wheels.glob("moire-*.whl")
    venv.create(folder / "venv", with_pip=False)
    python = folder / "venv" / "bin" / "python"
    put = run(*pip, "--python", python, "install", "--no-deps", "--no-index", wheel)
    assert put.returncode == 0, put.stderr
    dependencies.mkdir()
    for package in DEPENDENCIES:
        origin = Path(package.__file__).parent
        (dependencies / origin.name).symlink_to(origin)
    variables = {name: text for name, text in os.environ.items() if name != "MOIRE_PORT"}
    variables["PYTHONPATH"] = str(dependencies)

    def program(name, *arguments):
        return run(python.parent / name, *arguments, cwd=folder, env=variables)

    return program


def test_the_command_runs(installed):
    for command in (("moire",), ("python", "-m", "moire")):
        ended = installed(*command, "--help")
        assert ended.returncode == 0 and "Drives and motion:" in ended.stdout, ended.stderr
        assert installed(*command, "--version").stdout.startswith("moire ")
    ended = installed("moire", "status")
    assert ended.returncode == 4 and "write --port /dev/ttyUSB0" in ended.stderr


def test_nothing_but_the_host_package_is_there(installed):
    for package in ("twin", "experiments", "tables", "tb"):
        ended = installed("python", "-c", f"import {package}")
        assert ended.returncode == 1 and "ModuleNotFoundError" in ended.stderr
    where = installed("python", "-c", "import moire; print(moire.__file__)").stdout
    assert "/venv/lib/" in where


def test_the_twin_needs_a_checkout(installed):
    ended = installed("moire", "--port", "twin", "status")
    assert ended.returncode == 4 and ended.stdout == ""
    assert ended.stderr == (
        "moire: the simulated machine needs a checkout of Moire: run `make demo` there and use its "
        "build/venv/bin/moire\n"
    )


def test_every_module_of_the_command_line_is_in_the_wheel(installed):
    names = {
        ".".join(path.relative_to(HOST).with_suffix("").parts)
        for path in (HOST / "moire" / "cli").rglob("*.py")
        if path.name != "__init__.py"
    }
    program = f"import importlib; [importlib.import_module(name) for name in {sorted(names)}]"
    ended = installed("python", "-c", program)
    assert ended.returncode == 0, ended.stderr
    assert len(names) > 20


@pytest.mark.parametrize("folder", ["static", "uplot"])
def test_the_files_of_the_live_page_are_in_the_wheel(installed, folder):
    names = {one.name for one in (HOST / "moire" / "web").glob(f"{folder}/*")}
    program = (
        "from importlib.resources import files; from pathlib import Path; "
        f"folder = Path(str(files('moire.web'))) / {folder!r}; "
        "print(sorted(one.name for one in folder.glob('*')))"
    )
    ended = installed("python", "-c", program)
    assert ended.stdout == f"{sorted(names)}\n", ended.stderr
