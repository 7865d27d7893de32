# SPDX-License-Identifier: Apache-2.0
"""The netlist of a block that contains many mutants of it, of which a register selects one.

Yosys makes the mutants (its pass `mutate`): an input or output bit of a cell is inverted, inverted
as long as another bit is 0 or 1, or tied to 0 or 1. Cells are those of the RTL, such as an adder or
a multiplexer, since nothing is mapped. Blocks inside the block are as in the RTL, without mutants.
The register `mutant` in the netlist has the number of the mutant, or 0 for the block as it is.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from twin import build, netlist
from twin.build import ROOT

BUILD = ROOT / "build" / "mutation"
SELECTOR = "mutant"
NETLIST, MUTATED, LIST = "netlist.v", "mutated.il", "mutants.ys"
ELABORATED = "elaborated.il"
Fault = tuple[str, str, str, str]  # source, kind of cell, port, mode of MODES
MODES = {
    "inv": "inverted",
    "const0": "tied to 0",
    "const1": "tied to 1",
    "cnot0": "inverted while bit {control} is 0",
    "cnot1": "inverted while bit {control} is 1",
}


class MutationError(Exception):
    """One line that says why there are no mutants."""


@dataclass(frozen=True)
class CellMutant:
    """One fault in a cell of a block."""

    number: int  # that selects it
    mode: str  # of MODES
    cell: str  # as Yosys calls it, with a number of this build
    port: str  # of the cell
    bit: int  # of the port
    control: int  # the bit of the port that decides, in some modes
    wire: str  # at the port, if it has a name in the source
    source: str  # file:line.column-line.column, "" if Yosys does not know it

    @property
    def kind(self) -> str:
        """What kind of cell it is, such as add or procmux; the name of an instance."""
        return self.cell.lstrip("$").split("$")[0]

    @property
    def name(self) -> str:
        """Its name in the line of the source."""
        what = MODES[self.mode].format(control=self.control)
        wire = f" ({self.wire})" if self.wire else ""
        return f"{self.kind}.{self.port} bit {self.bit}{wire} {what}"

    @property
    def place(self) -> str:
        """Where it is, as an editor wants it."""
        return self.source.partition(".sv:")[0] + ".sv:" + self.line if self.source else "?"

    @property
    def line(self) -> str:
        """Number of its line."""
        return self.source.rpartition(".sv:")[2].partition(".")[0]

    @property
    def text(self) -> str:
        """The line of the source."""
        if not self.source:
            return ""
        lines = (ROOT / self.place.partition(":")[0]).read_text().splitlines()
        return lines[int(self.line) - 1].strip()

    @property
    def fault(self) -> Fault:
        """What it has in common with the mutants of other bits, also in other builds."""
        return self.source, self.kind, self.port, self.mode


def build_words(parameters: netlist.Parameters) -> str:
    """The parameters of a build in one line."""
    return " ".join(f"{name}={Path(str(value)).name}" for name, value in parameters.items())


def label(block: str, build: str, mutant: CellMutant) -> str:
    """The place and the name of a mutant of a block; build: its parameters in words."""
    return f"{mutant.place}: {block}{' ' if build else ''}{build}: {mutant.name}"


def words_of(line: str) -> dict[str, list[str]]:
    """{option: its values} of a line of Yosys's list."""
    found: dict[str, list[str]] = {}
    for part in line.split(" -")[1:]:
        option, _, value = part.partition(" ")
        found.setdefault(option, []).append(value)
    return found


def mutant_of(line: str) -> CellMutant:
    """The mutant of a line of Yosys's list. A flip-flop is where its wire is declared, any other
    cell where it is used.
    """
    words = words_of(line)
    sources = words.get("src", [""])
    place = sources[0 if words["cell"][0].startswith("$procdff") else -1]
    found = place.partition("|")[0].removeprefix(f"{ROOT}/")
    return CellMutant(
        int(words["ctrl"][0].split()[-1]),
        words["mode"][0],
        words["cell"][0].lstrip("\\"),
        words["port"][0].lstrip("\\"),
        int(words.get("portbit", ["0"])[0]),
        int(words.get("ctrlbit", ["0"])[0]),
        words.get("wire", [""])[0].lstrip("\\"),
        found if ".sv:" in found else "",
    )


