# SPDX-License-Identifier: Apache-2.0
"""The netlist of a block that contains many mutants of it, of which a register selects one.

Yosys makes the mutants (its pass `mutate`): an input or output bit of a cell is inverted, inverted
as long as another bit is 0 or 1, or tied to 0 or 1. Cells are those of the RTL, such as an adder or
a multiplexer, since nothing is mapped. Blocks inside the block are as in the RTL, without mutants.
The register `mutant` in the netlist has the number of the mutant, or 0 for the block as it is.
"""

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from twin import build, netlist
from twin.build import ROOT

BUILD = ROOT / "build" / "mutation"
SELECTOR = "mutant"
NETLIST, MUTATED, LIST = "netlist.v", "mutated.il", "mutants.ys"
MODES = {
    "inv": "inverted",
    "const0": "tied to 0",
    "const1": "tied to 1",
    "cnot0": "inverted while bit {ctrlbit} is 0",
    "cnot1": "inverted while bit {ctrlbit} is 1",
}


class MutationError(Exception):
    """One line that says why there are no mutants."""


@dataclass(frozen=True)
class CellMutant:
    """One fault in a cell of a block."""

    number: int  # that selects it
    module: str
    mode: str  # of MODES
    cell: str  # as Yosys calls it, with a number of this build
    port: str  # of the cell
    bit: int  # of the port
    control: int  # the bit that decides, in some modes
    place: str  # file:line, the file as it is named in a search by name

    @property
    def kind(self) -> str:
        """What kind of cell it is, such as add or mux."""
        return self.cell.lstrip("$\\").split("$")[0]

    @property
    def name(self) -> str:
        """Its name in lists and in the table of reasons."""
        what = MODES[self.mode].format(ctrlbit=self.control)
        return f"{self.place}: {self.kind}.{self.port}[{self.bit}] {what}"


def words_of(line: str) -> dict[str, list[str]]:
    """{option: its values} of a line of Yosys's list."""
    found: dict[str, list[str]] = {}
    for option, values in re.findall(r"-(\w+) ((?:(?!-[a-z]+ )\S+ ?)+)", line):
        found.setdefault(option, []).append(values.strip())
    return found


def mutant_of(line: str) -> CellMutant:
    """The mutant of a line of Yosys's list. Its place is the last and so the smallest source of
    the cell that Yosys names.
    """
    words = words_of(line)
    place = re.sub(r"\.\d+-.*", "", words["src"][-1].split("|")[0]) if "src" in words else "?"
    return CellMutant(
        int(words["ctrl"][0].split()[-1]),
        *(words[key][0].lstrip("\\") for key in ("module", "mode", "cell", "port")),
        int(words.get("portbit", ["0"])[0]),
        int(words.get("ctrlbit", ["0"])[0]),
        place.removeprefix(f"{ROOT}/"),
    )


def mutants_of(folder: Path) -> list[CellMutant]:
    """The mutants of a netlist, by number."""
    lines = (folder / LIST).read_text().splitlines()
    return [mutant_of(line) for line in lines if line.startswith("mutate")]


def yosys(passes: Sequence[str], log: Path) -> None:
    """Run these passes; what Yosys prints goes to a file."""
    command = [sys.executable, str(ROOT / "tools" / "yosys.py"), "; ".join(passes)]
    with open(log, "w") as out:
        done = subprocess.run(command, cwd=ROOT, stdout=out, stderr=subprocess.STDOUT)
    if done.returncode:
        lines = log.read_text().splitlines()
        errors = [line for line in lines if "ERROR" in line] or lines[-1:]
        raise MutationError(errors[-1] if errors else f"Yosys ended with {done.returncode}")


def with_parameters(text: str, top: str, values: dict[str, str]) -> str:
    """The netlist with the block's parameters, which Yosys has evaluated, for tests that read them;
    and with a register as its selector, which nothing in the netlist drives.
    """
    lines = "".join(f"  parameter {name} = {value};\n" for name, value in values.items())
    text = re.sub(rf"^(module {top}\(.*?\);\n)", rf"\1{lines}", text, flags=re.M | re.S)
    return re.sub(rf"^  wire (\[\d+:0\] {SELECTOR};)", r"  reg \1", text, flags=re.M)


def prepared(
    source: Path, values: netlist.Parameters, folders: Sequence[Path], count: int, seed: int
) -> Path:
    """The folder of the netlist of a block with so many mutants, made once."""
    top, bits = source.stem, count.bit_length()
    change = "".join(f" -set {name} {netlist.literal(value)}" for name, value in values.items())

    def make(folder: Path) -> None:
        passes = [
            f"read_verilog -sv {source}",
            f"chparam{change} {top}" if change else "",
            f"hierarchy -check -top {top} {' '.join(f'-libdir {d}' for d in folders)}",
            f"prep -top {top}; write_json {folder}/interface.json",
            f"mutate -list {count} -seed {seed} -ctrl {SELECTOR} {bits} 1 -o {folder}/{LIST} {top}",
            f"script {folder}/{LIST}; write_rtlil {folder}/{MUTATED}",
            f"delete -input {top}/{SELECTOR}; write_verilog -noattr {folder}/{NETLIST}",
        ]
        yosys(passes, folder / "yosys.log")
        module = json.loads((folder / "interface.json").read_text())["modules"][top]
        defaults = module.get("parameter_default_values", {})
        known = {name: netlist.value_of(bits) for name, bits in defaults.items()}
        file = folder / NETLIST
        file.write_text(with_parameters(file.read_text(), top, known))

    files = [*netlist.parts(source, folders), Path(__file__), Path(netlist.__file__)]
    files += [ROOT / v for v in values.values() if isinstance(v, str) and (ROOT / v).is_file()]
    name = build.digest(files, sorted(values.items()), count, seed)
    return build.made_once(BUILD / f"{top}-mutants-{name}", NETLIST, make).parent
