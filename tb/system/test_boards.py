# SPDX-License-Identifier: Apache-2.0
"""The boards of constraints/: each port of its top has one pin of its own, and the top fits the
node as it is.
"""

import re
import subprocess
import sys

import pytest

from tb.bench import ROOT, search_path

BOARDS = sorted(path.parent for path in (ROOT / "constraints").glob("*/board.mk"))


def ports(top):
    """Names of the pads: a vector has one for each bit."""
    declared = re.findall(
        r"(?:input\s+wire|output\s+logic)\s+(?:\[(\d+):0\])?\s*(\w+)", top.read_text()
    )
    return [
        name if high == "" else f"{name}[{n}]"
        for high, name in declared
        for n in range(int(high or 0) + 1)
    ]


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.name)
def test_each_port_has_a_pin_of_its_own(board):
    pins = re.findall(r'LOCATE COMP "([^"]+)" SITE "(\w+)"', (board / "pins.lpf").read_text())
    assert sorted(name for name, _ in pins) == sorted(ports(board / "top.sv"))
    assert len({site for _, site in pins}) == len(pins)
    electrical = re.findall(r'IOBUF PORT "([^"]+)"', (board / "pins.lpf").read_text())
    assert sorted(electrical) == sorted(name for name, _ in pins)


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.name)
def test_the_top_fits_the_node(board):
    directories = " ".join(f"-libdir {directory}" for directory in search_path())
    passes = (
        f"read_verilog -lib +/ecp5/cells_bb.v; read_verilog -sv {board / 'top.sv'}; "
        f"hierarchy -check -top top {directories}"
    )
    done = subprocess.run(
        [sys.executable, ROOT / "tools" / "yosys.py", passes],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-400:]
    assert not re.search(r"not connected|Resizing cell port top", done.stdout)
