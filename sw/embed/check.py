# SPDX-License-Identifier: Apache-2.0
"""Whether the blocks can be used by others: lints, builds and simulates the examples and the LiteX
SoC. embed.fusesoc does the same for the FuseSoC cores.

    python -m embed.check [EXAMPLE …]        of these or of all, with the SoC; names what failed
"""

import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from embed import design
from embed.examples import axi_lite_encoder
from embed.litex_parts import FOLDER as LITEX
from embed.litex_parts import NAME as SOC
from figures import synthesis
from figures.synthesis import SynthesisError
from twin.build import ROOT, package

BUILD = ROOT / "build" / "embed"
SMALL, LARGE = "ice40", "ecp5"


@dataclass(frozen=True)
class Example:
    """A design of docs/embedding.md."""

    name: str  # its top module, and its test tb/embed/test_NAME.py
    family: str  # of the FPGAs that it is synthesised for
    make: Callable[[], Path]  # gives its source
    blocks: tuple[str, ...]  # modules that it needs


def of_amaranth() -> Path:
    """The Verilog of the example in Amaranth."""
    path = BUILD / f"{axi_lite_encoder.NAME}.sv"
    axi_lite_encoder.write_verilog(path)
    return path


def sources(example: Example) -> list[Path]:
    """The files of an example, its top last."""
    top = example.make()
    return [*(path for path in design.files(*example.blocks) if path != top), top]


def in_verilog(name: str, family: str) -> Example:
    return Example(name, family, lambda: design.file_of(name), (name,))


EXAMPLES = {
    example.name: example
    for example in (
        in_verilog("position_counter", SMALL),
        in_verilog("axis_on_wishbone", LARGE),
        Example(
            axi_lite_encoder.NAME,
            SMALL,
            of_amaranth,
            axi_lite_encoder.BLOCKS,
        ),
    )
}


def failed(step: str, command: Sequence[object]) -> list[str]:
    """Run a command: a line with its last words if it fails."""
    done = subprocess.run(
        [str(word) for word in command],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    said = (done.stdout + done.stderr).strip().splitlines()
    reasons = [line for line in said if line.startswith("%")][:3] or said[-3:]  # of Verilator
    return [f"{step}: {' | '.join(reasons) or 'failed'}"] if done.returncode else []


def lint(name: str, files: Sequence[Path]) -> list[str]:
    """Verilator's lint of a design, whose top is the last file."""
    verilator = package("verilator", "it lints")
    flags = ["--lint-only", "--quiet", "--timescale", "1ns/1ps", "-Wall"]
    waivers = ROOT / "rtl" / "cpu" / "cores.vlt"
    return failed(
        f"lint of {name}",
        [
            *("env", f"VERILATOR_ROOT={verilator}", verilator / "bin" / "verilator_bin"),
            *(*flags, "--top-module", name, waivers, *files),
        ],
    )


def synthesised(name: str, source: Path, family: str) -> list[str]:
    """Yosys's synthesis of a design."""
    try:
        synthesis.netlist_of(source, {}, family, 1)
    except SynthesisError as why:
        return [f"synthesis of {name} for {family}: {why}"]
    return []


def simulated(test: str) -> list[str]:
    """The cocotb tests of a design; a test that is skipped counts as failed."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-rs"]
    file = ROOT / "tb" / "embed" / f"test_{test}.py"
    done = subprocess.run(
        [*command, file], cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True, text=True
    )
    if done.returncode or " skipped" in done.stdout:
        lines = done.stdout.strip().splitlines()
        return [f"simulation of {test}: {' | '.join(lines[-3:])}"]
    return []


def wrong_example(example: Example, build: bool = True, simulate: bool = True) -> list[str]:
    """What fails of an example: its lint, and if asked for its synthesis and its simulation."""
    files = sources(example)
    return [
        *lint(example.name, files),
        *(synthesised(example.name, files[-1], example.family) if build else []),
        *(simulated(example.name) if simulate else []),
    ]


def wrong_soc() -> list[str]:
    """What fails of the LiteX SoC, which is fetched first. Its simulation writes its Verilog."""
    found = failed("LiteX", ["make", LITEX.relative_to(ROOT) / "stamp"]) or simulated("litex")
    if found:
        return found
    top = ROOT / "build" / "benches" / f"{SOC}.sv"
    return lint(SOC, [*design.files("axis_on_wishbone", "node"), top])


def main() -> int:
    names = sys.argv[1:]
    unknown = [name for name in names if name not in EXAMPLES]
    if unknown:
        known = ", ".join(EXAMPLES)
        print(f"embed: there is no example {unknown[0]}; there are {known}", file=sys.stderr)
        return 2
    found = [why for name in names or EXAMPLES for why in wrong_example(EXAMPLES[name])]
    found += [] if names else wrong_soc()
    for line in found:
        print(line)
    print(f"embed: {len(names or EXAMPLES)} examples, {len(found)} failures")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