def mutants_of(folder: Path) -> list[CellMutant]:
    """The mutants of a netlist, by number. Those of a clock are left out: a block has one clock,
    and the wiring of clocks is tested elsewhere.
    """
    found = [mutant_of(line) for line in (folder / LIST).read_text().splitlines()]
    return [mutant for mutant in found if not mutant.port.endswith("CLK")]


def yosys(passes: Sequence[str], log: Path) -> None:
    """Run these passes; what Yosys prints goes to a file."""
    if wrong := netlist.yosys(passes, log):
        raise MutationError(wrong)


def with_parameters(text: str, top: str, values: dict[str, str]) -> str:
    """The netlist with the block's parameters, which Yosys has evaluated, for tests that read them;
    and with a register as its selector, which nothing in the netlist drives.
    """
    lines = "".join(f"  parameter {name} = {value};\n" for name, value in values.items())
    text = re.sub(rf"^(module {top}\(.*?\);\n)", rf"\1{lines}", text, flags=re.M | re.S)
    return re.sub(rf"^  wire (\[\d+:0\] {SELECTOR};)", r"  reg \1", text, flags=re.M)


def lists_of(
    folder: Path, top: str, count: int, seed: int, faults: Sequence[Fault]
) -> dict[Path, str]:
    """{file of a list of mutants: the pass that makes it}: so many of the block, or of each of
    these faults.
    """
    options = f"-list {count} -seed {seed}"
    if not faults:
        return {folder / "list": f"mutate {options} -o {folder}/list {top}"}
    return {
        folder / f"list-{n}": f"mutate {options} -mode {mode} -port {port} -src {ROOT}/{source} "
        f"-o {folder}/list-{n} {top}"
        for n, (source, _, port, mode) in enumerate(faults)
    }


def prepared(
    source: Path,
    values: netlist.Parameters,
    folders: Sequence[Path],
    count: int,
    seed: int,
    faults: Sequence[Fault] = (),
) -> Path:
    """The folder of the netlist of a block with so many mutants, made once; or with so many of each
    of these faults.
    """
    top = source.stem

    def make(folder: Path) -> None:
        lists = lists_of(folder, top, count, seed, faults)
        passes = [
            *netlist.elaboration(source, values, folders),
            f"prep -top {top}; write_json {folder}/interface.json",
            "opt_expr -mux_undef; opt_clean",  # a word that is not written has an address too
            f"write_rtlil {folder}/{ELABORATED}",
            *lists.values(),
        ]
        yosys(passes, folder / "elaborated.log")
        lines = [line for file in lists for line in file.read_text().splitlines()]
        bits = len(lines).bit_length()
        numbered = [
            line.replace("mutate ", f"mutate -ctrl {SELECTOR} {bits} {n} ", 1)
            for n, line in enumerate(lines, 1)
        ]
        (folder / LIST).write_text("".join(f"{line}\n" for line in numbered))
        passes = [
            f"read_rtlil {folder}/{ELABORATED}",
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
    name = build.digest(files, sorted(values.items()), count, seed, sorted(faults))
    return build.made_once(BUILD / f"{top}-mutants-{name}", NETLIST, make).parent


@dataclass(frozen=True)
class Run:
    """One simulation of a build with some of its mutants. The tests leave its verdicts beside it,
    in a file of lines `number test`, without a test for a survivor.
    """

    folder: str  # of the netlist
    parameters: dict[str, int | str]
    numbers: list[int]  # of the mutants

    def write(self, path: Path) -> None:
        """Leave it for the campaign."""
        path.write_text(json.dumps(vars(self)))

    @classmethod
    def all(cls, folder: Path) -> list[tuple["Run", dict[int, str]]]:
        """The runs in a folder, each with its verdicts so far: {number: test, "" for a survivor}"""
        found = []
        for path in sorted(folder.glob("*.json")):
            verdicts = path.with_suffix(".verdicts")
            lines = verdicts.read_text().splitlines() if verdicts.exists() else []
            pairs = (line.partition(" ") for line in lines)
            run = cls(**json.loads(path.read_text()))
            found.append((run, {int(number): test for number, _, test in pairs}))
        return found

    @classmethod
    def found(cls, folder: Path, build: Path) -> set[int]:
        """The mutants of a build that tests have found."""
        runs = [verdicts for run, verdicts in cls.all(folder) if run.folder == str(build)]
        return {number for verdicts in runs for number, test in verdicts.items() if test}
