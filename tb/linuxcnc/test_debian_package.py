# SPDX-License-Identifier: Apache-2.0
"""The driver as a Debian package: built, and without a complaint of lintian. Skipped by name where
the programs for this are not installed.
"""

import shutil
import subprocess

import pytest

from linuxcnc_config.headless import RULES, SOURCES

PROGRAMS = ("dpkg-buildpackage", "dh", "lintian")


def test_the_package_is_built_and_lintian_finds_nothing(tmp_path):
    lacking = [name for name in PROGRAMS if not shutil.which(name)]
    if lacking or not RULES.exists():
        pytest.skip(f"not installed: {', '.join(lacking) or 'linuxcnc-uspace-dev'}")
    source = tmp_path / "linuxcnc-moire"
    objects = shutil.ignore_patterns("*.o", "*.so", "*.sym", "*.tmp", "*.ver")
    shutil.copytree(SOURCES, source, ignore=objects)
    run = {"check": True, "capture_output": True, "text": True}
    subprocess.run(["dpkg-buildpackage", "-us", "-uc", "-b"], cwd=source, **run)
    changes = next(tmp_path.glob("*.changes"))
    command = ["lintian", "--allow-root", "--info", "--display-info", str(changes)]
    assert subprocess.run(command, **run).stdout == ""
    package = next(path for path in tmp_path.glob("*.deb") if "dbgsym" not in path.name)
    listed = subprocess.run(["dpkg-deb", "--contents", str(package)], **run).stdout
    assert "./usr/lib/linuxcnc/modules/moire.so" in listed
