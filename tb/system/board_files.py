# SPDX-License-Identifier: Apache-2.0
"""Board and machine files with changes, and all builds, for the tests of boards."""

import os

import pytest

from boards import board, build, machine
from boards.fit import fit
from boards.toml_file import Misfit
from tb.bench import ROOT

DESIGNS, TOO_LARGE = build.fitting()
ULX3S, MILL = "constraints/ulx3s_85f/board.toml", "constraints/machines/mill.toml"


def edited(folder, path, *changes):
    """A copy of a board or machine file with some of its text replaced."""
    text = (ROOT / path).read_text()
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    copy = folder / os.path.basename(path)
    copy.write_text(text)
    return copy


def refusal(make):
    """The one line with which something is refused."""
    with pytest.raises(Misfit) as why:
        make()
    assert "\n" not in str(why.value)
    return str(why.value)


def packer(folder):
    """A packer that makes an empty bitstream."""

    def pack(*_):
        made = folder / "moire.bit"
        made.write_bytes(b"")
        return made

    return pack


def assert_refused(path, name, words):
    """The machine of this file is refused for a board by its name, with the name of the file."""
    found = refusal(lambda: fit(board.named(name), machine.load(path)))
    assert found.startswith(f"{path}: ") and words in found


def over_ethernet(folder, address="192.168.1.50", more=""):
    """The mill with its link over Ethernet."""
    node = "memory_kib = 64\naddress = 1\n"
    table = f'[node.ethernet]\naddress = "{address}"\n{more}\n'
    return edited(folder, MILL, (node, f"{node}\n{table}"))
