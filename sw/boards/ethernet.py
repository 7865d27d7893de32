# SPDX-License-Identifier: Apache-2.0
"""The Ethernet core between the PHY of a board and a node: LiteEth, made on demand.

boards.ethernet_core makes it; it needs LiteX and LiteEth, which `make litex` fetches.
"""

import os
import subprocess
import sys
from pathlib import Path

from boards.toml_file import Misfit
from embed.design import FOREIGN_STYLE
from embed.litex_parts import FOLDER, has_ethernet
from moire.made import link_tables
from twin import build
from twin.build import ROOT

NAME = "ethernet_core"  # of the module and its file
MAKER = Path(__file__).with_name("ethernet_core.py")
SOURCES = (  # of all that the core depends on, but its options
    MAKER,
    Path(__file__),
    ROOT / "sw" / "embed" / "litex.lock",
    Path(link_tables.__file__),
)


def core(interface: str, family: str, clk_hz: int, delays_ns: tuple[float, float] = (0, 0)) -> Path:
    """The Verilog of the core, made once: an interface of the board, the family of the part (or
    `simulation`), the clock of the node, and the delays of the clock to the PHY and of the data
    from it. A Misfit says what is missing.
    """
    if not has_ethernet():
        raise Misfit("the Ethernet core is made by LiteEth, which is not set up: make litex")
    words = [interface, family, str(clk_hz), *map(str, delays_ns)]
    name = build.digest(list(SOURCES), *words)

    def make(folder: Path) -> None:
        file = folder / f"{NAME}.v"
        done = subprocess.run(
            [sys.executable, "-m", "boards.ethernet_core", *words, file],
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(FOLDER), *sys.path])},
            cwd=folder,
            capture_output=True,
            text=True,
        )
        if done.returncode:
            raise Misfit(f"LiteEth has not made the Ethernet core: {done.stderr[-1000:]}")
        file.write_text(FOREIGN_STYLE + file.read_text(encoding="utf-8"), encoding="utf-8")

    folder = ROOT / "build" / "ethernet" / f"{interface}-{family}-{name}"
    return build.made_once(folder, f"{NAME}.v", make)
